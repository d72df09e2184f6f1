//! What was observed: the past window, repaired where a sample was bad.

use super::step::{Fault, StoredPlan};
use super::window::Window;
use crate::hankel::Shape;

/// One sample. As it was reported, slices may have any length and hold anything.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample<'a> {
    pub input: &'a [f64],
    pub disturbance: &'a [f64],
    pub output: &'a [f64],
}

/// The past window and the values applied and measured last.
#[derive(Debug)]
pub(super) struct Samples {
    window: Window,
    /// u(k−1), if `applied`.
    input: Vec<f64>,
    applied: bool,
    /// Whether the window has been full since the start.
    was_full: bool,
    /// d(k−1), if `disturbed`.
    disturbance: Vec<f64>,
    disturbed: bool,
    /// y(k−1), as measured or repaired.
    output: Vec<f64>,
    /// Of the last sample.
    fault: Option<Fault>,
    frozen: FrozenWatch,
}

impl Samples {
    pub fn new(shape: Shape, frozen_after: Option<usize>) -> Self {
        let Shape {
            inputs,
            disturbances,
            outputs,
            horizons,
        } = shape;
        Self {
            window: Window::new(horizons.past, inputs, disturbances, outputs),
            input: vec![0.0; inputs],
            applied: false,
            was_full: false,
            disturbance: vec![0.0; disturbances],
            disturbed: false,
            output: vec![0.0; outputs],
            fault: None,
            frozen: FrozenWatch::new(outputs, frozen_after),
        }
    }

    /// Appends a sample. Where it is bad, the input is replaced by the one decided (if one was),
    /// the disturbance by the one before and the output by what the plan predicts; the plan is
    /// one sample older afterwards. Without a replacement the window has to fill again.
    ///
    /// What a plan predicts belongs to its own inputs: where another one was applied, the plan ends.
    pub fn take(&mut self, sample: Sample<'_>, decided: Option<&[f64]>, plan: &mut StoredPlan) {
        let input = Trust::of(sample.input, self.input.len());
        let disturbance = Trust::of(sample.disturbance, self.disturbance.len());
        let output = Trust::of(sample.output, self.output.len());

        // What was applied: as reported where that can be trusted, else as decided.
        let input_known = input == Trust::Whole || decided.is_some();
        if input_known {
            repair(&mut self.input, sample.input, decided);
            self.applied = true;
        }
        let predicted = plan
            .row()
            .filter(|&row| !input_known || plan.is_followed(row, &self.input));
        plan.age = predicted.map(|row| row + 1);
        let disturbance_known = disturbance == Trust::Whole || self.disturbed;
        if disturbance_known {
            repair(&mut self.disturbance, sample.disturbance, None);
            self.disturbed = true;
        }
        self.frozen.watch(sample.output);

        let wrong = [input, disturbance, output].contains(&Trust::Length);
        self.fault = if wrong {
            Some(Fault::MeasurementShape)
        } else if input == Trust::Parts || output == Trust::Parts {
            Some(Fault::MeasurementNotFinite)
        } else if disturbance == Trust::Parts {
            // There was nothing to hold yet: nothing is known of the sample.
            Some(if disturbance_known {
                Fault::DisturbanceNotFinite
            } else {
                Fault::MeasurementNotFinite
            })
        } else {
            None
        };

        let output_known = match (output, predicted) {
            (Trust::Whole, _) => {
                self.output.copy_from_slice(sample.output);
                true
            }
            (_, Some(row)) => {
                let trusted = output == Trust::Parts;
                for (channel, entry) in self.output.iter_mut().enumerate() {
                    let measured = Some(channel).filter(|_| trusted).map(|i| sample.output[i]);
                    *entry = measured
                        .filter(|value| value.is_finite())
                        .unwrap_or(plan.outputs[(row, channel)]);
                }
                true
            }
            (_, None) => false,
        };
        if input_known && disturbance_known && output_known {
            let repaired = self.fault.is_some();
            self.window
                .push(&self.input, &self.disturbance, &self.output, repaired);
            self.was_full |= self.window.is_full();
        } else {
            self.window.clear();
        }
    }

    /// As [`Self::take`] for a sample that never came.
    pub fn take_lost(&mut self, decided: &[f64], plan: &mut StoredPlan) {
        let nothing = Sample {
            input: &[],
            disturbance: &[],
            output: &[],
        };
        self.take(nothing, Some(decided), plan);
        self.fault = Some(Fault::MeasurementLost);
    }

