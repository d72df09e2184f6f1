//! Settings of the OSQP back end.

use ::osqp::Settings;
use serde::{Deserialize, Serialize};

use crate::solver::SolverError;
use crate::solver::error::check_tolerance;

/// Settings of [`OsqpSolver`](super::OsqpSolver). They decide accuracy and cost, not behaviour,
/// so they may have defaults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OsqpSettings {
    /// Largest [`relative`](crate::solver::Certificate::relative) residual of a `Solved` point,
    /// 1e-12 to 1e-3.
    pub tolerance: f64,
    /// What OSQP itself stops at first (its `eps_abs` and `eps_rel`), 1e-14 to 1e-1. When its
    /// point misses `tolerance` it is asked for more and goes on, within the budget.
    pub eps: f64,
    /// Whether OSQP may solve for the rows it believes active, once it has stopped.
    pub polish: bool,
    /// Iterations between two looks at the step size ρ and at the residuals, 1 to 10 000. Counted
    /// and not timed, so that equal histories give equal bits.
    pub check_interval: u32,
}

impl Default for OsqpSettings {
    /// A tolerance of 1e-8, `eps` of 1e-9, polishing, looks every 25 iterations.
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            eps: 1e-9,
            polish: true,
            check_interval: 25,
        }
    }
}

impl OsqpSettings {
    /// Checks the range of every field.
    ///
    /// # Errors
    /// Names the field out of range.
    pub fn check(&self) -> Result<(), SolverError> {
        let wrong = |field, found, range| {
            Err(SolverError::Setting {
                field,
                found,
                range,
            })
        };
        check_tolerance(self.tolerance)?;
        if !(1e-14..=1e-1).contains(&self.eps) {
            return wrong("eps", self.eps, "a value from 1e-14 to 1e-1");
        }
        if !(1..=10_000).contains(&self.check_interval) {
            let found = f64::from(self.check_interval);
            return wrong("check_interval", found, "a value from 1 to 10000");
        }
        Ok(())
    }

    /// OSQP's own settings.
    pub(super) fn native(self) -> Settings {
        Settings::default()
            .verbose(false)
            .eps_abs(self.eps)
            .eps_rel(self.eps)
            .eps_prim_inf(INFEASIBILITY_EPS)
            .eps_dual_inf(INFEASIBILITY_EPS)
            .polish(self.polish)
            .polish_refine_iter(POLISH_REFINEMENTS)
            .rho(INITIAL_RHO)
            .adaptive_rho(true)
            .adaptive_rho_interval(Some(self.check_interval))
            .check_termination(Some(self.check_interval))
    }
}

/// OSQP's own starting step size.
pub(super) const INITIAL_RHO: f64 = 0.1;

/// OSQP's default of 1e-4 calls badly scaled programs infeasible that are not.
pub(super) const INFEASIBILITY_EPS: f64 = 1e-8;

/// Steps of iterative refinement after polishing; each gains about six digits.
const POLISH_REFINEMENTS: u32 = 5;
