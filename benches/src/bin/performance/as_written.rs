//! The problem as the papers write it, with all its variables: on the whole data matrix (full)
//! and on its exact reduction (rd, the original study's RD-DeePC).

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Result, anyhow};
use benches::backend::{self, ACTIVE_SET, ADMM, CLARABEL};
use benches::case::Case;
use benches::replay::{Replay, active_bounds};
use deepc_core::data::Dataset;
use deepc_core::predictor::Predictor;
use deepc_core::program::{PredictiveProgram, SparseProgram};
use deepc_core::solver::{QpSolver, SolveBudget};

use crate::condensed::{mean, median_time};
use crate::rows::{FULL, REDUCED, Row, Times};
use crate::run::Run;

/// Back ends are compared at this objective gap: each at the loosest tolerance that reaches it.
const EQUAL_ACCURACY: f64 = 1e-6;

/// Tolerances tried, the loosest first.
const TOLERANCES: [f64; 6] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

/// Accuracies asked of the reference optima, one after the other.
const REFERENCE_TOLERANCES: [f64; 4] = [1e-12, 1e-11, 1e-10, 1e-8];

/// A reference with this residual is good enough.
const GOOD_RESIDUAL: f64 = 1e-10;

/// The optimum of the full problem at one moment.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    pub moment: usize,
    objective: f64,
    /// Of its certificate.
    pub residual: f64,
}

impl Reference {
    /// Relative distance of another objective from it; infinite without one.
    pub fn gap(&self, objective: f64) -> f64 {
        let gap = (objective - self.objective).abs() / self.objective.abs();
        if gap.is_nan() { f64::INFINITY } else { gap }
    }
}

/// Solves the full problem as accurately as can be: Clarabel at its tightest, then with less asked
/// of it (what is out of its reach makes it give up), and keeps the best point.
pub fn references(
    run: &Run,
    case: &Case,
    data: &Dataset,
    replay: &Replay,
    moments: &[usize],
) -> Result<Vec<Reference>> {
    let predictor = case.full_predictor(data);
    let mut program = SparseProgram::new(&predictor, &case.settings())?;
    let mut references = Vec::new();
    for &moment in moments {
        let mut best: Option<Reference> = None;
        for tolerance in REFERENCE_TOLERANCES {
            run.check()?;
            run.stage(format!("{}: full optimum at step {moment}", case.name));
            let mut solver = backend::solver(CLARABEL, program.qp(), tolerance)?;
            let budget = SolveBudget::generous();
            let plan = program.solve(&replay.moment(moment), solver.as_mut(), &budget)?;
            let residual = plan.residual;
            let Some(objective) = program.objective() else {
                continue;
            };
            if best.is_none_or(|best| residual < best.residual) {
                best = Some(Reference {
                    moment,
                    objective,
                    residual,
                });
            }
            if residual <= GOOD_RESIDUAL {
                break;
            }
        }
        let missing = || anyhow!("{}, step {moment}: no reference optimum", case.name);
        references.push(best.ok_or_else(missing)?);
    }
    Ok(references)
}

