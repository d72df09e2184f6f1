//! The order of the rows of a data matrix, in one place.

use std::ops::Range;

use faer::MatRef;
use serde::{Deserialize, Serialize};

use super::stacking::stacked_position;
use crate::data::Record;

/// The two horizons, in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Horizons {
    /// Past window `T_ini`: long enough to fix the plant's state (at least its lag).
    pub past: usize,
    /// Prediction horizon N.
    pub future: usize,
}

impl Horizons {
    /// `past` = `T_ini` and `future` = N samples.
    #[must_use]
    pub fn new(past: usize, future: usize) -> Self {
        Self { past, future }
    }

    /// Window L = `T_ini` + N.
    #[must_use]
    pub fn window(&self) -> usize {
        self.past.saturating_add(self.future)
    }
}

/// The six blocks of rows, in their order. The first four are known when the controller decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// `U_p`, m·`T_ini` rows.
    PastInputs,
    /// `D_p`, q·`T_ini` rows.
    PastDisturbances,
    /// `Y_p`, p·`T_ini` rows.
    PastOutputs,
    /// `D_f`, q·N rows.
    FutureDisturbances,
    /// `U_f`, m·N rows.
    FutureInputs,
    /// `Y_f`, p·N rows.
    FutureOutputs,
}

impl Block {
    /// All of them, from the top row down.
    pub const ALL: [Self; 6] = [
        Self::PastInputs,
        Self::PastDisturbances,
        Self::PastOutputs,
        Self::FutureDisturbances,
        Self::FutureInputs,
        Self::FutureOutputs,
    ];

    fn is_past(self) -> bool {
        matches!(
            self,
            Self::PastInputs | Self::PastDisturbances | Self::PastOutputs
        )
    }

    /// Of three things, one per role of a channel, the one that stands in this block.
    fn pick<T>(self, inputs: T, disturbances: T, outputs: T) -> T {
        match self {
            Self::PastInputs | Self::FutureInputs => inputs,
            Self::PastDisturbances | Self::FutureDisturbances => disturbances,
            Self::PastOutputs | Self::FutureOutputs => outputs,
        }
    }
}

/// Sizes shared by everything built from one Hankel matrix: m inputs, q measured disturbances, p
/// outputs, horizons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shape {
    /// Input channels m.
    pub inputs: usize,
    /// Measured disturbances q, which may be 0.
    pub disturbances: usize,
    /// Output channels p.
    pub outputs: usize,
    /// Horizons `T_ini` and N.
    pub horizons: Horizons,
}

impl Shape {
    /// All channels: m + q + p.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.inputs + self.disturbances + self.outputs
    }

    /// Length of what is known when the controller decides, (`u_ini`, `d_ini`, `y_ini`, d):
    /// (m + q + p)·`T_ini` + q·N.
    #[must_use]
    pub fn known_rows(&self) -> usize {
        self.channels() * self.horizons.past + self.disturbances * self.horizons.future
    }

    /// Length of what is decided, the stacked future (u, y): (m + p)·N.
    #[must_use]
    pub fn future_rows(&self) -> usize {
        (self.inputs + self.outputs) * self.horizons.future
    }

    /// Rows of the stacked Hankel matrix: (m + q + p)·L.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.known_rows() + self.future_rows()
    }

    /// The rows of a block.
    #[must_use]
    pub fn rows_of(&self, block: Block) -> Range<usize> {
        let size = |block| self.channels_of(block) * self.steps_of(block);
        let above = Block::ALL.into_iter().take_while(|&other| other != block);
        let first: usize = above.map(size).sum();
        first..first + size(block)
    }

    /// One value per row of the stacked Hankel matrix, from one value per channel.
    pub(crate) fn per_row<T: Copy>(
        &self,
        inputs: &[T],
        disturbances: &[T],
        outputs: &[T],
    ) -> Vec<T> {
        let blocks = Block::ALL.into_iter();
        let values = blocks.flat_map(|block| {
            let values = block.pick(inputs, disturbances, outputs);
            values.repeat(self.steps_of(block))
        });
        values.collect()
    }

    /// Writes the window of L samples of `record` that starts at sample `start` as a column of
    /// the stacked Hankel matrix.
    pub(crate) fn write_window(&self, record: &Record, start: usize, column: &mut [f64]) {
        let signals = (record.inputs(), record.disturbances(), record.outputs());
        for block in Block::ALL {
            let series = block.pick(signals.0, signals.1, signals.2);
            let first = start
                + if block.is_past() {
                    0
                } else {
                    self.horizons.past
                };
            let channels = series.ncols();
            let rows = &mut column[self.rows_of(block)];
            for channel in 0..channels {
                let values = series.col(channel).subrows(first, self.steps_of(block));
                for (time, &value) in values.iter().enumerate() {
                    rows[stacked_position(time, channel, channels)] = value;
                }
            }
        }
    }

    /// Where every row of the time-major stack of all channels (inputs, disturbances, outputs of
    /// a sample side by side, L samples) stands in the stacked Hankel matrix.
    pub(crate) fn positions(&self) -> Vec<usize> {
        use Block::{
            FutureDisturbances, FutureInputs, FutureOutputs, PastDisturbances, PastInputs,
            PastOutputs,
        };
        let Horizons { past, future } = self.horizons;
        let sides = [
            (past, [PastInputs, PastDisturbances, PastOutputs]),
            (future, [FutureInputs, FutureDisturbances, FutureOutputs]),
        ];
        let mut positions = Vec::with_capacity(self.rows());
        for (steps, blocks) in sides {
            for time in 0..steps {
                for block in blocks {
                    let channels = self.channels_of(block);
                    let first = self.rows_of(block).start;
                    let rows = 0..channels;
                    positions.extend(rows.map(|i| first + stacked_position(time, i, channels)));
                }
            }
        }
        positions
    }

    fn channels_of(&self, block: Block) -> usize {
        block.pick(self.inputs, self.disturbances, self.outputs)
    }

    fn steps_of(&self, block: Block) -> usize {
        if block.is_past() {
            self.horizons.past
        } else {
            self.horizons.future
        }
    }
}

