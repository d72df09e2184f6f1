//! `λ_g` and `λ_y` by what they predict.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

use faer::Mat;
use serde::{Deserialize, Serialize};

use super::error::AssessmentError;
use super::hold_out::{HoldOut, Split};
use super::prediction::{output_deviations, prediction_errors, training_predictor};
use crate::data::Dataset;
use crate::hankel::{Horizons, stacked_position};
use crate::program::{OutputPredictor, Regularisation, Slack};

/// Which weights to try and how to judge them.
///
/// For a prediction only the ratios of `λ_g`, `λ_u` and `λ_y` matter: with a hard `input_slack`
/// pairs of equal `λ_g/λ_y` predict alike. In control the size of all of them against the
/// weights of the plan matters too, and prediction says nothing about it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TuningSettings {
    /// Values of `λ_g` to try, per column ([`Regularisation::per_column`]), finite and above 0.
    pub lambda_g: Vec<f64>,
    /// Values of `λ_y` to try, finite and above 0.
    pub lambda_y: Vec<f64>,
    /// `λ_u`, the same for all, or hard.
    pub input_slack: Slack,
    /// What to hold out.
    pub hold_out: HoldOut,
    /// Most windows to judge by, at least 2.
    pub windows: usize,
    /// Places the windows. The same seed gives the same curve.
    pub seed: u64,
}

impl TuningSettings {
    /// Checks every field against its range.
    ///
    /// # Errors
    /// Names the first field that is out of range.
    pub fn check(&self) -> Result<(), AssessmentError> {
        for (field, values) in [("lambda_g", &self.lambda_g), ("lambda_y", &self.lambda_y)] {
            if values.is_empty() {
                return Err(AssessmentError::EmptyGrid { field });
            }
            for (index, &found) in values.iter().enumerate() {
                if !(found.is_finite() && found > 0.0) {
                    return Err(AssessmentError::GridValue {
                        field,
                        index,
                        found,
                    });
                }
            }
        }
        if self.windows < 2 {
            return Err(AssessmentError::Count {
                field: "windows",
                found: self.windows,
                least: 2,
            });
        }
        Ok(())
    }
}

/// `count` values from `first` to `last` in equal ratios; `first` alone if `count` is 1.
#[must_use]
pub fn logarithmic_grid(first: f64, last: f64, count: usize) -> Vec<f64> {
    let ratio = (last / first).ln() / count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|i| first * (ratio * i as f64).exp())
        .collect()
}

/// One pair of weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TuningPoint {
    /// `λ_g` per column.
    pub lambda_g: f64,
    /// `λ_y`.
    pub lambda_y: f64,
    /// Root mean square error over windows, steps and outputs, each output by its standard
    /// deviation: 1 is no better than the mean.
    pub error: f64,
    /// Mean over the windows of the squared error; `error` is its root.
    pub mean_square: f64,
    /// Standard error of `mean_square`. Windows that overlap are counted as what fits side by
    /// side.
    pub standard_error: f64,
    /// Root mean square error of every output (p), in its unit.
    pub output_errors: Vec<f64>,
}

/// A pair of weights that gives no predictor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RefusedPoint {
    /// `λ_g` per column.
    pub lambda_g: f64,
    /// `λ_y`.
    pub lambda_y: f64,
    /// Why.
    pub reason: String,
}

/// The prediction error of every pair of weights. JSON by `serde`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TuningCurve {
    /// `λ_u` of all points.
    pub input_slack: Slack,
    /// Output names, as in [`TuningPoint::output_errors`].
    pub output_names: Vec<String>,
    /// Windows judged by.
    pub windows: usize,
    /// How many windows without a common sample fit into what was held out.
    pub independent_windows: usize,
    /// All points, `λ_y` moving fastest. All numbers are finite.
    pub points: Vec<TuningPoint>,
    /// Pairs without a predictor.
    pub refused: Vec<RefusedPoint>,
    /// Index of the point with the least error.
    pub best: usize,
    /// Index of the most cautious point that is as good: of those whose mean square is within one
    /// standard error of the least, the one with the largest `λ_g/λ_y`, which trusts data and
    /// measurements least (the one-standard-error rule; Breiman, Friedman, Olshen, Stone 1984).
    pub one_standard_error: usize,
}

