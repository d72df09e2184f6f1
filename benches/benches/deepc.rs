//! What `DeePC` costs at the paper's size: 600×3001, 2 inputs, 1 output, `T_ini` = N = 100.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons, PersistentlyExciting};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcProgram, DeepcSettings, Moment, Normalisation, OutputBounds,
    PlanOrigin, Regularisation, Slack,
};
use deepc_core::solver::{ActiveRows, ClarabelSettings, QpSolver, SolveBudget};
use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const SAMPLES: usize = 3200;
const HORIZONS: Horizons = Horizons {
    past: 100,
    future: 100,
};
/// Where the second input stands: a target speed in km/h, say.
const OFFSET: f64 = 100.0;

/// A well-damped oscillation driven by the first input and a little by the second, measured with
/// noise. The inputs are slow noise plus white noise.
fn recording(samples: usize) -> (Mat<f64>, Mat<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut slow, mut state) = (0.0, [0.0, 0.0]);
    let (mut inputs, mut outputs) = (Mat::zeros(samples, 2), Mat::zeros(samples, 1));
    for k in 0..samples {
        slow = 0.99 * slow + 5.0 * normal();
        let input = [slow + 5.0 * normal(), OFFSET + normal()];
        let drive = 4e-4 * input[0] + 1e-5 * (input[1] - OFFSET);
        state = [1.93 * state[0] - 0.94 * state[1] + drive, state[0]];
        inputs[(k, 0)] = input[0];
        inputs[(k, 1)] = input[1];
        outputs[(k, 0)] = state[0] + 1e-3 * normal();
    }
    (inputs, outputs)
}

fn exciting() -> PersistentlyExciting {
    let (inputs, outputs) = recording(SAMPLES);
    let mut data = Dataset::new(0.01, ["u1", "u2"], ["y"]).expect("the names differ");
    data.push_record(inputs, outputs)
        .expect("the record is finite");
    let hankel = HankelMatrix::build(&data, HORIZONS).expect("the record is long enough");
    hankel
        .require_persistently_exciting(8)
        .expect("white noise excites")
}

fn settings(limit: f64) -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![1.0, 5e-4],
        output_weights: vec![0.0],
        regularisation: Regularisation {
            lambda_g: 60.0,
            normalisation: Normalisation::PerColumn,
        },
        input_slack: Slack::Penalty(1e8),
        output_slack: Slack::Penalty(1e8),
        input_bounds: vec![Bounds::between(-200.0, 200.0), Bounds::between(90.0, 120.0)],
        output_bounds: vec![OutputBounds::soft(-limit, limit, 1e5, 1e6)],
    }
}

fn set_up(criterion: &mut Criterion) {
    let data = exciting();
    let mut group = criterion.benchmark_group("deepc set-up 600x3001");
    group.sample_size(10);
    group.bench_function("excitation report", |b| {
        b.iter(|| data.hankel().excitation(8));
    });
    group.bench_function("exact reduction", |b| b.iter(|| Predictor::exact(&data)));
    let full = Predictor::full(&data);
    group.bench_function("condensed program", |b| {
        b.iter(|| CondensedProgram::new(&full, &settings(1.0)));
    });
    let program = CondensedProgram::new(&full, &settings(1.0)).expect("the settings are valid");
    group.bench_function("active rows", |b| {
        b.iter(|| ActiveRows::new(program.qp(), ClarabelSettings::default()));
    });
    group.finish();
}

/// Steps through 100 consecutive moments of the recording, so that a warm start is worth what it
/// is in a control loop. A tight limit keeps rows active in nearly every step.
fn step(criterion: &mut Criterion) {
    let predictor = Predictor::exact(&exciting()).expect("the SVD converges");
    let (inputs, outputs) = recording(SAMPLES);
    let mut group = criterion.benchmark_group("deepc 100 steps, condensed");
    group.sample_size(20);
    for (name, limit) in [("no bound active", 1e3), ("some bounds active", 0.5)] {
        let program = CondensedProgram::new(&predictor, &settings(limit));
        let mut program = program.expect("the settings are valid");
        let solver = ActiveRows::new(program.qp(), ClarabelSettings::default());
        let mut solver = solver.expect("the Hessian is positive definite");
        let mut solved = 0_u32;
        let mut steps = 0_u32;
        group.bench_function(name, |b| {
            b.iter(|| {
                for k in 1500..1600 {
                    let hold = inputs[(k + HORIZONS.past, 0)];
                    let reference =
                        Mat::from_fn(
                            HORIZONS.future,
                            2,
                            |_, i| if i == 0 { hold } else { OFFSET },
                        );
                    let zero = Mat::zeros(HORIZONS.future, 1);
                    let moment = Moment {
                        past_inputs: inputs.subrows(k, HORIZONS.past),
                        past_outputs: outputs.subrows(k, HORIZONS.past),
                        input_reference: reference.as_ref(),
                        output_reference: zero.as_ref(),
                    };
                    let plan = program
                        .solve(
                            black_box(&moment),
                            &mut solver as &mut dyn QpSolver,
                            &SolveBudget::generous(),
                        )
                        .expect("the shapes fit");
                    assert!(plan.is_usable(), "{:?}", plan.status);
                    steps += 1;
                    solved += u32::from(plan.origin == PlanOrigin::Solver);
                }
            });
        });
        println!(
            "  {name}: the solver ran in {} % of the steps",
            100 * solved / steps.max(1)
        );
    }
    group.finish();
}

criterion_group!(benches, set_up, step);
criterion_main!(benches);
