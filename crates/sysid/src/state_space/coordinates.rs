//! The same model in other coordinates of its state.

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, MatRef, Side};

use super::{StateSpace, SystemMatrices, check_matrix};
use crate::error::SysidError;

/// Smallest Hankel singular value over the largest at which a state still counts as both reachable
/// and observable.
const MINIMAL_TOLERANCE: f64 = 1e-13;

/// A transformation whose condition number is above this loses the model in rounding.
const LARGEST_CONDITION: f64 = 1e14;

/// Doublings until even a pole at distance 1e-13 from the circle is summed.
const MOST_DOUBLINGS: usize = 60;

impl StateSpace {
    /// The model in the state `T x`, T n×n: A → T A T⁻¹, B → T B, C → C T⁻¹, K → T K.
    ///
    /// # Errors
    /// The shape does not fit, a value is not finite, or T has a condition number above 1e14.
    pub fn transformed(&self, transformation: MatRef<'_, f64>) -> Result<Self, SysidError> {
        let n = self.order();
        check_matrix("T", transformation, n, n)?;
        if n == 0 {
            return Ok(self.clone());
        }
        let values = singular_values(transformation, "the transformation")?;
        let condition = values[0] / values[n - 1];
        if condition.is_nan() || condition > LARGEST_CONDITION {
            return Err(SysidError::Numerical {
                what: "the change of coordinates",
                why: format!(
                    "T has condition number {condition:.1e}, above {LARGEST_CONDITION:.0e}; \
                     choose a transformation that can be undone"
                ),
            });
        }
        let backward = transformation.transpose().partial_piv_lu();
        let right = |m: MatRef<'_, f64>| {
            // m T⁻¹ = (T⁻ᵀ mᵀ)ᵀ.
            backward.solve(m.transpose()).transpose().to_owned()
        };
        let system = &self.matrices;
        let moved = transformation * &system.a;
        Ok(Self {
            matrices: SystemMatrices {
                a: right(moved.as_ref()),
                b: transformation * &system.b,
                c: right(system.c.as_ref()),
                d: system.d.clone(),
                k: transformation * &system.k,
            },
            ..self.clone()
        })
    }

    /// The n Hankel singular values of the inputs' effect on the outputs, largest first, all
    /// channels in units of their scales.
    ///
    /// # Errors
    /// The model is not stable.
    pub fn hankel_singular_values(&self) -> Result<Vec<f64>, SysidError> {
        if self.order() == 0 {
            return Ok(Vec::new());
        }
        let (reach, observe) = self.gramian_roots()?;
        let product = observe.transpose() * &reach;
        singular_values(product.as_ref(), "the Hankel singular values")
    }

    /// The model in balanced coordinates (Moore 1981; the square-root method): each state is as
    /// easily reached from the inputs as seen in the outputs, all channels in units of their
    /// scales, most important state first.
    ///
    /// # Errors
    /// The model is not stable, or a state is not reached or not seen.
    pub fn balanced(&self) -> Result<Self, SysidError> {
        let n = self.order();
        if n == 0 {
            return Ok(self.clone());
        }
        let (reach, observe) = self.gramian_roots()?;
        let product = observe.transpose() * &reach;
        let svd = product.svd().map_err(|error| SysidError::Numerical {
            what: "the Hankel singular values",
            why: format!("{error:?}"),
        })?;
        let values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let minimal = values
            .iter()
            .filter(|&&v| v > MINIMAL_TOLERANCE * values[0]);
        let minimal = minimal.count();
        if minimal < n {
            return Err(SysidError::Order {
                order: n,
                largest: minimal,
                reason: format!(
                    "a balanced form of a model whose Hankel singular values fall from {:.1e} to {:.1e}",
                    values[0],
                    values[n - 1]
                ),
            });
        }
        // T = Σ^(−1/2) Uᵀ Lᵀ with Q = L Lᵀ; its inverse is R V Σ^(−1/2) with P = R Rᵀ.
        let left = svd.U().transpose() * observe.transpose();
        let right = &reach * svd.V();
        let forward = Mat::from_fn(n, n, |i, j| left[(i, j)] / values[i].sqrt());
        let back = Mat::from_fn(n, n, |i, j| right[(i, j)] / values[j].sqrt());
        let system = &self.matrices;
        Ok(Self {
            matrices: SystemMatrices {
                a: &forward * &system.a * &back,
                b: &forward * &system.b,
                c: &system.c * &back,
                d: system.d.clone(),
                k: &forward * &system.k,
            },
            ..self.clone()
        })
    }

    /// Roots R and L of the Gramians P = R Rᵀ (reachability) and Q = L Lᵀ (observability).
    fn gramian_roots(&self) -> Result<(Mat<f64>, Mat<f64>), SysidError> {
        let radius = self.spectral_radius()?;
        // Gramians are infinite for a pole on the circle.
        if radius.is_nan() || radius >= 1.0 {
            return Err(SysidError::Unstable {
                what: "A",
                radius,
                limit: 1.0,
                remedy: "only a stable model has Gramians",
            });
        }
        let channels: Vec<_> = self.inputs.iter().chain(&self.disturbances).collect();
        let (system, n) = (&self.matrices, self.order());
        let b = Mat::from_fn(n, channels.len(), |i, j| {
            system.b[(i, j)] * channels[j].scale
        });
        let c = Mat::from_fn(n, self.outputs.len(), |i, j| {
            system.c[(j, i)] / self.outputs[j].scale
        });
        Ok((
            gramian_root(system.a.as_ref(), b.as_ref())?,
            gramian_root(system.a.transpose(), c.as_ref())?,
        ))
    }
}

/// R with R Rᵀ = Σ Aᵏ B Bᵀ (Aᵀ)ᵏ, n×n, by doubling the number of terms (Smith 1968).
fn gramian_root(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Result<Mat<f64>, SysidError> {
    let n = a.nrows();
    let mut gramian = b * b.transpose();
    let mut power = a.to_owned();
    for _ in 0..MOST_DOUBLINGS {
        let more = &power * &gramian * power.transpose();
        gramian += &more;
        if more.norm_max() <= f64::EPSILON * gramian.norm_max() {
            break;
        }
        power = &power * &power;
    }
    let symmetric = Mat::from_fn(n, n, |i, j| 0.5 * (gramian[(i, j)] + gramian[(j, i)]));
    let eigen =
        symmetric
            .self_adjoint_eigen(Side::Lower)
            .map_err(|error| SysidError::Numerical {
                what: "the root of a Gramian",
                why: format!("{error:?}"),
            })?;
    let values = eigen.S().column_vector();
    Ok(Mat::from_fn(n, n, |i, j| {
        eigen.U()[(i, j)] * values[j].max(0.0).sqrt()
    }))
}

fn singular_values(matrix: MatRef<'_, f64>, what: &'static str) -> Result<Vec<f64>, SysidError> {
    matrix
        .singular_values()
        .map_err(|error| SysidError::Numerical {
            what,
            why: format!("{error:?}"),
        })
}
