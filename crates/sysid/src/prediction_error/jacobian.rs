//! Derivatives of the innovations by all free parameters, as a triangle.

use deepc_core::faer::linalg::matmul::matmul;
use deepc_core::faer::{Accum, Mat, MatMut, MatRef, Par};

use super::parameters::{Entry, Layout};
use super::predictor::Evaluation;
use crate::error::SysidError;
use crate::least_squares::StreamedQr;
use crate::regressors::{BLOCK, FilterBank, FreeResponse, Packed};
use crate::state_space::SystemMatrices;

/// The weighted least-squares problem of one Gauss-Newton step, `‖R α + r‖² + rest` in local
/// coordinates α; the initial states have been eliminated (they are linear: Golub and Pereyra
/// 2003, with Kaufman's approximation).
pub(crate) struct Linearised {
    /// Entries of the parameter vector over local coordinates: full = `to_full` α.
    pub to_full: Mat<f64>,
    /// R over local coordinates, at most d×d.
    pub triangle: Mat<f64>,
    /// r, as long as R has rows.
    pub right: Vec<f64>,
    /// Sums of weighted derivative times innovation over consecutive spans of samples, spans×d; no
    /// row if not asked for.
    pub scores: Mat<f64>,
}

/// Linearises the whitened innovations about `model`, whose run is `run`. With `span` the scores
/// are summed over so many samples each.
pub(crate) fn linearise(
    packed: &Packed,
    model: &SystemMatrices,
    run: &Evaluation,
    layout: &Layout,
    span: Option<usize>,
) -> Result<Linearised, SysidError> {
    let rows = Rows::new(packed, model, run, layout);
    let scales = rows.scales();
    let mut to_full = layout.complement(model, &scales);
    for j in 0..to_full.ncols() {
        for (value, scale) in to_full.col_as_slice_mut(j).iter_mut().zip(&scales) {
            *value /= scale;
        }
    }
    let local = to_full.ncols();
    let maps = rows.maps(&to_full);
    let response = FreeResponse::new(rows.f.as_ref(), rows.c.as_ref(), packed.longest())?;
    let mut bank = FilterBank::new(rows.f.as_ref(), rows.c.as_ref(), layout.signals());
    let mut all = StreamedRecords::new(local);
    let mut scores = Scores {
        span: span.unwrap_or(0),
        local,
        p: layout.p,
        sums: Vec::new(),
        last: None,
    };
    for index in 0..packed.records.len() {
        let basis = response.basis(packed.records[index].samples)?;
        let mut qr = all.record(basis.ncols());
        bank.reset();
        rows.push(index, &mut bank, &maps, &response, &basis, |block, k| {
            scores.add(block.as_ref(), k);
            let rows = block.nrows();
            qr.rows(rows).copy_from(block);
        });
        all.finish(qr, basis.ncols());
        // The next record starts a span of its own.
        scores.last = None;
    }
    let r = all.triangle();
    let kept = r.nrows().min(local);
    Ok(Linearised {
        triangle: r.submatrix(0, 0, kept, local).to_owned(),
        right: (0..kept).map(|i| r[(i, local)]).collect(),
        scores: Mat::from_fn(scores.sums.len(), local, |i, j| scores.sums[i][j]),
        to_full,
    })
}

/// Sums of weighted derivatives times innovations over spans of samples.
struct Scores {
    /// Samples of a span; 0 if no sums are wanted.
    span: usize,
    local: usize,
    p: usize,
    sums: Vec<Vec<f64>>,
    /// Span of its record that the last sum belongs to.
    last: Option<usize>,
}

impl Scores {
    /// Takes a block of rows (all samples of the first output, then of the next, ...) whose first
    /// sample is k; innovations are in the last column, derivatives in those before.
    fn add(&mut self, block: MatRef<'_, f64>, k: usize) {
        let count = block.nrows() / self.p;
        let mut step = 0;
        while self.span > 0 && step < count {
            let current = (k + step) / self.span;
            let until = ((current + 1) * self.span - k).min(count);
            if self.last != Some(current) {
                self.sums.push(vec![0.0; self.local]);
                self.last = Some(current);
            }
            let first = block.ncols() - 1 - self.local;
            if let Some(sums) = self.sums.last_mut() {
                for l in 0..self.p {
                    let rows = block.subrows(l * count + step, until - step);
                    let right = rows.col(first + self.local);
                    for (j, sum) in sums.iter_mut().enumerate() {
                        *sum += rows.col(first + j).transpose() * right;
                    }
                }
            }
            step = until;
        }
    }
}

/// The triangles of the records, the initial states eliminated, in one.
struct StreamedRecords {
    local: usize,
    all: StreamedQr,
}

impl StreamedRecords {
    fn new(local: usize) -> Self {
        Self {
            local,
            all: StreamedQr::new(local + 1, BLOCK),
        }
    }

    fn record(&self, states: usize) -> StreamedQr {
        StreamedQr::new(states + self.local + 1, 2 * BLOCK)
    }

