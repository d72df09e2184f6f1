//! B, D and the noise covariances from the triangular factor: the state equations as a
//! least-squares problem.
//!
//! With L₄ the row block `Y_f` of the factor, split as `[L₄₁ L₄₂ L₄₃ L₄₄]`, the states at the
//! beginning of the future and one sample later are, up to what the future inputs add,
//! `Γ⁺[L₄₁ L₄₂ L₄₃]` and `Γ̲⁺` times all block rows but the first, one output more known (Van
//! Overschee and De Moor 1994; Γ̲ is Γ without its last block row).

use deepc_core::faer::{Mat, MatRef};

use super::factor::Factor;
use super::projection::Dynamics;
use crate::dense::{compressed, least_squares, pseudo_inverse};
use crate::error::SysidError;
use crate::state_space::SystemMatrices;
use crate::working::WorkingData;

/// Covariances of the state and output noise, per sample.
#[derive(Debug, Clone)]
pub(crate) struct NoiseCovariances {
    /// Of the state noise, n×n.
    pub q: Mat<f64>,
    /// Of the output noise, p×p.
    pub r: Mat<f64>,
    /// Between them, n×p.
    pub s: Mat<f64>,
}

/// Both sides of the state equations in the coordinates of the factor, and what they need.
pub(crate) struct StateEquations<'a> {
    factor: &'a Factor,
    dynamics: &'a Dynamics,
    /// Γ⁺, n×p·f.
    inverse: Mat<f64>,
    /// Γ̲⁺, n×p(f − 1).
    inverse_shorter: Mat<f64>,
    /// State, n×k; zero in the last p columns.
    now: Mat<f64>,
    /// Next state over the first outputs, (n + p)×k.
    next: Mat<f64>,
}

impl<'a> StateEquations<'a> {
    pub fn new(factor: &'a Factor, dynamics: &'a Dynamics) -> Result<Self, SysidError> {
        let (p, n) = (factor.outputs, dynamics.a.nrows());
        let gamma = &dynamics.observability;
        let shorter = gamma.nrows() - p;
        let before = factor.rows_before_outputs();
        let outputs = factor.future_outputs();
        let inverse = pseudo_inverse(gamma.as_ref())?;
        let inverse_shorter = pseudo_inverse(gamma.subrows(0, shorter))?;
        let state = &inverse * outputs.subcols(0, before);
        let later = &inverse_shorter * outputs.submatrix(p, 0, shorter, before + p);
        let now = Mat::from_fn(
            n,
            before + p,
            |i, j| {
                if j < before { state[(i, j)] } else { 0.0 }
            },
        );
        let next = Mat::from_fn(n + p, before + p, |i, j| match i.checked_sub(n) {
            None => later[(i, j)],
            Some(i) => outputs[(i, j)],
        });
        Ok(Self {
            factor,
            dynamics,
            inverse,
            inverse_shorter,
            now,
            next,
        })
    }

    /// Covariances of the residuals when the next state and the output are regressed on the state
    /// and the future inputs, over the number of samples.
    pub fn noise_covariances(&self) -> Result<NoiseCovariances, SysidError> {
        let n = self.dynamics.a.nrows();
        // The future inputs, being the first rows of a triangle, fit their own columns exactly.
        let inputs = self.factor.inputs * self.factor.future;
        let columns = self.now.ncols() - inputs;
        let state = self.now.subcols(inputs, columns);
        let target = self.next.subcols(inputs, columns);
        let fit = least_squares(state.transpose(), target.transpose())?;
        let residual = target - fit.transpose() * state;
        let covariance = &residual * residual.transpose() * (1.0 / self.factor.samples as f64);
        let p = self.factor.outputs;
        Ok(NoiseCovariances {
            q: covariance.submatrix(0, 0, n, n).to_owned(),
            r: covariance.submatrix(n, n, p, p).to_owned(),
            s: covariance.submatrix(0, n, n, p).to_owned(),
        })
    }