impl TuningCurve {
    /// The point with the least error.
    #[must_use]
    pub fn best(&self) -> &TuningPoint {
        &self.points[self.best]
    }

    /// The most cautious point within one standard error of the best.
    #[must_use]
    pub fn cautious(&self) -> &TuningPoint {
        &self.points[self.one_standard_error]
    }

    /// Writes one line per point, with a header: `lambda_g`, `lambda_y`, `error`, `mean_square`,
    /// `standard_error`, `choice` (`best`, `one_standard_error`, `both` or empty), and the error
    /// of each output as `error_NAME`.
    ///
    /// # Errors
    /// The writer fails.
    pub fn write_csv<W: Write>(&self, writer: W) -> Result<(), AssessmentError> {
        let mut table = csv::Writer::from_writer(writer);
        let fixed = [
            "lambda_g",
            "lambda_y",
            "error",
            "mean_square",
            "standard_error",
            "choice",
        ];
        let outputs = self.output_names.iter().map(|name| format!("error_{name}"));
        table.write_record(fixed.into_iter().map(String::from).chain(outputs))?;
        for (index, point) in self.points.iter().enumerate() {
            let choice = match (index == self.best, index == self.one_standard_error) {
                (true, true) => "both",
                (true, false) => "best",
                (false, true) => "one_standard_error",
                (false, false) => "",
            };
            let numbers = [
                point.lambda_g,
                point.lambda_y,
                point.error,
                point.mean_square,
                point.standard_error,
            ];
            let numbers = numbers.map(|value| format!("{value:e}")).into_iter();
            let outputs = point.output_errors.iter().map(|value| format!("{value:e}"));
            table.write_record(numbers.chain([choice.to_owned()]).chain(outputs))?;
        }
        table.flush().map_err(csv::Error::from)?;
        Ok(())
    }
}

/// Where a tuning run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TuningProgress {
    /// Pairs done.
    pub done: usize,
    /// Pairs in all.
    pub total: usize,
}

/// Tries every pair of weights on the windows held out.
///
/// The data are decomposed once; a pair then costs factorisations of matrices with (m + p)L rows
/// and columns, whatever the length of the recording.
///
/// # Errors
/// A setting is out of range, there is too little to predict with or to judge by, no output
/// changes, or no pair gives a predictor.
pub fn tune(
    dataset: &Dataset,
    horizons: Horizons,
    settings: &TuningSettings,
) -> Result<TuningCurve, AssessmentError> {
    tune_with(dataset, horizons, settings, &AtomicBool::new(false), |_| {})
}

