//! What `DeePC` costs at the original study's size: 600×3001, 2 inputs, 1 output, `T_ini` = N = 100.

use std::hint::black_box;
use std::time::Duration;

use benches::backend::{self, ACTIVE_SET, ADMM, CLARABEL};
use benches::case::{Activity, Case};
use benches::replay::Replay;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use deepc_core::hankel::HankelMatrix;
use deepc_core::program::{CondensedProgram, Plan, PredictiveProgram, SparseProgram};
use deepc_core::solver::{QpSolver, SolveBudget};

/// Steps of one sample; consecutive, so that a warm start is worth what it is in control.
const STEPS: usize = 100;

const TOLERANCE: f64 = 1e-9;

fn set_up(criterion: &mut Criterion) {
    let case = Case::paper(Activity::Some, 0.0);
    let data = case.data();
    let mut group = criterion.benchmark_group("deepc set-up 600x3001");
    group.sample_size(10);
    group.bench_function("hankel matrix", |b| {
        b.iter(|| HankelMatrix::build(&data, case.horizons));
    });
    let hankel = HankelMatrix::build(&data, case.horizons).expect("the recording is long enough");
    group.bench_function("excitation report", |b| b.iter(|| hankel.excitation(8)));
    group.bench_function("exact reduction", |b| {
        b.iter(|| case.reduced_predictor(&data));
    });
    let full = case.full_predictor(&data);
    group.bench_function("condensed program", |b| {
        b.iter(|| CondensedProgram::new(&full, &case.settings()));
    });
    let program = CondensedProgram::new(&full, &case.settings()).expect("the settings are valid");
    group.bench_function("active-set", |b| {
        b.iter(|| backend::solver(ACTIVE_SET, program.qp(), TOLERANCE));
    });
    group.finish();
}

fn steps(
    program: &mut dyn PredictiveProgram,
    solver: &mut dyn QpSolver,
    replay: &Replay,
    range: std::ops::Range<usize>,
) {
    for k in range {
        let moment = black_box(replay.moment(k));
        let plan = program.solve(&moment, solver, &SolveBudget::generous());
        assert!(plan.is_ok_and(Plan::is_usable));
    }
}

fn condensed(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("deepc 100 steps, condensed");
    group.sample_size(20);
    for (name, activity) in [
        ("no bound active", Activity::None),
        ("some bounds active", Activity::Some),
        ("nearly all inputs at bounds", Activity::NearlyAll),
    ] {
        let case = Case::paper(activity, 0.0);
        let full = case.full_predictor(&case.data());
        let program = CondensedProgram::new(&full, &case.settings());
        let mut program = program.expect("the settings are valid");
        let solver = backend::solver(ACTIVE_SET, program.qp(), TOLERANCE);
        let mut solver = solver.expect("the Hessian is positive definite");
        let replay = Replay::record(&case, &mut program, solver.as_mut(), STEPS);
        group.bench_function(name, |b| {
            b.iter(|| steps(&mut program, solver.as_mut(), &replay, 0..STEPS));
        });
    }
    group.finish();
}

/// One step of every formulation and back end: a few samples each, because as written a step
/// takes seconds. The comparison at equal accuracy is the program `performance`'s.
fn formulations(criterion: &mut Criterion) {
    let case = Case::paper(Activity::Some, 0.0);
    let data = case.data();
    let (full, reduced) = (case.full_predictor(&data), case.reduced_predictor(&data));
    let settings = case.settings();
    let condensed = || CondensedProgram::new(&full, &settings).expect("the settings are valid");
    let mut program = condensed();
    let solver = backend::solver(ACTIVE_SET, program.qp(), TOLERANCE);
    let mut solver = solver.expect("the Hessian is positive definite");
    let replay = Replay::record(&case, &mut program, solver.as_mut(), STEPS);
    let written = |predictor| SparseProgram::new(predictor, &settings).expect("they are valid");
    let programs: [(&str, Box<dyn PredictiveProgram>); 3] = [
        ("condensed", Box::new(condensed())),
        ("rd", Box::new(written(&reduced))),
        ("full", Box::new(written(&full))),
    ];
    let mut group = criterion.benchmark_group("deepc one step");
    group.sample_size(10);
    group.warm_up_time(Duration::from_millis(500));
    group.measurement_time(Duration::from_secs(2));
    for (name, mut program) in programs {
        for backend in backend::available() {
            let dense = name == "condensed";
            // The project's own solvers need a dense Hessian; the full form as written takes minutes.
            let ours = [ACTIVE_SET, ADMM].contains(&backend);
            if (ours && !dense) || (name == "full" && backend == CLARABEL) {
                continue;
            }
            let solver = backend::solver(backend, program.qp(), 1e-6);
            let mut solver = solver.expect("the problem is convex");
            let mut k = 50;
            group.bench_function(BenchmarkId::new(name, backend), |b| {
                b.iter(|| {
                    steps(program.as_mut(), solver.as_mut(), &replay, k..k + 1);
                    k = if k + 1 < STEPS { k + 1 } else { 50 };
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, set_up, condensed, formulations);
criterion_main!(benches);
