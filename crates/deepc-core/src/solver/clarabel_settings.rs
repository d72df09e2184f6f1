//! Settings of the Clarabel back end and translations to and from its types.

use clarabel::algebra::CscMatrix as ClarabelMatrix;
use clarabel::solver::{DefaultSettings, SolverStatus};
use serde::{Deserialize, Serialize};

use super::error::{SolverError, check_tolerance};
use super::{QpStatus, SolveBudget};

/// Settings of the Clarabel back end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClarabelSettings {
    /// Largest [`relative`](super::Certificate::relative) residual of a `Solved` point,
    /// 1e-12 to 1e-3. Clarabel itself is asked for a tenth of it.
    pub tolerance: f64,
}

impl Default for ClarabelSettings {
    /// A tolerance of 1e-8. This decides accuracy, not behaviour, so it may have a default.
    fn default() -> Self {
        Self { tolerance: 1e-8 }
    }
}

impl ClarabelSettings {
    /// Checks the range of every field.
    ///
    /// # Errors
    /// Names the field out of range.
    pub fn check(&self) -> Result<(), SolverError> {
        check_tolerance(self.tolerance)
    }

    /// Clarabel's own settings. Presolve and dropping of zeros are off because they forbid
    /// updating vectors.
    pub(super) fn native(self, equilibrate: bool) -> DefaultSettings<f64> {
        let tolerance = 0.1 * self.tolerance;
        DefaultSettings {
            verbose: false,
            max_threads: 1,
            presolve_enable: false,
            input_sparse_dropzeros: false,
            equilibrate_enable: equilibrate,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            ..DefaultSettings::default()
        }
    }
}

/// Iterations and seconds that remain of a budget.
#[derive(Debug, Clone, Copy)]
pub(super) struct Remaining {
    pub iterations: u32,
    pub time_s: f64,
}

impl Remaining {
    pub fn of(budget: &SolveBudget, used_iterations: u32, used_time_s: f64) -> Self {
        Self {
            iterations: budget.max_iterations.saturating_sub(used_iterations),
            time_s: budget.max_time_s - used_time_s,
        }
    }

    /// The limit that is spent, if one is.
    pub fn spent(&self) -> Option<QpStatus> {
        if self.iterations == 0 {
            Some(QpStatus::IterationLimit)
        } else if self.time_s.is_nan() || self.time_s <= 0.0 {
            Some(QpStatus::TimeLimit)
        } else {
            None
        }
    }

    pub fn limit(&self, settings: &mut DefaultSettings<f64>) {
        settings.max_iter = self.iterations;
        settings.time_limit = self.time_s;
    }
}

/// What Clarabel says, in our words. `Solved` here still has to be certified; points without
/// full accuracy are passed on to the certificate as well.
pub(super) fn translate(status: SolverStatus) -> QpStatus {
    match status {
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress => {
            QpStatus::Solved
        }
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
            QpStatus::Infeasible
        }
        SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => QpStatus::Unbounded,
        SolverStatus::MaxIterations => QpStatus::IterationLimit,
        SolverStatus::MaxTime => QpStatus::TimeLimit,
        SolverStatus::NumericalError
        | SolverStatus::Unsolved
        | SolverStatus::CallbackTerminated => QpStatus::NumericalError,
    }
}

/// A Clarabel matrix from triplets.
pub(super) fn clarabel_matrix(
    rows: usize,
    columns: usize,
    triplets: Vec<(usize, usize, f64)>,
) -> Result<ClarabelMatrix<f64>, SolverError> {
    let matrix = super::CscMatrix::from_triplets(rows, columns, triplets)?;
    let (starts, indices, values) = matrix.into_parts();
    Ok(ClarabelMatrix::new(rows, columns, starts, indices, values))
}
