//! The state estimate of the running controller.

use deepc_core::faer::MatRef;
use deepc_core::program::StateEstimator;

use super::design::Design;
use super::prediction::sizes;
use crate::state_space::StateSpace;

/// The Kalman predictor in its steady state, z(k+1) = A z + B u + L e with e = y − C z − D u, over
/// all samples since the start, and what starts it from a window.
///
/// All matrices stand row by row in one slice each, so that a step is a few short inner products.
pub(super) struct Observer {
    /// [A B L], `n_z`×(`n_z` + M + p).
    update: Vec<f64>,
    /// [C D], p×(`n_z` + M).
    output: Vec<f64>,
    /// For every sample of the window, Nᵢ, `n_z`×p.
    start: Vec<f64>,
    input_offsets: Vec<f64>,
    disturbance_offsets: Vec<f64>,
    output_offsets: Vec<f64>,
    /// Entries of the previewed disturbances, qN.
    preview: usize,
    /// (z, u, e): the state, and the deviations of the sample being taken.
    stacked: Vec<f64>,
    next: Vec<f64>,
    correction: Vec<f64>,
    sample: Vec<f64>,
}

impl Observer {
    pub fn new(model: &StateSpace, design: &Design, horizon: usize) -> Self {
        let (m, q, p, _) = sizes(model);
        let matrices = &design.matrices;
        let size = matrices.order();
        let offsets = |channels: &[crate::Channel]| channels.iter().map(|c| c.offset).collect();
        let windows = design.start_gain.ncols() / p.max(1);
        let start = (0..windows).flat_map(|time| rows(&[design.start_gain.subcols(time * p, p)]));
        Self {
            update: rows(&[
                matrices.a.as_ref(),
                matrices.b.as_ref(),
                matrices.k.as_ref(),
            ]),
            output: rows(&[matrices.c.as_ref(), matrices.d.as_ref()]),
            start: start.collect(),
            input_offsets: offsets(model.inputs()),
            disturbance_offsets: offsets(model.disturbances()),
            output_offsets: offsets(model.outputs()),
            preview: q * horizon,
            stacked: vec![0.0; size + m + q + p],
            next: vec![0.0; size],
            correction: vec![0.0; size],
            sample: vec![0.0; m + q + p],
        }
    }

    fn size(&self) -> usize {
        self.next.len()
    }

    /// Takes what stands in `sample`: u and d, then y.
    fn take_sample(&mut self) {
        let size = self.size();
        let (m, q, p) = (
            self.input_offsets.len(),
            self.disturbance_offsets.len(),
            self.output_offsets.len(),
        );
        let offsets = self.input_offsets.iter().chain(&self.disturbance_offsets);
        let inputs = self.sample[..m + q].iter().zip(offsets);
        let (known, innovation) = self.stacked.split_at_mut(size + m + q);
        for (target, (value, offset)) in known[size..].iter_mut().zip(inputs) {
            *target = value - offset;
        }
        let measured = self.sample[m + q..].iter().zip(&self.output_offsets);
        let predicted = self.output.chunks_exact(size + m + q);
        for ((e, (y, offset)), row) in innovation.iter_mut().zip(measured).zip(predicted) {
            *e = y - offset - dot(row, known);
        }
        let rows = self.update.chunks_exact(size + m + q + p);
        for (next, row) in self.next.iter_mut().zip(rows) {
            *next = dot(row, &self.stacked);
        }
        self.stacked[..size].copy_from_slice(&self.next);
    }
}

impl StateEstimator for Observer {
    fn coordinates(&self) -> usize {
        self.size() + 1 + self.preview
    }

    fn start(
        &mut self,
        inputs: MatRef<'_, f64>,
        disturbances: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    ) {
        let (size, p) = (self.size(), outputs.ncols());
        let (m, q) = (inputs.ncols(), disturbances.ncols());
        self.stacked.fill(0.0);
        self.correction.fill(0.0);
        for time in 0..outputs.nrows() {
            // Without disturbances there is no row, either.
            let measured = (q > 0).then(|| disturbances.row(time).iter());
            let series = inputs.row(time).iter();
            let series = series.chain(measured.into_iter().flatten());
            let series = series.chain(outputs.row(time).iter());
            let sample = self.sample.iter_mut();
            sample
                .zip(series)
                .for_each(|(entry, value)| *entry = *value);
            self.take_sample();
            let innovation = &self.stacked[size + m + q..];
            let rows = self.start[time * size * p..].chunks_exact(p);
            for (entry, row) in self.correction.iter_mut().zip(rows) {
                *entry += dot(row, innovation);
            }
        }
        let state = self.stacked[..size].iter_mut();
        state.zip(&self.correction).for_each(|(z, more)| *z += more);
    }

    fn observe(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        let sample = input.iter().chain(disturbance).chain(output);
        let entries = self.sample.iter_mut().zip(sample);
        entries.for_each(|(entry, value)| *entry = *value);
        self.take_sample();
    }

    fn write(&self, preview: &[f64], c: &mut [f64]) {
        let size = self.size();
        let (state, rest) = c.split_at_mut(size);
        state.copy_from_slice(&self.stacked[..size]);
        rest[0] = 1.0;
        let offsets = self.disturbance_offsets.iter().cycle();
        for (target, (value, offset)) in rest[1..].iter_mut().zip(preview.iter().zip(offsets)) {
            *target = value - offset;
        }
    }
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(a, b)| a * b).sum()
}

/// Matrices side by side, row by row.
fn rows(blocks: &[MatRef<'_, f64>]) -> Vec<f64> {
    let count = blocks.first().map_or(0, MatRef::nrows);
    let entries = (0..count).flat_map(|i| {
        let row = blocks
            .iter()
            .flat_map(move |block| block.row(i).iter().copied());
        row.collect::<Vec<_>>()
    });
    entries.collect()
}
