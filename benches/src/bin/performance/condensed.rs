//! One problem, condensed, with every back end, step after step of a closed loop.

use std::time::Instant;

use anyhow::Result;
use benches::backend::{self, ACTIVE_SET};
use benches::case::Case;
use benches::replay::{Replay, active_bounds};
use deepc_core::data::Dataset;
use deepc_core::program::{CondensedProgram, PlanOrigin, PredictiveProgram};
use deepc_core::solver::{QpSolver, SolveBudget};

use crate::as_written::{self, Reference};
use crate::bandwidth::BareProduct;
use crate::lmpc;
use crate::rows::{CONDENSED, PRODUCT, Row, Times};
use crate::run::Run;

/// Steps that one back end takes in a row. In between the others take theirs, so that a change
/// of the machine's mood hits all alike, and caches still are as in a loop of their own.
const BLOCK: usize = 100;

/// Moments from which those of the reference optima are chosen. Later the objective, which takes
/// products with matrices a step does not touch, is not asked for.
const REFERENCE_MOMENTS: usize = 100;

/// Accuracy asked of the condensed solvers.
pub const TOLERANCE: f64 = 1e-9;

/// What one case gave.
pub struct CaseResult {
    pub name: String,
    pub rows: Vec<Row>,
    /// Steps of every row.
    pub steps: Vec<usize>,
    /// Bytes of the bare product's matrix.
    pub product_bytes: usize,
    /// Relative residual of the reference optima.
    pub reference_residual: f64,
}

/// One back end on its way through the moments.
struct Track {
    name: &'static str,
    solver: Box<dyn QpSolver>,
    setup_ms: f64,
    times: Times,
    objectives: Vec<f64>,
    active: Vec<usize>,
    violation: f64,
}

impl Track {
    fn row(&self, case: &Case, references: &[Reference]) -> Row {
        let summary = self.times.summary();
        let gaps = references.iter().filter_map(|reference| {
            self.objectives
                .get(reference.moment)
                .map(|found| reference.gap(*found))
        });
        Row {
            problem: case.name.clone(),
            formulation: CONDENSED,
            backend: self.name.to_owned(),
            columns: case.columns(),
            bounds_active: mean(&self.active),
            setup_ms: self.setup_ms,
            median_us: summary.median,
            p99_us: summary.p99,
            max_us: summary.max,
            objective_gap: gaps.reduce(f64::max).filter(|gap| gap.is_finite()),
            bound_violation: Some(self.violation).filter(|violation| violation.is_finite()),
        }
    }
}

pub fn mean(counts: &[usize]) -> f64 {
    counts.iter().sum::<usize>() as f64 / counts.len().max(1) as f64
}

/// Median seconds of `count` runs of `work`, and what the last one made.
pub fn median_time<T>(count: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let mut times = Vec::new();
    loop {
        let start = Instant::now();
        let made = work();
        times.push(start.elapsed().as_secs_f64());
        if times.len() >= count {
            times.sort_by(f64::total_cmp);
            return (times[times.len() / 2], made);
        }
    }
}

fn condensed(case: &Case, data: &Dataset) -> Result<CondensedProgram> {
    Ok(CondensedProgram::new(
        &case.full_predictor(data),
        &case.settings(),
    )?)
}

