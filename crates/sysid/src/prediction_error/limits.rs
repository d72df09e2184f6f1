//! How far poles may go, and what to do with those at the limit.

use deepc_core::faer::linalg::solvers::DenseSolveCore;
use deepc_core::faer::{Mat, c64};

use super::parameters::{Entry, Layout};
use super::predictor::ROUNDING;
use super::predictor_radius;
use crate::stability::{reflected_gain, spectral_radius, stabilise};
use crate::state_space::SystemMatrices;

/// A step that moves a pole as far out as this is shortened, not mended.
const FAR_OUT: f64 = 1.5;

/// Poles this close to the limit are at it.
const AT_THE_LIMIT: f64 = 1e-3;

/// The set that the descent never leaves.
pub(super) struct Limits {
    model: f64,
    predictor: f64,
}

impl Limits {
    #[cfg(test)]
    pub fn at(model: f64, predictor: f64) -> Self {
        Self { model, predictor }
    }

    pub fn new(start: &SystemMatrices, radius: f64) -> Self {
        let rounding = 1.0 + 1e-9;
        Self {
            model: radius
                .max(spectral_radius(start.a.as_ref()) * rounding)
                .min(1.0 - 1e-12),
            predictor: radius
                .max(predictor_radius(start) * rounding)
                .min(1.0 - 1e-12),
        }
    }

    /// The candidate, with its poles and those of its predictor brought inside if they are not far
    /// out: that is tried before a shorter step, and the criterion decides.
    pub fn kept(
        &self,
        layout: &Layout,
        candidate: &SystemMatrices,
        covariance: &Mat<f64>,
    ) -> Option<SystemMatrices> {
        let mut candidate = candidate.clone();
        if layout.dynamics {
            let stable = stabilise(candidate.a.as_ref(), self.model).ok()?;
            // Far outside the linearisation means nothing.
            if stable.radius_before > FAR_OUT {
                return None;
            }
            candidate.a = stable.a;
        }
        if layout.gain {
            let radius = predictor_radius(&candidate);
            if radius > self.predictor {
                if radius > FAR_OUT {
                    return None;
                }
                let guarded = Mat::from_fn(layout.p, layout.p, |i, j| {
                    covariance[(i, j)] + if i == j { ROUNDING } else { 0.0 }
                });
                candidate.k = reflected_gain(
                    candidate.a.as_ref(),
                    candidate.c.as_ref(),
                    candidate.k.as_ref(),
                    guarded.as_ref(),
                    self.predictor,
                )?;
            }
        }
        Some(candidate)
    }

    /// Gradients by local coordinates of the moduli of the poles at the limit.
    pub fn gradients_at_the_limit(
        &self,
        layout: &Layout,
        model: &SystemMatrices,
        to_full: &Mat<f64>,
    ) -> Vec<Vec<f64>> {
        let mut gradients = Vec::new();
        if layout.dynamics {
            let none = Mat::zeros(layout.n, layout.p);
            gradients.extend(moduli(layout, model, &none, self.model));
        }
        if layout.gain {
            gradients.extend(moduli(layout, model, &model.k, self.predictor));
        }
        let local = gradients.into_iter().map(|full| {
            let columns = (0..to_full.ncols()).map(|j| to_full.col_as_slice(j));
            columns
                .map(|column| column.iter().zip(&full).map(|(a, b)| a * b).sum())
                .collect()
        });
        local.collect()
    }
}

/// Gradients by all free entries of the moduli close to `limit` of the poles of A − KC:
/// dλ = wᴴ (dA − dK C − K dC) v with wᴴv = 1.
fn moduli(layout: &Layout, model: &SystemMatrices, k: &Mat<f64>, limit: f64) -> Vec<Vec<f64>> {
    let f = &model.a - k * &model.c;
    let Ok(eigen) = f.eigen() else {
        return Vec::new();
    };
    let right = eigen.U();
    let left = right.partial_piv_lu().inverse();
    let poles = eigen.S().column_vector();
    let mut gradients = Vec::new();
    for (index, pole) in poles.iter().enumerate() {
        let modulus = pole.re.hypot(pole.im);
        // One of a pair is enough.
        if modulus < limit - AT_THE_LIMIT || pole.im < 0.0 {
            continue;
        }
        let along = |value: c64| (pole.re * value.re + pole.im * value.im) / modulus;
        let (w, v) = (left.row(index), right.col(index));
        let seen = |l: usize| (0..layout.n).map(|j| v[j] * model.c[(l, j)]).sum::<c64>();
        let driven = |l: usize| (0..layout.n).map(|i| w[i] * k[(i, l)]).sum::<c64>();
        let predictor = k.norm_max() > 0.0 || !layout.dynamics;
        let entries = layout.entries();
        let gradient = entries.iter().map(|&entry| match entry {
            Entry::A(i, j) => along(w[i] * v[j]),
            Entry::C(l, j) => -along(driven(l) * v[j]),
            Entry::K(i, l) if predictor => -along(w[i] * seen(l)),
            _ => 0.0,
        });
        let gradient: Vec<f64> = gradient.collect();
        if gradient.iter().all(|value| value.is_finite()) {
            gradients.push(gradient);
        }
    }
    gradients
}
