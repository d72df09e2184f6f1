//! The figures of a report as SVG: those of the paper, and one for every plot of the page.

use anyhow::Result;
use plotters::prelude::{Color, RGBColor, ShapeStyle};

use super::cast::drawn_first;
use super::chart::{Axes, Field, Series, limit_style, line_chart, run_width};
use super::data::{Point, Report, Run, Scene, TerrainMap};
use super::log::TIME;
use super::pack::{Grid, Thinning};
use super::paper_figures::paper_figures;
use super::plots::{Look, PLOTS, Plot, WHEEL_LOADS, looks};

/// A drawn figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// File name without extension: the scene's name and the plot's, or one of
    /// [`PAPER_FIGURES`](super::PAPER_FIGURES).
    pub name: String,
    /// What it shows, in a sentence.
    pub caption: String,
    /// The drawing.
    pub svg: String,
    /// Whether it is one of the paper's figures, which lie apart from those of the page's plots.
    pub of_the_paper: bool,
}

/// The part of a figure's file name that tells its plot.
pub const FIGURE_ENDS: [&str; 12] = [
    "ltr",
    "speed",
    "steering-wheel",
    "steering-correction",
    "roll",
    "path-deviation",
    "lateral-acceleration",
    "yaw-rate",
    "step-time",
    "wheel-loads",
    "road",
    "terrain",
];

const WIDE: (u32, u32) = (920, 400);
/// Instants in a figure: two for each of its pixels.
const INSTANTS: f64 = 1600.0;
/// Fields of a terrain of which more would make the figure slow to draw.
const MOST_FIELDS: usize = 6000;
/// Colours and names of the wheel loads, in the order of their columns.
pub(super) const WHEELS: [(&str, RGBColor, [u8; 2]); 4] = [
    ("front left", RGBColor(0, 95, 173), [0, 0]),
    ("front right", RGBColor(213, 94, 0), [0, 0]),
    ("rear left", RGBColor(0, 95, 173), [6, 4]),
    ("rear right", RGBColor(213, 94, 0), [6, 4]),
];

/// Draws the paper's figures for which there are runs, and every plot of every scene.
///
/// # Errors
/// When a figure cannot be drawn.
pub fn figures(report: &Report) -> Result<Vec<Figure>> {
    let mut all = paper_figures(report)?;
    for scene in &report.scenes {
        for plot in &PLOTS {
            all.extend(time_plot(scene, plot)?);
        }
        all.extend(wheel_loads(scene)?);
        all.extend(road(scene)?);
        all.extend(profile(scene)?);
    }
    Ok(all)
}

/// A name that every file system takes.
pub(super) fn file_name(text: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || c == '-' {
            c
        } else {
            '-'
        }
    };
    let name: String = text.chars().take(80).map(plain).collect();
    name.trim_matches('-').to_lowercase()
}

fn shown(scene: &Scene) -> impl Iterator<Item = (usize, &Run, Look)> {
    let looks = looks(&scene.runs);
    let drawn = drawn_first(&scene.runs);
    let runs = scene.runs.iter().zip(looks).zip(drawn);
    let runs = runs.filter(|(_, drawn)| *drawn).enumerate();
    runs.map(|(index, ((run, look), _))| (index, run, look))
}

pub(super) fn colour(look: Look) -> RGBColor {
    let [r, g, b] = look.light;
    RGBColor(r, g, b)
}

pub(super) fn ended_early(run: &Run) -> bool {
    use vehicle_dyn::metrics::Outcome;
    matches!(run.outcome, Some(Outcome::RolledOver | Outcome::SpunOut))
}

/// A column of a run over time, with no more points than the figure shows.
pub(super) fn trace(run: &Run, column: &str) -> Option<Vec<(f64, f64)>> {
    let (time, values) = (run.columns.get(TIME)?, run.columns.get(column)?);
    let (&start, &end) = (time.first()?, time.last()?);
    let step = (end - start) / INSTANTS;
    if time.len() as f64 <= INSTANTS || step <= 0.0 {
        return Some(time.iter().copied().zip(values.iter().copied()).collect());
    }
    let grid = Grid::over(start, end, step);
    let sampled = grid.sample(time, values, Thinning::Peaks);
    let instants = (0..grid.count).map(|k| (start + k as f64 * step).min(end));
    let mut points: Vec<(f64, f64)> = instants.zip(sampled).collect();
    // The grid's last instants lie behind the log.
    while points.last().is_some_and(|p| !p.1.is_finite()) {
        points.pop();
    }
    Some(points)
}

