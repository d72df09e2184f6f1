//! A step of the real-time solvers allocates nothing, whatever its rows do. The counting
//! allocator of `allocation-counter` serves this test binary alone.

use allocation_counter::measure;
use deepc_core::solver::contract::{CorpusProblem, corpus, moving_problem};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, QpMatrix, QpProblem, QpSolver, QpStatus,
    QpVectors, SolveBudget, SolverError,
};

type SetUp = fn(&CorpusProblem) -> Result<Box<dyn QpSolver>, SolverError>;

const SOLVERS: [(&str, SetUp); 2] = [
    ("active-set", |case| {
        let settings = ActiveSetSettings::default();
        Ok(Box::new(ActiveSet::new(&case.problem, settings)?))
    }),
    ("admm", |case| {
        let settings = AdmmSettings::default();
        Ok(Box::new(Admm::new(&case.problem, settings)?))
    }),
];

fn allocations(solver: &mut dyn QpSolver, case: &CorpusProblem, budget: &SolveBudget) -> u64 {
    let vectors = case.vectors();
    let info = measure(|| {
        solver.update(vectors).expect("the lengths fit");
        solver.solve(budget);
    });
    info.count_total
}

#[test]
fn the_counter_counts() {
    let info = measure(|| {
        std::hint::black_box(vec![1.0; 10]);
    });
    assert_eq!(info.count_total, 1);
}

#[test]
fn no_program_of_the_corpus_makes_a_step_allocate() {
    for (name, set_up) in SOLVERS {
        for case in corpus() {
            let Ok(mut solver) = set_up(&case) else {
                assert!(case.semidefinite, "{name}: {}", case.name);
                continue;
            };
            // Degenerate, full, contradicting: first cold, then warm, then out of budget.
            for iterations in [10_000, 10_000, 2] {
                let budget = SolveBudget {
                    max_iterations: iterations,
                    ..SolveBudget::generous()
                };
                let count = allocations(solver.as_mut(), &case, &budget);
                assert_eq!(count, 0, "{name}: {}", case.name);
            }
        }
    }
}

#[test]
fn rows_may_come_and_go_without_an_allocation() {
    for (name, set_up) in SOLVERS {
        let mut solver = set_up(&moving_problem(0)).unwrap();
        for step in 0..200 {
            let mut case = moving_problem(step);
            if step % 50 == 30 {
                case.linear[0] = f64::NAN;
            }
            let count = allocations(solver.as_mut(), &case, &SolveBudget::generous());
            assert_eq!(count, 0, "{name}, step {step}");
        }
    }
}

/// Large enough for every blocked path of the dense kernels, with a full Hessian and a q.
#[test]
fn a_program_of_the_size_of_a_study_does_not_make_a_step_allocate() {
    let n = 300;
    let entry = |i: usize, j: usize| (-(i.abs_diff(j) as f64) / 5.0).exp();
    let hessian = faer::Mat::from_fn(n, n, |i, j| entry(i, j) + f64::from(u8::from(i == j)));
    let rows = faer::Mat::from_fn(n, n, |i, j| if j <= i { entry(i, j) } else { 0.0 });
    let problem = QpProblem::new(
        QpMatrix::Dense(hessian),
        QpMatrix::Dense(rows),
        vec![None; n],
    )
    .unwrap();
    let bound = vec![0.5; n];
    let opposite = vec![-0.5; n];
    let mut solvers: [Box<dyn QpSolver>; 2] = [
        Box::new(ActiveSet::new(&problem, ActiveSetSettings::default()).unwrap()),
        Box::new(Admm::new(&problem, AdmmSettings::default()).unwrap()),
    ];
    for solver in &mut solvers {
        for step in 0..5 {
            let linear: Vec<f64> = (0..n)
                .map(|i| 3.0 * (0.05 * (i as f64) + 0.1 * f64::from(step)).sin())
                .collect();
            let vectors = QpVectors {
                linear: &linear,
                lower: &opposite,
                upper: &bound,
            };
            let info = measure(|| {
                solver.update(vectors).expect("the lengths fit");
                solver.solve(&SolveBudget::generous());
            });
            assert_eq!(solver.solution().status, QpStatus::Solved);
            let pushing = solver.solution().dual.iter().filter(|m| **m != 0.0).count();
            assert!(pushing > 20, "{pushing} rows push");
            assert_eq!(info.count_total, 0, "{}, step {step}", solver.name());
        }
    }
}
