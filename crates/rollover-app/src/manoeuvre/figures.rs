//! Pictures of a manoeuvre: signals over time, and what the manoeuvre shows over something else.

use anyhow::Result;
use plotters::style::Color;
use vehicle_dyn::manoeuvre::{Curve, Performed, Trace, TraceRow};
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2};

use super::files::PICTURE;
use crate::report::chart::{Axes, Series, limit_style, line_chart, run_colour, run_width};

/// A drawn picture.
pub(super) struct Figure {
    /// File name.
    pub(super) file: String,
    /// What it shows.
    pub(super) caption: String,
    /// The drawing.
    pub(super) svg: String,
}

/// Runs in one picture: as many as a legend and the colours can tell apart.
const MOST_RUNS: usize = 6;
const WIDE: (u32, u32) = (920, 400);
/// Largest |LTR| shown: a landing may send it far beyond what matters.
const LTR_SHOWN: f64 = 2.0;
/// Points of one line: more than the width of a picture shows nothing more.
const MOST_POINTS: usize = 1500;

struct Quantity {
    file: &'static str,
    title: &'static str,
    unit: &'static str,
    value: fn(&TraceRow) -> f64,
    limits: &'static [f64],
    shown: Option<f64>,
}

const QUANTITIES: [Quantity; 6] = [
    Quantity {
        file: "handwheel",
        title: "Handwheel angle",
        unit: "deg",
        value: |row| row.seen.handwheel_actual_deg(),
        limits: &[],
        shown: None,
    },
    Quantity {
        file: "lateral-acceleration",
        title: "Lateral acceleration",
        unit: "g",
        value: |row| row.seen.lateral_acceleration_m_s2 / GRAVITY_M_S2,
        limits: &[],
        shown: None,
    },
    Quantity {
        file: "yaw-rate",
        title: "Yaw rate",
        unit: "deg/s",
        value: |row| row.seen.yaw_rate_rad_s / DEGREE,
        limits: &[],
        shown: None,
    },
    Quantity {
        file: "roll-angle",
        title: "Roll angle",
        unit: "deg",
        value: |row| row.seen.roll_rad / DEGREE,
        limits: &[],
        shown: None,
    },
    Quantity {
        file: "ltr",
        title: "Load transfer ratio",
        unit: "LTR",
        value: |row| row.seen.ltr,
        limits: &[-1.0, 1.0],
        shown: Some(LTR_SHOWN),
    },
    Quantity {
        file: "two-wheel-lift",
        title: "Height of both wheels of one side",
        unit: "mm",
        value: |row| 1e3 * row.seen.pair_clearance_m(),
        limits: &[1e3 * vehicle_dyn::manoeuvre::TWO_WHEEL_LIFT_M],
        shown: Some(300.0),
    },
];

/// Draws everything.
pub(super) fn draw_all(done: &Performed) -> Result<Vec<Figure>> {
    let shown = shown(&done.traces);
    let mut figures = curves(&done.report.curves, &shown)?;
    let names: Vec<&str> = shown.iter().map(|trace| trace.name.as_str()).collect();
    let left_out = done.traces.len() - shown.len();
    let which = if left_out == 0 {
        String::new()
    } else {
        format!(
            " Shown: {}. The other {left_out} runs, mirrored ones among them, are in the logs.",
            names.join(", ")
        )
    };
    for quantity in QUANTITIES {
        let flat = |trace: &&Trace| trace.rows.iter().all(|row| (quantity.value)(row) == 0.0);
        if shown.iter().all(flat) {
            continue;
        }
        figures.push(over_time(&quantity, &shown, &which)?);
    }
    Ok(figures)
}

/// The runs that are drawn: those of the manoeuvre itself rather than of a sub-test, of one direction
/// only, spread evenly over all.
fn shown(traces: &[Trace]) -> Vec<&Trace> {
    let own = |trace: &&Trace| !trace.name.starts_with("slowly-increasing-steer");
    let mut runs: Vec<&Trace> = traces.iter().filter(own).collect();
    if runs.is_empty() {
        runs = traces.iter().collect();
    }
    let one_way = |trace: &&&Trace| !trace.name.split('-').any(|part| part == "right");
    let left: Vec<&Trace> = runs.iter().filter(one_way).copied().collect();
    let runs = if left.is_empty() { runs } else { left };
    if runs.len() <= MOST_RUNS {
        return runs;
    }
    let last = runs.len() - 1;
    (0..MOST_RUNS)
        .map(|index| runs[index * last / (MOST_RUNS - 1)])
        .collect()
}

fn over_time(quantity: &Quantity, runs: &[&Trace], which: &str) -> Result<Figure> {
    let end = runs.iter().map(|run| run.end_s()).fold(1e-3, f64::max);
    let mut series: Vec<Series<'_>> = runs
        .iter()
        .enumerate()
        .map(|(index, run)| Series {
            name: &run.name,
            style: run_colour(index).stroke_width(run_width(index)),
            points: points(run, quantity),
            cross: run.ended == Outcome::RolledOver,

            dash: [0, 0],
        })
        .collect();
    series.extend(quantity.limits.iter().map(|&limit| Series {
        name: "",
        style: limit_style(),
        points: vec![(0.0, limit), (end, limit)],
        cross: false,

        dash: [0, 0],
    }));
    let axes = Axes {
        fields: Vec::new(),
        title: quantity.title,
        x_label: "time / s",
        y_label: quantity.unit,
        x: (0.0, end),
        y: range(&series),
    };
    let cut = quantity.shown.map_or_else(String::new, |most| {
        format!(" Cut at {most} {}.", quantity.unit)
    });
    Ok(Figure {
        file: format!("{PICTURE}{}.svg", quantity.file),
        caption: format!("{}. A cross marks a rollover.{cut}{which}", quantity.title),
        svg: line_chart(WIDE, &axes, &series)?,
    })
}

