//! Small dense problems that all estimators share.

use deepc_core::faer::linalg::solvers::SolveLstsq;
use deepc_core::faer::{Mat, MatRef};

use crate::error::SysidError;
use crate::least_squares::thin_svd;

/// Below this ratio of pivots a least-squares problem is taken for one without full rank. A QR
/// decomposition leaves rounding of about 1e-15 where a pivot should be 0.
const PIVOT_TOLERANCE: f64 = 1e-12;

/// Singular values below this fraction of the largest are rounding.
const SINGULAR_TOLERANCE: f64 = 1e-13;

/// X that minimises ‖AX − B‖, A k×n; the shortest one if A does not have full column rank.
pub(crate) fn least_squares(
    a: MatRef<'_, f64>,
    b: MatRef<'_, f64>,
) -> Result<Mat<f64>, SysidError> {
    if a.nrows() >= a.ncols() {
        let qr = a.col_piv_qr();
        let r = qr.thin_R();
        let n = a.ncols();
        // The pivots of this decomposition fall.
        if n == 0 || r[(n - 1, n - 1)].abs() > PIVOT_TOLERANCE * r[(0, 0)].abs() {
            return Ok(qr.solve_lstsq(b));
        }
    }
    Ok(pseudo_inverse(a)? * b)
}

/// The pseudo-inverse of A.
pub(crate) fn pseudo_inverse(a: MatRef<'_, f64>) -> Result<Mat<f64>, SysidError> {
    let svd = thin_svd(a, "a singular value decomposition")?;
    let rank = svd.rank(SINGULAR_TOLERANCE);
    let scaled = Mat::from_fn(a.ncols(), rank, |i, j| svd.v[(i, j)] / svd.values[j]);
    Ok(scaled * svd.u.subcols(0, rank).transpose())
}

/// L of A = LQ with orthonormal rows of Q, n×n for A n×k, k ≥ n: the same Gram matrix and the same
/// left singular vectors, in fewer columns. A itself if it has no more columns than rows.
pub(crate) fn compressed(a: MatRef<'_, f64>) -> Mat<f64> {
    if a.ncols() <= a.nrows() {
        return a.to_owned();
    }
    let r = a.transpose().qr();
    let r = r.thin_R();
    Mat::from_fn(
        a.nrows(),
        a.nrows(),
        |i, j| if j <= i { r[(j, i)] } else { 0.0 },
    )
}

/// (A + Aᵀ)/2.
pub(crate) fn symmetric_part(a: MatRef<'_, f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
        f64::midpoint(a[(i, j)], a[(j, i)])
    })
}

#[cfg(test)]
mod tests {
    use deepc_core::faer::mat;

    use super::*;

    #[test]
    fn least_squares_solves_and_takes_the_shortest_of_many() {
        let a = mat![[1.0, 2.0], [3.0, 4.0], [5.0, 7.0]];
        let x = mat![[1.0, -1.0], [2.0, 0.5]];
        let found = least_squares(a.as_ref(), (&a * &x).as_ref()).unwrap();
        assert!((found - &x).norm_max() < 1e-14);
        let singular = mat![[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]];
        let right = mat![[2.0], [4.0], [6.0]];
        let found = least_squares(singular.as_ref(), right.as_ref()).unwrap();
        assert!((found - mat![[1.0], [1.0]]).norm_max() < 1e-14);
    }

    #[test]
    fn compression_keeps_the_gram_matrix() {
        let a = Mat::from_fn(3, 8, |i, j| ((3 * i + j * j) as f64).sin());
        let lower = compressed(a.as_ref());
        assert_eq!(lower.shape(), (3, 3));
        assert!((&lower * lower.transpose() - &a * a.transpose()).norm_max() < 1e-14);
    }
}
