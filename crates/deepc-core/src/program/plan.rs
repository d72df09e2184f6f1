//! What a program is asked, and what it answers.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use crate::hankel::Shape;
use crate::solver::QpStatus;

/// What is known and wanted at one sample instant. Rows are time, columns channels.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    /// Past inputs `u_ini`, `T_ini`×m, oldest first.
    pub past_inputs: MatRef<'a, f64>,
    /// Past outputs `y_ini`, `T_ini`×p, oldest first.
    pub past_outputs: MatRef<'a, f64>,
    /// Input reference `u_r`, N×m.
    pub input_reference: MatRef<'a, f64>,
    /// Output reference `y_r`, N×p.
    pub output_reference: MatRef<'a, f64>,
    /// Measured disturbances, where the data have such channels.
    pub disturbances: Option<MeasuredDisturbances<'a>>,
}

/// Measured disturbances at one sample instant. Rows are time, columns channels.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredDisturbances<'a> {
    /// Of the past, `T_ini`×q, oldest first.
    pub past: MatRef<'a, f64>,
    /// Expected over the horizon, N×q.
    pub preview: MatRef<'a, f64>,
}

impl MeasuredDisturbances<'_> {
    /// Those given, if they have channels; else none, 0×0.
    pub(super) fn or_none(given: Option<Self>) -> Self {
        let none = MatRef::from_column_major_slice(&[], 0, 0);
        let given = given.filter(|given| given.past.ncols() + given.preview.ncols() > 0);
        given.unwrap_or(Self {
            past: none,
            preview: none,
        })
    }
}

/// How a plan came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlanOrigin {
    /// The optimum without bounds meets them all.
    Unconstrained,
    /// A solver's answer, or none: see [`Plan::status`].
    Solver,
}

/// The optimal future: inputs to apply and outputs predicted.
#[derive(Debug, Clone)]
pub struct Plan {
    /// u, N×m.
    pub inputs: Mat<f64>,
    /// y, N×p.
    pub outputs: Mat<f64>,
    /// ‖u − `u_r‖²_R` + ‖y − `y_r‖²_Q` and the cost of input changes. The whole objective, with what
    /// g and the slacks cost, is [`super::PredictiveProgram::objective`].
    pub tracking: f64,
    /// Price of the violated soft constraints, Σ ρs + ½ws².
    pub soft_penalty: f64,
    /// Largest violation of each output's bounds over the horizon, in the output's units (p).
    pub output_violation: Vec<f64>,
    /// Largest violation of a bound on the inputs or their changes over the horizon (rounding of
    /// the solver).
    pub input_violation: f64,
    /// Largest violation of an affine or terminal constraint, in its own units.
    pub constraint_violation: f64,
    /// How it came about.
    pub origin: PlanOrigin,
    /// How the solve ended.
    pub status: QpStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// Largest relative residual of the solver's point
    /// ([`crate::solver::Certificate::relative`]); 0 for an unconstrained optimum.
    pub residual: f64,
    /// Relative part of the past that the data cannot explain, where slack is hard and the data
    /// do not span every past; 0 otherwise, and always 0 in the sparse form.
    pub past_inconsistency: f64,
}

impl Plan {
    pub(super) fn empty(shape: Shape) -> Self {
        let steps = shape.horizons.future;
        Self {
            inputs: Mat::zeros(steps, shape.inputs),
            outputs: Mat::zeros(steps, shape.outputs),
            tracking: f64::NAN,
            soft_penalty: f64::NAN,
            output_violation: vec![0.0; shape.outputs],
            input_violation: 0.0,
            constraint_violation: 0.0,
            origin: PlanOrigin::Solver,
            status: QpStatus::NotRun,
            iterations: 0,
            residual: f64::NAN,
            past_inconsistency: 0.0,
        }
    }

    /// Whether inputs and outputs may be used.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.status.is_usable()
    }

    /// Largest violation of any output bound, over outputs that may have different units.
    #[must_use]
    pub fn largest_output_violation(&self) -> f64 {
        self.output_violation.iter().copied().fold(0.0, f64::max)
    }
}

/// The summands of the objective.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObjectiveParts {
    /// ‖u − `u_r‖²_R`.
    pub input_tracking: f64,
    /// ‖y − `y_r‖²_Q`.
    pub output_tracking: f64,
    /// Cost of the input changes.
    pub input_change: f64,
    /// What g costs (`λ_g‖g‖²` with the raw `λ_g` for the squared norm).
    pub regularisation: f64,
    /// `λ_u‖σ_u‖²`, and what the slack of the measured disturbances costs.
    pub input_slack: f64,
    /// `λ_y‖σ_y‖²`.
    pub output_slack: f64,
    /// Σ ρs + ½ws².
    pub soft_bounds: f64,
}

impl ObjectiveParts {
    /// The objective.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.input_tracking
            + self.output_tracking
            + self.input_change
            + self.regularisation
            + self.input_slack
            + self.output_slack
            + self.soft_bounds
    }
}

/// What condensing removed from the problem, recovered. For a reduced predictor g is that of
/// the reduced matrix (ḡ).
#[derive(Debug, Clone)]
pub struct Recovered {
    /// g, one entry per column of the data matrix; none without data.
    pub g: Vec<f64>,
    /// `σ_u`, `T_ini`×m.
    pub input_slack: Mat<f64>,
    /// `σ_y`, `T_ini`×p.
    pub output_slack: Mat<f64>,
    /// The summands of the objective, from g and σ.
    pub parts: ObjectiveParts,
}
