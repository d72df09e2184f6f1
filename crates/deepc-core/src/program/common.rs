//! What both forms share: the stacked vectors, the weights and the plan.

use faer::MatRef;

use super::bounds::BoundRows;
use super::error::ProgramError;
use super::plan::{Moment, ObjectiveParts, Plan, PlanOrigin};
use super::settings::DeepcSettings;
use crate::hankel::{Shape, stack_into, unstack_into};
use crate::predictor::Predictor;
use crate::solver::{QpSolution, QpStatus};

#[derive(Debug)]
pub(super) struct Common {
    pub shape: Shape,
    pub settings: DeepcSettings,
    pub sample_time_s: f64,
    /// `λ_g` of the raw form.
    pub lambda_g: f64,
    /// `1/λ_u` and `1/λ_y`, one per entry of `w_ini`.
    pub compliance: Vec<f64>,
    /// Diagonal of blkdiag(R, Q), one per entry of f.
    pub weights: Vec<f64>,
    pub bounds: BoundRows,
    /// `w_ini = col(u_ini, y_ini)`.
    pub past: Vec<f64>,
    /// `r = col(u_r, y_r)`.
    pub reference: Vec<f64>,
    pub plan: Plan,
}

impl Common {
    pub fn new(predictor: &Predictor, settings: &DeepcSettings) -> Result<Self, ProgramError> {
        let shape = predictor.shape();
        settings.check(shape.inputs, shape.outputs)?;
        let [(_, past_u), (_, past_y), ..] = shape.blocks();
        let mut compliance = vec![settings.input_slack.compliance(); past_u];
        compliance.resize(past_u + past_y, settings.output_slack.compliance());
        let steps = shape.horizons.future;
        let mut weights = settings.input_weights.repeat(steps);
        weights.extend(settings.output_weights.repeat(steps));
        let columns = predictor.reduction().columns_before;
        Ok(Self {
            shape,
            sample_time_s: predictor.sample_time_s(),
            lambda_g: settings.regularisation.raw_lambda_g(columns),
            compliance,
            weights,
            bounds: BoundRows::new(
                shape,
                settings,
                &predictor.row_scales()[shape.past_rows()..],
            ),
            past: vec![0.0; shape.past_rows()],
            reference: vec![0.0; shape.future_rows()],
            plan: Plan::empty(shape),
            settings: settings.clone(),
        })
    }

    /// Stacks the moment into `past` and `reference`.
    pub fn stack(&mut self, moment: &Moment<'_>) -> Result<(), ProgramError> {
        let Shape {
            inputs,
            outputs,
            horizons,
        } = self.shape;
        let series = [
            (
                "the past of the inputs",
                moment.past_inputs,
                horizons.past,
                inputs,
            ),
            (
                "the past of the outputs",
                moment.past_outputs,
                horizons.past,
                outputs,
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
        for (name, series, rows, columns) in series {
            check_series(name, series, rows, columns)?;
        }
        let (past_u, past_y) = self.past.split_at_mut(inputs * horizons.past);
        stack_into(moment.past_inputs, past_u);
        stack_into(moment.past_outputs, past_y);
        let (future_u, future_y) = self.reference.split_at_mut(inputs * horizons.future);
        stack_into(moment.input_reference, future_u);
        stack_into(moment.output_reference, future_y);
        self.plan.status = QpStatus::NotRun;
        Ok(())
    }

    /// `‖u − u_r‖²_R` and `‖y − y_r‖²_Q` of the future f.
    pub fn tracking(&self, future: &[f64]) -> (f64, f64) {
        let first_output = self.shape.inputs * self.shape.horizons.future;
        let cost = |range: std::ops::Range<usize>| -> f64 {
            range
                .map(|i| {
                    let error = future[i] - self.reference[i];
                    self.weights[i] * error * error
                })
                .sum()
        };
        (cost(0..first_output), cost(first_output..future.len()))
    }

    /// Writes a plan. `model_cost` is `λ_g‖g‖²` plus the slack costs.
    pub fn write_plan(&mut self, future: &[f64], model_cost: f64, ending: Ending) {
        let (input_tracking, output_tracking) = self.tracking(future);
        let penalty = self.bounds.penalty(future);
        let plan = &mut self.plan;
        let first_output = self.shape.inputs * self.shape.horizons.future;
        unstack_into(&future[..first_output], plan.inputs.as_mut());
        unstack_into(&future[first_output..], plan.outputs.as_mut());
        plan.objective = input_tracking + output_tracking + model_cost + penalty;
        plan.input_violation = self
            .bounds
            .largest_violations(future, &mut plan.output_violation);
        plan.origin = ending.origin;
        plan.status = ending.status;
        plan.iterations = ending.iterations;
        plan.residual = ending.residual;
    }

    /// Marks the plan as unusable.
    pub fn reject(&mut self, ending: Ending) {
        self.plan.objective = f64::NAN;
        self.plan.origin = ending.origin;
        self.plan.status = ending.status;
        self.plan.iterations = ending.iterations;
        self.plan.residual = ending.residual;
    }

    /// The parts of the objective from g and σ (as `col(σ_u, σ_y)`).
    pub fn parts(&self, future: &[f64], g: &[f64], slack: &[f64]) -> ObjectiveParts {
        let (input_tracking, output_tracking) = self.tracking(future);
        let past_u = self.shape.inputs * self.shape.horizons.past;
        let slack_cost = |range: std::ops::Range<usize>| -> f64 {
            range
                .filter(|&i| self.compliance[i] > 0.0)
                .map(|i| slack[i] * slack[i] / self.compliance[i])
                .sum()
        };
        ObjectiveParts {
            input_tracking,
            output_tracking,
            regularisation: self.lambda_g * crate::linalg::dot(g, g),
            input_slack: slack_cost(0..past_u),
            output_slack: slack_cost(past_u..slack.len()),
            soft_bounds: self.bounds.penalty(future),
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

    /// No solver was asked: hard slack cannot explain the past.
    pub fn refused() -> Self {
        Self {
            origin: PlanOrigin::Solver,
            status: QpStatus::Infeasible,
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
}

fn check_series(
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
