//! What a controller decided, and how it came to it.

use std::time::Duration;

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use crate::program::{Bounds, Plan};
use crate::solver::QpStatus;

/// Where an input came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// The past window has not been full yet since the controller was built or reset: the reference
    /// input, clipped to the bounds.
    Passthrough,
    /// The optimum without bounds, which meets them all.
    Unconstrained,
    /// A solver's optimum.
    Solver,
    /// The optimum of the second solver, because the first one failed.
    SecondSolver,
    /// A later move of the last plan, as scheduled (`moves_per_solve` above 1).
    Plan,
    /// A later move of the last plan, because no new plan could be made.
    Fallback,
    /// The input applied last, because there is no plan to fall back on. Before the first sample
    /// the input decided last, which at the start is 0, within the bounds.
    Hold,
    /// What the user's own fallback chose, because plan and hold are used up.
    User,
}

impl Origin {
    /// Whether the step did without a fresh plan although one was due.
    #[must_use]
    pub fn is_fallback(self) -> bool {
        matches!(self, Self::Fallback | Self::Hold | Self::User)
    }
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
    /// An output did not change at all for longer than
    /// [`frozen_after`](super::RecedingHorizonSettings::frozen_after) allows; it is used all the
    /// same.
    MeasurementFrozen,
    /// A fault before this step could not be repaired and emptied the past window, which is not full
    /// again yet.
    WindowRefilling,
    /// A measured disturbance is NaN or infinite; the last good value took its place.
    DisturbanceNotFinite,
    /// The reference (or its preview of the disturbances) holds NaN or an infinity.
    ReferenceNotFinite,
    /// The reference does not have the controller's shape.
    ReferenceShape,
    /// The signal that chooses the data set is NaN; the data set in use stays.
    ScheduleNotFinite,
    /// The solve ended with a status that is not usable: see [`Step::status`].
    SolveFailed,
    /// The plan came after the deadline and was discarded.
    DeadlineMissed,
}

impl Fault {
    /// Whether no new plan is made because of it. The others are only reported.
    #[must_use]
    pub fn stops_planning(self) -> bool {
        !matches!(
            self,
            Self::MeasurementFrozen | Self::DisturbanceNotFinite | Self::ScheduleNotFinite
        )
    }
}

/// One decision.
#[derive(Debug, Clone)]
pub struct Step {
    /// u(k), m values: finite, within the hard bounds, and from u(k−1) within the hard bounds of
    /// the changes ([`Controller`](super::Controller), clause 2).
    pub input: Vec<f64>,
    /// Where it came from.
    pub origin: Origin,
    /// What went wrong, if anything did (of several faults the gravest).
    pub fault: Option<Fault>,
    /// Steps in a row with this origin, this one included.
    pub origin_steps: usize,
    /// Steps in a row that fell back ([`Origin::is_fallback`]), this one included; 0 if it did
    /// not.
    pub fallback_steps: usize,
    /// The data set that acted; 0 but for a [`super::ScheduledController`].
    pub data_set: usize,
    /// How the plan made in this step ended (`Solved` for an unconstrained optimum);
    /// [`QpStatus::NotRun`] if none was made.
    pub status: QpStatus,
    /// How the second solver ended; [`QpStatus::NotRun`] if it was not asked.
    pub second_status: QpStatus,
    /// Iterations of the solvers in this step.
    pub iterations: u32,
    /// Wall-clock time of the whole decision.
    pub solve_time: Duration,
    /// Whether `solve_time` exceeds the deadline.
    pub late: bool,
    /// Tracking cost ‖u − `u_r‖²_R` + ‖y − `y_r‖²_Q` (and of input changes) of the plan made in this
    /// step; `None` if none was made.
    pub tracking: Option<f64>,
    /// Largest violation of an output bound over what remains of the plan, in the output's
    /// units (of several outputs, the largest number).
    pub predicted_violation: f64,
    /// Largest violation of an affine or terminal constraint in the plan that acts, over its whole
    /// horizon as it was made, in the constraint's units (of several, the largest number); 0 if no
    /// plan acts.
    pub constraint_violation: f64,
    /// Largest relative residual of the solver's point; 0 where no solver ran.
    pub residual: f64,
    /// Samples in the past window that had to be replaced by predictions.
    pub repaired_samples: usize,
    /// Row of the plan that belongs to this step.
    pub(super) plan_row: Option<usize>,
    pub(super) plan: StoredPlan,
}

