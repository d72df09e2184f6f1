//! The moments at which programs are timed, taken from a run's log.

use deepc_core::program::Moment;
use faer::Mat;

use super::{LoggedRun, TimingError};
use crate::closed_loop::{INPUTS, OUTPUTS};
use crate::run_log::{LogRow, SolveStatus};

/// What was known and wanted at one step of a run.
pub(super) struct Past {
    /// End of the last interval that was known, s.
    pub(super) time_s: f64,
    inputs: Mat<f64>,
    outputs: Mat<f64>,
    input_reference: Mat<f64>,
    output_reference: Mat<f64>,
}

impl Past {
    /// The moment at which the input of row `k` was decided.
    fn before(log: &[LogRow], k: usize, past_steps: usize, horizon_steps: usize) -> Self {
        let window = &log[k - past_steps..k];
        let now = &log[k];
        let wanted = [
            now.steering_wheel_reference_deg,
            now.target_speed_reference_kmh,
        ];
        Self {
            time_s: window.last().map_or(0.0, |row| row.time_s),
            inputs: Mat::from_fn(past_steps, INPUTS, |i, j| input(&window[i])[j]),
            outputs: Mat::from_fn(past_steps, OUTPUTS, |i, _| measured(&window[i])),
            input_reference: Mat::from_fn(horizon_steps, INPUTS, |_, j| wanted[j]),
            output_reference: Mat::zeros(horizon_steps, OUTPUTS),
        }
    }

    pub(super) fn moment(&self) -> Moment<'_> {
        Moment {
            past_inputs: self.inputs.as_ref(),
            past_outputs: self.outputs.as_ref(),
            input_reference: self.input_reference.as_ref(),
            output_reference: self.output_reference.as_ref(),
            disturbances: None,
        }
    }
}

/// Inputs of a row.
pub(super) fn input(row: &LogRow) -> [f64; INPUTS] {
    [row.steering_wheel_deg, row.target_speed_kmh]
}

/// What the controller was given of the LTR: not a number where the sensor lost it.
pub(super) fn measured(row: &LogRow) -> f64 {
    row.ltr_measured.unwrap_or(f64::NAN)
}

/// `count` moments of a run at which bounds are active, spread evenly over all such.
pub(super) fn at_bounds(run: &LoggedRun<'_>, count: usize) -> Result<Vec<Past>, TimingError> {
    let (past, horizon) = (run.settings.past_steps, run.settings.horizon_steps);
    let log = run.log;
    let found: Vec<usize> = (past..log.len())
        .filter(|&k| {
            let solver = matches!(
                log[k].solve_status,
                SolveStatus::Solved | SolveStatus::SolvedBySecond
            );
            solver && log[k - past..k].iter().all(|row| measured(row).is_finite())
        })
        .collect();
    if found.len() < count || count == 0 {
        return Err(TimingError::TooFewMoments {
            controller: run.name.to_owned(),
            found: found.len(),
            needed: count.max(1),
        });
    }
    // The middles of equal shares.
    let middle = |i: usize| found[(2 * i + 1) * found.len() / (2 * count)];
    Ok((0..count)
        .map(|i| Past::before(log, middle(i), past, horizon))
        .collect())
}
