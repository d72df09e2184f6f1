//! Running the predictor over all records: innovations, states, covariance, criterion.

use deepc_core::faer::{Mat, Side};

use super::OutputWeights;
use crate::error::SysidError;
use crate::kernels::{Output, add_free, add_product, add_scaled, march};
use crate::regressors::{FreeResponse, Packed, PackedRecord};
use crate::state_space::SystemMatrices;

/// Variance, of outputs with variance 1, below which innovations are rounding.
pub(super) const ROUNDING: f64 = 1e-27;

/// The predictor run over the data, with the best initial states.
pub(crate) struct Evaluation {
    /// x(k) per record, row by row.
    pub states: Vec<Vec<f64>>,
    /// e(k) per record, row by row.
    pub innovations: Vec<Vec<f64>>,
    /// x(0) per record.
    pub initial: Vec<Vec<f64>>,
    /// Sum of e eᵀ over the number of samples, p×p.
    pub covariance: Mat<f64>,
    /// W with `WᵀW` the inverse of the (guarded) covariance: W e is white with variance 1. For equal
    /// weights a multiple of the identity.
    pub whitening: Mat<f64>,
    /// Mean over outputs of the logarithm of the innovations' variance.
    pub criterion: f64,
}

impl Evaluation {
    /// `whitening` weights the outputs against each other in the fit of the initial states.
    pub fn new(
        packed: &Packed,
        model: &SystemMatrices,
        whitening: &Mat<f64>,
        weighting: OutputWeights,
    ) -> Result<Self, SysidError> {
        let response = free_response(packed, model, whitening)?;
        Self::with_response(packed, model, &response, whitening, weighting)
    }

    /// The same for a free response that is known: [`free_response`] of this model and `whitening`.
    pub fn with_response(
        packed: &Packed,
        model: &SystemMatrices,
        response: &FreeResponse,
        whitening: &Mat<f64>,
        weighting: OutputWeights,
    ) -> Result<Self, SysidError> {
        let p = packed.outputs;
        let f = model.predictor();
        let c = -&model.c;
        let (mut states, mut innovations, mut initial) = (Vec::new(), Vec::new(), Vec::new());
        let mut sums = vec![0.0; p * p];
        for record in &packed.records {
            let (mut x, mut e) = run(record, model);
            let mut weighted = vec![0.0; e.len()];
            if p == 1 {
                add_scaled(&mut weighted, whitening[(0, 0)], &e);
            } else {
                for (weighted, e) in weighted.chunks_exact_mut(p).zip(e.chunks_exact(p)) {
                    add_product(weighted, whitening, e);
                }
            }
            let start = response.take_off(&mut weighted, &response.basis(record.samples)?);
            add_free(&f, &c, &start, response.kept(), &mut x, &mut e);
            for e in e.chunks_exact(p) {
                for (sums, e_i) in sums.chunks_exact_mut(p).zip(e) {
                    for (sum, e_j) in sums.iter_mut().zip(e) {
                        *sum += e_i * e_j;
                    }
                }
            }
            states.push(x);
            innovations.push(e);
            initial.push(start);
        }
        let samples = packed.samples().max(1) as f64;
        let covariance = Mat::from_fn(p, p, |i, j| sums[i * p + j] / samples);
        let (whitening, criterion) = weights(&covariance, weighting)?;
        Ok(Self {
            states,
            innovations,
            initial,
            covariance,
            whitening,
            criterion,
        })
    }
}

/// The response `W C Fᵏ` to the initial states, F = A − KC.
pub(super) fn free_response(
    packed: &Packed,
    model: &SystemMatrices,
    whitening: &Mat<f64>,
) -> Result<FreeResponse, SysidError> {
    let (f, c) = (model.predictor(), whitening * &model.c);
    FreeResponse::new(f.as_ref(), c.as_ref(), packed.longest())
}

/// W and the criterion: log det (Ljung 1999, chapter 7) or the logarithm of the mean variance.
fn weights(covariance: &Mat<f64>, weighting: OutputWeights) -> Result<(Mat<f64>, f64), SysidError> {
    let p = covariance.nrows();
    let failed = |why: &str| SysidError::Numerical {
        what: "the covariance of the innovations",
        why: why.into(),
    };
    if !covariance.as_ref().is_all_finite() {
        return Err(failed("the predictor's output is not finite"));
    }
    match weighting {
        OutputWeights::Equal => {
            let trace: f64 = (0..p).map(|i| covariance[(i, i)]).sum();
            let mean = trace / p as f64 + ROUNDING;
            let scale = 1.0 / mean.sqrt();
            let w = Mat::from_fn(p, p, |i, j| if i == j { scale } else { 0.0 });
            Ok((w, mean.ln()))
        }
        OutputWeights::Covariance => {
            let eigen = covariance
                .self_adjoint_eigen(Side::Lower)
                .map_err(|_| failed("its eigenvalues were not found"))?;
            let (u, s) = (eigen.U(), eigen.S().column_vector());
            let values: Vec<f64> = s.iter().map(|value| value.max(0.0) + ROUNDING).collect();
            let w = Mat::from_fn(p, p, |i, j| u[(j, i)] / values[i].sqrt());
            let logs = values.iter().map(|value| value.ln()).sum::<f64>();
            Ok((w, logs / p as f64))
        }
    }
}

/// States and innovations from x(0) = 0.
fn run(record: &PackedRecord, model: &SystemMatrices) -> (Vec<f64>, Vec<f64>) {
    let n = model.order();
    let mut states = vec![0.0; record.samples * n];
    let mut innovations = record.outputs.clone();
    march(
        model,
        &vec![0.0; n],
        &record.inputs,
        &mut innovations,
        &mut states,
        Output::Residual,
    );
    (states, innovations)
}
