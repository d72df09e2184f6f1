//! What the linear MPC costs at the original study's size, on the moments of `DeePC`'s closed loop.

use std::hint::black_box;

use benches::backend::{self, ACTIVE_SET};
use benches::case::{Activity, Case};
use benches::replay::Replay;
use criterion::{Criterion, criterion_group, criterion_main};
use deepc_core::program::{CondensedProgram, Plan, PredictiveProgram};
use deepc_core::solver::SolveBudget;
use sysid::lmpc;

const STEPS: usize = 100;

const TOLERANCE: f64 = 1e-9;

fn set_up(criterion: &mut Criterion) {
    let case = Case::paper(Activity::Some, 0.0);
    let (model, settings) = (case.model(), case.lmpc_settings());
    let mut group = criterion.benchmark_group("lmpc set-up, horizon 100");
    group.sample_size(10);
    group.bench_function("program", |b| {
        b.iter(|| lmpc::program(&model, &settings, case.horizons.future));
    });
    group.finish();
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lmpc 100 steps");
    group.sample_size(20);
    for (activity, output_weight) in [
        (Activity::None, 0.0),
        (Activity::Some, 0.0),
        (Activity::Some, 10.0),
        (Activity::NearlyAll, 0.0),
    ] {
        let case = Case::paper(activity, output_weight);
        let predictor = case.full_predictor(&case.data());
        let deepc = CondensedProgram::new(&predictor, &case.settings());
        let mut deepc = deepc.expect("the settings are valid");
        let solver = backend::solver(ACTIVE_SET, deepc.qp(), TOLERANCE);
        let mut solver = solver.expect("the Hessian is positive definite");
        let replay = Replay::record(&case, &mut deepc, solver.as_mut(), STEPS);
        let (model, settings) = (case.model(), case.lmpc_settings());
        let program = lmpc::program(&model, &settings, case.horizons.future);
        let mut program = program.expect("the model is stable");
        let solver = backend::solver(ACTIVE_SET, program.qp(), TOLERANCE);
        let mut solver = solver.expect("the Hessian is positive definite");
        let mut room = replay.room();
        group.bench_function(&case.name, |b| {
            b.iter(|| {
                program.forget();
                for k in 0..STEPS {
                    replay.tell(k, &mut program, &mut room);
                    let moment = black_box(replay.moment(k));
                    let budget = SolveBudget::generous();
                    let plan = program.solve(&moment, solver.as_mut(), &budget);
                    assert!(plan.is_ok_and(Plan::is_usable));
                }
            });
        });
    }
    group.finish();
}

criterion_group!(benches, set_up, steps);
criterion_main!(benches);
