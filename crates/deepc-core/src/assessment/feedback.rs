//! Were the inputs decided from the outputs while recording?
//!
//! Noise that feedback carries into the inputs biases every predictor that takes the inputs as
//! given (closed-loop identification; Söderström, Stoica 1989, ch. 10; for `DeePC`
//! Dinkla, Mulders, van Wingerden, Oomen 2023). The test asks whether past outputs predict an input
//! beyond what past inputs do (Granger 1969):
//!
//! ```text
//! uᵢ(t) on 1, u(t−1) … u(t−10)            leaves e₀ᵢ(t);  y(t−1) … y(t−3) on the same leaves ỹ(t)
//! 1 on Σ e₀ᵢ(t)·ỹ(t) over each block      explains S of B blocks,  d₁ = 3p regressors
//! F = (S/d₁)/((B − S)/d₂)                 partial R² of e₀ᵢ on ỹ, adjusted for d₁
//! ```
//!
//! This form of the test does not need an e₀ that is white and of the same size at all times
//! (Wooldridge 1991): inputs that are held for some samples are new at few of them. A block has
//! twice as many samples as the input stays at one value, on average; one if it never does. A
//! warning needs a significant F and an R² that matters. Feedback of what past inputs already
//! explain leaves no trace, and does no harm.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::channel::{ChannelStatistics, Role, Stretches};
use super::order::MOST_WINDOWS;
use super::special::f_tail;
use crate::data::Dataset;

/// Chance that inputs recorded without feedback (white, or autoregressive up to the lags used) give
/// a significant F in any channel: the false-alarm level, before the demand on R².
pub const FALSE_ALARM_LEVEL: f64 = 1e-3;

/// Smallest partial R² that matters. Outputs remember inputs older than the lags of the test; for
/// inputs held for some samples that alone can make an R² of 0.04.
pub const FEEDBACK_R_SQUARED: f64 = 0.05;

const INPUT_LAGS: usize = 10;
const OUTPUT_LAGS: usize = 3;

/// Rows of the regression for each of its columns, at least.
const ROWS_PER_COLUMN: usize = 3;

/// An input that its own past leaves less of than this is no random signal: nothing to test.
const PREDICTABLE: f64 = 1e-10;

/// Whether one input follows the outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeedbackTest {
    /// Input channel.
    pub name: String,
    /// Share of what is new in the input that past outputs explain, adjusted for the number of
    /// regressors; near 0 (or slightly below) without feedback. `None` if there is nothing to
    /// test: past inputs alone fix the input, or it changes too seldom.
    pub partial_r_squared: Option<f64>,
    /// F statistic.
    pub f: Option<f64>,
    /// Chance of an F this large without feedback.
    pub p_value: Option<f64>,
    /// Whether the p value is below [`FALSE_ALARM_LEVEL`] over the number of inputs, and the R²
    /// above [`FEEDBACK_R_SQUARED`].
    pub feedback: bool,
}

