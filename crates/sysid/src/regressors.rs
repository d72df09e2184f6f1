//! What the output is linear in: responses of the observer to single signals and to the state.

use deepc_core::faer::{Mat, MatRef};

use crate::error::SysidError;
pub(crate) use crate::kernels::{add_product, add_scaled};
use crate::kernels::{filter, free_rows, stride};
use crate::least_squares::{StreamedQr, thin_svd};
use crate::working::{WorkingData, WorkingRecord};

/// Free responses below this fraction of their largest value are rounding.
const DECAYED: f64 = 1e-18;

/// Directions of the initial state whose response is below this fraction of the largest (each
/// state scaled to a response of size 1) are not estimated.
const UNOBSERVED: f64 = 1e-11;

/// Rows that go through one QR decomposition.
pub(crate) const BLOCK: usize = 256;

/// Records sample by sample, with the active inputs only.
pub(crate) struct Packed {
    pub inputs: usize,
    pub outputs: usize,
    pub records: Vec<PackedRecord>,
}

/// One record, row by row.
pub(crate) struct PackedRecord {
    pub samples: usize,
    pub inputs: Vec<f64>,
    pub outputs: Vec<f64>,
}

impl PackedRecord {
    fn new(record: &WorkingRecord, active: &[usize]) -> Self {
        let samples = record.samples();
        let mut inputs = Vec::with_capacity(samples * active.len());
        let mut outputs = Vec::with_capacity(samples * record.outputs.ncols());
        for k in 0..samples {
            inputs.extend(active.iter().map(|&j| record.inputs[(k, j)]));
            outputs.extend(record.outputs.row(k).iter());
        }
        Self {
            samples,
            inputs,
            outputs,
        }
    }
}

impl Packed {
    pub fn new(data: &WorkingData, active: &[usize]) -> Self {
        let records = data.records.iter();
        Self {
            inputs: active.len(),
            outputs: data.outputs.len(),
            records: records.map(|r| PackedRecord::new(r, active)).collect(),
        }
    }

    /// Of all records together.
    pub fn samples(&self) -> usize {
        self.records.iter().map(|record| record.samples).sum()
    }

    /// Of the longest record.
    pub fn longest(&self) -> usize {
        let samples = self.records.iter().map(|record| record.samples);
        samples.max().unwrap_or(0)
    }
}

/// For every output l the responses `v_l(k+1) = Fᵀ v_l(k) + C_lᵀ s_j(k)` to every signal j: entry i
/// is the response of output l to signal j acting on state i, `C_l (qI − F)⁻¹ e_i s_j`. So n·p
/// numbers per signal give the derivatives of the output by everything that multiplies the signal.
pub(crate) struct FilterBank {
    n: usize,
    signals: usize,
    /// Numbers per state: the signals, filled up to whole registers.
    lanes: usize,
    /// F and C, row by row.
    f: Vec<f64>,
    c: Vec<f64>,
    values: Vec<f64>,
    state: Vec<f64>,
    next: Vec<f64>,
}

impl FilterBank {
    pub fn new(f: MatRef<'_, f64>, c: MatRef<'_, f64>, signals: usize) -> Self {
        let (n, p) = (f.nrows(), c.nrows());
        let rows = |m: MatRef<'_, f64>| -> Vec<f64> {
            (0..m.nrows())
                .flat_map(|i| (0..m.ncols()).map(move |j| m[(i, j)]))
                .collect()
        };
        let lanes = stride(signals);
        Self {
            n,
            signals,
            lanes,
            f: rows(f),
            c: rows(c),
            values: vec![0.0; lanes],
            state: vec![0.0; p * n * lanes],
            next: vec![0.0; p * n * lanes],
        }
    }

    pub fn reset(&mut self) {
        self.state.fill(0.0);
    }

    /// Responses of output `l` to all signals, state by state.
    pub fn responses(&self, l: usize) -> impl Iterator<Item = &[f64]> {
        let size = self.n * self.lanes;
        let states = self.state[l * size..(l + 1) * size].chunks_exact(self.lanes.max(1));
        states.map(|responses| &responses[..self.signals])
    }

    /// One sample on, with these values of the signals.
    pub fn step(&mut self, values: &[f64]) {
        let size = self.n * self.lanes;
        if size == 0 {
            return;
        }
        self.values[..self.signals].copy_from_slice(values);
        let outputs = self
            .next
            .chunks_exact_mut(size)
            .zip(self.state.chunks_exact(size))
            .zip(self.c.chunks_exact(self.n));
        for ((next, state), c) in outputs {
            filter(&self.f, c, &self.values, state, next, self.lanes);
        }
        std::mem::swap(&mut self.state, &mut self.next);
    }
}

