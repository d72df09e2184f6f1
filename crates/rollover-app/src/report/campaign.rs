//! A campaign's folder, read back: every run's numbers, the runs that could not be made, and what was
//! timed. `paper` writes it, and builds its report from it as `report` does.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vehicle_dyn::metrics::Outcome;

use super::cast::rank;
use super::collect::{SUMMARY_FILE, read_json};
use super::data::{self, Problem, Role, Run, RunFigures, Scene, SeedRow, UnloggedRun};
use super::measures::{SeedRun, rows_of};
use crate::summary::Summary;
use crate::timing::{TimedForm, TimingRow, TimingTable};

/// Name of the file that says which runs belong to a campaign, in its folder.
pub const CAMPAIGN_FILE: &str = "campaign.json";
/// Name of the file that stands for the summary where a run could not be made.
pub const FAILURE_FILE: &str = "failure.json";
/// Name of the file with the table of costs and times, in the campaign's folder.
pub const TIMING_FILE: &str = "timing.json";

/// What a campaign consists of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignFile {
    /// Version of the program that made it.
    pub version: String,
    /// The command that made it.
    pub command: String,
    /// Recording seeds.
    pub seeds: Vec<u64>,
    /// Folders of its runs, below its own, in the order of its results.
    pub runs: Vec<PathBuf>,
}

/// A run that could not be made: its recording or its model gives no controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the controller.
    pub controller: String,
    /// Seed of the recording.
    pub seed: u64,
    /// Whether the course was to be driven as its mirror image.
    pub mirrored: bool,
    /// Why.
    pub reason: String,
}

/// A campaign's results.
#[derive(Debug, Clone, PartialEq)]
pub struct Campaign {
    /// What it consists of.
    pub file: CampaignFile,
    /// Its runs.
    pub summaries: Vec<Summary>,
    /// The runs that could not be made.
    pub failures: Vec<Failure>,
    /// What was timed, if anything was.
    pub timing: Option<TimingTable>,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let course = if self.mirrored { ", mirrored" } else { "" };
        write!(
            f,
            "{}, {}, seed {}{course}: no controller, and counted as not safe: {}",
            self.scenario, self.controller, self.seed, self.reason
        )
    }
}

impl Campaign {
    /// Reads a campaign's folder; `None` if it is none. What cannot be read is told in `problems`.
    #[must_use]
    pub fn read(folder: &Path, problems: &mut Vec<Problem>) -> Option<Self> {
        let file: CampaignFile = read_json(&folder.join(CAMPAIGN_FILE), problems)?;
        let mut found = Self {
            summaries: Vec::new(),
            failures: Vec::new(),
            timing: read_json(&folder.join(TIMING_FILE), problems),
            file,
        };
        let mut absent = 0;
        for run in &found.file.runs {
            let (of_run, told) = (folder.join(run), problems.len());
            if let Some(summary) = read_json(&of_run.join(SUMMARY_FILE), problems) {
                found.summaries.push(summary);
            } else if let Some(failure) = read_json(&of_run.join(FAILURE_FILE), problems) {
                found.failures.push(failure);
            } else if problems.len() == told {
                absent += 1;
            }
        }
        if absent > 0 {
            problems.push(Problem {
                file: folder.join(CAMPAIGN_FILE).display().to_string(),
                line: None,
                reason: format!(
                    "{absent} of its {} runs are not there; the claims are judged by the others",
                    found.file.runs.len()
                ),
            });
        }
        Some(found)
    }

