//! Clarabel on the whole program as it is.

use std::time::Instant;

use clarabel::solver::{DefaultSolver, IPSolver, SupportedConeT};

use super::certificate::{CertificateWork, INACCURATE_TOLERANCE};
use super::clarabel_settings::{ClarabelSettings, Remaining, clarabel_matrix, translate};
use super::error::SolverError;
use super::problem::{OwnedVectors, QpProblem, QpVectors, Screening};
use super::{QpSolution, QpSolver, QpStatus, SolveBudget};

/// The interior-point solver Clarabel on the whole program: any Hessian that is positive
/// semidefinite, dense or sparse rows, no warm start.
///
/// Every soft row gets a violation variable of its own. Clarabel is set up again only when the
/// kind of a row changes (equality, which sides are bounded); otherwise its vectors are
/// updated.
pub struct ClarabelDirect {
    problem: QpProblem,
    settings: ClarabelSettings,
    vectors: OwnedVectors,
    native: Option<Native>,
    solution: QpSolution,
    certificate_work: CertificateWork,
}

/// Clarabel's side: `min ½vᵀP̂v + q̂ᵀv, Âv + s = b, s ∈ cones` with v = (x, violations).
struct Native {
    solver: DefaultSolver<f64>,
    kinds: Vec<RowKind>,
    targets: Vec<Targets>,
    linear: Vec<f64>,
    right_hand_side: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RowKind {
    Equality,
    Sides { lower: bool, upper: bool },
}

/// Rows of Clarabel's problem that stand for one row of ours.
#[derive(Debug, Clone, Copy, Default)]
struct Targets {
    equality: Option<usize>,
    upper: Option<usize>,
    lower: Option<usize>,
}

impl ClarabelDirect {
    /// Takes the constant problem; Clarabel itself is set up in the first solve.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn new(problem: &QpProblem, settings: ClarabelSettings) -> Result<Self, SolverError> {
        settings.check()?;
        Ok(Self {
            problem: problem.clone(),
            settings,
            vectors: OwnedVectors::new(problem),
            native: None,
            solution: QpSolution::empty(problem.variable_count(), problem.row_count()),
            certificate_work: CertificateWork::new(problem),
        })
    }

    fn kind(&self, row: usize) -> RowKind {
        let (lower, upper) = (self.vectors.lower[row], self.vectors.upper[row]);
        // A soft equality is two soft sides.
        if lower >= upper && self.problem.soft()[row].is_none() {
            RowKind::Equality
        } else {
            RowKind::Sides {
                lower: lower.is_finite(),
                upper: upper.is_finite(),
            }
        }
    }

    fn run(&mut self, budget: &SolveBudget, start: Instant) -> QpStatus {
        match self.vectors.screen() {
            Screening::Invalid => return QpStatus::InvalidData,
            Screening::Infeasible => return QpStatus::Infeasible,
            Screening::Proceed => {}
        }
        let kinds: Vec<_> = (0..self.problem.row_count())
            .map(|row| self.kind(row))
            .collect();
        let native = match self.native.take().filter(|native| native.kinds == kinds) {
            Some(native) => native,
            None => match self.set_up(kinds) {
                Ok(native) => native,
                Err(_) => return QpStatus::NumericalError,
            },
        };
        let native = self.native.insert(native);
        let remaining = Remaining::of(budget, 0, start.elapsed().as_secs_f64());
        if let Some(status) = remaining.spent() {
            return status;
        }
        if native
            .load(&self.vectors, self.settings, remaining)
            .is_none()
        {
            return QpStatus::NumericalError;
        }
        native.solver.solve();
        let result = &native.solver.solution;
        self.solution.iterations = result.iterations.min(budget.max_iterations);
        let status = translate(result.status);
        if status != QpStatus::Solved || result.x.iter().any(|value| !value.is_finite()) {
            return if status == QpStatus::Solved {
                QpStatus::NumericalError
            } else {
                status
            };
        }
        let variables = self.problem.variable_count();
        self.solution.primal.copy_from_slice(&result.x[..variables]);
        for (dual, targets) in self.solution.dual.iter_mut().zip(&native.targets) {
            let part = |target: Option<usize>| target.map_or(0.0, |row| result.z[row]);
            *dual = part(targets.equality) + part(targets.upper) - part(targets.lower);
        }
        let (solution, vectors) = (&mut self.solution, self.vectors.as_ref());
        solution.certificate = self.certificate_work.certify(
            &self.problem,
            &vectors,
            &solution.primal,
            &solution.dual,
        );
        grade(solution.certificate.relative, self.settings.tolerance)
    }