/// The responses `C Fᵏ` to the state at the start of a record.
pub(crate) struct FreeResponse {
    n: usize,
    p: usize,
    /// Samples until they have decayed.
    kept: usize,
    /// Numbers from one row to the next.
    stride: usize,
    /// C Fᵏ, row by row, sample after sample.
    rows: Vec<f64>,
    /// Of the records at least `kept` long: n×rank, so that `C Fᵏ basis` is orthonormal over all k.
    basis: Mat<f64>,
}

impl FreeResponse {
    /// # Errors
    /// The response overflows within `samples`.
    pub fn new(f: MatRef<'_, f64>, c: MatRef<'_, f64>, samples: usize) -> Result<Self, SysidError> {
        let (n, p) = (f.nrows(), c.nrows());
        let rows = free_rows(f, c, samples, DECAYED).ok_or_else(|| SysidError::Unstable {
            what: "the model whose response to its initial state is fitted",
            radius: crate::stability::spectral_radius(f),
            limit: 1.0,
            remedy: "stabilise it first",
        })?;
        let stride = stride(n);
        let kept = rows.len().checked_div(p * stride).unwrap_or(0);
        let mut response = Self {
            n,
            p,
            kept,
            stride,
            rows,
            basis: Mat::zeros(n, 0),
        };
        response.basis = response.orthonormal(kept)?;
        Ok(response)
    }

    /// Samples until the response has decayed.
    pub fn kept(&self) -> usize {
        self.kept
    }

    /// Row `l` of `C Fᵏ`, for k below [`kept`](Self::kept).
    pub fn at(&self, k: usize, l: usize) -> &[f64] {
        let first = (k * self.p + l) * self.stride;
        &self.rows[first..first + self.n]
    }

    /// n×rank, so that `C Fᵏ basis` is orthonormal over the samples of a record.
    pub fn basis(&self, samples: usize) -> Result<Mat<f64>, SysidError> {
        if samples >= self.kept {
            Ok(self.basis.clone())
        } else {
            self.orthonormal(samples)
        }
    }

    fn orthonormal(&self, samples: usize) -> Result<Mat<f64>, SysidError> {
        let (n, p) = (self.n, self.p);
        let mut qr = StreamedQr::new(n, BLOCK);
        for first in (0..samples * p).step_by(BLOCK) {
            let count = BLOCK.min(samples * p - first);
            let mut block = qr.rows(count);
            let rows = &self.rows[first * self.stride..(first + count) * self.stride];
            block.copy_from(MatRef::from_row_major_slice(rows, count, self.stride).subcols(0, n));
        }
        let r = qr.triangle();
        let scales: Vec<f64> = (0..n)
            .map(|j| match r.col(j).norm_l2() {
                0.0 => 0.0,
                length => 1.0 / length,
            })
            .collect();
        let scaled = Mat::from_fn(r.nrows(), n, |i, j| r[(i, j)] * scales[j]);
        let svd = thin_svd(scaled.as_ref(), "the observability of a model")?;
        let rank = svd.rank(UNOBSERVED);
        Ok(Mat::from_fn(n, rank, |i, j| {
            scales[i] * svd.v[(i, j)] / svd.values[j]
        }))
    }

    /// The initial state whose response is closest to `series` (row by row, p columns), of minimum
    /// norm; its response is taken off the series.
    pub fn take_off(&self, series: &mut [f64], basis: &Mat<f64>) -> Vec<f64> {
        let n = self.n;
        let mut initial = vec![0.0; n];
        if n == 0 {
            return initial;
        }
        let rows = self.rows.chunks_exact(self.stride).map(|row| &row[..n]);
        // The second pass corrects the rounding of the first (corrected semi-normal equations).
        for _ in 0..2 {
            let mut gradient = vec![0.0; n];
            for (row, &value) in rows.clone().zip(series.iter()) {
                add_scaled(&mut gradient, value, row);
            }
            let mut correction = vec![0.0; n];
            for j in 0..basis.ncols() {
                let column = basis.col_as_slice(j);
                let along = column.iter().zip(&gradient).map(|(b, g)| b * g).sum();
                add_scaled(&mut correction, along, column);
            }
            for (row, value) in rows.clone().zip(series.iter_mut()) {
                *value -= row.iter().zip(&correction).map(|(r, x)| r * x).sum::<f64>();
            }
            add_scaled(&mut initial, 1.0, &correction);
        }
        initial
    }
}