    /// Outcomes over the seeds, logged or not.
    #[must_use]
    pub fn seed_rows(&self, scenes: &[Scene]) -> Vec<SeedRow> {
        let title = |scenario: &str| {
            let scene = scenes.iter().find(|scene| scene.name == scenario);
            scene.map_or_else(|| scenario.to_owned(), |scene| scene.title.clone())
        };
        let made = self.summaries.iter().map(|run| SeedRun {
            scene: title(&run.scenario),
            controller: run.controller.clone(),
            mirrored: run.mirrored,
            completed: Some(run.outcome == Outcome::Completed),
            figures: figures_of(run),
        });
        let failed = self.failures.iter().map(|run| SeedRun {
            scene: title(&run.scenario),
            controller: run.controller.clone(),
            mirrored: run.mirrored,
            completed: Some(false),
            figures: RunFigures::default(),
        });
        let mut runs: Vec<SeedRun> = made.chain(failed).collect();
        let place = |run: &SeedRun| scenes.iter().position(|s| s.title == run.scene);
        let order = |run: &SeedRun| {
            let controller = run.controller.clone();
            (
                place(run),
                Role::of_name(&controller).order(),
                rank(&controller),
                controller,
                run.mirrored,
            )
        };
        runs.sort_by_key(order);
        rows_of(&runs)
    }

    /// The runs that no scene shows, in the order of the campaign.
    #[must_use]
    pub fn unlogged(&self, scenes: &[Scene]) -> Vec<UnloggedRun> {
        let shown = |scenario: &str, like: &Run| {
            let mut runs = scenes
                .iter()
                .filter(|s| s.name == scenario)
                .flat_map(|s| &s.runs);
            runs.any(|run| {
                // A run that no recording matters to is shown without a seed.
                let same_seed = run.seed.is_none() || run.seed == like.seed;
                same_seed && run.controller == like.controller && run.mirrored == like.mirrored
            })
        };
        let run = |controller: &str, seed: u64, mirrored: bool| Run {
            controller: controller.to_owned(),
            label: controller.to_owned(),
            seed: Some(seed),
            mirrored,
            ..Run::default()
        };
        let made = self.summaries.iter().map(|summary| UnloggedRun {
            scene: summary.scenario.clone(),
            run: Run {
                outcome: Some(summary.outcome),
                figures: figures_of(summary),
                ..run(&summary.controller, summary.seed, summary.mirrored)
            },
            failure: None,
        });
        let failed = self.failures.iter().map(|failure| UnloggedRun {
            scene: failure.scenario.clone(),
            run: run(&failure.controller, failure.seed, failure.mirrored),
            failure: Some(failure.reason.clone()),
        });
        let all = made.chain(failed);
        all.filter(|one| !shown(&one.scene, &one.run)).collect()
    }

    /// The table of costs and times as the page shows it.
    #[must_use]
    pub fn timing_rows(&self) -> Vec<data::TimingRow> {
        let rows = self.timing.iter().flat_map(|table| &table.rows);
        rows.map(timing_row).collect()
    }
}

/// The numbers of a log that is not there any more.
fn figures_of(run: &Summary) -> RunFigures {
    // The driver alone decides nothing that could be timed.
    let timed = |us: f64| (run.step_time_us.max > 0.0).then_some(us);
    RunFigures {
        steps: run.steps,
        end_time_s: Some(run.end_time_s),
        ltr_abs_max: Some(run.ltr_abs_max),
        ltr_violation_s: Some(run.ltr_violation_s),
        roll_abs_max_deg: Some(run.measures.roll_abs_max_rad.to_degrees()),
        speed_min_kmh: Some(run.speed_min_kmh),
        speed_mean_kmh: Some(run.speed_mean_kmh),
        path_deviation_max_m: Some(run.path_deviation_max_m),
        steering_correction_max_deg: Some(run.steering_correction_max_deg),
        cost: run.cost,
        fallback_steps: Some(run.fallback_steps),
        step_time_median_us: timed(run.step_time_us.median),
        step_time_max_us: timed(run.step_time_us.max),
    }
}

fn timing_row(row: &TimingRow) -> data::TimingRow {
    let form = match row.form {
        TimedForm::LinearMpc => String::new(),
        form => format!(", {form}"),
    };
    data::TimingRow {
        method: format!("{}{form}", row.method),
        size: match (row.rows, row.columns) {
            (Some(rows), Some(columns)) => format!("{rows}×{columns}"),
            _ => String::new(),
        },
        paper_cost: row.paper_cost,
        paper_time_s: row.paper_time_s,
        cost: row.cost,
        time_s: Some(row.step_s_median),
        ratio: Some(row.time_to_rd_deepc),
        note: row.note.clone(),
    }
}
