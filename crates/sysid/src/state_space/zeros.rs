//! Zeros of the system and of single channels.

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, MatRef, Scale, c64};

use super::{StateSpace, poles};
use crate::error::SysidError;

/// Rank decisions: a singular value below this fraction of the system matrix is zero.
const RANK_TOLERANCE: f64 = 1e-12;

impl StateSpace {
    /// Finite invariant zeros of (A, B, C, D): the transmission zeros, and where the model is not
    /// minimal the modes that an input does not reach or an output does not show. They are z at
    /// which the system matrix loses rank, found by orthogonal reductions that take the infinite
    /// ones away (Emami-Naeini and Van Dooren 1982). K plays no part. A system whose numbers of
    /// inputs and outputs differ generally has none: ask for its
    /// [`channel_zeros`](Self::channel_zeros).
    ///
    /// # Errors
    /// The eigenvalue iteration does not converge.
    pub fn zeros(&self) -> Result<Vec<c64>, SysidError> {
        let outputs: Vec<usize> = (0..self.outputs.len()).collect();
        let inputs: Vec<usize> = (0..self.matrices.inputs()).collect();
        self.zeros_between(&outputs, &inputs)
    }

    /// Finite zeros of the channel from one input or measured disturbance (counted together) to
    /// one output, both from 0; as [`zeros`](Self::zeros). Poles of other channels show up among
    /// them as zeros that cancel.
    ///
    /// # Errors
    /// There is no such channel, or the eigenvalue iteration does not converge.
    pub fn channel_zeros(&self, output: usize, input: usize) -> Result<Vec<c64>, SysidError> {
        for (kind, index, count) in [
            ("output", output, self.outputs.len()),
            ("input", input, self.matrices.inputs()),
        ] {
            if index >= count {
                return Err(SysidError::NoSuchChannel { kind, index, count });
            }
        }
        self.zeros_between(&[output], &[input])
    }

    fn zeros_between(&self, outputs: &[usize], inputs: &[usize]) -> Result<Vec<c64>, SysidError> {
        let (system, n) = (&self.matrices, self.order());
        let full = Pencil {
            a: system.a.clone(),
            b: Mat::from_fn(n, inputs.len(), |i, j| system.b[(i, inputs[j])]),
            c: Mat::from_fn(outputs.len(), n, |i, j| system.c[(outputs[i], j)]),
            d: Mat::from_fn(outputs.len(), inputs.len(), |i, j| {
                system.d[(outputs[i], inputs[j])]
            }),
        }
        .scaled();
        let tolerance = RANK_TOLERANCE * full.size();
        let rows = full.reduced(tolerance)?;
        let square = rows.transposed().reduced(tolerance)?;
        square.finite_zeros()
    }
}

/// The system matrix [A − zI, B; C, D].
struct Pencil {
    a: Mat<f64>,
    b: Mat<f64>,
    c: Mat<f64>,
    d: Mat<f64>,
}

