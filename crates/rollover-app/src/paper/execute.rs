//! Making the runs of a plan, several groups at a time.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use deepc_core::data::Dataset;
use indicatif::ProgressBar;
use serde::de::DeserializeOwned;

use super::fingerprint::Program;
use super::plan::{Plan, PlannedRun};
use crate::campaign::RECORDING;
use crate::campaign::job::{FINGERPRINT_FILE, Job, remove_old_results, step_bar};
use crate::closed_loop::Recorded;
use crate::interrupt::{Interrupt, Interrupted};
use crate::output::{create_folder, write_json, write_whole};
use crate::progress;
use crate::record::{self, record};
use crate::report::{FAILURE_FILE, Failure, LOG_FILE, SUMMARY_FILE, TIMING_FILE};
use crate::run_log;
use crate::summary::Summary;
use crate::timing::{self, Follow, LoggedRun, Timing, TimingTable};

/// The controllers of the table of costs and times: whole matrix, reduced matrix, model.
const TIMED: [&str; 3] = ["deepc-1", "rd-deepc-1", "lmpc-1"];
const TIMING_FINGERPRINT_FILE: &str = "timing.fingerprint";

/// Runs that share a recording.
#[derive(Clone, Copy)]
struct Group {
    scene: usize,
    seed: u64,
}

/// How many runs were made, and how many were there already.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Made {
    pub(super) now: usize,
    pub(super) before: usize,
}

/// Work on a plan.
pub(super) struct Execution<'a> {
    plan: &'a Plan,
    out: &'a Path,
    interrupt: &'a Interrupt,
    program: Option<Program>,
    all: ProgressBar,
    made: AtomicUsize,
    kept: AtomicUsize,
}

impl<'a> Execution<'a> {
    pub(super) fn new(plan: &'a Plan, out: &'a Path, interrupt: &'a Interrupt) -> Self {
        Self {
            plan,
            out,
            interrupt,
            // Without it everything is made again.
            program: Program::running().ok(),
            all: progress::bar(plan.runs().count(), "all runs"),
            made: AtomicUsize::new(0),
            kept: AtomicUsize::new(0),
        }
    }

    /// Makes what is not there yet, `workers` groups at a time. The first error stops all.
    pub(super) fn all(&self, workers: usize) -> Result<Made> {
        self.all.tick();
        let groups: Vec<Group> = self.groups();
        let next = AtomicUsize::new(0);
        let error: Mutex<Option<anyhow::Error>> = Mutex::new(None);
        let failed = || error.lock().unwrap_or_else(PoisonError::into_inner);
        std::thread::scope(|scope| {
            for _ in 0..workers.min(groups.len()) {
                scope.spawn(|| {
                    while failed().is_none()
                        && let Some(&group) = groups.get(next.fetch_add(1, Ordering::Relaxed))
                    {
                        if let Err(wrong) = self.group(group) {
                            failed().get_or_insert(wrong);
                        }
                    }
                });
            }
        });
        self.all.finish_and_clear();
        let made = Made {
            now: self.made.load(Ordering::Relaxed),
            before: self.kept.load(Ordering::Relaxed),
        };
        let error = error.into_inner().unwrap_or_else(PoisonError::into_inner);
        error.map_or(Ok(made), |error| Err(self.explained(error, made)))
    }

    /// An interruption in the words of the whole campaign.
    fn explained(&self, error: anyhow::Error, made: Made) -> anyhow::Error {
        if !error.is::<Interrupted>() {
            return error;
        }
        let done = made.now + made.before;
        Interrupted {
            after: format!("after {done} of {} runs", self.plan.runs().count()),
            kept: format!(
                "{} holds them, and the same command goes on from there",
                self.out.display()
            ),
        }
        .into()
    }

    /// The group that takes longest, because the timing goes with it, comes first, then the scenarios
    /// from the last, whose runs take longer, so that the threads end together.
    fn groups(&self) -> Vec<Group> {
        let mut groups = Vec::new();
        for scene in (0..self.plan.scenes.len()).rev() {
            let seeds = self.plan.seeds.iter();
            groups.extend(seeds.map(|&seed| Group { scene, seed }));
        }
        groups.sort_by_key(|group| timed(&self.plan.group(group.scene, group.seed)).is_none());
        groups
    }

    fn group(&self, group: Group) -> Result<()> {
        let runs = self.plan.group(group.scene, group.seed);
        let due: Vec<&PlannedRun> = runs.iter().filter(|run| !self.is_there(run)).collect();
        let kept = runs.len() - due.len();
        self.kept.fetch_add(kept, Ordering::Relaxed);
        self.all.inc(kept as u64);
        let to_time = timed(&runs).filter(|run| !self.is_timed(run));
        if due.is_empty() && to_time.is_none() {
            return Ok(());
        }
        let data = self.recording(group)?;
        let recorded = data.as_ref().map(Recorded::new);
        for run in due {
            let named = || format!("run {}", self.plan.folder(run).display());
            self.run(run, recorded.as_ref().map_err(ToString::to_string))
                .with_context(named)?;
            self.made.fetch_add(1, Ordering::Relaxed);
            self.all.inc(1);
        }
        match (to_time, recorded) {
            (Some(run), Ok(recorded)) => self.time(run, &recorded),
            _ => Ok(()),
        }
    }

    /// Records; a recording that cannot be made is a result, told in words.
    fn recording(&self, group: Group) -> Result<Result<Dataset, String>> {
        let scene = &self.plan.scenes[group.scene];
        let scenario = &scene.as_it_is.scenario;
        match record(scenario, &scene.vehicle, group.seed, self.interrupt) {
            Ok((data, summary)) => {
                if self.plan.seeds.first() == Some(&group.seed) {
                    let folder = self.out.join(&scenario.name);
                    create_folder(&folder)?;
                    record::write(&folder.join(RECORDING), &data)?;
                    write_json(&folder.join("recording.json"), &summary)?;
                }
                Ok(Ok(data))
            }
            Err(error) if error.is::<Interrupted>() => Err(error),
            Err(error) => Ok(Err(format!("{error:#}"))),
        }
    }

