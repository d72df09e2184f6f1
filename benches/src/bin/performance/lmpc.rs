//! The linear MPC on the moments of `DeePC`'s closed loop, with its own state estimate in place of the
//! past window.

use std::time::Instant;

use anyhow::Result;
use benches::backend::{self, ACTIVE_SET};
use benches::case::Case;
use benches::replay::{Replay, active_bounds};
use deepc_core::program::{PlanOrigin, PredictiveProgram};
use deepc_core::solver::SolveBudget;
use sysid::lmpc;

use crate::condensed::{TOLERANCE, mean, median_time};
use crate::rows::{LMPC, Row, Times};
use crate::run::Run;

/// The row, and its steps. Telling the observer a sample belongs to a step. There is no full problem
/// to compare the objective with.
pub fn measure(run: &Run, case: &Case, replay: &Replay) -> Result<(Row, usize)> {
    run.stage(format!("{}: {LMPC}", case.name));
    let (model, settings) = (case.model(), case.lmpc_settings());
    let set_up = || lmpc::program(&model, &settings, case.horizons.future);
    let (program_s, program) = median_time(run.extent().set_ups, set_up);
    let mut program = program?;
    let set_up = || backend::solver(ACTIVE_SET, program.qp(), TOLERANCE);
    let (solver_s, solver) = median_time(run.extent().set_ups, set_up);
    let mut solver = solver?;
    let columns = program.optimum_gain().ncols();
    let (mut times, mut active, mut violation) = (Times::default(), Vec::new(), 0.0_f64);
    let mut room = replay.room();
    for k in 0..replay.len() {
        run.check()?;
        let moment = replay.moment(k);
        let start = Instant::now();
        replay.tell(k, &mut program, &mut room);
        let plan = program.solve(&moment, solver.as_mut(), &SolveBudget::generous())?;
        let seconds = start.elapsed().as_secs_f64();
        // The first step is cold, and starts the observer.
        if k > 0 {
            times.push(seconds);
        }
        violation = violation.max(plan.input_violation);
        active.push(match plan.origin {
            PlanOrigin::Unconstrained => 0,
            PlanOrigin::Solver => active_bounds(solver.as_ref(), 0),
        });
    }
    let summary = times.summary();
    let row = Row {
        problem: case.name.clone(),
        formulation: LMPC,
        backend: ACTIVE_SET.to_owned(),
        columns,
        bounds_active: mean(&active),
        setup_ms: (program_s + solver_s) * 1e3,
        median_us: summary.median,
        p99_us: summary.p99,
        max_us: summary.max,
        objective_gap: None,
        bound_violation: Some(violation),
    };
    Ok((row, times.len()))
}