impl Pencil {
    fn size(&self) -> f64 {
        let parts = [&self.a, &self.b, &self.c, &self.d];
        parts
            .iter()
            .map(|m| m.norm_l2().powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// With inputs, outputs and the state in units that make rank decisions mean something: none of
    /// them moves a zero.
    fn scaled(mut self) -> Self {
        let (b, c) = (self.b.norm_l2(), self.c.norm_l2());
        if b > 0.0 && c > 0.0 {
            let unit = (c / b).sqrt();
            self.b *= Scale(unit);
            self.c *= Scale(1.0 / unit);
        }
        for j in 0..self.d.ncols() {
            let size = self.b.col(j).norm_l2().hypot(self.d.col(j).norm_l2());
            if size > 0.0 {
                for column in [self.b.col_mut(j), self.d.col_mut(j)] {
                    column.iter_mut().for_each(|value| *value /= size);
                }
            }
        }
        for i in 0..self.d.nrows() {
            let size = self.c.row(i).norm_l2().hypot(self.d.row(i).norm_l2());
            if size > 0.0 {
                for row in [self.c.row_mut(i), self.d.row_mut(i)] {
                    row.iter_mut().for_each(|value| *value /= size);
                }
            }
        }
        self
    }

    fn transposed(&self) -> Self {
        Self {
            a: self.a.transpose().to_owned(),
            b: self.c.transpose().to_owned(),
            c: self.b.transpose().to_owned(),
            d: self.d.transpose().to_owned(),
        }
    }

    /// A smaller pencil with the same finite zeros and a D of full row rank.
    fn reduced(self, tolerance: f64) -> Result<Self, SysidError> {
        let Self {
            mut a,
            mut b,
            mut c,
            mut d,
        } = self;
        loop {
            let (n, m, p) = (a.nrows(), d.ncols(), d.nrows());
            // Rows of Uᵀ D beyond its rank vanish.
            let (left, _, rank) = factor(d.as_ref(), tolerance)?;
            let turned = left.transpose() * &d;
            let seen = left.transpose() * &c;
            d = turned.get(..rank, ..).to_owned();
            let upper = seen.get(..rank, ..).to_owned();
            let lower = seen.get(rank.., ..);
            let (_, right, states) = factor(lower, tolerance)?;
            if rank == p || states == 0 {
                return Ok(Self { a, b, c: upper, d });
            }
            // Coordinates whose last `states` the outputs without feedthrough fix at zero; the
            // equations of these states become outputs.
            let kept = n - states;
            let order: Vec<usize> = (states..n).chain(0..states).collect();
            let basis = Mat::from_fn(n, n, |i, j| right[(i, order[j])]);
            let moved = basis.transpose() * &a * &basis;
            let driven = basis.transpose() * &b;
            let outputs = &upper * &basis;
            a = moved.get(..kept, ..kept).to_owned();
            b = driven.get(..kept, ..).to_owned();
            c = Mat::from_fn(states + rank, kept, |i, j| match i.checked_sub(states) {
                None => moved[(kept + i, j)],
                Some(i) => outputs[(i, j)],
            });
            let direct = d;
            d = Mat::from_fn(states + rank, m, |i, j| match i.checked_sub(states) {
                None => driven[(kept + i, j)],
                Some(i) => direct[(i, j)],
            });
        }
    }

    /// Of a pencil with a square, regular D: the z at which [A − zI, B; C, D] loses rank. An
    /// orthogonal W with [C, D] W = [0, F] leaves the pencil [A, B] W − z [I, 0] W in its first n
    /// columns.
    fn finite_zeros(&self) -> Result<Vec<c64>, SysidError> {
        let (n, m) = (self.a.nrows(), self.d.ncols());
        if n == 0 {
            return Ok(Vec::new());
        }
        let stacked = Mat::from_fn(n + m, self.c.nrows(), |i, j| match i.checked_sub(n) {
            None => self.c[(j, i)],
            Some(i) => self.d[(j, i)],
        });
        let rank = self.c.nrows();
        let null = if rank == 0 {
            Mat::identity(n + m, n + m)
        } else {
            stacked.qr().compute_Q()
        };
        let null = null.get(.., rank..(rank + n));
        let left = &self.a * null.get(..n, ..) + &self.b * null.get(n.., ..);
        let right = null.get(..n, ..);
        // The rank decisions have left a regular pencil, so that a QZ iteration is not needed.
        poles::eigenvalues(right.partial_piv_lu().solve(&left).as_ref())
    }
}

/// Square orthogonal U and V of the singular value decomposition, and the numerical rank.
fn factor(
    matrix: MatRef<'_, f64>,
    tolerance: f64,
) -> Result<(Mat<f64>, Mat<f64>, usize), SysidError> {
    let (rows, columns) = matrix.shape();
    if rows == 0 || columns == 0 {
        return Ok((
            Mat::identity(rows, rows),
            Mat::identity(columns, columns),
            0,
        ));
    }
    let svd = matrix.svd().map_err(|error| SysidError::Numerical {
        what: "a rank decision of the zeros",
        why: format!("{error:?}"),
    })?;
    let values = svd.S().column_vector();
    let rank = values.iter().filter(|&&value| value > tolerance).count();
    Ok((svd.U().to_owned(), svd.V().to_owned(), rank))
}
