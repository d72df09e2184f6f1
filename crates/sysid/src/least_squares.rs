//! Least squares over any number of rows in the memory of a triangle.

use deepc_core::faer::dyn_stack::{MemBuffer, MemStack};
use deepc_core::faer::linalg::qr::no_pivoting::factor::{
    qr_in_place, qr_in_place_scratch, recommended_block_size,
};
use deepc_core::faer::{Mat, MatMut, MatRef, Par, Spec};

use crate::error::SysidError;

/// The triangular factor of a matrix whose rows come a block at a time: Householder QR of the
/// triangle so far over the block, as accurate as that of all rows at once.
pub(crate) struct StreamedQr {
    /// The triangle (first `occupied` rows), then what waits.
    stack: Mat<f64>,
    occupied: usize,
    filled: usize,
    coefficients: Mat<f64>,
    memory: MemBuffer,
}

impl StreamedQr {
    /// For rows of `columns` numbers; `block` rows are taken at once.
    pub fn new(columns: usize, block: usize) -> Self {
        let rows = columns + block.max(columns).max(1);
        let size = recommended_block_size::<f64>(rows, columns).max(1);
        let scratch = qr_in_place_scratch::<f64>(rows, columns, size, Par::Seq, Spec::default());
        Self {
            stack: Mat::zeros(rows, columns),
            occupied: 0,
            filled: 0,
            coefficients: Mat::zeros(size, columns),
            memory: MemBuffer::new(scratch),
        }
    }

    /// Room for the next `count` rows (at most the block), to be overwritten whole.
    pub fn rows(&mut self, count: usize) -> MatMut<'_, f64> {
        if self.filled + count > self.stack.nrows() {
            self.compress();
        }
        let first = self.filled;
        self.filled += count;
        self.stack.subrows_mut(first, count)
    }

    fn compress(&mut self) {
        let kept = self.filled.min(self.stack.ncols());
        if self.filled == self.occupied || kept == 0 {
            return;
        }
        qr_in_place(
            self.stack.subrows_mut(0, self.filled),
            self.coefficients.subcols_mut(0, kept),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Spec::default(),
        );
        for j in 0..self.stack.ncols() {
            // Below the diagonal are the reflectors.
            let column = &mut self.stack.col_as_slice_mut(j)[..kept];
            if j + 1 < kept {
                column[j + 1..].fill(0.0);
            }
        }
        self.occupied = kept;
        self.filled = kept;
    }

    /// R, upper triangular (trapezoidal if there were fewer rows than columns).
    pub fn triangle(&mut self) -> MatRef<'_, f64> {
        self.compress();
        self.stack.subrows(0, self.occupied)
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
