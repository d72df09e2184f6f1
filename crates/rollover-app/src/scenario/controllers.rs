//! Settings of the controllers of a scenario.

use deepc_core::program::Regularisation;
use serde::Deserialize;
use sysid::IdentificationSettings;
use sysid::lmpc::OffsetHandling;

use crate::summary::InputWeights;

/// Settings of one controller: what every method shares, and how the future is predicted.
#[derive(Debug, Clone)]
pub struct ControllerSettings {
    /// What is special about it, in a sentence.
    pub description: String,
    /// Length of the past window `T_ini`, steps. With a model it is the window that its state is
    /// started from.
    pub past_steps: usize,
    /// Prediction horizon N, steps.
    pub horizon_steps: usize,
    /// Moves applied from each solve, steps.
    pub moves_per_solve: usize,
    /// Bound on |LTR| over the horizon.
    pub ltr_limit: f64,
    /// Price of exceeding it.
    pub ltr_penalty: LtrPenalty,
    /// Weights R on the inputs' distance from their references.
    pub input_weights: InputWeights,
    /// What it is told of the driver's steering over the horizon.
    pub reference: ReferenceAhead,
    /// How many records of the recording it works from, the first ones; all of them if `None`.
    pub records: Option<usize>,
    /// How it predicts.
    pub prediction: Prediction,
}

/// What a controller is told of the driver's steering over the horizon. The paper does not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReferenceAhead {
    /// His present wish, held: nothing else is known.
    #[default]
    Held,
    /// His present wish, changed as his steering changed ahead of here on an earlier, slower drive.
    Preview,
}

/// How a controller predicts, by the scenario file's `method`.
#[derive(Debug, Clone)]
pub enum Prediction {
    /// `deepc`, `rd-deepc`: by the recording itself.
    Data(DataSettings),
    /// `lmpc`: by a model identified from the recording.
    Model(ModelSettings),
}

/// Settings of `DeePC`.
#[derive(Debug, Clone)]
pub struct DataSettings {
    /// Which matrix it predicts with.
    pub matrix: DataMatrix,
    /// Upper bound on the plant's order n, for the excitation check of order L + n.
    pub order_bound: usize,
    /// Regularisation of g.
    pub regularisation: Regularisation,
    /// Weight `λ_u` on the slack of the past inputs, 1/deg² and 1/(km/h)².
    pub lambda_u: f64,
    /// Weight `λ_y` on the slack of the past outputs.
    pub lambda_y: f64,
}

/// The matrix that `DeePC` predicts with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataMatrix {
    /// The whole Hankel matrix (paper eq. 16).
    Whole,
    /// The matrix reduced to its numerical rank (paper eq. 19).
    Reduced,
}

/// Settings of the linear MPC on an identified model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSettings {
    /// How the model is identified; what is left out is found from the recording.
    pub identification: IdentificationSettings,
    /// What becomes of a lasting difference between the vehicle and the model.
    pub offset_handling: OffsetHandling,
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
