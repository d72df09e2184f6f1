//! Programs made from seeded numbers, whose optimum is shown by its certificate.

use faer::Mat;

use super::{CorpusProblem, Draft, Expected, INF};
use crate::solver::{CscMatrix, QpMatrix, QpProblem, QpStatus, SoftPenalty};

/// Numbers spread over −1..1, the same for the same seed (`SplitMix64`; Steele, Lea, Flood 2014).
struct Spread(u64);

impl Spread {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| self.next())
    }
}

fn well_conditioned(n: usize, spread: &mut Spread) -> Mat<f64> {
    let root = spread.matrix(n, n);
    let product = &root * root.transpose();
    Mat::from_fn(n, n, |i, j| {
        0.5 * (product[(i, j)] + product[(j, i)]) + if i == j { 0.1 } else { 0.0 }
    })
}

/// 2n rows around a point that meets them all: boxes, soft rows of every kind, one equality.
pub(super) fn generated(name: &'static str, n: usize, seed: u64) -> CorpusProblem {
    let mut spread = Spread(seed);
    let hessian = well_conditioned(n, &mut spread);
    let linear: Vec<f64> = (0..n).map(|_| 10.0 * spread.next()).collect();
    let rows = spread.matrix(2 * n, n);
    let inside: Vec<f64> = (0..n).map(|_| 0.3 * spread.next()).collect();
    let mut bounds = Vec::new();
    let mut soft = Vec::new();
    for i in 0..2 * n {
        let value: f64 = (0..n).map(|j| rows[(i, j)] * inside[j]).sum();
        let room = 0.2 + 0.2 * spread.next().abs();
        bounds.push(match i % 7 {
            0 if i == 0 => (value, value),
            1 => (-INF, value + room),
            2 => (value - room, INF),
            _ => (value - room, value + room),
        });
        let penalty = |linear, quadratic| Some(SoftPenalty { linear, quadratic });
        soft.push(match i % 5 {
            1 => penalty(0.5, 0.0),
            2 => penalty(0.0, 3.0),
            3 => penalty(0.3, 2.0),
            _ => None,
        });
    }
    let mut draft = Draft::hard(name, hessian, &linear, rows, &bounds);
    draft.soft = soft;
    draft.expecting(Expected::Certified)
}

/// Step `step` of a program whose vectors move slowly while its matrices stay, as in a control
/// loop.
#[must_use]
pub fn moving_problem(step: u32) -> CorpusProblem {
    let n = 12;
    let mut case = generated("moving", n, 5);
    let phase = f64::from(step) * 0.15;
    for (i, value) in case.linear.iter_mut().enumerate() {
        *value *= 0.6 + (phase + i as f64).sin();
    }
    for (i, (lower, upper)) in case.lower.iter_mut().zip(&mut case.upper).enumerate() {
        let shift = 0.05 * (phase * 1.7 + i as f64).cos();
        *lower += shift;
        *upper += shift;
    }
    case
}

/// The programs that are hard in a way of their own.
pub(super) fn special() -> Vec<CorpusProblem> {
    let mut all = vec![
        at_bounds("nearly all of 50 variables at bounds", 50, 0.02),
        all_but_two_at_bounds(),
        corner(),
        dependent_rows(),
        hidden_contradiction(),
        too_many_equalities(),
        prices(),
    ];
    all.extend([
        rescaled("rows from 1e-6 to 1e6", 0, 6),
        rescaled("variables from 1e-6 to 1e6", 6, 0),
        rescaled("rows and variables from 1e-3 to 1e3", 3, 3),
    ]);
    all.extend(control_problem());
    all
}

/// Boxes so narrow that nearly every variable ends in a corner.
fn at_bounds(name: &'static str, n: usize, width: f64) -> CorpusProblem {
    let mut spread = Spread(11);
    let hessian = well_conditioned(n, &mut spread);
    let linear: Vec<f64> = (0..n).map(|_| 20.0 * spread.next()).collect();
    let bounds = vec![(-width, width); n];
    Draft::hard(name, hessian, &linear, Mat::identity(n, n), &bounds).expecting(Expected::Certified)
}

/// Made backwards from its optimum: q = −Px − μ with 198 multipliers that push outwards.
fn all_but_two_at_bounds() -> CorpusProblem {
    let n = 200;
    let mut spread = Spread(12);
    let hessian = well_conditioned(n, &mut spread);
    let side = |i: usize| if i.is_multiple_of(3) { -1.0 } else { 1.0 };
    let x: Vec<f64> = (0..n)
        .map(|i| if i < n - 2 { side(i) } else { 0.1 })
        .collect();
    let (mut linear, mut objective) = (Vec::new(), 0.0);
    for i in 0..n {
        let multiplier = side(i) * (1.0 + spread.next().abs());
        let bend: f64 = (0..n).map(|j| hessian[(i, j)] * x[j]).sum();
        linear.push(if i < n - 2 { -bend - multiplier } else { -bend });
        objective += x[i] * (0.5 * bend + linear[i]);
    }
    Draft::hard(
        "198 of 200 variables at bounds",
        hessian,
        &linear,
        Mat::identity(n, n),
        &vec![(-1.0, 1.0); n],
    )
    .at(&x, objective)
}