    fn run(&self, run: &PlannedRun, recorded: Result<&Recorded<'_>, String>) -> Result<()> {
        let (scene, driven) = (&self.plan.scenes[run.scene], self.plan.driven(run));
        let scenario = &driven.scenario;
        let out = self.out.join(self.plan.folder(run));
        let bar = step_bar(scenario, &run.controller);
        let by_data = scenario.controllers.contains_key(&run.controller);
        let job = Job {
            scenario,
            vehicle: &scene.vehicle,
            terrain: driven.terrain.clone(),
            controller: &run.controller,
            seed: run.seed,
            mirrored: run.mirrored,
            speed_reference_kmh: scenario.speed_reference_kmh,
            recorded: recorded.as_ref().ok().copied().filter(|_| by_data),
            recording: &[],
            logged: run.logged,
            out: out.clone(),
        };
        let built = match recorded {
            Err(reason) if by_data => Err(reason),
            _ => match job.build(self.interrupt, &bar) {
                Err(error) if error.is::<Interrupted>() => return Err(error),
                built => built.map_err(|error| format!("{error:#}")),
            },
        };
        match built {
            Ok(built) => {
                job.drive(built, self.interrupt, &bar)?;
            }
            Err(reason) => {
                create_folder(&out)?;
                remove_old_results(&out)?;
                write_json(
                    &out.join(FAILURE_FILE),
                    &Failure {
                        scenario: scenario.name.clone(),
                        controller: run.controller.clone(),
                        seed: run.seed,
                        mirrored: run.mirrored,
                        reason,
                    },
                )?;
            }
        }
        bar.finish_and_clear();
        self.sign(&out.join(FINGERPRINT_FILE), |program| {
            program.of_run(self.plan, run)
        })
    }

    /// Whether a run's results are there, and are what would be made now.
    fn is_there(&self, run: &PlannedRun) -> bool {
        let folder = self.out.join(self.plan.folder(run));
        let whole = reads::<Summary>(&folder.join(SUMMARY_FILE))
            && (!run.logged || folder.join(LOG_FILE).is_file());
        (whole || reads::<Failure>(&folder.join(FAILURE_FILE)))
            && self.same(&folder.join(FINGERPRINT_FILE), |program| {
                program.of_run(self.plan, run)
            })
    }

    fn same(&self, file: &Path, expected: impl Fn(Program) -> String) -> bool {
        let Some(program) = self.program else {
            return false;
        };
        std::fs::read_to_string(file).is_ok_and(|found| found == expected(program))
    }

    /// Writes what [`Self::same`] looks for.
    fn sign(&self, file: &Path, fingerprint: impl Fn(Program) -> String) -> Result<()> {
        self.program
            .map_or(Ok(()), |program| write_whole(file, fingerprint(program)))
    }

    fn is_timed(&self, run: &PlannedRun) -> bool {
        reads::<TimingTable>(&self.out.join(TIMING_FILE))
            && self.same(&self.out.join(TIMING_FINGERPRINT_FILE), |program| {
                program.of_timing(self.plan, run)
            })
    }

    /// Times the programs on the runs that were just made.
    fn time(&self, run: &PlannedRun, recorded: &Recorded<'_>) -> Result<()> {
        let scenario = &self.plan.driven(run).scenario;
        let log = |controller: &str| {
            let beside = PlannedRun {
                controller: controller.into(),
                ..run.clone()
            };
            let file = self.out.join(self.plan.folder(&beside)).join(LOG_FILE);
            run_log::read(&file)
        };
        // A controller that could not be made has no log; then there is no table.
        let [Ok(deepc), Ok(rd_deepc), Ok(lmpc)] = TIMED.map(log) else {
            return Ok(());
        };
        let logged = |index: usize, log| {
            let name = TIMED[index];
            LoggedRun {
                name,
                settings: &scenario.controllers[name],
                log,
            }
        };
        let bar = progress::bar(1, "timing");
        let mut told = |done: usize, total: usize, what: &str| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
            bar.set_message(format!("timing: {what}"));
        };
        let table = timing::measure(
            &Timing {
                scenario,
                recorded,
                deepc: logged(0, &deepc),
                rd_deepc: logged(1, &rd_deepc),
                lmpc: Some(logged(2, &lmpc)),
                moments: self.plan.moments,
                deepc_as_written: self.plan.deepc_as_written,
            },
            Follow {
                interrupt: self.interrupt,
                progress: &mut told,
            },
        )
        .context("the table of costs and times")?;
        bar.finish_and_clear();
        write_json(&self.out.join(TIMING_FILE), &table)?;
        self.sign(&self.out.join(TIMING_FINGERPRINT_FILE), |program| {
            program.of_timing(self.plan, run)
        })
    }
}

/// Whether a file is there and holds what it should.
fn reads<T: DeserializeOwned>(file: &Path) -> bool {
    std::fs::read(file).is_ok_and(|text| serde_json::from_slice::<T>(&text).is_ok())
}

/// The run whose group is timed: that of RD-DeePC, if all controllers of the table are driven and
/// logged beside it.
fn timed(runs: &[PlannedRun]) -> Option<&PlannedRun> {
    let logged = |name: &str| runs.iter().find(|r| r.logged && r.controller == name);
    let [deepc, rd_deepc, lmpc] = TIMED.map(logged);
    deepc.and(lmpc).and(rd_deepc)
}
