//! How good a model is on data: fits over the horizon, and whether its residuals are white.

mod correlation;
mod display;
mod residual;
mod score;
mod special;
mod verdict;

use std::ops::RangeInclusive;

use deepc_core::data::{Dataset, Record};
use deepc_core::faer::Mat;
use serde::{Deserialize, Serialize};

pub use correlation::Correlation;
pub use residual::{InputTest, Portmanteau, ResidualTests, Whiteness};
pub use score::Score;

use crate::error::SysidError;
use crate::state_space::{InitialStateFor, StateSpace};
use crate::working::check_channels;
use score::Tally;

/// Allowed confidence of bands and tests.
const CONFIDENCE: RangeInclusive<f64> = 0.5..=0.999_999;

/// What to validate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValidationSettings {
    /// Steps of the prediction horizon, at least 1.
    pub steps: usize,
    /// Largest lag of the correlations in samples, at least 1.
    pub lags: usize,
    /// Confidence of the bands and of the tests, 0.5 to 0.999999: so often do the residuals of the
    /// true model pass each single test.
    pub confidence: f64,
}

impl Default for ValidationSettings {
    /// 20 steps, 25 lags, 99 %.
    fn default() -> Self {
        Self {
            steps: 20,
            lags: 25,
            confidence: 0.99,
        }
    }
}

impl ValidationSettings {
    /// With the future horizon of a controller as the steps.
    #[must_use]
    pub fn for_horizon(steps: usize) -> Self {
        Self {
            steps,
            ..Self::default()
        }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// A field is out of range; the message names it.
    pub fn check(&self) -> Result<(), SysidError> {
        let wrong = |field, found: String, allowed: String| {
            Err(SysidError::Setting {
                field,
                found,
                allowed,
            })
        };
        if self.steps == 0 {
            return wrong("steps", "0".into(), "give at least 1".into());
        }
        if self.lags == 0 {
            return wrong("lags", "0".into(), "give at least 1".into());
        }
        if !CONFIDENCE.contains(&self.confidence) {
            let (low, high) = (CONFIDENCE.start(), CONFIDENCE.end());
            let allowed = format!("give {low} to {high}, 0.99 for 99 %");
            return wrong("confidence", self.confidence.to_string(), allowed);
        }
        Ok(())
    }
}

/// What a model does on data. Use data that it was not identified from: on its own data the fits
/// flatter and the tests pass too easily.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validation {
    /// What was asked for.
    pub settings: ValidationSettings,
    /// Sample time in seconds.
    pub sample_time_s: f64,
    /// Samples of every record.
    pub record_samples: Vec<usize>,
    /// Order of the model.
    pub order: usize,
    /// Spectral radius of A; the model is stable below 1.
    pub spectral_radius: f64,
    /// Spectral radius of A − K C.
    pub predictor_radius: f64,
    /// Every output.
    pub outputs: Vec<OutputValidation>,
}

/// One output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputValidation {
    /// Name.
    pub name: String,
    /// Simulation from the inputs alone, every record from its own least-squares initial state.
    /// None if the simulation of an unstable model left the range of numbers.
    pub simulation: Option<Score>,
    /// Prediction 1, 2, … steps ahead. The first k−1 samples of a record, for which there is no
    /// output k samples before, do not count.
    pub prediction: Vec<Score>,
    /// Tests of the one-step residual.
    pub residual: ResidualTests,
    /// What the tests say, in sentences.
    pub verdict: Vec<String>,
}

impl Validation {
    /// Validates a model on all records of `data`. Initial states are estimated for each record,
    /// and nothing reaches across records: neither filter, nor prediction, nor a pair of lagged
    /// samples.
    ///
    /// # Errors
    /// A setting is out of range; channels or sample time are not those of the model; no record has
    /// more samples than the steps, the lags and the order need; or A − K C is so unstable that a
    /// prediction leaves the range of numbers.
    pub fn of(
        model: &StateSpace,
        data: &Dataset,
        settings: &ValidationSettings,
    ) -> Result<Self, SysidError> {
        settings.check()?;
        check_channels(model, data)?;
        check_length(model, data, settings)?;
        let spectral_radius = model.spectral_radius()?;
        let mut parts = Vec::new();
        for record in data.records() {
            parts.push(RecordPart::of(model, record, settings, spectral_radius)?);
        }
        let outputs = (0..model.outputs().len())
            .map(|i| output(model, &parts, settings, i))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            settings: settings.clone(),
            sample_time_s: model.sample_time_s(),
            record_samples: data.records().iter().map(Record::samples).collect(),
            order: model.order(),
            spectral_radius,
            predictor_radius: model.predictor_radius()?,
            outputs,
        })
    }
}