    /// B and D for the given A and C, as the least-squares solution of everything that the future
    /// inputs do to the state equations (Van Overschee and De Moor 1996, robust algorithm of
    /// chapter 4; the combined method of SLICOT).
    ///
    /// What the inputs add is `Σ_i N_i [D; B] U_i`, with `U_i` the i-th block row of the future
    /// inputs and `N_i` known from A, C and Γ.
    pub fn input_matrices(&self) -> Result<(Mat<f64>, Mat<f64>), SysidError> {
        let (m, p, f) = (self.factor.inputs, self.factor.outputs, self.factor.future);
        let (a, c) = (&self.dynamics.a, &self.dynamics.c);
        let n = a.nrows();
        let rows = n + p;
        let columns = m * f;
        if m == 0 {
            return Ok((Mat::zeros(n, 0), Mat::zeros(p, 0)));
        }
        let stacked = Mat::from_fn(rows, n, |i, j| match i.checked_sub(n) {
            None => a[(i, j)],
            Some(i) => c[(i, j)],
        });
        let added = self.next.subcols(0, columns) - &stacked * self.now.subcols(0, columns);
        let weights = self.weights(&stacked);
        let gamma = &self.dynamics.observability;
        let inputs = self.factor.future_inputs();
        // vec(N X U) = (Uᵀ ⊗ N) vec(X), X = [D; B].
        let mut system = Mat::zeros(rows * columns, rows * m);
        for i in 0..f {
            let rest = f - 1 - i;
            let direct = weights.subcols(i * p, p);
            let through = weights.subcols((i + 1) * p, rest * p) * gamma.subrows(0, rest * p);
            for input in 0..m {
                for column in 0..columns {
                    let factor = inputs[(i * m + input, column)];
                    if factor == 0.0 {
                        continue;
                    }
                    let mut block =
                        system
                            .as_mut()
                            .submatrix_mut(column * rows, input * rows, rows, rows);
                    for row in 0..rows {
                        for output in 0..p {
                            block[(row, output)] += factor * direct[(row, output)];
                        }
                        for state in 0..n {
                            block[(row, p + state)] += factor * through[(row, state)];
                        }
                    }
                }
            }
        }
        let right = Mat::from_fn(rows * columns, 1, |k, _| added[(k % rows, k / rows)]);
        let solution = least_squares(system.as_ref(), right.as_ref())?;
        let b = Mat::from_fn(n, m, |i, j| solution[(j * rows + p + i, 0)]);
        let d = Mat::from_fn(p, m, |i, j| solution[(j * rows + i, 0)]);
        Ok((b, d))
    }

    /// `[I 0; 0 Γ̲⁺]` shifted into place, minus `[A; C] Γ⁺`: (n + p)×p·f, state rows first.
    fn weights(&self, stacked: &Mat<f64>) -> Mat<f64> {
        let (n, p) = (self.dynamics.a.nrows(), self.factor.outputs);
        let mut weights = stacked * &self.inverse * -1.0;
        for j in p..weights.ncols() {
            for i in 0..n {
                weights[(i, j)] += self.inverse_shorter[(i, j - p)];
            }
        }
        for output in 0..p {
            weights[(n + output, output)] += 1.0;
        }
        weights
    }
}

/// The constant in the outputs that a model leaves: least squares of the simulated output, one
/// initial state per record. Exact without noise, also while transients last.
pub(crate) fn output_constant(
    data: &WorkingData,
    model: &SystemMatrices,
) -> Result<Vec<f64>, SysidError> {
    let (n, p) = (model.order(), model.outputs());
    let mut reduced: Vec<Mat<f64>> = Vec::new();
    for record in &data.records {
        let samples = record.samples();
        if samples * p <= n {
            continue;
        }
        let simulated = model.simulate(&vec![0.0; n], record.inputs.as_ref());
        // Columns: the initial state, the constant, what is to be explained.
        let mut table = Mat::zeros(samples * p, n + p + 1);
        let mut free = model.c.clone();
        for k in 0..samples {
            for i in 0..p {
                let row = k * p + i;
                for j in 0..n {
                    table[(row, j)] = free[(i, j)];
                }
                table[(row, n + i)] = 1.0;
                table[(row, n + p)] = record.outputs[(k, i)] - simulated[(k, i)];
            }
            free = &free * &model.a;
        }
        let lower = compressed(table.transpose());
        let rest = lower.ncols() - n;
        reduced.push(lower.submatrix(n, n, p + 1, rest).transpose().to_owned());
    }
    let rows = reduced.iter().map(Mat::nrows).sum();
    let mut all = Mat::zeros(rows, p + 1);
    let mut row = 0;
    for block in &reduced {
        all.as_mut()
            .subrows_mut(row, block.nrows())
            .copy_from(block.as_ref());
        row += block.nrows();
    }
    let constant: MatRef<'_, f64> = all.subcols(0, p);
    let solution = least_squares(constant, all.subcols(p, 1))?;
    Ok(solution.col_as_slice(0).to_vec())
}
