//! What was found, and how far it can be trusted.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use super::order::OrderTrial;
use super::settings::{FocusChoice, OffsetChoice};
use crate::subspace::Weighting;

/// A steady-state gain whose standard error is above this fraction of it has no sign that could be relied
/// on: at the limit one in forty comes out wrong.
pub const UNIDENTIFIED_RATIO: f64 = 0.5;

/// A response whose standard error is above this fraction of it at every frequency is not identified at
/// all. Stricter than [`UNIDENTIFIED_RATIO`], because the best of many frequencies is looked at.
pub const UNIDENTIFIED_RESPONSE_RATIO: f64 = 1.0 / 3.0;

/// Everything [`identify`](crate::identify) found beside the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentificationReport {
    /// Samples of all records.
    pub samples: usize,
    /// Records.
    pub records: usize,
    /// Order n of the model.
    pub order: usize,
    /// Every order tried.
    pub trials: Vec<OrderTrial>,
    /// Horizon of the subspace estimate that the model comes from.
    pub horizon: usize,
    /// Its weighting.
    pub weighting: Weighting,
    /// Singular values of that estimate, relative to the largest.
    pub singular_values: Vec<f64>,
    /// What was taken from the channels.
    #[serde(default)]
    pub offsets: OffsetChoice,
    /// What the model was refined for.
    pub focus: FocusChoice,
    /// Whether it was refined by prediction error, or is the subspace estimate itself.
    pub refined: bool,
    /// Spectral radius of the subspace estimate before its poles were moved inside, if they were.
    pub unstable_radius: Option<f64>,
    /// Fit of the simulation on held-out samples before the last refit, NRMSE in %, per output.
    pub held_out_fit: Vec<f64>,
    /// The same of the prediction so many steps ahead.
    pub held_out_prediction_fit: Vec<f64>,
    /// Steps ahead of that prediction: those of the settings, or fewer if the held-out records are
    /// shorter.
    pub steps_ahead: usize,
    /// Effects of the inputs and measured disturbances on every output.
    pub effects: Vec<InputEffect>,
    /// What is left of the outputs is coloured noise or missing dynamics; the standard errors allow for
    /// it.
    pub coloured_innovations: bool,
    /// What to keep in mind.
    pub warnings: Vec<String>,
}

/// What the data say of one input's effect on one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InputEffect {
    /// Name of the input or measured disturbance.
    pub input: String,
    /// Name of the output.
    pub output: String,
    /// Steady-state gain, in units of the output per unit of the input.
    pub gain: f64,
    /// Its standard error; infinite if the data say nothing.
    #[serde(deserialize_with = "null_as_infinity")]
    pub standard_error: f64,
    /// Frequency at which the response is known best, in Hz.
    pub best_frequency_hz: f64,
    /// Its standard error there, over its magnitude; infinite if it is known nowhere.
    #[serde(deserialize_with = "null_as_infinity")]
    pub best_relative_error: f64,
    /// Part of the output's variance that the input's simulated effect has, in the recording.
    pub share: f64,
    /// Whether D has an entry.
    pub feedthrough: bool,
    /// That entry when it is free.
    pub feedthrough_value: f64,
    /// Its t value then.
    pub feedthrough_t: f64,
    /// What this means.
    pub verdict: EffectVerdict,
}

/// How far an effect is identified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectVerdict {
    /// Steady-state gain and its sign are known.
    Identified,
    /// The steady-state gain may have either sign, but the response at some frequency is known: the
    /// recording is short against the slowest pole, or has a drift.
    SteadyStateNotIdentified,
    /// The response is not known at any frequency.
    NotIdentified,
    /// Held at zero by a setting.
    HeldAtZero,
}

/// JSON has no infinity; it is written as null.
fn null_as_infinity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let value = Option::deserialize(deserializer)?;
    Ok(value.unwrap_or(f64::INFINITY))
}

impl InputEffect {
    /// Standard error over the gain's magnitude; infinite for a gain of 0.
    #[must_use]
    pub fn relative_error(&self) -> f64 {
        self.standard_error / self.gain.abs()
    }
}

