//! The bounded signals of the stacked future f = col(u, y), as rows of a quadratic program.

use super::settings::DeepcSettings;
use crate::hankel::{Shape, stacked_position};
use crate::solver::SoftPenalty;

/// One row per bounded signal and step. Rows are divided by the size of their channel in the
/// data, so that solver tolerances mean the same for all of them.
#[derive(Debug, Clone)]
pub(super) struct BoundRows {
    /// Position of the row's signal in f.
    pub positions: Vec<usize>,
    /// Divisor of the row.
    pub scales: Vec<f64>,
    /// Bounds in the signal's units, not divided.
    pub lower: Vec<f64>,
    /// Bounds in the signal's units, not divided.
    pub upper: Vec<f64>,
    /// Penalty of the signal's violation in its own units; `None` if hard.
    pub penalties: Vec<Option<SoftPenalty>>,
    /// Output channel of the row; `None` for inputs.
    outputs: Vec<Option<usize>>,
}

impl BoundRows {
    /// `future_scales`: size of every entry of f.
    pub fn new(shape: Shape, settings: &DeepcSettings, future_scales: &[f64]) -> Self {
        let mut rows = Self {
            positions: Vec::new(),
            scales: Vec::new(),
            lower: Vec::new(),
            upper: Vec::new(),
            penalties: Vec::new(),
            outputs: Vec::new(),
        };
        let steps = shape.horizons.future;
        let first_output = shape.inputs * steps;
        for time in 0..steps {
            for (channel, bounds) in settings.input_bounds.iter().enumerate() {
                let position = stacked_position(time, channel, shape.inputs);
                rows.push(position, bounds, None, None);
            }
        }
        for time in 0..steps {
            for (channel, output) in settings.output_bounds.iter().enumerate() {
                let position = first_output + stacked_position(time, channel, shape.outputs);
                rows.push(
                    position,
                    &output.bounds,
                    output.softness.penalty(),
                    Some(channel),
                );
            }
        }
        rows.scales = rows
            .positions
            .iter()
            .map(|&position| future_scales[position])
            .collect();
        rows
    }

    fn push(
        &mut self,
        position: usize,
        bounds: &super::Bounds,
        penalty: Option<SoftPenalty>,
        output: Option<usize>,
    ) {
        if bounds.is_bounded() {
            self.positions.push(position);
            self.lower.push(bounds.lower_value());
            self.upper.push(bounds.upper_value());
            self.penalties.push(penalty);
            self.outputs.push(output);
        }
    }

    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Penalties of the divided rows: a violation of the row is the signal's divided by the
    /// scale.
    pub fn row_penalties(&self) -> impl Iterator<Item = Option<SoftPenalty>> + '_ {
        self.penalties
            .iter()
            .zip(&self.scales)
            .map(|(penalty, scale)| {
                penalty.map(|penalty| SoftPenalty {
                    linear: penalty.linear * scale,
                    quadratic: penalty.quadratic * scale * scale,
                })
            })
    }

    /// Violation of row `row` by the future f.
    fn violation(&self, row: usize, future: &[f64]) -> f64 {
        let value = future[self.positions[row]];
        (self.lower[row] - value)
            .max(value - self.upper[row])
            .max(0.0)
    }

    /// Whether f meets every bound, to `tolerance` of the channel's size.
    pub fn are_met(&self, future: &[f64], tolerance: f64) -> bool {
        (0..self.len()).all(|row| {
            // Written so that NaN is not met.
            self.violation(row, future) <= tolerance * self.scales[row]
        })
    }

    /// Price of the violations of the soft rows.
    pub fn penalty(&self, future: &[f64]) -> f64 {
        let soft = |row: usize| self.penalties[row].map(|p| p.cost(self.violation(row, future)));
        (0..self.len()).filter_map(soft).sum()
    }

    /// Largest violation per output (written to `outputs`) and over all inputs (returned).
    pub fn largest_violations(&self, future: &[f64], outputs: &mut [f64]) -> f64 {
        outputs.fill(0.0);
        let mut inputs = 0.0_f64;
        for row in 0..self.len() {
            let violation = self.violation(row, future);
            match self.outputs[row] {
                Some(channel) => outputs[channel] = outputs[channel].max(violation),
                None => inputs = inputs.max(violation),
            }
        }
        inputs
    }
}
