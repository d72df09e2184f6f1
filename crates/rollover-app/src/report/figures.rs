//! The figures of a run, or of several runs over one another.

use anyhow::Result;
use plotters::prelude::{Color, ShapeStyle};

use super::chart::{Axes, Series, limit_style, line_chart, run_colour, run_width};
use crate::run_log::LogRow;
use crate::summary::LTR_LIFT_OFF;

/// A run as the figures need it.
pub struct RunTrace<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// The run's log.
    pub rows: &'a [LogRow],
    /// Whether it ended before its time, by a rollover or a spin.
    pub ended_early: bool,
}

/// A drawn figure.
#[derive(Debug, Clone)]
pub struct Figure {
    /// File name without extension.
    pub name: &'static str,
    /// What it shows, in a sentence.
    pub caption: String,
    /// The drawing.
    pub svg: String,
}

/// The road's edges as a picture needs them, in metres.
pub type Polyline = Vec<(f64, f64)>;

/// File names, without extension, of all figures.
pub const FIGURE_NAMES: [&str; 4] = [LTR, SPEED, STEERING_WHEEL, COURSE];
const LTR: &str = "ltr";
const SPEED: &str = "speed";
const STEERING_WHEEL: &str = "steering-wheel";
const COURSE: &str = "course";

const WIDE: (u32, u32) = (920, 400);
/// LTR beyond its limits, with room for the legend above.
const LTR_AXIS: (f64, f64) = (-1.5, 2.1);

/// Draws load transfer ratio, speed, steering wheel and the course from above.
///
/// # Errors
/// When a figure cannot be drawn.
pub fn draw_all(runs: &[RunTrace<'_>], road_edges: &[Polyline]) -> Result<Vec<Figure>> {
    Ok(vec![
        ltr(runs)?,
        speed(runs)?,
        steering_wheel(runs)?,
        course(runs, road_edges)?,
    ])
}

fn ltr(runs: &[RunTrace<'_>]) -> Result<Figure> {
    let mut series = run_series(runs, |r| r.ltr);
    series.extend(limits(runs, &[-LTR_LIFT_OFF, LTR_LIFT_OFF]));
    Ok(Figure {
        name: LTR,
        caption: "Load transfer ratio. At ±1 the inner wheels carry nothing. A cross marks a run that ended early.".into(),
        svg: time_chart(runs, "Load transfer ratio", "LTR", LTR_AXIS, &series)?,
    })
}

fn speed(runs: &[RunTrace<'_>]) -> Result<Figure> {
    let mut series = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let colour = run_colour(index);
        let thin = colour.mix(0.45).stroke_width(1);
        series.push(trace(
            run,
            run.name,
            colour.stroke_width(run_width(index)),
            |r| r.speed_kmh,
        ));
        series.push(trace(run, "", thin, |r| r.target_speed_kmh));
    }
    let range = padded(&series, 2.0);
    Ok(Figure {
        name: SPEED,
        caption: "Speed (thick) and the commanded target speed (thin).".into(),
        svg: time_chart(runs, "Speed", "km/h", range, &series)?,
    })
}

fn steering_wheel(runs: &[RunTrace<'_>]) -> Result<Figure> {
    let mut series = run_series(runs, |r| r.steering_wheel_deg);
    for (index, run) in runs.iter().enumerate() {
        let faint = run_colour(index).mix(0.45).stroke_width(1);
        series.push(trace(run, "", faint, |r| r.steering_wheel_reference_deg));
    }
    let range = padded(&series, 10.0);
    Ok(Figure {
        name: STEERING_WHEEL,
        caption: "Steering wheel: what was applied (thick) and what the driver asked for (thin)."
            .into(),
        svg: time_chart(runs, "Steering wheel", "deg", range, &series)?,
    })
}

/// Top view at one scale in both directions, so that a turn has its true shape.
fn course(runs: &[RunTrace<'_>], road_edges: &[Polyline]) -> Result<Figure> {
    let mut series: Vec<Series<'_>> = road_edges
        .iter()
        .map(|edge| Series {
            name: "",
            style: limit_style(),
            points: edge.clone(),
            cross: false,
        })
        .collect();
    for (index, run) in runs.iter().enumerate() {
        let points = run.rows.iter().map(|r| (r.x_m, r.y_m)).collect();
        let style = run_colour(index).stroke_width(run_width(index));
        series.push(Series {
            name: run.name,
            style,
            points,
            cross: run.ended_early,
        });
    }
    let extent = |f: fn(&(f64, f64)) -> f64| range_of(series.iter().flat_map(|s| &s.points).map(f));
    let (x, y) = (extent(|p| p.0), extent(|p| p.1));
    let margin = 25.0;
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
        title: "Course from above",
        x_label: "x / m",
        y_label: "y / m",
        x,
        y,
    };
    Ok(Figure {
        name: COURSE,
        caption: "The road's edges and where the vehicle went.".into(),
        svg: line_chart(size, &axes, &series)?,
    })
}

fn run_series<'a>(runs: &[RunTrace<'a>], value: fn(&LogRow) -> f64) -> Vec<Series<'a>> {
    runs.iter()
        .enumerate()
        .map(|(index, run)| {
            trace(
                run,
                run.name,
                run_colour(index).stroke_width(run_width(index)),
                value,
            )
        })
        .collect()
}

fn trace<'a>(
    run: &RunTrace<'_>,
    name: &'a str,
    style: ShapeStyle,
    value: fn(&LogRow) -> f64,
) -> Series<'a> {
    Series {
        name,
        style,
        points: run.rows.iter().map(|r| (r.time_s, value(r))).collect(),
        // The thin lines beside a run's own need no mark.
        cross: run.ended_early && !name.is_empty(),
    }
}

fn limits(runs: &[RunTrace<'_>], values: &[f64]) -> Vec<Series<'static>> {
    let end = duration(runs);
    values
        .iter()
        .map(|&v| Series {
            name: "",
            style: limit_style(),
            points: vec![(0.0, v), (end, v)],
            cross: false,
        })
        .collect()
}

fn time_chart(
    runs: &[RunTrace<'_>],
    title: &str,
    y_label: &str,
    y: (f64, f64),
    series: &[Series<'_>],
) -> Result<String> {
    let axes = Axes {
        title,
        x_label: "time / s",
        y_label,
        x: (0.0, duration(runs)),
        y,
    };
    line_chart(WIDE, &axes, series)
}

fn duration(runs: &[RunTrace<'_>]) -> f64 {
    runs.iter()
        .filter_map(|run| run.rows.last())
        .map(|r| r.time_s)
        .fold(1e-3, f64::max)
}

fn padded(series: &[Series<'_>], padding: f64) -> (f64, f64) {
    let (low, high) = range_of(series.iter().flat_map(|s| &s.points).map(|p| p.1));
    (low - padding, high + padding)
}

fn range_of(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}
