//! The report as one HTML file that opens offline.
//!
//! Scripts and styles are in the file; its Content-Security-Policy names them by their SHA-256 and
//! forbids everything else, so that nothing is loaded and nothing that a log or a scenario brings
//! along can run.

use anyhow::{Context, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use vehicle_dyn::metrics::Outcome;

use super::cast::{casts, drawn_first};
use super::data::{Columns, Report, Scene, TerrainMap, VehicleShape};
use super::log::TIME;
use super::pack::{Grid, Packed, Thinning, unwrapped_deg};
use super::plots::{PLOTS, looks, page_columns};

const STYLES: &str = concat!(
    include_str!("../../assets/report/uPlot.min.css"),
    "\n",
    include_str!("../../assets/report/style.css"),
);
/// uPlot with its licence, as that asks for.
const LIBRARY: &str = concat!(
    "/*\n",
    include_str!("../../assets/report/uPlot.LICENSE"),
    "\n*/\n",
    include_str!("../../assets/report/uPlot.iife.min.js"),
);
/// One script, so that one name holds what its parts share.
const PROGRAM: &str = concat!(
    "(() => {\n\"use strict\";\n",
    include_str!("../../assets/report/page.js"),
    include_str!("../../assets/report/tables.js"),
    include_str!("../../assets/report/claims.js"),
    include_str!("../../assets/report/plots.js"),
    include_str!("../../assets/report/road.js"),
    include_str!("../../assets/report/vehicle.js"),
    include_str!("../../assets/report/replay.js"),
    include_str!("../../assets/report/scene.js"),
    include_str!("../../assets/report/keyboard.js"),
    include_str!("../../assets/report/selftest.js"),
    include_str!("../../assets/report/main.js"),
    "})();\n",
);

/// Shortest display interval, s: 25 instants a second are a smooth replay.
const SHORTEST_INTERVAL_S: f64 = 0.04;
/// Most samples in a page, over all columns; each takes 2⅔ bytes.
const MOST_SAMPLES: f64 = 1.3e6;
/// Most heights of a terrain.
const MOST_HEIGHTS: usize = 100_000;

/// The report as HTML.
///
/// # Errors
/// When it cannot be written as JSON.
pub fn html(report: &Report) -> Result<String> {
    let data = page_data(report)?;
    // `<` could end the block; everything else is harmless within it.
    let data = serde_json::to_string(&data)?.replace('<', "\\u003c");
    let title = escaped(&report.title);
    let hash = |text: &str| STANDARD.encode(Sha256::digest(text.as_bytes()));
    let policy = format!(
        "default-src 'none'; script-src 'sha256-{}' 'sha256-{}'; style-src 'sha256-{}'; base-uri 'none'; form-action 'none'",
        hash(LIBRARY),
        hash(PROGRAM),
        hash(STYLES)
    );
    let body = include_str!("../../assets/report/body.html");
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>{STYLES}</style>\n</head>\n<body>\n{body}\n\
         <script type=\"application/json\" id=\"report-data\">{data}</script>\n\
         <script>{LIBRARY}</script>\n<script>{PROGRAM}</script>\n</body>\n</html>\n"
    ))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

fn page_data(report: &Report) -> Result<Value> {
    let step_s = display_interval_s(report);
    let scenes: Vec<Value> = report
        .scenes
        .iter()
        .map(|scene| scene_data(scene, step_s))
        .collect::<Result<_>>()?;
    let mut bare = report.clone();
    bare.scenes.clear();
    bare.unlogged.clear();
    let mut data = serde_json::to_value(&bare).context("the report is no JSON")?;
    data["scenes"] = scenes.into();
    data["unlogged_runs"] = report.unlogged.len().into();
    data["plots"] = serde_json::to_value(PLOTS)?;
    Ok(data)
}

/// The interval between the page's samples: short enough for a smooth replay, long enough for the
/// page's size.
fn display_interval_s(report: &Report) -> f64 {
    let columns = page_columns();
    let spans = report
        .scenes
        .iter()
        .flat_map(|scene| &scene.runs)
        .map(|run| {
            let time = run.columns.get(TIME).map_or(&[][..], Vec::as_slice);
            let span = time.last().zip(time.first()).map_or(0.0, |(b, a)| b - a);
            let carried = columns.iter().filter(|(n, _)| run.columns.contains_key(*n));
            span * carried.count() as f64
        });
    let total: f64 = spans.sum();
    let least = (total / MOST_SAMPLES).max(SHORTEST_INTERVAL_S);
    // An interval that reads well.
    [0.04, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0]
        .into_iter()
        .find(|step| *step >= least)
        .unwrap_or(least)
}

