//! What the future costs and what bounds it, whatever predicts it.

use serde::{Deserialize, Serialize};

use super::error::SettingsError;
use super::options::{ProgramOptions, check_weight};
use super::settings::{Bounds, OutputBounds, check_bounds, check_penalty};

/// Weights, bounds and options of a predictive program with m inputs and p outputs: all that does
/// not depend on whether data or a model predict the outputs. One code makes costs and constraints of
/// them, so that controllers with equal `StageSettings` are asked the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageSettings {
    /// Diagonal of R, one weight per input (m), at least 0, per unit squared and step.
    pub input_weights: Vec<f64>,
    /// Diagonal of Q, one weight per output (p), at least 0, per unit squared and step.
    pub output_weights: Vec<f64>,
    /// Bounds of every input (m).
    pub input_bounds: Vec<Bounds>,
    /// Bounds of every output (p).
    pub output_bounds: Vec<OutputBounds>,
    /// Costs and constraints beyond these.
    #[serde(default)]
    pub options: ProgramOptions,
}

impl StageSettings {
    /// Weights without bounds and options, to be completed with
    /// `StageSettings { input_bounds: …, ..StageSettings::new(…) }`.
    #[must_use]
    pub fn new(input_weights: &[f64], output_weights: &[f64]) -> Self {
        Self {
            input_weights: input_weights.to_vec(),
            output_weights: output_weights.to_vec(),
            input_bounds: vec![Bounds::none(); input_weights.len()],
            output_bounds: vec![OutputBounds::none(); output_weights.len()],
            options: ProgramOptions::default(),
        }
    }

    /// Checks every field against its range, for m inputs, p outputs and a horizon of N steps.
    ///
    /// # Errors
    /// Names the first field that is out of range.
    pub fn check(
        &self,
        inputs: usize,
        outputs: usize,
        horizon: usize,
    ) -> Result<(), SettingsError> {
        for (field, expected, found) in [
            ("input_weights", inputs, self.input_weights.len()),
            ("output_weights", outputs, self.output_weights.len()),
            ("input_bounds", inputs, self.input_bounds.len()),
            ("output_bounds", outputs, self.output_bounds.len()),
        ] {
            if expected != found {
                return Err(SettingsError::Length {
                    field,
                    expected,
                    found,
                });
            }
        }
        for (field, weights) in [
            ("input_weights", &self.input_weights),
            ("output_weights", &self.output_weights),
        ] {
            for (index, &found) in weights.iter().enumerate() {
                check_weight(field, index, found)?;
            }
        }
        for (index, bounds) in self.input_bounds.iter().enumerate() {
            check_bounds("input_bounds", index, bounds)?;
        }
        for (index, output) in self.output_bounds.iter().enumerate() {
            check_bounds("output_bounds", index, &output.bounds)?;
            check_penalty("output_bounds.softness", index, output.softness)?;
        }
        self.options.check(inputs, outputs, horizon)
    }
}
