//! Least squares over any number of rows in the memory of a triangle.

use deepc_core::faer::{Mat, MatMut, MatRef};

use crate::error::SysidError;
use crate::kernels::Block;

/// The triangular factor of a matrix whose rows come a block at a time: Householder QR of the
/// triangle so far over the block, as accurate as that of all rows at once.
pub(crate) struct StreamedQr {
    columns: usize,
    /// R, row by row; rows from `occupied` on are zero.
    triangle: Vec<f64>,
    occupied: usize,
    waiting: Block,
}

impl StreamedQr {
    /// For rows of `columns` numbers; `block` rows are taken at once.
    pub fn new(columns: usize, block: usize) -> Self {
        Self {
            columns,
            triangle: vec![0.0; columns * columns],
            occupied: 0,
            waiting: Block::new(columns, block),
        }
    }

    /// Room for the next `count` rows (at most the block), to be overwritten whole.
    pub fn rows(&mut self, count: usize) -> MatMut<'_, f64> {
        if !self.waiting.has_room(count) {
            self.compress();
        }
        self.waiting.append(count)
    }

    fn compress(&mut self) {
        self.occupied = (self.occupied + self.waiting.rows()).min(self.columns);
        self.waiting.fold_into(&mut self.triangle);
        // What fewer rows than columns leave there is rounding.
        self.triangle[self.occupied * self.columns..].fill(0.0);
    }

    /// R, upper triangular (trapezoidal if there were fewer rows than columns).
    pub fn triangle(&mut self) -> MatRef<'_, f64> {
        self.compress();
        let all = MatRef::from_row_major_slice(&self.triangle, self.columns, self.columns);
        all.subrows(0, self.occupied)
    }
}

/// A least-squares solution of smallest (scaled) norm.
pub(crate) struct Solution {
    pub x: Mat<f64>,
}

/// Minimises `‖M x − y‖` column by column from the triangle of `[M y]`, where M has `unknowns`
/// columns. The columns of M are scaled to length 1; directions whose singular value is below
/// `tolerance` times the largest are left at zero.
pub(crate) fn solve(
    triangle: MatRef<'_, f64>,
    unknowns: usize,
    tolerance: f64,
) -> Result<Solution, SysidError> {
    let rows = triangle.nrows().min(unknowns);
    let (m, y) = triangle.subrows(0, rows).split_at_col(unknowns);
    let lengths: Vec<f64> = (0..unknowns).map(|j| m.col(j).norm_l2()).collect();
    let scales: Vec<f64> = lengths
        .iter()
        .map(|&length| if length > 0.0 { 1.0 / length } else { 0.0 })
        .collect();
    let scaled = Mat::from_fn(rows, unknowns, |i, j| m[(i, j)] * scales[j]);
    let svd = thin_svd(
        scaled.as_ref(),
        "the singular values of a least-squares problem",
    )?;
    let rank = svd.rank(tolerance);
    let mut coordinates = svd.u.subcols(0, rank).transpose() * y;
    for i in 0..rank {
        for j in 0..coordinates.ncols() {
            coordinates[(i, j)] /= svd.values[i];
        }
    }
    let mut x = svd.v.subcols(0, rank) * coordinates;
    for j in 0..x.ncols() {
        for i in 0..unknowns {
            x[(i, j)] *= scales[i];
        }
    }
    Ok(Solution { x })
}

/// `M = U diag(values) Vᵀ`, thin, values falling.
#[derive(Debug, Clone)]
pub(crate) struct ThinSvd {
    pub u: Mat<f64>,
    pub values: Vec<f64>,
    pub v: Mat<f64>,
}

impl ThinSvd {
    /// How many values are above `tolerance` times the first.
    pub fn rank(&self, tolerance: f64) -> usize {
        let first = self.values.first().copied().unwrap_or(0.0);
        self.values
            .iter()
            .take_while(|&&value| value > tolerance * first)
            .count()
    }
}

