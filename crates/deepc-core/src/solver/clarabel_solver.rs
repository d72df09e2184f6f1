//! Clarabel on the whole program.
//!
//! Clarabel's tolerances are relative above and absolute below 1, so it is given a program of
//! size 1: with x = s·v and the cost divided by s²κ, P and the quadratic penalties are divided by
//! the constant κ, q and the linear penalties by sκ, and the bounds by s. κ is the size of the
//! curvature; s follows q and the bounds from step to step and touches no matrix. Rows that move
//! far beyond 1 per unit of cost are divided by a size of their own, with their violations. All
//! sizes are powers of two, so that nothing is rounded.

use std::time::Instant;

use clarabel::solver::{DefaultSolver, IPSolver, SupportedConeT};

use super::certificate::CertificateWork;
use super::clarabel_settings::{ClarabelSettings, Remaining, clarabel_matrix, translate};
use super::error::SolverError;
use super::problem::{OwnedVectors, QpProblem, QpVectors, Screening};
use super::sizes::Sizes;
use super::{QpSolution, QpSolver, QpStatus, SolveBudget};

/// The interior-point solver Clarabel on the whole program: any Hessian that is positive
/// semidefinite, dense or sparse rows, no warm start.
///
/// Every soft row gets a violation variable of its own. Clarabel is set up again only when the
/// kind of a row changes (equality, which sides are bounded); otherwise its vectors are
/// updated.
pub struct ClarabelSolver {
    problem: QpProblem,
    settings: ClarabelSettings,
    vectors: OwnedVectors,
    native: Option<Native>,
    sizes: Sizes,
    solution: QpSolution,
    certificate_work: CertificateWork,
}

/// Clarabel's side: `min ½vᵀP̂v + q̂ᵀv, Âv + s = b, s ∈ cones` with v = (x, violations).
struct Native {
    solver: DefaultSolver<f64>,
    kinds: Vec<RowKind>,
    /// s at set-up.
    step: f64,
    /// Divisor of every row of ours.
    row_sizes: Vec<f64>,
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

impl ClarabelSolver {
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
            sizes: Sizes::new(problem),
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
        if self.origin_is_optimal() {
            return self.certify_origin();
        }
        let step = self.sizes.step(&self.problem, &self.vectors);
        let kinds: Vec<_> = (0..self.problem.row_count())
            .map(|row| self.kind(row))
            .collect();
        let native = match self
            .native
            .take()
            .filter(|native| native.kinds == kinds && native.fits(step))
        {
            Some(native) => native,
            None => match self.set_up(kinds, step) {
                Ok(native) => native,
                Err(_) => return QpStatus::NumericalError,
            },
        };
        let native = self.native.insert(native);
        let remaining = Remaining::of(budget, 0, start.elapsed().as_secs_f64());
        if let Some(status) = remaining.spent() {
            return status;
        }
        let mut limits = self.settings.native(true);
        remaining.limit(&mut limits);
        if native.solver.update_settings(limits).is_err()
            || native
                .load(&self.problem, &self.vectors, [step, self.sizes.cost])
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
        for (x, value) in self.solution.primal.iter_mut().zip(&result.x[..variables]) {
            *x = step * value;
        }
        let rows = native.targets.iter().zip(&native.row_sizes);
        for (dual, (targets, row_size)) in self.solution.dual.iter_mut().zip(rows) {
            let part = |target: Option<usize>| target.map_or(0.0, |row| result.z[row]);
            *dual = part(targets.equality) + part(targets.upper) - part(targets.lower);
            *dual *= step * self.sizes.cost / row_size;
        }
        self.certify()
    }

    /// Without a q, x = 0 is an optimum if it meets every row: P is positive semidefinite. An
    /// interior point has no size to be accurate to there.
    fn origin_is_optimal(&self) -> bool {
        let OwnedVectors {
            linear,
            lower,
            upper,
        } = &self.vectors;
        linear.iter().all(|q| *q == 0.0)
            && lower.iter().zip(upper).all(|(l, u)| *l <= 0.0 && *u >= 0.0)
    }

    /// x = 0 and μ = 0.
    fn certify_origin(&mut self) -> QpStatus {
        self.solution.primal.fill(0.0);
        self.solution.dual.fill(0.0);
        self.certify()
    }

    fn certify(&mut self) -> QpStatus {
        self.solution.certify(
            &mut self.certificate_work,
            &self.problem,
            &self.vectors.as_ref(),
        );
        self.solution.grade(self.settings.tolerance)
    }

    fn set_up(&self, kinds: Vec<RowKind>, step: f64) -> Result<Native, SolverError> {
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
        let cost = self.sizes.cost;
        for (.., value) in &mut hessian {
            *value /= cost;
        }
        let row_sizes = self.sizes.rows(step);
        let mut rows = Vec::new();
        for (i, j, value) in self.problem.rows().triplets() {
            let value = value / row_sizes[i];
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
        for q in &mut linear {
            *q /= step * cost;
        }
        for ((penalty, target), size) in soft.iter().zip(&targets).zip(&row_sizes) {
            let Some(penalty) = penalty else { continue };
            let violation = linear.len();
            linear.push(penalty.linear * size / (step * cost));
            hessian.push((violation, violation, penalty.quadratic * size * size / cost));
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
            step,
            row_sizes,
            targets,
            linear,
            right_hand_side,
        })
    }
}

impl Native {
    /// Whether `step` is near enough to that of set-up.
    fn fits(&self, step: f64) -> bool {
        (1.0 / 64.0..=64.0).contains(&(step / self.step))
    }

    /// Hands the moving vectors to Clarabel, in its size (s, κ).
    fn load(
        &mut self,
        problem: &QpProblem,
        vectors: &OwnedVectors,
        [step, cost]: [f64; 2],
    ) -> Option<()> {
        let penalties = problem.soft().iter().zip(&self.row_sizes);
        let penalties = penalties.filter_map(|(soft, size)| soft.map(|soft| soft.linear * size));
        let linear = vectors.linear.iter().copied().chain(penalties);
        for (scaled, value) in self.linear.iter_mut().zip(linear) {
            *scaled = value / (step * cost);
        }
        for (i, target) in self.targets.iter().enumerate() {
            let size = step * self.row_sizes[i];
            for row in [target.equality, target.upper].into_iter().flatten() {
                self.right_hand_side[row] = vectors.upper[i] / size;
            }
            if let Some(row) = target.lower {
                self.right_hand_side[row] = -vectors.lower[i] / size;
            }
        }
        self.solver.update_q(&self.linear).ok()?;
        self.solver.update_b(&self.right_hand_side).ok()
    }
}

impl QpSolver for ClarabelSolver {
    fn name(&self) -> &'static str {
        "clarabel"
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
        self.native = None;
    }
}