pub(super) fn series(name: &str, style: ShapeStyle, points: Vec<(f64, f64)>) -> Series<'_> {
    Series {
        name,
        style,
        points,
        cross: false,
        dash: [0, 0],
    }
}

fn time_plot(scene: &Scene, plot: &Plot) -> Result<Option<Figure>> {
    let mut lines = Vec::new();
    for (index, run, look) in shown(scene) {
        if let Some(points) = trace(run, plot.column) {
            let style = colour(look).stroke_width(run_width(index));
            lines.push(Series {
                cross: ended_early(run),
                dash: look.dash,
                ..series(&run.label, style, points)
            });
        }
        if let Some(points) = plot.companion.and_then(|column| trace(run, column)) {
            lines.push(series("", colour(look).mix(0.5).stroke_width(1), points));
        }
    }
    if lines.is_empty() {
        return Ok(None);
    }
    let x = extent(&lines, |p| p.0);
    let (low, high) = extent(&lines, |p| p.1);
    let [least, most] = plot.at_least.unwrap_or([low, high]);
    let (low, high) = (low.min(least), high.max(most));
    // Limits far outside would flatten what there is to see.
    let reach = 0.6 * (high - low);
    let near = |v: &f64| (low - reach..=high + reach).contains(v);
    let limits: Vec<f64> = plot.limits.values(scene).into_iter().filter(near).collect();
    let low = limits.iter().copied().fold(low, f64::min);
    let high = limits.iter().copied().fold(high, f64::max);
    for value in limits {
        lines.push(series("", limit_style(), vec![(x.0, value), (x.1, value)]));
    }
    let margin = 0.06 * (high - low).max(1e-3);
    // Room for the legend above the lines.
    let legend = 0.08 * (high - low) * shown(scene).count() as f64;
    let axes = Axes {
        title: plot.title,
        x_label: "time / s",
        y_label: plot.axis,
        x: (x.0, x.1.max(x.0 + 1e-3)),
        y: (low - margin, high + margin + legend),
        fields: Vec::new(),
    };
    figure(
        scene,
        plot.name,
        plot.caption,
        line_chart(WIDE, &axes, &lines)?,
    )
}

#[expect(clippy::unnecessary_wraps, reason = "what the callers return")]
fn figure(scene: &Scene, plot: &str, caption: &str, svg: String) -> Result<Option<Figure>> {
    Ok(Some(Figure {
        name: format!("{}-{plot}", file_name(&scene.name)),
        caption: caption.into(),
        svg,
        of_the_paper: false,
    }))
}

/// One figure per run: four lines are enough for one.
fn wheel_loads(scene: &Scene) -> Result<Vec<Figure>> {
    let mut drawn = Vec::new();
    for (_, run, _) in shown(scene) {
        let lines: Vec<Series<'_>> = WHEEL_LOADS
            .iter()
            .zip(WHEELS)
            .filter_map(|(column, (name, colour, dash))| {
                let points = trace(run, column)?.into_iter().map(|(t, n)| (t, n / 1e3));
                Some(Series {
                    dash,
                    ..series(name, colour.stroke_width(2), points.collect())
                })
            })
            .collect();
        if lines.is_empty() {
            continue;
        }
        let (x, y) = (extent(&lines, |p| p.0), extent(&lines, |p| p.1));
        let title = format!("Wheel loads, {}", run.label);
        let axes = Axes {
            title: &title,
            x_label: "time / s",
            y_label: "kN",
            x: (x.0, x.1.max(x.0 + 1e-3)),
            y: (y.0.min(0.0), (1.35 * y.1).max(1.0)),
            fields: Vec::new(),
        };
        drawn.push(Figure {
            name: format!(
                "{}-{}-wheel-loads",
                file_name(&scene.name),
                file_name(&run.label)
            ),
            caption: "Vertical tyre loads.".into(),
            svg: line_chart(WIDE, &axes, &lines)?,
            of_the_paper: false,
        });
    }
    Ok(drawn)
}

pub(super) fn line(points: &[Point]) -> Vec<(f64, f64)> {
    points.iter().map(|p| (p[0], p[1])).collect()
}

