//! What the real-time solvers cost on a program of 300 rows that is shaped like a condensed one:
//! P = 2I, q = 0, rows that are samples of smooth signals, bounds that move a little each step.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, CscMatrix, QpMatrix, QpProblem, QpSolver,
    QpVectors, SoftPenalty, SolveBudget,
};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::Solve;
use faer::{Col, Mat, Par, Side};

/// Samples of each of three signals: two inputs, interleaved, then an output.
const SAMPLES: usize = 100;
const SIZE: usize = 3 * SAMPLES;
/// Vectors computed beforehand and cycled through.
const STEPS: usize = 400;

fn is_output(row: usize) -> bool {
    row >= 2 * SAMPLES
}

fn is_first_input(row: usize) -> bool {
    !is_output(row) && row.is_multiple_of(2)
}

/// A slow input, a fast one, and the response of a damped oscillation to the slow one.
fn signals() -> Mat<f64> {
    let mut signals = Mat::<f64>::zeros(SIZE, SIZE);
    for k in 0..SAMPLES {
        for j in 0..=k {
            let slow = 0.3 * 0.99_f64.powi(i32::try_from(k - j).expect("few samples"));
            let fresh = f64::from(u8::from(k == j));
            signals[(2 * k, 2 * j)] = slow + 0.3 * fresh;
            signals[(2 * k + 1, 2 * j + 1)] = fresh;
            signals[(2 * SAMPLES + k, 2 * SAMPLES + j)] = 1e-3 * fresh;
        }
    }
    for column in 0..2 * SAMPLES {
        let mut state = [0.0, 0.0];
        for k in 0..SAMPLES {
            let drive = 0.01 * signals[(2 * k, column)];
            state = [1.93 * state[0] - 0.94 * state[1] + drive, state[0]];
            signals[(2 * SAMPLES + k, column)] = state[0];
        }
    }
    signals
}

struct Sequence {
    problem: QpProblem,
    linear: Vec<f64>,
    bounds: Vec<(Vec<f64>, Vec<f64>)>,
}

/// Bounds at the given fractions of what the signals reach without any; `shift` samples pass
/// between two steps.
fn sequence(input: f64, output: f64, soft: bool, shift: f64) -> Sequence {
    let signals = signals();
    let weights = |row: usize| match row {
        _ if is_output(row) => 0.5,
        _ if is_first_input(row) => 1.0,
        _ => 5e-4,
    };
    let weighted = Mat::from_fn(SIZE, SIZE, |i, j| weights(i) * signals[(i, j)]);
    let hessian = Mat::<f64>::identity(SIZE, SIZE) + signals.transpose() * &weighted;
    let factor = hessian.llt(Side::Lower).expect("the sum is definite");
    let mut rows = signals.transpose().to_owned();
    solve_lower_triangular_in_place(factor.L(), rows.as_mut(), Par::Seq);
    let rows = rows.transpose().to_owned();
    let gain = &signals * factor.solve(signals.transpose());
    let optimum = |time: f64| {
        let reference = Col::from_fn(SIZE, |i| {
            let at = |k: usize| k as f64 + time;
            if is_output(i) {
                weights(i) * 2.0 * (0.05 * at(i - 2 * SAMPLES)).sin()
            } else if is_first_input(i) {
                let t = at(i / 2);
                weights(i) * ((0.05 * t).sin() + 0.5 * (0.013 * t).cos())
            } else {
                0.0
            }
        });
        &gain * reference
    };
    let reach = |all: fn(usize) -> bool| {
        let first = optimum(0.0);
        (0..SIZE)
            .filter(|&i| all(i))
            .fold(0.0_f64, |max, i| max.max(first[i].abs()))
    };
    let limits = [input * reach(is_first_input), output * reach(is_output)];
    let limit = |i: usize| match i {
        _ if is_output(i) => limits[1],
        _ if is_first_input(i) => limits[0],
        _ => 5.0,
    };
    let penalty = SoftPenalty {
        linear: 100.0,
        quadratic: 1000.0,
    };
    let diagonal = (0..SIZE).map(|i| (i, i, 2.0)).collect();
    let hessian = CscMatrix::from_triplets(SIZE, SIZE, diagonal).expect("the places exist");
    let bounds = (0..STEPS).map(|step| {
        let optimum = optimum(shift * step as f64);
        let side = |sign: f64| (0..SIZE).map(|i| sign * limit(i) - optimum[i]).collect();
        (side(-1.0), side(1.0))
    });
    Sequence {
        bounds: bounds.collect(),
        linear: vec![0.0; SIZE],
        problem: QpProblem::new(
            QpMatrix::Sparse(hessian),
            QpMatrix::Dense(rows),
            (0..SIZE)
                .map(|i| (soft && is_output(i)).then_some(penalty))
                .collect(),
        )
        .expect("the program is well formed"),
    }
}

fn step(solver: &mut dyn QpSolver, sequence: &Sequence, index: usize, budget: &SolveBudget) {
    let (lower, upper) = &sequence.bounds[index];
    let vectors = QpVectors {
        linear: &sequence.linear,
        lower,
        upper,
    };
    solver.update(vectors).expect("the lengths fit");
    let solution = black_box(solver.solve(budget));
    assert!(solution.status.is_usable(), "{:?}", solution.status);
}

fn pushing_on_average(sequence: &Sequence) -> f64 {
    let mut solver = ActiveSet::new(&sequence.problem, ActiveSetSettings::default())
        .expect("the Hessian is positive definite");
    let mut count = 0;
    for index in 0..STEPS {
        step(&mut solver, sequence, index, &SolveBudget::generous());
        let dual = &solver.solution().dual;
        count += dual.iter().filter(|multiplier| **multiplier != 0.0).count();
    }
    count as f64 / STEPS as f64
}

fn solvers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("300 rows, one step");
    group.sample_size(30);
    let generous = SolveBudget::generous();
    for (name, input, output, soft) in [
        ("nothing active", 10.0, 10.0, false),
        ("soft outputs", 0.8, 0.7, true),
        ("hard bounds", 0.8, 0.9, false),
        ("tight hard bounds", 0.6, 0.8, false),
    ] {
        let sequence = sequence(input, output, soft, 0.2);
        let label = format!("{name}, {:.0} rows push", pushing_on_average(&sequence));
        let problem = &sequence.problem;
        let mut active = ActiveSet::new(problem, ActiveSetSettings::default())
            .expect("the Hessian is positive definite");
        let mut index = 0;
        group.bench_function(BenchmarkId::new("active-set warm", &label), |b| {
            b.iter(|| {
                step(&mut active, &sequence, index, &generous);
                index = (index + 1) % STEPS;
            });
        });
        group.bench_function(BenchmarkId::new("active-set cold", &label), |b| {
            b.iter(|| {
                active.forget();
                step(&mut active, &sequence, index, &generous);
                index = (index + 1) % STEPS;
            });
        });
        let mut admm =
            Admm::new(problem, AdmmSettings::default()).expect("the Hessian is positive definite");
        group.bench_function(BenchmarkId::new("admm warm", &label), |b| {
            b.iter(|| {
                step(&mut admm, &sequence, index, &generous);
                index = (index + 1) % STEPS;
            });
        });
    }
    group.finish();
}

criterion_group!(benches, solvers);
criterion_main!(benches);