fn scene_data(scene: &Scene, step_s: f64) -> Result<Value> {
    let times = || scene.runs.iter().filter_map(|run| run.columns.get(TIME));
    let start = times()
        .filter_map(|t| t.first())
        .copied()
        .fold(f64::INFINITY, f64::min);
    let end = times()
        .filter_map(|t| t.last())
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    // Samples farther apart than the display would leave gaps between them.
    let slowest = times().map(|t| typical_interval_s(t)).fold(0.0, f64::max);
    let step_s = step_s.max(slowest);
    let grid = if start.is_finite() {
        Grid::over(start, end, step_s)
    } else {
        Grid {
            start_s: 0.0,
            step_s,
            count: 0,
        }
    };
    let looks = looks(&scene.runs);
    let mut runs = Vec::with_capacity(scene.runs.len());
    let drawn = drawn_first(&scene.runs);
    for ((run, look), drawn) in scene.runs.iter().zip(looks).zip(drawn) {
        let mut bare = run.clone();
        bare.columns.clear();
        let mut data = serde_json::to_value(&bare)?;
        data["shown"] = drawn.into();
        data["look"] = serde_json::to_value(look)?;
        data["ended_early"] =
            matches!(run.outcome, Some(Outcome::RolledOver | Outcome::SpunOut)).into();
        data["log_interval_s"] = run.columns.get(TIME).map(|t| typical_interval_s(t)).into();
        data["columns"] = columns(&run.columns, &grid)?;
        runs.push(data);
    }
    let mut bare = scene.clone();
    bare.runs.clear();
    bare.terrain = None;
    let mut data = serde_json::to_value(&bare)?;
    data["terrain"] = serde_json::to_value(scene.terrain.as_ref().map(terrain))?;
    data["vehicle"] =
        serde_json::to_value(scene.vehicle.clone().unwrap_or_else(VehicleShape::typical))?;
    data["limit_values"] = PLOTS
        .iter()
        .map(|plot| (plot.name.to_owned(), json!(plot.limits.values(scene))))
        .collect::<serde_json::Map<_, _>>()
        .into();
    data["casts"] = serde_json::to_value(casts(&scene.runs))?;
    data["grid"] = serde_json::to_value(grid)?;
    data["runs"] = runs.into();
    Ok(data)
}

fn columns(log: &Columns, grid: &Grid) -> Result<Value> {
    let Some(time) = log.get(TIME) else {
        return Ok(json!({}));
    };
    let mut packed = serde_json::Map::new();
    for (name, thinning) in page_columns() {
        let Some(values) = log.get(name) else {
            continue;
        };
        let shown = if name == "yaw_deg" {
            grid.sample(time, &unwrapped_deg(values), thinning)
        } else {
            grid.sample(time, values, thinning)
        };
        packed.insert(name.into(), serde_json::to_value(Packed::of(&shown))?);
    }
    // The body leans smoothly in the replay; its plot keeps the peaks.
    if let Some(values) = log.get("roll_deg") {
        let shown = grid.sample(time, values, Thinning::Smooth);
        packed.insert(
            "roll_smooth_deg".into(),
            serde_json::to_value(Packed::of(&shown))?,
        );
    }
    Ok(packed.into())
}

/// Median interval between rows, s.
fn typical_interval_s(time: &[f64]) -> f64 {
    let mut intervals: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    intervals.sort_by(f64::total_cmp);
    let median = intervals.get(intervals.len() / 2).copied().unwrap_or(0.0);
    // Differences of rounded times.
    (median * 1e6).round() / 1e6
}

fn terrain(map: &TerrainMap) -> Value {
    let mut stride = 1;
    while map.columns.div_ceil(stride) * map.rows.div_ceil(stride) > MOST_HEIGHTS {
        stride += 1;
    }
    let rows = (0..map.rows).step_by(stride);
    let heights: Vec<f64> = rows
        .flat_map(|row| {
            (0..map.columns)
                .step_by(stride)
                .map(move |column| (row, column))
        })
        .map(|(row, column)| {
            let height = map.heights_m.get(row * map.columns + column);
            height.copied().unwrap_or(f64::NAN)
        })
        .collect();
    json!({
        "x_min_m": map.x_min_m,
        "y_min_m": map.y_min_m,
        "spacing_m": map.spacing_m * stride as f64,
        "columns": map.columns.div_ceil(stride),
        "rows": map.rows.div_ceil(stride),
        "heights_m": Packed::of(&heights),
    })
}