    pub fn window(&self) -> &Window {
        &self.window
    }

    /// Whether the window was full before and a fault emptied it.
    pub fn is_refilling(&self) -> bool {
        self.was_full && !self.window.is_full()
    }

    /// u(k−1), if it is known.
    pub fn input(&self) -> Option<&[f64]> {
        self.applied.then_some(&self.input)
    }

    /// d(k−1); 0 before any was measured.
    pub fn disturbance(&self) -> &[f64] {
        &self.disturbance
    }

    /// y(k−1), measured or repaired; `None` before the window holds a sample.
    pub fn output(&self) -> Option<&[f64]> {
        (self.window.outputs().nrows() > 0).then_some(&self.output)
    }

    /// The sample taken last, as it stands in the window; `None` if the window is empty.
    pub fn newest(&self) -> Option<Sample<'_>> {
        Some(Sample {
            input: &self.input,
            disturbance: &self.disturbance,
            output: self.output()?,
        })
    }

    /// Outputs that have not changed for too long.
    pub fn frozen(&self) -> impl Iterator<Item = usize> {
        self.frozen.frozen()
    }

    /// The fault of the last sample, once; without one, whether a sensor is frozen.
    pub fn take_fault(&mut self) -> Option<Fault> {
        let frozen = self.frozen().next().map(|_| Fault::MeasurementFrozen);
        self.fault.take().or(frozen)
    }

    pub fn clear(&mut self) {
        self.window.clear();
        self.applied = false;
        self.was_full = false;
        self.disturbed = false;
        self.disturbance.fill(0.0);
        self.fault = None;
        self.frozen.clear();
    }
}

/// How far a reported slice can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trust {
    /// All of it.
    Whole,
    /// Its finite entries.
    Parts,
    /// It has the wrong length: no entry can be told from another.
    Length,
}

impl Trust {
    fn of(values: &[f64], expected: usize) -> Self {
        if values.len() != expected {
            Self::Length
        } else if values.iter().all(|value| value.is_finite()) {
            Self::Whole
        } else {
            Self::Parts
        }
    }
}

/// Copies the finite entries of `reported` if its length fits, and takes the others from
/// `substitute`, or leaves them as they were.
fn repair(target: &mut [f64], reported: &[f64], substitute: Option<&[f64]>) {
    if let Some(substitute) = substitute {
        target.copy_from_slice(substitute);
    }
    if reported.len() == target.len() {
        for (entry, &value) in target.iter_mut().zip(reported) {
            if value.is_finite() {
                *entry = value;
            }
        }
    }
}

/// Counts for how long every output stood still, to the last bit.
#[derive(Debug)]
struct FrozenWatch {
    limit: Option<usize>,
    last: Vec<f64>,
    unchanged: Vec<usize>,
}

impl FrozenWatch {
    fn new(outputs: usize, limit: Option<usize>) -> Self {
        Self {
            limit,
            last: vec![f64::NAN; outputs],
            unchanged: vec![0; outputs],
        }
    }

    /// A value that is missing neither changes nor stands still.
    fn watch(&mut self, output: &[f64]) {
        if self.limit.is_none() || output.len() != self.last.len() {
            return;
        }
        let counts = self.last.iter_mut().zip(&mut self.unchanged);
        for ((last, unchanged), &value) in counts.zip(output) {
            if value.is_finite() {
                *unchanged = if value.to_bits() == last.to_bits() {
                    unchanged.saturating_add(1)
                } else {
                    0
                };
                *last = value;
            }
        }
    }

    fn frozen(&self) -> impl Iterator<Item = usize> {
        let limit = self.limit.unwrap_or(usize::MAX);
        let counts = self.unchanged.iter().enumerate();
        counts.filter_map(move |(channel, &count)| (count >= limit).then_some(channel))
    }

    fn clear(&mut self) {
        self.last.fill(f64::NAN);
        self.unchanged.fill(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_is_frozen_after_so_many_samples_without_change() {
        let mut watch = FrozenWatch::new(2, Some(2));
        for (sample, expected) in [
            ([1.0, 5.0], vec![]),
            ([2.0, 5.0], vec![]),
            ([3.0, f64::NAN], vec![]),
            ([3.0, 5.0], vec![1]),
            ([3.0, 5.0], vec![0, 1]),
            ([4.0, 5.0], vec![1]),
        ] {
            watch.watch(&sample);
            assert_eq!(watch.frozen().collect::<Vec<_>>(), expected, "{sample:?}");
        }
    }
}
