//! Random programs over many steps: the active set warm, cold and against Clarabel. Every point
//! is judged by its own certificate, never by a status.

use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, Certificate, ClarabelSettings,
    ClarabelSolver, CscMatrix, QpMatrix, QpProblem, QpSolver, QpStatus, QpVectors, SoftPenalty,
    SolveBudget, certify,
};
use faer::Mat;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const INF: f64 = f64::INFINITY;

/// What one random program looks like.
#[derive(Debug, Clone)]
struct Shape {
    seed: u64,
    variables: usize,
    rows: usize,
    /// Whether P is 2I, given sparse, and q = 0.
    white: bool,
    /// Share of neighbours in each other: 0 for independent rows, near 1 for a smooth signal.
    smooth: f64,
    /// Whether some rows repeat or add up others.
    dependent: bool,
    /// Share of the rows that are soft.
    soft: f64,
    /// Decades that units of rows and penalties are spread over.
    decades: f64,
    width: f64,
}

fn shapes() -> impl Strategy<Value = Shape> {
    let sizes = (1_usize..14, 1_usize..36);
    let kinds = (any::<bool>(), any::<bool>(), 0..3_usize, 0..3_usize);
    (any::<u64>(), sizes, kinds, 0.0..3.0, 0.05..1.0).prop_map(
        |(seed, (variables, rows), (white, dependent, smooth, soft), decades, width)| Shape {
            seed,
            variables,
            rows,
            white,
            smooth: [0.0, 0.7, 0.99][smooth],
            dependent,
            soft: [0.0, 0.6, 1.0][soft],
            decades,
            width,
        },
    )
}

/// A program, and vectors that move smoothly with time.
struct Case {
    problem: QpProblem,
    linear: Vec<f64>,
    centre: Vec<f64>,
    sway: Vec<f64>,
    room: Vec<(f64, f64)>,
}

#[derive(Debug, Clone)]
struct Vectors {
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Vectors {
    fn view(&self) -> QpVectors<'_> {
        QpVectors {
            linear: &self.linear,
            lower: &self.lower,
            upper: &self.upper,
        }
    }
}

impl Case {
    fn new(shape: &Shape) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(shape.seed);
        let (n, r) = (shape.variables, shape.rows);
        let mut rows = Mat::<f64>::zeros(r, n);
        for i in 0..r {
            for j in 0..n {
                let fresh: f64 = rng.sample(StandardNormal);
                let before = if i > 0 { rows[(i - 1, j)] } else { fresh };
                rows[(i, j)] = shape.smooth * before + (1.0 - shape.smooth) * fresh;
            }
        }
        if shape.dependent {
            for i in (4..r).step_by(5) {
                for j in 0..n {
                    rows[(i, j)] = rows[(i - 2, j)] - 0.5 * rows[(i - 3, j)];
                }
            }
        }
        // Units are powers of ten spread over the rows.
        let unit: Vec<f64> = (0..r)
            .map(|_| 10_f64.powf(shape.decades * rng.random_range(-1.0..1.0)))
            .collect();
        let soft = (0..r).map(|i| {
            if rng.random_range(0.0..1.0) >= shape.soft {
                return None;
            }
            let price = 10_f64.powf(shape.decades * rng.random_range(-1.0..1.0));
            Some(match rng.random_range(0..3) {
                0 => SoftPenalty {
                    linear: price / unit[i],
                    quadratic: 0.0,
                },
                1 => SoftPenalty {
                    linear: 0.0,
                    quadratic: price / unit[i] / unit[i],
                },
                _ => SoftPenalty {
                    linear: price / unit[i],
                    quadratic: price / unit[i] / unit[i],
                },
            })
        });
        let soft: Vec<_> = soft.collect();
        for i in 0..r {
            for j in 0..n {
                rows[(i, j)] *= unit[i];
            }
        }
        let hessian = if shape.white {
            let diagonal = (0..n).map(|i| (i, i, 2.0)).collect();
            QpMatrix::Sparse(CscMatrix::from_triplets(n, n, diagonal).unwrap())
        } else {
            let root = Mat::<f64>::from_fn(n, n, |_, _| rng.sample(StandardNormal));
            let product = &root * root.transpose();
            QpMatrix::Dense(Mat::from_fn(n, n, |i, j| {
                0.5 * (product[(i, j)] + product[(j, i)]) + if i == j { 0.1 } else { 0.0 }
            }))
        };
        let mut normal = || -> f64 { rng.sample(StandardNormal) };
        let linear = (0..n)
            .map(|_| if shape.white { 0.0 } else { 3.0 * normal() })
            .collect();
        let centre = (0..r).map(|i| normal() * unit[i]).collect();
        let sway = (0..r).map(|i| 0.4 * normal() * unit[i]).collect();
        let room = (0..r).map(|i| {
            let width = shape.width * unit[i];
            match rng.random_range(0..8) {
                0 => (INF, width),
                1 => (width, INF),
                // Equalities, few enough to leave room.
                2 if i % 7 == 0 => (0.0, 0.0),
                _ => (width, width),
            }
        });
        Self {
            room: room.collect(),
            problem: QpProblem::new(hessian, QpMatrix::Dense(rows), soft).unwrap(),
            linear,
            centre,
            sway,
        }
    }

    fn at(&self, step: u32) -> Vectors {
        let phase = 0.1 * f64::from(step);
        let middle = |i: usize| self.centre[i] + self.sway[i] * (phase + i as f64).sin();
        let r = self.room.len();
        Vectors {
            linear: self
                .linear
                .iter()
                .map(|q| q * (1.0 + 0.2 * phase.sin()))
                .collect(),
            lower: (0..r).map(|i| middle(i) - self.room[i].0).collect(),
            upper: (0..r).map(|i| middle(i) + self.room[i].1).collect(),
        }
    }
}

