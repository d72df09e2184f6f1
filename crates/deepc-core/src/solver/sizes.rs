//! Bringing a program to size 1, for solvers whose tolerances are partly absolute.

use super::certificate::{curvature, largest_saving};
use super::problem::{OwnedVectors, QpProblem};

/// What the size of the optimum is judged by.
pub(super) struct Sizes {
    /// Pⱼⱼ.
    pub curvature: Vec<f64>,
    /// `Σⱼ aᵢⱼ²/Pⱼⱼ` over Pⱼⱼ > 0: how easily row i moves.
    mobility: Vec<f64>,
    /// κ.
    pub cost: f64,
}

impl Sizes {
    pub fn new(problem: &QpProblem) -> Self {
        let curvature = curvature(problem);
        let mut mobility = vec![0.0; problem.row_count()];
        for (i, j, value) in problem.rows().triplets() {
            if curvature[j] > 0.0 {
                mobility[i] += value * (value / curvature[j]);
            }
        }
        let logarithms = || curvature.iter().filter(|p| **p > 0.0).map(|p| p.log2());
        let count = logarithms().count().max(1);
        let mean = logarithms().sum::<f64>() / count as f64;
        Self {
            // The solvers cope with large costs by themselves.
            cost: mean.round().min(0.0).exp2(),
            curvature,
            mobility,
        }
    }

    /// s: s²κ is about the largest cost that a single variable can save or a single row can
    /// force from x = 0, and at most 1: no cost is given to a solver smaller than it is.
    pub fn step(&self, problem: &QpProblem, vectors: &OwnedVectors) -> f64 {
        let mut cost = largest_saving(&self.curvature, &vectors.linear);
        for (i, mobility) in self.mobility.iter().enumerate() {
            let distance = vectors.lower[i].max(-vectors.upper[i]).max(0.0);
            if distance > 0.0 && *mobility > 0.0 {
                let forced = 0.5 * distance * (distance / mobility);
                let soft = problem.soft()[i].map(|penalty| penalty.cost(distance));
                cost = cost.max(soft.map_or(forced, |soft| soft.min(forced)));
            }
        }
        power_of_two((cost.min(1.0) / self.cost).sqrt())
    }

    /// Divisors of the rows for steps about as large as `step`. A row is never made to count
    /// for less than 1 in its own units.
    pub fn rows(&self, step: f64) -> Vec<f64> {
        let sizes = self.mobility.iter();
        sizes
            .map(|mobility| power_of_two((mobility * self.cost).sqrt().min(1.0 / step)))
            .collect()
    }
}

/// The nearest power of two; 1 for what is not a proper size.
pub(super) fn power_of_two(size: f64) -> f64 {
    let rounded = size.log2().round().exp2();
    if rounded.is_normal() { rounded } else { 1.0 }
}