/// What one record contributes.
struct RecordPart {
    /// T×M.
    inputs: Mat<f64>,
    /// T×p.
    outputs: Mat<f64>,
    /// T×p, if it stayed finite.
    simulated: Option<Mat<f64>>,
    /// For every step T×p.
    predicted: Vec<Mat<f64>>,
}

impl RecordPart {
    fn of(
        model: &StateSpace,
        record: &Record,
        settings: &ValidationSettings,
        radius: f64,
    ) -> Result<Self, SysidError> {
        let (decided, measured) = (record.inputs(), record.disturbances());
        let m = decided.ncols();
        let inputs = Mat::from_fn(record.samples(), m + measured.ncols(), |k, j| {
            match j.checked_sub(m) {
                None => decided[(k, j)],
                Some(j) => measured[(k, j)],
            }
        });
        let outputs = record.outputs();
        let simulated =
            match model.initial_state(inputs.as_ref(), outputs, InitialStateFor::Simulation) {
                Ok(state) => Some(model.simulate(&state, inputs.as_ref())?).filter(is_finite),
                // What an unstable model does over a long record is a finding, not a failure.
                Err(SysidError::Unstable { .. }) if radius >= 1.0 => None,
                Err(error) => return Err(error),
            };
        let state = model.initial_state(inputs.as_ref(), outputs, InitialStateFor::Prediction)?;
        let predicted = model.predictions(settings.steps, &state, inputs.as_ref(), outputs)?;
        if !predicted.iter().all(is_finite) {
            return Err(SysidError::Unstable {
                what: "A − K C",
                radius: model.predictor_radius()?,
                limit: 1.0,
                remedy: "its predictions leave the range of numbers; estimate K again",
            });
        }
        Ok(Self {
            inputs,
            outputs: outputs.to_owned(),
            simulated,
            predicted,
        })
    }
}

fn output(
    model: &StateSpace,
    parts: &[RecordPart],
    settings: &ValidationSettings,
    i: usize,
) -> Result<OutputValidation, SysidError> {
    let mut simulation = Some(Tally::default());
    let mut prediction = vec![Tally::default(); settings.steps];
    let mut residuals = Vec::new();
    for part in parts {
        let measured = part.outputs.col_as_slice(i);
        match (&part.simulated, &mut simulation) {
            (Some(simulated), Some(tally)) => tally.add(measured, simulated.col_as_slice(i)),
            _ => simulation = None,
        }
        for (before, (tally, predicted)) in prediction.iter_mut().zip(&part.predicted).enumerate() {
            let from = before.min(measured.len());
            tally.add(&measured[from..], &predicted.col_as_slice(i)[from..]);
        }
        let predicted = part.predicted[0].col_as_slice(i);
        let residual = measured.iter().zip(predicted).map(|(y, ahead)| y - ahead);
        residuals.push(residual.collect::<Vec<_>>());
    }
    let channels = model.inputs().iter().chain(model.disturbances());
    let inputs: Vec<(&str, Vec<&[f64]>)> = channels
        .enumerate()
        .map(|(j, channel)| {
            let series = parts.iter().map(|part| part.inputs.col_as_slice(j));
            (channel.name.as_str(), series.collect())
        })
        .collect();
    let spread = prediction[0].spread();
    let residual = ResidualTests::of(&residuals, spread, &inputs, settings)?;
    let name = model.outputs()[i].name.clone();
    Ok(OutputValidation {
        verdict: verdict::sentences(model, i, &residual, settings),
        simulation: simulation.map(|tally| tally.score()),
        prediction: prediction.iter().map(Tally::score).collect(),
        residual,
        name,
    })
}

fn is_finite(series: &Mat<f64>) -> bool {
    (0..series.ncols()).all(|j| series.col(j).iter().all(|value| value.is_finite()))
}

fn check_length(
    model: &StateSpace,
    data: &Dataset,
    settings: &ValidationSettings,
) -> Result<(), SysidError> {
    let longest = data.records().iter().map(Record::samples).max();
    let longest = longest.unwrap_or(0);
    let (steps, lags, order) = (settings.steps, settings.lags, model.order());
    // A correlation over as many lags as there are samples says nothing; half of them is the least.
    let needed = (lags.saturating_mul(2).max(steps)).saturating_add(order + 2);
    if longest < needed {
        return Err(SysidError::TooShortToValidate {
            longest,
            steps,
            lags,
            order,
            needed,
        });
    }
    Ok(())
}
