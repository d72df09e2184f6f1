//! Stage 5: quadratic programs and what solves them.
//!
//! The problem, with n variables and r rows:
//!
//! ```text
//! min ½xᵀPx + qᵀx + Σ_soft (ρᵢ sᵢ + ½ wᵢ sᵢ²)        P: n×n, symmetric, positive semidefinite
//! s.t. lᵢ ≤ (Ax)ᵢ ≤ uᵢ              hard rows       A: r×n
//!      lᵢ − sᵢ ≤ (Ax)ᵢ ≤ uᵢ + sᵢ, sᵢ ≥ 0   soft rows
//! ```
//!
//! P, A and the penalties (ρ, w) are constant; q, l and u change every step.

mod active_rows;
mod certificate;
mod clarabel_direct;
mod clarabel_settings;
pub mod contract;
mod error;
mod problem;
mod sparse_matrix;

use std::time::Duration;

pub use active_rows::ActiveRows;
pub use certificate::{Certificate, INACCURATE_TOLERANCE, certify};
pub use clarabel_direct::ClarabelDirect;
pub use clarabel_settings::ClarabelSettings;
pub use error::SolverError;
pub use problem::{QpMatrix, QpProblem, QpVectors, SoftPenalty};
pub use sparse_matrix::CscMatrix;

use serde::{Deserialize, Serialize};

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum QpStatus {
    /// Nothing was solved yet.
    NotRun,
    /// The point is optimal: its certificate meets the solver's tolerance.
    Solved,
    /// The point is close to optimal: its certificate misses the solver's tolerance, but not by
    /// more than [`INACCURATE_TOLERANCE`] relative to the data.
    Inaccurate,
    /// No point meets the hard rows.
    Infeasible,
    /// The cost is unbounded below.
    Unbounded,
    /// The iteration budget is spent.
    IterationLimit,
    /// The time budget is spent.
    TimeLimit,
    /// The solver broke down.
    NumericalError,
    /// A vector holds NaN, or an infinity where none is allowed.
    InvalidData,
}

impl QpStatus {
    /// Whether the point returned may be used as the optimum.
    #[must_use]
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Solved | Self::Inaccurate)
    }
}

/// What one solve may cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolveBudget {
    /// Iterations, in the solver's own kind (interior-point steps for Clarabel), all rounds
    /// together. At least 1.
    pub max_iterations: u32,
    /// Wall-clock time in seconds, above 0; infinity for no limit. Checked between iterations,
    /// so one iteration more may pass.
    pub max_time_s: f64,
}

impl SolveBudget {
    /// No limit on time and a generous one on iterations: for set-up, tests and studies.
    #[must_use]
    pub fn generous() -> Self {
        Self {
            max_iterations: 10_000,
            max_time_s: f64::INFINITY,
        }
    }

    /// Whether both limits make sense.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.max_iterations >= 1 && self.max_time_s > 0.0
    }
}

/// What a solve returned. All vectors keep their length; they are NaN when there is no point.
#[derive(Debug, Clone)]
pub struct QpSolution {
    /// How it ended.
    pub status: QpStatus,
    /// x, n values.
    pub primal: Vec<f64>,
    /// μ, one value per row, with Px + q + Aᵀμ = 0: positive where the upper side pushes,
    /// negative where the lower side does.
    pub dual: Vec<f64>,
    /// Iterations used.
    pub iterations: u32,
    /// Wall-clock time used.
    pub time: Duration,
    /// What the point is worth, computed by this crate from the point and the problem and not
    /// taken from the solver's word.
    pub certificate: Certificate,
}

impl QpSolution {
    /// A solution with no point yet, for n variables and r rows.
    #[must_use]
    pub fn empty(variables: usize, rows: usize) -> Self {
        Self {
            status: QpStatus::NotRun,
            primal: vec![f64::NAN; variables],
            dual: vec![f64::NAN; rows],
            iterations: 0,
            time: Duration::ZERO,
            certificate: Certificate::none(),
        }
    }

    /// Ends a solve without a point.
    pub(crate) fn fail(&mut self, status: QpStatus) {
        self.status = status;
        self.primal.fill(f64::NAN);
        self.dual.fill(f64::NAN);
        self.certificate = Certificate::none();
    }
}

/// A quadratic-program solver, set up for one [`QpProblem`].
///
/// # Contract
/// 1. **Life cycle.** A constructor takes the constant problem and may fail and allocate.
///    [`update`](Self::update) replaces q, l and u. [`solve`](Self::solve) solves and cannot
///    fail: how it ended is in [`QpSolution::status`].
/// 2. **The problem is the one of [this module](self)**, with its sign and ½ conventions.
///    Bounds may be infinite; `l = u` is an equality row.
/// 3. **`Solved` means certified**: the certificate is computed from the returned point and
///    meets the solver's tolerance. A point that misses it is `Inaccurate` or a failure.
/// 4. **Bad numbers end in a status.** NaN anywhere, infinite q, l = +∞ or u = −∞ give
///    `InvalidData`; l > u gives `Infeasible`; never a panic, never NaN in a usable point.
/// 5. **Wrong lengths are refused** by `update` with an error, and the old vectors stay.
/// 6. **Budgets hold**: `iterations` never exceeds the budget; when one is spent the status
///    says which.
/// 7. **Only speed may depend on history**: the optimum of a warm solve is that of a cold one,
///    to the certificate's tolerance. [`forget`](Self::forget) drops the history.
/// 8. **Deterministic**: the same history and vectors give the same bits, time limits aside.
pub trait QpSolver: Send {
    /// Short name for logs.
    fn name(&self) -> &'static str;

    /// The constant problem.
    fn problem(&self) -> &QpProblem;

    /// Replaces q, l and u.
    ///
    /// # Errors
    /// A length does not fit the problem.
    fn update(&mut self, vectors: QpVectors<'_>) -> Result<(), SolverError>;

    /// Solves within the budget and returns [`Self::solution`].
    fn solve(&mut self, budget: &SolveBudget) -> &QpSolution;

    /// The last solution.
    fn solution(&self) -> &QpSolution;

    /// Forgets what the next solve might start from.
    fn forget(&mut self);
}
