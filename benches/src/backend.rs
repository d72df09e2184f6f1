//! The one place that knows the quadratic-program solvers by name.

use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, ClarabelSettings, ClarabelSolver, QpProblem,
    QpSolver, SolverError,
};
use thiserror::Error;

/// The solver meant for the control loop.
pub const ACTIVE_SET: &str = "active-set";
/// The interior-point solver.
pub const CLARABEL: &str = "clarabel";
/// The fixed-cost splitting solver.
pub const ADMM: &str = "admm";
/// The operator-splitting solver; only with this package's feature `osqp`.
pub const OSQP: &str = "osqp";

/// A back end could not be set up.
#[derive(Debug, Error)]
pub enum BackendError {
    /// Nothing has this name, or it was not compiled in.
    #[error("there is no back end `{name}`; there are: {}", available().join(", "))]
    Unknown {
        /// Name asked for.
        name: String,
    },
    /// It refused the problem.
    #[error(transparent)]
    Solver(#[from] SolverError),
}

/// Names of the back ends compiled in, the fastest first.
#[must_use]
pub fn available() -> Vec<&'static str> {
    let mut names = vec![ACTIVE_SET, ADMM, CLARABEL];
    if cfg!(feature = "osqp") {
        names.push(OSQP);
    }
    names
}

/// Sets a back end up so that `Solved` means a relative residual of at most `tolerance`.
///
/// # Errors
/// The name is unknown, or the back end refuses the problem or the tolerance.
pub fn solver(
    name: &str,
    problem: &QpProblem,
    tolerance: f64,
) -> Result<Box<dyn QpSolver>, BackendError> {
    Ok(match name {
        ACTIVE_SET => Box::new(ActiveSet::new(problem, ActiveSetSettings { tolerance })?),
        CLARABEL => Box::new(ClarabelSolver::new(
            problem,
            ClarabelSettings { tolerance },
        )?),
        ADMM => {
            let settings = AdmmSettings {
                tolerance,
                ..AdmmSettings::default()
            };
            Box::new(Admm::new(problem, settings)?)
        }
        #[cfg(feature = "osqp")]
        OSQP => {
            use deepc_core::solver::{OsqpSettings, OsqpSolver};
            let settings = OsqpSettings {
                tolerance,
                eps: tolerance,
                ..OsqpSettings::default()
            };
            Box::new(OsqpSolver::new(problem, settings)?)
        }
        _ => {
            return Err(BackendError::Unknown {
                name: name.to_owned(),
            });
        }
    })
}
