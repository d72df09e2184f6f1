//! The contract of [`QpSolver`] as checks that every back end runs.
//!
//! ```
//! use deepc_core::solver::{ActiveSet, ActiveSetSettings, contract};
//!
//! contract::check_qp_solver(&mut |problem| {
//!     Ok(Box::new(ActiveSet::new(problem, ActiveSetSettings::default())?))
//! })?;
//! # Ok::<(), deepc_core::solver::contract::ContractViolation>(())
//! ```

mod corpus;

use thiserror::Error;

pub use corpus::{CorpusProblem, Expected, corpus, moving_problem};

use super::{
    QpProblem, QpSolution, QpSolver, QpStatus, QpVectors, SolveBudget, SolverError, certify,
};

/// An implementer breaks its trait's contract.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("contract clause {clause} is broken: {what}")]
pub struct ContractViolation {
    /// Number of the clause in the trait's documentation.
    pub clause: u8,
    /// What was expected and what was found.
    pub what: String,
}

/// `Err` unless `holds`.
pub(crate) fn demand(
    clause: u8,
    holds: bool,
    what: impl FnOnce() -> String,
) -> Result<(), ContractViolation> {
    if holds {
        return Ok(());
    }
    Err(ContractViolation {
        clause,
        what: what(),
    })
}

/// Sets a back end up for a problem.
pub type QpFactory<'a> = dyn FnMut(&QpProblem) -> Result<Box<dyn QpSolver>, SolverError> + 'a;

/// What a back end is held to.
#[derive(Debug, Clone, Copy)]
pub struct Terms<'a> {
    /// Largest [`relative`](super::Certificate::relative) residual of a usable point, and largest
    /// relative error of an objective against a known optimum.
    pub residual: f64,
    /// Names of programs of the corpus that it need not solve. It must still say so: a usable
    /// point or another ending than the expected one remains a breach.
    pub excused: &'a [&'a str],
}

impl Default for Terms<'_> {
    /// A residual of 1e-7, and no excuse.
    fn default() -> Self {
        Self {
            residual: 1e-7,
            excused: &[],
        }
    }
}

impl Terms<'_> {
    fn excuse(&self, case: &CorpusProblem, status: QpStatus) -> bool {
        let failed = matches!(
            status,
            QpStatus::IterationLimit | QpStatus::TimeLimit | QpStatus::NumericalError
        );
        failed && self.excused.contains(&case.name)
    }
}

/// Largest error of a variable against a known optimum, relative to max(1, its size).
const PRIMAL_TOLERANCE: f64 = 1e-4;

/// How far the certificate and the rows a solver returns may be from those of its point.
const CERTIFICATE_ROUNDING: f64 = 1e-9;

/// Runs all checks on the solvers `factory` makes. A back end that needs a positive definite
/// Hessian may refuse the problems of the corpus that are only semidefinite, with
/// [`SolverError::NotPositiveDefinite`].
///
/// # Errors
/// The first clause found broken.
pub fn check_qp_solver(factory: &mut QpFactory<'_>) -> Result<(), ContractViolation> {
    check_qp_solver_on(factory, &Terms::default())
}

/// [`check_qp_solver`] on terms of its own, for a back end that is less accurate by nature.
///
/// # Errors
/// The first clause found broken.
pub fn check_qp_solver_on(
    factory: &mut QpFactory<'_>,
    terms: &Terms<'_>,
) -> Result<(), ContractViolation> {
    for case in corpus() {
        let Some(mut solver) = set_up(factory, &case)? else {
            continue;
        };
        check_optimum(&case, solver.as_mut(), terms)?;
    }
    check_bad_numbers(factory, terms)?;
    check_lengths(factory)?;
    check_budgets(factory)?;
    check_history(factory, terms)
}

fn set_up(
    factory: &mut QpFactory<'_>,
    case: &CorpusProblem,
) -> Result<Option<Box<dyn QpSolver>>, ContractViolation> {
    match factory(&case.problem) {
        Ok(solver) => Ok(Some(solver)),
        Err(SolverError::NotPositiveDefinite { .. }) if case.semidefinite => Ok(None),
        Err(error) => Err(ContractViolation {
            clause: 1,
            what: format!("`{}` is refused: {error}", case.name),
        }),
    }
}

fn solve(
    solver: &mut dyn QpSolver,
    vectors: QpVectors<'_>,
    budget: &SolveBudget,
) -> Result<QpSolution, ContractViolation> {
    solver.update(vectors).map_err(|error| ContractViolation {
        clause: 1,
        what: format!("vectors of the right lengths are refused: {error}"),
    })?;
    Ok(solver.solve(budget).clone())
}

