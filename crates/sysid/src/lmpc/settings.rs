//! Settings of the model-based controller.

use deepc_core::program::{Bounds, DeepcSettings, OutputBounds, ProgramOptions, StageSettings};
use serde::{Deserialize, Serialize};

use crate::error::SysidError;

/// Settings of a linear MPC with m inputs and p outputs: the costs and bounds of
/// [`DeepcSettings`], and what the model needs instead of a regularisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LmpcSettings {
    /// Diagonal of R, one weight per input (m), at least 0, per unit squared and step.
    pub input_weights: Vec<f64>,
    /// Diagonal of Q, one weight per output (p), at least 0, per unit squared and step.
    pub output_weights: Vec<f64>,
    /// Bounds of every input (m).
    pub input_bounds: Vec<Bounds>,
    /// Bounds of every output (p).
    pub output_bounds: Vec<OutputBounds>,
    /// Costs and constraints beyond these; its slack of measured disturbances has no meaning here.
    #[serde(default)]
    pub options: ProgramOptions,
    /// How the controller deals with what the model does not explain in steady state.
    #[serde(default)]
    pub offset_handling: OffsetHandling,
    /// Samples of the window from which the state is estimated at the start and after a fault that
    /// could not be repaired, at least 1; the controller plans from then on, and all later samples go
    /// through the observer. Absent: three times the model's order, at least 1. For a comparison with
    /// `DeePC`, give its `T_ini`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub past_steps: Option<usize>,
}

/// What becomes of a lasting difference between the plant and the model's predictions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum OffsetHandling {
    /// Nothing: the innovation gain K of the model alone corrects the state.
    None,
    /// An output disturbance d that drifts, d(k+1) = d(k) + w(k), y = Cx + Du + d + e, is estimated
    /// with the state (Pannocchia and Rawlings 2003). With no weight on the inputs themselves
    /// (`input_weights` 0, weights on their changes) outputs then reach their references without
    /// error, where bounds allow it.
    OutputDisturbance {
        /// Standard deviation of w over that of the innovation e, above 0 and at most 1: roughly the
        /// share of an innovation that is taken for a lasting offset.
        drift: f64,
    },
}

impl Default for OffsetHandling {
    /// An output disturbance with a drift of 0.05, which follows an offset within about 20 samples.
    fn default() -> Self {
        Self::OutputDisturbance { drift: 0.05 }
    }
}

impl LmpcSettings {
    /// Weights and nothing else: no bounds, no options, the default offset handling.
    #[must_use]
    pub fn new(input_weights: &[f64], output_weights: &[f64]) -> Self {
        StageSettings::new(input_weights, output_weights).into()
    }

    /// The part that `DeePC` has as well.
    #[must_use]
    pub fn stage(&self) -> StageSettings {
        StageSettings {
            input_weights: self.input_weights.clone(),
            output_weights: self.output_weights.clone(),
            input_bounds: self.input_bounds.clone(),
            output_bounds: self.output_bounds.clone(),
            options: self.options.clone(),
        }
    }

    /// Checks every field against its range, for m inputs, p outputs and a horizon of N steps.
    ///
    /// # Errors
    /// Names the first field that is out of range.
    pub fn check(&self, inputs: usize, outputs: usize, horizon: usize) -> Result<(), SysidError> {
        let stage = self.stage().check(inputs, outputs, horizon);
        stage.map_err(deepc_core::program::ProgramError::from)?;
        if let OffsetHandling::OutputDisturbance { drift } = self.offset_handling
            && !(drift > 0.0 && drift <= 1.0)
        {
            return Err(SysidError::Setting {
                field: "offset_handling.output_disturbance.drift",
                found: drift.to_string(),
                allowed: "give a value above 0 and at most 1".into(),
            });
        }
        if self.past_steps == Some(0) {
            return Err(SysidError::Setting {
                field: "past_steps",
                found: "0".into(),
                allowed: "give at least 1 sample, or leave it out".into(),
            });
        }
        Ok(())
    }
}

impl From<StageSettings> for LmpcSettings {
    /// With the default offset handling.
    fn from(stage: StageSettings) -> Self {
        Self {
            input_weights: stage.input_weights,
            output_weights: stage.output_weights,
            input_bounds: stage.input_bounds,
            output_bounds: stage.output_bounds,
            options: stage.options,
            offset_handling: OffsetHandling::default(),
            past_steps: None,
        }
    }
}

impl From<&DeepcSettings> for LmpcSettings {
    /// The very costs and bounds of a `DeePC` controller, with the default offset handling.
    fn from(settings: &DeepcSettings) -> Self {
        settings.stage().into()
    }
}
