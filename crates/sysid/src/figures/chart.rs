//! Panels of lines, bands, stems and marks on a sheet, as SVG text.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::Axis;
use super::layers::draw_layer;
use crate::error::SysidError;

/// Colour-blind safe hues (Okabe and Ito 2008), dark enough on white.
const PALETTE: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(170, 68, 153),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];
pub(super) const INK: RGBColor = RGBColor(45, 49, 54);
pub(super) const LIMIT: RGBColor = RGBColor(110, 115, 121);
const GRID: RGBColor = RGBColor(226, 229, 233);
const FONT: &str = "Helvetica, Arial, sans-serif";
/// Width of a sheet in pixels unless its panels need more.
pub(super) const WIDTH: u32 = 900;
/// Units of the drawing per pixel of the sheet: the drawing's places are whole numbers, and lines
/// rounded to pixels look crooked.
pub(super) const FINE: u32 = 8;
const TITLE_HEIGHT: u32 = 38;
const LEGEND_ROW: u32 = 22;
/// Width of a character of the legend on average, and at most of a tick's label.
const CHARACTER: u32 = 7;
const TICK_CHARACTER: u32 = 8;
/// Longest name in a legend or above a panel, in characters.
const LONGEST_NAME: usize = 60;
const LONGEST_TITLE: usize = 90;

pub(super) type Points = Vec<(f64, f64)>;

/// Colour of the `index`-th model of a figure.
pub(super) fn colour(index: usize) -> RGBColor {
    PALETTE[index % PALETTE.len()]
}

/// What is drawn within a panel, in this order.
#[derive(Clone)]
pub(super) enum Layer {
    Line {
        points: Points,
        colour: RGBColor,
        width: u32,
    },
    Dashes {
        points: Points,
        colour: RGBColor,
    },
    /// (x, lower, upper).
    Band {
        points: Vec<(f64, f64, f64)>,
        colour: RGBColor,
    },
    /// Lines from zero with a dot.
    Stems {
        points: Points,
        colour: RGBColor,
    },
    Marks {
        points: Points,
        shape: Shape,
        colour: RGBColor,
    },
}

#[derive(Clone, Copy)]
pub(super) enum Shape {
    Cross,
    Ring,
    Dot,
}

impl Shape {
    /// So that models whose colours repeat are told apart.
    pub fn of(index: usize) -> Self {
        match index / PALETTE.len() % 3 {
            0 => Self::Dot,
            1 => Self::Ring,
            _ => Self::Cross,
        }
    }
}

pub(super) struct Panel {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    pub layers: Vec<Layer>,
}

/// How a legend shows an entry.
#[derive(Clone, Copy)]
pub(super) enum Key {
    Line(RGBColor),
    Dashes(RGBColor),
    Band(RGBColor),
    Mark(Shape, RGBColor),
    MarkedLine(Shape, RGBColor),
}

pub(super) struct Sheet {
    pub title: String,
    /// Whether a unit is as long upwards as it is to the right.
    pub equal_scales: bool,
    pub legend: Vec<(String, Key)>,
    pub columns: usize,
    pub panel_size: (u32, u32),
    pub panels: Vec<Panel>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;
pub(super) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Ticked, Ticked>>;

/// A linear coordinate with its ticks at given places.
pub(super) struct Ticked {
    line: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Ranged for Ticked {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.line.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() {
            Vec::new()
        } else {
            self.ticks.clone()
        }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.line.range()
    }
}

impl Sheet {
    /// The SVG.
    pub fn draw(&self) -> Result<String, SysidError> {
        self.check()?;
        let width = self.panel_size.0 * u32::try_from(self.columns).unwrap_or(1);
        let legend = self.legend_places(width);
        let rows = legend.iter().map(|place| place.1 + 1).max().unwrap_or(0);
        let top = TITLE_HEIGHT + rows * LEGEND_ROW;
        let lines = u32::try_from(self.panels.len().div_ceil(self.columns)).unwrap_or(1);
        let mut svg = String::new();
        {
            let size = (width * FINE, (top + lines * self.panel_size.1) * FINE);
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            self.draw_on(&root, width, top, &legend)
                .map_err(|error| SysidError::Figure {
                    figure: self.title.clone(),
                    problem: error.to_string(),
                })?;
        }
        // The size on the page; the view box stays fine.
        let (fine, page) = (
            [width * FINE, (top + lines * self.panel_size.1) * FINE],
            [width, top + lines * self.panel_size.1],
        );
        let head = |size: [u32; 2]| format!("<svg width=\"{}\" height=\"{}\"", size[0], size[1]);
        Ok(svg.replacen(&head(fine), &head(page), 1))
    }