impl fmt::Display for InputEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            input,
            output,
            gain,
            standard_error,
            share,
            ..
        } = self;
        write!(
            f,
            "{input} → {output}: gain {gain:.4e} ± {standard_error:.1e}, {:.1} % of the output's variance",
            100.0 * share
        )?;
        match self.verdict {
            EffectVerdict::Identified => write!(f, "; identified")?,
            EffectVerdict::SteadyStateNotIdentified => write!(
                f,
                "; steady state not identified (standard error {:.0} % of the gain, {:.0} % allowed), \
                 but known to {:.0} % at {:.3} Hz",
                100.0 * self.relative_error(),
                100.0 * UNIDENTIFIED_RATIO,
                100.0 * self.best_relative_error,
                self.best_frequency_hz
            )?,
            EffectVerdict::NotIdentified => write!(
                f,
                "; NOT identified: the standard error is {:.0} % of the gain ({:.0} % allowed) and at \
                 best, at {:.3} Hz, {:.0} % of the response ({:.0} % allowed); even its sign may be chance",
                100.0 * self.relative_error(),
                100.0 * UNIDENTIFIED_RATIO,
                self.best_frequency_hz,
                100.0 * self.best_relative_error,
                100.0 * UNIDENTIFIED_RESPONSE_RATIO
            )?,
            EffectVerdict::HeldAtZero => write!(f, "; held at zero by `without_effect`")?,
        }
        if self.feedthrough {
            write!(
                f,
                "; acts within its own interval (t = {:.1})",
                self.feedthrough_t
            )?;
        }
        Ok(())
    }
}

impl IdentificationReport {
    /// Inputs with no identified effect on any output.
    #[must_use]
    pub fn unidentified_inputs(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for effect in &self.effects {
            let name = effect.input.as_str();
            let unknown = |e: &&InputEffect| e.verdict == EffectVerdict::NotIdentified;
            let of_input = || self.effects.iter().filter(|e| e.input == name);
            if !names.contains(&name) && of_input().all(|e| unknown(&e)) {
                names.push(name);
            }
        }
        names
    }
}

impl fmt::Display for IdentificationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "Model of order {} from {} samples in {} record{}",
            self.order,
            self.samples,
            self.records,
            if self.records == 1 { "" } else { "s" }
        )?;
        writeln!(
            f,
            "  subspace estimate: {}, horizon {}{}",
            self.weighting,
            self.horizon,
            match (self.refined, self.focus) {
                (false, _) => "; not refined",
                (true, FocusChoice::Prediction) => "; refined one step ahead (innovation form)",
                (true, _) => "; refined on the simulated output, K afterwards",
            }
        )?;
        match self.offsets {
            OffsetChoice::Found => {}
            OffsetChoice::Means => {
                writeln!(f, "  offsets: the channels' means, nothing else")?;
            }
            OffsetChoice::None => {
                writeln!(f, "  offsets: none, the model goes through the origin")?;
            }
        }
        let fits = |fits: &[f64]| -> String {
            let fits: Vec<_> = fits.iter().map(|fit| format!("{fit:.1} %")).collect();
            fits.join(", ")
        };
        writeln!(
            f,
            "  held-out fit (NRMSE): simulated {}; {} steps ahead {}",
            fits(&self.held_out_fit),
            self.steps_ahead,
            fits(&self.held_out_prediction_fit)
        )?;
        if self.trials.len() > 1 {
            writeln!(f, "Orders tried (held-out fit of the worst output):")?;
            for trial in &self.trials {
                writeln!(
                    f,
                    "  {}{:>3}: {:7.2} %  (squared error e^{:.3} held out; information criterion {:.3}, {:.0} effective samples; {}, horizon {})",
                    if trial.order == self.order { ">" } else { " " },
                    trial.order,
                    trial.held_out_fit,
                    trial.held_out_score,
                    trial.information_criterion(),
                    trial.effective_samples,
                    trial.weighting,
                    trial.horizon
                )?;
            }
        }
        writeln!(
            f,
            "Effects of the inputs (steady-state gain ± standard error{}):",
            if self.coloured_innovations {
                ", which allows for coloured residuals"
            } else {
                ""
            }
        )?;
        for effect in &self.effects {
            writeln!(f, "  {effect}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "Warning: {warning}")?;
        }
        Ok(())
    }
}