    fn finish(&mut self, mut qr: StreamedQr, states: usize) {
        let r = qr.triangle();
        for first in (states..r.nrows()).step_by(BLOCK) {
            let count = BLOCK.min(r.nrows() - first);
            let rest = r.submatrix(first, states, count, self.local + 1);
            self.all.rows(count).copy_from(rest);
        }
    }

    fn triangle(&mut self) -> MatRef<'_, f64> {
        self.all.triangle()
    }
}

/// How the rows of the Jacobian come about.
pub(super) struct Rows<'a> {
    packed: &'a Packed,
    model: &'a SystemMatrices,
    run: &'a Evaluation,
    layout: &'a Layout,
    entries: Vec<Entry>,
    /// A − KC.
    f: Mat<f64>,
    /// W C.
    c: Mat<f64>,
}

impl<'a> Rows<'a> {
    pub fn new(
        packed: &'a Packed,
        model: &'a SystemMatrices,
        run: &'a Evaluation,
        layout: &'a Layout,
    ) -> Self {
        Self {
            packed,
            model,
            run,
            layout,
            entries: layout.entries(),
            f: model.predictor(),
            c: &run.whitening * &model.c,
        }
    }

    /// Expected lengths of the columns of the Jacobian if all signals were white: the units in
    /// which steps are measured, so that neither the scale of a state nor that of an input matters.
    fn scales(&self) -> Vec<f64> {
        let (layout, n) = (self.layout, self.layout.n);
        let samples = self.packed.samples().max(1) as f64;
        let mean_square = |series: &[Vec<f64>], width: usize| -> Vec<f64> {
            let mut sums = vec![0.0; width];
            for row in series.iter().flat_map(|s| s.chunks_exact(width.max(1))) {
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += value * value;
                }
            }
            sums.iter().map(|sum| (sum / samples).sqrt()).collect()
        };
        let states = mean_square(&self.run.states, n);
        let innovations = mean_square(&self.run.innovations, layout.p);
        let mut inputs = vec![0.0; layout.inputs];
        for record in &self.packed.records {
            for row in record.inputs.chunks_exact(layout.inputs.max(1)) {
                for (sum, value) in inputs.iter_mut().zip(row) {
                    *sum += value * value / samples;
                }
            }
        }
        let inputs: Vec<f64> = inputs.iter().map(|sum| sum.sqrt()).collect();
        let gramian = super::balance::gramian(self.f.transpose(), self.c.transpose());
        let reach: Vec<f64> = (0..n).map(|i| gramian[(i, i)].max(0.0).sqrt()).collect();
        let weight: Vec<f64> = (0..layout.p)
            .map(|l| self.run.whitening.col(l).norm_l2())
            .collect();
        let mut scales: Vec<f64> = self
            .entries
            .iter()
            .map(|&entry| {
                samples.sqrt()
                    * match entry {
                        Entry::A(i, j) => reach[i] * states[j],
                        Entry::B(i, j) => reach[i] * inputs[j],
                        Entry::C(l, j) => weight[l] * states[j],
                        Entry::D(l, j) => weight[l] * inputs[j],
                        Entry::K(i, l) => reach[i] * innovations[l],
                    }
            })
            .collect();
        let largest = scales.iter().copied().fold(0.0, f64::max);
        let least = if largest > 0.0 { 1e-8 * largest } else { 1.0 };
        for scale in &mut scales {
            *scale = scale.max(least);
        }
        scales
    }

    /// Per output a map from what a sample provides (responses of the filter bank, states, inputs)
    /// to the derivatives by the coordinates whose parameters are the columns of `to_full`.
    fn maps(&self, to_full: &Mat<f64>) -> Vec<Mat<f64>> {
        let (layout, w) = (self.layout, &self.run.whitening);
        let (n, m, q) = (layout.n, layout.inputs, layout.signals());
        let innovation = if layout.dynamics { n + m } else { 0 };
        let (state, input) = (n * q, n * q + n);
        let maps = (0..layout.p).map(|l| {
            let mut map = Mat::zeros(self.width(), to_full.ncols());
            for column in 0..to_full.ncols() {
                let values = to_full.col_as_slice(column);
                let map = map.col_as_slice_mut(column);
                for (&entry, &value) in self.entries.iter().zip(values) {
                    // e = y − C x − D u falls where the prediction rises.
                    match entry {
                        Entry::A(i, j) => map[i * q + j] -= value,
                        Entry::B(i, j) => map[i * q + n + j] -= value,
                        Entry::K(i, j) => map[i * q + innovation + j] -= value,
                        Entry::C(h, j) => {
                            map[state + j] -= w[(l, h)] * value;
                            for i in 0..n {
                                map[i * q + j] += self.model.k[(i, h)] * value;
                            }
                        }
                        Entry::D(h, j) => {
                            map[input + j] -= w[(l, h)] * value;
                            for i in 0..n {
                                map[i * q + n + j] += self.model.k[(i, h)] * value;
                            }
                        }
                    }
                }
            }
            map
        });
        maps.collect()
    }

    /// Responses of the filter bank, states and inputs of one output and sample.
    fn width(&self) -> usize {
        let (layout, n) = (self.layout, self.layout.n);
        let direct = if layout.dynamics {
            n + layout.inputs
        } else {
            0
        };
        n * layout.signals() + direct
    }

    /// Hands blocks of rows `[initial state | parameters | innovation]`, whitened, to `take`, with
    /// the sample they start at.
    fn push(
        &self,
        index: usize,
        bank: &mut FilterBank,
        maps: &[Mat<f64>],
        response: &FreeResponse,
        basis: &Mat<f64>,
        mut take: impl FnMut(MatMut<'_, f64>, usize),
    ) {
        let (layout, record) = (self.layout, &self.packed.records[index]);
        let (n, m, p, q) = (layout.n, layout.inputs, layout.p, layout.signals());
        let (states, innovations) = (&self.run.states[index], &self.run.innovations[index]);
        let (initial, local) = (basis.ncols(), maps[0].ncols());
        let length = (BLOCK / p).clamp(1, record.samples.max(1));
        let mut provided = vec![Mat::<f64>::zeros(self.width(), length); p];
        let mut block = Mat::<f64>::zeros(length * p, initial + local + 1);
        let mut signals = vec![0.0; q];
        let mut k = 0;
        while k < record.samples {
            let count = length.min(record.samples - k);
            for step in 0..count {
                let x = &states[(k + step) * n..(k + step + 1) * n];
                let u = &record.inputs[(k + step) * m..(k + step + 1) * m];
                let e = &innovations[(k + step) * p..(k + step + 1) * p];
                for (l, provided) in provided.iter_mut().enumerate() {
                    let column = provided.col_as_slice_mut(step);
                    let responses = column.chunks_exact_mut(q.max(1)).zip(bank.responses(l));
                    responses.for_each(|(to, from)| to.copy_from_slice(from));
                    if layout.dynamics {
                        column[n * q..n * q + n].copy_from_slice(x);
                        column[n * q + n..].copy_from_slice(u);
                    }
                }
                let (dynamic, rest) = signals.split_at_mut(if layout.dynamics { n + m } else { 0 });
                if layout.dynamics {
                    dynamic[..n].copy_from_slice(x);
                    dynamic[n..].copy_from_slice(u);
                }
                if layout.gain {
                    rest.copy_from_slice(e);
                }
                bank.step(&signals);
            }
            let mut rows = block.subrows_mut(0, count * p);
            for l in 0..p {
                let mut rows = rows.as_mut().subrows_mut(l * count, count);
                initial_columns(response, basis, k, l, rows.as_mut());
                matmul(
                    rows.as_mut().subcols_mut(initial, local),
                    Accum::Replace,
                    provided[l].subcols(0, count).transpose(),
                    &maps[l],
                    1.0,
                    Par::Seq,
                );
                for step in 0..count {
                    let e = &innovations[(k + step) * p..(k + step + 1) * p];
                    let weighted = (0..p).map(|h| self.run.whitening[(l, h)] * e[h]).sum();
                    rows[(step, initial + local)] = weighted;
                }
            }
            take(rows, k);
            k += count;
        }
    }

    /// The whole Jacobian of the whitened innovations by all entries for initial states that stay,
    /// one row per sample and output.
    #[cfg(test)]
    pub fn full(&self) -> Mat<f64> {
        let (p, count) = (self.layout.p, self.entries.len());
        let maps = self.maps(&Mat::identity(count, count));
        let response = FreeResponse::new(self.f.as_ref(), self.c.as_ref(), 1).unwrap();
        let nothing = Mat::zeros(self.layout.n, 0);
        let mut bank = FilterBank::new(self.f.as_ref(), self.c.as_ref(), self.layout.signals());
        let mut full = Mat::zeros(self.packed.samples() * p, count);
        let mut before = 0;
        for (index, record) in self.packed.records.iter().enumerate() {
            bank.reset();
            self.push(index, &mut bank, &maps, &response, &nothing, |block, k| {
                let samples = block.nrows() / p;
                for row in 0..block.nrows() {
                    let (l, step) = (row / samples, row % samples);
                    let target = (before + k + step) * p + l;
                    full.row_mut(target)
                        .copy_from(block.as_ref().row(row).subcols(0, count));
                }
            });
            before += record.samples;
        }
        full
    }
}

/// Columns of the initial states in the rows of output `l` from sample `k` on.
fn initial_columns(
    response: &FreeResponse,
    basis: &Mat<f64>,
    k: usize,
    l: usize,
    mut rows: MatMut<'_, f64>,
) {
    let kept = response.kept().saturating_sub(k).min(rows.nrows());
    for j in 0..basis.ncols() {
        let basis = basis.col_as_slice(j);
        let (top, mut rest) = rows.as_mut().col_mut(j).split_at_row_mut(kept);
        for (step, value) in top.iter_mut().enumerate() {
            let free = response.at(k + step, l);
            *value = -basis.iter().zip(free).map(|(b, r)| b * r).sum::<f64>();
        }
        rest.fill(0.0);
    }
}
