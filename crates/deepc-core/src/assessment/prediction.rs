//! How well the data predict what they have not seen.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::error::AssessmentError;
use super::hold_out::{HoldOut, Split, Windows};
use crate::data::{Dataset, Record};
use crate::hankel::{HankelMatrix, Horizons, stacked_position};
use crate::predictor::Predictor;
use crate::program::{OutputPredictor, Regularisation, Slack};

/// How outputs are predicted from a past and inputs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PredictionMethod {
    /// The least-squares predictor of subspace predictive control (Favoreel, De Moor, Gevers
    /// 1999): no weight to choose. It says what the data are worth.
    LeastSquares,
    /// As a controller with these weights predicts when its cost on the plan does not pull.
    Weighted {
        /// Weight of g.
        regularisation: Regularisation,
        /// `λ_u`, or hard.
        input_slack: Slack,
        /// `λ_y`, or hard.
        output_slack: Slack,
    },
}

/// What to hold out and how to predict it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PredictionSettings {
    /// How to predict.
    pub method: PredictionMethod,
    /// What to hold out.
    pub hold_out: HoldOut,
    /// Most windows to judge by, at least 1; fewer if the hold-out has fewer. Windows may
    /// overlap each other, never the data that predict.
    pub windows: usize,
    /// Places the windows if there are more than that. The same seed gives the same windows.
    pub seed: u64,
}

impl PredictionSettings {
    /// Least squares on the last quarter of every record, all windows up to 2000.
    #[must_use]
    pub fn least_squares() -> Self {
        Self {
            method: PredictionMethod::LeastSquares,
            hold_out: HoldOut::LastQuarter,
            windows: 2000,
            seed: 0,
        }
    }

    /// The same with the weights of a controller.
    #[must_use]
    pub fn weighted(
        regularisation: Regularisation,
        input_slack: Slack,
        output_slack: Slack,
    ) -> Self {
        Self {
            method: PredictionMethod::Weighted {
                regularisation,
                input_slack,
                output_slack,
            },
            ..Self::least_squares()
        }
    }
}

/// Every prediction error of the windows held out, measured minus predicted.
#[derive(Debug, Clone)]
pub struct HoldOutErrors {
    horizons: Horizons,
    method: PredictionMethod,
    names: Vec<String>,
    deviations: Vec<f64>,
    training_samples: usize,
    held_samples: usize,
    independent: usize,
    /// pN×windows, stacked time-major.
    errors: Mat<f64>,
}

impl HoldOutErrors {
    /// Predicts the windows held out with the rest of the data.
    ///
    /// # Errors
    /// A setting is out of range, there is too little to predict with or to judge by, or the
    /// inputs of what is left do not excite.
    pub fn measure(
        dataset: &Dataset,
        horizons: Horizons,
        settings: &PredictionSettings,
    ) -> Result<Self, AssessmentError> {
        if settings.windows == 0 {
            return Err(AssessmentError::Count {
                field: "windows",
                found: 0,
                least: 1,
            });
        }
        let split = Split::new(dataset, horizons, &settings.hold_out)?;
        let predictor = training_predictor(&split.training, horizons)?;
        let outputs = output_predictor(&predictor, settings.method)?;
        let windows = split.windows(settings.windows, settings.seed);
        Ok(Self {
            horizons,
            method: settings.method,
            names: dataset.output_names().to_vec(),
            deviations: output_deviations(dataset),
            training_samples: split.training.samples(),
            held_samples: split.held_samples(),
            independent: windows.independent,
            errors: prediction_errors(&outputs, &windows),
        })
    }

    /// Number of windows.
    #[must_use]
    pub fn windows(&self) -> usize {
        self.errors.ncols()
    }