fn points(run: &Trace, quantity: &Quantity) -> Vec<(f64, f64)> {
    let most = quantity.shown.unwrap_or(f64::INFINITY);
    let every = run.rows.len().div_ceil(MOST_POINTS).max(1);
    run.rows
        .iter()
        .step_by(every)
        .chain(run.rows.last())
        .map(|row| (row.seen.time_s, (quantity.value)(row).clamp(-most, most)))
        .collect()
}

/// One picture for all curves over the same axes.
fn curves(curves: &[Curve], runs: &[&Trace]) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let mut done: Vec<(&str, &str)> = Vec::new();
    for curve in curves {
        let axes = (curve.x.as_str(), curve.y.as_str());
        // Gains of different responses share neither scale nor picture.
        if done.contains(&axes) && axes.0 != FREQUENCY {
            continue;
        }
        done.push(axes);
        let number = figures.len() + 1;
        let group: Vec<&Curve> = if axes.0 == FREQUENCY {
            vec![curve]
        } else {
            curves
                .iter()
                .filter(|other| (other.x.as_str(), other.y.as_str()) == axes)
                .collect()
        };
        figures.push(if axes.0 == TOP_VIEW {
            top_view(&group, runs)?
        } else {
            one_curve(number, &group)?
        });
    }
    Ok(figures)
}

/// Labels of the curves that `vehicle_dyn` makes.
const FREQUENCY: &str = "frequency / Hz";
const TOP_VIEW: &str = "x / m";

fn one_curve(number: usize, group: &[&Curve]) -> Result<Figure> {
    let series: Vec<Series<'_>> = group
        .iter()
        .enumerate()
        .map(|(index, curve)| Series {
            name: &curve.name,
            style: run_colour(index).stroke_width(run_width(index)),
            points: curve.points.iter().map(|p| (p[0], p[1])).collect(),
            cross: false,

            dash: [0, 0],
        })
        .collect();
    let title = group.first().map_or("", |curve| {
        curve.name.split(',').next().unwrap_or(&curve.name)
    });
    let (x, y) = group.first().map_or(("", ""), |curve| (&curve.x, &curve.y));
    let along = series.iter().flat_map(|s| &s.points).map(|p| p.0);
    let axes = Axes {
        fields: Vec::new(),
        title,
        x_label: x,
        y_label: y,
        x: padded(along),
        y: range(&series),
    };
    Ok(Figure {
        file: format!("{PICTURE}curve-{number}.svg"),
        caption: format!("{title} over {x}."),
        svg: line_chart(WIDE, &axes, &series)?,
    })
}

fn top_view(group: &[&Curve], runs: &[&Trace]) -> Result<Figure> {
    let of_left = group.iter().filter(|curve| curve.name.ends_with("left"));
    let mut series: Vec<Series<'_>> = of_left
        .map(|curve| Series {
            name: "",
            style: limit_style(),
            points: curve.points.iter().map(|p| (p[0], p[1])).collect(),
            cross: false,

            dash: [0, 0],
        })
        .collect();
    let x = padded(series.iter().flat_map(|s| &s.points).map(|p| p.0));
    series.extend(runs.iter().enumerate().map(|(index, run)| {
        Series {
            name: &run.name,
            style: run_colour(index).stroke_width(run_width(index)),
            points: run
                .rows
                .iter()
                .map(|row| (row.seen.x_m, row.seen.y_m))
                .filter(|point| point.0 <= x.1 && point.1.abs() < 20.0)
                .collect(),
            cross: run.ended == Outcome::RolledOver,

            dash: [0, 0],
        }
    }));
    let axes = Axes {
        fields: Vec::new(),
        title: "Lanes, path and way of the centre of gravity",
        x_label: "x / m",
        y_label: "y / m",
        x,
        y: range(&series),
    };
    Ok(Figure {
        file: format!("{PICTURE}lanes.svg"),
        caption: "Edges of the lanes and the path (grey), and where the centre of gravity went; y is stretched. A cross marks a rollover.".into(),
        svg: line_chart(WIDE, &axes, &series)?,
    })
}

/// A range of y with room for the legend above.
fn range(series: &[Series<'_>]) -> (f64, f64) {
    let (low, high) = padded(series.iter().flat_map(|s| &s.points).map(|p| p.1));
    let legend = 0.11 * series.iter().filter(|s| !s.name.is_empty()).count() as f64;
    (low, high + legend * (high - low))
}

fn padded(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return (0.0, 1.0);
    }
    let room = (0.04 * (high - low)).max(1e-9 * (1.0 + high.abs()));
    (low - room, high + room)
}
