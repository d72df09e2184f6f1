//! OSQP's side of the program.
//!
//! `min ½vᵀP̂v + q̂ᵀv, l̂ ≤ Âv ≤ û` with v = (x, violations), in the sizes of [`Sizes`]: the cost
//! divided by s²κ, and xⱼ = s tⱼ vⱼ. OSQP scales its matrices by itself (but for very small rows and
//! columns), but its tolerances are those of the program it is given.
//!
//! A soft row stays one row, l ≤ (Ax)ᵢ + s₋ − s₊ ≤ u, so that its multiplier is OSQP's. With a
//! linear penalty s₋ and s₊ are two variables, both at least 0 (in an optimum one of them is 0);
//! with a quadratic one alone their difference is one free variable.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use ::osqp::{CscMatrix as OsqpMatrix, Problem, SetupError, Status};

use super::scaling::{Scaling, violation_size};
use super::settings::{INFEASIBILITY_EPS, INITIAL_RHO, OsqpSettings};
use crate::linalg;
use crate::solver::clarabel_settings::Remaining;
use crate::solver::problem::{OwnedVectors, QpProblem};
use crate::solver::sizes::Sizes;
use crate::solver::{CscMatrix, SolverError};

/// OSQP's infinity: it multiplies bounds by zero multipliers, which ∞ would turn into NaN.
const INFINITY: f64 = 1e30;

/// Relative accuracy of a proof that no point, or no lowest cost, exists.
const PROOF_TOLERANCE: f64 = 1e-6;

/// OSQP and everything it is given and returns, in its size.
pub(super) struct Native {
    solver: Problem,
    settings: OsqpSettings,
    hessian: CscMatrix,
    rows: CscMatrix,
    /// tⱼ, the factor of every variable of ours; after them come the violations.
    variable_sizes: Vec<f64>,
    /// Divisor of every row of ours; after them come the violations' own bounds.
    row_sizes: Vec<f64>,
    /// ρᵢ/κ in the violation's size; they follow x in q̂ when divided by s.
    penalties: Vec<f64>,
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    point: Vec<f64>,
    multipliers: Vec<f64>,
    proof: Vec<f64>,
    /// κ.
    cost: f64,
    /// s.
    step: f64,
    /// OSQP counts its set-up into the time of its first solve.
    set_up_time_s: f64,
}

/// How a run of OSQP ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// By its own measure there is a solution.
    Converged,
    IterationLimit,
    TimeLimit,
    /// Proven.
    Infeasible,
    /// Proven.
    Unbounded,
    /// It claims one of the two above, and its proof does not hold.
    Unproven,
    BrokenDown,
}

impl Native {
    pub fn new(
        problem: &QpProblem,
        settings: OsqpSettings,
        sizes: &Sizes,
    ) -> Result<Self, SolverError> {
        let start = Instant::now();
        let (n, r) = (problem.variable_count(), problem.row_count());
        let cost = sizes.cost;
        let scaling = Scaling::choose(problem);
        let variable_sizes = scaling.variable_sizes(sizes);
        let mut hessian = problem.hessian().triplets();
        hessian.retain(|&(i, j, _)| i <= j);
        for (i, j, value) in &mut hessian {
            *value *= variable_sizes[*i] * variable_sizes[*j] / cost;
        }
        let mut rows = problem.rows().triplets();
        let mut row_sizes = vec![0.0_f64; r];
        for (i, j, value) in &mut rows {
            *value *= variable_sizes[*j];
            row_sizes[*i] = row_sizes[*i].hypot(*value);
        }
        for size in &mut row_sizes {
            *size = scaling.row_size(*size);
        }
        for (i, _, value) in &mut rows {
            *value /= row_sizes[*i];
        }
        let mut penalties = Vec::new();
        let mut row_count = r;
        for (i, penalty) in problem.soft().iter().enumerate() {
            let Some(penalty) = penalty else { continue };
            let size = violation_size(*penalty, row_sizes[i], cost);
            let signs: &[f64] = if penalty.linear > 0.0 {
                &[-1.0, 1.0]
            } else {
                &[-1.0]
            };
            for sign in signs {
                let violation = n + penalties.len();
                penalties.push(penalty.linear * size / cost);
                hessian.push((violation, violation, penalty.quadratic * size * size / cost));
                rows.push((i, violation, sign * size / row_sizes[i]));
                if penalty.linear > 0.0 {
                    rows.push((row_count, violation, 1.0));
                    row_count += 1;
                }
            }
        }
        let columns = n + penalties.len();
        let hessian = CscMatrix::from_triplets(columns, columns, hessian)?;
        let rows = CscMatrix::from_triplets(row_count, columns, rows)?;
        // Without a q, so that large penalties do not decide OSQP's scaling of the cost.
        let linear = vec![0.0; columns];
        let mut lower = vec![0.0; row_count];
        lower[..r].fill(-INFINITY);
        let upper = vec![INFINITY; row_count];
        let native = settings.native();
        let solver = Problem::new(
            osqp_matrix(&hessian),
            &linear,
            osqp_matrix(&rows),
            &lower,
            &upper,
            &native,
        )
        .map_err(|error| SolverError::SparseStructure {
            problem: match error {
                SetupError::NonConvex => "OSQP finds the Hessian not positive semidefinite",
                SetupError::MemoryAllocationFailed => "OSQP has too little memory",
                _ => "OSQP refused the problem",
            },
        })?;
        Ok(Self {
            solver,
            settings,
            hessian,
            rows,
            variable_sizes,
            row_sizes,
            penalties,
            point: vec![0.0; columns],
            multipliers: vec![0.0; row_count],
            proof: vec![0.0; columns.max(row_count)],
            linear,
            lower,
            upper,
            cost,
            step: 1.0,
            set_up_time_s: start.elapsed().as_secs_f64(),
        })
    }

