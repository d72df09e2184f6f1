//! What a returned point is worth, computed from the point itself.

use serde::{Deserialize, Serialize};

use super::problem::{QpProblem, QpVectors};
use crate::linalg;

/// A point whose relative residual is above this is no solution.
pub const INACCURATE_TOLERANCE: f64 = 1e-5;

/// Residuals of a primal/dual pair (x, μ). With r = Px + q + Aᵀμ all of them are zero exactly at
/// an optimum, and `duality_gap` bounds how far the cost of x is from the optimal cost, up to
/// the other two residuals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Cost ½xᵀPx + qᵀx + penalties.
    pub objective: f64,
    /// Largest violation of a hard row, in the row's units.
    pub primal_residual: f64,
    /// ‖r‖∞, or the largest multiplier that pushes against no bound, if larger.
    pub dual_residual: f64,
    /// |xᵀr| + Σ |complementarity of row i|; a soft row's term is the Fenchel gap between its
    /// penalty and its multiplier.
    pub duality_gap: f64,
    /// The largest of the three, each divided by its scale (0/0 is 0):
    /// - a violation by max(1, the row's value): what 1 means in a row is its author's choice;
    /// - the dual residual by the largest of the gradient's parts Px, q and Aᵀμ;
    /// - the gap by the parts of the cost, or, if that is larger (the cost may be 0 at the
    ///   optimum), by what a single variable could save from x = 0 if there were no rows,
    ///   maxⱼ ½qⱼ²/Pⱼⱼ, but no more than 1.
    ///
    /// So a program whose costs are all small is held to the same digits as any other.
    pub relative: f64,
}

impl Certificate {
    /// Of no point.
    #[must_use]
    pub fn none() -> Self {
        Self {
            objective: f64::NAN,
            primal_residual: f64::NAN,
            dual_residual: f64::NAN,
            duality_gap: f64::NAN,
            relative: f64::NAN,
        }
    }
}

/// Certifies the point (x, μ). Lengths must fit the problem.
#[must_use]
pub fn certify(
    problem: &QpProblem,
    vectors: &QpVectors<'_>,
    primal: &[f64],
    dual: &[f64],
) -> Certificate {
    let mut work = CertificateWork::new(problem);
    work.certify(problem, vectors, primal, dual)
}

/// The vectors [`certify`] needs, kept by solvers so that a step allocates nothing for them.
#[derive(Debug, Clone)]
pub(super) struct CertificateWork {
    hessian_x: Vec<f64>,
    gradient: Vec<f64>,
    rows_x: Vec<f64>,
    /// Pⱼⱼ.
    curvature: Vec<f64>,
}

impl CertificateWork {
    pub fn new(problem: &QpProblem) -> Self {
        Self {
            hessian_x: vec![0.0; problem.variable_count()],
            gradient: vec![0.0; problem.variable_count()],
            rows_x: vec![0.0; problem.row_count()],
            curvature: curvature(problem),
        }
    }

    /// A x of the last point certified.
    pub fn rows(&self) -> &[f64] {
        &self.rows_x
    }

    pub fn certify(
        &mut self,
        problem: &QpProblem,
        vectors: &QpVectors<'_>,
        x: &[f64],
        dual: &[f64],
    ) -> Certificate {
        problem.hessian().multiply(&mut self.hessian_x, x);
        problem.rows().multiply(&mut self.rows_x, x);
        self.gradient.fill(0.0);
        problem
            .rows()
            .multiply_transposed_add(&mut self.gradient, dual);
        let gradient_scale = linalg::max_abs(&self.gradient)
            .max(linalg::max_abs(&self.hessian_x))
            .max(linalg::max_abs(vectors.linear));
        let parts = self.hessian_x.iter().zip(vectors.linear);
        for (gradient, (hessian_x, linear)) in self.gradient.iter_mut().zip(parts) {
            *gradient += hessian_x + linear;
        }
        let quadratic = 0.5 * linalg::dot(&self.hessian_x, x);
        let linear = linalg::dot(vectors.linear, x);

        let mut rows = RowSums::default();
        for (i, (&value, &multiplier)) in self.rows_x.iter().zip(dual).enumerate() {
            let row = RowPoint {
                value,
                lower: vectors.lower[i],
                upper: vectors.upper[i],
                multiplier,
            };
            rows.add(&row, problem.soft()[i]);
        }
        CostParts {
            quadratic,
            linear,
            saving: largest_saving(&self.curvature, vectors.linear),
            gradient: linalg::max_abs(&self.gradient),
            gradient_scale,
            gradient_gap: linalg::dot(&self.gradient, x).abs(),
        }
        .certificate(&rows)
    }
}

