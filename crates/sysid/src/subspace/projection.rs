//! From the triangular factor to the extended observability matrix.

use std::fmt;

use deepc_core::faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use deepc_core::faer::{Mat, MatRef, Par};
use deepc_core::hankel::leading_condition;
use serde::{Deserialize, Serialize};

use super::factor::Factor;
use crate::dense::{compressed, least_squares, pseudo_inverse};
use crate::error::SysidError;
use crate::least_squares::thin_svd;

/// Directions of the outputs below this fraction of the strongest are not whitened by the
/// canonical variate weighting. Sensors and files do not resolve them, and on data without noise
/// what is left there is rounding.
pub(crate) const WHITENING_TOLERANCE: f64 = 1e-11;

/// Singular values below this fraction of the largest are rounding: they carry no state.
pub(crate) const ORDER_TOLERANCE: f64 = 1e-12;

/// Below this reciprocal condition number the past is inverted by its singular values.
const PAST_TOLERANCE: f64 = 1e-10;

/// How the oblique projection of the future outputs along the future inputs on the past is
/// weighted before its singular values are taken (Van Overschee and De Moor 1996, table of
/// chapter 4). All are consistent; they differ in variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weighting {
    /// Canonical variate analysis (Larimore 1990): the outputs are whitened, and the singular
    /// values are canonical correlations between 0 and 1. The usual choice with noise; it does not
    /// see the units of the outputs.
    Cva,
    /// The part orthogonal to the future inputs, unweighted (Verhaegen 1994). Outputs with larger
    /// numbers count more.
    Moesp,
    /// The oblique projection itself, unweighted (Van Overschee and De Moor 1994). Coloured inputs
    /// enter the weights: not for lightly damped plants that were shaken slowly, where it can be
    /// far behind the other two.
    N4sid,
}

impl fmt::Display for Weighting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cva => "CVA",
            Self::Moesp => "MOESP",
            Self::N4sid => "N4SID",
        })
    }
}

/// The weighted projection, decomposed.
#[derive(Debug, Clone)]
pub(crate) struct Projection {
    /// In falling order, p·f of them at most.
    pub singular_values: Vec<f64>,
    /// Candidates for the extended observability matrix, p·f×k: its first n columns are one.
    columns: Mat<f64>,
    /// Directions that are not rounding.
    carried: usize,
    /// p.
    outputs: usize,
    /// f.
    future: usize,
}

/// A and C.
#[derive(Debug, Clone)]
pub(crate) struct Dynamics {
    /// n×n.
    pub a: Mat<f64>,
    /// p×n.
    pub c: Mat<f64>,
    /// Γ, p·f×n, in whose coordinates they are.
    pub observability: Mat<f64>,
}

impl Factor {
    /// Decomposes the weighted projection: small matrices only.
    pub fn project(&self, weighting: Weighting) -> Result<Projection, SysidError> {
        let inputs = self.inputs * self.future;
        let past = self.rows_before_outputs() - inputs;
        // Y_f beside U_f, along the past: L₃₂.
        let along = self.future_outputs().subcols(inputs, past);
        let what = "the singular value decomposition of the projection";
        let (columns, singular_values, carried) = match weighting {
            Weighting::Moesp => {
                let svd = thin_svd(compressed(along).as_ref(), what)?;
                let carried = svd.rank(ORDER_TOLERANCE);
                (svd.u, svd.values, carried)
            }
            Weighting::N4sid => {
                // Y_f /U_f W_p = L₃₂ L₂₂⁺ [L₂₁ L₂₂]; the last product is L₃₂ itself.
                let gain = self.times_inverse_of_past(along)?;
                let aside = gain * self.past_along_inputs();
                let both = Mat::from_fn(along.nrows(), inputs + past, |i, j| {
                    match j.checked_sub(inputs) {
                        None => aside[(i, j)],
                        Some(j) => along[(i, j)],
                    }
                });
                let svd = thin_svd(compressed(both.as_ref()).as_ref(), what)?;
                let carried = svd.rank(ORDER_TOLERANCE);
                (svd.u, svd.values, carried)
            }
            Weighting::Cva => {
                // Y_f beside U_f is [L₃₂ L₃₃] = V·diag(σ)·Zᵀ; the weight is diag(σ)⁺Vᵀ.
                let all = self.future_outputs();
                let beside = compressed(all.subcols(inputs, all.ncols() - inputs));
                let whole = thin_svd(beside.as_ref(), what)?;
                let kept = whole.rank(WHITENING_TOLERANCE);
                let directions = whole.u.subcols(0, kept);
                let mut white = directions.transpose() * along;
                for j in 0..white.ncols() {
                    for (value, sigma) in white.col_as_slice_mut(j).iter_mut().zip(&whole.values) {
                        *value /= sigma;
                    }
                }
                let svd = thin_svd(compressed(white.as_ref()).as_ref(), what)?;
                let weighted =
                    Mat::from_fn(kept, svd.u.ncols(), |i, j| whole.values[i] * svd.u[(i, j)]);
                let carried = svd.rank(ORDER_TOLERANCE);
                (directions * weighted, svd.values, carried)
            }
        };
        Ok(Projection {
            singular_values,
            columns,
            carried,
            outputs: self.outputs,
            future: self.future,
        })
    }

    /// X L₂₂⁺ of the past L₂₂.
    fn times_inverse_of_past(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, SysidError> {
        let past = self.past_beside_inputs();
        if leading_condition(past, past.nrows()) < 1.0 / PAST_TOLERANCE {
            // X = G L  ⇔  Lᵀ Gᵀ = Xᵀ.
            let mut solution = x.transpose().to_owned();
            solve_upper_triangular_in_place(past.transpose(), solution.as_mut(), Par::Seq);
            return Ok(solution.transpose().to_owned());
        }
        Ok(x * pseudo_inverse(past)?)
    }
}

impl Projection {
    /// Largest order that the horizon (p(f − 1)) and the data (directions that are not rounding)
    /// allow.
    pub fn largest_order(&self) -> usize {
        self.carried.min(self.outputs * (self.future - 1))
    }

    /// A and C of order n from the shift of the extended observability matrix (Verhaegen 1994,
    /// Van Overschee and De Moor 1996).
    ///
    /// # Errors
    /// [`SysidError::Order`].
    pub fn dynamics(&self, order: usize) -> Result<Dynamics, SysidError> {
        let horizon = self.outputs * (self.future - 1);
        let largest = self.largest_order();
        if order == 0 || order > largest {
            let reason = if order == 0 {
                "a model needs a state, and the recording".to_owned()
            } else if order > horizon {
                format!(
                    "a future horizon of {} with {} outputs",
                    self.future, self.outputs
                )
            } else {
                let sigma = self.singular_values.get(order - 1).copied().unwrap_or(0.0);
                let first = self.singular_values.first().copied().unwrap_or(0.0);
                format!(
                    "the recording (singular value {order} is {:.1e} of the first)",
                    sigma / first
                )
            };
            return Err(SysidError::Order {
                order,
                largest,
                reason,
            });
        }
        let observability = self.columns.subcols(0, order).to_owned();
        let a = least_squares(
            observability.subrows(0, horizon),
            observability.subrows(self.outputs, horizon),
        )?;
        let c = observability.subrows(0, self.outputs).to_owned();
        Ok(Dynamics {
            a,
            c,
            observability,
        })
    }
}