    /// Hands the moving vectors to OSQP in the size `step`, which its point follows.
    pub fn load(&mut self, vectors: &OwnedVectors, step: f64) {
        let linear = vectors.linear.iter().zip(&self.variable_sizes);
        let linear = linear.map(|(q, size)| q * size / self.cost);
        let linear = linear.chain(self.penalties.iter().copied());
        for (scaled, value) in self.linear.iter_mut().zip(linear) {
            *scaled = value / step;
        }
        let bounds = vectors.lower.iter().zip(&vectors.upper).enumerate();
        for (i, (lower, upper)) in bounds {
            let size = step * self.row_sizes[i];
            self.lower[i] = (lower / size).max(-INFINITY);
            self.upper[i] = (upper / size).min(INFINITY);
        }
        self.solver.update_lin_cost(&self.linear);
        self.solver.update_bounds(&self.lower, &self.upper);
        #[expect(clippy::float_cmp, reason = "both are powers of two")]
        if step != self.step {
            let ratio = self.step / step;
            let values = self.point.iter_mut().chain(&mut self.multipliers);
            values.for_each(|value| *value *= ratio);
            self.solver.warm_start(&self.point, &self.multipliers);
            self.step = step;
        }
    }

    /// Goes on from the last point, with OSQP's own tolerances times `tightening`. Returns the
    /// iterations used as well.
    pub fn solve(&mut self, limits: Remaining, tightening: f64) -> (Outcome, u32) {
        let time_s = limits.time_s + std::mem::take(&mut self.set_up_time_s);
        let eps = (self.settings.eps * tightening).max(f64::EPSILON);
        let infeasibility_eps = INFEASIBILITY_EPS * tightening;
        let solver = &mut self.solver;
        // The binding panics when OSQP's factorisation breaks down while it adapts its step.
        let result = catch_unwind(AssertUnwindSafe(|| {
            solver.update_max_iter(limits.iterations);
            solver.update_time_limit(Duration::try_from_secs_f64(time_s).ok());
            solver.update_eps_abs(eps);
            solver.update_eps_rel(eps);
            solver.update_eps_prim_inf(infeasibility_eps);
            solver.update_eps_dual_inf(infeasibility_eps);
            let status = solver.solve();
            let iterations = status.iter().min(limits.iterations);
            let outcome = match &status {
                Status::Solved(_) | Status::SolvedInaccurate(_) => Outcome::Converged,
                Status::MaxIterationsReached(_) => Outcome::IterationLimit,
                Status::TimeLimitReached(_) => Outcome::TimeLimit,
                Status::PrimalInfeasible(proof) | Status::PrimalInfeasibleInaccurate(proof) => {
                    let length = self.multipliers.len();
                    self.proof[..length].copy_from_slice(proof.delta_y());
                    Outcome::Infeasible
                }
                Status::DualInfeasible(proof) | Status::DualInfeasibleInaccurate(proof) => {
                    let length = self.point.len();
                    self.proof[..length].copy_from_slice(proof.delta_x());
                    Outcome::Unbounded
                }
                _ => Outcome::BrokenDown,
            };
            if let Status::Solved(point)
            | Status::SolvedInaccurate(point)
            | Status::MaxIterationsReached(point)
            | Status::TimeLimitReached(point) = &status
            {
                self.point.copy_from_slice(point.x());
                self.multipliers.copy_from_slice(point.y());
            }
            (outcome, iterations)
        }));
        let Ok((outcome, iterations)) = result else {
            return (Outcome::BrokenDown, 0);
        };
        let proven = match outcome {
            Outcome::Infeasible => self.is_infeasible(),
            Outcome::Unbounded => self.is_unbounded(),
            _ => return (outcome, iterations),
        };
        // OSQP's own point is back at zero now.
        self.point.fill(0.0);
        self.multipliers.fill(0.0);
        (if proven { outcome } else { Outcome::Unproven }, iterations)
    }