    fn check(&self) -> Result<(), SysidError> {
        let problem = |problem: &str| {
            Err(SysidError::Figure {
                figure: self.title.clone(),
                problem: problem.to_owned(),
            })
        };
        if self.panels.is_empty() {
            return problem("there is nothing to draw; give at least one curve");
        }
        let finite = |layer: &Layer| match layer {
            Layer::Line { points, .. }
            | Layer::Dashes { points, .. }
            | Layer::Stems { points, .. }
            | Layer::Marks { points, .. } => {
                points.iter().all(|(x, y)| x.is_finite() && y.is_finite())
            }
            Layer::Band { points, .. } => {
                let finite = |v: &(f64, f64, f64)| [v.0, v.1, v.2].iter().all(|v| v.is_finite());
                points.iter().all(finite)
            }
        };
        let ends = |panel: &Panel| [panel.x.ends(), panel.y.ends()];
        for panel in &self.panels {
            let whole = ends(panel)
                .iter()
                .all(|e| e.0.is_finite() && e.1.is_finite());
            if !whole || !panel.layers.iter().all(finite) {
                return problem("a value is NaN or infinite; leave such points out");
            }
        }
        Ok(())
    }

    fn draw_on(&self, root: &Area<'_>, width: u32, top: u32, legend: &[(u32, u32)]) -> Drawn {
        root.fill(&WHITE)?;
        let centre = font(18).pos(Pos::new(HPos::Center, VPos::Center));
        let title = shortened(&self.title, LONGEST_TITLE);
        root.draw_text(&title, &centre, (pixel(width / 2), pixel(20)))?;
        for ((name, key), &(x, row)) in self.legend.iter().zip(legend) {
            let y = TITLE_HEIGHT + row * LEGEND_ROW + LEGEND_ROW / 2;
            draw_key(root, *key, (x, y))?;
            let style = font(13).pos(Pos::new(HPos::Left, VPos::Center));
            let name = shortened(name, LONGEST_NAME);
            root.draw_text(&name, &style, (pixel(x + 32), pixel(y)))?;
        }
        // One width for all, so that panels above one another share their axis.
        let ticks = self
            .panels
            .iter()
            .flat_map(|panel| panel.y.labelled_ticks());
        let longest = ticks.map(|tick| tick.1.chars().count()).max();
        let longest = u32::try_from(longest.unwrap_or(1)).unwrap_or(1);
        let label_area = 34 + TICK_CHARACTER * longest;
        for (index, panel) in self.panels.iter().enumerate() {
            let (column, line) = (index % self.columns, index / self.columns);
            let (column, line) = (u32::try_from(column), u32::try_from(line));
            let left = column.unwrap_or(0) * self.panel_size.0;
            let upper = top + line.unwrap_or(0) * self.panel_size.1;
            let size = (self.panel_size.0 * FINE, self.panel_size.1 * FINE);
            let area = root.clone().shrink((left * FINE, upper * FINE), size);
            if self.equal_scales {
                let panel = widened(panel, size, label_area)?;
                draw_panel(&area, &panel, label_area)?;
            } else {
                draw_panel(&area, panel, label_area)?;
            }
        }
        root.present()
    }

    /// Left end and row of every entry; rows break where the sheet ends.
    fn legend_places(&self, width: u32) -> Vec<(u32, u32)> {
        let (mut x, mut row) = (MARGIN, 0);
        let mut places = Vec::new();
        for (name, _) in &self.legend {
            let characters =
                u32::try_from(shortened(name, LONGEST_NAME).chars().count()).unwrap_or(0);
            let needed = 32 + characters * CHARACTER + 18;
            if x > MARGIN && x + needed > width {
                (x, row) = (MARGIN, row + 1);
            }
            places.push((x, row));
            x += needed;
        }
        places
    }
}

/// Where legends begin.
const MARGIN: u32 = 72;

/// Pixels of the sheet in units of the drawing.
pub(super) fn pixel(value: u32) -> i32 {
    i32::try_from(value * FINE).unwrap_or(i32::MAX)
}

fn font(size: u32) -> TextStyle<'static> {
    (FONT, size * FINE).into_font().color(&INK)
}

pub(super) fn stroke(colour: impl Color, width: u32) -> ShapeStyle {
    colour.stroke_width(width * FINE)
}

/// A name as it fits a legend or a title.
fn shortened(name: &str, longest: usize) -> String {
    let one_line = name.replace(char::is_control, " ");
    if one_line.chars().count() <= longest {
        return one_line;
    }
    let kept = one_line.chars().take(longest - 1);
    kept.chain(['…']).collect()
}

