//! Slack rows below a triangular factor.
//!
//! `[B; D 0]` with the upper triangular B (n×n, columns s then f) and D = diag(1/√λ) over the
//! columns s is `Ω [T; 0]` with the upper triangular T. Givens rotations of one row of B with one
//! row of D, and not a general QR decomposition, because the rows differ in size by 1e12 and
//! more: a rotation keeps what is small, and the pivots of T come out as
//! √(Bₖₖ² + 1/λₖ + …) ≥ 1/√λₖ whatever B is.

use faer::{Mat, MatRef};

use crate::linalg;

pub(super) struct Damping {
    rotations: Vec<Rotation>,
    /// Of the columns f, once the columns s are done: (f+s)×f.
    last: Mat<f64>,
    /// Tᵀ, n×n, lower triangular.
    pub lower: Mat<f64>,
}

/// Row `upper` of B and row `slack` of D.
struct Rotation {
    upper: usize,
    slack: usize,
    cosine: f64,
    sine: f64,
}

impl Rotation {
    fn apply(&self, upper: &mut f64, slack: &mut f64) {
        let (x, y) = (*upper, *slack);
        *upper = self.cosine * x + self.sine * y;
        *slack = self.cosine * y - self.sine * x;
    }

    fn undo(&self, upper: &mut f64, slack: &mut f64) {
        let (x, y) = (*upper, *slack);
        *upper = self.cosine * x - self.sine * y;
        *slack = self.cosine * y + self.sine * x;
    }
}

impl Damping {
    /// `roots`: the diagonal of D.
    pub fn new(b: MatRef<'_, f64>, roots: &[f64]) -> Self {
        let (n, soft) = (b.ncols(), roots.len());
        // Rows of [B; D] as columns, so that a rotation walks through memory in order.
        let mut upper = linalg::lower_from_upper(b);
        let mut slack = Mat::zeros(n, soft);
        let mut rotations = Vec::with_capacity(soft * (soft + 1) / 2);
        for k in 0..soft {
            slack[(k, k)] = roots[k];
            for i in 0..=k {
                let (x, y) = (upper[(k, k)], slack[(k, i)]);
                if y == 0.0 {
                    continue;
                }
                let size = x.hypot(y);
                let rotation = Rotation {
                    upper: k,
                    slack: i,
                    cosine: x / size,
                    sine: y / size,
                };
                let pair = upper.col_as_slice_mut(k)[k..].iter_mut();
                for (x, y) in pair.zip(&mut slack.col_as_slice_mut(i)[k..]) {
                    rotation.apply(x, y);
                }
                slack[(k, i)] = 0.0;
                rotations.push(rotation);
            }
        }
        let future = n - soft;
        let left_over = Mat::from_fn(future + soft, future, |i, j| {
            if i < future {
                upper[(soft + j, soft + i)]
            } else {
                slack[(soft + j, i - future)]
            }
        });
        let decomposition = left_over.qr();
        let last = linalg::lower_from_upper(decomposition.thin_R());
        upper
            .submatrix_mut(soft, soft, future, future)
            .copy_from(&last);
        Self {
            rotations,
            last: decomposition.compute_thin_Q(),
            lower: upper,
        }
    }

    /// `Ω [x; 0]`: its part beside B (n) and its part beside D.
    pub fn undo(&self, x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (height, future) = self.last.shape();
        let soft = height - future;
        let mut bottom = vec![0.0; height];
        linalg::multiply(&mut bottom, self.last.as_ref(), &x[soft..]);
        let mut slack = bottom.split_off(future);
        let mut upper = [&x[..soft], &bottom].concat();
        for rotation in self.rotations.iter().rev() {
            rotation.undo(&mut upper[rotation.upper], &mut slack[rotation.slack]);
        }
        (upper, slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// B with pivots from 1 to 0, and slack from free to nearly hard.
    #[test]
    fn damping_is_orthogonal_and_keeps_every_pivot_above_its_slack() {
        let n = 7;
        let pivots = [1.0, 0.0, 1e-3, 1e-14, 2.0, 0.0, 1.0];
        let b = Mat::from_fn(n, n, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => (1.0 + (3 * i + j) as f64).sin(),
            std::cmp::Ordering::Equal => pivots[i],
            std::cmp::Ordering::Greater => 0.0,
        });
        for root in [1.0, 1e-4, 1e-10] {
            let roots = [root, 2.0 * root, root, 3.0 * root];
            let damping = Damping::new(b.as_ref(), &roots);
            let t = damping.lower.transpose();
            for (k, root) in roots.iter().enumerate() {
                assert!(t[(k, k)].abs() >= root * (1.0 - 1e-15));
            }
            for column in 0..n {
                let x: Vec<f64> = (0..n).map(|i| t[(i, column)]).collect();
                let (upper, slack) = damping.undo(&x);
                for i in 0..n {
                    assert!((upper[i] - b[(i, column)]).abs() < 1e-14);
                }
                for (k, value) in slack.iter().enumerate() {
                    let expected = if k == column { roots[k] } else { 0.0 };
                    assert!((value - expected).abs() < 1e-14);
                }
            }
        }
    }
}
