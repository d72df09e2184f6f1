//! Figures of models, of their validation and of how they were chosen, as SVG text.
//!
//! Every function takes plain data and returns a whole SVG document. Names may be any text; what
//! does not fit is shortened. Values must be finite.

mod axis;
mod chart;
mod choice;
mod frequency;
mod layers;
mod plane;
mod residuals;
mod time;

pub use choice::{OrderCurve, SingularValues, order_curve, singular_values};
pub use frequency::{FrequencyCurve, FrequencyFigure, frequency_response};
pub use plane::{PoleZeroMap, pole_zero_map};
pub use residuals::residual_correlations;
pub use time::{
    HorizonFit, OutputCurve, OutputFigure, StepCurve, StepFigure, fit_over_horizon,
    measured_and_computed, step_responses,
};
