//! The figures of the page.

use anyhow::Result;

use crate::chart::{self, Bar, Line};
use crate::condensed::CaseResult;
use crate::page::{duration, formulation_words};
use crate::rows::{CONDENSED, FULL, LMPC, PRODUCT, REDUCED, Row};
use crate::sweeps::{FUTURE, INPUTS, OUTPUTS, PAST, Point, SAMPLES, Sweeps};

/// Median step of every formulation and back end of one case, the slowest on top.
pub fn steps(case: &CaseResult) -> Result<String> {
    let mut rows: Vec<&Row> = case.rows.iter().collect();
    rows.sort_by(|a, b| b.median_us.total_cmp(&a.median_us));
    let groups = [FULL, REDUCED, CONDENSED, PRODUCT, LMPC];
    let bars: Vec<Bar> = rows
        .iter()
        .map(|row| Bar {
            name: format!("{}, {}", formulation_words(row.formulation), row.backend),
            value: row.median_us,
            text: duration(row.median_us),
            group: groups
                .iter()
                .position(|g| *g == row.formulation)
                .unwrap_or(0),
        })
        .collect();
    chart::bars(&case.name, "median time of a step", round_duration, &bars)
}

/// A whole power of ten of microseconds.
fn round_duration(us: f64) -> String {
    match us {
        us if us < 1e3 => format!("{us} µs"),
        us if us < 1e6 => format!("{} ms", us / 1e3),
        us => format!("{} s", us / 1e6),
    }
}

/// Set-up time and memory, and the step, against the length of the recording.
pub fn set_up(sweeps: &Sweeps) -> Result<String> {
    let line = |name: &str, value: fn(&Point) -> Option<f64>| Line {
        name: name.to_owned(),
        points: points(sweeps, SAMPLES, value),
    };
    let lines = [
        line("set-up (ms)", |point| Some(point.setup_ms)),
        line("memory of set-up (MB)", |point| {
            point.setup_peak_mb.filter(|mb| *mb > 0.0)
        }),
        line("median step (µs)", |point| Some(point.median_us)),
    ];
    chart::lines(
        "Length of the recording",
        ["T (samples)", "ms, MB, µs"],
        &lines,
    )
}

/// The step against the horizons and against the channels.
pub fn sizes(sweeps: &Sweeps) -> Result<[String; 2]> {
    let line = |sweep: &'static str, name: &str| Line {
        name: name.to_owned(),
        points: points(sweeps, sweep, |point| Some(point.median_us)),
    };
    let horizons = [
        line(PAST, "T_ini (N = 100)"),
        line(FUTURE, "N (T_ini = 100)"),
    ];
    let channels = [line(INPUTS, "m (p = 1)"), line(OUTPUTS, "p (m = 2)")];
    let axis = "median step (µs)";
    Ok([
        chart::lines("Horizons", ["samples", axis], &horizons)?,
        chart::lines("Channels", ["channels", axis], &channels)?,
    ])
}

fn points(sweeps: &Sweeps, sweep: &str, value: fn(&Point) -> Option<f64>) -> Vec<(f64, f64)> {
    let points = sweeps.points.iter().filter(|point| point.sweep == sweep);
    points
        .filter_map(|point| Some((point.value as f64, value(point)?)))
        .collect()
}