fn draw_key(root: &Area<'_>, key: Key, (x, y): (u32, u32)) -> Drawn {
    let line = |from: u32, to: u32| [(pixel(x + from), pixel(y)), (pixel(x + to), pixel(y))];
    match key {
        Key::Line(colour) => root.draw(&PathElement::new(line(0, 26), stroke(colour, 3))),
        Key::Dashes(colour) => {
            for start in [0, 10, 20] {
                let dash = line(start, start + 6);
                root.draw(&PathElement::new(dash, stroke(colour, 2)))?;
            }
            Ok(())
        }
        Key::Band(colour) => {
            let corners = [(pixel(x), pixel(y - 6)), (pixel(x + 26), pixel(y + 6))];
            root.draw(&Rectangle::new(corners, colour.mix(0.25).filled()))
        }
        Key::Mark(shape, colour) => draw_mark(root, (pixel(x + 13), pixel(y)), shape, colour),
        Key::MarkedLine(shape, colour) => {
            draw_key(root, Key::Line(colour), (x, y))?;
            draw_key(root, Key::Mark(shape, colour), (x, y))
        }
    }
}

pub(super) fn draw_mark(root: &Area<'_>, at: (i32, i32), shape: Shape, colour: RGBColor) -> Drawn {
    match shape {
        Shape::Cross => root.draw(&Cross::new(at, pixel(5), stroke(colour, 2))),
        Shape::Ring => root.draw(&Circle::new(at, pixel(5), stroke(colour, 2))),
        Shape::Dot => root.draw(&Circle::new(at, pixel(4), colour.filled())),
    }
}

/// The chart of a panel, with nothing in it yet.
fn empty_chart<'a, 'b>(
    area: &'a Area<'b>,
    panel: &Panel,
    label_area: u32,
) -> Result<Chart<'a, 'b>, DrawingAreaErrorKind<std::io::Error>> {
    let coordinate = |axis: &Axis| {
        let (low, high) = axis.ends();
        Ticked {
            line: (low..high).into(),
            ticks: axis.labelled_ticks().iter().map(|tick| tick.0).collect(),
        }
    };
    let mut builder = ChartBuilder::on(area);
    builder
        .margin(6 * FINE)
        // Half of the last label reaches beyond the axis.
        .margin_right(24 * FINE)
        .x_label_area_size(44 * FINE)
        .y_label_area_size(label_area * FINE);
    let top = if panel.title.is_empty() { 14 } else { 26 };
    builder.margin_top(top * FINE);
    builder.build_cartesian_2d(coordinate(&panel.x), coordinate(&panel.y))
}

/// The panel with one of its ranges widened until both axes have the same scale.
fn widened(
    panel: &Panel,
    size: (u32, u32),
    label_area: u32,
) -> Result<Panel, DrawingAreaErrorKind<std::io::Error>> {
    let mut draft = String::new();
    let area = SVGBackend::with_string(&mut draft, size).into_drawing_area();
    let (width, height) = empty_chart(&area, panel, label_area)?
        .plotting_area()
        .dim_in_pixel();
    let length = |axis: &Axis| axis.range.1 - axis.range.0;
    let unit = (length(&panel.x) / f64::from(width)).max(length(&panel.y) / f64::from(height));
    let wide = |axis: &Axis, pixels: u32| {
        let middle = 0.5 * (axis.range.0 + axis.range.1);
        let half = 0.5 * unit * f64::from(pixels);
        Axis {
            range: (middle - half, middle + half),
            ..axis.clone()
        }
    };
    Ok(Panel {
        title: panel.title.clone(),
        x: wide(&panel.x, width),
        y: wide(&panel.y, height),
        layers: panel.layers.clone(),
    })
}

fn draw_panel(area: &Area<'_>, panel: &Panel, label_area: u32) -> Drawn {
    let mut chart = empty_chart(area, panel, label_area)?;
    if !panel.title.is_empty() {
        let (across, _) = chart.plotting_area().get_pixel_range();
        let middle = across.start.midpoint(across.end) - area.get_base_pixel().0;
        let style = font(14).pos(Pos::new(HPos::Center, VPos::Center));
        let title = shortened(&panel.title, LONGEST_NAME);
        area.draw_text(&title, &style, (middle, pixel(14)))?;
    }
    let (x_ticks, y_ticks) = (panel.x.labelled_ticks(), panel.y.labelled_ticks());
    let label = |ticks: &[(f64, String)], value: f64| {
        let distance = |tick: &(f64, String)| (tick.0 - value).abs();
        let tick = ticks
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        tick.map(|tick| tick.1.clone()).unwrap_or_default()
    };
    chart
        .configure_mesh()
        .set_all_tick_mark_size(5 * FINE)
        .x_label_formatter(&|value| label(&x_ticks, *value))
        .y_label_formatter(&|value| label(&y_ticks, *value))
        .x_labels(x_ticks.len().max(1))
        .y_labels(y_ticks.len().max(1))
        .x_desc(&panel.x.label)
        .y_desc(&panel.y.label)
        .label_style(font(13))
        .axis_desc_style(font(14))
        .axis_style(stroke(INK, 1))
        .bold_line_style(stroke(GRID, 1))
        .light_line_style(TRANSPARENT)
        .draw()?;
    for layer in &panel.layers {
        draw_layer(&mut chart, panel, layer)?;
    }
    Ok(())
}
