//! The constraints on the stacked future f = col(u, y), as rows of a quadratic program.

use super::options::{AffineConstraint, Steps, Terminal};
use super::settings::Bounds;
use super::stage_settings::StageSettings;
use crate::hankel::{Shape, stacked_position};
use crate::solver::SoftPenalty;

/// Whom a row belongs to, for reporting its violation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner {
    Input,
    Output(usize),
    /// Affine or terminal.
    Other,
}

/// What moves both bounds of a row from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shift {
    Known(usize),
    Reference(usize),
}

/// One row per constraint and step. Rows are divided by the size of what they bound in the
/// data, so that solver tolerances mean the same for all of them.
#[derive(Debug, Clone, Default)]
pub(super) struct ConstraintRows {
    /// Row i has the terms `starts[i]..starts[i + 1]`.
    starts: Vec<usize>,
    positions: Vec<usize>,
    coefficients: Vec<f64>,
    /// Divisor of every row.
    pub scales: Vec<f64>,
    /// 1/divisor: a product is a fraction of a division, and every step has two per row.
    reciprocals: Vec<f64>,
    /// Bounds of the present step in the constraint's units, not divided.
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Rows whose bounds move, with what moves them, and their bounds at shift 0.
    moving: Vec<(usize, Shift, [f64; 2])>,
    /// Penalty of a violation in the constraint's units; `None` if hard.
    penalties: Vec<Option<SoftPenalty>>,
    owners: Vec<Owner>,
}

struct NewRow<'a> {
    terms: &'a [(usize, f64)],
    bounds: [f64; 2],
    shift: Option<Shift>,
    penalty: Option<SoftPenalty>,
    owner: Owner,
}

impl ConstraintRows {
    /// `future_scales`: size of every entry of f.
    pub fn new(shape: Shape, settings: &StageSettings, future_scales: &[f64]) -> Self {
        let mut rows = Self {
            starts: vec![0],
            ..Self::default()
        };
        rows.add_boxes(shape, settings);
        for (channel, bounds) in settings.options.input_change_bounds.iter().enumerate() {
            rows.add_change(shape, channel, bounds);
        }
        for constraint in &settings.options.affine {
            rows.add_affine(shape, constraint);
        }
        if let Some(terminal) = &settings.options.terminal {
            rows.add_terminal(shape, terminal);
        }
        rows.scales = (0..rows.len())
            .map(|row| {
                let size = rows.terms(row).map(|(i, c)| c.abs() * future_scales[i]);
                size.fold(0.0, f64::max)
            })
            .collect();
        rows.reciprocals = rows.scales.iter().map(|scale| 1.0 / scale).collect();
        rows
    }

    fn add_boxes(&mut self, shape: Shape, settings: &StageSettings) {
        let steps = shape.horizons.future;
        for time in 0..steps {
            for (channel, bounds) in settings.input_bounds.iter().enumerate() {
                self.push(&NewRow {
                    terms: &[(input_position(shape, time, channel), 1.0)],
                    bounds: [bounds.lower_value(), bounds.upper_value()],
                    shift: None,
                    penalty: None,
                    owner: Owner::Input,
                });
            }
        }
        for time in 0..steps {
            for (channel, output) in settings.output_bounds.iter().enumerate() {
                self.push(&NewRow {
                    terms: &[(output_position(shape, time, channel), 1.0)],
                    bounds: [output.bounds.lower_value(), output.bounds.upper_value()],
                    shift: None,
                    penalty: output.softness.penalty(),
                    owner: Owner::Output(channel),
                });
            }
        }
    }

    fn add_change(&mut self, shape: Shape, channel: usize, bounds: &Bounds) {
        for time in 0..shape.horizons.future {
            let this = (input_position(shape, time, channel), 1.0);
            let before = time
                .checked_sub(1)
                .map(|before| (input_position(shape, before, channel), -1.0));
            let terms: Vec<_> = std::iter::once(this).chain(before).collect();
            self.push(&NewRow {
                terms: &terms,
                bounds: [bounds.lower_value(), bounds.upper_value()],
                shift: (time == 0).then(|| Shift::Known(newest_input(shape, channel))),
                penalty: None,
                owner: Owner::Input,
            });
        }
    }

    fn add_affine(&mut self, shape: Shape, constraint: &AffineConstraint) {
        let range = constraint.steps.range(shape.horizons.future);
        for time in range.unwrap_or_default() {
            let inputs = constraint.inputs.iter().enumerate();
            let inputs = inputs.map(|(i, &c)| (input_position(shape, time, i), c));
            let outputs = constraint.outputs.iter().enumerate();
            let outputs = outputs.map(|(i, &c)| (output_position(shape, time, i), c));
            let terms: Vec<_> = inputs.chain(outputs).filter(|(_, c)| *c != 0.0).collect();
            self.push(&NewRow {
                terms: &terms,
                bounds: [
                    constraint.bounds.lower_value(),
                    constraint.bounds.upper_value(),
                ],
                shift: None,
                penalty: constraint.softness.penalty(),
                owner: Owner::Other,
            });
        }
    }

    fn add_terminal(&mut self, shape: Shape, terminal: &Terminal) {
        let range = Steps::Last(terminal.steps).range(shape.horizons.future);
        for time in range.unwrap_or_default() {
            let inputs = (0..shape.inputs).map(|i| input_position(shape, time, i));
            let outputs = (0..shape.outputs).map(|i| output_position(shape, time, i));
            for position in inputs.chain(outputs) {
                self.push(&NewRow {
                    terms: &[(position, 1.0)],
                    bounds: [0.0, 0.0],
                    shift: Some(Shift::Reference(position)),
                    penalty: terminal.softness.penalty(),
                    owner: Owner::Other,
                });
            }
        }
    }

