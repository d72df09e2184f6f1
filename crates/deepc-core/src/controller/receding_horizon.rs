//! The receding-horizon controller.

use std::time::Instant;

use faer::Mat;

use super::Controller;
use super::error::ControllerError;
use super::fallback::{Fallback, FallbackContext};
use super::planner::Planner;
use super::reference::Reference;
use super::samples::{Sample, Samples};
use super::settings::RecedingHorizonSettings;
use super::statistics::StepStatistics;
use super::step::{Fault, Origin, Step};
use crate::hankel::Shape;
use crate::predictor::Predictor;
use crate::program::{Bounds, DeepcSettings, MeasuredDisturbances, Moment, PredictiveProgram};
use crate::solver::QpSolver;

/// The receding-horizon controller as `DeePC`'s papers know it: [`RecedingHorizonController::condensed`]
/// builds it from data.
pub type DeepcController = RecedingHorizonController;

/// A predictive program, `DeePC` or on a model, in closed loop: past window → program vectors → unconstrained optimum or solver →
/// step.
///
/// | situation | input |
/// |---|---|
/// | past window not full for the first time yet | reference input |
/// | unconstrained optimum meets all bounds | its first move; no solver runs |
/// | otherwise | first move of the solver's plan |
/// | between solves (`moves_per_solve` > 1) | next move of the plan |
/// | solver failed | first move of the second solver's plan, if there is one |
/// | solve failed or discarded as late, sample NaN or lost, past window refilling after that, bad reference | as [`FallbackPolicy`](super::FallbackPolicy) says: next move of the last plan, the input applied last, or the user's choice |
///
/// Whatever it is, it is clipped to the hard bounds of the changes from the input applied last (if
/// one was) and then to those of the inputs, which win where both cannot be met.
///
/// A sample that is missing is replaced in the past window by what the last plan predicted for
/// it (a missing disturbance by the one before), and counted in [`Step::repaired_samples`] as long
/// as it stays there. Without a prediction, also because another input than the plan's was
/// decided or applied, the window has to fill again.
pub struct RecedingHorizonController {
    /// All of one shape and sample time; one acts.
    planners: Vec<Planner>,
    active: usize,
    settings: RecedingHorizonSettings,
    samples: Samples,
    fallback: Fallback,
    /// The disturbances expected where the reference does not say, N×q.
    held_disturbances: Mat<f64>,
    /// A decision was made and its sample not observed yet.
    awaits_sample: bool,
    /// Since it was built or reset.
    decisions: u64,
    statistics: StepStatistics,
    step: Step,
}

impl RecedingHorizonController {
    /// `DeePC` for the control loop: the condensed program of a predictor and the active-set back end.
    ///
    /// # Errors
    /// A setting is out of range, or data and weights do not make a program.
    pub fn condensed(
        predictor: &Predictor,
        settings: &DeepcSettings,
        horizon: RecedingHorizonSettings,
    ) -> Result<Self, ControllerError> {
        Self::with_planner(Planner::condensed(predictor, settings)?, horizon)
    }

    /// Puts a program and a solver set up with its [`PredictiveProgram::qp`] together.
    ///
    /// # Errors
    /// A setting is out of range, or the solver was set up for another program.
    pub fn new(
        program: Box<dyn PredictiveProgram>,
        solver: Box<dyn QpSolver>,
        settings: RecedingHorizonSettings,
    ) -> Result<Self, ControllerError> {
        Self::with_planner(Planner::new(program, solver)?, settings)
    }