fn check_optimum(
    case: &CorpusProblem,
    solver: &mut dyn QpSolver,
    terms: &Terms<'_>,
) -> Result<(), ContractViolation> {
    let name = case.name;
    let solution = solve(solver, case.vectors(), &SolveBudget::generous())?;
    let status = solution.status;
    if terms.excuse(case, status) {
        return Ok(());
    }
    match &case.expected {
        Expected::Status(expected) => demand(2, status == *expected, || {
            format!("`{name}` ends with {status:?}, expected {expected:?}")
        }),
        Expected::Optimum { primal, objective } => {
            check_certificate(case, &solution, terms)?;
            let found = solution.certificate.objective;
            // An optimum without a cost is held to the cost's unit.
            let size = if *objective == 0.0 {
                1.0
            } else {
                objective.abs()
            };
            let error = (found - objective).abs() / size;
            demand(2, error <= terms.residual, || {
                format!("`{name}` has objective {found}, expected {objective}")
            })?;
            let far = solution.primal.iter().zip(primal).any(|(found, expected)| {
                let size = expected.abs().max(f64::MIN_POSITIVE);
                // Corpus values are given in the variable's own size, or are zero.
                let scale = if *expected == 0.0 { 1.0 } else { size };
                (found - expected).abs() > PRIMAL_TOLERANCE * scale
            });
            demand(2, !far, || {
                format!(
                    "`{name}` is solved by {primal:?}, found {:?}",
                    solution.primal
                )
            })
        }
        Expected::Certified => check_certificate(case, &solution, terms),
    }
}

/// Clause 3: the certificate is that of the point, and good.
fn check_certificate(
    case: &CorpusProblem,
    solution: &QpSolution,
    terms: &Terms<'_>,
) -> Result<(), ContractViolation> {
    let name = case.name;
    // Not by the status: a penalty of 1e8 makes 1e-8 of a rounding of 1e-16.
    demand(2, solution.status.is_usable(), || {
        format!(
            "`{name}` ends with {:?} instead of an optimum",
            solution.status
        )
    })?;
    let certificate = certify(
        &case.problem,
        &case.vectors(),
        &solution.primal,
        &solution.dual,
    );
    let told = &solution.certificate;
    let objective_error = (told.objective - certificate.objective).abs();
    let agrees = (told.relative - certificate.relative).abs() <= CERTIFICATE_ROUNDING
        && objective_error <= CERTIFICATE_ROUNDING * certificate.objective.abs().max(1e-6);
    demand(3, agrees, || {
        format!("`{name}`: certificate {told:?}, its point has {certificate:?}")
    })?;
    demand(3, certificate.relative <= terms.residual, || {
        format!(
            "`{name}` is called solved with a residual of {:e}",
            certificate.relative
        )
    })?;
    check_rows(case, solution)
}

/// Clause 3: `rows` is A x.
fn check_rows(case: &CorpusProblem, solution: &QpSolution) -> Result<(), ContractViolation> {
    let mut differences = solution.rows.clone();
    let mut sizes: Vec<f64> = differences.iter().map(|value| value.abs()).collect();
    for (i, j, entry) in case.problem.rows().triplets() {
        differences[i] -= entry * solution.primal[j];
        sizes[i] += (entry * solution.primal[j]).abs();
    }
    let mut pairs = differences.iter().zip(&sizes);
    let wrong = pairs.position(|(d, size)| d.is_nan() || d.abs() > CERTIFICATE_ROUNDING * size);
    demand(3, wrong.is_none(), || {
        let i = wrong.unwrap_or_default();
        format!(
            "`{}`: rows[{i}] is {}, A x differs by {:e}",
            case.name, solution.rows[i], differences[i]
        )
    })
}