    fn push(&mut self, row: &NewRow<'_>) {
        if row.bounds.iter().all(|bound| bound.is_infinite()) {
            return;
        }
        if let Some(shift) = row.shift {
            self.moving.push((self.len(), shift, row.bounds));
        }
        for &(position, coefficient) in row.terms {
            self.positions.push(position);
            self.coefficients.push(coefficient);
        }
        self.starts.push(self.positions.len());
        self.lower.push(row.bounds[0]);
        self.upper.push(row.bounds[1]);
        self.penalties.push(row.penalty);
        self.owners.push(row.owner);
    }

    pub fn len(&self) -> usize {
        self.owners.len()
    }

    /// Positions in f and coefficients of a row.
    pub fn terms(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[row]..self.starts[row + 1];
        let coefficients = &self.coefficients[range.clone()];
        self.positions[range]
            .iter()
            .copied()
            .zip(coefficients.iter().copied())
    }

    /// The signal that a row bounds by itself, if it is one.
    pub fn single(&self, row: usize) -> Option<usize> {
        let range = self.starts[row]..self.starts[row + 1];
        #[expect(clippy::float_cmp, reason = "a box row holds exactly 1")]
        let alone = range.len() == 1 && self.coefficients[range.start] == 1.0;
        alone.then(|| self.positions[range.start])
    }

    /// Value of a row at f, in the constraint's units.
    #[inline]
    pub fn value(&self, row: usize, future: &[f64]) -> f64 {
        let range = self.starts[row]..self.starts[row + 1];
        if range.len() == 1 {
            return self.coefficients[range.start] * future[self.positions[range.start]];
        }
        let mut value = 0.0;
        for k in range {
            value += self.coefficients[k] * future[self.positions[k]];
        }
        value
    }

    /// Moves the bounds to the present known part and reference.
    pub fn move_bounds(&mut self, known: &[f64], reference: &[f64]) {
        for &(row, shift, [lower, upper]) in &self.moving {
            let by = match shift {
                Shift::Known(i) => known[i],
                Shift::Reference(i) => reference[i],
            };
            self.lower[row] = lower + by;
            self.upper[row] = upper + by;
        }
    }

    /// Bounds of the divided rows, measured from the future `start`.
    pub fn bounds_from(&self, start: &[f64], lower: &mut [f64], upper: &mut [f64]) {
        for row in 0..self.len() {
            let (value, factor) = (self.value(row, start), self.reciprocals[row]);
            lower[row] = (self.lower[row] - value) * factor;
            upper[row] = (self.upper[row] - value) * factor;
        }
    }

    /// Bounds of the divided rows.
    pub fn bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        for row in 0..self.len() {
            lower[row] = self.lower[row] / self.scales[row];
            upper[row] = self.upper[row] / self.scales[row];
        }
    }

    /// Penalties of the divided rows: a violation of the row is the signal's divided by the
    /// scale.
    pub fn row_penalties(&self) -> impl Iterator<Item = Option<SoftPenalty>> + '_ {
        let pairs = self.penalties.iter().zip(&self.scales);
        pairs.map(|(penalty, scale)| {
            penalty.map(|penalty| SoftPenalty {
                linear: penalty.linear * scale,
                quadratic: penalty.quadratic * scale * scale,
            })
        })
    }

    /// Violation of a row by the future f, in the constraint's units.
    fn violation(&self, row: usize, future: &[f64]) -> f64 {
        let value = self.value(row, future);
        (self.lower[row] - value)
            .max(value - self.upper[row])
            .max(0.0)
    }

    /// Whether f meets every row, to `tolerance` of the row's size.
    pub fn are_met(&self, future: &[f64], tolerance: f64) -> bool {
        (0..self.len()).all(|row| {
            let value = self.value(row, future);
            let room = tolerance * self.scales[row];
            // Written so that NaN is not met.
            value >= self.lower[row] - room && value <= self.upper[row] + room
        })
    }

    /// Price of the violations of the soft rows, and the largest violation of each kind: of the
    /// inputs, of every output (written to `outputs`) and of the other rows.
    pub fn judge(&self, future: &[f64], outputs: &mut [f64]) -> Judgement {
        outputs.fill(0.0);
        let mut judgement = Judgement::default();
        for row in 0..self.len() {
            let violation = self.violation(row, future);
            if violation > 0.0 {
                if let Some(penalty) = self.penalties[row] {
                    judgement.penalty += penalty.cost(violation);
                }
                let worst = match self.owners[row] {
                    Owner::Input => &mut judgement.inputs,
                    Owner::Output(channel) => &mut outputs[channel],
                    Owner::Other => &mut judgement.others,
                };
                *worst = worst.max(violation);
            }
        }
        judgement
    }

    /// Price of the violations of the soft rows.
    pub fn penalty(&self, future: &[f64]) -> f64 {
        let soft = |row: usize| self.penalties[row].map(|p| p.cost(self.violation(row, future)));
        (0..self.len()).filter_map(soft).sum()
    }
}

/// What [`ConstraintRows::judge`] finds beside the outputs' violations.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Judgement {
    pub penalty: f64,
    pub inputs: f64,
    pub others: f64,
}

fn input_position(shape: Shape, time: usize, channel: usize) -> usize {
    stacked_position(time, channel, shape.inputs)
}

fn output_position(shape: Shape, time: usize, channel: usize) -> usize {
    shape.inputs * shape.horizons.future + stacked_position(time, channel, shape.outputs)
}

/// Position of u(−1) in the known part, whose first block is `u_ini`.
pub(super) fn newest_input(shape: Shape, channel: usize) -> usize {
    stacked_position(shape.horizons.past - 1, channel, shape.inputs)
}
