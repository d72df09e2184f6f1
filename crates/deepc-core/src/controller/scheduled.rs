//! Several data sets, of which the one for the present operating point acts.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::Controller;
use super::error::ControllerError;
use super::fallback::FallbackContext;
use super::planner::Planner;
use super::receding_horizon::RecedingHorizonController;
use super::reference::Reference;
use super::settings::RecedingHorizonSettings;
use super::statistics::StepStatistics;
use super::step::{Fault, Step};
use crate::predictor::{Schedule, ScheduledPredictors};
use crate::program::DeepcSettings;

/// Which data set acts where: data set i in range i of the schedule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduleSettings {
    /// The ranges of the signal, as many as data sets.
    pub ranges: Schedule,
    /// Decisions a data set acts at least before another one may. The one to start with gives way at
    /// once when the signal is known for the first time.
    pub min_steps: usize,
    /// The data set that acts before the first sample, counted from 0.
    pub start: usize,
}

impl ScheduleSettings {
    /// Checks the ranges, for a number of data sets.
    ///
    /// # Errors
    /// Names what is out of range.
    pub fn check(&self, data_sets: usize) -> Result<(), ControllerError> {
        self.ranges.check().map_err(ControllerError::Schedule)?;
        let ranges = self.ranges.ranges();
        if ranges != data_sets {
            return Err(ControllerError::Ranges { data_sets, ranges });
        }
        if self.start >= data_sets {
            return Err(ControllerError::Start {
                found: self.start,
                data_sets,
            });
        }
        Ok(())
    }
}

/// What a schedule may look at.
#[derive(Debug, Clone, Copy)]
pub struct ScheduleContext<'a> {
    /// The input applied last, m values.
    pub input: &'a [f64],
    /// The disturbance measured last, q values.
    pub disturbance: &'a [f64],
    /// The output measured last (or repaired), p values.
    pub output: &'a [f64],
    /// What was given to [`ScheduledController::set_external_signal`] last.
    pub external: Option<f64>,
    /// The data set that acts.
    pub data_set: usize,
}

type Signal = Box<dyn FnMut(&ScheduleContext<'_>) -> f64 + Send>;

/// A [`RecedingHorizonController`] over several data sets, for a plant that one linear predictor cannot
/// hold: each program is built from data around one operating point, and the one for the present
/// point plans. The past window and the last plan are shared, so nothing starts anew at a switch.
/// [`Step::data_set`] says which one acted.
///
/// The signal is a function of the last sample. It must return what [`Schedule::signal`] names, the
/// channel by which [`Schedule::part`] divided the recording: nothing here can check that. It is
/// asked in every decision once a sample is known; NaN from it leaves the data set as it is and is
/// reported as [`Fault::ScheduleNotFinite`]. Between solves (`moves_per_solve` above 1) a switch
/// takes effect with the next solve.
///
/// ```
/// # use deepc_core::{controller::*, data::Dataset, hankel::*, predictor::*, program::*, solver::*};
/// # let mut data = Dataset::new(1.0, ["valve"], ["level"])?;
/// # for (gain, middle) in [(1.0, -2.0), (0.5, 2.0)] {
/// #     let (mut valve, mut level) = (Vec::new(), vec![middle]);
/// #     for k in 0..80_u32 {
/// #         valve.push(f64::from(k * k * 7 % 101) / 50.0 - 1.0);
/// #         let before: f64 = level[level.len() - 1];
/// #         level.push(middle + 0.4 * (before - middle) + gain * valve[valve.len() - 1]);
/// #     }
/// #     data.push_rows(&valve, &level[1..])?;
/// # }
/// # let settings = DeepcSettings::new(
/// #     &[0.1], &[1.0], Regularisation::per_column(1e-6), Slack::Penalty(1e6));
/// # let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
/// // `data`: a recording in which the output `level` stays a while on either side of 0.
/// let schedule = Schedule { signal: "level".into(), edges: vec![0.0], hysteresis: 0.1 };
/// let horizons = Horizons::new(2, 5);
/// let mut predictors = Vec::new();
/// for part in schedule.part(&data, horizons.window())? {
///     let exciting = HankelMatrix::build(&part, horizons)?.require_persistently_exciting(2)?;
///     predictors.push(Predictor::exact(&exciting)?);
/// }
/// let predictors = ScheduledPredictors::new(schedule, predictors)?;
/// let mut controller =
///     ScheduledController::from_predictors(&predictors, &settings, horizon, 3, |now| now.output[0])?;
/// controller.observe(&[0.0], &[2.0]);
/// let reference = controller.new_reference();
/// assert_eq!(controller.decide(&reference).data_set, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct ScheduledController {
    inner: RecedingHorizonController,
    settings: ScheduleSettings,
    signal: Signal,
    external: Option<f64>,
    active: usize,
    /// Decisions of the active data set since the signal was known for the first time.
    dwelt: usize,
}

