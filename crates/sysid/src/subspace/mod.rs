//! Subspace identification: the triangular factor of past and future, its weighted projection,
//! and the state equations.

mod factor;
mod projection;
mod settings;
mod state_equations;

use deepc_core::data::Dataset;
use deepc_core::hankel::{FactorReport, OnesRow};

use deepc_core::faer::Mat;
pub(crate) use factor::Factor;
use projection::Dynamics;
pub(crate) use projection::Projection;
pub use projection::Weighting;
pub use settings::{InputMatrices, Offsets, OutputScaling, SubspaceSettings, UnstablePoles};
pub(crate) use state_equations::{StateEquations, output_constant};

use crate::error::SysidError;
use crate::input_fit::{InputFit, InputStructure, fit_inputs};
use crate::kalman::{GainFallback, innovation_gain};
use crate::stability::{spectral_radius, stabilise};
use crate::state_space::{StateSpace, SystemMatrices};
use crate::working::WorkingData;

/// A model with what its identification found on the way.
#[derive(Debug, Clone)]
pub struct SubspaceModel {
    /// The model.
    pub model: StateSpace,
    /// Singular values of the weighted projection in falling order. A gap after the n-th speaks
    /// for order n.
    pub singular_values: Vec<f64>,
    /// Largest order that horizon and data allow.
    pub largest_order: usize,
    /// How the triangular factor was computed.
    pub factor: FactorReport,
    /// Spectral radius of A: below 1 unless [`UnstablePoles::Keep`] was asked for.
    pub radius: f64,
    /// Spectral radius before poles were moved inside, if they were.
    pub moved_from: Option<f64>,
    /// Spectral radius of A − KC, below 1.
    pub predictor_radius: f64,
    /// Mean squared error of the simulation that B and D were fitted to, over all samples and outputs,
    /// these over their scales; `None` where B and D came from the state equations.
    pub simulation_error: Option<f64>,
    /// Set if K is not the Kalman gain of the estimated noise.
    pub gain_fallback: Option<GainFallback>,
}

/// Identifies a model with every choice made by the caller.
///
/// For experts and for comparison with other tools: the order and the horizons are taken as given, and
/// nothing is validated. An unstable model is an error unless the settings say otherwise.
///
/// ```
/// use deepc_core::data::Dataset;
/// use sysid::{SubspaceSettings, subspace_model};
///
/// let mut data = Dataset::new(0.1, ["valve"], ["level"])?;
/// let (mut state, mut noise, mut inputs, mut outputs) = (0.0, 0.3, Vec::new(), Vec::new());
/// for _ in 0..500 {
///     noise = (noise * 997.0_f64).fract();
///     let input = (noise * 89.0).fract() - 0.5;
///     inputs.push(input);
///     outputs.push(state + 0.01 * (noise * 71.0).fract());
///     state = 0.9 * state + input;
/// }
/// data.push_rows(&inputs, &outputs)?;
/// let found = subspace_model(&data, &SubspaceSettings::slicot(10, 1))?;
/// assert!((found.radius - 0.9).abs() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Too short a recording, inputs that do not excite, a constant channel, an order that horizon or
/// data do not allow, a setting out of range; an unstable A that C does not see.
pub fn subspace_model(
    data: &Dataset,
    settings: &SubspaceSettings,
) -> Result<SubspaceModel, SysidError> {
    let mut working = prepare(data, settings)?;
    let ones = match settings.offsets {
        Offsets::Free => OnesRow::OnTop,
        Offsets::Means | Offsets::Given { .. } => OnesRow::Without,
    };
    let factor = Factor::new(
        &working,
        settings.past,
        settings.future,
        ones,
        settings.factor,
    )?;
    let projection = factor.project(settings.weighting)?;
    let mut dynamics = projection.dynamics(settings.order)?;
    let moved_from = judge_poles(&mut dynamics, settings.unstable_poles)?;
    let equations = StateEquations::new(&factor, &dynamics)?;
    let (b, d, simulation_error) = match settings.input_matrices {
        InputMatrices::Subspace => {
            let (b, d) = equations.input_matrices()?;
            (b, d, None)
        }
        InputMatrices::Simulation => {
            let fit = simulated(&working, &dynamics, ones)?;
            (fit.b, fit.d, Some(fit.loss))
        }
    };
    let noise = equations.noise_covariances()?;
    let gain = innovation_gain(
        dynamics.a.as_ref(),
        dynamics.c.as_ref(),
        noise.q.as_ref(),
        noise.r.as_ref(),
        noise.s.as_ref(),
    )?;
    let radius = spectral_radius(dynamics.a.as_ref());
    let matrices = SystemMatrices {
        a: dynamics.a,
        b,
        c: dynamics.c,
        d,
        k: gain.k,
    };
    // The free response of an unstable model says nothing about a constant.
    if ones == OnesRow::OnTop && radius < 1.0 {
        let constant = output_constant(&working, &matrices)?;
        for (channel, constant) in working.outputs.iter_mut().zip(constant) {
            channel.offset += constant * channel.scale;
        }
    }
    Ok(SubspaceModel {
        model: working.to_state_space(&matrices, gain.covariance.as_ref())?,
        largest_order: projection.largest_order(),
        singular_values: projection.singular_values,
        factor: factor.report().clone(),
        radius,
        moved_from,
        predictor_radius: gain.radius,
        simulation_error,
        gain_fallback: gain.fallback,
    })
}

