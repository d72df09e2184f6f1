//! Linear model predictive control on an identified model.
//!
//! Every sample it solves the problem of `DeePC` with the model in place of the data,
//!
//! ```text
//! min  ‖u − u_r‖²_R + ‖y − y_r‖²_Q + what the options add
//! s.t. x(k+1) = A x(k) + B u(k),  y(k) = C x(k) + D u(k) + d,  k = 0 … N − 1
//!      x(0), d from the observer; constraints on u and y as for DeePC
//! ```
//!
//! condensed to the inputs: [`deepc_core`]'s program, solvers and controller, of which only the
//! prediction is exchanged. x and d come from the model's Kalman predictor, which has seen every
//! sample since the controller started planning: not from a window, so that the baseline uses all
//! of the past.
//!
//! ```
//! # use deepc_core::{controller::*, faer::mat, program::*, solver::SolveBudget};
//! # use sysid::{Channel, StateSpace, SystemMatrices, lmpc::{self, LmpcSettings}};
//! let matrices = SystemMatrices {
//!     a: mat![[0.9, 0.1], [-0.1, 0.8]],
//!     b: mat![[0.0], [1.0]],
//!     c: mat![[1.0, 0.0]],
//!     d: mat![[0.0]],
//!     k: mat![[0.3], [0.1]],
//! };
//! let (input, output) = (vec![Channel::new("valve")], vec![Channel::new("level")]);
//! let model = StateSpace::new(0.1, input, vec![], output, matrices)?;
//! let settings = LmpcSettings {
//!     input_bounds: vec![Bounds::between(-1.0, 1.0)],
//!     ..LmpcSettings::new(&[0.1], &[1.0])
//! };
//! let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
//! let mut controller = lmpc::controller(&model, &settings, 20, horizon)?;
//! let mut reference = controller.new_reference();
//! reference.hold(&[0.0], &[1.0])?;
//! for _ in 0..6 {
//!     controller.observe(&[0.0], &[0.0]);
//! }
//! assert!(controller.decide(&reference).input[0] > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod design;
mod observer;
mod prediction;
mod settings;

use deepc_core::controller::{
    ControllerError, Planner, RecedingHorizonController, RecedingHorizonSettings,
};
use deepc_core::hankel::Horizons;
use deepc_core::program::{CondensedProgram, PredictionModel, PredictiveProgram, ProgramError};
use deepc_core::solver::{ActiveSet, ActiveSetSettings};

use crate::error::SysidError;
use crate::state_space::{Channel, StateSpace};
use design::Design;
use observer::Observer;
use prediction::PredictionMatrices;
pub use settings::{LmpcSettings, OffsetHandling};

/// The controller that [`controller`] makes: `DeePC`'s own, with a program on a model.
pub type LmpcController = RecedingHorizonController;

/// The condensed program of a model over `horizon` = N steps, for any solver: mN variables.
///
/// # Errors
/// A setting is out of range; A − KC is not stable; the model grows too much over the horizon; an
/// output disturbance is not detectable; the cost does not determine the plan.
pub fn program(
    model: &StateSpace,
    settings: &LmpcSettings,
    horizon: usize,
) -> Result<CondensedProgram, SysidError> {
    let (inputs, outputs) = (model.inputs().len(), model.outputs().len());
    settings.check(inputs, outputs, horizon)?;
    let past = settings.past_steps.unwrap_or(3 * model.order()).max(1);
    let horizons = Horizons::new(past, horizon);
    let handling = settings.offset_handling;
    let with_disturbance = handling != OffsetHandling::None;
    let matrices = PredictionMatrices::new(model, horizons, with_disturbance)?;
    let design = Design::new(model, handling, past)?;
    let scales = |channels: &[Channel]| channels.iter().map(|channel| channel.scale).collect();
    let prediction = PredictionModel {
        shape: prediction::shape(model, horizons),
        sample_time_s: model.sample_time_s(),
        known: matrices.known,
        free: matrices.free,
        input_scales: scales(model.inputs()),
        output_scales: scales(model.outputs()),
        estimator: Box::new(Observer::new(model, &design, horizon)),
    };
    Ok(CondensedProgram::from_model(prediction, &settings.stage())?)
}

/// [`program`] with the back end for the control loop, [`ActiveSet`]: to be switched to in a running
/// controller, or scheduled.
///
/// # Errors
/// As [`program`].
pub fn planner(
    model: &StateSpace,
    settings: &LmpcSettings,
    horizon: usize,
) -> Result<Planner, SysidError> {
    let program = program(model, settings, horizon)?;
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default());
    let solver = solver.map_err(|error| ControllerError::from(ProgramError::from(error)))?;
    Ok(Planner::new(Box::new(program), Box::new(solver))?)
}

/// The controller for the control loop: [`planner`] in a receding horizon over N = `horizon` steps.
///
/// # Errors
/// As [`program`], or a setting of the receding horizon is out of range.
pub fn controller(
    model: &StateSpace,
    settings: &LmpcSettings,
    horizon: usize,
    receding: RecedingHorizonSettings,
) -> Result<LmpcController, SysidError> {
    let planner = planner(model, settings, horizon)?;
    Ok(RecedingHorizonController::with_planner(planner, receding)?)
}
