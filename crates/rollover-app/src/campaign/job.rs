//! One run: its controller, the drive, and the files it leaves.

use std::path::{Path, PathBuf};

use anyhow::Result;
use indicatif::ProgressBar;
use sysid::{Identification, Progress};
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

use crate::closed_loop::{self, Built, Recorded, Run, SteeringProfile, Watch};
use crate::interrupt::Interrupt;
use crate::output::{create_folder, remove_old_file, write_json, write_whole};
use crate::progress;
use crate::report::{
    self, FAILURE_FILE, LOG_FILE, REPORT_FILE, SCENE_FILE, SUMMARY_FILE, SceneFile,
};
use crate::scenario::{ReferenceAhead, Scenario};
use crate::summary::{ModelSummary, RunIdentity, Summary};

/// What tells that a run's results are those of the same program and settings.
pub(crate) const FINGERPRINT_FILE: &str = "fingerprint";
const MAT_LOG: &str = "log.mat";
const MODEL: &str = "model.json";
const IDENTIFICATION_TEXT: &str = "identification.txt";
const IDENTIFICATION_JSON: &str = "identification.json";

/// One run to be made.
pub(crate) struct Job<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) vehicle: &'a ReadyVehicle,
    pub(crate) terrain: Terrain,
    pub(crate) controller: &'a str,
    pub(crate) seed: u64,
    /// Whether `scenario` is the mirror image of the one in the file.
    pub(crate) mirrored: bool,
    pub(crate) speed_reference_kmh: f64,
    pub(crate) recorded: Option<&'a Recorded<'a>>,
    pub(crate) recording: &'a [PathBuf],
    /// Whether its log is kept, and all that goes with a log; without, only the summary is.
    pub(crate) logged: bool,
    pub(crate) out: PathBuf,
}

impl Job<'_> {
    /// Runs, then writes the summary beside the log.
    pub(crate) fn run(&self, interrupt: &Interrupt, bar: &ProgressBar) -> Result<Summary> {
        let built = self.build(interrupt, bar)?;
        self.drive(built, interrupt, bar)
    }

    /// Makes the controller; nothing for [`DRIVER`](crate::scenario::DRIVER) and
    /// [`FLOOR`](crate::scenario::FLOOR). Writes nothing.
    pub(crate) fn build(&self, interrupt: &Interrupt, bar: &ProgressBar) -> Result<Option<Built>> {
        let settings = self.scenario.controller(self.controller)?;
        let (Some(settings), Some(recorded)) = (settings, self.recorded) else {
            return Ok(None);
        };
        let progress = |progress: &Progress| {
            bar.set_length(progress.total as u64);
            bar.set_position(progress.done as u64);
            bar.set_message(format!("{}: {}", self.controller, progress.stage));
        };
        let watch = Watch {
            interrupt,
            progress: &progress,
        };
        closed_loop::controller(self.scenario, settings, recorded, watch).map(Some)
    }

    /// Drives with the controller that was built, then writes the summary beside the log.
    pub(crate) fn drive(
        &self,
        built: Option<Built>,
        interrupt: &Interrupt,
        bar: &ProgressBar,
    ) -> Result<Summary> {
        let (controller, identification) = built.map_or((None, None), |built: Built| {
            (Some(built.controller), built.identification)
        });
        progress::begin(bar, self.scenario.steps(), self.controller);
        interrupt.check("before the first step", "the run was not begun")?;
        create_folder(&self.out)?;
        remove_old_results(&self.out)?;
        let log = self.out.join(LOG_FILE);
        if self.logged {
            self.describe(identification.as_deref())?;
        }
        let settings = self.scenario.controller(self.controller)?;
        let preview = match settings.map(|s| s.reference) {
            Some(ReferenceAhead::Preview) => Some(SteeringProfile::record(
                self.scenario,
                self.vehicle,
                &self.terrain,
                self.seed,
            )?),
            _ => None,
        };
        let run = Run {
            preview,
            scenario: self.scenario,
            vehicle: self.vehicle,
            terrain: self.terrain.clone(),
            speed_reference_kmh: self.speed_reference_kmh,
            seed: self.seed,
            fixed_target_speed_kmh: self
                .scenario
                .fixed_target_speed_kmh(self.controller, self.speed_reference_kmh),
            controller,
        };
        let to = self.logged.then_some(log.as_path());
        let finished = closed_loop::run(run, to, interrupt, || bar.inc(1))?;
        let summary = Summary::of_log(
            RunIdentity {
                scenario: self.scenario.name.clone(),
                vehicle: self.vehicle.parameters().name.clone(),
                controller: self.controller.to_owned(),
                seed: self.seed,
                mirrored: self.mirrored,
                turns_m: self.scenario.course.turns_m(),
                recording: (!self.recording.is_empty()).then(|| {
                    let files = self.recording.iter().map(|file| file.display().to_string());
                    files.collect::<Vec<_>>().join(", ")
                }),
                speed_reference_kmh: self.speed_reference_kmh,
                target_speed_bounds_kmh: settings.map(|_| self.scenario.bounds.target_speed_kmh),
                model: identification.map(|i| ModelSummary::of_report(&i.report)),
            },
            finished.outcome,
            &finished.rows,
            settings.map(|s| &s.input_weights),
            self.scenario.sample_time_s,
        );
        if self.logged {
            // MATLAB reads this one without an import script.
            let columns = report::log::read(&log, &report::log::Renamed::new()).columns;
            report::mat::write(&self.out.join(MAT_LOG), &columns)?;
        }
        write_json(&self.out.join(SUMMARY_FILE), &summary)?;
        Ok(summary)
    }

    /// Writes what a log does not hold.
    fn describe(&self, identification: Option<&Identification>) -> Result<()> {
        if let Some(identification) = identification {
            write_identification(&self.out, identification)?;
        }
        let mut described = SceneFile::new(
            self.scenario,
            self.vehicle.parameters(),
            self.controller,
            self.seed,
            Some(&self.terrain),
        )?;
        described.run.mirrored = self.mirrored;
        write_whole(
            &self.out.join(SCENE_FILE),
            &(serde_json::to_string(&described)? + "\n"),
        )
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
pub(crate) fn remove_old_results(folder: &Path) -> Result<()> {
    for name in [
        SUMMARY_FILE,
        FAILURE_FILE,
        FINGERPRINT_FILE,
        SCENE_FILE,
        MAT_LOG,
        MODEL,
        IDENTIFICATION_TEXT,
        IDENTIFICATION_JSON,
    ] {
        remove_old_file(&folder.join(name))?;
    }
    report::remove_old(&folder.join(REPORT_FILE))
}

pub(crate) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

pub(crate) fn step_bar(scenario: &Scenario, name: &str) -> ProgressBar {
    progress::bar(scenario.steps(), name)
}
