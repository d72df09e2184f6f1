//! The tables of a report as CSV files.

use anyhow::Result;

use super::cast::rank;
use super::data::{Report, Role, Run};

/// A table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// File name without extension.
    pub name: &'static str,
    /// Its text, a header line first.
    pub csv: String,
}

/// File names, without extension, of all tables.
pub const TABLE_NAMES: [&str; 5] = ["claims", "timing", "seeds", "runs", "problems"];

fn text(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

/// The tables of a report; those without a row are left out.
///
/// # Errors
/// When a table cannot be written as CSV.
pub fn tables(report: &Report) -> Result<Vec<Table>> {
    let all = [
        claims(report),
        timing(report),
        seeds(report),
        runs(report),
        problems(report),
    ];
    let mut tables = Vec::new();
    for (name, (header, rows)) in TABLE_NAMES.into_iter().zip(all) {
        if rows.is_empty() {
            continue;
        }
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(header)?;
        for row in rows {
            writer.write_record(row)?;
        }
        let csv = String::from_utf8(writer.into_inner()?)?;
        tables.push(Table { name, csv });
    }
    Ok(tables)
}

type Content = (&'static [&'static str], Vec<Vec<String>>);

fn claims(report: &Report) -> Content {
    let row = |claim: &super::data::Claim| {
        let seeds: Vec<String> = claim.seeds.iter().map(u64::to_string).collect();
        vec![
            claim.id.clone(),
            claim.group.clone(),
            text(claim.settings),
            claim.claim.clone(),
            claim.paper.clone(),
            claim.ours.clone(),
            seeds.join(" "),
            claim.judged.to_string(),
            text(claim.fraction),
            claim.verdict.to_string(),
            text(claim.reason.as_ref().map(|reason| &reason.text)),
        ]
    };
    (
        &[
            "id", "group", "settings", "claim", "paper", "ours", "seeds", "judged", "fraction",
            "verdict", "reason",
        ],
        report.claims.iter().map(row).collect(),
    )
}

fn timing(report: &Report) -> Content {
    let row = |row: &super::data::TimingRow| {
        vec![
            row.method.clone(),
            row.size.clone(),
            text(row.paper_cost),
            text(row.cost),
            text(row.paper_time_s),
            text(row.time_s),
            text(row.ratio),
            row.note.clone(),
        ]
    };
    (
        &[
            "method",
            "size",
            "paper_cost",
            "cost",
            "paper_time_s",
            "time_s",
            "ratio",
            "note",
        ],
        report.timing.iter().map(row).collect(),
    )
}

fn seeds(report: &Report) -> Content {
    let row = |row: &super::data::SeedRow| {
        vec![
            row.scene.clone(),
            row.controller.clone(),
            row.course.clone(),
            row.runs.to_string(),
            text(row.completed_fraction),
            text(row.safe_fraction),
            text(row.ltr_abs_median),
            text(row.ltr_abs_worst),
            text(row.speed_mean_median_kmh),
            text(row.speed_min_worst_kmh),
            text(row.path_deviation_worst_m),
            text(row.cost_median),
        ]
    };
    (
        &[
            "scene",
            "controller",
            "course",
            "runs",
            "completed_fraction",
            "safe_fraction",
            "ltr_abs_median",
            "ltr_abs_worst",
            "speed_mean_median_kmh",
            "speed_min_worst_kmh",
            "path_deviation_worst_m",
            "cost_median",
        ],
        report.seeds.iter().map(row).collect(),
    )
}

/// Every run, also those without a log, grouped by controller.
fn runs(report: &Report) -> Content {
    let logged = report.scenes.iter().flat_map(|scene| {
        let of_scene = scene.runs.iter();
        of_scene.map(|run| (scene.name.as_str(), run, None))
    });
    let unlogged = report.unlogged.iter();
    let unlogged = unlogged.map(|one| (one.scene.as_str(), &one.run, one.failure.as_deref()));
    let mut all: Vec<(&str, &Run, Option<&str>)> = logged.chain(unlogged).collect();
    let place = |name: &str| report.scenes.iter().position(|scene| scene.name == name);
    // Stable: what this does not order stays as it is.
    all.sort_by_key(|(scene, run, _)| {
        let role = Role::of_name(&run.controller).order();
        let controller = run.controller.as_str();
        let last = place(scene).unwrap_or(usize::MAX);
        (
            last,
            role,
            rank(controller),
            controller,
            run.mirrored,
            run.seed,
        )
    });
    let row = |(scene, run, failure): &(&str, &Run, Option<&str>)| {
        let f = &run.figures;
        // What could not be made has no numbers.
        let made = failure.is_none();
        vec![
            (*scene).to_owned(),
            run.label.clone(),
            run.controller.clone(),
            text(run.seed),
            run.mirrored.to_string(),
            text(run.outcome),
            text(made.then_some(f.steps)),
            text(f.end_time_s),
            text(f.ltr_abs_max),
            text(f.ltr_violation_s),
            text(f.roll_abs_max_deg),
            text(f.speed_min_kmh),
            text(f.speed_mean_kmh),
            text(f.path_deviation_max_m),
            text(f.steering_correction_max_deg),
            text(f.cost),
            text(f.fallback_steps),
            text(f.step_time_median_us),
            text(f.step_time_max_us),
            run.source.clone(),
            failure.unwrap_or_default().to_owned(),
        ]
    };
    let rows = all.iter().map(row).collect();
    (
        &[
            "scene",
            "label",
            "controller",
            "seed",
            "mirrored",
            "outcome",
            "steps",
            "end_time_s",
            "ltr_abs_max",
            "ltr_violation_s",
            "roll_abs_max_deg",
            "speed_min_kmh",
            "speed_mean_kmh",
            "path_deviation_max_m",
            "steering_correction_max_deg",
            "cost",
            "fallback_steps",
            "step_time_median_us",
            "step_time_max_us",
            "log",
            "failure",
        ],
        rows,
    )
}

fn problems(report: &Report) -> Content {
    let row = |p: &super::data::Problem| vec![p.file.clone(), text(p.line), p.reason.clone()];
    (
        &["file", "line", "reason"],
        report.problems.iter().map(row).collect(),
    )
}
