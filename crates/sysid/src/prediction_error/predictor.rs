//! Running the predictor over all records: innovations, states, covariance, criterion.

use deepc_core::faer::{Mat, Side};

use super::OutputWeights;
use crate::error::SysidError;
use crate::kernels::{Output, march};
use crate::regressors::{FreeResponse, Packed, PackedRecord, add_product};
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
        let (n, p) = (model.order(), packed.outputs);
        let f = model.predictor();
        let unobserved = Unweighted::new(&f, model, response.kept());
        let (mut states, mut innovations, mut initial) = (Vec::new(), Vec::new(), Vec::new());
        let mut covariance = Mat::zeros(p, p);
        for record in &packed.records {
            let (mut x, mut e) = run(record, model);
            let mut weighted = vec![0.0; e.len()];
            for (weighted, e) in weighted.chunks_exact_mut(p).zip(e.chunks_exact(p)) {
                add_product(weighted, whitening, e);
            }
            let start = response.take_off(&mut weighted, &response.basis(record.samples)?);
            unobserved.add(&start, &mut x, &mut e, n, p);
            for e in e.chunks_exact(p) {
                for i in 0..p {
                    for j in 0..=i {
                        covariance[(i, j)] += e[i] * e[j];
                    }
                }
            }
            states.push(x);
            innovations.push(e);
            initial.push(start);
        }
        let samples = packed.samples().max(1) as f64;
        for i in 0..p {
            for j in 0..=i {
                covariance[(i, j)] /= samples;
                covariance[(j, i)] = covariance[(i, j)];
            }
        }
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

/// The free motion `x(k+1) = F x(k)`, e = −C x, until it has decayed.
struct Unweighted<'a> {
    f: &'a Mat<f64>,
    c: Mat<f64>,
    samples: usize,
}

impl<'a> Unweighted<'a> {
    fn new(f: &'a Mat<f64>, model: &SystemMatrices, samples: usize) -> Self {
        Self {
            f,
            c: -&model.c,
            samples,
        }
    }

    fn add(&self, start: &[f64], states: &mut [f64], innovations: &mut [f64], n: usize, p: usize) {
        if n == 0 {
            return;
        }
        let (mut free, mut next) = (start.to_vec(), vec![0.0; n]);
        let samples = states
            .chunks_exact_mut(n)
            .zip(innovations.chunks_exact_mut(p));
        for (x, e) in samples.take(self.samples) {
            for (x, free) in x.iter_mut().zip(&free) {
                *x += free;
            }
            add_product(e, &self.c, &free);
            next.fill(0.0);
            add_product(&mut next, self.f, &free);
            std::mem::swap(&mut free, &mut next);
        }
    }
}
