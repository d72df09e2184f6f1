//! Panels of lines over a common horizontal axis, as SVG text.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;

/// A line: its name, whether it is the reference, and its points.
pub struct Line {
    pub name: String,
    pub reference: bool,
    pub points: Vec<(f64, f64)>,
}

/// A panel: what its vertical axis shows, its lines, and points marked by circles.
pub struct Panel {
    pub axis: String,
    pub lines: Vec<Line>,
    pub marks: Vec<(f64, f64)>,
}

const REFERENCE: RGBColor = RGBColor(45, 49, 54);
/// Colour-blind safe (Okabe and Ito).
const OURS: [RGBColor; 5] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(170, 68, 153),
    RGBColor(230, 159, 0),
];
const INK: RGBColor = RGBColor(45, 49, 54);
const GRID: RGBColor = RGBColor(226, 229, 233);
const FONT: &str = "Helvetica, Arial, sans-serif";
const WIDTH: u32 = 900;
const PANEL_HEIGHT: u32 = 210;

/// Draws the panels below each other.
pub fn panels(title: &str, x_axis: &str, logarithmic: bool, panels: &[Panel]) -> Result<String> {
    let mut svg = String::new();
    {
        let count = u32::try_from(panels.len()).unwrap_or(1);
        let size = (WIDTH, 40 + PANEL_HEIGHT * count);
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let failed = |error: &dyn std::fmt::Display| anyhow!("cannot draw `{title}`: {error}");
        area.fill(&WHITE).map_err(|error| failed(&error))?;
        let titled = area
            .titled(title, (FONT, 17).into_font().color(&INK))
            .map_err(|error| failed(&error))?;
        for (index, (panel, part)) in panels
            .iter()
            .zip(titled.split_evenly((panels.len(), 1)))
            .enumerate()
        {
            let last = index + 1 == panels.len();
            let label = if last { x_axis } else { "" };
            draw(&part, panel, label, logarithmic, index == 0).map_err(|error| failed(&error))?;
        }
        area.present().map_err(|error| failed(&error))?;
    }
    Ok(svg)
}

fn bounds(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    if low < high {
        let margin = 0.06 * (high - low);
        (low - margin, high + margin)
    } else if low.is_finite() {
        (low - 1.0, low + 1.0)
    } else {
        (0.0, 1.0)
    }
}

/// The corner with the fewest points, so that the legend hides least.
fn emptiest_corner(
    points: &[(f64, f64)],
    (left, right): (f64, f64),
    (bottom, top): (f64, f64),
) -> SeriesLabelPosition {
    // Shares of the panel that a legend takes.
    const WIDTH_SHARE: f64 = 0.25;
    const HEIGHT_SHARE: f64 = 0.6;
    let hidden = |at_right: bool, at_top: bool| {
        let inside = |&&(x, y): &&(f64, f64)| {
            let (across, up) = ((x - left) / (right - left), (y - bottom) / (top - bottom));
            let across = if at_right { 1.0 - across } else { across };
            let up = if at_top { 1.0 - up } else { up };
            across < WIDTH_SHARE && up < HEIGHT_SHARE
        };
        points.iter().filter(inside).count()
    };
    [
        (hidden(true, true), SeriesLabelPosition::UpperRight),
        (hidden(false, true), SeriesLabelPosition::UpperLeft),
        (hidden(true, false), SeriesLabelPosition::LowerRight),
        (hidden(false, false), SeriesLabelPosition::LowerLeft),
    ]
    .into_iter()
    .min_by_key(|corner| corner.0)
    .map_or(SeriesLabelPosition::UpperRight, |corner| corner.1)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

fn draw(
    area: &Area<'_>,
    panel: &Panel,
    x_axis: &str,
    logarithmic: bool,
    legend: bool,
) -> Result<()> {
    // A logarithmic axis is drawn over the exponents.
    let across = |x: f64| if logarithmic { x.log10() } else { x };
    let all = || panel.lines.iter().flat_map(|line| line.points.iter());
    let (left, right) = bounds(all().map(|(x, _)| across(*x)));
    let (bottom, top) = bounds(all().map(|(_, y)| *y));
    let drawn: Vec<(f64, f64)> = all().map(|&(x, y)| (across(x), y)).collect();
    let corner = emptiest_corner(&drawn, (left, right), (bottom, top));
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(18)
        .x_label_area_size(34)
        .y_label_area_size(76)
        .build_cartesian_2d(left..right, bottom..top)
        .map_err(|error| anyhow!("{error}"))?;
    let exponent = |x: &f64| format!("{:.2}", 10_f64.powf(*x));
    let plain = |x: &f64| format!("{}", (x * 1e3).round() / 1e3);
    chart
        .configure_mesh()
        .x_desc(x_axis)
        .y_desc(&panel.axis)
        .x_label_formatter(if logarithmic { &exponent } else { &plain })
        .y_label_formatter(&|y| format!("{}", (y * 1e4).round() / 1e4))
        .y_labels(6)
        .label_style((FONT, 12).into_font().color(&INK))
        .axis_desc_style((FONT, 13).into_font().color(&INK))
        .axis_style(INK.stroke_width(1))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(|error| anyhow!("{error}"))?;
    let mut colour = 0;
    let mut named = false;
    for line in &panel.lines {
        let style = if line.reference {
            REFERENCE.stroke_width(1)
        } else {
            colour += 1;
            OURS[(colour - 1) % OURS.len()].stroke_width(2)
        };
        let points = line.points.iter().map(|&(x, y)| (across(x), y));
        let points: Vec<_> = points.filter(|(_, y)| y.is_finite()).collect();
        let series = if line.reference {
            chart.draw_series(DashedLineSeries::new(points, 9, 6, style))
        } else {
            chart.draw_series(LineSeries::new(points, style))
        };
        let series = series.map_err(|error| anyhow!("{error}"))?;
        // All references look alike, so one of them is named.
        if !(line.reference && std::mem::replace(&mut named, true)) {
            series
                .label(line.name.clone())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
        }
    }
    let circles = panel.marks.iter().map(|&(x, y)| {
        let place = (across(x), y);
        Circle::new(place, 5, INK.stroke_width(2))
    });
    chart
        .draw_series(circles)
        .map_err(|error| anyhow!("{error}"))?;
    if legend {
        chart
            .configure_series_labels()
            .position(corner)
            .label_font((FONT, 12).into_font().color(&INK))
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .draw()
            .map_err(|error| anyhow!("{error}"))?;
    }
    Ok(())
}
