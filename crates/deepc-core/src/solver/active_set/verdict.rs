//! From multipliers to a certified solution.

use super::super::QpSolution;
use super::super::certificate::{CertificateWork, CostParts, RowPoint, RowSums, largest_saving};
use super::super::problem::{OwnedVectors, QpProblem};
use super::dual::Dual;
use crate::columns::weighted_square;
use crate::linalg;

/// Relative residual that is good enough not to be improved.
const SHARP: f64 = 1e-10;

/// Improvements of a point that is not.
const IMPROVEMENTS: usize = 2;

impl Dual {
    /// Fills the solution from the multipliers and their values. `solution.primal` holds the
    /// unconstrained optimum.
    pub(in crate::solver) fn conclude(
        &mut self,
        problem: &QpProblem,
        vectors: &OwnedVectors,
        work: &mut CertificateWork,
        solution: &mut QpSolution,
    ) {
        self.constant.move_by(&mut solution.primal, &self.pushing);
        self.write_multipliers(solution);
        if let Some(curvature) = self.constant.diagonal() {
            let blur = self.certify(curvature, problem, vectors, solution);
            if solution.certificate.relative <= SHARP && blur <= SHARP {
                return;
            }
        }
        solution.certify(work, problem, &vectors.as_ref());
        for _ in 0..IMPROVEMENTS {
            let before = solution.certificate.relative;
            if before <= SHARP || self.factored.is_empty() {
                return;
            }
            self.point.copy_from_slice(&solution.primal);
            self.improve(solution);
            solution.certify(work, problem, &vectors.as_ref());
            let after = solution.certificate.relative;
            if after.is_nan() || after >= before {
                solution.primal.copy_from_slice(&self.point);
                solution.certify(work, problem, &vectors.as_ref());
                return;
            }
        }
    }

    fn write_multipliers(&self, solution: &mut QpSolution) {
        solution.dual.fill(0.0);
        for &(i, multiplier) in &self.pushing {
            solution.dual[i] = multiplier * self.constant.reciprocals[i];
        }
    }

    /// Moves x so that its rows meet their demands. Multipliers that are large and cancel
    /// determine x only to rounding of their size; the rows of x itself are known better.
    fn improve(&mut self, solution: &mut QpSolution) {
        for (i, value) in self.values.iter_mut().enumerate() {
            *value = solution.rows[i] * self.constant.reciprocals[i];
        }
        self.solve_for_correction();
        self.constant.move_by(&mut solution.primal, &self.terms);
    }

    /// The certificate without a product: with a diagonal P, x is to rounding what the
    /// multipliers make it, so Px + q + Aᵀμ = 0 and A x = c − Gμ, which was computed last.
    /// Returns how much of its relative residual rounding may hide.
    fn certify(
        &self,
        curvature: &[f64],
        problem: &QpProblem,
        vectors: &OwnedVectors,
        solution: &mut QpSolution,
    ) -> f64 {
        let mut sums = RowSums::default();
        let values = self.values.iter().zip(&self.constant.scales);
        for (row, (value, scale)) in solution.rows.iter_mut().zip(values) {
            *row = value * scale;
        }
        for (i, &value) in solution.rows.iter().enumerate() {
            let row = RowPoint {
                value,
                lower: vectors.lower[i],
                upper: vectors.upper[i],
                multiplier: solution.dual[i],
            };
            if row.multiplier != 0.0 || value.is_nan() || value < row.lower || value > row.upper {
                sums.add(&row, problem.soft()[i]);
            }
        }
        // A NaN would be in the sum.
        let (square, gradient_scale) = weighted_square(&solution.primal, curvature);
        let quadratic = 0.5 * square;
        let mut cost = CostParts {
            quadratic,
            linear: 0.0,
            saving: 0.0,
            gradient: 0.0,
            gradient_scale,
            gradient_gap: 0.0,
        };
        // With q = 0 there is nothing to add, and divisions are dear.
        if !self.origin {
            cost.linear = linalg::dot(&vectors.linear, &solution.primal);
            cost.saving = largest_saving(curvature, &vectors.linear);
            cost.gradient_scale = gradient_scale.max(linalg::max_abs(&vectors.linear));
        }
        solution.certificate = cost.certificate(&sums);
        let pushed: f64 = self.pushing.iter().map(|(_, m)| m.abs()).sum();
        let rounding = 4.0 * f64::EPSILON * self.size() * pushed;
        if rounding > 0.0 {
            rounding / quadratic
        } else {
            0.0
        }
    }
}
