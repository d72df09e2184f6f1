//! A triangular factor that grows: R of Hᵀ = QR, one column of H or one block of columns at a
//! time. H itself is never held.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{
    qr_in_place, qr_in_place_scratch, recommended_block_size,
};
use faer::{Mat, MatRef, Par};

/// Rᵀ, n×n, lower triangular, so that a row of R is contiguous. `RᵀR = H Hᵀ`; the signs of the
/// diagonal are arbitrary. With fewer than n columns so far, the last columns of Rᵀ are zero.
#[derive(Debug, Clone)]
pub(crate) struct Triangle {
    lower: Mat<f64>,
}

impl Triangle {
    /// Of a matrix with n rows and no column.
    pub fn new(n: usize) -> Self {
        Self {
            lower: Mat::zeros(n, n),
        }
    }

    /// Of a factor that is known, lower triangular.
    pub fn of(lower: Mat<f64>) -> Self {
        Self { lower }
    }

    pub fn lower(&self) -> MatRef<'_, f64> {
        self.lower.as_ref()
    }

    pub fn into_lower(self) -> Mat<f64> {
        self.lower
    }

    pub fn clear(&mut self) {
        self.lower.fill(0.0);
    }

    /// R ← `factor`·R.
    pub fn scale(&mut self, factor: f64) {
        for k in 0..self.lower.ncols() {
            for value in &mut self.lower.col_as_slice_mut(k)[k..] {
                *value *= factor;
            }
        }
    }

    /// `RᵀR ← RᵀR + hhᵀ` by n Givens rotations (Golub, Van Loan, Matrix Computations, 6.5.3).
    /// `column` is h; it is used up.
    pub fn update(&mut self, column: &mut [f64]) {
        for k in 0..self.lower.ncols() {
            let (x, y) = (self.lower[(k, k)], column[k]);
            if y == 0.0 {
                continue;
            }
            let size = x.hypot(y);
            let row = &mut self.lower.col_as_slice_mut(k)[k..];
            rotate(row, &mut column[k..], x / size, y / size);
        }
    }

    /// `RᵀR ← RᵀR − hhᵀ` (the LINPACK downdate: Dongarra et al. 1979, Stewart 1979). With Rᵀa = h
    /// and α² = 1 − ‖a‖², returns α², by which rounding is amplified: the smaller, the more of
    /// some direction was in h alone. Nothing is done, and `None` returned, if α² is below
    /// `least`.
    ///
    /// `column` is h and `row` any n numbers; both are used up.
    pub fn downdate(&mut self, column: &mut [f64], row: &mut [f64], least: f64) -> Option<f64> {
        let n = self.lower.ncols();
        for k in 0..n {
            let pivot = self.lower[(k, k)];
            if pivot == 0.0 {
                return None;
            }
            let value = column[k] / pivot;
            column[k] = value;
            let below = &self.lower.col_as_slice(k)[k + 1..];
            for (x, l) in column[k + 1..].iter_mut().zip(below) {
                *x -= value * l;
            }
        }
        let mut rest = column.iter().fold(1.0, |rest, a| rest - a * a);
        let squared = rest;
        if squared.is_nan() || squared < least {
            return None;
        }
        // Rotations that turn (a, α) into (0, 1), from the last entry up, turn (R, 0) into
        // (R⁻, hᵀ).
        row.fill(0.0);
        let mut alpha = rest.sqrt();
        for k in (0..n).rev() {
            rest += column[k] * column[k];
            let size = rest.sqrt();
            let (cosine, sine) = (alpha / size, column[k] / size);
            rotate(
                &mut self.lower.col_as_slice_mut(k)[k..],
                &mut row[k..],
                cosine,
                -sine,
            );
            alpha = size;
        }
        Some(squared)
    }

    /// Smallest and largest magnitude on the diagonal. (The ratio is a lower bound on the
    /// condition number of R, and for triangular factors of data a good guess.)
    pub fn pivots(&self) -> (f64, f64) {
        let sizes = (0..self.lower.ncols()).map(|k| self.lower[(k, k)].abs());
        sizes.fold((f64::INFINITY, 0.0), |(least, most), size| {
            (least.min(size), most.max(size))
        })
    }
}

/// (x, y) ← (c·x + s·y, c·y − s·x).
fn rotate(x: &mut [f64], y: &mut [f64], c: f64, s: f64) {
    for (x, y) in x.iter_mut().zip(y) {
        let (a, b) = (*x, *y);
        *x = c * a + s * b;
        *y = c * b - s * a;
    }
}

/// Takes columns into a [`Triangle`] a block at a time: the QR decomposition of R over the
/// transposed block, as exact as that of all columns at once. Allocates nothing once made.
pub(crate) struct BlockQr {
    /// Columns that wait, n×B.
    block: Mat<f64>,
    waiting: usize,
    /// Columns taken before, up to n: rows of R that are not zero.
    occupied: usize,
    /// (n + B)×n.
    stack: Mat<f64>,
    coefficients: Mat<f64>,
    memory: MemBuffer,
}

impl BlockQr {
    /// For columns with n rows. The block holds 3n of them: a larger one saves little time (R
    /// goes through every decomposition once more), and costs memory.
    pub fn new(n: usize) -> Self {
        let block = 3 * n.max(1);
        let size = recommended_block_size::<f64>(n + block, n);
        let scratch =
            qr_in_place_scratch::<f64>(n + block, n, size, Par::Seq, faer::Spec::default());
        Self {
            block: Mat::zeros(n, block),
            waiting: 0,
            occupied: 0,
            stack: Mat::zeros(n + block, n),
            coefficients: Mat::zeros(size, n),
            memory: MemBuffer::new(scratch),
        }
    }