    /// The same from a program and solvers that were put together before.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn with_planner(
        planner: Planner,
        settings: RecedingHorizonSettings,
    ) -> Result<Self, ControllerError> {
        let shape = planner.program().shape();
        let steps = shape.horizons.future;
        settings.check(steps)?;
        Ok(Self {
            samples: Samples::new(shape, settings.frozen_after),
            fallback: Fallback::new(settings.fallback, shape.inputs),
            held_disturbances: Mat::zeros(steps, shape.disturbances),
            awaits_sample: false,
            decisions: 0,
            statistics: StepStatistics::default(),
            step: Step::new(steps, shape.inputs, shape.outputs),
            planners: vec![planner],
            active: 0,
            settings,
        })
    }

    /// Adds a solver that is asked for the same plan when the first one fails, before the last
    /// plan is followed. Best one that always costs the same.
    ///
    /// # Errors
    /// It was set up for another program.
    pub fn with_second_solver(
        mut self,
        solver: Box<dyn QpSolver>,
    ) -> Result<Self, ControllerError> {
        self.planners[self.active].set_second_solver(solver)?;
        Ok(self)
    }

    /// Adds the user's own choice for when plan and hold are used up
    /// ([`FallbackPolicy`](super::FallbackPolicy)). It finds the input applied last in the slice
    /// of m values and may change it; what is not finite is replaced by the input applied last, and
    /// the result is clipped to the hard bounds of the inputs and their changes.
    ///
    /// It is asked within [`Controller::decide`]: it should be quick and must not panic. What it
    /// remembers is its own; [`Controller::reset`] does not reach it.
    #[must_use]
    pub fn with_user_fallback(
        mut self,
        choose: impl FnMut(&FallbackContext<'_>, &mut [f64]) + Send + 'static,
    ) -> Self {
        self.fallback.set_user(Box::new(choose));
        self
    }

    /// Takes another program and its solver from the next decision on, as for updated data, and
    /// returns those that acted so far. The past window and the last plan stay; a second solver
    /// belongs to its program and leaves with it.
    ///
    /// # Errors
    /// The program has another shape or sample time, or the solver was set up for another one;
    /// nothing changes then.
    pub fn switch_program(
        &mut self,
        program: Box<dyn PredictiveProgram>,
        solver: Box<dyn QpSolver>,
    ) -> Result<Planner, ControllerError> {
        self.switch_planner(Planner::new(program, solver)?)
    }

    /// [`Self::switch_program`] for a program and solvers that were put together before. Allocates
    /// nothing.
    ///
    /// # Errors
    /// The program has another shape or sample time; nothing changes then.
    pub fn switch_planner(&mut self, mut planner: Planner) -> Result<Planner, ControllerError> {
        let active = &mut self.planners[self.active];
        active.check_replacement(&planner)?;
        // What it may have observed before is another past.
        planner.forget_samples();
        Ok(std::mem::replace(active, planner))
    }

    /// The program, for its last plan and what it can recover.
    #[must_use]
    pub fn program(&self) -> &dyn PredictiveProgram {
        self.planners[self.active].program()
    }

    /// The last decision.
    #[must_use]
    pub fn step(&self) -> &Step {
        &self.step
    }

    /// Counts and extremes of all steps since the start or the last reset.
    #[must_use]
    pub fn statistics(&self) -> &StepStatistics {
        &self.statistics
    }

    /// Starts the statistics anew.
    pub fn reset_statistics(&mut self) {
        self.statistics.reset();
    }

    /// Outputs that stand still for longer than `frozen_after` allows.
    pub fn frozen_outputs(&self) -> impl Iterator<Item = usize> {
        self.samples.frozen()
    }

    /// Adds a program that can take over.
    pub(super) fn add_planner(&mut self, planner: Planner) -> Result<(), ControllerError> {
        self.planners[self.active].check_replacement(&planner)?;
        self.planners.push(planner);
        Ok(())
    }

    /// Lets another of the programs act; `index` must be below their number.
    pub(super) fn activate(&mut self, index: usize) {
        self.active = index;
    }

    pub(super) fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Two decisions without a sample between them: it is lost.
    pub(super) fn note_lost_sample(&mut self) {
        if std::mem::take(&mut self.awaits_sample) {
            let Step { input, plan, .. } = &mut self.step;
            self.samples.take_lost(input, plan);
            self.tell_planners();
        }
    }

    /// Passes the sample taken last on to all programs, also to those that do not act: they may have
    /// to, any time.
    fn tell_planners(&mut self) {
        for planner in &mut self.planners {
            match self.samples.newest() {
                Some(sample) => planner.observe(sample),
                None => planner.forget_samples(),
            }
        }
    }

    /// Decides; `start` is when the decision began and `warning` a fault that does not stop it.
    pub(super) fn decide_from(
        &mut self,
        start: Instant,
        reference: &Reference,
        warning: Option<Fault>,
    ) -> &Step {
        self.note_lost_sample();
        self.step.clear();
        self.step.data_set = self.active;
        let origin = self.choose(start, reference, warning);
        self.step.count_origin(origin);
        self.clip_input();
        self.step.repaired_samples = self.samples.window().repaired_samples();
        self.awaits_sample = true;
        self.decisions += 1;
        self.step.solve_time = start.elapsed();
        self.step.late = self.is_late(start);
        self.statistics.record(&self.step);
        &self.step
    }

    fn shape(&self) -> Shape {
        self.program().shape()
    }

    fn is_late(&self, start: Instant) -> bool {
        let deadline_s = self.settings.deadline_s.unwrap_or(f64::INFINITY);
        start.elapsed().as_secs_f64() > deadline_s
    }

    /// The gravest fault known before any plan is made.
    fn find_fault(&mut self, reference: &Reference, warning: Option<Fault>) -> Option<Fault> {
        let sample = self.samples.take_fault();
        let reference = if !reference.fits(&self.shape()) {
            Some(Fault::ReferenceShape)
        } else if !reference.is_finite() {
            Some(Fault::ReferenceNotFinite)
        } else {
            None
        };
        let refilling = self.samples.is_refilling();
        let window = refilling.then_some(Fault::WindowRefilling);
        let mut faults = [sample, reference, window, warning].into_iter().flatten();
        let first = faults.clone().next();
        faults.find(|fault| fault.stops_planning()).or(first)
    }

    /// Clips the input to the bounds of its change from the one applied last, then to its own.
    fn clip_input(&mut self) {
        let settings = self.planners[self.active].program().stage();
        if let Some(last) = self.samples.input() {
            let changes = settings.options.input_change_bounds.iter().zip(last);
            for (value, (change, last)) in self.step.input.iter_mut().zip(changes) {
                *value = within_reach(change, *last).clip(*value);
            }
        }
        for (value, bounds) in self.step.input.iter_mut().zip(&settings.input_bounds) {
            *value = bounds.clip(*value);
        }
    }

    /// Chooses the input; the caller clips it.
    fn choose(&mut self, start: Instant, reference: &Reference, warning: Option<Fault>) -> Origin {
        self.step.fault = self.find_fault(reference, warning);
        if let Some(age) = self.step.plan.row()
            && age > 0
            && age < self.settings.moves_per_solve
        {
            self.take_planned(age);
            return Origin::Plan;
        }
        if self.step.fault.is_some_and(Fault::stops_planning) {
            return self.fall_back(reference);
        }
        // Only before the window is full for the first time: later it is refilling, a fault.
        if !self.samples.window().is_full() {
            self.fallback.rearm();
            let first = reference.inputs().row(0).iter();
            let input = self.step.input.iter_mut();
            input.zip(first).for_each(|(u, r)| *u = *r);
            return Origin::Passthrough;
        }
        let planned = self.plan(reference);
        match planned {
            Some(origin) if !(self.settings.discard_late && self.is_late(start)) => {
                if origin == Origin::SecondSolver {
                    self.step.fault = Some(Fault::SolveFailed);
                }
                self.adopt_plan();
                origin
            }
            Some(_) => {
                self.step.fault = Some(Fault::DeadlineMissed);
                self.fall_back(reference)
            }
            None => {
                self.step.fault = Some(Fault::SolveFailed);
                self.fall_back(reference)
            }
        }
    }

    /// Makes a new plan from a full window.
    fn plan(&mut self, reference: &Reference) -> Option<Origin> {
        let window = self.samples.window();
        let preview = reference.disturbances();
        if preview.is_none() {
            for (channel, &value) in self.samples.disturbance().iter().enumerate() {
                self.held_disturbances.col_mut(channel).fill(value);
            }
        }
        let measured = MeasuredDisturbances {
            past: window.disturbances(),
            preview: preview.unwrap_or(self.held_disturbances.as_ref()),
        };
        let moment = Moment {
            past_inputs: window.inputs(),
            past_outputs: window.outputs(),
            input_reference: reference.inputs(),
            output_reference: reference.outputs(),
            disturbances: (self.held_disturbances.ncols() > 0).then_some(measured),
        };
        let budget = &self.settings.budget;
        let second_budget = self.settings.fallback.second_solver_budget;
        self.planners[self.active].plan(
            &moment,
            budget,
            second_budget.as_ref().unwrap_or(budget),
            &mut self.step,
        )
    }

    /// Keeps the program's plan and takes its first move.
    fn adopt_plan(&mut self) {
        let program = self.planners[self.active].program();
        let plan = program.plan();
        self.step.residual = plan.residual;
        self.step.tracking = Some(plan.tracking);
        self.step.plan.adopt(plan, &program.stage().input_bounds);
        self.fallback.rearm();
        self.take_planned(0);
    }

    fn fall_back(&mut self, reference: &Reference) -> Origin {
        if let Some(row) = self.fallback.plan_row(&self.step) {
            self.take_planned(row);
            return Origin::Fallback;
        }
        self.fallback
            .without_plan(self.decisions, &self.samples, reference, &mut self.step)
    }

    /// Takes a row of the last plan, and what remains of the plan as the prediction.
    fn take_planned(&mut self, row: usize) {
        let step = &mut self.step;
        step.plan_row = Some(row);
        step.constraint_violation = step.plan.constraint_violation;
        let planned = step.plan.inputs.row(row).iter();
        let input = step.input.iter_mut();
        input.zip(planned).for_each(|(u, planned)| *u = *planned);
        let outputs = step.predicted_outputs();
        let bounds = &self.planners[self.active].program().stage().output_bounds;
        let violations = bounds
            .iter()
            .zip(outputs.col_iter())
            .flat_map(|(output, y)| {
                let bounds: Bounds = output.bounds;
                y.iter().map(move |&value| bounds.violation(value))
            });
        step.predicted_violation = violations.fold(0.0, f64::max);
    }
}