/// The blocks of a data matrix with the rows `col(u_ini, d_ini, y_ini, d, u, y)`, by name.
#[derive(Debug, Clone, Copy)]
pub struct Blocks<'a> {
    /// `U_p`, m·`T_ini` rows.
    pub past_inputs: MatRef<'a, f64>,
    /// `D_p`, q·`T_ini` rows.
    pub past_disturbances: MatRef<'a, f64>,
    /// `Y_p`, p·`T_ini` rows.
    pub past_outputs: MatRef<'a, f64>,
    /// `D_f`, q·N rows.
    pub future_disturbances: MatRef<'a, f64>,
    /// `U_f`, m·N rows.
    pub future_inputs: MatRef<'a, f64>,
    /// `Y_f`, p·N rows.
    pub future_outputs: MatRef<'a, f64>,
}

impl<'a> Blocks<'a> {
    /// Of a matrix with `shape.rows()` rows.
    pub(crate) fn of(matrix: MatRef<'a, f64>, shape: Shape) -> Self {
        let block = |block| {
            let rows = shape.rows_of(block);
            matrix.subrows(rows.start, rows.len())
        };
        Self {
            past_inputs: block(Block::PastInputs),
            past_disturbances: block(Block::PastDisturbances),
            past_outputs: block(Block::PastOutputs),
            future_disturbances: block(Block::FutureDisturbances),
            future_inputs: block(Block::FutureInputs),
            future_outputs: block(Block::FutureOutputs),
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;

    use super::*;
    use crate::data::Dataset;

    const SHAPE: Shape = Shape {
        inputs: 2,
        disturbances: 1,
        outputs: 3,
        horizons: Horizons { past: 2, future: 3 },
    };

    #[test]
    fn blocks_fill_the_rows_without_gap() {
        let mut next = 0;
        for block in Block::ALL {
            let rows = SHAPE.rows_of(block);
            assert_eq!(rows.start, next);
            next = rows.end;
        }
        assert_eq!(next, SHAPE.rows());
        assert_eq!(SHAPE.rows(), 30);
        assert_eq!(SHAPE.known_rows(), 15);
        assert_eq!(SHAPE.rows_of(Block::FutureInputs).start, 15);
    }

    /// A value says which channel and which sample it is.
    #[test]
    fn a_window_stands_in_the_named_order() {
        let series = |channels, base: f64| {
            Mat::from_fn(7, channels, |k, i| base + 10.0 * i as f64 + k as f64)
        };
        let mut data =
            Dataset::with_disturbances(1.0, ["u1", "u2"], ["d"], ["y1", "y2", "y3"]).unwrap();
        data.push_record_with_disturbances(series(2, 100.0), series(1, 200.0), series(3, 300.0))
            .unwrap();
        let mut column = vec![0.0; SHAPE.rows()];
        SHAPE.write_window(&data.records()[0], 1, &mut column);
        let expected = [
            vec![101.0, 111.0, 102.0, 112.0],
            vec![201.0, 202.0],
            vec![301.0, 311.0, 321.0, 302.0, 312.0, 322.0],
            vec![203.0, 204.0, 205.0],
            vec![103.0, 113.0, 104.0, 114.0, 105.0, 115.0],
            vec![
                303.0, 313.0, 323.0, 304.0, 314.0, 324.0, 305.0, 315.0, 325.0,
            ],
        ];
        assert_eq!(column, expected.concat());
        let channels = data.records()[0].channels();
        let placed: Vec<_> = SHAPE
            .positions()
            .iter()
            .map(|&place| column[place])
            .collect();
        let in_time: Vec<_> = (0..placed.len())
            .map(|row| channels[row % channels.len()][1 + row / channels.len()])
            .collect();
        assert_eq!(placed, in_time);
        let owners = SHAPE.per_row(&[1, 2], &[3], &[4, 5, 6]);
        assert_eq!(owners.len(), SHAPE.rows());
        assert_eq!(&owners[12..19], [3, 3, 3, 1, 2, 1, 2]);
    }
}
