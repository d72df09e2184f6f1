//! Stage 7: the control loop.
//!
//! # Timing
//! One sample is: apply u(k) over `[t_k, t_k + Ts)`, then measure y(k) at the **end** of that
//! interval. The pair (u(k), y(k)) is what a recording holds in row k and what
//! [`Controller::observe`] takes. At the moment of deciding u(k) everything up to
//! (u(k−1), y(k−1)) is known, which is exactly the past window.
//!
//! ```text
//! loop { step = controller.decide(reference);  plant.step(step.input) → output;
//!        controller.observe(step.input, output) }
//! ```
//!
//! A measured disturbance d(k) acts over the interval of u(k) and is known at its end; what is
//! expected of it over the horizon is part of the [`Reference`].

mod closed_loop;
pub mod contract;
mod error;
mod fallback;
mod planner;
mod receding_horizon;
mod reference;
mod samples;
mod scheduled;
mod settings;
mod statistics;
mod step;
mod time_histogram;
mod window;

pub use closed_loop::{ClosedLoopRun, run_closed_loop};
pub use error::{ControllerError, PlantError};
pub use fallback::FallbackContext;
pub use planner::Planner;
pub use receding_horizon::{DeepcController, RecedingHorizonController};
pub use reference::Reference;
pub use scheduled::{ScheduleContext, ScheduleSettings, ScheduledController};
pub use settings::{FallbackPolicy, RecedingHorizonSettings};
pub use statistics::{FaultCounts, OriginCounts, StatusCounts, StepStatistics};
pub use step::{Fault, Origin, Step};
pub use time_histogram::TimeHistogram;

/// A system with m inputs and p outputs that is sampled every Ts.
///
/// # Contract
/// 1. The sizes and the sample time never change; Ts is finite and above 0.
/// 2. [`step`](Self::step) holds `input` over one sample time and writes what is measured at its
///    end to all p entries of `output`.
/// 3. Finite inputs give finite outputs or an error, never NaN and never a panic.
/// 4. Slices of the wrong length are refused with an error ([`check_lengths`](Self::check_lengths)
///    does it) and do not advance the plant.
/// 5. Two plants built alike give the same outputs for the same inputs (a plant with noise is
///    built with its seed).
/// 6. After a step, [`measured_disturbances`](Self::measured_disturbances) has
///    [`disturbances`](Self::disturbances) entries, those of the interval just past.
pub trait Plant {
    /// Number of inputs m.
    fn inputs(&self) -> usize;

    /// Number of outputs p.
    fn outputs(&self) -> usize;

    /// Number of measured disturbances q; none unless the plant says so.
    fn disturbances(&self) -> usize {
        0
    }

    /// Sample time Ts in seconds.
    fn sample_time_s(&self) -> f64;

    /// What was measured of the disturbances that acted over the last sample's interval, q values.
    fn measured_disturbances(&self) -> &[f64] {
        &[]
    }

    /// Advances by one sample.
    ///
    /// # Errors
    /// The plant cannot go on, or a slice has the wrong length.
    fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError>;

    /// Refuses slices of the wrong length.
    ///
    /// # Errors
    /// `input` does not have m entries or `output` not p.
    fn check_lengths(&self, input: &[f64], output: &[f64]) -> Result<(), PlantError> {
        for (name, expected, found) in [
            ("input", self.inputs(), input.len()),
            ("output", self.outputs(), output.len()),
        ] {
            if expected != found {
                return Err(PlantError::Length {
                    name,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }
}

/// Decides the inputs of a plant, sample by sample.
///
/// # Contract
/// 1. The sizes and the sample time never change.
/// 2. [`decide`](Self::decide) cannot fail and does not panic. `Step::input` has m finite entries
///    within the hard input bounds, whatever was observed and whatever the reference holds. If an
///    input was applied before (as reported, or as decided where the report cannot be trusted), it
///    also differs from that one by no more than hard bounds on the input changes allow, to
///    rounding; where both cannot be met, the input bounds are, and the change is the nearest to
///    its own.
/// 3. `Step::origin` and `Step::fault` say how the input came about; a NaN or lost measurement, a
///    reference that does not fit and a failed solve are all reported there. Whatever falls back
///    names a fault, and `origin_steps` and `fallback_steps` count the steps in a row.
/// 4. [`observe`](Self::observe) is called once per sample after `decide`; it may be called
///    before the first `decide` to fill the past window. If `decide` is called twice without it,
///    the sample between counts as lost.
/// 5. After [`reset`](Self::reset) it behaves as when it was built.
/// 6. Deterministic: the same calls give the same bits, times aside. There are two exceptions, both
///    asked for by a setting: a solve that runs into its time limit, and a plan that `discard_late`
///    drops because it came after the deadline.
pub trait Controller {
    /// Number of inputs m.
    fn inputs(&self) -> usize;

    /// Number of outputs p.
    fn outputs(&self) -> usize;

    /// Number of measured disturbances q it takes; none unless it says so.
    fn disturbances(&self) -> usize {
        0
    }

    /// Prediction horizon N in samples.
    fn horizon(&self) -> usize;

    /// Sample time Ts in seconds.
    fn sample_time_s(&self) -> f64;

    /// Decides the input of the next sample.
    fn decide(&mut self, reference: &Reference) -> &Step;

    /// Takes the sample (u(k), y(k)): the input that was applied and what was measured at the
    /// end of its interval.
    fn observe(&mut self, input: &[f64], output: &[f64]);

    /// Takes the sample (u(k), d(k), y(k)) with what was measured of the disturbances (q values).
    /// A controller that takes none ignores them.
    fn observe_with_disturbances(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        let _ = disturbance;
        self.observe(input, output);
    }

    /// Forgets all samples and plans.
    fn reset(&mut self);

    /// A reference of the right shape, all zero, to be filled in place.
    fn new_reference(&self) -> Reference {
        Reference::with_disturbances(
            self.horizon(),
            self.inputs(),
            self.disturbances(),
            self.outputs(),
        )
    }
}
