//! A report from logs alone.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use vehicle_dyn::metrics::Outcome;

use super::campaign::Campaign;
use super::cast::rank;
use super::claims;
use super::data::{Limits, Problem, Provenance, Report, Role, Run, Scene};
use super::log::{self, Renamed, TIME};
use super::measures::{add_derived, outcome, run_figures, seed_rows};
use super::scene_file::{SCENE_FILE, SceneFile};
use crate::scenario;
use crate::summary::LTR_LIFT_OFF;

/// Name of the logs that are looked for in a folder.
pub const LOG_FILE: &str = "log.csv";

/// Name of the file with a run's numbers, beside its log.
pub const SUMMARY_FILE: &str = "summary.json";

/// The part of `summary.json` that helps; more may be there, and all of it may be missing.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct KnownSummary {
    scenario: Option<String>,
    vehicle: Option<String>,
    controller: Option<String>,
    seed: Option<u64>,
    mirrored: bool,
    outcome: Option<Outcome>,
    steps: Option<usize>,
}

/// Builds a report from logs: files, and all `log.csv` in folders and below. What cannot be read
/// is in [`Report::problems`]. `scene.json` or `summary.json` beside a log give names, road and
/// vehicle; without them a log is shown as it is.
#[must_use]
pub fn collect(paths: &[PathBuf], renamed: &Renamed) -> Report {
    let mut report = Report {
        title: "Report on logs".into(),
        provenance: provenance(),
        ..Report::default()
    };
    let mut logs = Vec::new();
    let mut campaigns = Vec::new();
    for path in paths {
        match Campaign::read(path, &mut report.problems) {
            Some(campaign) => {
                let of_run = campaign.file.runs.iter();
                let of_run = of_run.map(|run| path.join(run).join(LOG_FILE));
                logs.extend(of_run.filter(|log| log.is_file()));
                campaigns.push(campaign);
            }
            None => find_logs(path, &mut logs, &mut report.problems),
        }
    }
    logs.dedup();
    for log in &logs {
        add_log(&mut report, log, renamed);
    }
    for scene in &mut report.scenes {
        name_apart(&mut scene.runs);
        let names: Vec<String> = scene
            .runs
            .iter()
            .map(|run| run.controller.clone())
            .collect();
        scene.runs.sort_by_key(|run| {
            let place = names.iter().position(|name| *name == run.controller);
            (
                run.role.order(),
                rank(&run.controller),
                place,
                run.mirrored,
                run.seed,
            )
        });
        if scene.vehicle.is_none() {
            report.notes.push(format!(
                "{}: the logs do not say what vehicle it was; the replay draws {} with typical measures.",
                scene.title,
                super::data::VehicleShape::typical().name
            ));
        }
    }
    let seeds = report.scenes.iter().flat_map(|s| &s.runs);
    let mut seeds: Vec<u64> = seeds.filter_map(|run| run.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    report.provenance.seeds = seeds;
    report.seeds = seed_rows(&report.scenes);
    if let [scene] = report.scenes.as_slice() {
        report.title.clone_from(&scene.title);
    }
    if let [campaign] = campaigns.as_slice() {
        add_campaign(&mut report, campaign);
    }
    report
}

/// What a campaign adds to the logs of its runs.
fn add_campaign(report: &mut Report, campaign: &Campaign) {
    report.title = "Rollover prevention from data: the paper's claims, checked".into();
    report.asked = claims::QUESTION.map(str::to_owned).to_vec();
    report.claims = claims::judge(campaign);
    report.timing = campaign.timing_rows();
    report.seeds = campaign.seed_rows(&report.scenes);
    report.unlogged = campaign.unlogged(&report.scenes);
    report.notes.insert(0, claims::RULE.into());
    for scene in &mut report.scenes {
        if let Some(seed) = scene.runs.iter().find_map(|run| run.seed) {
            let _ = write!(
                scene.description,
                " Drawn and replayed is one run of each controller: recording seed {seed}, the course as it is. What the other seeds give is in the table of outcomes."
            );
        }
    }
    if let Some(table) = &campaign.timing {
        report
            .notes
            .push(format!("{}.", table.deepc_equals_rd_deepc));
    }
    for failure in &campaign.failures {
        report.notes.push(failure.to_string());
    }
    report.provenance.seeds.clone_from(&campaign.file.seeds);
    report.provenance.command.clone_from(&campaign.file.command);
}

/// Where this program runs.
fn provenance() -> Provenance {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    Provenance {
        version: env!("CARGO_PKG_VERSION").into(),
        command: String::new(),
        seeds: Vec::new(),
        machine: format!(
            "{} {}, {cores} cores",
            std::env::consts::OS,
            std::env::consts::ARCH
        ),
    }
}

fn find_logs(path: &Path, logs: &mut Vec<PathBuf>, problems: &mut Vec<Problem>) {
    let mut note = |path: &Path, reason: String| {
        problems.push(Problem {
            file: path.display().to_string(),
            line: None,
            reason,
        });
    };
    if !path.is_dir() {
        return logs.push(path.to_path_buf());
    }
    let mut waiting = vec![path.to_path_buf()];
    let before = logs.len();
    while let Some(folder) = waiting.pop() {
        let entries = match std::fs::read_dir(&folder) {
            Ok(entries) => entries,
            Err(error) => {
                note(&folder, format!("cannot be read ({error}); left out"));
                continue;
            }
        };
        for entry in entries.flatten() {
            // A link to a folder above would never end.
            let Ok(kind) = entry.file_type() else {
                continue;
            };
            if kind.is_dir() {
                waiting.push(entry.path());
            } else if entry.file_name() == LOG_FILE {
                logs.push(entry.path());
            }
        }
    }
    logs[before..].sort();
    if logs.len() == before {
        note(
            path,
            format!("holds no {LOG_FILE}, nor does a folder below it"),
        );
    }
}

fn add_log(report: &mut Report, path: &Path, renamed: &Renamed) {
    let mut table = log::read(path, renamed);
    let cut = !table.problems.is_empty();
    report.problems.append(&mut table.problems);
    if table.rows() == 0 {
        return;
    }
    let folder = path.parent().unwrap_or(Path::new("."));
    let summary = read_summary(&folder.join(SUMMARY_FILE), &mut report.problems);
    let SceneFile {
        scene,
        mut run,
        weights,
    } = describe(folder, path, summary.as_ref(), &mut report.problems);
    add_derived(&mut table.columns);
    run.source = path.display().to_string();
    run.figures = run_figures(&table.columns, weights.as_ref());
    let judged = outcome(&table.columns, scene.road.as_ref().map(|road| road.width_m));
    let summed_up = summary.as_ref().and_then(|s| s.outcome);
    let rows = table.rows();
    let incomplete = cut
        || summary
            .as_ref()
            .is_some_and(|s| s.steps.is_some_and(|n| n != rows));
    run.outcome = if incomplete {
        judged
    } else {
        summed_up.or(judged)
    };
    if let (Some(said), Some(judged)) = (summed_up, judged)
        && said != judged
    {
        report.problems.push(Problem {
            file: run.source.clone(),
            line: None,
            reason: format!("the log shows `{judged}`, summary.json beside it says `{said}`"),
        });
    }
    run.columns = table.columns;
    let place = report
        .scenes
        .iter()
        .position(|s| s.name == scene.name && s.title == scene.title);
    let place = place.unwrap_or_else(|| {
        report.scenes.push(scene);
        report.scenes.len() - 1
    });
    report.scenes[place].runs.push(run);
}

fn read_summary(path: &Path, problems: &mut Vec<Problem>) -> Option<KnownSummary> {
    read_json(path, problems)
}

/// Reads a file that may be missing.
pub(super) fn read_json<T: for<'de> Deserialize<'de>>(
    path: &Path,
    problems: &mut Vec<Problem>,
) -> Option<T> {
    let text = std::fs::read(path).ok()?;
    match serde_json::from_slice(&text) {
        Ok(value) => Some(value),
        Err(error) => {
            problems.push(Problem {
                file: path.display().to_string(),
                line: u64::try_from(error.line()).ok().filter(|line| *line > 0),
                reason: format!(
                    "cannot be understood ({error}); the log beside it is shown without it"
                ),
            });
            None
        }
    }
}

/// What is known of a log beside its columns.
fn describe(
    folder: &Path,
    log: &Path,
    summary: Option<&KnownSummary>,
    problems: &mut Vec<Problem>,
) -> SceneFile {
    let own_log = log.file_name().is_some_and(|name| name == LOG_FILE);
    if own_log && let Some(found) = read_json(&folder.join(SCENE_FILE), problems) {
        return found;
    }
    if own_log && let Some(found) = summary.and_then(by_name) {
        return found;
    }
    let summary = summary.filter(|_| own_log);
    let stem = |path: &Path| path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let name = if own_log { stem(folder) } else { stem(log) };
    let controller = summary.and_then(|s| s.controller.clone());
    let label = controller.or(name).unwrap_or_else(|| "log".into());
    let title = summary.and_then(|s| s.scenario.clone());
    SceneFile {
        scene: Scene {
            name: title.clone().unwrap_or_else(|| "logs".into()),
            title: title.unwrap_or_else(|| "Logs".into()),
            limits: Limits {
                ltr: Some(LTR_LIFT_OFF),
                ..Limits::default()
            },
            ..Scene::default()
        },
        run: Run {
            role: Role::of_name(&label),
            controller: label.clone(),
            label,
            seed: summary.and_then(|s| s.seed),
            mirrored: summary.is_some_and(|s| s.mirrored),
            ..Run::default()
        },
        weights: None,
    }
}

/// By the scenario and the vehicle that the summary names, if both are known here.
fn by_name(summary: &KnownSummary) -> Option<SceneFile> {
    let scenario = scenario::load(summary.scenario.as_deref()?).ok()?;
    let vehicle = vehicle_dyn::vehicles::find(summary.vehicle.as_deref()?).ok()?;
    let controller = summary.controller.as_deref()?;
    // Its ground may have come from a file: what is not known is not drawn.
    SceneFile::new(&scenario, &vehicle, controller, summary.seed?, None).ok()
}

/// Makes the labels of a scene's runs differ: by course, by seed, else by their files.
fn name_apart(runs: &mut [Run]) {
    let several_seeds = runs.iter().any(|a| {
        let other = |b: &Run| b.controller == a.controller && b.seed != a.seed;
        runs.iter().any(other)
    });
    for run in runs.iter_mut() {
        if run.mirrored {
            run.label += ", mirrored";
        }
        if let Some(seed) = run.seed.filter(|_| several_seeds) {
            run.label = format!("{}, seed {seed}", run.label);
        }
    }
    let known: Vec<(String, String)> = runs
        .iter()
        .map(|run| (run.label.clone(), run.source.clone()))
        .collect();
    for run in runs.iter_mut() {
        let same = known.iter().filter(|(label, _)| *label == run.label);
        let files: Vec<&Path> = same.map(|(_, source)| Path::new(source)).collect();
        if files.len() > 1 {
            run.label = format!(
                "{} ({})",
                run.label,
                own_part(Path::new(&run.source), &files)
            );
        }
    }
}

/// What a file's path has that those beside it do not begin with.
fn own_part(file: &Path, files: &[&Path]) -> String {
    let shared = |folder: &&Path| files.iter().all(|other| other.starts_with(folder));
    let folder = file.ancestors().skip(1).find(shared);
    let own = folder.and_then(|folder| file.strip_prefix(folder).ok());
    let own = own.unwrap_or(file);
    let own = match own.parent() {
        Some(parent) if own.ends_with(LOG_FILE) && parent != Path::new("") => parent,
        _ => own,
    };
    own.display().to_string()
}

/// Whether a report shows anything.
#[must_use]
pub fn has_runs(report: &Report) -> bool {
    report.scenes.iter().any(|scene| {
        let any = |run: &Run| run.columns.get(TIME).is_some_and(|time| !time.is_empty());
        scene.runs.iter().any(any)
    })
}
