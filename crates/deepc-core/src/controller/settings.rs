//! Settings of the receding horizon and of what happens when it fails.

use serde::{Deserialize, Serialize};

use super::error::ControllerError;
use crate::solver::SolveBudget;

/// Settings of the receding horizon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecedingHorizonSettings {
    /// Moves applied from one plan before the next is made, 1 to N.
    pub moves_per_solve: usize,
    /// What one solve may cost.
    pub budget: SolveBudget,
    /// Wall-clock time a whole decision may take, in seconds, above 0. A decision that takes
    /// longer is marked [`late`](super::Step::late) and counted. Absent: no deadline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deadline_s: Option<f64>,
    /// Whether a plan that comes after the deadline is replaced by the fallback.
    #[serde(default)]
    pub discard_late: bool,
    /// Samples in a row without the least change in an output after which the sensor is
    /// reported as frozen, at least 1. For outputs that always carry some noise; absent for
    /// others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen_after: Option<usize>,
    /// What happens when no plan can be made.
    #[serde(default = "FallbackPolicy::standard")]
    pub fallback: FallbackPolicy,
}

impl RecedingHorizonSettings {
    /// A new plan in every sample, no deadline, no watch for frozen sensors and the standard
    /// fallback.
    #[must_use]
    pub fn every_sample(budget: SolveBudget) -> Self {
        Self {
            moves_per_solve: 1,
            budget,
            deadline_s: None,
            discard_late: false,
            frozen_after: None,
            fallback: FallbackPolicy::standard(),
        }
    }

    /// Checks the ranges, for a horizon of N steps.
    ///
    /// # Errors
    /// Names the field out of range.
    pub fn check(&self, horizon: usize) -> Result<(), ControllerError> {
        if !(1..=horizon).contains(&self.moves_per_solve) {
            return Err(ControllerError::MovesPerSolve {
                found: self.moves_per_solve,
                horizon,
            });
        }
        check_budget("budget", &self.budget)?;
        if let Some(budget) = &self.fallback.second_solver_budget {
            check_budget("fallback.second_solver_budget", budget)?;
        }
        match self.deadline_s {
            // Written so that NaN is refused too.
            Some(found) if !(found > 0.0 && found.is_finite()) => {
                return Err(ControllerError::Deadline { found });
            }
            None if self.discard_late => return Err(ControllerError::NoDeadline),
            _ => {}
        }
        if self.frozen_after == Some(0) {
            return Err(ControllerError::FrozenAfter);
        }
        Ok(())
    }
}

/// What acts when a solve fails or is late, or a measurement or reference is bad. In this order:
///
/// 1. the second solver, if there is one
///    ([`with_second_solver`](super::RecedingHorizonController::with_second_solver)) and the first one
///    failed;
/// 2. the last plan, shifted: its move for this sample;
/// 3. the input applied last, held;
/// 4. the user's own choice
///    ([`with_user_fallback`](super::RecedingHorizonController::with_user_fallback)); without one the input
///    is held on.
///
/// A plan that was left for one of the later two, or because another input than its own was
/// applied, is not taken up again. The limits count anew after every plan, and while the past window
/// fills for the first time after every [`Passthrough`](super::Origin::Passthrough). A window that a
/// fault emptied changes nothing: the policy goes on where it was until there is a plan.
///
/// Whichever acts, the input is clipped to the hard bounds of the inputs and their changes.
///
/// Read from a file, what is left out is as in [`Self::standard`]; null means no limit (in a format
/// without null, write a number that no run reaches).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default = "FallbackPolicy::standard")]
pub struct FallbackPolicy {
    /// Moves of the last plan taken in a row; `None`: to its end.
    pub max_plan_steps: Option<usize>,
    /// Samples the last input is held before the user is asked; `None`: for ever.
    pub max_hold_steps: Option<usize>,
    /// What one solve of the second solver may cost; `None`: the same as of the first.
    pub second_solver_budget: Option<SolveBudget>,
}

impl FallbackPolicy {
    /// The last plan to its end, then the input applied last for 10 samples, then the user's
    /// choice (or the held input). The second solver has the budget of the first.
    #[must_use]
    pub fn standard() -> Self {
        Self {
            max_plan_steps: None,
            max_hold_steps: Some(10),
            second_solver_budget: None,
        }
    }
}

fn check_budget(field: &'static str, budget: &SolveBudget) -> Result<(), ControllerError> {
    if budget.is_valid() {
        return Ok(());
    }
    Err(ControllerError::Budget {
        field,
        iterations: budget.max_iterations,
        time_s: budget.max_time_s,
    })
}
