//! Whether `DeePC` and RD-DeePC decide alike, as they must: the reduction is exact.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::moments::input;
use super::written::AtMoments;
use super::{LoggedRun, TimingError};
use crate::scenario::{ControllerSettings, DataMatrix, DataSettings, Prediction};

/// Inputs that differ by no more agree: deg and km/h.
pub const INPUTS_AGREE: f64 = 1e-6;

/// Costs with no more than this relative difference agree to six digits.
pub const COSTS_AGREE: f64 = 5e-7;

/// How far apart `DeePC` and RD-DeePC are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Steps of the two runs that were compared; 0 where one was not made.
    pub steps: usize,
    /// Steps by which one run is longer.
    pub steps_apart: usize,
    /// Largest difference of the steering wheel along the runs, deg.
    pub steering_wheel_max_deg: f64,
    /// Largest difference of the target speed along the runs, km/h.
    pub target_speed_max_kmh: f64,
    /// Relative difference of the runs' costs.
    pub cost_relative: f64,
    /// The programs as written, where they were solved.
    pub as_written: Option<WrittenAgreement>,
    /// Whether inputs and costs of the runs agree ([`INPUTS_AGREE`], [`COSTS_AGREE`]).
    pub agrees: bool,
}

/// How far apart the programs as written are at the moments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WrittenAgreement {
    /// Moments compared.
    pub moments: usize,
    /// Largest relative difference of the optimal values.
    pub objective_relative: f64,
    /// Largest difference of the first steering-wheel angle, deg.
    pub steering_wheel_max_deg: f64,
    /// Largest difference of the first target speed, km/h.
    pub target_speed_max_kmh: f64,
}

/// Compares the runs of `DeePC` and RD-DeePC step by step.
///
/// # Errors
/// When one of them was not driven, or they differ in more than the data matrix.
pub fn deepc_equals_rd_deepc(
    deepc: &LoggedRun<'_>,
    rd_deepc: &LoggedRun<'_>,
) -> Result<Agreement, TimingError> {
    same_problem(deepc, rd_deepc)?;
    for run in [deepc, rd_deepc] {
        if run.log.is_empty() {
            return Err(TimingError::NoRun {
                controller: run.name.to_owned(),
            });
        }
    }
    Ok(compare(deepc, rd_deepc, None))
}

/// The comparison of runs that may be empty, with that of the programs as written.
pub(super) fn compare(
    deepc: &LoggedRun<'_>,
    rd_deepc: &LoggedRun<'_>,
    written: Option<(&AtMoments, &AtMoments)>,
) -> Agreement {
    let pairs = || {
        deepc
            .log
            .iter()
            .zip(rd_deepc.log)
            .map(|(a, b)| (input(a), input(b)))
    };
    let largest = |j: usize| {
        pairs()
            .map(|(a, b)| (a[j] - b[j]).abs())
            .fold(0.0, f64::max)
    };
    let inputs = [largest(0), largest(1)];
    let steps = pairs().count();
    let steps_apart = deepc.log.len().abs_diff(rd_deepc.log.len());
    let cost_relative = if steps == 0 {
        0.0
    } else {
        relative(cost(deepc), cost(rd_deepc))
    };
    let agree = |difference: &f64| *difference <= INPUTS_AGREE;
    Agreement {
        steps,
        steps_apart,
        steering_wheel_max_deg: inputs[0],
        target_speed_max_kmh: inputs[1],
        cost_relative,
        as_written: written.map(|(deepc, rd_deepc)| compare_written(deepc, rd_deepc)),
        agrees: steps > 0
            && steps_apart == 0
            && inputs.iter().all(agree)
            && cost_relative <= COSTS_AGREE,
    }
}

fn compare_written(deepc: &AtMoments, rd_deepc: &AtMoments) -> WrittenAgreement {
    let both = || deepc.inputs.iter().zip(&rd_deepc.inputs);
    let largest = |j: usize| both().map(|(a, b)| (a[j] - b[j]).abs()).fold(0.0, f64::max);
    WrittenAgreement {
        moments: both().count(),
        objective_relative: gap(&deepc.objectives, &rd_deepc.objectives),
        steering_wheel_max_deg: largest(0),
        target_speed_max_kmh: largest(1),
    }
}

