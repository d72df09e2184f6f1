//! Several predictors, one per operating range.

use serde::{Deserialize, Serialize};

use super::Predictor;
use super::error::PredictorError;
use crate::data::{DataError, Dataset, Record, same_sample_time};

/// Which operating range a measured signal is in. Range i lies between `edges[i − 1]` and
/// `edges[i]`; there is one more range than edges. The range is left only when the signal is
/// beyond its edge by the hysteresis, so that noise does not switch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// Name of the channel that [`Self::part`] divides a recording by. A running controller knows no
    /// names: it is given the signal by a function
    /// ([`ScheduledController::new`](crate::controller::ScheduledController::new)), which must
    /// return this same signal in the same units.
    pub signal: String,
    /// Where ranges meet, rising, in the units of the signal.
    pub edges: Vec<f64>,
    /// Half the width of the band around an edge in which the range before is kept, in the units
    /// of the signal; below half the width of the narrowest range.
    pub hysteresis: f64,
}

impl Schedule {
    /// Whether edges rise and the hysteresis fits between them.
    ///
    /// # Errors
    /// An edge is not finite or not above the one before, or the hysteresis is negative, not
    /// finite or too wide.
    pub fn check(&self) -> Result<(), PredictorError> {
        let mut narrowest = f64::INFINITY;
        for (index, &edge) in self.edges.iter().enumerate() {
            let before = match index {
                0 => f64::NEG_INFINITY,
                i => self.edges[i - 1],
            };
            if !(edge.is_finite() && edge > before) {
                return Err(PredictorError::Edge {
                    index,
                    found: edge,
                    before,
                });
            }
            narrowest = narrowest.min(edge - before);
        }
        if self.hysteresis >= 0.0
            && self.hysteresis.is_finite()
            && 2.0 * self.hysteresis < narrowest
        {
            return Ok(());
        }
        Err(PredictorError::Hysteresis {
            found: self.hysteresis,
            narrowest,
        })
    }

    /// Number of ranges.
    #[must_use]
    pub fn ranges(&self) -> usize {
        self.edges.len() + 1
    }

    /// The range that holds `value`, hysteresis aside; a value on an edge belongs above it.
    /// `None` if it is NaN.
    #[must_use]
    pub fn range_of(&self, value: f64) -> Option<usize> {
        if value.is_nan() {
            return None;
        }
        Some(self.edges.partition_point(|&edge| edge <= value))
    }

    /// The range to use now, from the one used before. A value that is NaN changes nothing.
    #[must_use]
    pub fn next(&self, before: usize, value: f64) -> usize {
        let leaves_below = before
            .checked_sub(1)
            .and_then(|i| self.edges.get(i))
            .is_some_and(|edge| value < edge - self.hysteresis);
        let leaves_above = self
            .edges
            .get(before)
            .is_some_and(|edge| value >= edge + self.hysteresis);
        if leaves_below || leaves_above {
            self.range_of(value).unwrap_or(before)
        } else {
            before
        }
    }

    /// Parts a data set by its own channel [`Schedule::signal`] (an input, a disturbance or an
    /// output): one data set per range, whose records are the pieces of at least `window` samples
    /// during which the signal stayed in the range, widened by the hysteresis. No window crosses
    /// from one range to another. A range that was not visited long enough has no record.
    ///
    /// # Errors
    /// The schedule is not in order or no channel has that name.
    pub fn part(&self, dataset: &Dataset, window: usize) -> Result<Vec<Dataset>, PredictorError> {
        self.check()?;
        let names = [
            dataset.input_names(),
            dataset.disturbance_names(),
            dataset.output_names(),
        ]
        .concat();
        let channel = names.iter().position(|name| *name == self.signal);
        let channel = channel.ok_or_else(|| PredictorError::NoSuchChannel {
            name: self.signal.clone(),
            found: names,
        })?;
        (0..self.ranges())
            .map(|range| self.pieces(dataset, channel, range, window))
            .collect::<Result<_, _>>()
            .map_err(PredictorError::Data)
    }

