//! Dense kernels on slices. They allocate nothing and run on one thread.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Qr;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, ColMut, ColRef, Mat, MatRef, Par};

/// `out = a·x`.
pub(crate) fn multiply(out: &mut [f64], a: MatRef<'_, f64>, x: &[f64]) {
    let (out, x) = (ColMut::from_slice_mut(out), ColRef::from_slice(x));
    matmul(out, Accum::Replace, a, x, 1.0, Par::Seq);
}

/// `out += scale·a·x`.
pub(crate) fn multiply_add(out: &mut [f64], a: MatRef<'_, f64>, x: &[f64], scale: f64) {
    let (out, x) = (ColMut::from_slice_mut(out), ColRef::from_slice(x));
    matmul(out, Accum::Add, a, x, scale, Par::Seq);
}

/// `x ← lower⁻¹·x`.
pub(crate) fn solve_lower(lower: MatRef<'_, f64>, x: &mut [f64]) {
    solve_lower_triangular_in_place(lower, ColMut::from_slice_mut(x).as_mat_mut(), Par::Seq);
}

/// `x ← upper⁻¹·x`.
pub(crate) fn solve_upper(upper: MatRef<'_, f64>, x: &mut [f64]) {
    solve_upper_triangular_in_place(upper, ColMut::from_slice_mut(x).as_mat_mut(), Par::Seq);
}

/// Inner product.
pub(crate) fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| a * b).sum()
}

/// Largest magnitude; NaN if any entry is NaN.
pub(crate) fn max_abs(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |max, value| {
        if max >= value.abs() || f64::is_nan(max) {
            max
        } else {
            value.abs()
        }
    })
}

/// Takes the part of `x` within the orthonormal columns `span` away; returns what is left, relative
/// to what was there or to entries of size 1, whichever is larger; NaN if there was one. `coordinates` has one entry per column.
pub(crate) fn part_outside(span: MatRef<'_, f64>, x: &mut [f64], coordinates: &mut [f64]) -> f64 {
    let size = dot(x, x).sqrt();
    multiply(coordinates, span.transpose(), x);
    multiply_add(x, span, coordinates, -1.0);
    let unit = (x.len() as f64).sqrt();
    // A NaN is not below the unit.
    dot(x, x).sqrt() / if size < unit { unit } else { size }
}

/// QR decomposition of `aᵀ`, its columns (the rows of `a`) taken in `order` first and then as they
/// stand. Rows of zeros, which change nothing, make the triangular factor square.
pub(crate) fn qr_of_rows(a: MatRef<'_, f64>, order: &[usize]) -> Qr<f64> {
    let (rows, columns) = a.shape();
    let mut transposed = Mat::zeros(columns.max(rows), rows);
    for j in 0..rows {
        let source = a.row(order.get(j).copied().unwrap_or(j));
        let target = transposed.col_mut(j).iter_mut().zip(source.iter());
        target.for_each(|(entry, &value)| *entry = value);
    }
    transposed.qr()
}

/// Rᵀ as a lower triangular matrix with clean zeros, for the upper trapezoidal `r` (k×n, k ≥ n).
pub(crate) fn lower_from_upper(r: MatRef<'_, f64>) -> Mat<f64> {
    let n = r.ncols();
    Mat::from_fn(n, n, |i, j| {
        if j <= i && j < r.nrows() {
            r[(j, i)]
        } else {
            0.0
        }
    })
}
