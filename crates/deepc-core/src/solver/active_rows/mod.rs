//! Few rows at a time, exactly: the dual of a dense, strictly convex program.
//!
//! With P = `LLᵀ` and V = L⁻¹Aᵀ the optimum for multipliers μ is
//! x = −P⁻¹(q + Aᵀμ), so Ax = c − Gμ with c = −Vᵀ(L⁻¹q) and the constant G = `VᵀV`. Rows that do
//! not push (μᵢ = 0) need not be looked at beyond checking that they hold. A step
//! 1. takes the unconstrained optimum, and the rows that pushed in the previous step,
//! 2. lets Clarabel solve the small dual over these rows,
//!    min ½μᵀGμ − dᵀμ, μ within what each row's penalty allows,
//! 3. checks all rows, adds those that are violated, and repeats.
//!
//! When no row is violated, the optimum of the relaxed program is feasible for the whole one
//! and therefore its optimum. Rows are scaled to Gᵢᵢ = 1 first.

mod dual;
mod refine;

use std::time::Instant;

use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, Par, Side};

use super::certificate::CertificateWork;
use super::clarabel_direct::{ClarabelDirect, grade};
use super::clarabel_settings::{ClarabelSettings, Remaining};
use super::error::SolverError;
use super::problem::{OwnedVectors, QpProblem, QpVectors, Screening, SoftPenalty};
use super::{QpSolution, QpSolver, QpStatus, SolveBudget};
use crate::linalg;
use refine::{RowState, refine};

/// Rounds of adding rows. Each adds at least one, in practice two to four suffice.
const MAX_ROUNDS: usize = 100;

/// Interior-point steps a small program may take. A healthy one takes 8 to 30.
const SMALL_ITERATIONS: u32 = 60;

/// Clarabel on the rows that matter: for a dense positive definite Hessian and many rows of
/// which few are active.
///
/// The point is exact to rounding when the set of active rows it found is consistent (checked),
/// and otherwise as accurate as Clarabel is; its certificate says how good it is either way. When
/// the small programs break down (rows so nearly dependent that their multipliers are not
/// determined), the whole program goes to [`ClarabelDirect`], which is slow but sturdier.
pub struct ActiveRows {
    problem: QpProblem,
    settings: ClarabelSettings,
    constant: Constant,
    vectors: OwnedVectors,
    /// L⁻¹q.
    reduced_linear: Vec<f64>,
    /// c, scaled: A x at the unconstrained optimum.
    unconstrained_rows: Vec<f64>,
    /// A x at the present multipliers, scaled.
    rows: Vec<f64>,
    /// Multiplier of every row, scaled.
    multipliers: Vec<f64>,
    working: Vec<WorkingRow>,
    work: Vec<f64>,
    certificate_work: CertificateWork,
    solution: QpSolution,
    /// The way out when the small programs break down; set up when it is first needed.
    whole: Option<ClarabelDirect>,
}

/// What set-up computes.
struct Constant {
    /// L of P = `LLᵀ`, n×n.
    lower: Mat<f64>,
    /// V = L⁻¹Aᵀ with its columns scaled to length 1, n×r.
    reduced_rows: Mat<f64>,
    /// G = `VᵀV`, r×r.
    gram: Mat<f64>,
    /// What every row was divided by.
    scales: Vec<f64>,
    /// Penalties of the scaled rows.
    soft: Vec<Option<SoftPenalty>>,
}

/// One side of one row in the working set. `bound` is of the scaled row.
#[derive(Debug, Clone, Copy)]
struct WorkingRow {
    row: usize,
    side: RowSide,
    bound: f64,
    penalty: Option<SoftPenalty>,
    state: RowState,
    /// Multiplier in the direction of `side`: ≥ 0 but for equalities.
    multiplier: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RowSide {
    Upper,
    Lower,
    Equality,
}

impl WorkingRow {
    fn sign(&self) -> f64 {
        if self.side == RowSide::Lower {
            -1.0
        } else {
            1.0
        }
    }