    fn pieces(
        &self,
        dataset: &Dataset,
        channel: usize,
        range: usize,
        window: usize,
    ) -> Result<Dataset, DataError> {
        let mut parted = Dataset::with_disturbances(
            dataset.sample_time_s(),
            dataset.input_names(),
            dataset.disturbance_names(),
            dataset.output_names(),
        )?;
        let lower = match range {
            0 => f64::NEG_INFINITY,
            i => self.edges[i - 1] - self.hysteresis,
        };
        let upper = self
            .edges
            .get(range)
            .map_or(f64::INFINITY, |e| e + self.hysteresis);
        for record in dataset.records() {
            let signal = record.channels()[channel];
            let mut start = 0;
            for end in 0..=signal.len() {
                let inside = signal.get(end).is_some_and(|&v| v >= lower && v < upper);
                if inside {
                    continue;
                }
                if end - start >= window.max(1) {
                    push_piece(&mut parted, record, start, end - start)?;
                }
                start = end + 1;
            }
        }
        Ok(parted)
    }
}

fn push_piece(
    parted: &mut Dataset,
    record: &Record,
    start: usize,
    samples: usize,
) -> Result<(), DataError> {
    parted.push_record_with_disturbances(
        record.inputs().subrows(start, samples).to_owned(),
        record.disturbances().subrows(start, samples).to_owned(),
        record.outputs().subrows(start, samples).to_owned(),
    )
}

/// One predictor per range of a [`Schedule`], all of the same plant and the same horizons.
#[derive(Debug, Clone)]
pub struct ScheduledPredictors {
    schedule: Schedule,
    predictors: Vec<Predictor>,
}

impl ScheduledPredictors {
    /// `predictors`: one per range, in order.
    ///
    /// # Errors
    /// The schedule is not in order, the number of predictors is not that of ranges, or they
    /// differ in sizes, sample time or channel names.
    pub fn new(schedule: Schedule, predictors: Vec<Predictor>) -> Result<Self, PredictorError> {
        schedule.check()?;
        if predictors.len() != schedule.ranges() {
            return Err(PredictorError::RangeCount {
                found: predictors.len(),
                expected: schedule.ranges(),
            });
        }
        for (range, predictor) in predictors.iter().enumerate() {
            if let Some(what) = difference(&predictors[0], predictor) {
                return Err(PredictorError::RangesDiffer { range, what });
            }
        }
        Ok(Self {
            schedule,
            predictors,
        })
    }

    /// The schedule.
    #[must_use]
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// The predictors, one per range.
    #[must_use]
    pub fn predictors(&self) -> &[Predictor] {
        &self.predictors
    }
}

fn difference(a: &Predictor, b: &Predictor) -> Option<&'static str> {
    let differ = [
        ("sizes", a.shape() != b.shape()),
        (
            "sample time",
            !same_sample_time(a.sample_time_s(), b.sample_time_s()),
        ),
        ("input names", a.input_names() != b.input_names()),
        (
            "disturbance names",
            a.disturbance_names() != b.disturbance_names(),
        ),
        ("output names", a.output_names() != b.output_names()),
    ];
    differ
        .into_iter()
        .find(|(_, differ)| *differ)
        .map(|(what, _)| what)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule(hysteresis: f64) -> Schedule {
        Schedule {
            signal: "speed".into(),
            edges: vec![10.0, 20.0],
            hysteresis,
        }
    }

    #[test]
    fn a_range_is_kept_within_the_hysteresis() {
        let schedule = schedule(1.0);
        let mut range = 0;
        let mut seen = Vec::new();
        for value in [
            5.0,
            10.5,
            11.0,
            9.5,
            9.0,
            8.9,
            25.0,
            19.5,
            f64::NAN,
            18.9,
            3.0,
        ] {
            range = schedule.next(range, value);
            seen.push(range);
        }
        assert_eq!(seen, [0, 0, 1, 1, 1, 0, 2, 2, 2, 1, 0]);
        assert_eq!(schedule.range_of(10.0), Some(1));
        assert_eq!(schedule.range_of(f64::NAN), None);
    }

    #[test]
    fn edges_and_hysteresis_are_checked() {
        assert!(schedule(4.9).check().is_ok());
        let message = schedule(5.0).check().unwrap_err().to_string();
        assert!(message.contains('5') && message.contains("10"), "{message}");
        assert!(schedule(-1.0).check().is_err());
        let mut falling = schedule(0.0);
        falling.edges = vec![10.0, 10.0];
        let message = falling.check().unwrap_err().to_string();
        assert!(message.contains("edge 1"), "{message}");
    }
}
