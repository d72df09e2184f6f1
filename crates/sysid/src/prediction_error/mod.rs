//! Refinement by prediction errors: Levenberg-Marquardt on the innovation form.
//!
//! All matrices are free (no canonical form, which would be ill conditioned), and every step is
//! orthogonal to the directions in which only the state basis changes: data-driven local
//! coordinates (McKelvey, Helmersson and Ribarits 2004). Initial states are not parameters of the
//! step: they are fitted exactly at every point, since the innovations are linear in them.

mod balance;
mod jacobian;
mod levenberg;
mod limits;
mod multi_step;
mod parameters;
mod predictor;
#[cfg(test)]
pub(crate) mod tests;

use deepc_core::faer::Mat;
use serde::{Deserialize, Serialize};

pub(crate) use balance::Basis;
pub(crate) use jacobian::linearise;
pub(crate) use multi_step::{errors_ahead, refine_gain};
pub(crate) use parameters::{Entry, Layout};
pub(crate) use predictor::Evaluation;

use crate::error::SysidError;
use crate::input_fit::InputStructure;
use crate::regressors::Packed;
use crate::stability::spectral_radius;
use crate::state_space::SystemMatrices;
use crate::working::WorkingData;

/// What a refinement minimises, and over which matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Focus {
    /// The simulation error, over A, B, C and D; K = 0 (output error).
    Simulation,
    /// The one-step prediction error, over A, B, C, D and K.
    Prediction,
    /// The one-step prediction error, over K alone.
    Gain,
}

/// How the errors of several outputs are weighed against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputWeights {
    /// By the inverse of their covariance, found along the way: the criterion is the determinant of
    /// the covariance, which maximum likelihood minimises (Ljung 1999, chapter 7).
    Covariance,
    /// All outputs alike, each over its standard deviation in the recording: the criterion is the
    /// sum of the variances.
    Equal,
}

/// When a refinement ends and how far poles may go.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RefineSettings {
    /// Steps at most; 0 evaluates only.
    pub iterations: usize,
    /// Ends when a step gains, or can be expected to gain, less than this fraction of the
    /// innovations' variance; above 0.
    pub tolerance: f64,
    /// Poles of A and of A − KC stay within this radius, above 0 and below 1. (Within that of the
    /// model to start from, if that is larger.)
    pub radius: f64,
    /// Weights of the outputs.
    pub weighting: OutputWeights,
}

impl Default for RefineSettings {
    fn default() -> Self {
        Self {
            iterations: 60,
            tolerance: 1e-6,
            radius: 0.99999,
            weighting: OutputWeights::Covariance,
        }
    }
}

impl RefineSettings {
    /// Whether every field is in range.
    ///
    /// # Errors
    /// The first field that is not, with what is allowed.
    pub fn check(&self) -> Result<(), SysidError> {
        let setting = |field, found: f64, allowed: &str| SysidError::Setting {
            field,
            found: found.to_string(),
            allowed: allowed.into(),
        };
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            let allowed = "give a value above 0 and below 1";
            return Err(setting("tolerance", self.tolerance, allowed));
        }
        if !(self.radius > 0.0 && self.radius < 1.0) {
            let allowed = "give a value above 0 and below 1";
            return Err(setting("radius", self.radius, allowed));
        }
        Ok(())
    }
}

/// How a refinement ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The next step promises less than the tolerance.
    Optimal,
    /// Several steps gained less than the tolerance although more was promised: a flat valley, as
    /// that of a model whose order is too high.
    Flat,
    /// The innovations are rounding.
    Exact,
    /// No step, however short, gains anything: the limit of rounding, or of stability.
    Stuck,
    /// The steps allowed were not enough.
    Iterations,
}

/// A refined model.
#[derive(Debug, Clone)]
pub(crate) struct Refined {
    /// In the state basis of the model to start from.
    pub matrices: SystemMatrices,
    /// x(0) of every record.
    pub initial_states: Vec<Vec<f64>>,
    /// Mean of e eᵀ over all samples, p×p.
    pub covariance: Mat<f64>,
    /// Mean over outputs of the logarithm of the innovations' variance (of the whitened ones, for
    /// weights by covariance): what was minimised.
    pub loss: f64,
    /// The same before the first step.
    pub loss_before: f64,
    /// Steps taken.
    pub iterations: usize,
    /// How it ended.
    pub ending: Ending,
}