    /// How far `value` is beyond the bound, in the direction of the side.
    fn violation(&self, value: f64) -> f64 {
        self.sign() * (value - self.bound)
    }
}

impl ActiveRows {
    /// Set-up: one Cholesky factorisation, one triangular solve with r right-hand sides, one
    /// r×n·n×r product.
    ///
    /// # Errors
    /// A setting is out of range or the Hessian is not positive definite.
    pub fn new(problem: &QpProblem, settings: ClarabelSettings) -> Result<Self, SolverError> {
        settings.check()?;
        let (n, r) = (problem.variable_count(), problem.row_count());
        let hessian = problem.hessian().to_dense();
        let factor = hessian.llt(Side::Lower).map_err(|error| {
            let faer::linalg::solvers::LltError::NonPositivePivot { index } = error;
            SolverError::NotPositiveDefinite { pivot: index }
        })?;
        let lower = factor.L().to_owned();
        let mut reduced_rows = problem.rows().to_dense().transpose().to_owned();
        solve_lower_triangular_in_place(lower.as_ref(), reduced_rows.as_mut(), Par::Seq);
        let mut scales = vec![1.0; r];
        for (j, scale) in scales.iter_mut().enumerate() {
            let length = reduced_rows.col(j).norm_l2();
            // A row of zeros cannot move and keeps its scale.
            if length > f64::MIN_POSITIVE.sqrt() {
                *scale = length;
                reduced_rows
                    .col_mut(j)
                    .iter_mut()
                    .for_each(|value| *value /= length);
            }
        }
        let gram = reduced_rows.transpose() * &reduced_rows;
        let soft = problem.soft().iter().zip(&scales);
        let soft = soft.map(|(penalty, scale)| {
            penalty.map(|penalty| SoftPenalty {
                linear: penalty.linear * scale,
                quadratic: penalty.quadratic * scale * scale,
            })
        });
        Ok(Self {
            constant: Constant {
                lower,
                reduced_rows,
                gram,
                soft: soft.collect(),
                scales,
            },
            settings,
            vectors: OwnedVectors::new(problem),
            reduced_linear: vec![0.0; n],
            unconstrained_rows: vec![0.0; r],
            rows: vec![0.0; r],
            multipliers: vec![0.0; r],
            working: Vec::with_capacity(2 * r),
            work: vec![0.0; n],
            certificate_work: CertificateWork::new(problem),
            solution: QpSolution::empty(n, r),
            whole: None,
            problem: problem.clone(),
        })
    }

    fn run(&mut self, budget: &SolveBudget, start: Instant) -> QpStatus {
        match self.vectors.screen() {
            Screening::Invalid => return QpStatus::InvalidData,
            Screening::Infeasible => return QpStatus::Infeasible,
            Screening::Proceed => {}
        }
        let constant = &self.constant;
        self.reduced_linear.copy_from_slice(&self.vectors.linear);
        linalg::solve_lower(constant.lower.as_ref(), &mut self.reduced_linear);
        let reduced = constant.reduced_rows.transpose();
        linalg::multiply(&mut self.unconstrained_rows, reduced, &self.reduced_linear);
        self.unconstrained_rows
            .iter_mut()
            .for_each(|value| *value = -*value);
        self.start_working_set();
        for _ in 0..MAX_ROUNDS {
            let used = start.elapsed().as_secs_f64();
            let remaining = Remaining::of(budget, self.solution.iterations, used);
            if let Some(status) = remaining.spent() {
                return status;
            }
            // The rows of the previous step usually fit this one: try them before Clarabel.
            let (result, iterations) = refine(
                &mut self.working,
                &self.constant.gram,
                &self.unconstrained_rows,
                remaining.iterations,
            );
            self.solution.iterations += iterations;
            if !result {
                let status = self.solve_small_dual(budget, start);
                if status != QpStatus::Solved {
                    return status;
                }
            }
            self.evaluate_rows();
            if !self.add_violated() {
                return self.finish();
            }
        }
        QpStatus::NumericalError
    }

    fn solve_whole(&mut self, budget: &SolveBudget, start: Instant) -> QpStatus {
        let used = start.elapsed().as_secs_f64();
        let remaining = Remaining::of(budget, self.solution.iterations, used);
        if let Some(status) = remaining.spent() {
            return status;
        }
        let whole = match self.whole.take() {
            Some(whole) => whole,
            None => match ClarabelDirect::new(&self.problem, self.settings) {
                Ok(whole) => whole,
                Err(_) => return QpStatus::NumericalError,
            },
        };
        let whole = self.whole.insert(whole);
        if whole.update(self.vectors.as_ref()).is_err() {
            return QpStatus::NumericalError;
        }
        let result = whole.solve(&SolveBudget {
            max_iterations: remaining.iterations,
            max_time_s: remaining.time_s,
        });
        self.solution.primal.copy_from_slice(&result.primal);
        self.solution.dual.copy_from_slice(&result.dual);
        self.solution.certificate = result.certificate;
        self.solution.iterations += result.iterations;
        result.status
    }

    fn solve_small_dual(&mut self, budget: &SolveBudget, start: Instant) -> QpStatus {
        let used = start.elapsed().as_secs_f64();
        let remaining = Remaining::of(budget, self.solution.iterations, used);
        if let Some(status) = remaining.spent() {
            return status;
        }
        let small = Remaining {
            iterations: remaining.iterations.min(SMALL_ITERATIONS),
            ..remaining
        };
        let (gram, c) = (&self.constant.gram, &self.unconstrained_rows);
        let (status, iterations) = dual::solve(&mut self.working, gram, c, self.settings, small);
        self.solution.iterations += iterations.min(small.iterations);
        if status == QpStatus::IterationLimit && small.iterations < remaining.iterations {
            return QpStatus::NumericalError;
        }
        if status == QpStatus::Solved {
            // Sharpens Clarabel's point to rounding where its active set is consistent.
            let mut sharpened = self.working.clone();
            let left = budget
                .max_iterations
                .saturating_sub(self.solution.iterations);
            let (consistent, guesses) = refine(&mut sharpened, gram, c, left);
            self.solution.iterations += guesses;
            if consistent {
                self.working = sharpened;
            }
        }
        status
    }

