//! Refining a model that one has, for experts; [`crate::identify`] does it by itself.

use deepc_core::data::Dataset;
use deepc_core::faer::Mat;

use crate::error::SysidError;
use crate::identification::to_state_space;
use crate::input_fit::InputStructure;
use crate::prediction_error::{Ending, Focus, RefineSettings, refine};
use crate::state_space::{StateSpace, SystemMatrices};
use crate::working::{WorkingData, check_channels};

/// A refined model and how the refinement went.
#[derive(Debug, Clone)]
pub struct RefinedModel {
    /// The model, with the innovation covariance of the recording.
    pub model: StateSpace,
    /// x(0) of every record.
    pub initial_states: Vec<Vec<f64>>,
    /// Mean logarithm of the innovations' variance, of outputs over their scales: what was minimised.
    pub loss: f64,
    /// The same before the first step.
    pub loss_before: f64,
    /// Steps taken.
    pub iterations: usize,
    /// How it ended.
    pub ending: Ending,
    /// Whether there was nothing left to gain.
    pub converged: bool,
}

/// Refines a model by prediction errors on a recording: Levenberg-Marquardt on the innovation form.
///
/// A, B, C and the offsets of the outputs are free as `focus` says: a model whose offsets are to stay as they
/// are comes from [`identify_with`](crate::identify_with) with another
/// [`OffsetChoice`](crate::OffsetChoice). Columns of B or D that are zero stay
/// zero: an input without effect keeps having none, and feedthrough is not introduced.
///
/// ```
/// use deepc_core::data::Dataset;
/// use sysid::{Focus, RefineSettings, SubspaceSettings, refine_model, subspace_model};
///
/// let (mut state, mut noise, mut inputs, mut outputs) = (0.0, 0.3, Vec::new(), Vec::new());
/// for _ in 0..500 {
///     noise = (noise * 997.0_f64).fract();
///     let input = (noise * 89.0).fract() - 0.5;
///     inputs.push(input);
///     outputs.push(state + 0.1 * (noise * 71.0).fract());
///     state = 0.9 * state + input;
/// }
/// let mut data = Dataset::new(0.1, ["valve"], ["level"])?;
/// data.push_rows(&inputs, &outputs)?;
/// let start = subspace_model(&data, &SubspaceSettings::new(10, 1))?.model;
/// let refined = refine_model(&data, &start, Focus::Simulation, &RefineSettings::default())?;
/// assert!(refined.converged && refined.loss <= refined.loss_before);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The recording's channels or sample time are not the model's, the model or its predictor is not
/// stable, a setting is out of range, or a record is empty.
pub fn refine_model(
    data: &Dataset,
    model: &StateSpace,
    focus: Focus,
    settings: &RefineSettings,
) -> Result<RefinedModel, SysidError> {
    check_channels(model, data)?;
    if data.records().is_empty() {
        return Err(SysidError::Series {
            series: "the recording",
            rows: 0,
            columns: data.inputs() + data.disturbances() + data.outputs(),
            expected: "at least one record".into(),
        });
    }
    let inputs = [model.inputs(), model.disturbances()].concat();
    let scaled = WorkingData::with_channels(data, inputs, model.outputs().to_vec());
    let start = scaled.to_scaled(model);
    let free = |matrix: &Mat<f64>| -> Vec<bool> {
        let columns = matrix.col_iter();
        columns.map(|column| column.norm_max() > 0.0).collect()
    };
    let mut structure = InputStructure {
        dynamics: free(&start.b),
        feedthrough: free(&start.d),
    };
    structure.dynamics.push(false);
    structure.feedthrough.push(true);
    let with_zero = |matrix: &Mat<f64>| {
        Mat::from_fn(matrix.nrows(), matrix.ncols() + 1, |i, j| {
            if j < matrix.ncols() {
                matrix[(i, j)]
            } else {
                0.0
            }
        })
    };
    let start = SystemMatrices {
        b: with_zero(&start.b),
        d: with_zero(&start.d),
        ..start
    };
    let refined = refine(&scaled.with_constant(), &start, &structure, focus, settings)?;
    Ok(RefinedModel {
        model: to_state_space(&scaled, &refined.matrices, refined.covariance.as_ref())?,
        converged: refined.converged(),
        initial_states: refined.initial_states,
        loss: refined.loss,
        loss_before: refined.loss_before,
        iterations: refined.iterations,
        ending: refined.ending,
    })
}
