//! Charts with logarithmic axes, as SVG text.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::combinators::{BindKeyPoints, LogCoord};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// A bar: its name, its length and the text behind it.
pub struct Bar {
    pub name: String,
    pub value: f64,
    pub text: String,
    /// Which colour.
    pub group: usize,
}

/// A line with marks.
pub struct Line {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

/// Colour-blind safe hues (Okabe and Ito).
const PALETTE: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(170, 68, 153),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
const INK: RGBColor = RGBColor(45, 49, 54);
const GRID: RGBColor = RGBColor(226, 229, 233);
const FONT: &str = "Helvetica, Arial, sans-serif";
const WIDTH: u32 = 860;
/// Height of a bar with its gap, in pixels.
const BAR_HEIGHT: u32 = 30;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<<SVGBackend<'static> as DrawingBackend>::ErrorType>>;

fn colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

fn draw(title: &str, height: u32, work: impl FnOnce(&Area<'_>) -> Drawn) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        let drawn = area
            .fill(&WHITE)
            .and_then(|()| work(&area))
            .and_then(|()| area.present());
        drawn.map_err(|error| anyhow!("cannot draw `{title}`: {error}"))?;
    }
    Ok(svg)
}

/// Whole powers of ten around the values.
fn decades(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|value| *value > 0.0 && value.is_finite())
        .fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
            (low.min(v), high.max(v))
        });
    if low > high {
        return (1.0, 10.0);
    }
    // A value just at a power of ten still gets a bar.
    (
        10_f64.powf((low * 0.8).log10().floor()),
        10_f64.powf(high.log10().ceil().max(-300.0)),
    )
}

/// Horizontal bars from the top down over a logarithmic axis, whose numbers `tick` writes.
pub fn bars(title: &str, axis: &str, tick: fn(f64) -> String, bars: &[Bar]) -> Result<String> {
    let count = bars.len() as f64;
    let (low, high) = decades(bars.iter().map(|bar| bar.value));
    // Room for the text behind the longest bar.
    let end = high * (high / low).powf(0.1);
    let height = 100 + BAR_HEIGHT * u32::try_from(bars.len()).unwrap_or(1);
    draw(title, height, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(14)
            .caption(title, (FONT, 18).into_font().color(&INK))
            .x_label_area_size(44)
            .y_label_area_size(210)
            .build_cartesian_2d((low..end).log_scale(), 0.0..count)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(0)
            .x_desc(axis)
            .x_label_formatter(&|value| tick(*value))
            .label_style((FONT, 13).into_font().color(&INK))
            .axis_desc_style((FONT, 14).into_font().color(&INK))
            .axis_style(INK.stroke_width(1))
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .draw()?;
        let label = (FONT, 13).into_font().color(&INK);
        for (index, bar) in bars.iter().enumerate() {
            let top = count - index as f64;
            let style = colour(bar.group).filled();
            let corners = [(low, top - 0.15), (bar.value.max(low), top - 0.85)];
            chart.draw_series(std::iter::once(Rectangle::new(corners, style)))?;
            let middle = |value: f64| chart.plotting_area().map_coordinate(&(value, top - 0.5));
            let (left, right) = (middle(low), middle(bar.value.max(low)));
            let name = label.clone().pos(Pos::new(HPos::Right, VPos::Center));
            let text = label.clone().pos(Pos::new(HPos::Left, VPos::Center));
            area.draw(&Text::new(bar.name.clone(), (left.0 - 8, left.1), name))?;
            area.draw(&Text::new(bar.text.clone(), (right.0 + 6, right.1), text))?;
        }
        Ok(())
    })
}

/// Lines over two logarithmic axes.
pub fn lines(title: &str, [x_axis, y_axis]: [&str; 2], lines: &[Line]) -> Result<String> {
    let all = || lines.iter().flat_map(|line| line.points.iter().copied());
    let (x_low, x_high) = all().fold((f64::INFINITY, 0.0_f64), |(low, high), (x, _)| {
        (low.min(x), high.max(x))
    });
    let y = decades(all().map(|(_, y)| y));
    // A tick at every size measured and nowhere else.
    let mut ticks: Vec<f64> = all().map(|(x, _)| x).collect();
    ticks.sort_by(f64::total_cmp);
    ticks.dedup();
    let x_range: LogCoord<f64> = (x_low * 0.9..x_high * 1.1).log_scale().into();
    let x_axis_range = x_range.with_key_points(ticks);
    draw(title, 420, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(14)
            .caption(title, (FONT, 18).into_font().color(&INK))
            .x_label_area_size(44)
            .y_label_area_size(76)
            .build_cartesian_2d(x_axis_range, (y.0..y.1).log_scale())?;
        chart
            .configure_mesh()
            .x_desc(x_axis)
            .y_desc(y_axis)
            .x_label_formatter(&|value| format!("{}", value.round()))
            .y_label_formatter(&|value| format!("{value}"))
            .label_style((FONT, 13).into_font().color(&INK))
            .axis_desc_style((FONT, 14).into_font().color(&INK))
            .axis_style(INK.stroke_width(1))
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .draw()?;
        for (index, line) in lines.iter().enumerate() {
            let style = colour(index).stroke_width(2);
            chart
                .draw_series(LineSeries::new(line.points.iter().copied(), style))?
                .label(line.name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
            let marks = line
                .points
                .iter()
                .map(|&at| Circle::new(at, 4, colour(index).filled()));
            chart.draw_series(marks)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .label_font((FONT, 13).into_font().color(&INK))
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .draw()
    })
}
