//! Alternating directions with one constant matrix: a step of predictable cost.
//!
//! In the rows of length 1 of `active_set` the program is: min D over values z of the rows, and
//! with the fixed σ an iteration is (Boyd et al. 2011, section 3; over-relaxed by α, section
//! 3.4.3)
//!
//! ```text
//! a = c − M(y + σ(c − z))          M = G(I + σG)⁻¹, r×r, computed at set-up
//! t = αa + (1 − α)z + y/σ
//! z = argmin ψ(z) + ½σ(z − t)²     ψ: the bounds and penalties, row by row
//! y = σ(t − z)
//! ```
//!
//! y converges to the multipliers, and its signs and sizes name the rows that push long before
//! y is accurate. So the last thing done is a few solves over these rows, as in `active_set`.

use faer::prelude::Solve;
use faer::{Mat, Side};
use serde::{Deserialize, Serialize};

use super::active_set::{Clock, Constant, Dual, rounds};
use super::certificate::CertificateWork;
use super::error::{SolverError, check_tolerance};
use super::problem::{OwnedVectors, QpProblem, QpVectors, Screening};
use super::{QpSolution, QpSolver, QpStatus, SolveBudget};
use crate::linalg;

/// Solves that end a solve, kept free of the iteration budget for it.
const POLISH: u32 = 8;

/// Iterations between two looks at the residuals.
const LOOK_EVERY: u32 = 10;

/// Relative residual at which the rows that push are tried for the first time, and by how much
/// it must fall before they are tried again.
const FIRST_TRY: f64 = 1e-2;
const NEXT_TRY: f64 = 0.1;

/// How far beyond the size of the bounds a point would have to be for rows to be met that are
/// called infeasible.
const FAR: f64 = 1e6;

/// How much more than the bounds allow, relative to them, they must demand to be infeasible.
const CONTRADICTION: f64 = 1e-9;

/// Settings of [`Admm`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdmmSettings {
    /// σ, what a unit of disagreement between a row of length 1 and its bounds costs: 1e-6 to
    /// 1e6.
    pub rho: f64,
    /// α, over-relaxation: 1 (none) up to, but not including, 2.
    pub relaxation: f64,
    /// Largest [`relative`](super::Certificate::relative) residual of a `Solved` point,
    /// 1e-12 to 1e-3.
    pub tolerance: f64,
}

impl Default for AdmmSettings {
    /// σ = 1, which suits rows of length 1; α = 1.6; a tolerance of 1e-8. They decide speed and
    /// accuracy, not behaviour, so they may have defaults.
    fn default() -> Self {
        Self {
            rho: 1.0,
            relaxation: 1.6,
            tolerance: 1e-8,
        }
    }
}

impl AdmmSettings {
    /// Checks the range of every field.
    ///
    /// # Errors
    /// Names the field out of range.
    pub fn check(&self) -> Result<(), SolverError> {
        let wrong = |field, found, range| {
            Err(SolverError::Setting {
                field,
                found,
                range,
            })
        };
        if !(1e-6..=1e6).contains(&self.rho) {
            return wrong("rho", self.rho, "a value from 1e-6 to 1e6");
        }
        if !(1.0..2.0).contains(&self.relaxation) {
            return wrong(
                "relaxation",
                self.relaxation,
                "a value from 1 up to, but not including, 2",
            );
        }
        check_tolerance(self.tolerance)
    }
}

/// The alternating direction method of multipliers, with a fixed penalty parameter, for dense,
/// strictly convex programs.
///
/// An iteration is one product with an r×r matrix, whatever the rows do: a budget of iterations
/// is nearly a budget of time. What comes on top are solves over the rows found to push, at a few
/// moments, k³/3 operations for k of them. Use it where the time of the worst step counts more than that of the
/// usual one, which [`super::ActiveSet`] needs less for. The last 8 iterations of a budget (or
/// half of it, if it is smaller) are kept for solves over the rows that were found to push, which
/// usually make the point exact. Nothing is allocated in a step.
pub struct Admm {
    problem: QpProblem,
    settings: AdmmSettings,
    dual: Dual,
    /// M, r×r.
    product: Mat<f64>,
    vectors: OwnedVectors,
    /// z.
    targets: Vec<f64>,
    /// y.
    multipliers: Vec<f64>,
    /// Change of y in the last iteration.
    change: Vec<f64>,
    /// y + σ(c − z), and a.
    drive: Vec<f64>,
    values: Vec<f64>,
    unconstrained_x: Vec<f64>,
    certificate_work: CertificateWork,
    solution: QpSolution,
}

