//! What acts when no plan can be made.

use faer::MatRef;

use super::reference::Reference;
use super::samples::Samples;
use super::settings::FallbackPolicy;
use super::step::{Fault, Origin, Step};
use crate::solver::QpStatus;

/// What a user's own fallback may look at.
#[derive(Debug, Clone, Copy)]
pub struct FallbackContext<'a> {
    /// Decisions before this one, since the controller was built or reset
    /// ([`Controller::reset`](super::Controller::reset)); resetting the statistics leaves it alone.
    pub step: u64,
    /// What is known of the past inputs, at most `T_ini`×m, the newest in the last row. Fewer
    /// rows, or none, after a start or a fault that could not be repaired.
    pub past_inputs: MatRef<'a, f64>,
    /// The same of the measured disturbances, at most `T_ini`×q.
    pub past_disturbances: MatRef<'a, f64>,
    /// The same of the outputs, at most `T_ini`×p.
    pub past_outputs: MatRef<'a, f64>,
    /// The reference as given; its shape and values are not checked if they are the fault.
    pub reference: &'a Reference,
    /// The input applied last, m values; the one decided last before any sample was observed.
    pub last_input: &'a [f64],
    /// Why there is no plan.
    pub fault: Fault,
    /// How the solve ended, if there was one.
    pub status: QpStatus,
    /// Steps in a row that fell back before this one.
    pub fallback_steps: usize,
}

/// A user's own fallback: writes the m inputs. They are clipped to the hard bounds of the inputs
/// and their changes, and entries that are not finite are replaced by the input applied last, which
/// is also what it finds there.
pub(super) type UserFallback = Box<dyn FnMut(&FallbackContext<'_>, &mut [f64]) + Send>;

/// The policy, and how much of it is used up.
pub(super) struct Fallback {
    policy: FallbackPolicy,
    user: Option<UserFallback>,
    held: Vec<f64>,
    plan_steps: usize,
    hold_steps: usize,
}

impl Fallback {
    pub fn new(policy: FallbackPolicy, inputs: usize) -> Self {
        Self {
            policy,
            user: None,
            held: vec![0.0; inputs],
            plan_steps: 0,
            hold_steps: 0,
        }
    }

    pub fn set_user(&mut self, user: UserFallback) {
        self.user = Some(user);
    }

    /// The limits count anew.
    pub fn rearm(&mut self) {
        self.plan_steps = 0;
        self.hold_steps = 0;
    }

    /// The row of the last plan to take, if the policy still allows it.
    pub fn plan_row(&mut self, step: &Step) -> Option<usize> {
        let limit = self.policy.max_plan_steps.unwrap_or(usize::MAX);
        let row = step.plan.row().filter(|_| self.plan_steps < limit)?;
        self.plan_steps += 1;
        Some(row)
    }

    /// Holds the last input, or asks the user. The plan is left, so it is dropped.
    pub fn without_plan(
        &mut self,
        decisions: u64,
        samples: &Samples,
        reference: &Reference,
        step: &mut Step,
    ) -> Origin {
        step.plan.age = None;
        // Before any sample there is nothing to hold but the input of the last step, which is
        // zero at the start.
        self.held
            .copy_from_slice(samples.input().unwrap_or(&step.input));
        step.input.copy_from_slice(&self.held);
        let may_hold = self
            .policy
            .max_hold_steps
            .is_none_or(|limit| self.hold_steps < limit);
        let Some(user) = self.user.as_mut().filter(|_| !may_hold) else {
            self.hold_steps = self.hold_steps.saturating_add(1);
            return Origin::Hold;
        };
        let window = samples.window();
        let context = FallbackContext {
            step: decisions,
            past_inputs: window.inputs(),
            past_disturbances: window.disturbances(),
            past_outputs: window.outputs(),
            reference,
            last_input: &self.held,
            fault: step.fault.unwrap_or(Fault::SolveFailed),
            status: step.status,
            fallback_steps: step.fallback_steps,
        };
        user(&context, &mut step.input);
        for (entry, held) in step.input.iter_mut().zip(&self.held) {
            if !entry.is_finite() {
                *entry = *held;
            }
        }
        Origin::User
    }
}
