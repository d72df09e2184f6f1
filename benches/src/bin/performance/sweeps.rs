//! What set-up and step cost when one size changes.

use std::process::Command;
use std::time::Instant;

use anyhow::{Result, ensure};
use benches::backend::{self, ACTIVE_SET};
use benches::case::{Activity, Case};
use benches::replay::{Replay, active_bounds};
use deepc_core::program::{CondensedProgram, PlanOrigin, PredictiveProgram};
use deepc_core::solver::SolveBudget;
use serde::Serialize;

use crate::condensed::mean;
use crate::machine::PeakMemory;
use crate::rows::Times;
use crate::run::Run;

/// Accuracy asked of the solver.
const TOLERANCE: f64 = 1e-9;

/// One size, condensed, with the active-set solver.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    /// Which size changes.
    pub sweep: &'static str,
    pub value: usize,
    pub columns: usize,
    pub bounds_active: f64,
    /// From the recording to a solver that is ready.
    pub setup_ms: f64,
    /// Memory that set-up needs beyond the recording, where it was asked for and the system tells
    /// it.
    pub setup_peak_mb: Option<f64>,
    pub median_us: f64,
    pub p99_us: f64,
    pub max_us: f64,
}

#[derive(Debug, Default)]
pub struct Sweeps {
    pub points: Vec<Point>,
}

/// The names of the sweeps.
pub const SAMPLES: &str = "T";
pub const PAST: &str = "T_ini";
pub const FUTURE: &str = "N";
pub const INPUTS: &str = "m";
pub const OUTPUTS: &str = "p";

/// Sets one size of a case.
type Change = fn(&mut Case, usize);

pub fn measure(run: &Run) -> Result<Sweeps> {
    let extent = *run.extent();
    let plan: [(&'static str, &[usize], Change); 5] = [
        (SAMPLES, extent.sweep_samples, |case, value| {
            case.samples = value;
        }),
        (PAST, extent.sweep_horizons, |case, value| {
            case.horizons.past = value;
        }),
        (FUTURE, extent.sweep_horizons, |case, value| {
            case.horizons.future = value;
        }),
        (INPUTS, extent.sweep_channels, |case, value| {
            case.inputs = value;
        }),
        (OUTPUTS, extent.sweep_channels, |case, value| {
            case.outputs = value;
        }),
    ];
    let mut sweeps = Sweeps::default();
    for (sweep, values, change) in plan {
        for &value in values {
            run.check()?;
            run.stage(format!("{sweep} = {value}"));
            let mut case = Case::paper(Activity::Some, 0.0);
            case.name = format!("{sweep} = {value}");
            change(&mut case, value);
            sweeps.points.push(point(run, &case, sweep, value)?);
        }
    }
    Ok(sweeps)
}

fn point(run: &Run, case: &Case, sweep: &'static str, value: usize) -> Result<Point> {
    let data = case.data();
    let start = Instant::now();
    let predictor = case.streamed_predictor(&data);
    let mut program = CondensedProgram::new(&predictor, &case.settings())?;
    let mut solver = backend::solver(ACTIVE_SET, program.qp(), TOLERANCE)?;
    let setup_ms = start.elapsed().as_secs_f64() * 1e3;
    let setup_peak_mb = if sweep == SAMPLES {
        asked_memory(value)?
    } else {
        None
    };
    drop(predictor);
    let steps = run.extent().sweep_steps + 1;
    let replay = Replay::record(case, &mut program, solver.as_mut(), steps);
    solver.forget();
    let (mut times, mut active) = (Times::default(), Vec::new());
    for k in 0..replay.len() {
        run.check()?;
        let moment = replay.moment(k);
        let start = Instant::now();
        let plan = program.solve(&moment, solver.as_mut(), &SolveBudget::generous())?;
        let seconds = start.elapsed().as_secs_f64();
        let solved = plan.origin == PlanOrigin::Solver;
        active.push(if solved {
            active_bounds(solver.as_ref(), 0)
        } else {
            0
        });
        // The first step is cold.
        if k > 0 {
            times.push(seconds);
        }
    }
    let summary = times.summary();
    Ok(Point {
        sweep,
        value,
        columns: case.columns(),
        bounds_active: mean(&active),
        setup_ms,
        setup_peak_mb,
        median_us: summary.median,
        p99_us: summary.p99,
        max_us: summary.max,
    })
}

/// The peak of set-up beyond the recording, in MB, in this process.
pub fn set_up_memory(samples: usize) -> Result<Option<f64>> {
    let case = Case {
        samples,
        ..Case::paper(Activity::Some, 0.0)
    };
    let data = case.data();
    let memory = PeakMemory::start();
    let predictor = case.streamed_predictor(&data);
    let program = CondensedProgram::new(&predictor, &case.settings())?;
    backend::solver(ACTIVE_SET, program.qp(), TOLERANCE)?;
    Ok(memory.and_then(|memory| memory.megabytes()))
}

/// The same in a process of its own.
fn asked_memory(samples: usize) -> Result<Option<f64>> {
    let asked = Command::new(std::env::current_exe()?)
        .args(["--set-up-of", &samples.to_string()])
        .output()?;
    ensure!(
        asked.status.success(),
        "set-up for {samples} samples: {}",
        asked.status
    );
    Ok(serde_json::from_slice(&asked.stdout)?)
}
