//! The triangular factor of windows of any channels, rows in any order: what subspace methods
//! start from.

use faer::{Mat, MatRef};

use super::factor::{FactorMethod, FactorReport, OnesRow, factor, gram_condition, starts};

/// Rᵀ of a block Hankel matrix of any channels with its rows in any order, n×min(n, J), lower
/// triangular, in bounded memory.
///
/// `records` holds the channels of each record; records with fewer than `depth` samples
/// contribute nothing, and no column crosses a record boundary. Row r of the time-major stack
/// ([`stacked_position`](super::stacked_position)) becomes row `positions[r]`, below the row of ones if there is one.
/// [`FactorMethod::Gram`] falls back if it is not exact enough.
///
/// # Panics
/// `positions` does not hold each of 0 … c·`depth` − 1 once.
#[must_use]
pub fn factor_windows(
    records: &[Vec<&[f64]>],
    depth: usize,
    positions: &[usize],
    ones: OnesRow,
    method: FactorMethod,
) -> (Mat<f64>, FactorReport) {
    let mut seen = vec![false; positions.len()];
    for &position in positions {
        assert!(!seen[position], "row {position} is given twice");
        seen[position] = true;
    }
    let long: Vec<_> = (records.iter())
        .filter(|record| starts(record, depth) > 0)
        .cloned()
        .collect();
    if let Some(first) = long.first() {
        assert_eq!(first.len() * depth, positions.len(), "rows");
        return factor(&long, depth, positions, ones, method);
    }
    let rows = positions.len() + usize::from(ones == OnesRow::OnTop);
    let report = FactorReport {
        method,
        rows,
        columns: 0,
        gram_condition: None,
        fell_back: false,
    };
    (Mat::zeros(rows, 0), report)
}

/// Estimated 2-norm condition number of the leading `size`×`size` triangle of Rᵀ: from below, and
/// seldom by more than a tenth. Infinite if a pivot is 0.
///
/// # Panics
/// `lower` is smaller.
#[must_use]
pub fn leading_condition(lower: MatRef<'_, f64>, size: usize) -> f64 {
    if (0..size).any(|k| lower[(k, k)] == 0.0) {
        return f64::INFINITY;
    }
    let squared = gram_condition(lower.submatrix(0, 0, size, size));
    if squared.is_nan() {
        f64::INFINITY
    } else {
        squared.sqrt()
    }
}
