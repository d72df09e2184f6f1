//! How well a model explains records it was not made from.

use deepc_core::faer::{ColRef, Mat};

use crate::error::SysidError;
use crate::input_fit::fit_initial_states;
use crate::prediction_error::errors_ahead;
use crate::state_space::SystemMatrices;
use crate::working::WorkingData;

/// Mean squared errors per output, over all records.
#[derive(Debug, Clone)]
pub(super) struct Errors {
    /// Of the simulated output, from the initial state that suits it best.
    pub simulation: Vec<f64>,
    /// Of the prediction so many steps ahead.
    pub prediction: Vec<f64>,
}

/// Lags over which errors are taken to be correlated.
const LAGS: usize = 200;

/// An error below this is rounding, and differences between such are of no matter.
pub(super) const ROUNDING: f64 = 1e-20;

impl Errors {
    /// Evaluates a model of scaled deviations on records.
    pub fn of(
        data: &WorkingData,
        model: &SystemMatrices,
        steps_ahead: usize,
    ) -> Result<Self, SysidError> {
        let simulation = simulation_errors(data, model)?;
        let initial = fit_initial_states(data, model)?;
        let p = model.outputs();
        let mut sums = vec![0.0; p];
        let mut count = 0;
        for (record, initial) in data.records.iter().zip(&initial) {
            let samples = record.samples();
            if samples < steps_ahead {
                continue;
            }
            errors_ahead(model, initial, record, steps_ahead, |k, errors| {
                if k < steps_ahead {
                    return;
                }
                for (sum, errors) in sums.iter_mut().zip(errors.col_iter()) {
                    let later = errors.iter().skip(k - 1);
                    *sum += later.map(|error| error * error).sum::<f64>();
                }
            });
            count += samples + 1 - steps_ahead;
        }
        let prediction = if count == 0 {
            simulation.clone()
        } else {
            sums.into_iter().map(|sum| sum / count as f64).collect()
        };
        Ok(Self {
            simulation,
            prediction,
        })
    }

    /// The logarithm of the errors, averaged over both kinds and all outputs: what is compared.
    pub fn score(&self) -> f64 {
        0.5 * (mean_log(&self.simulation) + mean_log(&self.prediction))
    }
}

/// Mean logarithm of mean squared errors; infinite if one is NaN.
pub(super) fn mean_log(errors: &[f64]) -> f64 {
    let logs = errors.iter().map(|error| {
        if error.is_nan() {
            f64::INFINITY
        } else {
            error.max(ROUNDING).ln()
        }
    });
    logs.sum::<f64>() / errors.len() as f64
}

/// Mean squared errors of the simulated output, per output.
pub(super) fn simulation_errors(
    data: &WorkingData,
    model: &SystemMatrices,
) -> Result<Vec<f64>, SysidError> {
    Ok(mean_squares(&simulated(data, model)?))
}

/// Mean squares per output of errors T×p of every record.
pub(super) fn mean_squares(records: &[Mat<f64>]) -> Vec<f64> {
    let mut sums = vec![0.0; records.first().map_or(0, Mat::ncols)];
    for errors in records {
        for (sum, errors) in sums.iter_mut().zip(errors.col_iter()) {
            *sum += errors.squared_norm_l2();
        }
    }
    let samples = records.iter().map(Mat::nrows).sum::<usize>() as f64;
    sums.into_iter().map(|sum| sum / samples).collect()
}

/// The same by parts of every record: one entry per part, each with one mean per output.
pub(super) fn mean_squares_by_part(records: &[Mat<f64>], parts: usize) -> Vec<Vec<f64>> {
    let mut means = Vec::new();
    for errors in records {
        let samples = errors.nrows();
        for part in 0..parts {
            let (from, to) = (samples * part / parts, samples * (part + 1) / parts);
            // A record with fewer samples than parts; the mean of nothing would be NaN.
            if from == to {
                continue;
            }
            let of_part = errors.subrows(from, to - from);
            let mean = |errors: ColRef<'_, f64>| errors.squared_norm_l2() / (to - from) as f64;
            means.push(of_part.col_iter().map(mean).collect());
        }
    }
    means
}

/// Errors of the simulated output, T×p per record.
pub(super) fn simulated(
    data: &WorkingData,
    model: &SystemMatrices,
) -> Result<Vec<Mat<f64>>, SysidError> {
    let without_gain = SystemMatrices {
        k: Mat::zeros(model.order(), model.outputs()),
        ..model.clone()
    };
    let initial = fit_initial_states(data, &without_gain)?;
    let records = data.records.iter().zip(&initial);
    let errors = records
        .map(|(record, initial)| &record.outputs - model.simulate(initial, record.inputs.as_ref()));
    Ok(errors.collect())
}

/// Number of independent samples that the simulation's errors are worth: they are coloured by whatever
/// noise and model error there is. N/(1 + 2Σρ²), ρ the autocorrelations (Bartlett 1946), mean over the
/// outputs.
pub(super) fn effective_samples(
    data: &WorkingData,
    model: &SystemMatrices,
) -> Result<f64, SysidError> {
    let (p, samples) = (model.outputs(), data.samples());
    let mut covariances = vec![vec![0.0; LAGS + 1]; p];
    for errors in simulated(data, model)? {
        for (channel, sums) in covariances.iter_mut().enumerate() {
            let errors = errors.col_as_slice(channel);
            for (lag, sum) in sums.iter_mut().enumerate() {
                let later = errors.iter().skip(lag);
                *sum += errors.iter().zip(later).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
    let worth = covariances.iter().map(|sums| {
        let squares = sums[1..].iter().map(|sum| (sum / sums[0]).powi(2));
        let squares: f64 = squares.filter(|square| square.is_finite()).sum();
        samples as f64 / (1.0 + 2.0 * squares)
    });
    Ok(worth.sum::<f64>() / p as f64)
}

/// Covariance of the one-step prediction errors, p×p.
pub(super) fn innovation_covariance(
    data: &WorkingData,
    model: &SystemMatrices,
) -> Result<Mat<f64>, SysidError> {
    let initial = fit_initial_states(data, model)?;
    let mut covariance = Mat::zeros(model.outputs(), model.outputs());
    for (record, initial) in data.records.iter().zip(&initial) {
        errors_ahead(model, initial, record, 1, |_, errors| {
            covariance += errors.transpose() * errors;
        });
    }
    covariance /= deepc_core::faer::Scale(data.samples() as f64);
    Ok(covariance)
}