impl ScheduledController {
    /// From programs of one shape and sample time, in the order of the schedule's ranges
    /// ([`Schedule::part`] gives their data).
    ///
    /// # Errors
    /// There is no program, they differ in shape or sample time, or a setting is out of range.
    pub fn new(
        planners: Vec<Planner>,
        horizon: RecedingHorizonSettings,
        schedule: ScheduleSettings,
        signal: impl FnMut(&ScheduleContext<'_>) -> f64 + Send + 'static,
    ) -> Result<Self, ControllerError> {
        schedule.check(planners.len())?;
        let mut planners = planners.into_iter();
        let first = planners.next().ok_or(ControllerError::Ranges {
            data_sets: 0,
            ranges: schedule.ranges.ranges(),
        })?;
        let mut inner = RecedingHorizonController::with_planner(first, horizon)?;
        for planner in planners {
            inner.add_planner(planner)?;
        }
        inner.activate(schedule.start);
        Ok(Self {
            inner,
            active: schedule.start,
            dwelt: 0,
            settings: schedule,
            signal: Box::new(signal),
            external: None,
        })
    }

    /// From one predictor per range: their condensed programs, all with the same settings, each with
    /// the back end for the control loop ([`Planner::condensed`]). The first one acts before the
    /// first sample. `min_steps` as in [`ScheduleSettings`].
    ///
    /// # Errors
    /// A setting is out of range, or data and weights do not make a program.
    pub fn from_predictors(
        predictors: &ScheduledPredictors,
        settings: &DeepcSettings,
        horizon: RecedingHorizonSettings,
        min_steps: usize,
        signal: impl FnMut(&ScheduleContext<'_>) -> f64 + Send + 'static,
    ) -> Result<Self, ControllerError> {
        let planners = predictors.predictors().iter();
        let planners = planners.map(|predictor| Planner::condensed(predictor, settings));
        let schedule = ScheduleSettings {
            ranges: predictors.schedule().clone(),
            min_steps,
            start: 0,
        };
        Self::new(
            planners.collect::<Result<_, _>>()?,
            horizon,
            schedule,
            signal,
        )
    }

    /// As [`RecedingHorizonController::with_user_fallback`].
    #[must_use]
    pub fn with_user_fallback(
        mut self,
        choose: impl FnMut(&FallbackContext<'_>, &mut [f64]) + Send + 'static,
    ) -> Self {
        self.inner = self.inner.with_user_fallback(choose);
        self
    }

    /// Sets [`ScheduleContext::external`], for a signal that is neither input nor output.
    pub fn set_external_signal(&mut self, signal: f64) {
        self.external = Some(signal);
    }

    /// The data set that acts, counted from 0.
    #[must_use]
    pub fn data_set(&self) -> usize {
        self.active
    }

    /// The last decision.
    #[must_use]
    pub fn step(&self) -> &Step {
        self.inner.step()
    }

    /// Counts and extremes of all steps since the start or the last reset.
    #[must_use]
    pub fn statistics(&self) -> &StepStatistics {
        self.inner.statistics()
    }

    /// Starts the statistics anew.
    pub fn reset_statistics(&mut self) {
        self.inner.reset_statistics();
    }

    /// Asks the signal and lets the data set for it act; what is wrong with the signal.
    fn schedule(&mut self) -> Option<Fault> {
        // 0: where it starts was a guess, which may be mended at once.
        let may_switch = self.dwelt == 0 || self.dwelt >= self.settings.min_steps;
        if self.dwelt > 0 {
            self.dwelt = self.dwelt.saturating_add(1);
        }
        let samples = self.inner.samples();
        let (input, output) = (samples.input()?, samples.output()?);
        let signal = (self.signal)(&ScheduleContext {
            input,
            disturbance: samples.disturbance(),
            output,
            external: self.external,
            data_set: self.active,
        });
        if signal.is_nan() {
            return Some(Fault::ScheduleNotFinite);
        }
        let chosen = self.settings.ranges.next(self.active, signal);
        self.dwelt = self.dwelt.max(1);
        if chosen != self.active && may_switch {
            self.active = chosen;
            // The decision being made is the first of the new one.
            self.dwelt = 1;
            self.inner.activate(chosen);
        }
        None
    }
}

impl Controller for ScheduledController {
    fn inputs(&self) -> usize {
        self.inner.inputs()
    }

    fn outputs(&self) -> usize {
        self.inner.outputs()
    }

    fn disturbances(&self) -> usize {
        self.inner.disturbances()
    }

    fn horizon(&self) -> usize {
        self.inner.horizon()
    }

    fn sample_time_s(&self) -> f64 {
        self.inner.sample_time_s()
    }

    fn decide(&mut self, reference: &Reference) -> &Step {
        let start = Instant::now();
        self.inner.note_lost_sample();
        let warning = self.schedule();
        self.inner.decide_from(start, reference, warning)
    }

    fn observe(&mut self, input: &[f64], output: &[f64]) {
        self.inner.observe(input, output);
    }

    fn observe_with_disturbances(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        self.inner
            .observe_with_disturbances(input, disturbance, output);
    }

    fn reset(&mut self) {
        self.inner.reset();
        self.external = None;
        self.dwelt = 0;
        self.active = self.settings.start;
        self.inner.activate(self.active);
    }
}
