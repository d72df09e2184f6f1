//! What a step costs: `DeePC` and RD-DeePC as the paper writes them, their condensed form, and the
//! linear MPC, timed on the moments of recorded runs.
//!
//! Runs are made several at a time, so the times in their logs depend on what ran beside them. Here
//! everything is timed again on one thread, one after the other: the programs as written at a few
//! moments at which bounds are active, the controllers at every step of their own runs. Their
//! decisions must be those of the logs, which shows that the moments are the same.

mod agreement;
mod error;
mod moments;
mod replay;
mod table;
mod written;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::closed_loop::Recorded;
use crate::interrupt::Interrupt;
use crate::run_log::LogRow;
use crate::scenario::{ControllerSettings, Scenario};

pub use agreement::{
    Agreement, COSTS_AGREE, INPUTS_AGREE, WrittenAgreement, deepc_equals_rd_deepc,
};
pub use error::TimingError;
pub use table::measure;

/// What to time.
#[derive(Clone, Copy)]
pub struct Timing<'a> {
    /// The scenario of the runs.
    pub scenario: &'a Scenario,
    /// The recording that the controllers work from.
    pub recorded: &'a Recorded<'a>,
    /// `DeePC` on the whole matrix. Its log may be empty: then it has no cost, and is timed at the
    /// moments of RD-DeePC's run.
    pub deepc: LoggedRun<'a>,
    /// RD-DeePC, whose run gives the moments.
    pub rd_deepc: LoggedRun<'a>,
    /// The linear MPC, if it is to be timed; its log may be empty.
    pub lmpc: Option<LoggedRun<'a>>,
    /// Moments at which the programs as written are solved: at least [`MOMENTS`], or fewer for a
    /// quick look.
    pub moments: usize,
    /// Whether `DeePC` is solved as written, too: 20 s and more for each moment.
    pub deepc_as_written: bool,
}

/// Moments behind a row of the paper's table, unless a quick look is asked for.
pub const MOMENTS: usize = 3;

/// A controller and the log of its run.
#[derive(Clone, Copy)]
pub struct LoggedRun<'a> {
    /// Its name in the scenario.
    pub name: &'a str,
    /// Its settings there.
    pub settings: &'a ControllerSettings,
    /// Its run.
    pub log: &'a [LogRow],
}

/// Stops the work and is told how far it is.
pub struct Follow<'a> {
    /// Stops it between two solves.
    pub interrupt: &'a Interrupt,
    /// Is told pieces of work done, their number, and what is being done.
    pub progress: &'a mut dyn FnMut(usize, usize, &str),
}

/// The table, and whether its first two rows are the same controller.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimingTable {
    /// One row per method and form; those of the paper first.
    pub rows: Vec<TimingRow>,
    /// Times within RD-DeePC's run at which the programs as written were solved, s.
    pub moments_s: Vec<f64>,
    /// Whether `DeePC` and RD-DeePC decide alike.
    pub deepc_equals_rd_deepc: Agreement,
}

/// One method in one form.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimingRow {
    /// The method.
    pub method: TimedMethod,
    /// The form in which it is solved.
    pub form: TimedForm,
    /// Name of the controller in the scenario.
    pub controller: String,
    /// Rows of the data matrix; absent for a model.
    pub rows: Option<usize>,
    /// Columns of the data matrix that is part of the program; absent for a model.
    pub columns: Option<usize>,
    /// The paper's cost of the run; absent for what is not in the paper.
    pub paper_cost: Option<f64>,
    /// The paper's time of a step, s.
    pub paper_time_s: Option<f64>,
    /// Cost of the whole run: of the condensed forms and the linear MPC. The programs as written are
    /// not driven through a run.
    pub cost: Option<f64>,
    /// Median time of the steps timed, s.
    pub step_s_median: f64,
    /// Shortest, s.
    pub step_s_min: f64,
    /// Steps timed: those in which a plan was made.
    pub steps_timed: usize,
    /// Of these, the steps whose optimum without bounds violates one.
    pub steps_at_bounds: usize,
    /// Mean number of active bounds at the optimum of the moments; absent for a model.
    pub bounds_active: Option<f64>,
    /// Optimal value at every moment; empty for a model, which solves another problem.
    pub objectives: Vec<f64>,
    /// Largest relative distance of these from those of the condensed `DeePC`.
    pub objective_gap: Option<f64>,
    /// Median time over that of RD-DeePC as written.
    pub time_to_rd_deepc: f64,
    /// The same of the paper's times.
    pub paper_time_to_rd_deepc: Option<f64>,
    /// How it was timed, for readers of the table.
    pub note: String,
}

/// A method of the paper's table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TimedMethod {
    /// `DeePC` on the whole data matrix (paper eq. 16).
    Deepc,
    /// `DeePC` on the reduced data matrix (paper eq. 19).
    RdDeepc,
    /// Linear MPC on an identified model.
    Lmpc,
}

/// The form in which a method is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimedForm {
    /// With all its variables g, u, y and σ, by the interior-point solver.
    AsWritten,
    /// g and the slacks eliminated at set-up; the controller as it drives.
    Condensed,
    /// The condensed program of a model, its state estimate included.
    LinearMpc,
}

impl TimedMethod {
    /// Cost of the run and time of a step in the paper's table.
    #[must_use]
    pub fn paper(self) -> (f64, f64) {
        match self {
            Self::Deepc => (9.94, 1.446),
            Self::RdDeepc => (9.95, 0.089),
            Self::Lmpc => (74.13, 0.004),
        }
    }
}

impl fmt::Display for TimedMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Deepc => "DeePC",
            Self::RdDeepc => "RD-DeePC",
            Self::Lmpc => "LMPC",
        })
    }
}

impl fmt::Display for TimedForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::AsWritten => "as written",
            Self::Condensed => "condensed",
            Self::LinearMpc => "linear MPC",
        })
    }
}
