//! From a recording and settings to a controller: the offline line of the data flow.

use std::sync::Arc;

use anyhow::{Context, Result};
use deepc_core::controller::{Controller, DeepcController, RecedingHorizonSettings};
use deepc_core::hankel::Horizons;
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, DeepcSettings, OutputBounds, ProgramOptions, Slack, StageSettings,
};
use deepc_core::solver::SolveBudget;
use sysid::lmpc::{self, LmpcSettings};
use sysid::{Identification, StateSpace};

use super::recorded::{PredictorOf, Recorded, Watch};
use crate::scenario::{
    ControllerSettings, DataSettings, InputBounds, ModelSettings, Prediction, Scenario,
};

/// A controller, and what it was made from beside the recording.
pub struct Built {
    /// The controller.
    pub controller: Box<dyn Controller>,
    /// The identification of its model, if it has one.
    pub identification: Option<Arc<Identification>>,
}

/// Builds the controller of `settings` from a recording.
///
/// # Errors
/// When the recording is too short or does not excite the plant; the message says what to record.
/// As [`Interrupted`](crate::interrupt::Interrupted) when the user stops an identification.
pub fn controller(
    scenario: &Scenario,
    settings: &ControllerSettings,
    recorded: &Recorded<'_>,
    watch: Watch<'_>,
) -> Result<Built> {
    Ok(match &settings.prediction {
        Prediction::Data(data) => Built {
            controller: deepc(scenario, settings, data, recorded)?,
            identification: None,
        },
        Prediction::Model(model) => {
            let identification =
                recorded.identification(settings.records, &model.identification, watch)?;
            Built {
                controller: linear_mpc(scenario, settings, model, &identification.model)?,
                identification: Some(identification),
            }
        }
    })
}

fn deepc(
    scenario: &Scenario,
    settings: &ControllerSettings,
    by_data: &DataSettings,
    recorded: &Recorded<'_>,
) -> Result<Box<dyn Controller>> {
    let (predictor, program) = deepc_problem(scenario, settings, by_data, recorded)?;
    let controller = DeepcController::condensed(&predictor, &program, receding(settings))?;
    Ok(Box::new(controller))
}

/// What a controller on data solves, whatever form it is solved in.
///
/// # Errors
/// As [`controller`].
pub(crate) fn deepc_problem(
    scenario: &Scenario,
    settings: &ControllerSettings,
    by_data: &DataSettings,
    recorded: &Recorded<'_>,
) -> Result<(Arc<Predictor>, DeepcSettings)> {
    let predictor = recorded.predictor(PredictorOf {
        records: settings.records,
        horizons: Horizons {
            past: settings.past_steps,
            future: settings.horizon_steps,
        },
        order_bound: by_data.order_bound,
        matrix: by_data.matrix,
    })?;
    let stage = stage(&scenario.bounds, settings);
    let program = DeepcSettings {
        input_bounds: stage.input_bounds,
        output_bounds: stage.output_bounds,
        options: stage.options,
        input_slack: Slack::Penalty(by_data.lambda_u),
        output_slack: Slack::Penalty(by_data.lambda_y),
        ..DeepcSettings::new(
            &stage.input_weights,
            &stage.output_weights,
            by_data.regularisation,
            Slack::Hard,
        )
    };
    Ok((predictor, program))
}

fn linear_mpc(
    scenario: &Scenario,
    settings: &ControllerSettings,
    by_model: &ModelSettings,
    model: &StateSpace,
) -> Result<Box<dyn Controller>> {
    let program = LmpcSettings {
        offset_handling: by_model.offset_handling,
        past_steps: Some(settings.past_steps),
        ..stage(&scenario.bounds, settings).into()
    };
    let horizon = settings.horizon_steps;
    let controller = lmpc::controller(model, &program, horizon, receding(settings))
        .context(
            "the model that the recording gives cannot be used for control (with \
             `identification.order` it is another one; `offset_handling = \"none\"` asks less of it)",
        )?;
    Ok(Box::new(controller))
}

fn receding(settings: &ControllerSettings) -> RecedingHorizonSettings {
    RecedingHorizonSettings {
        moves_per_solve: settings.moves_per_solve,
        // Simulated time waits for the solver. A limit in wall-clock time would let the load of
        // the machine decide the outcome.
        ..RecedingHorizonSettings::every_sample(SolveBudget::generous())
    }
}

/// What every method shares, in the order of the recording's columns: steering wheel, target speed;
/// LTR.
fn stage(bounds: &InputBounds, settings: &ControllerSettings) -> StageSettings {
    let between = |[lower, upper]: [f64; 2]| Bounds::between(lower, upper);
    let (limit, penalty) = (settings.ltr_limit, settings.ltr_penalty);
    StageSettings {
        input_weights: vec![
            settings.input_weights.steering_wheel_per_deg2,
            settings.input_weights.target_speed_per_kmh2,
        ],
        // The paper's Q = 0: LTR is bounded, not tracked.
        output_weights: vec![0.0],
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