/// The thin singular value decomposition; `what` says in the error what it was for.
pub(crate) fn thin_svd(m: MatRef<'_, f64>, what: &'static str) -> Result<ThinSvd, SysidError> {
    if !m.is_all_finite() {
        return Err(SysidError::Numerical {
            what,
            why: "an entry is NaN or infinite".into(),
        });
    }
    if m.nrows() == 0 || m.ncols() == 0 {
        return Ok(ThinSvd {
            u: Mat::zeros(m.nrows(), 0),
            values: Vec::new(),
            v: Mat::zeros(m.ncols(), 0),
        });
    }
    let svd = m.thin_svd().map_err(|_| SysidError::Numerical {
        what,
        why: "the singular value decomposition did not converge".into(),
    })?;
    let values = svd.S().column_vector();
    Ok(ThinSvd {
        u: svd.U().to_owned(),
        values: values.iter().copied().collect(),
        v: svd.V().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use deepc_core::faer::Scale;

    use super::*;

    fn wave(rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |i, j| {
            ((7 * i + 3 * j * j + i * j) as f64).sin()
        })
    }

    #[test]
    fn blocks_give_the_triangle_of_the_whole() {
        for rows in [3, 40, 101] {
            let m = wave(rows, 6);
            let mut qr = StreamedQr::new(6, 10);
            let mut first = 0;
            while first < rows {
                let count = (rows - first).min(7);
                qr.rows(count).copy_from(m.subrows(first, count));
                first += count;
            }
            let r = qr.triangle();
            assert_eq!(r.nrows(), rows.min(6));
            let error = (r.transpose() * r - m.transpose() * &m).norm_max();
            assert!(error < 1e-12, "{rows} rows: {error:e}");
            assert!((0..r.nrows()).all(|i| (0..i).all(|j| r[(i, j)] == 0.0)));
        }
    }

    #[test]
    fn the_triangle_is_that_of_another_library_whatever_the_scale() {
        for (columns, scale) in [(1, 1.0), (5, 1.0), (13, 1e-170), (22, 1e200), (40, 1.0)] {
            let m = wave(150, columns) * Scale(scale);
            let mut qr = StreamedQr::new(columns, 64);
            for first in (0..150).step_by(50) {
                qr.rows(50).copy_from(m.subrows(first, 50));
            }
            let r = qr.triangle();
            let expected = m.qr();
            let expected = expected.thin_R();
            // Rows are known up to their signs.
            for i in 0..columns {
                let sign = (r[(i, i)] * expected[(i, i)]).signum();
                for j in i..columns {
                    let error = (r[(i, j)] - sign * expected[(i, j)]).abs() / scale;
                    assert!(error < 1e-11, "{columns} columns, ({i}, {j}): {error:e}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_stays_visible() {
        for (rows, value) in [(17..18, f64::NAN), (0..30, f64::NAN), (3..4, f64::INFINITY)] {
            let mut m = wave(30, 3);
            rows.for_each(|i| m[(i, 1)] = value);
            let mut qr = StreamedQr::new(3, 64);
            qr.rows(30).copy_from(&m);
            assert!(!qr.triangle().is_all_finite());
        }
    }

    #[test]
    fn dependent_and_empty_columns_take_the_smallest_solution() {
        let mut m = wave(30, 5);
        for i in 0..30 {
            m[(i, 1)] = 0.0;
            m[(i, 2)] = m[(i, 0)];
            m[(i, 4)] = 3.0 * m[(i, 0)] - 1e9 * m[(i, 3)];
        }
        let mut qr = StreamedQr::new(5, 64);
        qr.rows(30).copy_from(&m);
        let solution = solve(qr.triangle(), 4, 1e-12).unwrap();
        let expected = [1.5, 0.0, 1.5, -1e9];
        for (i, expected) in expected.into_iter().enumerate() {
            let found = solution.x[(i, 0)];
            assert!((found - expected).abs() < 1e-5, "{i}: {found}");
        }
    }
}