/// Sixteen rows that all pass through the optimum, in four dimensions.
fn corner() -> CorpusProblem {
    let mut spread = Spread(21);
    let hessian = well_conditioned(4, &mut spread);
    // Each row looks in the direction of a pull that all share.
    let rows = Mat::from_fn(16, 4, |_, _| 1.0 + 0.9 * spread.next());
    let corner = [0.5, -1.0, 0.25, 2.0];
    let bounds: Vec<(f64, f64)> = (0..16)
        .map(|i| (-INF, (0..4).map(|j| rows[(i, j)] * corner[j]).sum()))
        .collect();
    Draft::hard(
        "sixteen rows through one corner",
        hessian,
        &[-30.0; 4],
        rows,
        &bounds,
    )
    .expecting(Expected::Certified)
}

/// Twenty rows that span three dimensions of six, hard and soft.
fn dependent_rows() -> CorpusProblem {
    let mut spread = Spread(22);
    let hessian = well_conditioned(6, &mut spread);
    let basis = spread.matrix(3, 6);
    let rows = spread.matrix(20, 3) * basis;
    let linear: Vec<f64> = (0..6).map(|_| 10.0 * spread.next()).collect();
    let bounds: Vec<(f64, f64)> = (0..20).map(|i| (-0.1, 0.1 + 0.01 * f64::from(i))).collect();
    let mut draft = Draft::hard("twenty rows of rank three", hessian, &linear, rows, &bounds);
    for (i, soft) in draft.soft.iter_mut().enumerate() {
        let penalty = |linear, quadratic| Some(SoftPenalty { linear, quadratic });
        *soft = match i % 4 {
            0 => penalty(0.3, 0.0),
            1 => penalty(0.1, 5.0),
            _ => None,
        };
    }
    draft.expecting(Expected::Certified)
}

/// The mean of twelve variables must exceed what each of them may be.
fn hidden_contradiction() -> CorpusProblem {
    let n = 12;
    let mut spread = Spread(23);
    let hessian = well_conditioned(n, &mut spread);
    let rows = Mat::from_fn(n + 1, n, |i, j| {
        if i == n {
            1.0 / n as f64
        } else {
            f64::from(u8::from(i == j))
        }
    });
    let mut bounds = vec![(-1.0, 1.0); n];
    bounds.push((1.01, INF));
    Draft::hard(
        "a mean beyond its parts",
        hessian,
        &vec![0.5; n],
        rows,
        &bounds,
    )
    .ends(QpStatus::Infeasible)
}

/// Three equalities in the plane that do not meet.
fn too_many_equalities() -> CorpusProblem {
    Draft::hard(
        "three lines without a common point",
        Mat::identity(2, 2),
        &[1.0, 0.0],
        faer::mat![[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]],
        &[(1.0, 1.0), (1.0, 1.0), (3.0, 3.0)],
    )
    .ends(QpStatus::Infeasible)
}

/// Penalties from 1e-8 to 1e8 in one program.
fn prices() -> CorpusProblem {
    let mut case = generated("penalties from 1e-8 to 1e8", 10, 6);
    let soft = (0..20).map(|i| {
        let penalty = |linear, quadratic| Some(SoftPenalty { linear, quadratic });
        match i % 6 {
            1 => penalty(1e-8, 0.0),
            2 => penalty(0.0, 1e-8),
            3 => penalty(1e8, 1e8),
            4 => penalty(1e8, 0.0),
            5 => penalty(0.0, 1e8),
            _ => None,
        }
    });
    let (hessian, rows) = (case.problem.hessian(), case.problem.rows());
    case.problem = QpProblem::new(hessian.clone(), rows.clone(), soft.collect())
        .expect("the penalties are valid");
    case
}

/// The program of `generated` with 8 variables in other units: its optimal cost is the same.
fn rescaled(name: &'static str, variable_digits: i32, row_digits: i32) -> CorpusProblem {
    let mut case = generated(name, 8, 2);
    let unit = |i: usize, digits: i32| {
        // Spread evenly over 10^±digits.
        10_f64.powf(f64::from(digits) * ((i * 5 % 9) as f64 / 4.0 - 1.0))
    };
    let (hessian, rows) = (case.problem.hessian(), case.problem.rows());
    let (hessian, rows) = (hessian.to_dense(), rows.to_dense());
    let x = |j| unit(j, variable_digits);
    let y = |i| unit(i, row_digits);
    let hessian = Mat::from_fn(8, 8, |i, j| hessian[(i, j)] * x(i) * x(j));
    let rows = Mat::from_fn(16, 8, |i, j| rows[(i, j)] * y(i) * x(j));
    for (j, linear) in case.linear.iter_mut().enumerate() {
        *linear *= x(j);
    }
    for (i, (lower, upper)) in case.lower.iter_mut().zip(&mut case.upper).enumerate() {
        *lower *= y(i);
        *upper *= y(i);
    }
    let soft = case.problem.soft().iter().enumerate();
    let soft = soft.map(|(i, penalty)| {
        penalty.map(|penalty| SoftPenalty {
            linear: penalty.linear / y(i),
            quadratic: penalty.quadratic / y(i) / y(i),
        })
    });
    let soft = soft.collect();
    case.problem = QpProblem::new(QpMatrix::Dense(hessian), QpMatrix::Dense(rows), soft)
        .expect("the units are finite");
    case
}

