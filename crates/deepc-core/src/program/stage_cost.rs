//! What the future costs: ‖u − `u_r‖²_R` + ‖y − `y_r‖²_Q` + Σ‖u(k) − `u(k−1)‖²_S`.

use faer::{Mat, MatRef};

use super::rows::newest_input;
use super::stage_settings::StageSettings;
use crate::hankel::{Shape, stacked_position};

/// The quadratic cost (f − r)ᵀW(f − r) + Δuᵀ S Δu of a stacked future f = col(u, y) with the
/// diagonal W = blkdiag(R, Q) and Δu(0) = u(0) − u(−1).
#[derive(Debug, Clone)]
pub(super) struct StageCost {
    shape: Shape,
    /// Diagonal of W, one per entry of f.
    pub weights: Vec<f64>,
    /// Diagonal of S for one step, m entries; empty if all are 0.
    changes: Vec<f64>,
}

/// The cost by its summands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TrackingCost {
    pub inputs: f64,
    pub outputs: f64,
    pub changes: f64,
}

impl TrackingCost {
    pub fn total(&self) -> f64 {
        self.inputs + self.outputs + self.changes
    }
}

impl StageCost {
    pub fn new(shape: Shape, settings: &StageSettings) -> Self {
        let options = &settings.options;
        let steps = shape.horizons.future;
        let block = |weights: &[f64], factors: &[Vec<f64>]| -> Vec<f64> {
            (0..steps)
                .flat_map(|time| {
                    weights.iter().enumerate().map(move |(channel, weight)| {
                        weight * factors.get(time).map_or(1.0, |row| row[channel])
                    })
                })
                .collect()
        };
        let mut weights = block(&settings.input_weights, &options.input_weight_factors);
        weights.extend(block(
            &settings.output_weights,
            &options.output_weight_factors,
        ));
        let some = options.input_change_weights.iter().any(|&w| w > 0.0);
        Self {
            shape,
            weights,
            changes: if some {
                options.input_change_weights.clone()
            } else {
                Vec::new()
            },
        }
    }

    /// Every weighted change: (weight, position of u(k), position of u(k−1) if it is in f,
    /// channel).
    fn changes(&self) -> impl Iterator<Item = (f64, usize, Option<usize>, usize)> + '_ {
        let m = self.shape.inputs;
        (0..self.shape.horizons.future).flat_map(move |time| {
            let channels = self.changes.iter().enumerate();
            channels
                .filter(|(_, weight)| **weight > 0.0)
                .map(move |(channel, &weight)| {
                    let before = time.checked_sub(1);
                    let before = before.map(|time| stacked_position(time, channel, m));
                    (weight, stacked_position(time, channel, m), before, channel)
                })
        })
    }

    /// Entries (i, j, value) of the curvature W + `DᵀSD`, both triangles.
    pub fn curvature(&self) -> Vec<(usize, usize, f64)> {
        let weights = self.weights.iter().enumerate();
        let mut entries: Vec<_> = weights.map(|(i, &weight)| (i, i, weight)).collect();
        for (weight, now, before, _) in self.changes() {
            entries.push((now, now, weight));
            if let Some(before) = before {
                entries.push((before, before, weight));
                entries.push((now, before, -weight));
                entries.push((before, now, -weight));
            }
        }
        entries
    }

    /// Entries of f that W weighs.
    pub fn weighted(&self) -> Vec<usize> {
        let entries = 0..self.weights.len();
        entries.filter(|&i| self.weights[i] > 0.0).collect()
    }

    /// The rows of √cost·X for a matrix X with one row per entry of f, but for rows of zeros: those
    /// of [`weighted`](Self::weighted), then those of the changes.
    pub fn root_times(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let weighted = self.weighted();
        let changes: Vec<_> = self.changes().collect();
        Mat::from_fn(weighted.len() + changes.len(), x.ncols(), |i, j| {
            match i.checked_sub(weighted.len()) {
                None => self.weights[weighted[i]].sqrt() * x[(weighted[i], j)],
                Some(i) => {
                    let (weight, now, before, _) = changes[i];
                    weight.sqrt() * (x[(now, j)] - before.map_or(0.0, |before| x[(before, j)]))
                }
            }
        })
    }

    /// The changes from u(−1): (row among those of [`root_times`](Self::root_times) after the
    /// weights of W, position in the known part, weight).
    pub fn newest_inputs(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let changes = self.changes().enumerate();
        changes
            .filter(|(_, (_, _, before, _))| before.is_none())
            .map(|(row, (weight, _, _, channel))| (row, newest_input(self.shape, channel), weight))
    }

    /// Minus half the gradient at f = 0: W r plus the pull of u(−1).
    pub fn pull(&self, known: &[f64], reference: &[f64], out: &mut [f64]) {
        let pairs = self.weights.iter().zip(reference);
        for (out, (weight, reference)) in out.iter_mut().zip(pairs) {
            *out = weight * reference;
        }
        for (weight, now, before, channel) in self.changes() {
            if before.is_none() {
                out[now] += weight * known[newest_input(self.shape, channel)];
            }
        }
    }

    /// The cost of f.
    pub fn tracking(&self, future: &[f64], known: &[f64], reference: &[f64]) -> TrackingCost {
        let first_output = self.shape.inputs * self.shape.horizons.future;
        let cost = |range: std::ops::Range<usize>| -> f64 {
            let mut sum = 0.0;
            for i in range {
                let error = future[i] - reference[i];
                sum += self.weights[i] * error * error;
            }
            sum
        };
        let mut changes = 0.0;
        for (weight, now, before, channel) in self.changes() {
            let before = before.map_or(known[newest_input(self.shape, channel)], |b| future[b]);
            changes += weight * (future[now] - before) * (future[now] - before);
        }
        TrackingCost {
            inputs: cost(0..first_output),
            outputs: cost(first_output..future.len()),
            changes,
        }
    }
}
