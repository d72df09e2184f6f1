//! One method on one set: model, fits, time.

use std::ops::ControlFlow;
use std::time::Instant;

use serde::Serialize;
use sysid::{
    IdentificationSettings, Offsets, StateSpace, SubspaceSettings, SysidError, UnstablePoles,
    Validation, ValidationSettings, Weighting, identify_with, subspace_model,
};

use crate::folder::Set;

/// Steps ahead of the prediction that is judged.
const STEPS_AHEAD: usize = 10;

/// Short runs are repeated and the shortest time counts, as for the other tools.
const REPEATS: usize = 5;

/// A run that takes longer is not repeated, in milliseconds.
const LONG_MS: f64 = 200.0;

/// How a model is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// [`sysid::identify`]: everything found from the data.
    Automatic,
    /// The same with the order that the other tools were given.
    AutomaticAtOrder,
    /// A subspace estimate with the block rows and the order that the other tools were given.
    Subspace(Weighting),
    /// SLICOT's combined method.
    SlicotParity,
}

pub const METHODS: [Method; 6] = [
    Method::Automatic,
    Method::AutomaticAtOrder,
    Method::Subspace(Weighting::Moesp),
    Method::Subspace(Weighting::N4sid),
    Method::Subspace(Weighting::Cva),
    Method::SlicotParity,
];

impl Method {
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::AutomaticAtOrder => "automatic, order given",
            Self::Subspace(Weighting::Moesp) => "moesp",
            Self::Subspace(Weighting::N4sid) => "n4sid",
            Self::Subspace(Weighting::Cva) => "cva",
            Self::SlicotParity => "slicot parity",
        }
    }
}

/// One row of identification.json. Fits are NRMSE in %, one entry per output.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub dataset: String,
    pub method: &'static str,
    pub order: Option<usize>,
    pub horizon: Option<usize>,
    /// Of the simulated output of the validation samples, from the initial state that suits it best.
    pub fit_sim_val: Option<Vec<f64>>,
    /// Of the prediction 10 steps ahead.
    pub fit_10step_val: Option<Vec<f64>>,
    /// Whether all poles are inside the unit circle.
    pub stable: Option<bool>,
    /// From the recording to the model.
    pub time_ms: Option<f64>,
    /// Why there is no model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

struct Found {
    model: StateSpace,
    horizon: usize,
}

pub fn measure(set: &Set, method: Method) -> Row {
    let mut row = Row {
        dataset: set.name.clone(),
        method: method.name(),
        order: None,
        horizon: None,
        fit_sim_val: None,
        fit_10step_val: None,
        stable: None,
        time_ms: None,
        error: None,
    };
    if let Err(error) = fill(&mut row, set, method) {
        row.error = Some(error.to_string());
    }
    row
}

fn fill(row: &mut Row, set: &Set, method: Method) -> Result<(), SysidError> {
    let mut shortest = f64::INFINITY;
    let mut found = None;
    for _ in 0..REPEATS {
        let start = Instant::now();
        found = Some(model(set, method)?);
        shortest = shortest.min(start.elapsed().as_secs_f64() * 1e3);
        if shortest > LONG_MS {
            break;
        }
    }
    let Some(Found { model, horizon }) = found else {
        return Ok(());
    };
    row.order = Some(model.order());
    row.horizon = Some(horizon);
    row.time_ms = Some(shortest);
    row.stable = Some(model.is_stable()?);
    let settings = ValidationSettings::for_horizon(STEPS_AHEAD);
    let validation = Validation::of(&model, &set.validation, &settings)?;
    let outputs = || validation.outputs.iter();
    let simulated = outputs().map(|output| output.simulation.as_ref()?.fit_percent);
    row.fit_sim_val = simulated.collect();
    let ahead = outputs().map(|output| output.prediction.last()?.fit_percent);
    row.fit_10step_val = ahead.collect();
    Ok(())
}

fn model(set: &Set, method: Method) -> Result<Found, SysidError> {
    let data = &set.identification;
    let automatic = |settings: &IdentificationSettings| {
        let found = identify_with(data, settings, &mut |_| ControlFlow::Continue(()))?;
        Ok(Found {
            horizon: found.report.horizon,
            model: found.model,
        })
    };
    let by_subspace = |settings: &SubspaceSettings| {
        Ok(Found {
            model: subspace_model(data, settings)?.model,
            horizon: set.block_rows,
        })
    };
    match method {
        Method::Automatic => automatic(&IdentificationSettings::default()),
        Method::AutomaticAtOrder => automatic(&IdentificationSettings::of_order(set.order)),
        Method::Subspace(weighting) => by_subspace(&SubspaceSettings {
            weighting,
            unstable_poles: UnstablePoles::Keep,
            ..SubspaceSettings::new(set.block_rows, set.order)
        }),
        Method::SlicotParity => by_subspace(&SubspaceSettings {
            unstable_poles: UnstablePoles::Keep,
            offsets: Offsets::Given {
                inputs: set.input_offsets.clone(),
                outputs: set.output_offsets.clone(),
            },
            ..SubspaceSettings::slicot(set.block_rows, set.order)
        }),
    }
}
