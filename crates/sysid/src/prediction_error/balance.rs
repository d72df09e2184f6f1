//! A state basis in which the parameters of a model are of comparable weight.

use deepc_core::faer::linalg::solvers::DenseSolveCore;
use deepc_core::faer::{Mat, MatRef, Side};

use super::predictor::Evaluation;
use crate::error::SysidError;
use crate::state_space::SystemMatrices;

/// Directions weaker than this fraction of the mean are treated as if they had that weight.
const LEAST_WEIGHT: f64 = 1e-10;

/// `Σ Fᵏ G Gᵀ Fᵏᵀ` by doubling (Smith 1968). For F just inside the unit circle the sum stops after
/// 2³⁰ terms.
pub(super) fn gramian(f: MatRef<'_, f64>, g: MatRef<'_, f64>) -> Mat<f64> {
    let mut sum = g * g.transpose();
    let mut power = f.to_owned();
    for _ in 0..30 {
        let next = &power * &sum * power.transpose();
        let (size, before) = (next.norm_max(), sum.norm_max());
        if !size.is_finite() || size <= 1e-16 * before {
            break;
        }
        sum += next;
        power = &power * &power;
    }
    sum
}

/// A change of basis x = T z.
pub(crate) struct Basis {
    to_old: Mat<f64>,
    to_new: Mat<f64>,
}

impl Basis {
    /// States as large as they are observable, both measured on the data: the predictor's states
    /// against the responses of the outputs.
    pub fn balanced(model: &SystemMatrices, run: &Evaluation) -> Result<Self, SysidError> {
        let n = model.order();
        if n == 0 {
            return Ok(Self {
                to_old: Mat::zeros(0, 0),
                to_new: Mat::zeros(0, 0),
            });
        }
        let failed = || SysidError::Numerical {
            what: "balancing the states",
            why: "a decomposition did not converge".into(),
        };
        let f = model.predictor();
        let c = &run.whitening * &model.c;
        let mut size = Mat::<f64>::zeros(n, n);
        let mut samples = 0.0;
        for x in run.states.iter().flat_map(|s| s.chunks_exact(n.max(1))) {
            samples += 1.0;
            for i in 0..n {
                for j in 0..n {
                    size[(i, j)] += x[i] * x[j];
                }
            }
        }
        let reach = gramian(f.transpose(), c.transpose());
        // Units first, so that the guard below means the same for every state.
        let units: Vec<f64> = (0..n)
            .map(|i| {
                let (size, reach) = (size[(i, i)] / f64::max(samples, 1.0), reach[(i, i)]);
                match (size > 0.0, reach > 0.0) {
                    (true, true) => (size / reach).powf(0.25),
                    (true, false) => size.sqrt(),
                    (false, true) => 1.0 / reach.sqrt(),
                    (false, false) => 1.0,
                }
            })
            .collect();
        let size = guarded(n, |i, j| size[(i, j)] / units[i] / units[j]);
        let reach = guarded(n, |i, j| reach[(i, j)] * units[i] * units[j]);
        // T = L V S^(-1/2) from size = L Lᵀ and Lᵀ reach L = V S² Vᵀ.
        let l = size.llt(Side::Lower).map_err(|_| failed())?.L().to_owned();
        let product = l.transpose() * reach * &l;
        let eigen = product
            .self_adjoint_eigen(Side::Lower)
            .map_err(|_| failed())?;
        let values = eigen.S().column_vector();
        let v = eigen.U();
        let scaled = Mat::from_fn(n, n, |i, j| {
            v[(i, j)] / values[j].max(f64::MIN_POSITIVE).powf(0.25)
        });
        let to_old = l * scaled;
        let to_old = Mat::from_fn(n, n, |i, j| units[i] * to_old[(i, j)]);
        let to_new = to_old.partial_piv_lu().inverse();
        if !(to_old.as_ref().is_all_finite() && to_new.as_ref().is_all_finite()) {
            return Err(failed());
        }
        Ok(Self { to_old, to_new })
    }

    pub fn apply(&self, model: &SystemMatrices) -> SystemMatrices {
        transformed(model, &self.to_old, &self.to_new)
    }

    pub fn undo(&self, model: &SystemMatrices) -> SystemMatrices {
        transformed(model, &self.to_new, &self.to_old)
    }

    /// An initial state in the basis before.
    pub fn undo_state(&self, state: &[f64]) -> Vec<f64> {
        let mut old = vec![0.0; state.len()];
        crate::regressors::add_product(&mut old, &self.to_old, state);
        old
    }
}

fn guarded(n: usize, of: impl Fn(usize, usize) -> f64) -> Mat<f64> {
    let mut matrix = Mat::from_fn(n, n, of);
    let mean = (0..n).map(|i| matrix[(i, i)]).sum::<f64>() / n.max(1) as f64;
    let least = if mean > 0.0 { LEAST_WEIGHT * mean } else { 1.0 };
    for i in 0..n {
        matrix[(i, i)] += least;
    }
    matrix
}

fn transformed(model: &SystemMatrices, to_old: &Mat<f64>, to_new: &Mat<f64>) -> SystemMatrices {
    SystemMatrices {
        a: to_new * &model.a * to_old,
        b: to_new * &model.b,
        c: &model.c * to_old,
        d: model.d.clone(),
        k: to_new * &model.k,
    }
}