impl Refined {
    /// Whether it ended because there was nothing left to gain.
    pub fn converged(&self) -> bool {
        matches!(self.ending, Ending::Optimal | Ending::Flat | Ending::Exact)
    }
}

/// Refines `start` on `data`. Columns of B and D that `structure` does not allow are set to zero.
///
/// # Errors
/// A setting is out of range, a shape does not fit, or A or A − KC of the start is not stable.
pub(crate) fn refine(
    data: &WorkingData,
    start: &SystemMatrices,
    structure: &InputStructure,
    focus: Focus,
    settings: &RefineSettings,
) -> Result<Refined, SysidError> {
    settings.check()?;
    let (packed, model, layout) = prepared(data, start, structure, focus)?;
    let found = levenberg::descend(&packed, &model, &layout, settings)?;
    let reduced = found.model;
    let mut matrices = reduced.clone();
    if focus == Focus::Gain {
        // To the bit, which a change of basis and back would not give.
        matrices = SystemMatrices {
            k: matrices.k,
            ..start.clone()
        };
    }
    matrices.b = Mat::zeros(layout.n, structure.dynamics.len());
    matrices.d = Mat::zeros(layout.p, structure.dynamics.len());
    for (position, j) in structure.active().into_iter().enumerate() {
        let (b, d) = match focus {
            Focus::Gain => (start.b.col(j), model.d.col(position)),
            _ => (reduced.b.col(position), reduced.d.col(position)),
        };
        matrices.b.col_mut(j).copy_from(b);
        matrices.d.col_mut(j).copy_from(d);
    }
    Ok(Refined {
        matrices,
        initial_states: found.initial_states,
        covariance: found.covariance,
        loss: found.loss,
        loss_before: found.loss_before,
        iterations: found.iterations,
        ending: found.ending,
    })
}

/// The data and the model with active inputs only, and what is free; checked.
pub(crate) fn prepared(
    data: &WorkingData,
    start: &SystemMatrices,
    structure: &InputStructure,
    focus: Focus,
) -> Result<(Packed, SystemMatrices, Layout), SysidError> {
    let (n, m, p) = (start.order(), data.inputs.len(), data.outputs.len());
    for (matrix, found, rows, columns) in [
        ("A", start.a.shape(), n, n),
        ("B", start.b.shape(), n, m),
        ("C", start.c.shape(), p, n),
        ("D", start.d.shape(), p, m),
        ("K", start.k.shape(), n, p),
    ] {
        if found != (rows, columns) {
            return Err(SysidError::MatrixShape {
                matrix,
                rows: found.0,
                columns: found.1,
                expected_rows: rows,
                expected_columns: columns,
            });
        }
    }
    let (active, feedthrough) = (structure.active(), structure.feedthrough());
    let mut model = start.clone();
    let dynamic = structure.dynamic();
    model.b = Mat::from_fn(n, active.len(), |i, j| {
        if j < dynamic {
            start.b[(i, active[j])]
        } else {
            0.0
        }
    });
    model.d = Mat::zeros(p, active.len());
    for &position in &feedthrough {
        let column = start.d.col(active[position]);
        model.d.col_mut(position).copy_from(column);
    }
    if focus == Focus::Simulation {
        model.k.fill(0.0);
    }
    for (what, radius, remedy) in [
        (
            "A of the model to refine",
            spectral_radius(model.a.as_ref()),
            "stabilise it and fit B and D again",
        ),
        (
            "A − KC of the model to refine",
            predictor_radius(&model),
            "take K from a Riccati equation",
        ),
    ] {
        if radius.is_nan() || radius >= 1.0 {
            return Err(SysidError::Unstable {
                what,
                radius,
                limit: 1.0,
                remedy,
            });
        }
    }
    let layout = Layout::new(n, p, structure, focus);
    Ok((Packed::new(data, &active), model, layout))
}

/// Spectral radius of A − KC.
fn predictor_radius(model: &SystemMatrices) -> f64 {
    spectral_radius(model.predictor().as_ref())
}
