//! Two ways to scale a program before OSQP scales it once more.

use crate::solver::sizes::{Sizes, power_of_two};
use crate::solver::{QpProblem, SoftPenalty};

/// OSQP's own scaling leaves rows and columns below this as they are, and stops at its inverse.
const LEFT_ALONE: f64 = 1e-4;

/// Penalties in one program that differ by more than this are not left to OSQP's scaling.
const PENALTY_SPREAD: f64 = 1e8;

/// Who scales variables and rows. All factors are powers of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scaling {
    /// OSQP. On `DeePC` problems as written it finds the active rows several times earlier than
    /// with the other scaling.
    Osqps,
    /// This crate: every curvature 1, every row of length 1. Rows, variables or penalties many
    /// orders of magnitude apart need it.
    Ours,
}

impl Scaling {
    /// What a program needs.
    pub fn choose(problem: &QpProblem) -> Self {
        let mut rows = vec![0.0_f64; problem.row_count()];
        let mut columns = vec![0.0_f64; problem.variable_count()];
        for (i, j, value) in problem.rows().triplets() {
            rows[i] = rows[i].max(value.abs());
            columns[j] = columns[j].max(value.abs());
        }
        let unusual = |size: &f64| *size > 0.0 && !(LEFT_ALONE..=1.0 / LEFT_ALONE).contains(size);
        let penalties = || {
            let soft = problem.soft().iter().flatten();
            soft.flat_map(|soft| [soft.linear, soft.quadratic])
                .filter(|penalty| *penalty > 0.0)
        };
        let (low, high) = penalties().fold((f64::INFINITY, 0.0_f64), |(low, high), penalty| {
            (low.min(penalty), high.max(penalty))
        });
        if rows.iter().chain(&columns).any(unusual) || high / low > PENALTY_SPREAD {
            Self::Ours
        } else {
            Self::Osqps
        }
    }

    /// tⱼ, the factor of every variable.
    pub fn variable_sizes(self, sizes: &Sizes) -> Vec<f64> {
        let curvature = sizes.curvature.iter();
        curvature
            .map(|p| match self {
                Self::Osqps => 1.0,
                Self::Ours => power_of_two((sizes.cost / p).sqrt()),
            })
            .collect()
    }

    /// Divisor of a row of this length.
    pub fn row_size(self, length: f64) -> f64 {
        match self {
            Self::Osqps => 1.0,
            Self::Ours => power_of_two(length),
        }
    }
}

/// Factor of the violation of a row of this size. It keeps the penalty near the size of the
/// program, κ = `cost`: OSQP's tolerance is relative to its largest entry.
pub(super) fn violation_size(penalty: SoftPenalty, row_size: f64, cost: f64) -> f64 {
    power_of_two((cost / penalty.linear).sqrt().min(row_size))
}