/// A plant with two inputs and two states over eight steps, x(k+1) = F x(k) + B u(k), with bounds
/// on u and soft ones on x: with the states as variables tied by equalities (sparse), and with
/// the states written by the inputs (dense). Their optimal inputs are the same.
fn control_problem() -> [CorpusProblem; 2] {
    const STEPS: usize = 8;
    const F: [[f64; 2]; 2] = [[0.9, 0.3], [-0.2, 0.95]];
    const B: [[f64; 2]; 2] = [[0.5, 0.1], [-0.2, 0.4]];
    const WEIGHTS: [f64; 2] = [4.0, 1.0];
    const START: [f64; 2] = [2.0, -1.5];
    const EFFORT: f64 = 0.2;
    let n = 2 * STEPS;
    // Variables (u, x), each time-major; rows: dynamics, bounds of u, bounds of x.
    let mut hessian: Vec<_> = (0..n).map(|i| (i, i, EFFORT)).collect();
    hessian.extend((0..n).map(|i| (n + i, n + i, WEIGHTS[i % 2])));
    let mut rows: Vec<_> = (0..2 * n).map(|i| (n + i, i, 1.0)).collect();
    let (mut lower, mut upper) = (vec![0.0; n], vec![0.0; n]);
    // Response of x to u, and to the first state.
    let mut forced = Mat::<f64>::zeros(n, n);
    let mut free = START;
    let mut free_states = Vec::new();
    for k in 0..STEPS {
        free = [0, 1].map(|i| F[i][0] * free[0] + F[i][1] * free[1]);
        free_states.extend(free);
        for i in 0..2 {
            let row = 2 * k + i;
            rows.push((row, n + row, 1.0));
            for j in 0..2 {
                rows.push((row, 2 * k + j, -B[i][j]));
                forced[(row, 2 * k + j)] += B[i][j];
                if k > 0 {
                    rows.push((row, n + 2 * (k - 1) + j, -F[i][j]));
                    for column in 0..n {
                        let earlier = forced[(2 * (k - 1) + j, column)];
                        forced[(row, column)] += F[i][j] * earlier;
                    }
                } else {
                    lower[row] += F[i][j] * START[j];
                    upper[row] += F[i][j] * START[j];
                }
            }
        }
    }
    let penalty = SoftPenalty {
        linear: 3.0,
        quadratic: 10.0,
    };
    let mut soft = vec![None; 2 * n];
    soft.extend(vec![Some(penalty); n]);
    let sparse = QpProblem::new(
        QpMatrix::Sparse(csc(2 * n, 2 * n, hessian)),
        QpMatrix::Sparse(csc(3 * n, 2 * n, rows)),
        soft.clone(),
    );
    for (bound, side) in [(&mut lower, -1.0), (&mut upper, 1.0)] {
        bound.extend(vec![side * 1.2; n]);
        bound.extend(vec![side * 1.0; n]);
    }
    let sparse = CorpusProblem {
        name: "control, sparse form",
        semidefinite: false,
        problem: sparse.expect("the control problem is well formed"),
        linear: vec![0.0; 2 * n],
        lower: lower.clone(),
        upper: upper.clone(),
        expected: Expected::Certified,
    };

    let weighted = Mat::from_fn(n, n, |i, j| WEIGHTS[i % 2] * forced[(i, j)]);
    let product = forced.transpose() * &weighted;
    let hessian = Mat::from_fn(n, n, |i, j| {
        0.5 * (product[(i, j)] + product[(j, i)]) + if i == j { EFFORT } else { 0.0 }
    });
    let pull = |j| (0..n).map(|i| weighted[(i, j)] * free_states[i]).sum();
    let rows = Mat::from_fn(2 * n, n, |i, j| match i.checked_sub(n) {
        None => f64::from(u8::from(i == j)),
        Some(i) => forced[(i, j)],
    });
    let shift = |bounds: &[f64]| {
        let states = bounds[2 * n..].iter().zip(&free_states);
        let mut shifted = bounds[n..2 * n].to_vec();
        shifted.extend(states.map(|(bound, free)| bound - free));
        shifted
    };
    let dense = QpProblem::new(
        QpMatrix::Dense(hessian),
        QpMatrix::Dense(rows),
        soft[n..].to_vec(),
    );
    let dense = CorpusProblem {
        name: "control, dense form",
        semidefinite: false,
        problem: dense.expect("the control problem is well formed"),
        linear: (0..n).map(pull).collect(),
        lower: shift(&lower),
        upper: shift(&upper),
        expected: Expected::Certified,
    };
    [sparse, dense]
}

fn csc(rows: usize, columns: usize, triplets: Vec<(usize, usize, f64)>) -> CscMatrix {
    CscMatrix::from_triplets(rows, columns, triplets).expect("the triplets are in range")
}