    fn set_up(&self, kinds: Vec<RowKind>) -> Result<Native, SolverError> {
        let soft = self.problem.soft();
        let mut targets = vec![Targets::default(); kinds.len()];
        let mut count = 0;
        let mut next = || {
            count += 1;
            Some(count - 1)
        };
        for (target, kind) in targets.iter_mut().zip(&kinds) {
            if *kind == RowKind::Equality {
                target.equality = next();
            }
        }
        for (target, kind) in targets.iter_mut().zip(&kinds) {
            if let RowKind::Sides { lower, upper } = *kind {
                target.upper = if upper { next() } else { None };
                target.lower = if lower { next() } else { None };
            }
        }
        let equalities = targets.iter().filter(|t| t.equality.is_some()).count();

        let mut hessian = self.problem.hessian().triplets();
        hessian.retain(|&(i, j, _)| i <= j);
        let mut rows = Vec::new();
        for (i, j, value) in self.problem.rows().triplets() {
            let Targets {
                equality,
                upper,
                lower,
            } = targets[i];
            rows.extend(
                [equality, upper]
                    .into_iter()
                    .flatten()
                    .map(|row| (row, j, value)),
            );
            rows.extend(lower.map(|row| (row, j, -value)));
        }
        // Clarabel's scaling of the cost looks at q once, here.
        let mut linear = self.vectors.linear.clone();
        for (penalty, target) in soft.iter().zip(&targets) {
            let Some(penalty) = penalty else { continue };
            let violation = linear.len();
            linear.push(penalty.linear);
            hessian.push((violation, violation, penalty.quadratic));
            let sides = [target.upper, target.lower, next()];
            rows.extend(
                sides
                    .into_iter()
                    .flatten()
                    .map(|row| (row, violation, -1.0)),
            );
        }
        let columns = linear.len();
        let right_hand_side = vec![0.0; count];
        let cones = [
            SupportedConeT::ZeroConeT(equalities),
            SupportedConeT::NonnegativeConeT(count - equalities),
        ];
        let solver = DefaultSolver::new(
            &clarabel_matrix(columns, columns, hessian)?,
            &linear,
            &clarabel_matrix(count, columns, rows)?,
            &right_hand_side,
            &cones,
            self.settings.native(true),
        )
        .map_err(|_| SolverError::SparseStructure {
            problem: "Clarabel refused the problem",
        })?;
        Ok(Native {
            solver,
            kinds,
            targets,
            linear,
            right_hand_side,
        })
    }
}

/// `Solved`, `Inaccurate` or a failure, by the certificate.
pub(super) fn grade(relative: f64, tolerance: f64) -> QpStatus {
    if relative <= tolerance {
        QpStatus::Solved
    } else if relative <= INACCURATE_TOLERANCE {
        QpStatus::Inaccurate
    } else {
        QpStatus::NumericalError
    }
}

impl Native {
    /// Hands the moving vectors and what is left of the budget to Clarabel.
    fn load(
        &mut self,
        vectors: &OwnedVectors,
        settings: ClarabelSettings,
        remaining: Remaining,
    ) -> Option<()> {
        self.linear[..vectors.linear.len()].copy_from_slice(&vectors.linear);
        for (i, target) in self.targets.iter().enumerate() {
            for row in [target.equality, target.upper].into_iter().flatten() {
                self.right_hand_side[row] = vectors.upper[i];
            }
            if let Some(row) = target.lower {
                self.right_hand_side[row] = -vectors.lower[i];
            }
        }
        let mut native = settings.native(true);
        remaining.limit(&mut native);
        self.solver.update_settings(native).ok()?;
        self.solver.update_q(&self.linear).ok()?;
        self.solver.update_b(&self.right_hand_side).ok()
    }
}

impl QpSolver for ClarabelDirect {
    fn name(&self) -> &'static str {
        "clarabel-direct"
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
        if status.is_usable() {
            self.solution.status = status;
        } else {
            self.solution.fail(status);
        }
        self.solution.time = start.elapsed();
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.native = None;
    }
}
