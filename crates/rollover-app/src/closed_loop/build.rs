//! From a recording and settings to a controller: the offline line of the data flow.

use anyhow::{Context, Result, bail};
use deepc_core::controller::{Controller, DeepcController, RecedingHorizonSettings};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, OutputBounds, PredictiveProgram, ProgramOptions, Slack,
};
use deepc_core::solver::{ActiveSet, ActiveSetSettings, SolveBudget};

use crate::scenario::{ControllerSettings, InputBounds, Method, Scenario};

/// Builds the controller of `settings` from the recording `data`.
///
/// # Errors
/// When the recording is too short or does not excite the plant; the message says what to record.
pub fn controller(
    scenario: &Scenario,
    settings: &ControllerSettings,
    data: &Dataset,
) -> Result<Box<dyn Controller>> {
    let horizons = Horizons {
        past: settings.past_steps,
        future: settings.horizon_steps,
    };
    let hankel = HankelMatrix::build(data, horizons).context("the recording cannot be used")?;
    let exciting = hankel
        .require_persistently_exciting(settings.order_bound)
        .context("the recording cannot be used")?;
    if let Some((name, value)) = exciting.report().and_then(|r| r.constant_outputs.first()) {
        bail!(
            "the recording cannot be used: output `{name}` is constant at {value}, so nothing can \
             be learnt about it; check its sensor and record again"
        );
    }
    let predictor = match settings.method {
        Method::Deepc => Predictor::full(&exciting),
        Method::RdDeepc => Predictor::exact(&exciting)?,
    };
    let program = CondensedProgram::new(&predictor, &deepc_settings(&scenario.bounds, settings))?;
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default())?;
    let receding = RecedingHorizonSettings {
        moves_per_solve: settings.moves_per_solve,
        // Simulated time waits for the solver. A limit in wall-clock time would let the load of
        // the machine decide the outcome.
        ..RecedingHorizonSettings::every_sample(SolveBudget::generous())
    };
    Ok(Box::new(DeepcController::new(
        Box::new(program),
        Box::new(solver),
        receding,
    )?))
}

/// The settings in the order of the recording's columns: steering wheel, target speed; LTR.
fn deepc_settings(bounds: &InputBounds, settings: &ControllerSettings) -> DeepcSettings {
    let between = |[lower, upper]: [f64; 2]| Bounds::between(lower, upper);
    let (limit, penalty) = (settings.ltr_limit, settings.ltr_penalty);
    DeepcSettings {
        input_weights: vec![
            settings.input_weights.steering_wheel_per_deg2,
            settings.input_weights.target_speed_per_kmh2,
        ],
        // The paper's Q = 0: LTR is bounded, not tracked.
        output_weights: vec![0.0],
        regularisation: settings.regularisation,
        input_slack: Slack::Penalty(settings.lambda_u),
        output_slack: Slack::Penalty(settings.lambda_y),
        input_bounds: vec![
            between(bounds.steering_wheel_deg),
            between(bounds.target_speed_kmh),
        ],
        output_bounds: vec![OutputBounds::soft(
            -limit,
            limit,
            penalty.linear,
            penalty.quadratic,
        )],
        options: ProgramOptions::default(),
    }
}
