//! Making runs, several at a time.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, anyhow};
use indicatif::ProgressBar;
use sysid::{Identification, Progress};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::terrain::Terrain;

use crate::closed_loop::{self, Built, Recorded, Run, Watch};
use crate::interrupt::Interrupt;
use crate::output::{create_folder, write_json, write_whole};
use crate::progress;
use crate::report::{self, REPORT_FILE, SCENE_FILE, SceneFile};
use crate::scenario::Scenario;
use crate::summary::{ModelSummary, RunIdentity, Summary};

const MAT_LOG: &str = "log.mat";
const MODEL: &str = "model.json";
const IDENTIFICATION_TEXT: &str = "identification.txt";
const IDENTIFICATION_JSON: &str = "identification.json";

/// One run to be made.
pub(super) struct Job<'a> {
    pub(super) scenario: &'a Scenario,
    pub(super) vehicle: &'a VehicleParameters,
    pub(super) terrain: Terrain,
    pub(super) controller: &'a str,
    pub(super) seed: u64,
    pub(super) speed_reference_kmh: f64,
    pub(super) recorded: Option<&'a Recorded<'a>>,
    pub(super) recording: &'a [PathBuf],
    pub(super) out: PathBuf,
}

/// A run that was made.
pub(super) struct RunResult {
    pub(super) summary: Summary,
}

impl Job<'_> {
    /// Runs, then writes the summary beside the log.
    pub(super) fn run(&self, interrupt: &Interrupt, bar: &ProgressBar) -> Result<RunResult> {
        let settings = self.scenario.controller(self.controller)?;
        let built = match (settings, self.recorded) {
            (Some(settings), Some(recorded)) => {
                let progress = |progress: &Progress| {
                    bar.set_length(progress.total as u64);
                    bar.set_position(progress.done as u64);
                    bar.set_message(format!("{}: {}", self.controller, progress.stage));
                };
                let watch = Watch {
                    interrupt,
                    progress: &progress,
                };
                Some(closed_loop::controller(
                    self.scenario,
                    settings,
                    recorded,
                    watch,
                )?)
            }
            _ => None,
        };
        let (controller, identification) = built.map_or((None, None), |built: Built| {
            (Some(built.controller), built.identification)
        });
        progress::begin(bar, self.scenario.steps(), self.controller);
        interrupt.check("before the first step", "nothing was written")?;
        create_folder(&self.out)?;
        remove_old_results(&self.out)?;
        if let Some(identification) = &identification {
            write_identification(&self.out, identification)?;
        }
        let described = SceneFile::new(
            self.scenario,
            self.vehicle,
            self.controller,
            self.seed,
            Some(&self.terrain),
        )?;
        write_whole(
            &self.out.join(SCENE_FILE),
            &(serde_json::to_string(&described)? + "\n"),
        )?;
        let run = Run {
            scenario: self.scenario,
            vehicle: self.vehicle,
            terrain: self.terrain.clone(),
            speed_reference_kmh: self.speed_reference_kmh,
            seed: self.seed,
            controller,
        };
        let log = self.out.join("log.csv");
        let finished = closed_loop::run(run, &log, interrupt, || bar.inc(1))?;
        let summary = Summary::of_log(
            RunIdentity {
                scenario: self.scenario.name.clone(),
                vehicle: self.vehicle.name.clone(),
                controller: self.controller.to_owned(),
                seed: self.seed,
                recording: (!self.recording.is_empty()).then(|| {
                    let files = self.recording.iter().map(|file| file.display().to_string());
                    files.collect::<Vec<_>>().join(", ")
                }),
                speed_reference_kmh: self.speed_reference_kmh,
                model: identification.map(|i| ModelSummary::of_report(&i.report)),
            },
            finished.outcome,
            &finished.rows,
            settings.map(|s| &s.input_weights),
            self.scenario.sample_time_s,
        );
        write_json(&self.out.join("summary.json"), &summary)?;
        // MATLAB reads this one without an import script.
        let columns = report::log::read(&log, &report::log::Renamed::new()).columns;
        report::mat::write(&self.out.join(MAT_LOG), &columns)?;
        Ok(RunResult { summary })
    }
}

/// Writes the model and all that was found beside it.
fn write_identification(folder: &Path, found: &Identification) -> Result<()> {
    write_whole(&folder.join(MODEL), &found.model.to_json()?)?;
    write_whole(&folder.join(IDENTIFICATION_TEXT), found.report.to_string())?;
    write_json(&folder.join(IDENTIFICATION_JSON), &found.report)
}

/// Removes what an earlier run or campaign derived from its logs: beside fresh logs it would lie if
/// this one is interrupted.
pub(super) fn remove_old_results(folder: &Path) -> Result<()> {
    for name in [
        "summary.json",
        SCENE_FILE,
        MAT_LOG,
        MODEL,
        IDENTIFICATION_TEXT,
        IDENTIFICATION_JSON,
    ] {
        let old = folder.join(name);
        match std::fs::remove_file(&old) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(e).with_context(|| format!("cannot replace {}", old.display()));
            }
            _ => {}
        }
    }
    report::remove_old(&folder.join(REPORT_FILE))
}

/// Makes the runs, `workers` at a time, in the order given.
pub(super) fn run_all(
    jobs: &[Job<'_>],
    workers: usize,
    interrupt: &Interrupt,
) -> Vec<Result<RunResult>> {
    let all = progress::bar(jobs.len(), "all runs");
    all.tick();
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<Result<RunResult>>>> =
        jobs.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..workers.min(jobs.len()) {
            scope.spawn(|| {
                // A run that has not begun when the user stops the program leaves what an earlier
                // one wrote in its folder.
                while let Some((job, result)) = (!interrupt.is_raised())
                    .then(|| next.fetch_add(1, Ordering::Relaxed))
                    .and_then(|index| jobs.get(index).zip(results.get(index)))
                {
                    let bar = step_bar(job.scenario, job.controller);
                    let made = job
                        .run(interrupt, &bar)
                        .with_context(|| format!("run {}", job.controller));
                    bar.finish_and_clear();
                    all.inc(1);
                    *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(made);
                }
            });
        }
    });
    all.finish_and_clear();
    let made = results
        .into_iter()
        .map(|r| r.into_inner().unwrap_or_else(PoisonError::into_inner));
    made.map(|r| r.unwrap_or_else(|| Err(anyhow!("the run was not begun"))))
        .collect()
}

pub(super) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

pub(super) fn step_bar(scenario: &Scenario, name: &str) -> ProgressBar {
    progress::bar(scenario.steps(), name)
}
