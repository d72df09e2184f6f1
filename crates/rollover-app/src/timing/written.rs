//! One data-driven problem at the moments, as the paper writes it and condensed.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    CondensedProgram, DeepcSettings, PlanOrigin, PredictiveProgram, SparseProgram,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, ClarabelSettings, ClarabelSolver, QpSolver, SolveBudget,
};

use super::moments::Past;
use super::{Follow, TimedForm, TimingError};
use crate::closed_loop::INPUTS;

/// Accuracy asked of the interior-point solver. First inputs then agree to 1e-6 as well, not only
/// optimal values, which are flat around the optimum; 1e-5 would save two of fourteen iterations.
const WRITTEN_TOLERANCE: f64 = 1e-9;

/// Accuracy asked of the condensed programs, whose optima are the reference.
const CONDENSED_TOLERANCE: f64 = 1e-9;

/// Duals below this share of the largest are those of bounds that do not push.
const PUSHES: f64 = 1e-6;

/// What the moments gave.
#[derive(Debug, Clone, Default)]
pub(super) struct AtMoments {
    /// Time of every solve, s.
    pub(super) times_s: Vec<f64>,
    /// Optimal values.
    pub(super) objectives: Vec<f64>,
    /// First moves.
    pub(super) inputs: Vec<[f64; INPUTS]>,
    /// Numbers of active bounds.
    pub(super) active: Vec<usize>,
}

/// Whose program it is, for messages.
#[derive(Clone, Copy)]
pub(super) struct Whose<'a> {
    pub(super) controller: &'a str,
    pub(super) form: TimedForm,
}

/// Solves the program as written at every moment, telling `step` before each.
pub(super) fn as_written(
    whose: Whose<'_>,
    (predictor, settings): &(Arc<Predictor>, DeepcSettings),
    moments: &[Past],
    follow: &mut Follow<'_>,
    step: &mut dyn FnMut(&mut Follow<'_>),
) -> Result<AtMoments> {
    let mut program = SparseProgram::new(predictor, settings)?;
    let clarabel = ClarabelSettings {
        tolerance: WRITTEN_TOLERANCE,
    };
    let mut solver = ClarabelSolver::new(program.qp(), clarabel)?;
    let equalities = predictor.stacked().nrows();
    solve_all(
        whose,
        &mut program,
        (&mut solver, equalities),
        moments,
        follow,
        step,
    )
}

/// Solves the condensed program at every moment.
pub(super) fn condensed(
    whose: Whose<'_>,
    (predictor, settings): &(Arc<Predictor>, DeepcSettings),
    moments: &[Past],
    follow: &mut Follow<'_>,
) -> Result<AtMoments> {
    let mut program = CondensedProgram::new(predictor, settings)?;
    let active_set = ActiveSetSettings {
        tolerance: CONDENSED_TOLERANCE,
    };
    let mut solver = ActiveSet::new(program.qp(), active_set)?;
    solve_all(
        whose,
        &mut program,
        (&mut solver, 0),
        moments,
        follow,
        &mut |_| {},
    )
}

fn solve_all(
    whose: Whose<'_>,
    program: &mut dyn PredictiveProgram,
    (solver, equalities): (&mut dyn QpSolver, usize),
    moments: &[Past],
    follow: &mut Follow<'_>,
    step: &mut dyn FnMut(&mut Follow<'_>),
) -> Result<AtMoments> {
    let mut found = AtMoments::default();
    for past in moments {
        step(follow);
        follow.interrupt.check(
            "while steps were timed",
            "the runs and their logs are complete",
        )?;
        let started = Instant::now();
        let plan = program.solve(&past.moment(), solver, &SolveBudget::generous())?;
        let seconds = started.elapsed().as_secs_f64();
        if !plan.is_usable() {
            return Err(TimingError::Unsolved {
                controller: whose.controller.to_owned(),
                form: whose.form.to_string(),
                time_s: past.time_s,
                status: format!("{:?}", plan.status),
                residual: plan.residual,
            }
            .into());
        }
        found.times_s.push(seconds);
        found
            .inputs
            .push(std::array::from_fn(|j| plan.inputs[(0, j)]));
        found.active.push(match plan.origin {
            PlanOrigin::Unconstrained => 0,
            PlanOrigin::Solver => active_bounds(solver, equalities),
        });
        found
            .objectives
            .push(program.objective().unwrap_or(f64::NAN));
    }
    Ok(found)
}

/// Bounds that push in the last solution; the `equalities` come before them.
fn active_bounds(solver: &dyn QpSolver, equalities: usize) -> usize {
    let dual = solver.solution().dual.get(equalities..).unwrap_or_default();
    let largest = dual.iter().fold(0.0_f64, |max, mu| max.max(mu.abs()));
    dual.iter().filter(|mu| mu.abs() > PUSHES * largest).count()
}
