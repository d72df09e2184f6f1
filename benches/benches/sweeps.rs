//! Set-up and step when one size of the problem changes, condensed, with the active-set solver.

use std::hint::black_box;

use benches::backend::{self, ACTIVE_SET};
use benches::case::{Activity, Case};
use benches::replay::Replay;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use deepc_core::program::{CondensedProgram, Plan, PredictiveProgram};
use deepc_core::solver::SolveBudget;

const STEPS: usize = 50;

/// Sets one size of a case.
type Change = fn(&mut Case, usize);

fn set_up(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sweep: set-up");
    group.sample_size(10);
    for samples in [1000, 3200, 10_000, 100_000, 1_000_000] {
        let mut case = Case::paper(Activity::Some, 0.0);
        case.samples = samples;
        let data = case.data();
        group.bench_function(BenchmarkId::new("T", samples), |b| {
            b.iter(|| {
                let predictor = case.streamed_predictor(&data);
                CondensedProgram::new(&predictor, &case.settings())
            });
        });
    }
    group.finish();
}

fn step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sweep: 50 steps");
    group.sample_size(10);
    let changes: [(&str, &[usize], Change); 5] = [
        ("T", &[1000, 3200, 10_000], |case, value| {
            case.samples = value;
        }),
        ("T_ini", &[25, 50, 100], |case, value| {
            case.horizons.past = value;
        }),
        ("N", &[25, 50, 100], |case, value| {
            case.horizons.future = value;
        }),
        ("m", &[1, 2, 4], |case, value| {
            case.inputs = value;
        }),
        ("p", &[1, 2, 4], |case, value| {
            case.outputs = value;
        }),
    ];
    for (name, values, change) in changes {
        for &value in values {
            let mut case = Case::paper(Activity::Some, 0.0);
            change(&mut case, value);
            let predictor = case.streamed_predictor(&case.data());
            let program = CondensedProgram::new(&predictor, &case.settings());
            let mut program = program.expect("the settings are valid");
            let solver = backend::solver(ACTIVE_SET, program.qp(), 1e-9);
            let mut solver = solver.expect("the Hessian is positive definite");
            let replay = Replay::record(&case, &mut program, solver.as_mut(), STEPS);
            group.bench_function(BenchmarkId::new(name, value), |b| {
                b.iter(|| {
                    for k in 0..STEPS {
                        let moment = black_box(replay.moment(k));
                        let budget = SolveBudget::generous();
                        let plan = program.solve(&moment, solver.as_mut(), &budget);
                        assert!(plan.is_ok_and(Plan::is_usable));
                    }
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, set_up, step);
criterion_main!(benches);