    /// Farkas: no v meets the rows if y with Âᵀy = 0 has Σ ûᵢ yᵢ⁺ − l̂ᵢ yᵢ⁻ < 0.
    fn is_infeasible(&self) -> bool {
        let y = &self.proof[..self.multipliers.len()];
        let balanced = (0..self.rows.ncols()).all(|j| {
            let terms = self.rows.column(j).map(|(i, value)| value * y[i]);
            let (sum, size) = sums(terms);
            sum.abs() <= PROOF_TOLERANCE * size.max(linalg::max_abs(y))
        });
        let terms = y.iter().enumerate().filter(|(_, y)| **y != 0.0);
        let (support, size) = sums(terms.map(|(i, y)| {
            let bound = if *y > 0.0 {
                self.upper[i]
            } else {
                self.lower[i]
            };
            y * bound
        }));
        balanced && support < -PROOF_TOLERANCE * size
    }

    /// The cost falls for ever along d if P̂d = 0, q̂ᵀd < 0 and Âd leads out of no bound.
    fn is_unbounded(&self) -> bool {
        let d = &self.proof[..self.point.len()];
        let size = linalg::max_abs(d);
        let mut curvature = vec![0.0; d.len()];
        for (i, j, value) in self.hessian.triplets() {
            curvature[i] += value * d[j];
            if i != j {
                curvature[j] += value * d[i];
            }
        }
        let mut rows = vec![0.0; self.rows.nrows()];
        for (i, j, value) in self.rows.triplets() {
            rows[i] += value * d[j];
        }
        let bounded = |i: usize, value: f64| {
            let limit = PROOF_TOLERANCE * size;
            (value > limit && self.upper[i] < INFINITY)
                || (value < -limit && self.lower[i] > -INFINITY)
        };
        let (slope, slope_size) = sums(self.linear.iter().zip(d).map(|(q, d)| q * d));
        linalg::max_abs(&curvature) <= PROOF_TOLERANCE * size
            && slope < -PROOF_TOLERANCE * slope_size
            && !rows.iter().enumerate().any(|(i, value)| bounded(i, *value))
    }

    /// x and μ of the last point, in their own size.
    pub fn unload(&self, primal: &mut [f64], dual: &mut [f64]) {
        let point = self.point.iter().zip(&self.variable_sizes);
        for (x, (value, size)) in primal.iter_mut().zip(point) {
            *x = self.step * size * value;
        }
        let multipliers = self.multipliers.iter().zip(&self.row_sizes);
        for (mu, (value, size)) in dual.iter_mut().zip(multipliers) {
            *mu = self.step * self.cost / size * value;
        }
    }

    /// Back to the state after set-up: the point and the step size ρ.
    pub fn forget(&mut self) {
        self.point.fill(0.0);
        self.multipliers.fill(0.0);
        self.solver.update_rho(INITIAL_RHO);
        self.solver.warm_start(&self.point, &self.multipliers);
    }
}

/// The sum and the sum of sizes.
fn sums(terms: impl Iterator<Item = f64>) -> (f64, f64) {
    terms.fold((0.0, 0.0), |(sum, size), term| {
        (sum + term, size + term.abs())
    })
}

fn osqp_matrix(matrix: &CscMatrix) -> OsqpMatrix<'static> {
    let (nrows, ncols) = (matrix.nrows(), matrix.ncols());
    let (starts, indices, values) = matrix.clone().into_parts();
    OsqpMatrix {
        nrows,
        ncols,
        indptr: starts.into(),
        indices: indices.into(),
        data: values.into(),
    }
}
