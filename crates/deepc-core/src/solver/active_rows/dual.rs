//! The small dual program over the working set, by Clarabel.

use clarabel::solver::{DefaultSolver, IPSolver, SupportedConeT};
use faer::Mat;

use super::refine::RowState;
use super::{RowSide, WorkingRow};
use crate::solver::QpStatus;
use crate::solver::clarabel_settings::{ClarabelSettings, Remaining, clarabel_matrix, translate};

/// One variable of the dual. The multiplier of a row with both penalties is the sum of two:
/// the part up to ρ is free, the part beyond costs μ²/(2w).
struct DualVariable {
    working: usize,
    /// Cost beside G: 1/w, or 0.
    price: f64,
    /// ρ, if the variable may not exceed it.
    cap: Option<f64>,
    free: bool,
}

/// Solves min ½μᵀ(SGS + diag price)μ − dᵀμ over the working set, with S the signs of the sides
/// and d the violations at the unconstrained optimum, and writes multipliers and states.
/// Returns the status (`Solved` means a finite point; `Infeasible` that the rows contradict each
/// other) and the iterations.
pub(super) fn solve(
    working: &mut [WorkingRow],
    gram: &Mat<f64>,
    unconstrained: &[f64],
    settings: ClarabelSettings,
    remaining: Remaining,
) -> (QpStatus, u32) {
    let variables = variables(working);
    let n = variables.len();
    // Clarabel's tolerances are absolute below 1: multipliers are given in units of `size`.
    let size = working
        .iter()
        .map(|row| row.violation(unconstrained[row.row]).abs())
        .fold(0.0, f64::max);
    let size = if size.is_normal() { size } else { 1.0 };
    let mut hessian = Vec::with_capacity(n * (n + 1) / 2);
    let mut linear = Vec::with_capacity(n);
    let mut rows = Vec::new();
    let mut right_hand_side = Vec::new();
    for (j, variable) in variables.iter().enumerate() {
        let own = &working[variable.working];
        for (i, other) in variables[..=j].iter().enumerate() {
            let other_row = &working[other.working];
            let mut value = own.sign() * other_row.sign() * gram[(other_row.row, own.row)];
            if i == j {
                value += variable.price;
            }
            hessian.push((i, j, value));
        }
        linear.push(-own.violation(unconstrained[own.row]) / size);
        if !variable.free {
            rows.push((right_hand_side.len(), j, -1.0));
            right_hand_side.push(0.0);
        }
        if let Some(cap) = variable.cap {
            // Divided by ρ, so that a large one does not loosen Clarabel's relative tolerance.
            rows.push((right_hand_side.len(), j, size / cap));
            right_hand_side.push(1.0);
        }
    }
    let cones = [SupportedConeT::NonnegativeConeT(right_hand_side.len())];
    let matrices = clarabel_matrix(n, n, hessian)
        .and_then(|p| Ok((p, clarabel_matrix(right_hand_side.len(), n, rows)?)));
    let Ok((hessian, rows)) = matrices else {
        return (QpStatus::NumericalError, 0);
    };
    let mut native = settings.native(false);
    remaining.limit(&mut native);
    let solver = DefaultSolver::new(&hessian, &linear, &rows, &right_hand_side, &cones, native);
    let Ok(mut solver) = solver else {
        return (QpStatus::NumericalError, 0);
    };
    solver.solve();
    let point = &solver.solution;
    let status = match translate(point.status) {
        // An unbounded dual is a contradiction among the rows.
        QpStatus::Unbounded => QpStatus::Infeasible,
        QpStatus::Infeasible => QpStatus::NumericalError,
        other => other,
    };
    if status == QpStatus::Solved && point.x.iter().any(|value| !value.is_finite()) {
        return (QpStatus::NumericalError, point.iterations);
    }
    if status == QpStatus::Solved {
        for row in working.iter_mut() {
            row.multiplier = 0.0;
        }
        for (variable, &value) in variables.iter().zip(&point.x) {
            let value = size * if variable.free { value } else { value.max(0.0) };
            let value = variable.cap.map_or(value, |cap| value.min(cap));
            working[variable.working].multiplier += value;
        }
        guess_states(working, gram, unconstrained);
    }
    (status, point.iterations)
}

fn variables(working: &[WorkingRow]) -> Vec<DualVariable> {
    let mut variables = Vec::with_capacity(working.len());
    for (index, row) in working.iter().enumerate() {
        let variable = |price, cap| DualVariable {
            working: index,
            price,
            cap,
            free: row.side == RowSide::Equality,
        };
        let Some(penalty) = row.penalty else {
            variables.push(variable(0.0, None));
            continue;
        };
        if penalty.linear > 0.0 {
            variables.push(variable(0.0, Some(penalty.linear)));
        }
        if penalty.quadratic > 0.0 {
            variables.push(variable(1.0 / penalty.quadratic, None));
        }
    }
    variables
}

/// At an interior-point solution one factor of every complementary pair is much smaller than
/// the other: it is taken to be the zero one.
fn guess_states(working: &mut [WorkingRow], gram: &Mat<f64>, unconstrained: &[f64]) {
    let violations: Vec<f64> = working
        .iter()
        .map(|row| {
            let pushed = working
                .iter()
                .map(|other| gram[(other.row, row.row)] * other.sign() * other.multiplier);
            row.violation(unconstrained[row.row] - pushed.sum::<f64>())
        })
        .collect();
    for (row, violation) in working.iter_mut().zip(violations) {
        row.state = match row.penalty {
            _ if row.side == RowSide::Equality => RowState::Tight,
            None if row.multiplier > -violation => RowState::Tight,
            None => RowState::Free,
            Some(_) if row.multiplier <= -violation => RowState::Free,
            Some(penalty) if penalty.linear > 0.0 => {
                if violation > penalty.linear - row.multiplier {
                    RowState::Exceeded
                } else {
                    RowState::Tight
                }
            }
            Some(_) => RowState::Exceeded,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::{SoftPenalty, SolveBudget};

    /// min ½(x − 2)² with the row x ≤ 1: the multiplier is 2 − x.
    fn multiplier_of(penalty: Option<SoftPenalty>) -> (f64, RowState) {
        let mut working = [WorkingRow {
            row: 0,
            side: RowSide::Upper,
            bound: 1.0,
            penalty,
            state: RowState::Tight,
            multiplier: 0.0,
        }];
        let gram = Mat::identity(1, 1);
        let remaining = Remaining::of(&SolveBudget::generous(), 0, 0.0);
        let settings = ClarabelSettings::default();
        let (status, _) = solve(&mut working, &gram, &[2.0], settings, remaining);
        assert_eq!(status, QpStatus::Solved);
        (working[0].multiplier, working[0].state)
    }

    #[test]
    fn the_small_dual_prices_every_kind_of_row() {
        let soft = |linear, quadratic| Some(SoftPenalty { linear, quadratic });
        for (penalty, multiplier, state) in [
            (None, 1.0, RowState::Tight),
            (soft(5.0, 0.0), 1.0, RowState::Tight),
            (soft(0.25, 0.0), 0.25, RowState::Exceeded),
            (soft(0.0, 3.0), 0.75, RowState::Exceeded),
            (soft(0.4, 1.0), 0.7, RowState::Exceeded),
            (soft(4.0, 1.0), 1.0, RowState::Tight),
        ] {
            let found = multiplier_of(penalty);
            assert!(
                (found.0 - multiplier).abs() < 1e-6,
                "{penalty:?}: {found:?}"
            );
            assert_eq!(found.1, state, "{penalty:?}");
        }
    }
}
