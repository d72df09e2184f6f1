//! A program with its solvers: moment in, plan out.

use super::error::ControllerError;
use super::samples::Sample;
use super::step::{Origin, Step};
use crate::data::same_sample_time;
use crate::predictor::Predictor;
use crate::program::{
    CondensedProgram, DeepcSettings, Moment, Plan, PredictiveProgram, ProgramError,
};
use crate::solver::{ActiveSet, ActiveSetSettings, QpSolver, QpStatus, SolveBudget};

/// A program and the solvers set up with its [`PredictiveProgram::qp`].
pub struct Planner {
    program: Box<dyn PredictiveProgram>,
    solver: Box<dyn QpSolver>,
    second: Option<Box<dyn QpSolver>>,
}

impl Planner {
    /// The condensed program of a predictor with the back end for the control loop,
    /// [`ActiveSet`].
    ///
    /// # Errors
    /// As [`CondensedProgram::new`].
    pub fn condensed(
        predictor: &Predictor,
        settings: &DeepcSettings,
    ) -> Result<Self, ControllerError> {
        let program = CondensedProgram::new(predictor, settings)?;
        let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default())
            .map_err(ProgramError::from)?;
        Self::new(Box::new(program), Box::new(solver))
    }

    /// Puts a program and its solver together.
    ///
    /// # Errors
    /// The solver was set up for another program.
    pub fn new(
        program: Box<dyn PredictiveProgram>,
        solver: Box<dyn QpSolver>,
    ) -> Result<Self, ControllerError> {
        check_solver(program.as_ref(), solver.as_ref())?;
        Ok(Self {
            program,
            solver,
            second: None,
        })
    }

    /// Adds a solver that is asked when the first one fails: one that fails for other reasons
    /// and costs the same in every step.
    ///
    /// # Errors
    /// It was set up for another program.
    pub fn with_second_solver(
        mut self,
        solver: Box<dyn QpSolver>,
    ) -> Result<Self, ControllerError> {
        self.set_second_solver(solver)?;
        Ok(self)
    }

    pub(super) fn set_second_solver(
        &mut self,
        solver: Box<dyn QpSolver>,
    ) -> Result<(), ControllerError> {
        check_solver(self.program.as_ref(), solver.as_ref())?;
        self.second = Some(solver);
        Ok(())
    }

    /// The program.
    #[must_use]
    pub fn program(&self) -> &dyn PredictiveProgram {
        self.program.as_ref()
    }

    /// Makes a plan and reports on it in the step; where it came from, or `None` if there is no
    /// usable one.
    pub(super) fn plan(
        &mut self,
        moment: &Moment<'_>,
        budget: &SolveBudget,
        second_budget: &SolveBudget,
        step: &mut Step,
    ) -> Option<Origin> {
        let program = self.program.as_mut();
        // The shapes were checked before; a program that refuses them all the same has no plan.
        program.set_moment(moment).ok()?;
        if program.refuse_past() {
            step.status = program.plan().status;
            return None;
        }
        if program.plan_unconstrained() {
            step.status = program.plan().status;
            return is_usable(program.plan()).then_some(Origin::Unconstrained);
        }
        step.status = ask(program, self.solver.as_mut(), budget, step);
        if is_usable(program.plan()) {
            return Some(Origin::Solver);
        }
        let second = self.second.as_deref_mut()?;
        step.second_status = ask(program, second, second_budget, step);
        is_usable(program.plan()).then_some(Origin::SecondSolver)
    }

    /// Passes a sample of the window on to the program.
    pub(super) fn observe(&mut self, sample: Sample<'_>) {
        self.program
            .observe(sample.input, sample.disturbance, sample.output);
    }

    /// The past window is all that is known.
    pub(super) fn forget_samples(&mut self) {
        self.program.forget();
    }

    /// Drops what the solvers would start from, and the samples.
    pub(super) fn forget(&mut self) {
        self.forget_samples();
        self.solver.forget();
        if let Some(second) = &mut self.second {
            second.forget();
        }
    }

    /// That `other` can take the place of this planner in a running controller.
    pub(super) fn check_replacement(&self, other: &Self) -> Result<(), ControllerError> {
        let (shape, found) = (self.program.shape(), other.program.shape());
        if shape != found {
            return Err(ControllerError::OtherShape { shape, found });
        }
        let (expected_s, found_s) = (self.program.sample_time_s(), other.program.sample_time_s());
        if !same_sample_time(expected_s, found_s) {
            return Err(ControllerError::OtherSampleTime {
                expected_s,
                found_s,
            });
        }
        Ok(())
    }
}

fn ask(
    program: &mut dyn PredictiveProgram,
    solver: &mut dyn QpSolver,
    budget: &SolveBudget,
    step: &mut Step,
) -> QpStatus {
    if solver.update(program.vectors()).is_err() {
        return QpStatus::NumericalError;
    }
    program.accept(solver.solve(budget));
    let plan = program.plan();
    step.iterations = step.iterations.saturating_add(plan.iterations);
    match plan.status {
        // A solver that calls NaN a solution is broken, and must not reach the plant.
        status if status.is_usable() && !is_usable(plan) => QpStatus::NumericalError,
        // A status with a point that does not fit the program.
        QpStatus::NotRun => QpStatus::NumericalError,
        status => status,
    }
}

fn is_usable(plan: &Plan) -> bool {
    plan.is_usable()
        && plan.tracking.is_finite()
        && plan.inputs.is_all_finite()
        && plan.outputs.is_all_finite()
}

fn check_solver(
    program: &dyn PredictiveProgram,
    solver: &dyn QpSolver,
) -> Result<(), ControllerError> {
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
    Ok(())
}
