//! The latest samples, and which windows among them lie in one record.

use super::PlantData;
use crate::hankel::stacked_position;

/// A ring of samples. Samples are counted from 0 as they come, lost ones left out.
pub(super) struct Recent {
    channels: usize,
    window: usize,
    /// Capacity×channels, sample after sample.
    values: Vec<f64>,
    /// How many samples of its record a sample is, itself included.
    run: Vec<usize>,
    /// Samples so far.
    samples: usize,
    /// Samples of the present record so far.
    present_run: usize,
    /// Where every row of a time-major window stands in a column.
    positions: Vec<usize>,
    /// 1/scale of every row of a column.
    inverse_scales: Vec<f64>,
}

impl Recent {
    pub fn new(plant: &PlantData, capacity: usize) -> Self {
        let channels = plant.shape.channels();
        Self {
            channels,
            window: plant.shape.horizons.window(),
            values: vec![0.0; capacity * channels],
            run: vec![0; capacity],
            samples: 0,
            present_run: 0,
            positions: plant.shape.positions(),
            inverse_scales: plant.row_scales.iter().map(|scale| 1.0 / scale).collect(),
        }
    }

    /// The next sample begins a new record.
    pub fn begin_record(&mut self) {
        self.present_run = 0;
    }

    /// Takes one value per channel.
    pub fn push(&mut self, values: impl Iterator<Item = f64>) {
        let slot = self.slot(self.samples);
        let first = slot * self.channels;
        let places = &mut self.values[first..first + self.channels];
        for (place, value) in places.iter_mut().zip(values) {
            *place = value;
        }
        self.present_run += 1;
        self.run[slot] = self.present_run;
        self.samples += 1;
    }

    /// Samples so far.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Samples missing before the present record holds a window.
    pub fn missing(&self) -> usize {
        self.window.saturating_sub(self.present_run)
    }

    /// First sample of the window that ends with the newest sample, if it lies in one record.
    pub fn newest_column(&self) -> Option<usize> {
        let start = self.samples.checked_sub(self.window)?;
        self.is_column(start).then_some(start)
    }

    /// Whether the window that begins with sample `start` lies in one record. All its samples are
    /// in the ring.
    pub fn is_column(&self, start: usize) -> bool {
        self.run[self.slot(start + self.window - 1)] >= self.window
    }

    /// Writes that window as a column of H, channels scaled.
    pub fn write_column(&self, start: usize, column: &mut [f64]) {
        for time in 0..self.window {
            let first = self.slot(start + time) * self.channels;
            let values = &self.values[first..first + self.channels];
            for (channel, value) in values.iter().enumerate() {
                let row = self.positions[stacked_position(time, channel, self.channels)];
                column[row] = value * self.inverse_scales[row];
            }
        }
    }

    fn slot(&self, sample: usize) -> usize {
        sample % self.run.len()
    }
}