    /// Measured minus predicted of output `output` at `step` of the horizon (both from 0), one
    /// per window in the order of time.
    ///
    /// # Panics
    /// If there is no such output or step.
    pub fn errors_of(&self, output: usize, step: usize) -> impl Iterator<Item = f64> + '_ {
        assert!(output < self.names.len(), "output {output}");
        assert!(step < self.horizons.future, "step {step}");
        let row = stacked_position(step, output, self.names.len());
        self.errors.row(row).iter().copied()
    }

    /// Root mean squares by output and step.
    #[must_use]
    pub fn summary(&self) -> HoldOutPrediction {
        let steps = self.horizons.future;
        let output = |index: usize| {
            let mean_square = |step| {
                let sum: f64 = self.errors_of(index, step).map(|e| e * e).sum();
                sum / self.windows() as f64
            };
            let squares: Vec<f64> = (0..steps).map(mean_square).collect();
            let overall = (squares.iter().sum::<f64>() / steps as f64).sqrt();
            let deviation = self.deviations[index];
            let varies = deviation > 0.0;
            let rms: Vec<f64> = squares.iter().map(|s| s.sqrt()).collect();
            OutputError {
                name: self.names[index].clone(),
                deviation,
                normalised: varies.then(|| rms.iter().map(|e| e / deviation).collect()),
                normalised_overall: varies.then_some(overall / deviation),
                rms,
                rms_overall: overall,
                largest: (0..steps)
                    .flat_map(|step| self.errors_of(index, step))
                    .fold(0.0, |most, e| most.max(e.abs())),
            }
        };
        HoldOutPrediction {
            method: self.method,
            training_samples: self.training_samples,
            held_samples: self.held_samples,
            windows: self.windows(),
            independent_windows: self.independent,
            outputs: (0..self.names.len()).map(output).collect(),
        }
    }

    /// How far a prediction may be off, with probability `level`: the conformal quantile of |e|,
    /// the ⌈(W + 1)·level⌉-th smallest of W windows (Vovk, Gammerman, Shafer 2005; Lei, G'Sell,
    /// Rinaldo, Tibshirani, Wasserman 2018, theorem 2). A bound on an output that is tightened by
    /// it is met with that probability at each step, provided the future is exchangeable with the
    /// windows held out: recorded under the conditions of use. Windows that overlap carry less
    /// than their number.
    ///
    /// # Errors
    /// `level` is not above 0 and below 1, or there are too few windows for it.
    pub fn margin(&self, level: f64) -> Result<HoldOutMargin, AssessmentError> {
        if !(level > 0.0 && level < 1.0) {
            return Err(AssessmentError::Level { found: level });
        }
        let windows = self.windows();
        let Some(rank) = (1..=windows).find(|&k| k as f64 >= (windows + 1) as f64 * level) else {
            return Err(AssessmentError::TooFewWindows {
                level,
                windows,
                // The smallest W with W ≥ (W + 1)·level.
                needed: (level / (1.0 - level)).ceil(),
            });
        };
        let quantile = |output, step| {
            let mut sizes: Vec<f64> = self.errors_of(output, step).map(f64::abs).collect();
            *sizes.select_nth_unstable_by(rank - 1, f64::total_cmp).1
        };
        let output = |index: usize| {
            let per_step: Vec<f64> = (0..self.horizons.future)
                .map(|step| quantile(index, step))
                .collect();
            OutputMargin {
                name: self.names[index].clone(),
                flat: per_step.iter().copied().fold(0.0, f64::max),
                per_step,
            }
        };
        Ok(HoldOutMargin {
            level,
            windows,
            outputs: (0..self.names.len()).map(output).collect(),
        })
    }
}

/// [`HoldOutErrors::margin`] in one call.
///
/// # Errors
/// As [`HoldOutErrors::measure`] and [`HoldOutErrors::margin`].
pub fn hold_out_margin(
    dataset: &Dataset,
    horizons: Horizons,
    settings: &PredictionSettings,
    level: f64,
) -> Result<HoldOutMargin, AssessmentError> {
    HoldOutErrors::measure(dataset, horizons, settings)?.margin(level)
}

