//! Stage 6: the control loop.
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

mod closed_loop;
pub mod contract;
mod deepc;
mod error;
mod reference;
mod step;
mod window;

pub use closed_loop::{ClosedLoopRun, run_closed_loop};
pub use deepc::{DeepcController, RecedingHorizonSettings};
pub use error::{ControllerError, PlantError};
pub use reference::Reference;
pub use step::{Fault, Origin, Step};

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
pub trait Plant {
    /// Number of inputs m.
    fn inputs(&self) -> usize;

    /// Number of outputs p.
    fn outputs(&self) -> usize;

    /// Sample time Ts in seconds.
    fn sample_time_s(&self) -> f64;

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
///    within the hard input bounds, whatever was observed and whatever the reference holds.
/// 3. `Step::origin` and `Step::fault` say how the input came about; a NaN or lost measurement, a
///    reference that does not fit and a failed solve are all reported there.
/// 4. [`observe`](Self::observe) is called once per sample after `decide`; it may be called
///    before the first `decide` to fill the past window. If `decide` is called twice without it,
///    the sample between counts as lost.
/// 5. After [`reset`](Self::reset) it behaves as when it was built.
/// 6. Deterministic: the same calls give the same bits (times aside; a solve that runs into its
///    time limit is the one exception).
pub trait Controller {
    /// Number of inputs m.
    fn inputs(&self) -> usize;

    /// Number of outputs p.
    fn outputs(&self) -> usize;

    /// Prediction horizon N in samples.
    fn horizon(&self) -> usize;

    /// Sample time Ts in seconds.
    fn sample_time_s(&self) -> f64;

    /// Decides the input of the next sample.
    fn decide(&mut self, reference: &Reference) -> &Step;

    /// Takes the sample (u(k), y(k)): the input that was applied and what was measured at the
    /// end of its interval.
    fn observe(&mut self, input: &[f64], output: &[f64]);

    /// Forgets all samples and plans.
    fn reset(&mut self);

    /// A reference of the right shape, all zero, to be filled in place.
    fn new_reference(&self) -> Reference {
        Reference::zeros(self.horizon(), self.inputs(), self.outputs())
    }
}
