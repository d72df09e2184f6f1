//! Settings of the controllers of a scenario.

use deepc_core::program::Regularisation;
use serde::Deserialize;

use crate::summary::InputWeights;

/// Settings of one controller.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerSettings {
    /// What is special about it, in a sentence.
    pub description: String,
    /// How it predicts.
    pub method: Method,
    /// Length of the past window `T_ini`, steps.
    pub past_steps: usize,
    /// Prediction horizon N, steps.
    pub horizon_steps: usize,
    /// Upper bound on the plant's order n, for the excitation check of order L + n.
    pub order_bound: usize,
    /// Moves applied from each solve, steps.
    pub moves_per_solve: usize,
    /// Bound on |LTR| over the horizon.
    pub ltr_limit: f64,
    /// Price of exceeding it.
    pub ltr_penalty: LtrPenalty,
    /// Weights R on the inputs' distance from their references.
    pub input_weights: InputWeights,
    /// Regularisation of g.
    pub regularisation: Regularisation,
    /// Weight `λ_u` on the slack of the past inputs, 1/deg² and 1/(km/h)².
    pub lambda_u: f64,
    /// Weight `λ_y` on the slack of the past outputs.
    pub lambda_y: f64,
}

/// How a controller predicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// `DeePC` on the whole Hankel matrix (paper eq. 16).
    Deepc,
    /// `DeePC` on the matrix reduced to its numerical rank (paper eq. 19).
    RdDeepc,
}

/// Price of exceeding the bound on |LTR| by s: linear·s + ½·quadratic·s² in every step.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LtrPenalty {
    /// Price of the first bit of violation; large enough, the bound is met wherever it can be.
    pub linear: f64,
    /// Growth of the price, which shares a violation among the steps.
    pub quadratic: f64,
}
