//! Which part of the data predicts and which part judges. They share no sample.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::error::AssessmentError;
use crate::data::Dataset;
use crate::hankel::{HankelError, Horizons, Shape};

/// The samples that are kept away from the predictor and used to judge it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum HoldOut {
    /// The last quarter of every record.
    LastQuarter,
    /// These records, numbered from 1.
    Records(Vec<usize>),
}

/// A data set cut in two.
pub(super) struct Split {
    pub training: Dataset,
    /// The parts held out, each at least one window long.
    held: Dataset,
    shape: Shape,
}

/// Windows of the part held out.
pub(super) struct Windows {
    /// One stacked window `col(u_ini, d_ini, y_ini, d, u, y)` per column, in the order of time.
    pub stacked: Mat<f64>,
    /// How many windows without a common sample fit into the part held out (at most the number
    /// of columns): what their errors count for in a standard error.
    pub independent: usize,
}

impl Split {
    pub fn new(
        dataset: &Dataset,
        horizons: Horizons,
        hold_out: &HoldOut,
    ) -> Result<Self, AssessmentError> {
        for (name, steps) in [("past", horizons.past), ("future", horizons.future)] {
            if steps == 0 {
                return Err(HankelError::EmptyHorizon { name }.into());
            }
        }
        let window = horizons.window();
        let available = dataset.records().len();
        if let HoldOut::Records(numbers) = hold_out {
            for (index, &found) in numbers.iter().enumerate() {
                if found == 0 || found > available || numbers[..index].contains(&found) {
                    return Err(AssessmentError::HoldOutRecord { found, available });
                }
            }
        }
        let like = || {
            Dataset::with_disturbances(
                dataset.sample_time_s(),
                dataset.input_names(),
                dataset.disturbance_names(),
                dataset.output_names(),
            )
        };
        let (mut training, mut held) = (like()?, like()?);
        let (mut longest_held, mut longest_training) = (0, 0);
        for (index, record) in dataset.records().iter().enumerate() {
            let samples = record.samples();
            let held_samples = match hold_out {
                HoldOut::LastQuarter => samples / 4,
                HoldOut::Records(numbers) if numbers.contains(&(index + 1)) => samples,
                HoldOut::Records(_) => 0,
            };
            let kept = samples - held_samples;
            longest_held = longest_held.max(held_samples);
            longest_training = longest_training.max(kept);
            let part = |from, count| {
                let part = |series: MatRef<'_, f64>| series.subrows(from, count).to_owned();
                (
                    part(record.inputs()),
                    part(record.disturbances()),
                    part(record.outputs()),
                )
            };
            if kept >= window {
                let (inputs, disturbances, outputs) = part(0, kept);
                training.push_record_with_disturbances(inputs, disturbances, outputs)?;
            }
            if held_samples >= window {
                let (inputs, disturbances, outputs) = part(kept, held_samples);
                held.push_record_with_disturbances(inputs, disturbances, outputs)?;
            }
        }
        if held.records().is_empty() {
            return Err(AssessmentError::HoldOutTooShort {
                samples: longest_held,
                needed: window,
            });
        }
        if training.records().is_empty() {
            return Err(AssessmentError::TrainingTooShort {
                samples: longest_training,
                needed: window,
            });
        }
        let shape = Shape {
            inputs: dataset.inputs(),
            disturbances: dataset.disturbances(),
            outputs: dataset.outputs(),
            horizons,
        };
        Ok(Self {
            training,
            held,
            shape,
        })
    }

    /// Samples held out.
    pub fn held_samples(&self) -> usize {
        self.held.samples()
    }

