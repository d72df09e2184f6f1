//! OSQP on the whole program.
//!
//! OSQP (Stellato, Banjac, Goulart, Bemporad, Boyd: OSQP: an operator splitting solver for
//! quadratic programs, 2020) is a first-order method: its steps are cheap, but its tolerances are
//! absolute below 1 and say little about a cost with weights of 1e8. So it is given a program of
//! size 1 ([`Sizes`]), its point is judged by this crate's certificate, and it is sent back for
//! more accuracy until that is met or the budget is spent.

mod native;
mod scaling;
mod settings;

use std::time::Instant;

pub use settings::OsqpSettings;

use super::certificate::CertificateWork;
use super::clarabel_settings::Remaining;
use super::error::SolverError;
use super::problem::{OwnedVectors, QpProblem, QpVectors, Screening};
use super::sizes::Sizes;
use super::{QpSolution, QpSolver, QpStatus, SolveBudget};
use native::{Native, Outcome};

/// How much more accuracy OSQP is asked for in every further round.
const TIGHTENING: f64 = 0.01;

/// Rounds after which more accuracy is not to be had in double precision.
const MAX_ROUNDS: u32 = 5;

/// The operator-splitting solver OSQP on the whole program: any Hessian that is positive
/// semidefinite, dense or sparse rows, warm start from the previous point.
///
/// OSQP is set up once, in [`OsqpSolver::new`]; afterwards only its vectors are replaced. It
/// factors again when a row becomes or stops being an equality or loses its last bound, and when
/// it adapts its step size. Needs the cargo feature `osqp` and, to build, `cmake`.
pub struct OsqpSolver {
    problem: QpProblem,
    settings: OsqpSettings,
    vectors: OwnedVectors,
    native: Native,
    sizes: Sizes,
    solution: QpSolution,
    certificate_work: CertificateWork,
}

impl OsqpSolver {
    /// Set-up: one sparse factorisation of size n + r + soft rows.
    ///
    /// # Errors
    /// A setting is out of range, or the Hessian is not positive semidefinite.
    pub fn new(problem: &QpProblem, settings: OsqpSettings) -> Result<Self, SolverError> {
        settings.check()?;
        let sizes = Sizes::new(problem);
        Ok(Self {
            native: Native::new(problem, settings, &sizes)?,
            settings,
            vectors: OwnedVectors::new(problem),
            sizes,
            solution: QpSolution::empty(problem.variable_count(), problem.row_count()),
            certificate_work: CertificateWork::new(problem),
            problem: problem.clone(),
        })
    }

    fn run(&mut self, budget: &SolveBudget, start: Instant) -> QpStatus {
        match self.vectors.screen() {
            Screening::Invalid => return QpStatus::InvalidData,
            Screening::Infeasible => return QpStatus::Infeasible,
            Screening::Proceed => {}
        }
        let step = self.sizes.step(&self.problem, &self.vectors);
        self.native.load(&self.vectors, step);
        let mut tightening = 1.0;
        let mut best = QpStatus::NumericalError;
        for _ in 0..MAX_ROUNDS {
            let used = start.elapsed().as_secs_f64();
            let remaining = Remaining::of(budget, self.solution.iterations, used);
            if let Some(status) = remaining.spent() {
                return if best.is_usable() { best } else { status };
            }
            let (outcome, iterations) = self.native.solve(remaining, tightening);
            self.solution.iterations += iterations;
            tightening *= TIGHTENING;
            let failure = match outcome {
                Outcome::Converged => QpStatus::NumericalError,
                Outcome::IterationLimit => QpStatus::IterationLimit,
                Outcome::TimeLimit => QpStatus::TimeLimit,
                Outcome::Infeasible => return QpStatus::Infeasible,
                Outcome::Unbounded => return QpStatus::Unbounded,
                Outcome::Unproven => continue,
                Outcome::BrokenDown => {
                    // Its iterates may be NaN by now.
                    if let Ok(fresh) = Native::new(&self.problem, self.settings, &self.sizes) {
                        self.native = fresh;
                    }
                    return QpStatus::NumericalError;
                }
            };
            best = self.certify(failure);
            if best == QpStatus::Solved || outcome != Outcome::Converged {
                return best;
            }
        }
        best
    }

    /// Takes OSQP's point over; `failure` if it is worth nothing.
    fn certify(&mut self, failure: QpStatus) -> QpStatus {
        let solution = &mut self.solution;
        self.native.unload(&mut solution.primal, &mut solution.dual);
        let vectors = self.vectors.as_ref();
        solution.certify(&mut self.certificate_work, &self.problem, &vectors);
        match solution.grade(self.settings.tolerance) {
            QpStatus::NumericalError => failure,
            usable => usable,
        }
    }
}

impl QpSolver for OsqpSolver {
    fn name(&self) -> &'static str {
        "osqp"
    }

    fn problem(&self) -> &QpProblem {
        &self.problem
    }

    fn update(&mut self, vectors: QpVectors<'_>) -> Result<(), SolverError> {
        self.vectors.copy_from(&self.problem, &vectors)
    }

    fn solve(&mut self, budget: &SolveBudget) -> &QpSolution {
        let start = Instant::now();
        self.solution.iterations = 0;
        let status = self.run(budget, start);
        self.solution.end(status);
        self.solution.time = start.elapsed();
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.native.forget();
    }
}
