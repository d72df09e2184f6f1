//! The receding-horizon `DeePC` controller.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::Controller;
use super::error::ControllerError;
use super::reference::Reference;
use super::step::{Fault, Origin, Step};
use super::window::Window;
use crate::program::{DeepcProgram, Moment, PlanOrigin};
use crate::solver::{QpSolver, SolveBudget};

/// Settings of the receding horizon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecedingHorizonSettings {
    /// Moves applied from one plan before the next is made, 1 to N.
    pub moves_per_solve: usize,
    /// What one solve may cost.
    pub budget: SolveBudget,
}

impl RecedingHorizonSettings {
    /// A new plan in every sample.
    #[must_use]
    pub fn every_sample(budget: SolveBudget) -> Self {
        Self {
            moves_per_solve: 1,
            budget,
        }
    }

    /// Checks the ranges, for a horizon of N steps.
    ///
    /// # Errors
    /// Names the field out of range.
    pub fn check(&self, horizon: usize) -> Result<(), ControllerError> {
        if !(1..=horizon).contains(&self.moves_per_solve) {
            return Err(ControllerError::MovesPerSolve {
                found: self.moves_per_solve,
                horizon,
            });
        }
        if !self.budget.is_valid() {
            return Err(ControllerError::Budget {
                iterations: self.budget.max_iterations,
                time_s: self.budget.max_time_s,
            });
        }
        Ok(())
    }
}

/// `DeePC` in closed loop: past window → program vectors → unconstrained optimum or solver →
/// step.
///
/// | situation | input |
/// |---|---|
/// | past window not full | reference input, clipped |
/// | unconstrained optimum meets all bounds | its first move; no solver runs |
/// | otherwise | first move of the solver's plan |
/// | between solves (`moves_per_solve` > 1) | next move of the plan |
/// | solve failed, sample NaN or lost, bad reference | next move of the last plan, and after its end the input applied last |
///
/// A sample that is missing is replaced in the past window by what the last plan predicted for
/// it, and counted in [`Step::repaired_samples`] as long as it stays there. Without a prediction
/// the window has to fill again.
pub struct DeepcController {
    program: Box<dyn DeepcProgram>,
    solver: Box<dyn QpSolver>,
    settings: RecedingHorizonSettings,
    window: Window,
    /// Samples since the plan was made: the plan's row that belongs to the next sample.
    plan_age: Option<usize>,
    /// The input applied last, if `input_applied`.
    last_input: Vec<f64>,
    input_applied: bool,
    /// A decision was made and its sample not observed yet.
    awaits_sample: bool,
    sample_fault: Option<Fault>,
    repaired_input: Vec<f64>,
    repaired_output: Vec<f64>,
    step: Step,
}

impl DeepcController {
    /// Puts a program and a solver set up with its [`DeepcProgram::qp`] together.
    ///
    /// # Errors
    /// A setting is out of range, or the solver was set up for another program.
    pub fn new(
        program: Box<dyn DeepcProgram>,
        solver: Box<dyn QpSolver>,
        settings: RecedingHorizonSettings,
    ) -> Result<Self, ControllerError> {
        let shape = program.shape();
        settings.check(shape.horizons.future)?;
        let (ours, theirs) = (program.qp(), solver.problem());
        let sizes = (ours.variable_count(), ours.row_count());
        if sizes != (theirs.variable_count(), theirs.row_count()) {
            return Err(ControllerError::SolverMismatch {
                solver_variables: theirs.variable_count(),
                solver_rows: theirs.row_count(),
                variables: sizes.0,
                rows: sizes.1,
            });
        }
        // The optimum for other weights or data would look like a solution of this program.
        if ours != theirs {
            return Err(ControllerError::SolverOfOtherProgram {
                variables: sizes.0,
                rows: sizes.1,
            });
        }
        Ok(Self {
            window: Window::new(shape.horizons.past, shape.inputs, shape.outputs),
            plan_age: None,
            last_input: vec![0.0; shape.inputs],
            input_applied: false,
            awaits_sample: false,
            sample_fault: None,
            repaired_input: vec![0.0; shape.inputs],
            repaired_output: vec![0.0; shape.outputs],
            step: Step::new(shape.horizons.future, shape.inputs, shape.outputs),
            program,
            solver,
            settings,
        })
    }

    /// The program, for its last plan and what it can recover.
    #[must_use]
    pub fn program(&self) -> &dyn DeepcProgram {
        self.program.as_ref()
    }

    /// The last decision.
    #[must_use]
    pub fn step(&self) -> &Step {
        &self.step
    }

    fn check_reference(&self, reference: &Reference) -> Option<Fault> {
        let shape = self.program.shape();
        let steps = shape.horizons.future;
        if reference.inputs().shape() != (steps, shape.inputs)
            || reference.outputs().shape() != (steps, shape.outputs)
        {
            return Some(Fault::ReferenceShape);
        }
        let finite = reference.inputs().is_all_finite() && reference.outputs().is_all_finite();
        (!finite).then_some(Fault::ReferenceNotFinite)
    }