/// Top view at one scale in both directions, so that a turn has its true shape.
fn road(scene: &Scene) -> Result<Option<Figure>> {
    let mut lines = Vec::new();
    if let Some(road) = &scene.road {
        for edge in [&road.left, &road.right] {
            lines.push(series("", limit_style(), line(edge)));
        }
    }
    for (index, run, look) in shown(scene) {
        let (Some(x), Some(y)) = (trace(run, "x_m"), trace(run, "y_m")) else {
            continue;
        };
        let points = x.iter().zip(&y).map(|(x, y)| (x.1, y.1)).collect();
        lines.push(Series {
            cross: ended_early(run),
            ..series(
                &run.label,
                colour(look).stroke_width(run_width(index)),
                points,
            )
        });
    }
    if lines.iter().all(|l| l.points.is_empty()) {
        return Ok(None);
    }
    let margin = 25.0;
    let (x, y) = (extent(&lines, |p| p.0), extent(&lines, |p| p.1));
    let (x, y) = ((x.0 - margin, x.1 + margin), (y.0 - margin, y.1 + margin));
    // The label areas and margins of the chart take these pixels away from the plot.
    let (frame_x, frame_y) = (92.0, 96.0);
    let pixels_per_m = (f64::from(WIDE.0) - frame_x) / (x.1 - x.0);
    let height = (pixels_per_m * (y.1 - y.0) + frame_y).clamp(200.0, 1600.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped above"
    )]
    let size = (WIDE.0, height as u32);
    let axes = Axes {
        title: "Road from above",
        x_label: "x / m",
        y_label: "y / m",
        x,
        y,
        fields: scene
            .terrain
            .as_ref()
            .map_or_else(Vec::new, |map| heights(map, x, y)),
    };
    let caption = "The road's edges and where the vehicles went.";
    figure(scene, "road", caption, line_chart(size, &axes, &lines)?)
}

/// Heights within a view as fields, dark where low; neighbours share one where there are too many.
pub(super) fn heights(map: &TerrainMap, x: (f64, f64), y: (f64, f64)) -> Vec<Field> {
    let known = || map.heights_m.iter().copied().filter(|h| h.is_finite());
    let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| {
        (low.min(h), high.max(h))
    });
    let span = (high - low).max(1e-9);
    let mut stride = 1;
    while known().count() / (stride * stride) > MOST_FIELDS {
        stride += 1;
    }
    let size = stride as f64 * map.spacing_m;
    let mut fields = Vec::new();
    for row in (0..map.rows).step_by(stride) {
        for column in (0..map.columns).step_by(stride) {
            let height = map.heights_m.get(row * map.columns + column);
            let Some(height) = height.filter(|h| h.is_finite()) else {
                continue;
            };
            let left = map.x_min_m + (column as f64 - 0.5) * map.spacing_m;
            let bottom = map.y_min_m + (row as f64 - 0.5) * map.spacing_m;
            let low_corner = (left.max(x.0), bottom.max(y.0));
            let high_corner = ((left + size).min(x.1), (bottom + size).min(y.1));
            if low_corner.0 >= high_corner.0 || low_corner.1 >= high_corner.1 {
                continue;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 176 and 246"
            )]
            let grey = (176.0 + 70.0 * (height - low) / span) as u8;
            fields.push(Field {
                low: low_corner,
                high: high_corner,
                grey,
            });
        }
    }
    fields
}

fn profile(scene: &Scene) -> Result<Option<Figure>> {
    let Some(profile) = &scene.profile else {
        return Ok(None);
    };
    let line = |heights: &[f64]| -> Vec<(f64, f64)> {
        let points = profile.station_m.iter().zip(heights);
        points.map(|(s, h)| (*s, h * 1e3)).collect()
    };
    let (_, left, _) = WHEELS[0];
    let (_, right, _) = WHEELS[1];
    let lines = [
        series(
            "under the left wheels",
            left.stroke_width(1),
            line(&profile.left_m),
        ),
        series(
            "under the right wheels",
            right.stroke_width(1),
            line(&profile.right_m),
        ),
    ];
    if lines.iter().all(|l| l.points.is_empty()) {
        return Ok(None);
    }
    let (x, y) = (extent(&lines, |p| p.0), extent(&lines, |p| p.1));
    let axes = Axes {
        title: "Height of the ground along the road",
        x_label: "distance along the road / m",
        y_label: "mm",
        x,
        y: (y.0 - 5.0, y.1 + 5.0 + 0.25 * (y.1 - y.0)),
        fields: Vec::new(),
    };
    let caption = "Height under the wheels along the centre line.";
    figure(scene, "terrain", caption, line_chart(WIDE, &axes, &lines)?)
}

pub(super) fn extent(lines: &[Series<'_>], f: fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let values = lines
        .iter()
        .flat_map(|s| &s.points)
        .map(f)
        .filter(|v| v.is_finite());
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if low <= high { (low, high) } else { (0.0, 1.0) }
}
