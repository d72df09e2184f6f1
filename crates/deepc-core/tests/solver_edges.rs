//! What a review found at the edges of the project's own solvers.

use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, QpMatrix, QpProblem, QpSolver, QpStatus,
    QpVectors, SoftPenalty, SolveBudget, certify, contract,
};
use faer::{Mat, mat};

const INF: f64 = f64::INFINITY;

fn problem(hessian: Mat<f64>, rows: Mat<f64>, soft: Vec<Option<SoftPenalty>>) -> QpProblem {
    QpProblem::new(QpMatrix::Dense(hessian), QpMatrix::Dense(rows), soft).unwrap()
}

fn active_set(problem: &QpProblem) -> ActiveSet {
    ActiveSet::new(problem, ActiveSetSettings::default()).unwrap()
}

/// A soft row gives way however dear it is: beside a hard row of the same direction the program has a
/// solution, whatever 1/w is beside rounding.
#[test]
fn a_very_dear_soft_row_yields_to_a_hard_one() {
    for quadratic in [1e10, 1e14, 1e16, 1e20] {
        for linear in [0.0, 1.0, 1e6] {
            let soft = SoftPenalty { linear, quadratic };
            let problem = problem(mat![[2.0]], mat![[1.0], [1.0]], vec![None, Some(soft)]);
            let mut solver = active_set(&problem);
            let vectors = QpVectors {
                linear: &[0.0],
                lower: &[2.0, -INF],
                upper: &[INF, 1.0],
            };
            solver.update(vectors).unwrap();
            let solution = solver.solve(&SolveBudget::generous());
            let name = format!("w = {quadratic:e}, ρ = {linear:e}");
            // Multipliers of 1e16 that cancel leave no digit of x; that is no contradiction.
            if quadratic > 1e14 {
                assert_ne!(solution.status, QpStatus::Infeasible, "{name}");
                continue;
            }
            assert_eq!(solution.status, QpStatus::Solved, "{name}");
            assert!((solution.primal[0] - 2.0).abs() < 1e-9, "{name}");
        }
    }
}

/// With a budget that only a warm start can meet, the solver gets there in a few steps.
#[test]
fn a_search_out_of_budget_goes_on_in_the_next_step() {
    let cases = contract::corpus();
    let case = cases
        .iter()
        .find(|case| case.name.contains("198 of 200"))
        .expect("the corpus has it");
    let generous = SolveBudget::generous();
    let mut cold = active_set(&case.problem);
    cold.update(case.vectors()).unwrap();
    let needed = cold.solve(&generous).iterations;
    assert!(needed >= 4, "{needed} iterations are no search");
    let budget = SolveBudget {
        max_iterations: needed / 2,
        max_time_s: INF,
    };
    let mut solver = active_set(&case.problem);
    solver.update(case.vectors()).unwrap();
    assert_eq!(solver.solve(&budget).status, QpStatus::IterationLimit);
    let arrived = (0..20).any(|_| solver.solve(&budget).status == QpStatus::Solved);
    assert!(arrived, "twenty budgets of {} iterations", needed / 2);
    let solution = solver.solution();
    let certificate = certify(
        &case.problem,
        &case.vectors(),
        &solution.primal,
        &solution.dual,
    );
    assert!(certificate.relative <= 1e-8, "{certificate:?}");
}

/// x = 0.1 and 3x ≤ 0.3, where 0.3/3 is below 0.1 by rounding.
#[test]
fn a_contradiction_of_rounding_is_none() {
    let problem = problem(mat![[2.0]], mat![[1.0], [3.0]], vec![None, None]);
    let vectors = QpVectors {
        linear: &[0.0],
        lower: &[0.1, -INF],
        upper: &[0.1, 0.3],
    };
    let solvers: [Box<dyn QpSolver>; 2] = [
        Box::new(active_set(&problem)),
        Box::new(Admm::new(&problem, AdmmSettings::default()).unwrap()),
    ];
    for mut solver in solvers {
        solver.update(vectors).unwrap();
        let (name, solution) = (solver.name(), solver.solve(&SolveBudget::generous()));
        assert!(solution.status.is_usable(), "{name}: {:?}", solution.status);
        assert!((solution.primal[0] - 0.1).abs() < 1e-9, "{name}");
    }
}

#[test]
fn a_budget_without_a_time_limit_survives_json() {
    let budget = SolveBudget::generous();
    let json = serde_json::to_string(&budget).unwrap();
    let back: SolveBudget = serde_json::from_str(&json).unwrap();
    assert_eq!(back, budget, "{json}");
}
