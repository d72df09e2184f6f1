//! The tables of a report as CSV files.

use anyhow::Result;

use super::data::Report;

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
            claim.claim.clone(),
            claim.paper.clone(),
            claim.ours.clone(),
            seeds.join(" "),
            text(claim.fraction),
            claim.verdict.to_string(),
            text(claim.reason.as_ref().map(|reason| &reason.text)),
        ]
    };
    (
        &[
            "id", "claim", "paper", "ours", "seeds", "fraction", "verdict", "reason",
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

fn runs(report: &Report) -> Content {
    let mut rows = Vec::new();
    for scene in &report.scenes {
        for run in &scene.runs {
            let f = &run.figures;
            rows.push(vec![
                scene.name.clone(),
                run.label.clone(),
                run.controller.clone(),
                text(run.seed),
                run.mirrored.to_string(),
                text(run.outcome),
                f.steps.to_string(),
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
            ]);
        }
    }
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
