//! The factor of windows in a chosen row order against the matrix itself.

use deepc_core::faer::{Mat, MatRef};
use deepc_core::hankel::{FactorMethod, OnesRow, block_hankel, factor_windows, leading_condition};

fn channel(seed: usize, samples: usize) -> Vec<f64> {
    // Fractions of a quadratic sequence: far from any low order.
    let value = |k: usize| ((k * k + seed * k) as f64 * 0.618_034 + seed as f64 * 0.37).fract();
    (0..samples).map(|k| value(k) + 4.0).collect()
}

/// Row r of the stack goes to (7r + 3) mod n, n and 7 without common factor.
fn shuffled(rows: usize) -> Vec<usize> {
    (0..rows).map(|r| (7 * r + 3) % rows).collect()
}

fn gram(a: MatRef<'_, f64>) -> Mat<f64> {
    a * a.transpose()
}

#[test]
fn the_gram_matrix_is_that_of_the_rows_in_their_order() {
    const DEPTH: usize = 5;
    // The second record is shorter than a window.
    let series: Vec<Vec<Vec<f64>>> = [90, 4, 60]
        .iter()
        .map(|&samples| (1..4).map(|c| channel(c, samples)).collect())
        .collect();
    let records: Vec<Vec<&[f64]>> = series
        .iter()
        .map(|record| record.iter().map(Vec::as_slice).collect())
        .collect();
    let matrices: Vec<_> = (series.iter())
        .map(|r| Mat::from_fn(r[0].len(), 3, |k, c| r[c][k]))
        .collect();
    let views: Vec<_> = matrices.iter().map(Mat::as_ref).collect();
    let stacked = block_hankel(&views, DEPTH);
    let (rows, columns) = stacked.shape();
    let positions = shuffled(rows);
    for ones in [OnesRow::Without, OnesRow::OnTop] {
        let top = usize::from(ones == OnesRow::OnTop);
        let mut expected = Mat::from_fn(top + rows, columns, |_, _| 1.0);
        for (row, &position) in positions.iter().enumerate() {
            expected.row_mut(top + position).copy_from(stacked.row(row));
        }
        let expected = gram(expected.as_ref());
        for method in [FactorMethod::Gram, FactorMethod::BlockQr] {
            let (lower, report) = factor_windows(&records, DEPTH, &positions, ones, method);
            assert_eq!(report.method, method);
            assert_eq!(report.columns, columns);
            assert_eq!(lower.shape(), (top + rows, top + rows));
            let apart = (gram(lower.as_ref()) - &expected).norm_max() / expected.norm_max();
            assert!(apart < 1e-14, "{ones:?} {method:?}: {apart:e}");
            let upper = (0..rows).flat_map(|j| (0..j).map(move |i| (i, j)));
            assert!(upper.into_iter().all(|(i, j)| lower[(i, j)] == 0.0));
        }
    }
}

#[test]
fn without_a_window_there_is_no_column() {
    let short = [1.0, 2.0];
    let (lower, report) = factor_windows(
        &[vec![&short]],
        3,
        &[0, 1, 2],
        OnesRow::Without,
        FactorMethod::Gram,
    );
    assert_eq!((lower.shape(), report.columns), ((3, 0), 0));
}

#[test]
#[should_panic(expected = "row 1 is given twice")]
fn an_order_that_is_none_is_a_mistake() {
    let series = [1.0; 9];
    let _ = factor_windows(
        &[vec![&series]],
        3,
        &[0, 1, 1],
        OnesRow::Without,
        FactorMethod::Gram,
    );
}

#[test]
fn the_condition_of_a_leading_triangle_is_estimated() {
    let lower = Mat::from_fn(30, 30, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => 10.0_f64.powf(-(i as f64) / 10.0),
        std::cmp::Ordering::Greater => 0.01 * ((3 * i + j * j) as f64).sin(),
    });
    for size in [1, 10, 30] {
        let sigma = lower.submatrix(0, 0, size, size).singular_values().unwrap();
        let exact = sigma[0] / sigma[size - 1];
        let found = leading_condition(lower.as_ref(), size);
        assert!(found > 0.9 * exact && found < 1.000_001 * exact, "{size}");
    }
    let mut singular = lower;
    singular[(4, 4)] = 0.0;
    let found = leading_condition(singular.as_ref(), 10);
    assert!(found.is_infinite() && found > 0.0);
}