fn solve(solver: &mut dyn QpSolver, vectors: &Vectors) -> (QpStatus, Option<Certificate>) {
    solver.update(vectors.view()).unwrap();
    let solution = solver.solve(&SolveBudget::generous());
    let point = solution.status.is_usable().then(|| {
        let found = certify(
            solver.problem(),
            &vectors.view(),
            &solver.solution().primal,
            &solver.solution().dual,
        );
        let told = solver.solution().certificate;
        assert!(
            (found.relative - told.relative).abs() <= 1e-9,
            "told {told:?}, found {found:?}"
        );
        found
    });
    (solver.solution().status, point)
}

/// Objectives agree to 1e-9, or to what the two certificates leave open.
fn agree(a: &Certificate, b: &Certificate) -> bool {
    let size = a.objective.abs().max(b.objective.abs()).max(1e-3);
    let open = 2.0 * (a.duality_gap + b.duality_gap) + 100.0 * size * a.relative.max(b.relative);
    (a.objective - b.objective).abs() <= open.max(1e-9 * size)
}

fn check(shape: &Shape, steps: u32) -> Result<(), TestCaseError> {
    let case = Case::new(shape);
    let problem = &case.problem;
    let mut warm = ActiveSet::new(problem, ActiveSetSettings::default()).unwrap();
    let mut cold = ActiveSet::new(problem, ActiveSetSettings::default()).unwrap();
    let tight = ClarabelSettings { tolerance: 1e-10 };
    let mut clarabel = ClarabelSolver::new(problem, tight).unwrap();
    for step in 0..steps {
        let vectors = case.at(step);
        cold.forget();
        let (warm_status, warm) = solve(&mut warm, &vectors);
        let (cold_status, cold) = solve(&mut cold, &vectors);
        let (other_status, other) = solve(&mut clarabel, &vectors);
        prop_assert!(
            warm_status == cold_status,
            "step {step}: warm {warm_status:?}, cold {cold_status:?}, clarabel {other_status:?}"
        );
        let (Some(warm), Some(cold)) = (&warm, &cold) else {
            prop_assert!(
                warm_status == QpStatus::Infeasible,
                "step {step}: {warm_status:?}, clarabel {other_status:?}"
            );
            prop_assert!(
                other.is_none(),
                "step {step}: called infeasible, but {other:?}"
            );
            continue;
        };
        prop_assert!(warm.relative <= 1e-8, "step {step}: {warm:?}");
        prop_assert!(agree(warm, cold), "step {step}: {warm:?} {cold:?}");
        if let Some(other) = &other {
            prop_assert!(agree(warm, other), "step {step}: {warm:?} {other:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 300,
        rng_seed: RngSeed::Fixed(1983),
        ..ProptestConfig::default()
    })]
    #[test]
    fn warm_cold_and_clarabel_agree(shape in shapes()) {
        check(&shape, 12)?;
    }

    #[test]
    fn admm_ends_with_the_same_optimum_or_says_that_it_did_not(shape in shapes()) {
        let case = Case::new(&shape);
        let mut exact = ActiveSet::new(&case.problem, ActiveSetSettings::default()).unwrap();
        let mut admm = Admm::new(&case.problem, AdmmSettings::default()).unwrap();
        for step in 0..4 {
            let vectors = case.at(step);
            let (status, optimum) = solve(&mut exact, &vectors);
            let (other, point) = solve(&mut admm, &vectors);
            match (optimum, point) {
                (Some(optimum), Some(point)) => {
                    prop_assert!(agree(&optimum, &point), "{optimum:?} {point:?}");
                }
                (Some(_), None) => prop_assert_eq!(other, QpStatus::IterationLimit),
                (None, point) => {
                    prop_assert_eq!(status, QpStatus::Infeasible);
                    prop_assert!(point.is_none(), "{point:?}");
                }
            }
        }
    }
}