    /// Forgets all columns, also those of `triangle`.
    pub fn restart(&mut self, triangle: &mut Triangle) {
        triangle.clear();
        self.waiting = 0;
        self.occupied = 0;
    }

    /// Takes a column, which `write` writes.
    pub fn push(&mut self, triangle: &mut Triangle, write: impl FnOnce(&mut [f64])) {
        write(self.block.col_as_slice_mut(self.waiting));
        self.waiting += 1;
        if self.waiting == self.block.ncols() {
            self.finish(triangle);
        }
    }

    /// Takes in what waits.
    pub fn finish(&mut self, triangle: &mut Triangle) {
        if self.waiting == 0 {
            return;
        }
        let n = self.block.nrows();
        let rows = self.occupied + self.waiting;
        let mut stack = self.stack.subrows_mut(0, rows);
        let lower = triangle.lower.as_ref();
        let (mut top, bottom) = stack.as_mut().split_at_row_mut(self.occupied);
        top.copy_from(lower.subcols(0, self.occupied).transpose());
        let mut bottom = bottom;
        bottom.copy_from(self.block.subcols(0, self.waiting).transpose());
        let kept = rows.min(n);
        let coefficients = self.coefficients.subcols_mut(0, kept);
        qr_in_place(
            stack.as_mut(),
            coefficients,
            Par::Seq,
            MemStack::new(&mut self.memory),
            faer::Spec::default(),
        );
        for k in 0..kept {
            let row = &mut triangle.lower.col_as_slice_mut(k)[k..];
            for (j, value) in row.iter_mut().enumerate() {
                *value = stack[(k, k + j)];
            }
        }
        self.occupied = kept;
        self.waiting = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(n: usize, count: usize) -> Mat<f64> {
        Mat::from_fn(n, count, |i, j| ((7 * i + 3 * j * j + i * j) as f64).sin())
    }

    fn error(triangle: &Triangle, h: MatRef<'_, f64>) -> f64 {
        let lower = triangle.lower();
        (lower * lower.transpose() - h * h.transpose()).norm_max()
    }

    fn is_lower(triangle: &Triangle) -> bool {
        let lower = triangle.lower();
        (0..lower.ncols()).all(|j| (0..j).all(|i| lower[(i, j)] == 0.0))
    }

    #[test]
    fn blocks_rotations_and_the_whole_agree() {
        let n = 6;
        // Fewer columns than rows, one full block, and a block and a part of one.
        for count in [4, 18, 40] {
            let h = columns(n, count);
            let (mut one_by_one, mut by_blocks) = (Triangle::new(n), Triangle::new(n));
            let mut qr = BlockQr::new(n);
            for j in 0..count {
                one_by_one.update(&mut h.col_as_slice(j).to_vec());
                qr.push(&mut by_blocks, |column| {
                    column.copy_from_slice(h.col_as_slice(j));
                });
            }
            qr.finish(&mut by_blocks);
            for triangle in [&one_by_one, &by_blocks] {
                assert!(error(triangle, h.as_ref()) < 1e-13);
                assert!(is_lower(triangle));
            }
        }
    }

    #[test]
    fn a_restarted_decomposition_forgets() {
        let h = columns(4, 9);
        let mut triangle = Triangle::new(4);
        let mut qr = BlockQr::new(4);
        qr.push(&mut triangle, |column| column.fill(3.0));
        qr.finish(&mut triangle);
        qr.push(&mut triangle, |column| column.fill(5.0));
        qr.restart(&mut triangle);
        for j in 0..9 {
            qr.push(&mut triangle, |column| {
                column.copy_from_slice(h.col_as_slice(j));
            });
        }
        qr.finish(&mut triangle);
        assert!(error(&triangle, h.as_ref()) < 1e-13);
    }

    #[test]
    fn a_downdate_undoes_an_update_also_for_negative_pivots() {
        let n = 5;
        let h = columns(n, 12);
        let mut triangle = Triangle::new(n);
        let mut qr = BlockQr::new(n);
        for j in 0..12 {
            qr.push(&mut triangle, |column| {
                column.copy_from_slice(h.col_as_slice(j));
            });
        }
        qr.finish(&mut triangle);
        let mut work = vec![0.0; n];
        for j in 0..4 {
            let alpha = triangle.downdate(&mut h.col_as_slice(j).to_vec(), &mut work, 1e-6);
            assert!(alpha.is_some_and(|a| a > 1e-6 && a <= 1.0));
        }
        assert!(error(&triangle, h.subcols(4, 8)) < 1e-13);
        assert!(is_lower(&triangle));
    }

    #[test]
    fn a_downdate_that_would_lose_a_direction_is_refused() {
        let mut triangle = Triangle::new(2);
        triangle.update(&mut [1.0, 0.0]);
        triangle.update(&mut [0.0, 2.0]);
        let before = triangle.clone();
        let mut work = [0.0; 2];
        assert_eq!(triangle.downdate(&mut [0.0, 2.0], &mut work, 1e-6), None);
        assert_eq!(triangle.lower(), before.lower());
        let mut empty = Triangle::new(2);
        assert_eq!(empty.downdate(&mut [1.0, 0.0], &mut work, 1e-6), None);
    }

    #[test]
    fn scaling_forgets_exponentially() {
        let h = columns(3, 6);
        let forget: f64 = 0.9;
        let mut triangle = Triangle::new(3);
        for j in 0..6 {
            triangle.scale(forget.sqrt());
            triangle.update(&mut h.col_as_slice(j).to_vec());
        }
        let weighted = Mat::from_fn(3, 6, |i, j| {
            h[(i, j)] * forget.sqrt().powi(5 - i32::try_from(j).unwrap_or(0))
        });
        assert!(error(&triangle, weighted.as_ref()) < 1e-14);
    }
}