    /// Chooses the input; the caller clips it.
    fn choose(&mut self, reference: &Reference) -> Origin {
        let reference_fault = self.check_reference(reference);
        let sample_fault = self.sample_fault.take();
        self.step.fault = sample_fault.or(reference_fault);
        if let Some(age) = self.plan_age
            && age > 0
            && age < self.settings.moves_per_solve
        {
            self.take_planned(age);
            return Origin::Plan;
        }
        if self.step.fault.is_some() {
            return self.fall_back();
        }
        if !self.window.is_full() {
            let first = reference.inputs().row(0);
            self.step
                .input
                .iter_mut()
                .zip(first.iter())
                .for_each(|(u, r)| *u = *r);
            return Origin::Passthrough;
        }
        let moment = Moment {
            past_inputs: self.window.inputs(),
            past_outputs: self.window.outputs(),
            input_reference: reference.inputs(),
            output_reference: reference.outputs(),
        };
        let solved = self
            .program
            .solve(&moment, self.solver.as_mut(), &self.settings.budget);
        if let Ok(plan) = solved {
            self.step.status = plan.status;
            self.step.iterations = plan.iterations;
            if plan.is_usable() {
                self.step.residual = plan.residual;
                self.step.objective = Some(plan.objective);
                let origin = match plan.origin {
                    PlanOrigin::Unconstrained => Origin::Unconstrained,
                    PlanOrigin::Solver => Origin::Solver,
                };
                self.plan_age = Some(0);
                self.take_planned(0);
                return origin;
            }
        }
        self.step.fault = Some(Fault::SolveFailed);
        self.fall_back()
    }

    fn fall_back(&mut self) -> Origin {
        match self.plan_age {
            Some(age) if age < self.program.shape().horizons.future => {
                self.take_planned(age);
                Origin::Fallback
            }
            _ => {
                // Before any sample there is nothing to hold but the input of the last step,
                // which is zero at the start.
                if self.input_applied {
                    self.step.input.copy_from_slice(&self.last_input);
                }
                Origin::Hold
            }
        }
    }

    /// Takes row `age` of the last plan, and what remains of the plan as the prediction.
    fn take_planned(&mut self, age: usize) {
        let plan = self.program.plan();
        let rows = plan.inputs.nrows() - age;
        let step = &mut self.step;
        step.predicted_rows = rows;
        let (inputs, outputs) = (
            plan.inputs.subrows(age, rows),
            plan.outputs.subrows(age, rows),
        );
        step.predicted_inputs
            .as_mut()
            .subrows_mut(0, rows)
            .copy_from(inputs);
        step.predicted_outputs
            .as_mut()
            .subrows_mut(0, rows)
            .copy_from(outputs);
        step.input
            .iter_mut()
            .zip(inputs.row(0).iter())
            .for_each(|(u, planned)| *u = *planned);
        let bounds = &self.program.settings().output_bounds;
        step.predicted_violation = bounds
            .iter()
            .enumerate()
            .flat_map(|(channel, output)| {
                outputs
                    .col(channel)
                    .iter()
                    .map(|&value| output.bounds.violation(value))
            })
            .fold(0.0, f64::max);
    }

    /// Appends a sample; entries that are not finite are replaced by the plan's prediction.
    fn take_sample(&mut self, input: &[f64], output: &[f64], fault: Option<Fault>) {
        let decided = std::mem::take(&mut self.awaits_sample);
        let predicted = self
            .plan_age
            .filter(|&age| age < self.program.shape().horizons.future);
        self.plan_age = self.plan_age.map(|age| age + 1);
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        // What was applied: as reported where that can be trusted, else as decided.
        let reported = input.len() == self.last_input.len() && finite(input);
        if reported || decided {
            repair(&mut self.repaired_input, input, self.step.input.iter());
            self.last_input.copy_from_slice(&self.repaired_input);
            self.input_applied = true;
        }
        if fault.is_none() && finite(input) && finite(output) {
            self.window.push(input, output, false);
            self.sample_fault = None;
            return;
        }
        self.sample_fault = Some(fault.unwrap_or(Fault::MeasurementNotFinite));
        let Some(row) = predicted else {
            self.window.clear();
            return;
        };
        let plan = self.program.plan();
        repair(
            &mut self.repaired_output,
            output,
            plan.outputs.row(row).iter(),
        );
        self.window
            .push(&self.repaired_input, &self.repaired_output, true);
    }
}

/// Copies the finite entries of `sample` and takes the others from `substitute`. A sample of the
/// wrong length has no entry that can be trusted.
fn repair<'a>(target: &mut [f64], sample: &[f64], substitute: impl Iterator<Item = &'a f64>) {
    let trusted = sample.len() == target.len();
    for (i, (entry, substitute)) in target.iter_mut().zip(substitute).enumerate() {
        *entry = if trusted && sample[i].is_finite() {
            sample[i]
        } else {
            *substitute
        };
    }
}

impl Controller for DeepcController {
    fn inputs(&self) -> usize {
        self.program.shape().inputs
    }

    fn outputs(&self) -> usize {
        self.program.shape().outputs
    }

    fn horizon(&self) -> usize {
        self.program.shape().horizons.future
    }

    fn sample_time_s(&self) -> f64 {
        self.program.sample_time_s()
    }

    fn decide(&mut self, reference: &Reference) -> &Step {
        let start = Instant::now();
        if self.awaits_sample {
            self.take_sample(&[], &[], Some(Fault::MeasurementLost));
        }
        self.step.clear();
        self.step.origin = self.choose(reference);
        let bounds = &self.program.settings().input_bounds;
        for (value, bounds) in self.step.input.iter_mut().zip(bounds) {
            *value = bounds.clip(*value);
        }
        self.step.repaired_samples = self.window.repaired_samples();
        self.awaits_sample = true;
        self.step.solve_time = start.elapsed();
        &self.step
    }

    fn observe(&mut self, input: &[f64], output: &[f64]) {
        let fits = input.len() == self.inputs() && output.len() == self.outputs();
        self.take_sample(input, output, (!fits).then_some(Fault::MeasurementShape));
    }

    fn reset(&mut self) {
        self.window.clear();
        self.solver.forget();
        self.plan_age = None;
        self.input_applied = false;
        self.awaits_sample = false;
        self.sample_fault = None;
        self.step.reset();
    }
}