/// What a certificate is made of beside the rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct CostParts {
    /// ½xᵀPx.
    pub quadratic: f64,
    /// qᵀx.
    pub linear: f64,
    /// maxⱼ ½qⱼ²/Pⱼⱼ.
    pub saving: f64,
    /// ‖r‖∞ of r = Px + q + Aᵀμ.
    pub gradient: f64,
    /// The largest entry of the parts of r.
    pub gradient_scale: f64,
    /// |xᵀr|.
    pub gradient_gap: f64,
}

impl CostParts {
    pub fn certificate(&self, rows: &RowSums) -> Certificate {
        let duality_gap = self.gradient_gap + rows.gap;
        let dual_residual = self.gradient.max(rows.stray_multiplier);
        let cost_scale =
            (self.quadratic.abs() + self.linear.abs() + rows.penalty).max(self.saving.min(1.0));
        let relative = [
            rows.relative_violation,
            ratio(dual_residual, self.gradient_scale),
            ratio(duality_gap, cost_scale),
        ];
        Certificate {
            objective: self.quadratic + self.linear + rows.penalty,
            primal_residual: rows.violation,
            dual_residual,
            duality_gap,
            relative: linalg::max_abs(&relative),
        }
    }
}

/// Pⱼⱼ of every variable.
pub(super) fn curvature(problem: &QpProblem) -> Vec<f64> {
    let mut diagonal = vec![0.0; problem.variable_count()];
    for (i, j, value) in problem.hessian().triplets() {
        if i == j {
            diagonal[i] += value;
        }
    }
    diagonal
}

/// maxⱼ ½qⱼ²/Pⱼⱼ over the variables with Pⱼⱼ > 0.
pub(super) fn largest_saving(curvature: &[f64], linear: &[f64]) -> f64 {
    let pairs = curvature.iter().zip(linear).filter(|(p, _)| **p > 0.0);
    pairs.fold(0.0, |max, (p, q)| max.max(0.5 * q * (q / p)))
}

/// With 0/0 = 0, and NaN if either is.
fn ratio(part: f64, scale: f64) -> f64 {
    if part == 0.0 {
        scale * 0.0
    } else {
        part / scale
    }
}

/// One row at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowPoint {
    pub value: f64,
    pub lower: f64,
    pub upper: f64,
    pub multiplier: f64,
}

/// What the rows add to a certificate.
#[derive(Debug, Default)]
pub(super) struct RowSums {
    violation: f64,
    relative_violation: f64,
    stray_multiplier: f64,
    penalty: f64,
    gap: f64,
}

impl RowSums {
    pub fn add(&mut self, row: &RowPoint, soft: Option<super::SoftPenalty>) {
        let violation = (row.value - row.upper).max(row.lower - row.value).max(0.0);
        let pushes_up = row.multiplier < 0.0;
        let bound = if pushes_up { row.lower } else { row.upper };
        let mut size = row.multiplier.abs();
        if bound.is_infinite() {
            self.stray_multiplier = self.stray_multiplier.max(size);
            size = 0.0;
        }
        let room = if pushes_up {
            row.value - bound
        } else {
            bound - row.value
        };
        let Some(soft) = soft else {
            self.violation = self.violation.max(violation);
            let scale = row.value.abs().max(1.0);
            self.relative_violation = self.relative_violation.max(violation / scale);
            self.gap += if size > 0.0 { (size * room).abs() } else { 0.0 };
            return;
        };
        let cost = soft.cost(violation);
        self.penalty += cost;
        let excess = (size - soft.linear).max(0.0);
        let conjugate = if soft.quadratic > 0.0 {
            excess * excess / (2.0 * soft.quadratic)
        } else {
            // Without a quadratic part no multiplier above ρ is possible.
            self.stray_multiplier = self.stray_multiplier.max(excess);
            size -= excess;
            0.0
        };
        let pressed = if size > 0.0 { size * room } else { 0.0 };
        self.gap += (cost + conjugate + pressed).abs();
    }
}