impl Admm {
    /// Set-up: that of [`super::ActiveSet`] and a Cholesky factorisation of I + σG, r×r.
    ///
    /// # Errors
    /// A setting is out of range or the Hessian is not positive definite.
    pub fn new(problem: &QpProblem, settings: AdmmSettings) -> Result<Self, SolverError> {
        settings.check()?;
        let (n, r) = (problem.variable_count(), problem.row_count());
        let constant = Constant::new(problem)?;
        let gram = Mat::from_fn(r, r, |i, j| constant.gram.column(j)[i]);
        let regular = Mat::<f64>::identity(r, r) + faer::Scale(settings.rho) * &gram;
        let factor = regular.llt(Side::Lower).map_err(|error| {
            let faer::linalg::solvers::LltError::NonPositivePivot { index } = error;
            SolverError::NotPositiveDefinite { pivot: index }
        })?;
        Ok(Self {
            product: factor.solve(&gram),
            dual: Dual::new(constant, n),
            settings,
            vectors: OwnedVectors::new(problem),
            targets: vec![0.0; r],
            multipliers: vec![0.0; r],
            change: vec![0.0; r],
            drive: vec![0.0; r],
            values: vec![0.0; r],
            unconstrained_x: vec![0.0; n],
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
        self.dual.load(&self.vectors, &mut self.unconstrained_x);
        let reserved = POLISH.min(clock.remaining() / 2);
        let mut iterations = clock.limited(clock.remaining() - reserved);
        let mut next_try = FIRST_TRY;
        let end = loop {
            let used = iterations.iterations;
            if let Err(status) = iterations.tick() {
                break status;
            }
            let residual = self.iterate();
            if !used.is_multiple_of(LOOK_EVERY) {
                continue;
            }
            if residual.is_nan() {
                break QpStatus::NumericalError;
            }
            if self.shows_infeasibility() {
                break QpStatus::Infeasible;
            }
            if residual > next_try {
                continue;
            }
            next_try = NEXT_TRY * residual;
            let status = self.polish(&mut iterations);
            if status == QpStatus::Solved {
                clock.iterations = iterations.iterations;
                return status;
            }
        };
        clock.iterations = iterations.iterations;
        match end {
            QpStatus::Infeasible | QpStatus::NumericalError => end,
            _ => {
                let status = self.polish(clock);
                if status.is_usable() { status } else { end }
            }
        }
    }

    /// One iteration; its residual relative to the numbers it is a difference of.
    fn iterate(&mut self) -> f64 {
        let AdmmSettings {
            rho, relaxation, ..
        } = self.settings;
        let unconstrained = &self.dual.unconstrained;
        let known = unconstrained
            .iter()
            .zip(&self.targets)
            .zip(&self.multipliers);
        for (drive, ((c, z), y)) in self.drive.iter_mut().zip(known) {
            *drive = y + rho * (c - z);
        }
        linalg::multiply(&mut self.values, self.product.as_ref(), &self.drive);
        let (mut residual, mut size): (f64, f64) = (0.0, 0.0);
        for (i, row) in self.dual.rows.iter().enumerate() {
            let (z, y) = (self.targets[i], self.multipliers[i]);
            let a = unconstrained[i] - self.values[i];
            let t = relaxation * a + (1.0 - relaxation) * z + y / rho;
            let next = row.proximal(t, rho);
            let multiplier = rho * (t - next);
            self.change[i] = multiplier - y;
            self.targets[i] = next;
            self.multipliers[i] = multiplier;
            let moved = (a - next).abs() + (next - z).abs();
            residual = if moved > residual || moved.is_nan() {
                moved
            } else {
                residual
            };
            size = size.max(a.abs()).max(multiplier.abs() / rho);
        }
        if residual == 0.0 {
            0.0
        } else {
            residual / size
        }
    }

    /// Whether the last change of y proves that no point meets the hard rows: with Gδ = 0, all
    /// values c − Gμ have the same δᵀv = δᵀc, and the bounds demand less (Banjac et al., J.
    /// Optim. Theory Appl. 183, 2019).
    fn shows_infeasibility(&mut self) -> bool {
        let largest = linalg::max_abs(&self.change);
        if largest <= 0.0 {
            return false;
        }
        let (mut demanded, mut size) = (0.0, 0.0_f64);
        for (i, row) in self.dual.rows.iter().enumerate() {
            let change = self.change[i] / largest;
            if change.abs() <= 1e-9 {
                self.drive[i] = 0.0;
                continue;
            }
            let bound = if change > 0.0 { row.upper } else { row.lower };
            if !row.price.is_hard() || bound.is_infinite() {
                return false;
            }
            self.drive[i] = change;
            let c = self.dual.unconstrained[i];
            demanded += change * (bound - c);
            size = size.max(bound.abs()).max(c.abs());
        }
        // Bounds that contradict each other by rounding do not.
        if -demanded <= CONTRADICTION * size {
            return false;
        }
        self.dual.gram_product(&mut self.values, &self.drive);
        linalg::max_abs(&self.values) * FAR * size <= -demanded
    }

    /// Solves over the rows that push according to y; without success, takes y as it is.
    fn polish(&mut self, clock: &mut Clock) -> QpStatus {
        let mut limited = clock.limited(POLISH);
        self.dual.guess(&self.multipliers);
        let found = rounds(&mut self.dual, &mut limited);
        clock.iterations = limited.iterations;
        if !matches!(found, Ok(true)) {
            self.dual.take(&self.multipliers);
        }
        self.solution.primal.copy_from_slice(&self.unconstrained_x);
        self.dual.conclude(
            &self.problem,
            &self.vectors,
            &mut self.certificate_work,
            &mut self.solution,
        );
        let status = self.solution.grade(self.settings.tolerance);
        if matches!(found, Ok(true)) && status.is_usable() {
            // The next step starts from the better multipliers.
            self.dual.give(&mut self.multipliers, &mut self.targets);
        }
        status
    }
}

impl QpSolver for Admm {
    fn name(&self) -> &'static str {
        "admm"
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
        // Out of budget, the next step goes on from here.
        let goes_on = matches!(status, QpStatus::IterationLimit | QpStatus::TimeLimit);
        if !status.is_usable() && !goes_on {
            self.forget();
        }
        self.solution.iterations = clock.iterations;
        self.solution.time = clock.elapsed();
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.targets.fill(0.0);
        self.multipliers.fill(0.0);
        self.dual.clear();
    }
}
