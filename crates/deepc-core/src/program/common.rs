//! What both forms share: the stacked vectors, the costs, the constraints and the plan.

use faer::MatRef;

use super::error::ProgramError;
use super::plan::{MeasuredDisturbances, Moment, ObjectiveParts, Plan, PlanOrigin};
use super::rows::ConstraintRows;
use super::settings::DeepcSettings;
use super::stage_cost::{StageCost, TrackingCost};
use super::stage_settings::StageSettings;
use crate::hankel::{Block, Shape, stack_into, unstack_into};
use crate::predictor::Predictor;
use crate::solver::{QpSolution, QpStatus};

#[derive(Debug)]
pub(super) struct Common {
    pub shape: Shape,
    pub stage: StageSettings,
    pub sample_time_s: f64,
    /// J before any reduction; 0 without data.
    pub columns: usize,
    /// 1/λ of the slack of every entry of the known part; 0 where it is hard.
    pub compliance: Vec<f64>,
    pub cost: StageCost,
    pub rows: ConstraintRows,
    /// `z = col(u_ini, d_ini, y_ini, d)`.
    pub known: Vec<f64>,
    /// `r = col(u_r, y_r)`.
    pub reference: Vec<f64>,
    pub plan: Plan,
}

impl Common {
    /// For the data of a predictor.
    pub fn new(predictor: &Predictor, settings: &DeepcSettings) -> Result<Self, ProgramError> {
        let shape = predictor.shape();
        let horizons = shape.horizons;
        settings.check(shape.inputs, shape.outputs, horizons.future)?;
        let disturbance = settings.options.disturbance_slack.0.compliance();
        let mut compliance = Vec::with_capacity(shape.known_rows());
        for (value, channels, steps) in [
            (
                settings.input_slack.compliance(),
                shape.inputs,
                horizons.past,
            ),
            (disturbance, shape.disturbances, horizons.past),
            (
                settings.output_slack.compliance(),
                shape.outputs,
                horizons.past,
            ),
            (disturbance, shape.disturbances, horizons.future),
        ] {
            compliance.resize(compliance.len() + channels * steps, value);
        }
        let future_scales = &predictor.row_scales()[shape.known_rows()..];
        Ok(Self {
            columns: predictor.reduction().columns_before,
            compliance,
            ..Self::without_data(
                shape,
                predictor.sample_time_s(),
                future_scales,
                settings.stage(),
            )
        })
    }

    /// For a future that is not predicted from data; `stage` was checked. `future_scales`: size of
    /// every entry of f.
    pub fn without_data(
        shape: Shape,
        sample_time_s: f64,
        future_scales: &[f64],
        stage: StageSettings,
    ) -> Self {
        Self {
            shape,
            sample_time_s,
            columns: 0,
            compliance: vec![0.0; shape.known_rows()],
            cost: StageCost::new(shape, &stage),
            rows: ConstraintRows::new(shape, &stage, future_scales),
            known: vec![0.0; shape.known_rows()],
            reference: vec![0.0; shape.future_rows()],
            plan: Plan::empty(shape),
            stage,
        }
    }

    /// Stacks the moment into the known part and the reference, and moves the constraints.
    pub fn stack(&mut self, moment: &Moment<'_>) -> Result<(), ProgramError> {
        let Shape {
            inputs,
            disturbances,
            outputs,
            horizons,
        } = self.shape;
        let measured = MeasuredDisturbances::or_none(moment.disturbances);
        let (past_d, preview) = (measured.past, measured.preview);
        // Nothing is expected where there is nothing.
        let steps = |steps: usize| if disturbances == 0 { 0 } else { steps };
        let series: [NamedSeries<'_>; 6] = [
            (
                "the past of the inputs",
                moment.past_inputs,
                horizons.past,
                inputs,
            ),
            (
                "the past of the disturbances",
                past_d,
                steps(horizons.past),
                disturbances,
            ),
            (
                "the past of the outputs",
                moment.past_outputs,
                horizons.past,
                outputs,
            ),
            (
                "the preview of the disturbances",
                preview,
                steps(horizons.future),
                disturbances,
            ),
            (
                "the input reference",
                moment.input_reference,
                horizons.future,
                inputs,
            ),
            (
                "the output reference",
                moment.output_reference,
                horizons.future,
                outputs,
            ),
        ];
        for &(name, series, rows, columns) in &series {
            check_series(name, series, rows, columns)?;
        }
        let (known, reference) = series.split_at(4);
        stack_all(known, &mut self.known);
        stack_all(reference, &mut self.reference);
        self.rows.move_bounds(&self.known, &self.reference);
        self.plan.status = QpStatus::NotRun;
        Ok(())
    }