    fn bound(&self, row: usize, side: RowSide) -> f64 {
        let bound = match side {
            RowSide::Lower => self.vectors.lower[row],
            RowSide::Upper | RowSide::Equality => self.vectors.upper[row],
        };
        bound / self.constant.scales[row]
    }

    fn is_equality(&self, row: usize) -> bool {
        self.vectors.lower[row] >= self.vectors.upper[row] && self.constant.soft[row].is_none()
    }

    fn working_row(&self, row: usize, side: RowSide, state: RowState) -> WorkingRow {
        WorkingRow {
            row,
            side,
            bound: self.bound(row, side),
            penalty: self.constant.soft[row],
            state,
            multiplier: 0.0,
        }
    }

    /// Rows that pushed last time, with this step's bounds, and all equalities.
    fn start_working_set(&mut self) {
        let mut previous = std::mem::take(&mut self.working);
        previous.retain(|old| {
            old.side != RowSide::Equality
                && old.state != RowState::Free
                && !self.is_equality(old.row)
                && self.bound(old.row, old.side).is_finite()
        });
        for old in &mut previous {
            *old = self.working_row(old.row, old.side, old.state);
        }
        let equalities = (0..self.problem.row_count()).filter(|&row| self.is_equality(row));
        for row in equalities {
            previous.push(self.working_row(row, RowSide::Equality, RowState::Tight));
        }
        self.working = previous;
    }

    /// A x = c − Gμ for all rows, from the working set.
    fn evaluate_rows(&mut self) {
        self.multipliers.fill(0.0);
        for working in &self.working {
            self.multipliers[working.row] += working.sign() * working.multiplier;
        }
        self.rows.copy_from_slice(&self.unconstrained_rows);
        for (j, &multiplier) in self.multipliers.iter().enumerate() {
            if multiplier != 0.0 {
                let column = self.constant.gram.col_as_slice(j);
                for (value, entry) in self.rows.iter_mut().zip(column) {
                    *value -= entry * multiplier;
                }
            }
        }
    }

    /// Adds the sides that are violated and not in the working set yet; whether there were any.
    fn add_violated(&mut self) -> bool {
        let before = self.working.len();
        for row in 0..self.problem.row_count() {
            if self.is_equality(row) {
                continue;
            }
            for side in [RowSide::Upper, RowSide::Lower] {
                let candidate = self.working_row(row, side, RowState::Tight);
                if candidate.bound.is_infinite() {
                    continue;
                }
                // A hundredth of what a `Solved` point may have, in the row's own units.
                let scale = self.constant.scales[row];
                let allowed =
                    0.01 * self.settings.tolerance * (candidate.bound.abs() * scale).max(1.0);
                let known = self.working[..before]
                    .iter()
                    .any(|w| w.row == row && w.side == side);
                if !known && candidate.violation(self.rows[row]) * scale > allowed {
                    self.working.push(candidate);
                }
            }
        }
        self.working.len() > before
    }

    /// x = −L⁻ᵀ(L⁻¹q + Vμ), and its certificate.
    fn finish(&mut self) -> QpStatus {
        self.work.copy_from_slice(&self.reduced_linear);
        for (j, &multiplier) in self.multipliers.iter().enumerate() {
            if multiplier != 0.0 {
                let column = self.constant.reduced_rows.col_as_slice(j);
                for (value, entry) in self.work.iter_mut().zip(column) {
                    *value += entry * multiplier;
                }
            }
        }
        linalg::solve_upper(self.constant.lower.transpose(), &mut self.work);
        for (x, value) in self.solution.primal.iter_mut().zip(&self.work) {
            *x = -value;
        }
        let scaled = self.multipliers.iter().zip(&self.constant.scales);
        for (dual, (multiplier, scale)) in self.solution.dual.iter_mut().zip(scaled) {
            *dual = multiplier / scale;
        }
        let solution = &mut self.solution;
        solution.certificate = self.certificate_work.certify(
            &self.problem,
            &self.vectors.as_ref(),
            &solution.primal,
            &solution.dual,
        );
        grade(solution.certificate.relative, self.settings.tolerance)
    }
}

impl QpSolver for ActiveRows {
    fn name(&self) -> &'static str {
        "clarabel-active-rows"
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
        let mut status = self.run(budget, start);
        if status == QpStatus::NumericalError {
            self.working.clear();
            status = self.solve_whole(budget, start);
        }
        if status.is_usable() {
            self.solution.status = status;
        } else {
            self.solution.fail(status);
            self.working.clear();
        }
        self.solution.time = start.elapsed();
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.working.clear();
        self.whole = None;
    }
}
