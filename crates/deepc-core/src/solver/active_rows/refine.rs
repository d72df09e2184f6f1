//! From a guess of which rows push to multipliers that are exact to rounding.

use faer::{Col, Mat, Side};

use super::{RowSide, WorkingRow};
use faer::prelude::Solve;

/// What a row of the working set does at the optimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowState {
    /// Does not push: μ = 0, not violated.
    Free,
    /// Pushes and stands at its bound.
    Tight,
    /// Soft and violated by s > 0: μ = ρ + w·s.
    Exceeded,
}

/// Guesses tried before Clarabel is asked.
const MAX_GUESSES: u32 = 8;

/// Rounding allowed in a sign, relative to the largest number of its kind.
const SIGN_TOLERANCE: f64 = 1e-12;

/// Solves the optimality conditions for the states guessed, corrects the states whose sign
/// comes out wrong, and repeats (a primal-dual active-set iteration; Hintermüller, Ito, Kunisch
/// 2003). Returns whether it ended in a consistent set (multipliers and states are then optimal
/// for the working set) and the number of factorisations, at most `allowed`.
pub(super) fn refine(
    working: &mut [WorkingRow],
    gram: &Mat<f64>,
    unconstrained: &[f64],
    allowed: u32,
) -> (bool, u32) {
    let allowed = allowed.min(MAX_GUESSES);
    for guess in 1..=allowed {
        if !solve_for_states(working, gram, unconstrained) {
            return (false, guess);
        }
        if !correct_states(working, gram, unconstrained) {
            return (true, guess);
        }
    }
    (false, allowed)
}

/// `(G_AA + diag ε) μ_A = d_A + ερ − G_AC μ_C` over the pushing rows A, where ε = 1/w for a row
/// that is exceeded and C are the rows whose multiplier is fixed at ρ (exceeded, w = 0).
fn solve_for_states(working: &mut [WorkingRow], gram: &Mat<f64>, unconstrained: &[f64]) -> bool {
    let mut solved = Vec::with_capacity(working.len());
    for (index, row) in working.iter_mut().enumerate() {
        row.multiplier = 0.0;
        match (row.state, row.penalty) {
            (RowState::Free, _) => {}
            (RowState::Exceeded, Some(penalty)) if penalty.quadratic <= 0.0 => {
                row.multiplier = penalty.linear;
            }
            _ => solved.push(index),
        }
    }
    if solved.is_empty() {
        return true;
    }
    let entry = |a: &WorkingRow, b: &WorkingRow| a.sign() * b.sign() * gram[(a.row, b.row)];
    let mut matrix = Mat::from_fn(solved.len(), solved.len(), |i, j| {
        entry(&working[solved[i]], &working[solved[j]])
    });
    let mut right = Col::zeros(solved.len());
    for (i, &index) in solved.iter().enumerate() {
        let row = &working[index];
        right[i] = row.violation(unconstrained[row.row]);
        if let (RowState::Exceeded, Some(penalty)) = (row.state, row.penalty) {
            matrix[(i, i)] += 1.0 / penalty.quadratic;
            right[i] += penalty.linear / penalty.quadratic;
        }
        for fixed in working.iter().filter(|other| other.multiplier > 0.0) {
            right[i] -= entry(row, fixed) * fixed.multiplier;
        }
    }
    let Ok(factor) = matrix.llt(Side::Lower) else {
        return false;
    };
    // A pivot this small means dependent rows: their multipliers are not determined.
    let pivots = factor.L().diagonal().column_vector().iter();
    if pivots.fold(f64::INFINITY, |least, &pivot| least.min(pivot)) < 1e-7 {
        return false;
    }
    let mut multipliers = factor.solve(&right);
    let residual = &right - &matrix * &multipliers;
    multipliers += factor.solve(&residual);
    for (i, &index) in solved.iter().enumerate() {
        working[index].multiplier = multipliers[i];
    }
    working.iter().all(|row| row.multiplier.is_finite())
}

/// Moves every row whose multiplier or violation contradicts its state; whether there was one.
fn correct_states(working: &mut [WorkingRow], gram: &Mat<f64>, unconstrained: &[f64]) -> bool {
    let largest = working
        .iter()
        .fold(0.0_f64, |max, row| max.max(row.multiplier.abs()));
    let mut changed = false;
    for index in 0..working.len() {
        let row = working[index];
        if row.side == RowSide::Equality {
            continue;
        }
        let pushed = working
            .iter()
            .map(|other| gram[(other.row, row.row)] * other.sign() * other.multiplier);
        let violation = row.violation(unconstrained[row.row] - pushed.sum::<f64>());
        let sizes = unconstrained[row.row].abs() + row.bound.abs() + largest;
        let rounding = SIGN_TOLERANCE * sizes.max(f64::MIN_POSITIVE);
        let cap = row.penalty.map_or(f64::INFINITY, |penalty| penalty.linear);
        let state = match row.state {
            RowState::Free if violation > rounding => {
                if cap > 0.0 {
                    RowState::Tight
                } else {
                    RowState::Exceeded
                }
            }
            RowState::Tight if row.multiplier < 0.0 => RowState::Free,
            RowState::Tight if row.multiplier > cap => RowState::Exceeded,
            RowState::Exceeded if violation < -rounding => {
                if cap > 0.0 {
                    RowState::Tight
                } else {
                    RowState::Free
                }
            }
            state => state,
        };
        if state != row.state {
            working[index].state = state;
            changed = true;
        }
    }
    changed
}