/// Clause 4.
fn check_bad_numbers(
    factory: &mut QpFactory<'_>,
    terms: &Terms<'_>,
) -> Result<(), ContractViolation> {
    let case = moving_problem(0);
    let Some(mut solver) = set_up(factory, &case)? else {
        return Ok(());
    };
    let good = case.vectors();
    let poisons = [
        (f64::NAN, 0.0, 1.0, QpStatus::InvalidData),
        (f64::INFINITY, 0.0, 1.0, QpStatus::InvalidData),
        (0.0, f64::NAN, 1.0, QpStatus::InvalidData),
        (0.0, 0.0, f64::NAN, QpStatus::InvalidData),
        (0.0, f64::INFINITY, f64::INFINITY, QpStatus::InvalidData),
        (
            0.0,
            f64::NEG_INFINITY,
            f64::NEG_INFINITY,
            QpStatus::InvalidData,
        ),
        (0.0, 1.0, 0.0, QpStatus::Infeasible),
    ];
    for (linear, lower, upper, expected) in poisons {
        let poisoned = |values: &[f64], first: f64| {
            let mut values = values.to_vec();
            values[0] = first;
            values
        };
        let (q, l, u) = (
            poisoned(good.linear, linear),
            poisoned(good.lower, lower),
            poisoned(good.upper, upper),
        );
        let bad = QpVectors {
            linear: &q,
            lower: &l,
            upper: &u,
        };
        let status = solve(solver.as_mut(), bad, &SolveBudget::generous())?.status;
        demand(4, status == expected, || {
            format!("q = {linear}, l = {lower}, u = {upper} ends with {status:?}, not {expected:?}")
        })?;
        // And it is not remembered.
        check_optimum(&case, solver.as_mut(), terms)?;
    }
    Ok(())
}

/// Clause 5.
fn check_lengths(factory: &mut QpFactory<'_>) -> Result<(), ContractViolation> {
    let case = moving_problem(1);
    let Some(mut solver) = set_up(factory, &case)? else {
        return Ok(());
    };
    let before = solve(solver.as_mut(), case.vectors(), &SolveBudget::generous())?;
    let good = case.vectors();
    let short = |values: &'static str| match values {
        "q" => QpVectors {
            linear: &good.linear[1..],
            ..good
        },
        "l" => QpVectors {
            lower: &good.lower[1..],
            ..good
        },
        _ => QpVectors {
            upper: &good.upper[1..],
            ..good
        },
    };
    for name in ["q", "l", "u"] {
        demand(5, solver.update(short(name)).is_err(), || {
            format!("{name} may be too short")
        })?;
    }
    let after = solver.solve(&SolveBudget::generous());
    let same = (after.certificate.objective - before.certificate.objective).abs() <= 1e-7;
    demand(5, same, || "refused vectors changed the problem".into())
}

/// Clause 6.
fn check_budgets(factory: &mut QpFactory<'_>) -> Result<(), ContractViolation> {
    let case = moving_problem(2);
    let Some(mut solver) = set_up(factory, &case)? else {
        return Ok(());
    };
    for max_iterations in [1, 2, 3] {
        let budget = SolveBudget {
            max_iterations,
            max_time_s: f64::INFINITY,
        };
        solver.forget();
        let solution = solve(solver.as_mut(), case.vectors(), &budget)?;
        demand(6, solution.iterations <= max_iterations, || {
            format!(
                "{} iterations, allowed {max_iterations}",
                solution.iterations
            )
        })?;
        let status = solution.status;
        demand(
            6,
            status.is_usable() || status == QpStatus::IterationLimit,
            || format!("{max_iterations} iterations end with {status:?}"),
        )?;
    }
    let budget = SolveBudget {
        max_iterations: 1000,
        max_time_s: 1e-12,
    };
    solver.forget();
    let status = solve(solver.as_mut(), case.vectors(), &budget)?.status;
    demand(
        6,
        status.is_usable() || status == QpStatus::TimeLimit,
        || format!("a time budget of 1e-12 s ends with {status:?}"),
    )
}

/// Clauses 7 and 8.
fn check_history(factory: &mut QpFactory<'_>, terms: &Terms<'_>) -> Result<(), ContractViolation> {
    let first = moving_problem(0);
    let (Some(mut warm), Some(mut twin)) = (set_up(factory, &first)?, set_up(factory, &first)?)
    else {
        return Ok(());
    };
    for step in 0..40 {
        let case = moving_problem(step);
        let budget = SolveBudget::generous();
        let continued = solve(warm.as_mut(), case.vectors(), &budget)?;
        let repeated = solve(twin.as_mut(), case.vectors(), &budget)?;
        check_certificate(&case, &continued, terms)?;
        demand(8, continued.primal == repeated.primal, || {
            format!("step {step}: equal histories give different points")
        })?;
        let Some(mut fresh) = set_up(factory, &case)? else {
            return Ok(());
        };
        let cold = solve(fresh.as_mut(), case.vectors(), &budget)?;
        let pairs = continued.primal.iter().zip(&cold.primal);
        let distance = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        demand(7, distance <= 1e-5, || {
            format!("step {step}: warm and cold solves are {distance:e} apart")
        })?;
    }
    warm.forget();
    let cleared = solve(warm.as_mut(), first.vectors(), &SolveBudget::generous())?;
    check_certificate(&first, &cleared, terms)
}
