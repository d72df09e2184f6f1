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

mod active_set;
mod admm;
mod certificate;
mod clarabel_settings;
mod clarabel_solver;
pub mod contract;
mod error;
#[cfg(feature = "osqp")]
mod osqp;
mod problem;
mod sizes;
mod sparse_matrix;

use std::time::Duration;

pub use active_set::{ActiveSet, ActiveSetSettings};
pub use admm::{Admm, AdmmSettings};
pub use certificate::{Certificate, INACCURATE_TOLERANCE, certify};
pub use clarabel_settings::ClarabelSettings;
pub use clarabel_solver::ClarabelSolver;
pub use error::SolverError;
#[cfg(feature = "osqp")]
pub use osqp::{OsqpSettings, OsqpSolver};
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
    /// Iterations, in the solver's own kind: solves for the working set, each about as dear as
    /// one change of it (`active-set`), products with the constant matrix (`admm`),
    /// interior-point steps (`clarabel`). At least 1.
    pub max_iterations: u32,
    /// Wall-clock time in seconds, above 0; infinity (absent in a file) for no limit. Checked
    /// between iterations, so one iteration more may pass; an iteration in which many rows join
    /// the working set of the project's own solvers takes k³/3 operations for k of them.
    #[serde(default = "no_limit", skip_serializing_if = "is_no_limit")]
    pub max_time_s: f64,
}

fn no_limit() -> f64 {
    f64::INFINITY
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde hands out references"
)]
fn is_no_limit(seconds: &f64) -> bool {
    *seconds == f64::INFINITY
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
    /// A x, one value per row.
    pub rows: Vec<f64>,
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
            rows: vec![f64::NAN; rows],
            iterations: 0,
            time: Duration::ZERO,
            certificate: Certificate::none(),
        }
    }

    /// Ends a solve as `status` says; what it took stays to be filled in.
    pub(crate) fn end(&mut self, status: QpStatus) {
        if status.is_usable() {
            self.status = status;
        } else {
            self.fail(status);
        }
    }

    /// Ends a solve without a point.
    pub(crate) fn fail(&mut self, status: QpStatus) {
        self.status = status;
        self.primal.fill(f64::NAN);
        self.dual.fill(f64::NAN);
        self.rows.fill(f64::NAN);
        self.certificate = Certificate::none();
    }

    /// Certifies the point it holds, and fills `rows`.
    fn certify(
        &mut self,
        work: &mut certificate::CertificateWork,
        problem: &QpProblem,
        vectors: &QpVectors<'_>,
    ) {
        self.certificate = work.certify(problem, vectors, &self.primal, &self.dual);
        self.rows.copy_from_slice(work.rows());
    }

    /// Ends a solve by the certificate of its point: `Solved` within `tolerance`, `Inaccurate`
    /// within [`INACCURATE_TOLERANCE`], otherwise a breakdown.
    fn grade(&self, tolerance: f64) -> QpStatus {
        let relative = self.certificate.relative;
        if relative <= tolerance {
            QpStatus::Solved
        } else if relative <= INACCURATE_TOLERANCE {
            QpStatus::Inaccurate
        } else {
            QpStatus::NumericalError
        }
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
/// 3. **`Solved` means certified**: the certificate is computed by this crate, not taken from a
///    foreign solver's word, agrees with [`certify`] of the returned point to rounding, and
///    meets the solver's tolerance. A point that misses it is `Inaccurate` or a failure.
///    `rows` is A x of the point, to rounding.
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
