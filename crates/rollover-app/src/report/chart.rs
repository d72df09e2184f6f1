//! Charts as SVG text.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

/// One line of a chart.
pub(crate) struct Series<'a> {
    /// Name in the legend; an empty one keeps the line out of the legend.
    pub(crate) name: &'a str,
    pub(crate) style: ShapeStyle,
    pub(crate) points: Vec<(f64, f64)>,
    /// Whether a cross marks the last point: the run ended early.
    pub(crate) cross: bool,
    /// Lengths of line and gap, px; 0 for a whole line.
    pub(crate) dash: [u8; 2],
}

/// What the axes show.
pub(crate) struct Axes<'a> {
    pub(crate) title: &'a str,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    pub(crate) x: (f64, f64),
    pub(crate) y: (f64, f64),
    /// Fields filled with grey under the lines.
    pub(crate) fields: Vec<Field>,
}

/// A rectangle and its grey, 0 to 255.
pub(crate) struct Field {
    pub(crate) low: (f64, f64),
    pub(crate) high: (f64, f64),
    pub(crate) grey: u8,
}

/// Colour-blind safe hues (Okabe and Ito), dark enough on white.
const PALETTE: [RGBColor; 6] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(170, 68, 153),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
pub(crate) const INK: RGBColor = RGBColor(45, 49, 54);
pub(crate) const GRID: RGBColor = RGBColor(226, 229, 233);
/// Half the size of the mark where a run ended early, in pixels.
const CROSS_SIZE: i32 = 6;
pub(crate) const FONT: &str = "Helvetica, Arial, sans-serif";

/// Colour of the `index`-th run of a figure.
pub(crate) fn run_colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// Thin grey line for limits and edges.
pub(crate) fn limit_style() -> ShapeStyle {
    RGBColor(120, 125, 131).stroke_width(1)
}

/// A tick's number without the zeros that say nothing.
pub(crate) fn tick(value: f64) -> String {
    // Ticks are multiples of a round step; what is left beyond is rounding.
    let rounded = (value * 1e6).round() / 1e6;
    // Adding zero turns −0 into 0.
    (rounded + 0.0).to_string()
}

/// Width of the `index`-th run's line. Earlier runs lie below and are wider, so that runs which
/// coincide are all seen.
pub(crate) fn run_width(index: usize) -> u32 {
    [4, 3, 2, 2].get(index).copied().unwrap_or(1)
}

/// Draws series over common axes and returns the SVG.
pub(crate) fn line_chart(
    size: (u32, u32),
    axes: &Axes<'_>,
    series: &[Series<'_>],
) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw(&area, axes, series).map_err(|e| anyhow!("cannot draw `{}`: {e}", axes.title))?;
    }
    Ok(svg)
}

pub(super) type Backend<'a> = SVGBackend<'a>;
pub(super) type DrawResult =
    Result<(), DrawingAreaErrorKind<<Backend<'static> as DrawingBackend>::ErrorType>>;

fn draw(
    area: &DrawingArea<Backend<'_>, Shift>,
    axes: &Axes<'_>,
    series: &[Series<'_>],
) -> DrawResult {
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(14)
        .caption(axes.title, (FONT, 18).into_font().color(&INK))
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(axes.x.0..axes.x.1, axes.y.0..axes.y.1)?;
    chart
        .configure_mesh()
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .x_desc(axes.x_label)
        .y_desc(axes.y_label)
        .label_style((FONT, 13).into_font().color(&INK))
        .axis_desc_style((FONT, 14).into_font().color(&INK))
        .axis_style(INK.stroke_width(1))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()?;
    chart.draw_series(axes.fields.iter().map(|field| {
        let grey = RGBColor(field.grey, field.grey, field.grey);
        Rectangle::new([field.low, field.high], grey.filled())
    }))?;
    for line in series {
        draw_series(&mut chart, line)?;
    }
    if series.iter().any(|s| !s.name.is_empty()) {
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .label_font((FONT, 13).into_font().color(&INK))
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .draw()?;
    }
    area.present()
}

pub(super) type Chart<'a, 'b> =
    ChartContext<'a, Backend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

pub(super) fn draw_series(chart: &mut Chart<'_, '_>, line: &Series<'_>) -> DrawResult {
    let style = line.style;
    let mut named = line.name;
    // A gap ends a stroke.
    for stroke in line.points.split(|p| !(p.0.is_finite() && p.1.is_finite())) {
        if stroke.is_empty() {
            continue;
        }
        let points = stroke.iter().copied();
        let drawn = if line.dash == [0, 0] {
            chart.draw_series(LineSeries::new(points, style))?
        } else {
            let [on, off] = line.dash.map(i32::from);
            chart.draw_series(DashedLineSeries::new(points, on, off, style))?
        };
        if !named.is_empty() {
            // A dashed line is dashed in the legend, too; a whole one has a dash longer than that.
            let dash = if line.dash == [0, 0] { (40, 1) } else { (7, 4) };
            drawn.label(named).legend(move |(x, y)| {
                let points = [(x, y), (x + 18, y)];
                DashedPathElement::new(points, dash.0, dash.1, style.stroke_width(3))
            });
            named = "";
        }
    }
    if let Some(&end) = line.points.iter().rfind(|p| line.cross && p.1.is_finite()) {
        let mark = Cross::new(end, CROSS_SIZE, line.style.color.stroke_width(3));
        chart.draw_series(std::iter::once(mark))?;
    }
    Ok(())
}