/// Empty if there are too few samples to tell.
pub(super) fn measure(
    dataset: &Dataset,
    channels: &[(String, Role, Stretches<'_>)],
    statistics: &[ChannelStatistics],
) -> Vec<FeedbackTest> {
    let (m, p) = (dataset.inputs(), dataset.outputs());
    let restricted = 1 + INPUT_LAGS * m;
    let full = restricted + OUTPUT_LAGS * p;
    let places: Vec<(usize, usize)> = (dataset.records().iter().enumerate())
        .flat_map(|(index, record)| (INPUT_LAGS..record.samples()).map(move |t| (index, t)))
        .collect();
    let stride = places.len().div_ceil(MOST_WINDOWS).max(1);
    let places: Vec<_> = places.into_iter().step_by(stride).collect();
    if places.len() < ROWS_PER_COLUMN * (full + m) {
        return Vec::new();
    }
    let first_output = channels.len() - p;
    let mut matrix = Mat::zeros(places.len(), full + m);
    matrix.col_mut(0).fill(1.0);
    let mut fill = |column: usize, channel: usize, lag: usize| {
        let (stretches, statistics) = (&channels[channel].2, &statistics[channel]);
        let scale = if statistics.deviation > 0.0 {
            statistics.deviation
        } else {
            1.0
        };
        let target = matrix.col_as_slice_mut(column);
        for (value, &(record, t)) in target.iter_mut().zip(&places) {
            *value = (stretches[record][t - lag] - statistics.mean) / scale;
        }
    };
    for lag in 1..=INPUT_LAGS {
        for input in 0..m {
            fill(1 + (lag - 1) * m + input, input, lag);
        }
    }
    for lag in 1..=OUTPUT_LAGS {
        for output in 0..p {
            fill(
                restricted + (lag - 1) * p + output,
                first_output + output,
                lag,
            );
        }
    }
    for input in 0..m {
        fill(full + input, input, 0);
    }
    let basis = matrix.subcols(0, restricted).qr().compute_thin_Q();
    let left = matrix.subcols(restricted, matrix.ncols() - restricted);
    let left = left - &basis * (basis.transpose() * left);
    let (outputs, inputs) = left.split_at_col(full - restricted);
    let test = |input: usize| {
        let name = dataset.input_names()[input].clone();
        let new = inputs.subcols(input, 1);
        let total = matrix.col(full + input).squared_norm_l2();
        let block = block_length(&channels[input].2);
        let blocks = places.len() / block;
        let predictable = new.squared_norm_l2() <= PREDICTABLE * total;
        if statistics[input].constant || predictable || blocks < ROWS_PER_COLUMN * outputs.ncols() {
            return FeedbackTest {
                name,
                partial_r_squared: None,
                f: None,
                p_value: None,
                feedback: false,
            };
        }
        let (d1, d2) = (outputs.ncols() as f64, (places.len() - full) as f64);
        let (explained, unexplained) = regress(outputs, new);
        let r_squared = 1.0 - (unexplained / d2) / ((explained + unexplained) / (d1 + d2));
        let products = Mat::from_fn(blocks, outputs.ncols(), |index, i| {
            let times = index * block..(index + 1) * block;
            times.map(|t| new[(t, 0)] * outputs[(t, i)]).sum::<f64>()
        });
        let ones = Mat::from_fn(blocks, 1, |_, _| 1.0);
        let (explained, unexplained) = regress(products.as_ref(), ones.as_ref());
        // What was taken from the samples to find e₀ and ỹ, shared out among the blocks.
        let d2 = d2 * blocks as f64 / places.len() as f64;
        let f = (explained / d1) / (unexplained / d2);
        let p_value = f_tail(f, d1, d2);
        FeedbackTest {
            name,
            partial_r_squared: Some(r_squared),
            f: Some(f),
            p_value: Some(p_value),
            feedback: p_value < FALSE_ALARM_LEVEL / m as f64 && r_squared >= FEEDBACK_R_SQUARED,
        }
    };
    (0..m).map(test).collect()
}

/// Twice the average number of samples that an input stays at one value; 1 if it never does.
fn block_length(stretches: &[&[f64]]) -> usize {
    let samples: usize = stretches.iter().map(|s| s.len()).sum();
    let runs: usize = stretches
        .iter()
        .map(|s| s.chunk_by(|a, b| a.total_cmp(b).is_eq()).count())
        .sum();
    let held = samples.div_ceil(runs.max(1));
    // A chance repetition or two is no hold.
    if 10 * runs > 9 * samples { 1 } else { 2 * held }
}

/// Explained and unexplained sum of squares of a column on regressors; the latter is above 0.
fn regress(regressors: MatRef<'_, f64>, column: MatRef<'_, f64>) -> (f64, f64) {
    let count = regressors.ncols();
    let both = Mat::from_fn(regressors.nrows(), count + 1, |t, i| {
        if i < count {
            regressors[(t, i)]
        } else {
            column[(t, 0)]
        }
    });
    let decomposition = both.qr();
    let last = decomposition.thin_R().col(count);
    let explained = last.subrows(0, count).squared_norm_l2();
    let unexplained = last[count].powi(2);
    (explained, unexplained.max(f64::EPSILON * explained))
}