/// Both forms with every back end made for them. Rows with the number of steps behind them.
pub fn measure(
    run: &Run,
    case: &Case,
    data: &Dataset,
    replay: &Replay,
    references: &[Reference],
) -> Result<Vec<(Row, usize)>> {
    let mut rows = Vec::new();
    // The full form needs the tolerance that the reduced one needed: it is tried first.
    let mut first_tolerance = BTreeMap::new();
    for formulation in [REDUCED, FULL] {
        let make = || -> Result<(SparseProgram, usize)> {
            let predictor: Predictor = if formulation == FULL {
                case.full_predictor(data)
            } else {
                case.reduced_predictor(data)
            };
            let columns = predictor.stacked().ncols();
            Ok((SparseProgram::new(&predictor, &case.settings())?, columns))
        };
        let (program_s, made) = median_time(1, make);
        let (mut program, columns) = made?;
        // The project's own solvers need a dense, positive definite Hessian.
        for name in backend::available()
            .into_iter()
            .filter(|name| ![ACTIVE_SET, ADMM].contains(name))
        {
            let mut found = None;
            let first = first_tolerance.get(name).copied().unwrap_or(0);
            for (index, tolerance) in TOLERANCES.into_iter().enumerate().skip(first) {
                let asked = Asked {
                    // Clarabel's steps are all alike.
                    warm_up: name != CLARABEL,
                    // Further steps of a tolerance that will not do are not worth their time.
                    stop_early: index + 1 < TOLERANCES.len(),
                    equalities: (case.inputs + case.outputs) * case.horizons.window(),
                };
                run.stage(format!(
                    "{}: {formulation}, {name}, {tolerance:e}",
                    case.name
                ));
                let start = Instant::now();
                let mut solver = backend::solver(name, program.qp(), tolerance)?;
                let solver_s = start.elapsed().as_secs_f64();
                let solver = solver.as_mut();
                let level = steps(run, &mut program, solver, replay, references, asked)?;
                let done = level.gap <= EQUAL_ACCURACY || level.spent;
                found = Some((level, solver_s));
                first_tolerance.insert(name, index);
                if done {
                    break;
                }
            }
            let Some((level, solver_s)) = found else {
                continue;
            };
            let summary = level.times.summary();
            let row = Row {
                problem: case.name.clone(),
                formulation,
                backend: name.to_owned(),
                columns,
                bounds_active: mean(&level.active),
                setup_ms: (program_s + solver_s) * 1e3,
                median_us: summary.median,
                p99_us: summary.p99,
                max_us: summary.max,
                objective_gap: Some(level.gap).filter(|gap| gap.is_finite()),
                bound_violation: Some(level.violation).filter(|v| v.is_finite()),
            };
            rows.push((row, level.times.len()));
        }
    }
    Ok(rows)
}

/// What a series of steps is for.
#[derive(Debug, Clone, Copy)]
struct Asked {
    /// Whether the step before the first reference is solved first, for a warm start.
    warm_up: bool,
    stop_early: bool,
    /// Rows before those of the bounds.
    equalities: usize,
}

/// Steps at one tolerance.
struct Level {
    times: Times,
    active: Vec<usize>,
    gap: f64,
    violation: f64,
    /// Whether a step spent its time: a tighter tolerance would, too.
    spent: bool,
}

/// Steps at the reference moments.
fn steps(
    run: &Run,
    program: &mut SparseProgram,
    solver: &mut dyn QpSolver,
    replay: &Replay,
    references: &[Reference],
    asked: Asked,
) -> Result<Level> {
    let mut level = Level {
        times: Times::default(),
        active: Vec::new(),
        gap: 0.0,
        violation: 0.0,
        spent: false,
    };
    let budget = SolveBudget {
        max_iterations: 1_000_000,
        max_time_s: run.extent().written_step_s,
    };
    if asked.warm_up {
        let before = references.first().map_or(0, |r| r.moment.saturating_sub(1));
        program.solve(&replay.moment(before), solver, &budget)?;
    }
    for reference in references.iter().take(run.extent().written_steps) {
        run.check()?;
        let moment = replay.moment(reference.moment);
        let start = Instant::now();
        let plan = program.solve(&moment, solver, &budget)?;
        let seconds = start.elapsed().as_secs_f64();
        level.times.push(seconds);
        level.violation = level.violation.max(plan.input_violation);
        let objective = program.objective().unwrap_or(f64::NAN);
        level.gap = level.gap.max(reference.gap(objective));
        level.active.push(active_bounds(solver, asked.equalities));
        if seconds >= budget.max_time_s {
            level.spent = true;
        }
        if asked.stop_early && level.gap > EQUAL_ACCURACY {
            break;
        }
    }
    Ok(level)
}
