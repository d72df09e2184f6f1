//! The model-based road: a state-space model from a recording, and linear predictive control on it.
//!
//! ```text
//! Dataset ─→ identify ─→ StateSpace + report ─→ Validation, figures
//!                            └→ lmpc ─→ Controller (deepc_core's own, with a model in place of the data)
//! ```
//!
//! # The model
//! Discrete, in innovation form, with M = m + q inputs (m decided ones, then q measured
//! disturbances), p outputs and order n:
//!
//! ```text
//! x(k+1) = A x(k) + B u(k) + K e(k)        A n×n   B n×M   K n×p
//! y(k)   = C x(k) + D u(k) + e(k)          C p×n   D p×M
//! ```
//!
//! u and y are deviations from the model's offsets. One sample is the pair (u(k), y(k)) as in
//! [`deepc_core`]: u(k) is held over `[t_k, t_k + Ts)` and y(k) is measured at the end of that
//! interval, so that D is what an input does within its own interval.
//!
//! # What there is
//!
//! | wanted | use |
//! |---|---|
//! | the best model of a recording | [`identify`]; [`identify_with`] to fix or limit what it chooses |
//! | how far it can be trusted | [`IdentificationReport`]: effects with standard errors, held-out fits, warnings |
//! | one subspace estimate, everything chosen by hand; SLICOT's numbers | [`subspace_model`] |
//! | a model one has, refined on data | [`refine_model`] |
//! | simulate, predict, poles, zeros, responses, files, MATLAB | [`StateSpace`] |
//! | fit per step, residual tests, a verdict in words | [`Validation`] |
//! | pictures of all that | [`figures`] |
//! | predictive control | [`lmpc`] |
//!
//! ```
//! # let (mut state, mut noise, mut u, mut y) = (0.0, 0.3, Vec::new(), Vec::new());
//! # for _ in 0..300 {
//! #     noise = (noise * 997.0_f64).fract();
//! #     u.push((noise * 89.0).fract() - 0.5);
//! #     state = 0.9 * state + u[u.len() - 1];
//! #     y.push(20.0 + state + 0.01 * (noise * 71.0).fract());
//! # }
//! let mut data = deepc_core::data::Dataset::new(0.1, ["valve"], ["level"])?;
//! data.push_rows(&u, &y)?;
//! let found = sysid::identify(&data)?;
//! println!("{}", found.report);
//! let frequencies_hz = [0.1, 1.0];
//! for response in found.frequency_response(&frequencies_hz)? {
//!     println!("{} Hz: ± {:.1e}", response.frequency_hz, response.standard_error[(0, 0)]);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # When not to use it
//! A plant whose behaviour depends on where it is: one linear model cannot hold both. A recording made
//! in closed loop without a shaken reference. An unstable or integrating plant, unless a model that is
//! stable by force will do over the horizon: [`identify`] never returns an unstable one.

mod dense;
mod error;
pub mod figures;
mod identification;
mod input_fit;
mod kalman;
mod least_squares;
pub mod lmpc;
mod prediction_error;
mod refine;
mod regressors;
mod stability;
mod state_space;
mod subspace;
mod uncertainty;
mod validation;
mod working;

pub use error::SysidError;
pub use identification::{
    EffectVerdict, Feedthrough, FocusChoice, Identification, IdentificationReport,
    IdentificationSettings, InputEffect, OffsetChoice, OrderTrial, Progress, UNIDENTIFIED_RATIO,
    UNIDENTIFIED_RESPONSE_RATIO, UncertainResponse, identify, identify_with,
};
pub use kalman::GainFallback;
pub use prediction_error::{Ending, Focus, OutputWeights, RefineSettings};
pub use refine::{RefinedModel, refine_model};
pub use state_space::{Channel, InitialStateFor, Mode, StateSpace, SystemMatrices};
pub use subspace::{
    InputMatrices, Offsets, OutputScaling, SubspaceModel, SubspaceSettings, UnstablePoles,
    Weighting, subspace_model,
};
pub use validation::{
    Correlation, InputTest, OutputValidation, Portmanteau, ResidualTests, Score, Validation,
    ValidationSettings, Whiteness,
};
