//! The back ends against each other on the corpus, by what their points are worth.

use deepc_core::solver::contract::{CorpusProblem, corpus};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, Certificate, ClarabelSettings,
    ClarabelSolver, CscMatrix, QpMatrix, QpProblem, QpSolution, QpSolver, QpStatus, SolveBudget,
    certify,
};
use faer::Mat;

fn back_ends(problem: &QpProblem) -> Vec<Box<dyn QpSolver>> {
    let mut all: Vec<Box<dyn QpSolver>> = Vec::new();
    if let Ok(solver) = ActiveSet::new(problem, ActiveSetSettings::default()) {
        all.push(Box::new(solver));
    }
    if let Ok(solver) = Admm::new(problem, AdmmSettings::default()) {
        all.push(Box::new(solver));
    }
    all.push(Box::new(
        ClarabelSolver::new(problem, ClarabelSettings::default()).unwrap(),
    ));
    all
}

fn solve(case: &CorpusProblem, solver: &mut dyn QpSolver) -> QpSolution {
    solver.update(case.vectors()).unwrap();
    solver.solve(&SolveBudget::generous()).clone()
}

fn case(name: &str) -> CorpusProblem {
    let found = corpus().into_iter().find(|case| case.name == name);
    found.unwrap_or_else(|| panic!("the corpus has no `{name}`"))
}

fn optimum(case: &CorpusProblem) -> QpSolution {
    let mut solver = ActiveSet::new(&case.problem, ActiveSetSettings::default()).unwrap();
    let solution = solve(case, &mut solver);
    assert!(solution.status.is_usable(), "{}", case.name);
    solution
}

#[test]
fn back_ends_agree_on_every_program() {
    for case in corpus() {
        let mut certificates: Vec<(&str, Certificate)> = Vec::new();
        let mut endings = Vec::new();
        for mut solver in back_ends(&case.problem) {
            let solution = solve(&case, solver.as_mut());
            let name = solver.name();
            println!(
                "{}: {name} {:?}, {} iterations, violation {:.1e}, gap {:.1e}, relative {:.1e}",
                case.name,
                solution.status,
                solution.iterations,
                solution.certificate.primal_residual,
                solution.certificate.duality_gap,
                solution.certificate.relative,
            );
            endings.push((name, solution.status.is_usable(), solution.status));
            if solution.status.is_usable() {
                let (x, dual) = (&solution.primal, &solution.dual);
                let found = certify(&case.problem, &case.vectors(), x, dual);
                certificates.push((name, found));
            }
        }
        let usable = endings[0].1;
        assert!(
            endings.iter().all(|ending| ending.1 == usable),
            "{}: {endings:?}",
            case.name
        );
        let Some((_, first)) = certificates.first() else {
            continue;
        };
        for (name, other) in &certificates {
            let open = 2.0 * (first.duality_gap + other.duality_gap);
            let size = first.objective.abs().max(other.objective.abs());
            let difference = (first.objective - other.objective).abs();
            // A violation of v is worth up to a multiplier times v; the relative residual
            // holds it.
            let allowed = open + size * (1e-9 + 100.0 * other.relative);
            assert!(
                difference <= allowed,
                "{}, {name}: {difference:e} > {allowed:e}",
                case.name
            );
        }
    }
}

#[test]
fn the_active_set_is_exact_to_rounding_on_every_program() {
    for case in corpus() {
        let Ok(mut solver) = ActiveSet::new(&case.problem, ActiveSetSettings::default()) else {
            assert!(case.semidefinite, "{}", case.name);
            continue;
        };
        let solution = solve(&case, &mut solver);
        if solution.status.is_usable() {
            let (x, dual) = (&solution.primal, &solution.dual);
            let found = certify(&case.problem, &case.vectors(), x, dual);
            // A penalty of 1e8 makes 1e-8 of a rounding of 1e-16.
            let allowed = if case.name.starts_with("penalties") {
                1e-7
            } else {
                1e-11
            };
            assert!(found.relative <= allowed, "{}: {found:?}", case.name);
        }
    }
}

#[test]
fn units_do_not_change_the_optimal_cost() {
    let objective = optimum(&case("generated, 8 variables"))
        .certificate
        .objective;
    for name in [
        "rows from 1e-6 to 1e6",
        "variables from 1e-6 to 1e6",
        "rows and variables from 1e-3 to 1e3",
    ] {
        let found = optimum(&case(name)).certificate.objective;
        let error = (found - objective).abs() / objective.abs();
        assert!(error <= 1e-10, "{name}: {error:e}");
    }
}

#[test]
fn the_sparse_and_the_dense_form_of_a_control_problem_have_the_same_inputs() {
    let sparse = optimum(&case("control, sparse form"));
    let dense = optimum(&case("control, dense form"));
    let pushing = dense.dual.iter().filter(|m| **m != 0.0).count();
    assert!(pushing >= 3, "only {pushing} rows push");
    for (a, b) in sparse.primal.iter().zip(&dense.primal) {
        assert!((a - b).abs() <= 1e-10, "{a} {b}");
    }
}

#[test]
fn nearly_all_variables_are_at_their_bounds_where_the_name_says_so() {
    let solution = optimum(&case("198 of 200 variables at bounds"));
    let pushing = solution.dual.iter().filter(|m| **m != 0.0).count();
    assert_eq!(pushing, 198);
}

/// P = 2I is certified from the multipliers, a full P from the point: the same program in both
/// forms must be worth the same.
#[test]
fn both_ways_to_a_certificate_agree() {
    let case = case("generated, 20 variables");
    let n = case.problem.variable_count();
    let white = CscMatrix::from_triplets(n, n, (0..n).map(|i| (i, i, 2.0)).collect()).unwrap();
    // The same P with two entries beside the diagonal too small to matter.
    let full = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => 2.0,
        1 if i + j == 1 => 1e-300,
        _ => 0.0,
    });
    let solutions = [QpMatrix::Sparse(white), QpMatrix::Dense(full)].map(|hessian| {
        let rows = case.problem.rows().clone();
        let problem = QpProblem::new(hessian, rows, case.problem.soft().to_vec()).unwrap();
        let mut solver = ActiveSet::new(&problem, ActiveSetSettings::default()).unwrap();
        solve(&case, &mut solver)
    });
    let [a, b] = &solutions;
    assert_eq!([a.status, b.status], [QpStatus::Solved; 2]);
    for (x, y) in a.primal.iter().zip(&b.primal) {
        assert!((x - y).abs() <= 1e-12);
    }
    for (x, y) in a.rows.iter().zip(&b.rows) {
        assert!((x - y).abs() <= 1e-11);
    }
    let (a, b) = (&a.certificate, &b.certificate);
    assert!((a.objective - b.objective).abs() <= 1e-12 * a.objective.abs());
    assert!((a.relative - b.relative).abs() <= 1e-12, "{a:?} {b:?}");
}