    pub fn tracking(&self, future: &[f64]) -> TrackingCost {
        self.cost.tracking(future, &self.known, &self.reference)
    }

    pub fn write_plan(&mut self, future: &[f64], ending: Ending) {
        let tracking = self.tracking(future).total();
        let plan = &mut self.plan;
        let judgement = self.rows.judge(future, &mut plan.output_violation);
        let first_output = self.shape.inputs * self.shape.horizons.future;
        unstack_into(&future[..first_output], plan.inputs.as_mut());
        unstack_into(&future[first_output..], plan.outputs.as_mut());
        plan.tracking = tracking;
        plan.soft_penalty = judgement.penalty;
        plan.input_violation = judgement.inputs;
        plan.constraint_violation = judgement.others;
        ending.write_to(plan);
    }

    /// Marks the plan as unusable.
    pub fn reject(&mut self, ending: Ending) {
        self.plan.tracking = f64::NAN;
        self.plan.soft_penalty = f64::NAN;
        ending.write_to(&mut self.plan);
    }

    /// `λ_u‖σ_u‖²` (with the slack of the disturbances) and `λ_y‖σ_y‖²`, from the slack of every
    /// known entry.
    pub fn slack_costs(&self, slack: &[f64]) -> (f64, f64) {
        let outputs = self.shape.rows_of(Block::PastOutputs);
        let mut costs = (0.0, 0.0);
        for (i, (value, compliance)) in slack.iter().zip(&self.compliance).enumerate() {
            if *compliance > 0.0 {
                let cost = value * value / compliance;
                if outputs.contains(&i) {
                    costs.1 += cost;
                } else {
                    costs.0 += cost;
                }
            }
        }
        costs
    }

    /// The parts of the objective, from what g costs and the slack of every known entry.
    pub fn parts(&self, future: &[f64], regularisation: f64, slack: &[f64]) -> ObjectiveParts {
        let tracking = self.tracking(future);
        let (input_slack, output_slack) = self.slack_costs(slack);
        ObjectiveParts {
            input_tracking: tracking.inputs,
            output_tracking: tracking.outputs,
            input_change: tracking.changes,
            regularisation,
            input_slack,
            output_slack,
            soft_bounds: self.rows.penalty(future),
        }
    }
}

/// How a step ended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ending {
    pub origin: PlanOrigin,
    pub status: QpStatus,
    pub iterations: u32,
    pub residual: f64,
}

impl Ending {
    pub fn unconstrained() -> Self {
        Self {
            origin: PlanOrigin::Unconstrained,
            status: QpStatus::Solved,
            iterations: 0,
            residual: 0.0,
        }
    }

    /// No solver was asked.
    pub fn refused(status: QpStatus) -> Self {
        Self {
            origin: PlanOrigin::Solver,
            status,
            iterations: 0,
            residual: f64::NAN,
        }
    }

    pub fn of(solution: &QpSolution) -> Self {
        Self {
            origin: PlanOrigin::Solver,
            status: solution.status,
            iterations: solution.iterations,
            residual: solution.certificate.relative,
        }
    }

    fn write_to(self, plan: &mut Plan) {
        plan.origin = self.origin;
        plan.status = self.status;
        plan.iterations = self.iterations;
        plan.residual = self.residual;
    }
}

pub(super) type NamedSeries<'a> = (&'static str, MatRef<'a, f64>, usize, usize);

pub(super) fn stack_all(series: &[NamedSeries<'_>], target: &mut [f64]) {
    let mut rest = target;
    for (_, series, ..) in series {
        let (now, later) = rest.split_at_mut(series.nrows() * series.ncols());
        stack_into(*series, now);
        rest = later;
    }
}

pub(super) fn check_series(
    name: &'static str,
    series: MatRef<'_, f64>,
    expected_rows: usize,
    expected_columns: usize,
) -> Result<(), ProgramError> {
    if series.shape() == (expected_rows, expected_columns) {
        return Ok(());
    }
    Err(ProgramError::Series {
        name,
        rows: series.nrows(),
        columns: series.ncols(),
        expected_rows,
        expected_columns,
    })
}
