//! The project's own solver: a dual active set with a constant Hessian.
//!
//! With P = `LLᵀ` and V = L⁻¹Aᵀ the optimum for multipliers μ is x = −P⁻¹(q + Aᵀμ), so
//! A x = c − Gμ with c = −Vᵀ(L⁻¹q) and the constant G = `VᵀV`. Rows that do not push (μᵢ = 0) cost
//! nothing beyond looking at their value. What remains is to find the few that do:
//!
//! | file | what it does |
//! |---|---|
//! | `constant` | set-up: V, G, P⁻¹Aᵀ, rows scaled to length 1 |
//! | `bounds` | what a row allows its multiplier: hard, soft, exactly penalised |
//! | `factor` | a Cholesky factor that rows join and leave |
//! | `dual` | multipliers, values and factor at one step, kept for the next |
//! | `values` | the values of all rows, and which rows they contradict |
//! | `exchange` | rows that push wrongly out, violated ones in: nearly always all that is needed |
//! | `rounds` | many rows at a time while the dual cost falls, where that does not settle |
//! | `descent` | one row at a time, with an end: degenerate and contradicting rows |
//! | `verdict` | x and its certificate |
//! | `guess` | multipliers that come from elsewhere (ADMM) |
//! | `clock` | the budget |

mod bounds;
mod clock;
mod constant;
mod descent;
mod dual;
mod exchange;
mod factor;
mod guess;
mod rounds;
mod values;
mod verdict;

use serde::{Deserialize, Serialize};

use super::certificate::CertificateWork;
use super::error::{SolverError, check_tolerance};
use super::problem::{OwnedVectors, QpProblem, QpVectors, Screening};
use super::{QpSolution, QpSolver, QpStatus, SolveBudget};
pub(super) use clock::Clock;
pub(super) use constant::Constant;
pub(super) use dual::Dual;
use exchange::exchange;
pub(super) use rounds::rounds;

/// Settings of [`ActiveSet`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActiveSetSettings {
    /// Largest [`relative`](super::Certificate::relative) residual of a `Solved` point,
    /// 1e-12 to 1e-3. The solver does not stop at it: its points are exact to rounding, which
    /// is relative to the largest multiplier.
    pub tolerance: f64,
}

impl Default for ActiveSetSettings {
    /// A tolerance of 1e-8. This decides what is called accurate, not behaviour, so it may have
    /// a default.
    fn default() -> Self {
        Self { tolerance: 1e-8 }
    }
}

impl ActiveSetSettings {
    /// Checks the range of every field.
    ///
    /// # Errors
    /// Names the field out of range.
    pub fn check(&self) -> Result<(), SolverError> {
        check_tolerance(self.tolerance)
    }
}

/// A warm-started dual active-set solver for dense, strictly convex programs of which few rows
/// push at a time: the default in a control loop.
///
/// The working set and its Cholesky factor are kept from step to step. A step in which the same
/// rows push costs two products with their columns; it allocates nothing. One iteration of the
/// budget is one solve for the multipliers of the working set, or one exchange of a row for
/// others it depends on.
///
/// A diagonal Hessian (sparse or dense) is certified from the multipliers alone; any other is
/// certified by [`super::certify`], which takes three more products with whole matrices. Memory:
/// 8(r² + 4nr) bytes and a factor of at most 4r².
pub struct ActiveSet {
    problem: QpProblem,
    settings: ActiveSetSettings,
    dual: Dual,
    vectors: OwnedVectors,
    left_out: Vec<bool>,
    certificate_work: CertificateWork,
    solution: QpSolution,
}

impl ActiveSet {
    /// Set-up: one Cholesky factorisation, two triangular solves with r right-hand sides and one
    /// r×n·n×r product; for a diagonal Hessian the product alone.
    ///
    /// # Errors
    /// A setting is out of range or the Hessian is not positive definite.
    pub fn new(problem: &QpProblem, settings: ActiveSetSettings) -> Result<Self, SolverError> {
        settings.check()?;
        let (n, r) = (problem.variable_count(), problem.row_count());
        Ok(Self {
            dual: Dual::new(Constant::new(problem)?, n),
            settings,
            vectors: OwnedVectors::new(problem),
            left_out: vec![false; r],
            certificate_work: CertificateWork::new(problem),
            solution: QpSolution::empty(n, r),
            problem: problem.clone(),
        })
    }

    fn run(&mut self, clock: &mut Clock) -> QpStatus {
        match self.vectors.screen() {
            Screening::Invalid => return QpStatus::InvalidData,
            Screening::Infeasible => return QpStatus::Infeasible,
            Screening::Proceed => {}
        }
        let status = self.attempt(true, clock);
        if matches!(status, QpStatus::NumericalError | QpStatus::Inaccurate) {
            // What was carried over from earlier steps may be to blame, or rows that were exchanged
            // although they nearly depend on each other.
            self.dual.clear();
            return self.attempt(false, clock);
        }
        status
    }

    fn attempt(&mut self, exchanging: bool, clock: &mut Clock) -> QpStatus {
        self.dual.load(&self.vectors, &mut self.solution.primal);
        self.dual.start();
        let found = self.search(exchanging, clock);
        if let Err(status) = found {
            return status;
        }
        self.dual.conclude(
            &self.problem,
            &self.vectors,
            &mut self.certificate_work,
            &mut self.solution,
        );
        self.solution.grade(self.settings.tolerance)
    }

    /// The fast ways first, then the one that ends.
    fn search(&mut self, exchanging: bool, clock: &mut Clock) -> Result<(), QpStatus> {
        if exchanging && exchange(&mut self.dual, clock)? {
            return Ok(());
        }
        if rounds(&mut self.dual, clock)? {
            return Ok(());
        }
        descent::descend(&mut self.dual, &mut self.left_out, clock)
    }
}

impl QpSolver for ActiveSet {
    fn name(&self) -> &'static str {
        "active-set"
    }

    fn problem(&self) -> &QpProblem {
        &self.problem
    }

    fn update(&mut self, vectors: QpVectors<'_>) -> Result<(), SolverError> {
        self.vectors.copy_from(&self.problem, &vectors)
    }

    fn solve(&mut self, budget: &SolveBudget) -> &QpSolution {
        let mut clock = Clock::start(budget);
        let status = self.run(&mut clock);
        self.solution.end(status);
        if !status.is_usable() {
            // A search that ran out of its budget goes on from where it stands: starting anew
            // every time, it might never arrive.
            if matches!(status, QpStatus::IterationLimit | QpStatus::TimeLimit) {
                self.dual.suspend();
            } else {
                self.dual.clear();
            }
        }
        self.solution.iterations = clock.iterations;
        self.solution.time = clock.elapsed();
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.dual.clear();
    }
}