impl Step {
    pub(super) fn new(horizon: usize, inputs: usize, outputs: usize) -> Self {
        Self {
            input: vec![0.0; inputs],
            origin: Origin::Passthrough,
            fault: None,
            origin_steps: 0,
            fallback_steps: 0,
            data_set: 0,
            status: QpStatus::NotRun,
            second_status: QpStatus::NotRun,
            iterations: 0,
            solve_time: Duration::ZERO,
            late: false,
            tracking: None,
            predicted_violation: 0.0,
            constraint_violation: 0.0,
            residual: 0.0,
            repaired_samples: 0,
            plan_row: None,
            plan: StoredPlan {
                inputs: Mat::zeros(horizon, inputs),
                outputs: Mat::zeros(horizon, outputs),
                constraint_violation: 0.0,
                tolerances: vec![0.0; inputs],
                age: None,
            },
        }
    }

    /// As before the first decision.
    pub(super) fn reset(&mut self) {
        self.clear();
        self.origin = Origin::Passthrough;
        self.origin_steps = 0;
        self.fallback_steps = 0;
        self.input.fill(0.0);
        self.solve_time = Duration::ZERO;
        self.repaired_samples = 0;
        self.plan.age = None;
    }

    /// Forgets the previous decision but for the input, the plan and the runs of origins.
    pub(super) fn clear(&mut self) {
        self.fault = None;
        self.status = QpStatus::NotRun;
        self.second_status = QpStatus::NotRun;
        self.iterations = 0;
        self.late = false;
        self.tracking = None;
        self.predicted_violation = 0.0;
        self.constraint_violation = 0.0;
        self.residual = 0.0;
        self.plan_row = None;
    }

    /// Sets the origin and counts how often it came in a row.
    pub(super) fn count_origin(&mut self, origin: Origin) {
        self.origin_steps = if origin == self.origin {
            self.origin_steps.saturating_add(1)
        } else {
            1
        };
        self.fallback_steps = if origin.is_fallback() {
            self.fallback_steps.saturating_add(1)
        } else {
            0
        };
        self.origin = origin;
    }

    /// Inputs of the plan from this sample on, one row per sample; no rows while no plan acts.
    #[must_use]
    pub fn predicted_inputs(&self) -> MatRef<'_, f64> {
        self.remaining(self.plan.inputs.as_ref())
    }

    /// Outputs the plan predicts from this sample on; row 0 is measured at the end of this
    /// sample. No rows while no plan acts (passthrough, hold, the user's choice).
    #[must_use]
    pub fn predicted_outputs(&self) -> MatRef<'_, f64> {
        self.remaining(self.plan.outputs.as_ref())
    }

    fn remaining<'a>(&self, series: MatRef<'a, f64>) -> MatRef<'a, f64> {
        let first = self.plan_row.unwrap_or(series.nrows());
        series.subrows(first, series.nrows() - first)
    }
}

/// The last usable plan, which outlives a failed solve and a change of the program.
#[derive(Debug, Clone)]
pub(super) struct StoredPlan {
    /// u, N×m.
    pub inputs: Mat<f64>,
    /// y, N×p.
    pub outputs: Mat<f64>,
    /// As [`Step::constraint_violation`].
    pub constraint_violation: f64,
    /// By how much an input applied may differ from the planned one and still count as it (m).
    pub tolerances: Vec<f64>,
    /// Samples since it was made: the row that belongs to the next sample. `None`: no plan, or
    /// one that was not followed.
    pub age: Option<usize>,
}

/// Share of an input's range within which the input applied counts as the one planned: more than
/// rounding, what clipping takes off a solver's answer and the resolution of an actuator that reports
/// what it did; less than another hand on it.
const FOLLOWED: f64 = 1e-3;

impl StoredPlan {
    /// Keeps a plan made for the next sample. The range of an input is that of its hard bounds;
    /// where they leave it open, the largest input planned.
    pub fn adopt(&mut self, plan: &Plan, bounds: &[Bounds]) {
        self.inputs.copy_from(&plan.inputs);
        self.outputs.copy_from(&plan.outputs);
        self.constraint_violation = plan.constraint_violation;
        let channels = self.inputs.col_iter().zip(bounds);
        for (tolerance, (planned, bounds)) in self.tolerances.iter_mut().zip(channels) {
            let width = bounds.upper_value() - bounds.lower_value();
            let range = if width > 0.0 && width.is_finite() {
                width
            } else {
                planned.iter().fold(0.0, |largest, u| u.abs().max(largest))
            };
            *tolerance = FOLLOWED * range;
        }
        self.age = Some(0);
    }

    /// Whether `applied` is what the plan has in this row.
    pub fn is_followed(&self, row: usize, applied: &[f64]) -> bool {
        let planned = self.inputs.row(row).iter().zip(&self.tolerances);
        let mut pairs = applied.iter().zip(planned);
        pairs.all(|(u, (planned, tolerance))| (u - planned).abs() <= *tolerance)
    }

    /// The row that belongs to the next sample, if there is one.
    pub fn row(&self) -> Option<usize> {
        self.age.filter(|&age| age < self.inputs.nrows())
    }
}