/// Prediction errors over the windows held out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HoldOutPrediction {
    /// How it was predicted.
    pub method: PredictionMethod,
    /// Samples that predicted.
    pub training_samples: usize,
    /// Samples held out.
    pub held_samples: usize,
    /// Windows predicted.
    pub windows: usize,
    /// How many windows without a common sample fit into what was held out.
    pub independent_windows: usize,
    /// Every output.
    pub outputs: Vec<OutputError>,
}

/// Prediction error of one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputError {
    /// Channel name.
    pub name: String,
    /// Standard deviation of the channel over the whole recording, in its unit.
    pub deviation: f64,
    /// Root mean square error at each step of the horizon (N), in the channel's unit.
    pub rms: Vec<f64>,
    /// Over all steps.
    pub rms_overall: f64,
    /// Largest error of any window and step.
    pub largest: f64,
    /// `rms` divided by `deviation`: 1 is no better than the channel's mean. `None` if the
    /// channel never changes.
    pub normalised: Option<Vec<f64>>,
    /// Over all steps.
    pub normalised_overall: Option<f64>,
}

/// How far predictions may be off with a given probability.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HoldOutMargin {
    /// The probability.
    pub level: f64,
    /// Windows it stands on.
    pub windows: usize,
    /// Every output.
    pub outputs: Vec<OutputMargin>,
}

/// How far predictions of one output may be off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputMargin {
    /// Channel name.
    pub name: String,
    /// At each step of the horizon (N), in the channel's unit.
    pub per_step: Vec<f64>,
    /// The largest of them: one margin for all steps.
    pub flat: f64,
}

/// Reduced exactly, so that every choice of weights costs a small factorisation only.
pub(super) fn training_predictor(
    training: &Dataset,
    horizons: Horizons,
) -> Result<Predictor, AssessmentError> {
    let hankel = HankelMatrix::build(training, horizons)?;
    // The output predictor refuses inputs that do not excite.
    Ok(Predictor::exact(&hankel.assume_persistently_exciting())?)
}

fn output_predictor(
    predictor: &Predictor,
    method: PredictionMethod,
) -> Result<OutputPredictor, AssessmentError> {
    Ok(match method {
        // With hard slack the weight of g changes nothing.
        PredictionMethod::LeastSquares => OutputPredictor::new(
            predictor,
            Regularisation::per_column(1.0),
            Slack::Hard,
            Slack::Hard,
        ),
        PredictionMethod::Weighted {
            regularisation,
            input_slack,
            output_slack,
        } => OutputPredictor::new(predictor, regularisation, input_slack, output_slack),
    }?)
}

/// Measured minus predicted, pN×windows.
pub(super) fn prediction_errors(predictor: &OutputPredictor, windows: &Windows) -> Mat<f64> {
    let gain = predictor.gain();
    let known = windows.stacked.subrows(0, gain.ncols());
    windows.stacked.subrows(gain.ncols(), gain.nrows()) - gain * known
}

/// Standard deviation of every output over all records; 0 for one that never changes.
pub(super) fn output_deviations(dataset: &Dataset) -> Vec<f64> {
    let series: Vec<_> = dataset.records().iter().map(Record::outputs).collect();
    (0..dataset.outputs())
        .map(|channel| deviation(&series, channel))
        .collect()
}

fn deviation(series: &[MatRef<'_, f64>], channel: usize) -> f64 {
    let values = || series.iter().flat_map(|s| s.col(channel).iter().copied());
    let count = values().count().max(1) as f64;
    let mean = values().sum::<f64>() / count;
    let size = (values().map(|v| v * v).sum::<f64>() / count).sqrt();
    let deviation = (values().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
    // A constant channel keeps the rounding of its mean.
    if deviation > crate::hankel::RANK_TOLERANCE * size {
        deviation
    } else {
        0.0
    }
}
