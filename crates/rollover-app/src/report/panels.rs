//! Charts for a column of a paper: panels below one another over a common axis, large letters, the
//! legend above, where it hides nothing.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

use super::chart::{Backend, DrawResult, FONT, Field, GRID, INK, Series, draw_series, tick};

/// Width of a figure, px: a letter of 15 px is 7 pt high in a column of 88 mm.
pub(super) const WIDTH: u32 = 560;
const LETTERS: i32 = 15;
/// Mean width of a letter, px, generous.
const LETTER_WIDTH: f64 = 7.8;
const LEGEND_ROW: u32 = 24;
const MARGIN: u32 = 8;
const X_AREA: u32 = 42;
const Y_AREA: u32 = 66;
/// What a panel has beside its plot, px.
pub(super) const FRAME: (u32, u32) = (Y_AREA + 2 * MARGIN, X_AREA + 2 * MARGIN);

/// One of the panels.
pub(super) struct Panel<'a> {
    pub(super) y_label: String,
    pub(super) y: (f64, f64),
    pub(super) series: Vec<Series<'a>>,
    /// Fields filled with grey under the lines.
    pub(super) fields: Vec<Field>,
    /// Height of the plot alone, px.
    pub(super) height: u32,
}

/// Draws panels over a common horizontal axis and returns the SVG. The legend has the named series of
/// the first.
pub(super) fn panels(x: (f64, f64), x_label: &str, panels: &[Panel<'_>]) -> Result<String> {
    let rows = legend_rows(panels.first().map_or(&[][..], |p| &p.series));
    let legend = LEGEND_ROW * u32::try_from(rows.len())?;
    let heights: Vec<u32> = panels.iter().map(|p| p.height + 2 * MARGIN).collect();
    let height = legend + heights.iter().sum::<u32>() + X_AREA;
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        let drawn = area.fill(&WHITE).and_then(|()| {
            let (top, mut rest) = area.split_vertically(legend);
            draw_legend(&top, &rows)?;
            for (index, (panel, height)) in panels.iter().zip(&heights).enumerate() {
                let last = index + 1 == panels.len();
                let (own, below) = rest.split_vertically(height + if last { X_AREA } else { 0 });
                draw_panel(&own, x, last.then_some(x_label), panel)?;
                rest = below;
            }
            area.present()
        });
        drawn.map_err(|e| anyhow!("cannot draw a figure: {e}"))?;
    }
    Ok(svg)
}

/// Entries of the legend with their left ends, a row after the other.
fn legend_rows<'a, 'b>(series: &'b [Series<'a>]) -> Vec<Vec<(f64, &'b Series<'a>)>> {
    let mut rows: Vec<Vec<(f64, &Series<'_>)>> = Vec::new();
    let mut x = f64::INFINITY;
    for line in series.iter().filter(|line| !line.name.is_empty()) {
        let width = 40.0 + LETTER_WIDTH * line.name.chars().count() as f64;
        if x + width > f64::from(WIDTH) {
            rows.push(Vec::new());
            x = 24.0;
        }
        if let Some(row) = rows.last_mut() {
            row.push((x, line));
        }
        x += width;
    }
    rows
}

fn draw_legend(
    area: &DrawingArea<Backend<'_>, Shift>,
    rows: &[Vec<(f64, &Series<'_>)>],
) -> DrawResult {
    use plotters::style::text_anchor::{HPos, Pos, VPos};
    let letters = (FONT, LETTERS).into_font().color(&INK);
    let letters = letters.pos(Pos::new(HPos::Left, VPos::Center));
    let mut y = 14;
    for row in rows {
        for (x, line) in row {
            #[expect(clippy::cast_possible_truncation, reason = "within the figure")]
            let x = *x as i32;
            let style = line.style.color.stroke_width(3);
            // A whole line has a dash longer than itself.
            let [on, off] = if line.dash == [0, 0] {
                [40, 1]
            } else {
                line.dash.map(i32::from)
            };
            area.draw(&DashedPathElement::new(
                [(x, y), (x + 24, y)],
                on,
                off,
                style,
            ))?;
            area.draw(&Text::new(
                line.name.to_owned(),
                (x + 30, y),
                letters.clone(),
            ))?;
        }
        y += 24;
    }
    Ok(())
}

fn draw_panel(
    area: &DrawingArea<Backend<'_>, Shift>,
    x: (f64, f64),
    x_label: Option<&str>,
    panel: &Panel<'_>,
) -> DrawResult {
    let mut chart = ChartBuilder::on(area)
        .margin(MARGIN)
        .x_label_area_size(if x_label.is_some() { X_AREA } else { 0 })
        .y_label_area_size(Y_AREA)
        .build_cartesian_2d(x.0..x.1, panel.y.0..panel.y.1)?;
    chart
        .configure_mesh()
        .x_labels(8)
        .y_labels(5)
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .x_desc(x_label.unwrap_or_default())
        .y_desc(&panel.y_label)
        .label_style((FONT, LETTERS).into_font().color(&INK))
        .axis_desc_style((FONT, LETTERS).into_font().color(&INK))
        .axis_style(INK.stroke_width(1))
        .bold_line_style(GRID)
        .light_line_style(TRANSPARENT)
        .draw()?;
    chart.draw_series(panel.fields.iter().map(|field| {
        let grey = RGBColor(field.grey, field.grey, field.grey);
        Rectangle::new([field.low, field.high], grey.filled())
    }))?;
    for line in &panel.series {
        draw_series(&mut chart, line)?;
    }
    Ok(())
}