pub fn measure(run: &Run, case: &Case, with_written: bool) -> Result<CaseResult> {
    run.stage(format!("{}: set-up", case.name));
    let extent = run.extent();
    let data = case.data();
    let (program_s, program) = median_time(extent.set_ups, || condensed(case, &data));
    let mut program = program?;
    let mut tracks = Vec::new();
    for name in backend::available() {
        let set_up = || backend::solver(name, program.qp(), TOLERANCE);
        let (solver_s, solver) = median_time(extent.set_ups, set_up);
        tracks.push(Track {
            name,
            solver: solver?,
            setup_ms: (program_s + solver_s) * 1e3,
            times: Times::default(),
            objectives: Vec::new(),
            active: Vec::new(),
            violation: 0.0,
        });
    }
    run.stage(format!("{}: closed loop", case.name));
    let mut recorder = backend::solver(ACTIVE_SET, program.qp(), TOLERANCE)?;
    let replay = Replay::record(case, &mut program, recorder.as_mut(), extent.steps + 1);
    let count = extent.references.max(extent.written_steps);
    let moments = reference_moments(replay.active(), count);
    let last_reference = moments.last().copied().unwrap_or(0);
    let mut product = BareProduct::new(case.future_rows(), case.known_rows());
    let mut product_times = Times::default();
    let mut first = 0;
    while first < replay.len() {
        let block = first..(first + BLOCK).min(replay.len());
        run.stage(format!("{}: condensed, step {first}", case.name));
        for _ in block.clone() {
            product_times.push(product.time());
        }
        for track in &mut tracks {
            for k in block.clone() {
                run.check()?;
                if k > last_reference && track.times.total_s() > extent.backend_s {
                    break;
                }
                step(track, &mut program, &replay, k)?;
            }
        }
        first = block.end;
    }
    let references = as_written::references(run, case, &data, &replay, &moments)?;
    let mut rows: Vec<Row> = tracks
        .iter()
        .map(|track| track.row(case, &references))
        .collect();
    let mut steps: Vec<usize> = tracks.iter().map(|track| track.times.len()).collect();
    let (row, count) = lmpc::measure(run, case, &replay)?;
    rows.push(row);
    steps.push(count);
    rows.push(product_row(case, &product, &product_times));
    steps.push(product_times.len());
    if with_written {
        let written = as_written::measure(run, case, &data, &replay, &references)?;
        steps.extend(written.iter().map(|(_, steps)| steps));
        rows.extend(written.into_iter().map(|(row, _)| row));
    }
    Ok(CaseResult {
        name: case.name.clone(),
        rows,
        steps,
        product_bytes: product.bytes(),
        reference_residual: references.iter().map(|r| r.residual).fold(0.0, f64::max),
    })
}

fn step(
    track: &mut Track,
    program: &mut CondensedProgram,
    replay: &Replay,
    k: usize,
) -> Result<()> {
    let moment = replay.moment(k);
    let start = Instant::now();
    let plan = program.solve(&moment, track.solver.as_mut(), &SolveBudget::generous())?;
    let seconds = start.elapsed().as_secs_f64();
    // The first step is cold.
    if k > 0 {
        track.times.push(seconds);
    }
    track.violation = track.violation.max(plan.input_violation);
    let origin = plan.origin;
    if k < REFERENCE_MOMENTS {
        track
            .objectives
            .push(program.objective().unwrap_or(f64::NAN));
    }
    track.active.push(match origin {
        PlanOrigin::Unconstrained => 0,
        PlanOrigin::Solver => active_bounds(track.solver.as_ref(), 0),
    });
    Ok(())
}

/// Consecutive moments with about as many bounds active as in the mean, early enough for slow
/// back ends to have come by.
fn reference_moments(active: &[usize], count: usize) -> Vec<usize> {
    let typical = mean(active);
    let window = active.len().min(REFERENCE_MOMENTS).saturating_sub(count);
    let distance = |k: &usize| {
        let worst = active[*k..*k + count]
            .iter()
            .map(|a| (*a as f64 - typical).abs());
        worst.fold(0.0, f64::max)
    };
    let first = (1..window)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(1);
    (first..first + count).collect()
}

fn product_row(case: &Case, product: &BareProduct, times: &Times) -> Row {
    let summary = times.summary();
    Row {
        problem: case.name.clone(),
        formulation: PRODUCT,
        backend: "faer".to_owned(),
        columns: product.columns(),
        bounds_active: 0.0,
        setup_ms: 0.0,
        median_us: summary.median,
        p99_us: summary.p99,
        max_us: summary.max,
        objective_gap: Some(0.0),
        bound_violation: Some(0.0),
    }
}
