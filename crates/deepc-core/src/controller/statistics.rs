//! What all steps of a run had in common.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::step::{Fault, Origin, Step};
use super::time_histogram::TimeHistogram;
use crate::solver::QpStatus;

/// A struct with one counter per variant of an enum.
macro_rules! counters {
    ($(#[$doc:meta])* $name:ident of $kind:ident { $($variant:ident => $field:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $(
                #[doc = concat!("Steps with [`", stringify!($kind), "::", stringify!($variant), "`].")]
                pub $field: u64,
            )+
        }

        impl $name {
            /// The count of one kind.
            #[must_use]
            pub fn of(&self, kind: $kind) -> u64 {
                match kind {
                    $($kind::$variant => self.$field,)+
                }
            }

            fn add(&mut self, kind: $kind) {
                match kind {
                    $($kind::$variant => self.$field += 1,)+
                }
            }
        }

        /// The kinds that occurred, each with its count.
        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let counts = [$((stringify!($field), self.$field)),+];
                let mut separator = "";
                for (name, count) in counts.into_iter().filter(|&(_, count)| count > 0) {
                    write!(f, "{separator}{count} {}", Words(name))?;
                    separator = ", ";
                }
                if separator.is_empty() { f.write_str("none") } else { Ok(()) }
            }
        }
    };
}

counters! {
    /// Steps by where their input came from.
    OriginCounts of Origin {
        Passthrough => passthrough,
        Unconstrained => unconstrained,
        Solver => solver,
        SecondSolver => second_solver,
        Plan => plan,
        Fallback => fallback,
        Hold => hold,
        User => user,
    }
}

counters! {
    /// Steps by what went wrong in them.
    FaultCounts of Fault {
        MeasurementNotFinite => measurement_not_finite,
        MeasurementShape => measurement_shape,
        MeasurementLost => measurement_lost,
        MeasurementFrozen => measurement_frozen,
        WindowRefilling => window_refilling,
        DisturbanceNotFinite => disturbance_not_finite,
        ReferenceNotFinite => reference_not_finite,
        ReferenceShape => reference_shape,
        ScheduleNotFinite => schedule_not_finite,
        SolveFailed => solve_failed,
        DeadlineMissed => deadline_missed,
    }
}

counters! {
    /// Steps by how their plan ended.
    StatusCounts of QpStatus {
        NotRun => not_run,
        Solved => solved,
        Inaccurate => inaccurate,
        Infeasible => infeasible,
        Unbounded => unbounded,
        IterationLimit => iteration_limit,
        TimeLimit => time_limit,
        NumericalError => numerical_error,
        InvalidData => invalid_data,
    }
}

/// The name of a field in words.
struct Words(&'static str);

impl fmt::Display for Words {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, word) in self.0.split('_').enumerate() {
            let space = if i > 0 { " " } else { "" };
            write!(f, "{space}{word}")?;
        }
        Ok(())
    }
}

/// Counts and extremes over the steps since a controller was built or reset, kept without
/// allocation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepStatistics {
    /// Decisions.
    pub steps: u64,
    /// By where their input came from.
    pub origins: OriginCounts,
    /// By what went wrong in them; steps without fault are in none of these.
    pub faults: FaultCounts,
    /// By how the plan made in them ended ([`Step::status`]).
    pub statuses: StatusCounts,
    /// Times of the decisions in which a plan was made or tried ([`Step::solve_time`]).
    pub solve_times: TimeHistogram,
    /// Decisions that took longer than the deadline.
    pub deadline_misses: u64,
    /// Iterations of all solves.
    pub iterations: u64,
    /// Most iterations in one step.
    pub max_iterations: u32,
    /// Largest [`Step::predicted_violation`], in the output's units.
    pub largest_predicted_violation: f64,
    /// Largest [`Step::constraint_violation`], in the constraint's units.
    pub largest_constraint_violation: f64,
    /// Largest [`Step::residual`].
    pub largest_residual: f64,
    /// Steps in a row that fell back up to the last step.
    pub fallback_steps: u64,
    /// The longest such run.
    pub longest_fallback: u64,
    /// Steps decided with repaired samples in the past window.
    pub steps_with_repairs: u64,
}

impl StepStatistics {
    /// Adds a step.
    pub fn record(&mut self, step: &Step) {
        self.steps += 1;
        self.origins.add(step.origin);
        if let Some(fault) = step.fault {
            self.faults.add(fault);
        }
        self.statuses.add(step.status);
        if step.status != QpStatus::NotRun {
            self.solve_times.record(step.solve_time);
        }
        self.deadline_misses += u64::from(step.late);
        self.iterations += u64::from(step.iterations);
        self.max_iterations = self.max_iterations.max(step.iterations);
        // `max` passes over NaN.
        self.largest_predicted_violation = self
            .largest_predicted_violation
            .max(step.predicted_violation);
        self.largest_constraint_violation = self
            .largest_constraint_violation
            .max(step.constraint_violation);
        self.largest_residual = self.largest_residual.max(step.residual);
        self.fallback_steps = step.fallback_steps as u64;
        self.longest_fallback = self.longest_fallback.max(self.fallback_steps);
        self.steps_with_repairs += u64::from(step.repaired_samples > 0);
    }

    /// As if no step had been recorded; keeps the histogram's memory.
    pub fn reset(&mut self) {
        let Self {
            steps,
            origins,
            faults,
            statuses,
            solve_times,
            deadline_misses,
            iterations,
            max_iterations,
            largest_predicted_violation,
            largest_constraint_violation,
            largest_residual,
            fallback_steps,
            longest_fallback,
            steps_with_repairs,
        } = self;
        solve_times.clear();
        *origins = OriginCounts::default();
        *faults = FaultCounts::default();
        *statuses = StatusCounts::default();
        *max_iterations = 0;
        *largest_predicted_violation = 0.0;
        *largest_constraint_violation = 0.0;
        *largest_residual = 0.0;
        for count in [
            steps,
            deadline_misses,
            iterations,
            fallback_steps,
            longest_fallback,
            steps_with_repairs,
        ] {
            *count = 0;
        }
    }
}

impl fmt::Display for StepStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} steps: {}", self.steps, self.origins)?;
        writeln!(f, "faults: {}", self.faults)?;
        writeln!(f, "solves: {}", self.statuses)?;
        let times = &self.solve_times;
        if let (Some(min), Some(median), Some(p99), Some(max)) =
            (times.min(), times.median(), times.p99(), times.max())
        {
            writeln!(
                f,
                "solve time: min {min:.2?}, median {median:.2?}, p99 {p99:.2?}, max {max:.2?}"
            )?;
        }
        writeln!(
            f,
            "iterations: {} in all, {} at most; residual at most {:.1e}",
            self.iterations, self.max_iterations, self.largest_residual
        )?;
        writeln!(
            f,
            "predicted violation at most {:.3e} of output bounds, {:.3e} of affine and terminal \
             constraints",
            self.largest_predicted_violation, self.largest_constraint_violation
        )?;
        write!(
            f,
            "longest fallback {} steps, {} deadlines missed, {} steps with repaired samples",
            self.longest_fallback, self.deadline_misses, self.steps_with_repairs
        )
    }
}