    /// At most `limit` of all windows: one from each of `limit` equal stretches of time, at a
    /// place that the seed decides.
    pub fn windows(&self, limit: usize, seed: u64) -> Windows {
        let length = self.shape.horizons.window();
        let records = self.held.records();
        let starts: Vec<(usize, usize)> = (records.iter().enumerate())
            .flat_map(|(part, record)| (0..=record.samples() - length).map(move |s| (part, s)))
            .collect();
        let chosen: Vec<(usize, usize)> = if starts.len() <= limit {
            starts
        } else {
            let mut random = SplitMix(seed);
            let edge = |stretch: usize| stretch * starts.len() / limit;
            (0..limit)
                .map(|i| starts[edge(i) + random.below(edge(i + 1) - edge(i))])
                .collect()
        };
        let independent: usize = records.iter().map(|r| r.samples() / length).sum();
        let mut stacked = Mat::zeros(self.shape.rows(), chosen.len());
        for (column, &(part, start)) in chosen.iter().enumerate() {
            let target = stacked.col_as_slice_mut(column);
            self.shape.write_window(&records[part], start, target);
        }
        Windows {
            independent: independent.min(chosen.len()),
            stacked,
        }
    }
}

/// Steele, Lea, Flood 2014: enough to place windows, and the same on every machine.
struct SplitMix(u64);

impl SplitMix {
    /// From 0 to `limit` − 1.
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        usize::try_from(z % limit.max(1) as u64).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records whose samples tell their record and time: 1000·record + time.
    fn numbered(lengths: &[usize]) -> Dataset {
        let mut data = Dataset::new(1.0, ["a", "b"], ["c"]).unwrap();
        for (record, &length) in lengths.iter().enumerate() {
            let value = |k: usize| (1000 * (record + 1) + k) as f64;
            let inputs = Mat::from_fn(length, 2, |k, _| value(k));
            data.push_record(inputs, Mat::from_fn(length, 1, |k, _| value(k)))
                .unwrap();
        }
        data
    }

    fn windows(split: &Split, limit: usize, seed: u64) -> Vec<[f64; 3]> {
        // u_ini(0), the last y, and the distance between them.
        let stacked = split.windows(limit, seed).stacked;
        let last = stacked.nrows() - 1;
        (0..stacked.ncols())
            .map(|j| {
                let (first, last) = (stacked[(0, j)], stacked[(last, j)]);
                [first, last, last - first]
            })
            .collect()
    }

    #[test]
    fn the_last_quarter_of_every_record_is_kept_away() {
        let split = Split::new(
            &numbered(&[40, 60, 12]),
            Horizons::new(2, 3),
            &HoldOut::LastQuarter,
        )
        .unwrap();
        let kept: Vec<_> = split
            .training
            .records()
            .iter()
            .map(crate::data::Record::samples)
            .collect();
        assert_eq!((kept, split.held_samples()), (vec![30, 45, 9], 25));
        let found = windows(&split, 100, 0);
        assert_eq!(found.len(), 6 + 11);
        for [first, last, length] in found {
            assert!((length - 4.0).abs() < 1e-9, "no window crosses a record");
            assert!((1030.0..1040.0).contains(&first) || (2045.0..2060.0).contains(&first));
            assert!((1030.0..1040.0).contains(&last) || (2045.0..2060.0).contains(&last));
        }
    }

    #[test]
    fn records_named_are_held_whole_and_windows_spread_over_them() {
        let hold_out = HoldOut::Records(vec![3, 1]);
        let split = Split::new(&numbered(&[100, 50, 200]), Horizons::new(4, 6), &hold_out).unwrap();
        assert_eq!((split.training.samples(), split.held_samples()), (50, 300));
        let some = windows(&split, 28, 9);
        assert_eq!(some.len(), 28);
        // 91 windows of record 1 and 191 of record 3, a window from each 1/28 of them.
        let of_first = some.iter().filter(|w| w[0] < 2000.0).count();
        assert!((9..=10).contains(&of_first), "{of_first}");
        assert!(some.is_sorted_by(|a, b| a[0] < b[0]));
        assert_ne!(some, windows(&split, 28, 10));
        assert_eq!(split.windows(28, 9).independent, 28);
        assert_eq!(split.windows(1000, 9).independent, 30);
    }
}