/// Refuses or moves poles outside the unit circle; the spectral radius before, if they were moved.
fn judge_poles(
    dynamics: &mut Dynamics,
    unstable: UnstablePoles,
) -> Result<Option<f64>, SysidError> {
    match unstable {
        UnstablePoles::Keep => Ok(None),
        UnstablePoles::Refuse => {
            let radius = spectral_radius(dynamics.a.as_ref());
            if radius < 1.0 {
                return Ok(None);
            }
            Err(SysidError::Unstable {
                what: "A of the subspace estimate",
                radius,
                limit: 1.0,
                remedy: "take another horizon or order, use `identify`, or set `unstable_poles`",
            })
        }
        UnstablePoles::MoveInside { radius } => {
            let stable = stabilise(dynamics.a.as_ref(), radius)?;
            dynamics.a = stable.a;
            Ok(stable.changed.then_some(stable.radius_before))
        }
    }
}

/// B and D from the simulated output; with free offsets, next to a constant.
fn simulated(
    working: &WorkingData,
    dynamics: &Dynamics,
    ones: OnesRow,
) -> Result<InputFit, SysidError> {
    let m = working.inputs.len();
    let mut structure = InputStructure {
        dynamics: vec![true; m],
        feedthrough: vec![true; m],
    };
    let (a, c) = (dynamics.a.as_ref(), dynamics.c.as_ref());
    let mut fit = if ones == OnesRow::OnTop {
        structure.dynamics.push(false);
        structure.feedthrough.push(true);
        fit_inputs(&working.with_constant(), a, c, &structure)?
    } else {
        fit_inputs(working, a, c, &structure)?
    };
    let of_inputs = |matrix: &Mat<f64>| matrix.subcols(0, m).to_owned();
    (fit.b, fit.d) = (of_inputs(&fit.b), of_inputs(&fit.d));
    Ok(fit)
}

/// Scaled deviations from the offsets that the settings ask for.
fn prepare(data: &Dataset, settings: &SubspaceSettings) -> Result<WorkingData, SysidError> {
    let working = WorkingData::new(data)?;
    let (mut inputs, mut outputs) = (working.inputs, working.outputs);
    settings.check(inputs.len(), outputs.len())?;
    if let Offsets::Given {
        inputs: u,
        outputs: y,
    } = &settings.offsets
    {
        let channels = inputs.iter_mut().chain(&mut outputs);
        for (channel, &offset) in channels.zip(u.iter().chain(y)) {
            channel.offset = offset;
        }
    }
    if settings.output_scaling == OutputScaling::Common {
        let largest = outputs.iter().map(|y| y.scale).fold(0.0, f64::max);
        for output in &mut outputs {
            output.scale = largest;
        }
    }
    Ok(WorkingData::with_channels(data, inputs, outputs))
}
