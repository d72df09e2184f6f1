//! What a controller decided, and how it came to it.

use std::time::Duration;

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use crate::solver::QpStatus;

/// Where an input came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The past window is not full yet: the reference input, clipped to the bounds.
    Passthrough,
    /// The optimum without bounds, which meets them all.
    Unconstrained,
    /// A solver's optimum.
    Solver,
    /// A later move of the last plan, as scheduled (`moves_per_solve` above 1).
    Plan,
    /// A later move of the last plan, because no new plan could be made.
    Fallback,
    /// The input applied last, because there is no plan to fall back on.
    Hold,
}

/// Why a step did not go as scheduled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// A measured value (or the reported input) is NaN or infinite.
    MeasurementNotFinite,
    /// A sample had the wrong number of values.
    MeasurementShape,
    /// No sample was observed since the last decision.
    MeasurementLost,
    /// The reference holds NaN or an infinity.
    ReferenceNotFinite,
    /// The reference does not have the controller's shape.
    ReferenceShape,
    /// The solve ended with a status that is not usable: see [`Step::status`].
    SolveFailed,
}

/// One decision.
#[derive(Debug, Clone)]
pub struct Step {
    /// u(k), m values: finite and within the hard bounds.
    pub input: Vec<f64>,
    /// Where it came from.
    pub origin: Origin,
    /// What went wrong, if anything did.
    pub fault: Option<Fault>,
    /// How the plan made in this step ended (`Solved` for an unconstrained optimum);
    /// [`QpStatus::NotRun`] if none was made.
    pub status: QpStatus,
    /// Iterations of the solver in this step.
    pub iterations: u32,
    /// Wall-clock time of the whole decision.
    pub solve_time: Duration,
    /// Objective of the plan made in this step; `None` if none was made.
    pub objective: Option<f64>,
    /// Largest violation of an output bound over what remains of the plan, in the output's
    /// units (of several outputs, the largest number).
    pub predicted_violation: f64,
    /// Largest relative residual of the solver's point; 0 where no solver ran.
    pub residual: f64,
    /// Samples in the past window that had to be replaced by predictions.
    pub repaired_samples: usize,
    pub(super) predicted_rows: usize,
    pub(super) predicted_inputs: Mat<f64>,
    pub(super) predicted_outputs: Mat<f64>,
}

impl Step {
    pub(super) fn new(horizon: usize, inputs: usize, outputs: usize) -> Self {
        Self {
            input: vec![0.0; inputs],
            origin: Origin::Passthrough,
            fault: None,
            status: QpStatus::NotRun,
            iterations: 0,
            solve_time: Duration::ZERO,
            objective: None,
            predicted_violation: 0.0,
            residual: 0.0,
            repaired_samples: 0,
            predicted_rows: 0,
            predicted_inputs: Mat::zeros(horizon, inputs),
            predicted_outputs: Mat::zeros(horizon, outputs),
        }
    }

    /// As before the first decision.
    pub(super) fn reset(&mut self) {
        self.clear();
        self.origin = Origin::Passthrough;
        self.input.fill(0.0);
        self.solve_time = Duration::ZERO;
        self.repaired_samples = 0;
    }

    /// Forgets the previous decision but for the input.
    pub(super) fn clear(&mut self) {
        self.fault = None;
        self.status = QpStatus::NotRun;
        self.iterations = 0;
        self.objective = None;
        self.predicted_violation = 0.0;
        self.residual = 0.0;
        self.predicted_rows = 0;
    }

    /// Inputs of the plan from this sample on, one row per sample; no rows if there is no plan.
    #[must_use]
    pub fn predicted_inputs(&self) -> MatRef<'_, f64> {
        self.predicted_inputs.subrows(0, self.predicted_rows)
    }

    /// Outputs the plan predicts from this sample on; row 0 is measured at the end of this
    /// sample.
    #[must_use]
    pub fn predicted_outputs(&self) -> MatRef<'_, f64> {
        self.predicted_outputs.subrows(0, self.predicted_rows)
    }
}