/// Where an input may go that was `last` before. An end beyond the largest number is that number, so
/// that what is clipped stays finite.
fn within_reach(change: &Bounds, last: f64) -> Bounds {
    let end = |change: f64| (last + change).clamp(f64::MIN, f64::MAX);
    Bounds {
        lower: change.lower.map(end),
        upper: change.upper.map(end),
    }
}

impl Controller for RecedingHorizonController {
    fn inputs(&self) -> usize {
        self.shape().inputs
    }

    fn outputs(&self) -> usize {
        self.shape().outputs
    }

    fn disturbances(&self) -> usize {
        self.shape().disturbances
    }

    fn horizon(&self) -> usize {
        self.shape().horizons.future
    }

    fn sample_time_s(&self) -> f64 {
        self.program().sample_time_s()
    }

    fn decide(&mut self, reference: &Reference) -> &Step {
        self.decide_from(Instant::now(), reference, None)
    }

    fn observe(&mut self, input: &[f64], output: &[f64]) {
        self.observe_with_disturbances(input, &[], output);
    }

    fn observe_with_disturbances(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        let sample = Sample {
            input,
            disturbance,
            output,
        };
        let Step { input, plan, .. } = &mut self.step;
        let decided = std::mem::take(&mut self.awaits_sample).then_some(&input[..]);
        self.samples.take(sample, decided, plan);
        self.tell_planners();
    }

    fn reset(&mut self) {
        self.samples.clear();
        self.fallback.rearm();
        self.planners.iter_mut().for_each(Planner::forget);
        self.awaits_sample = false;
        self.decisions = 0;
        self.statistics.reset();
        self.step.reset();
    }
}