/// As [`tune`]; calls `progress` after every pair and stops soon after `cancel` becomes true.
///
/// # Errors
/// As [`tune`], and [`AssessmentError::Interrupted`].
pub fn tune_with(
    dataset: &Dataset,
    horizons: Horizons,
    settings: &TuningSettings,
    cancel: &AtomicBool,
    mut progress: impl FnMut(TuningProgress),
) -> Result<TuningCurve, AssessmentError> {
    settings.check()?;
    let deviations = output_deviations(dataset);
    if deviations.iter().all(|&d| d <= 0.0) {
        return Err(AssessmentError::ConstantOutputs);
    }
    let total = settings.lambda_g.len() * settings.lambda_y.len();
    let stop = |done| {
        if cancel.load(Ordering::Relaxed) {
            Err(AssessmentError::Interrupted { done, total })
        } else {
            Ok(())
        }
    };
    stop(0)?;
    let split = Split::new(dataset, horizons, &settings.hold_out)?;
    let windows = split.windows(settings.windows, settings.seed);
    let predictor = training_predictor(&split.training, horizons)?;
    let (mut points, mut refused) = (Vec::with_capacity(total), Vec::new());
    let pairs = (settings.lambda_g.iter())
        .flat_map(|&lambda_g| settings.lambda_y.iter().map(move |&y| (lambda_g, y)));
    for (done, (lambda_g, lambda_y)) in pairs.enumerate() {
        stop(done)?;
        let outputs = OutputPredictor::new(
            &predictor,
            Regularisation::per_column(lambda_g),
            settings.input_slack,
            Slack::Penalty(lambda_y),
        );
        let point = outputs.map(|outputs| {
            let errors = prediction_errors(&outputs, &windows);
            judge(&errors, &deviations, windows.independent)
        });
        match point {
            Ok(judged) if judged.mean_square.is_finite() => points.push(TuningPoint {
                lambda_g,
                lambda_y,
                ..judged
            }),
            Ok(_) => refused.push(RefusedPoint {
                lambda_g,
                lambda_y,
                reason: "the predictions are not finite".into(),
            }),
            Err(error) => refused.push(RefusedPoint {
                lambda_g,
                lambda_y,
                reason: error.to_string(),
            }),
        }
        progress(TuningProgress {
            done: done + 1,
            total,
        });
    }
    let Some((best, one_standard_error)) = choose(&points) else {
        let reason = refused.swap_remove(0).reason;
        return Err(AssessmentError::NothingWorks {
            tried: total,
            reason,
        });
    };
    Ok(TuningCurve {
        input_slack: settings.input_slack,
        output_names: dataset.output_names().to_vec(),
        windows: windows.stacked.ncols(),
        independent_windows: windows.independent,
        points,
        refused,
        best,
        one_standard_error,
    })
}

/// `errors`: pN×windows.
fn judge(errors: &Mat<f64>, deviations: &[f64], independent: usize) -> TuningPoint {
    let (p, windows) = (deviations.len(), errors.ncols());
    let steps = errors.nrows() / p;
    let varying = deviations.iter().filter(|&&d| d > 0.0).count();
    let mut output_squares = vec![0.0; p];
    let mut window_squares = vec![0.0; windows];
    for (window, total) in window_squares.iter_mut().enumerate() {
        for (output, &deviation) in deviations.iter().enumerate() {
            let square: f64 = (0..steps)
                .map(|step| errors[(stacked_position(step, output, p), window)].powi(2))
                .sum();
            output_squares[output] += square;
            if deviation > 0.0 {
                *total += square / (deviation * deviation * (steps * varying) as f64);
            }
        }
    }
    let mean_square = window_squares.iter().sum::<f64>() / windows as f64;
    let scatter: f64 = window_squares
        .iter()
        .map(|s| (s - mean_square).powi(2))
        .sum();
    let variance = scatter / windows.saturating_sub(1).max(1) as f64;
    let entries = (windows * steps) as f64;
    TuningPoint {
        lambda_g: f64::NAN,
        lambda_y: f64::NAN,
        error: mean_square.sqrt(),
        mean_square,
        standard_error: (variance / independent.max(1) as f64).sqrt(),
        output_errors: output_squares
            .iter()
            .map(|s| (s / entries).sqrt())
            .collect(),
    }
}

/// Indices of the best and of the most cautious point within one standard error of it.
fn choose(points: &[TuningPoint]) -> Option<(usize, usize)> {
    let all = points.iter().enumerate();
    let (best, least) = all
        .clone()
        .min_by(|a, b| a.1.mean_square.total_cmp(&b.1.mean_square))?;
    let allowed = least.mean_square + least.standard_error;
    let caution = |point: &TuningPoint| point.lambda_g / point.lambda_y;
    let (cautious, _) = all
        .filter(|(_, point)| point.mean_square <= allowed)
        .max_by(|a, b| caution(a.1).total_cmp(&caution(b.1)))?;
    Some((best, cautious))
}
