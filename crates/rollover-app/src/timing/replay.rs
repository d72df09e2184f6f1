//! A controller asked again what it decided in a run.

use std::time::Instant;

use anyhow::Result;
use deepc_core::controller::{Controller, Origin};

use super::moments::{input, measured};
use crate::closed_loop::OUTPUTS;
use crate::interrupt::Interrupt;
use crate::run_log::LogRow;

/// What a replay gave.
#[derive(Debug, Clone, Default)]
pub(super) struct Replayed {
    /// Times of the steps in which a plan was made, s.
    pub(super) times_s: Vec<f64>,
    /// Of these, the steps that needed a solver.
    pub(super) at_bounds: usize,
    /// Largest difference of a decision from the log, in the input's units.
    pub(super) difference: f64,
}

/// Asks `controller` at every step of a log, and tells it what the log says came of it.
pub(super) fn replay(
    controller: &mut dyn Controller,
    log: &[LogRow],
    interrupt: &Interrupt,
) -> Result<Replayed> {
    controller.reset();
    let mut reference = controller.new_reference();
    let mut replayed = Replayed::default();
    for row in log {
        interrupt.check(
            "while steps were timed",
            "the runs and their logs are complete",
        )?;
        let wanted = [
            row.steering_wheel_reference_deg,
            row.target_speed_reference_kmh,
        ];
        let applied = input(row);
        let started = Instant::now();
        reference.hold(&wanted, &[0.0; OUTPUTS])?;
        let step = controller.decide(&reference);
        let seconds = started.elapsed().as_secs_f64();
        if matches!(
            step.origin,
            Origin::Unconstrained | Origin::Solver | Origin::SecondSolver
        ) {
            replayed.times_s.push(seconds);
            replayed.at_bounds += usize::from(step.origin != Origin::Unconstrained);
        }
        for (decided, applied) in step.input.iter().zip(&applied) {
            replayed.difference = replayed.difference.max((decided - applied).abs());
        }
        controller.observe(&applied, &[measured(row)]);
    }
    Ok(replayed)
}
