//! `report`: the page from logs alone.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Result, ensure};
use serde::Serialize;

use super::data::{Problem, RunFigures};
use super::log::Renamed;
use super::{REPORT_FILE, collect, has_runs, write};
use crate::cli::ReportArgs;
use crate::output::{print_json, print_line};

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    report: String,
    runs: Vec<PrintedRun<'a>>,
    problems: &'a [Problem],
}

#[derive(Serialize)]
struct PrintedRun<'a> {
    scene: &'a str,
    label: &'a str,
    controller: &'a str,
    seed: Option<u64>,
    outcome: Option<vehicle_dyn::metrics::Outcome>,
    log: &'a str,
    figures: &'a RunFigures,
}

/// Makes the page. What cannot be read is named in it and on standard error.
///
/// # Errors
/// When no log could be read at all, or the page cannot be written.
pub fn command(args: &ReportArgs) -> Result<()> {
    let renamed: Renamed = args.column.iter().cloned().collect();
    let mut report = collect(&args.paths, &renamed);
    let mut errors = std::io::stderr().lock();
    for problem in &report.problems {
        // Nobody is left to tell if standard error is closed.
        let _ = writeln!(errors, "warning: {problem}");
    }
    drop(errors);
    ensure!(
        has_runs(&report),
        "no log could be read: give folders with log.csv in them, or CSV files with a column `time_s` and others of a log (--column OURS=THEIRS names them)"
    );
    let mut words = vec!["rollover-app report".to_owned()];
    words.extend(args.paths.iter().map(|path| path.display().to_string()));
    words.extend(
        args.column
            .iter()
            .map(|(ours, theirs)| format!("--column {ours}={theirs}")),
    );
    if report.provenance.command.is_empty() {
        report.provenance.command = words.join(" ");
    }
    if let Some(title) = &args.title {
        report.title.clone_from(title);
    }
    let written = write(
        &report,
        &args.out.clone().unwrap_or_else(|| default_page(args)),
    )?;
    let scenes = report.scenes.iter();
    let runs: Vec<PrintedRun<'_>> = scenes
        .flat_map(|scene| scene.runs.iter().map(move |run| (scene, run)))
        .map(|(scene, run)| PrintedRun {
            scene: &scene.name,
            label: &run.label,
            controller: &run.controller,
            seed: run.seed,
            outcome: run.outcome,
            log: &run.source,
            figures: &run.figures,
        })
        .collect();
    if args.json {
        return print_json(&Printed {
            report: written.page.display().to_string(),
            runs,
            problems: &report.problems,
        });
    }
    print_line(&format!(
        "report: {} ({:.1} MB; {} of {}, {} figures and {} tables beside it)",
        written.page.display(),
        written.page_bytes as f64 / 1e6,
        count(runs.len(), "run"),
        count(report.scenes.len(), "scene"),
        written.figures,
        written.tables
    ))
}

fn count(number: usize, noun: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {noun}{plural}")
}

/// In the folder that was asked for; for files, where the command runs.
fn default_page(args: &ReportArgs) -> PathBuf {
    match args.paths.first() {
        Some(folder) if folder.is_dir() => folder.join(REPORT_FILE),
        _ => PathBuf::from(REPORT_FILE),
    }
}