/// Largest relative distance of values from their references.
pub(super) fn gap(values: &[f64], references: &[f64]) -> f64 {
    let gaps = values.iter().zip(references).map(|(v, r)| relative(*v, *r));
    // `max` would drop what is not a number.
    gaps.fold(0.0, |worst, gap| if gap <= worst { worst } else { gap })
}

fn relative(value: f64, reference: f64) -> f64 {
    let difference = (value - reference).abs();
    if difference == 0.0 {
        return 0.0;
    }
    difference / reference.abs()
}

/// Stage costs of the inputs over the run, as in the summary.
pub(super) fn cost(run: &LoggedRun<'_>) -> f64 {
    let weights = &run.settings.input_weights;
    run.log.iter().map(|row| weights.stage_cost(row)).sum()
}

/// The settings on data, where a run has the method of its row.
pub(super) fn on_data<'a>(
    run: &LoggedRun<'a>,
    wanted: DataMatrix,
) -> Result<&'a DataSettings, TimingError> {
    match &run.settings.prediction {
        Prediction::Data(data) if data.matrix == wanted => Ok(data),
        _ => {
            let (wanted, method) = match wanted {
                DataMatrix::Whole => ("DeePC", "deepc"),
                DataMatrix::Reduced => ("RD-DeePC", "rd-deepc"),
            };
            Err(TimingError::Method {
                controller: run.name.to_owned(),
                wanted,
                method,
            })
        }
    }
}

/// Whether two controllers differ in their data matrix alone.
pub(super) fn same_problem(
    deepc: &LoggedRun<'_>,
    rd_deepc: &LoggedRun<'_>,
) -> Result<(), TimingError> {
    let of_data = [
        on_data(deepc, DataMatrix::Whole)?,
        on_data(rd_deepc, DataMatrix::Reduced)?,
    ];
    let [a, b]: [&ControllerSettings; 2] = [deepc.settings, rd_deepc.settings];
    let [da, db] = of_data;
    // Exactly what a file says twice.
    #[expect(clippy::float_cmp, reason = "settings, not results")]
    let same = [
        ("past_steps", a.past_steps == b.past_steps),
        ("horizon_steps", a.horizon_steps == b.horizon_steps),
        ("moves_per_solve", a.moves_per_solve == b.moves_per_solve),
        ("ltr_limit", a.ltr_limit == b.ltr_limit),
        ("ltr_penalty", a.ltr_penalty == b.ltr_penalty),
        ("input_weights", a.input_weights == b.input_weights),
        ("regularisation", da.regularisation == db.regularisation),
        ("lambda_u", da.lambda_u == db.lambda_u),
        ("lambda_y", da.lambda_y == db.lambda_y),
    ];
    match same.iter().find(|(_, same)| !same) {
        None => Ok(()),
        Some(&(field, _)) => Err(TimingError::Unlike {
            deepc: deepc.name.to_owned(),
            rd_deepc: rd_deepc.name.to_owned(),
            field,
        }),
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.steps == 0 {
            f.write_str("DeePC and RD-DeePC: not both were driven")?;
        } else {
            write!(
                f,
                "DeePC and RD-DeePC {} over {} steps: inputs within {:.0e} deg and {:.0e} km/h, costs within {:.0e} of each other",
                if self.agrees { "agree" } else { "do not agree" },
                self.steps,
                self.steering_wheel_max_deg,
                self.target_speed_max_kmh,
                self.cost_relative
            )?;
        }
        if let Some(written) = &self.as_written {
            write!(
                f,
                "; as written, at {} moments: objectives within {:.0e}, first inputs within {:.0e} deg and {:.0e} km/h",
                written.moments,
                written.objective_relative,
                written.steering_wheel_max_deg,
                written.target_speed_max_kmh
            )?;
        }
        Ok(())
    }
}
