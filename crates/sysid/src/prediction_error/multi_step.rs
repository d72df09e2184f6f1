//! K for predictions several steps ahead.
//!
//! One step ahead, the best K of a model that is too simple leans on the last output: neighbouring
//! samples are alike, and the prediction is wrong a few steps later. A controller needs those.

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{ColRef, Mat, MatRef, Side};

use super::predictor_radius;
use crate::error::SysidError;
use crate::input_fit::fit_initial_states;
use crate::kernels::{Output, march};
use crate::stability::spectral_radius;
use crate::state_space::{SystemMatrices, by_sample};
use crate::working::{WorkingData, WorkingRecord};

/// Steps of Levenberg-Marquardt at most.
const ITERATIONS: usize = 20;

/// A step that gains less than this fraction is the last.
const TOLERANCE: f64 = 1e-4;

/// Size of the differences that give the Jacobian, relative to 1: signals are scaled.
const DIFFERENCE: f64 = 1e-6;

/// Damping that no longer lets anything move.
const MOST_DAMPING: f64 = 1e8;

/// A predictor may remember this fraction of the longest record, or as long as its model. One that
/// remembers longer uses its initial state to follow a drift, and drifts where there is none.
const MEMORY: f64 = 0.05;

/// K that minimises the mean squared errors of the predictions 1 to `steps` ahead, all alike, from K = 0
/// and from that of `model`. A − KC stays within `radius`, and forgets.
///
/// # Errors
/// A is too unstable to be evaluated.
pub(crate) fn refine_gain(
    data: &WorkingData,
    model: &SystemMatrices,
    steps: usize,
    radius: f64,
) -> Result<SystemMatrices, SysidError> {
    let longest = data.records.iter().map(WorkingRecord::samples).max();
    let forgets = 1.0 - 1.0 / (MEMORY * longest.unwrap_or(1) as f64).max(1.0);
    let limit = forgets.max(spectral_radius(model.a.as_ref())).min(radius);
    let zero = SystemMatrices {
        k: Mat::zeros(model.order(), model.outputs()),
        ..model.clone()
    };
    let mut best = descend(data, &zero, steps, limit)?;
    if model.k.norm_max() > 0.0 && predictor_radius(model) <= limit {
        let other = descend(data, model, steps, limit)?;
        if other.1 < best.1 {
            best = other;
        }
    }
    Ok(best.0)
}

fn descend(
    data: &WorkingData,
    start: &SystemMatrices,
    steps: usize,
    limit: f64,
) -> Result<(SystemMatrices, f64), SysidError> {
    let (n, p) = (start.order(), start.outputs());
    let count = n * p;
    let mut best = start.clone();
    let mut residuals = all_errors(data, &best, steps)?;
    let mut loss = squares(&residuals);
    let mut damping = 1e-3;
    for _ in 0..ITERATIONS {
        let mut jacobian = Mat::zeros(residuals.len(), count);
        for index in 0..count {
            let mut moved = best.clone();
            moved.k[(index % n, index / n)] += DIFFERENCE;
            let changed = all_errors(data, &moved, steps)?;
            let column = jacobian.col_as_slice_mut(index).iter_mut();
            for (slope, (new, old)) in column.zip(changed.iter().zip(&residuals)) {
                *slope = (new - old) / DIFFERENCE;
            }
        }
        let normal = jacobian.transpose() * &jacobian;
        let gradient = jacobian.transpose() * ColRef::from_slice(&residuals).as_mat();
        let before = loss;
        while damping < MOST_DAMPING {
            let damped = Mat::from_fn(count, count, |i, j| {
                let more = if i == j {
                    damping * normal[(i, i)]
                } else {
                    0.0
                };
                normal[(i, j)] + more
            });
            let Ok(factor) = damped.llt(Side::Lower) else {
                damping *= 10.0;
                continue;
            };
            let step = factor.solve(&gradient);
            let mut moved = best.clone();
            for index in 0..count {
                moved.k[(index % n, index / n)] -= step[(index, 0)];
            }
            if predictor_radius(&moved) <= limit {
                let changed = all_errors(data, &moved, steps)?;
                let found = squares(&changed);
                if found < loss {
                    (best, residuals, loss) = (moved, changed, found);
                    damping = (damping / 5.0).max(1e-12);
                    break;
                }
            }
            damping *= 5.0;
        }
        if loss.is_nan() || loss > before * (1.0 - TOLERANCE) {
            break;
        }
    }
    Ok((best, loss))
}

fn squares(errors: &[f64]) -> f64 {
    errors.iter().map(|error| error * error).sum()
}

/// Errors of the predictions 1 to `steps` ahead, of all records.
fn all_errors(
    data: &WorkingData,
    model: &SystemMatrices,
    steps: usize,
) -> Result<Vec<f64>, SysidError> {
    let initial = fit_initial_states(data, model)?;
    let mut all = Vec::new();
    for (record, initial) in data.records.iter().zip(&initial) {
        errors_ahead(model, initial, record, steps, |k, errors| {
            for channel in errors.col_iter() {
                all.extend(channel.iter().skip(k - 1));
            }
        });
    }
    Ok(all)
}

/// Calls `take` with every k = 1..=`steps` and y(t) − ŷ(t | t−k), T×p, of one record; the first k − 1
/// rows use all outputs before them.
///
/// ```text
/// ŷ(t | t−k−1) = ŷ(t | t−k) − C A^(k−1) K e(t−k),    e(t) = y(t) − ŷ(t | t−1)
/// ```
pub(crate) fn errors_ahead(
    model: &SystemMatrices,
    initial: &[f64],
    record: &WorkingRecord,
    steps: usize,
    mut take: impl FnMut(usize, &Mat<f64>),
) {
    let (p, samples) = (model.outputs(), record.samples());
    let mut innovations = by_sample(record.outputs.as_ref());
    march(
        model,
        initial,
        &by_sample(record.inputs.as_ref()),
        &mut innovations,
        &mut [],
        Output::Difference,
    );
    let innovations = MatRef::from_row_major_slice(&innovations, samples, p).to_owned();
    let mut errors = innovations.clone();
    let mut gain = model.k.clone();
    for k in 1..=steps {
        take(k, &errors);
        if k == steps {
            break;
        }
        let response = &model.c * &gain;
        for j in 0..p {
            for i in 0..p {
                let weight = response[(i, j)];
                let late = errors.col_as_slice_mut(i).iter_mut().skip(k);
                let early = innovations.col_as_slice(j).iter();
                late.zip(early).for_each(|(error, e)| *error += weight * e);
            }
        }
        gain = &model.a * &gain;
    }
}
