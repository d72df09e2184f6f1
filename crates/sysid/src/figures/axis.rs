//! Axes: ranges, ticks and their labels.

/// One axis of a panel.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub label: String,
    /// Ends, in the values shown.
    pub range: (f64, f64),
    pub logarithmic: bool,
    /// Whether only whole numbers mean something.
    pub whole: bool,
    /// About how many ticks there is room for.
    pub ticks: usize,
}

/// Share of the range left free at both ends.
const PADDING: f64 = 0.06;

impl Axis {
    /// Just over these values.
    pub fn over(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values);
        let padding = if high > low {
            PADDING * (high - low)
        } else {
            0.5 * high.abs().max(1e-12)
        };
        Self::between(label, low - padding, high + padding)
    }

    pub fn between(label: impl Into<String>, low: f64, high: f64) -> Self {
        let range = if high > low {
            (low, high)
        } else {
            (low, low + 1.0)
        };
        Self {
            label: label.into(),
            range,
            logarithmic: false,
            whole: false,
            ticks: 6,
        }
    }

    /// Logarithmic over the values above 0.
    pub fn logarithmic(label: impl Into<String>, values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values.filter(|value| *value > 0.0));
        // Half a decade at least, so that a flat curve does not fill the panel with its rounding.
        let widen = if high / low < 3.0 {
            1.8
        } else {
            (high / low).powf(PADDING)
        };
        Self {
            logarithmic: true,
            ..Self::between(label, low / widen, high * widen)
        }
    }

    pub fn with_ticks(mut self, ticks: usize) -> Self {
        self.ticks = ticks;
        self
    }

    /// Over whole numbers, half a one of room at both ends.
    pub fn counting(label: impl Into<String>, first: f64, last: f64) -> Self {
        Self {
            whole: true,
            ..Self::between(label, first - 0.6, last + 0.6).with_ticks(12)
        }
    }

    /// Where a value is on the paper: itself or its decade.
    pub fn place(&self, value: f64) -> f64 {
        if self.logarithmic {
            // What cannot be shown lies below the paper.
            value.max(1e-300).log10()
        } else {
            value
        }
    }

    /// Ends on the paper.
    pub fn ends(&self) -> (f64, f64) {
        (self.place(self.range.0), self.place(self.range.1))
    }

    /// Places of the ticks with their labels.
    pub fn labelled_ticks(&self) -> Vec<(f64, String)> {
        let values = if self.logarithmic {
            self.decades()
        } else {
            steps(self.range, self.ticks, self.whole)
        };
        let step = match values[..] {
            [first, second, ..] => (second - first).abs(),
            _ => 0.0,
        };
        let largest = values
            .iter()
            .fold(0.0_f64, |max, value| max.max(value.abs()));
        let label = |value: f64| {
            if self.logarithmic {
                // Every decade for itself.
                text(value, 0.0, value)
            } else {
                text(value, step, largest)
            }
        };
        let ticks = values
            .iter()
            .map(|&value| (self.place(value), label(value)));
        ticks.collect()
    }

    fn decades(&self) -> Vec<f64> {
        let (low, high) = self.ends();
        let within = |values: &[f64], every: i32| {
            #[expect(clippy::cast_possible_truncation, reason = "an f64 has 632 decades")]
            let decades = (low.floor() as i32)..=(high.ceil() as i32);
            let decades = decades.filter(|decade| decade.rem_euclid(every) == 0);
            decades
                // Parsed, so that 10⁻³ is what its decimal says.
                .flat_map(|decade| {
                    let powers = values.iter().map(move |v| format!("{v}e{decade}").parse());
                    powers.filter_map(Result::ok).collect::<Vec<f64>>()
                })
                .filter(|value| (self.range.0..=self.range.1).contains(value))
                .collect::<Vec<_>>()
        };
        let fine = [(&[1.0, 2.0, 5.0][..], 1), (&[1.0, 3.0], 1), (&[1.0], 1)];
        let coarse = [2, 3, 5, 10, 20, 50, 100].map(|every| (&[1.0][..], every));
        let choices = fine
            .into_iter()
            .chain(coarse)
            .map(|(v, every)| within(v, every));
        let mut last = Vec::new();
        for choice in choices {
            if choice.len() <= self.ticks + 1 {
                return if choice.len() >= 2 { choice } else { last };
            }
            last = choice;
        }
        last
    }
}

/// Multiples of a round step within a range.
fn steps((low, high): (f64, f64), count: usize, whole: bool) -> Vec<f64> {
    let rough = (high - low) / count.max(2) as f64;
    let rough = if whole { rough.max(1.0) } else { rough };
    let decade = 10.0_f64.powf(rough.log10().floor());
    let round = [1.0, 2.0, 2.5, 5.0, 10.0];
    let step = round.iter().map(|factor| factor * decade);
    // 2.5 steps over whole numbers would miss every other one.
    let fits = |step: &f64| *step >= rough * 0.999 && (!whole || step.fract() == 0.0);
    let step = step.into_iter().find(fits);
    let step = step.unwrap_or(10.0 * decade);
    let first = (low / step - 1e-9).ceil();
    let places = (0..=(2 * count + 4)).map(|index| (first + index as f64) * step);
    let places = places.take_while(|place| *place <= high + 1e-9 * step);
    // Adding zero turns −0 into 0.
    places.map(|place| place + 0.0).collect()
}

/// A number with the digits that ticks `step` apart need; `largest` is the largest of them.
fn text(value: f64, step: f64, largest: f64) -> String {
    let powers = value != 0.0 && !(1e-3..1e6).contains(&largest);
    let write = |digits: usize| {
        if powers {
            format!("{value:.digits$e}")
        } else {
            format!("{value:.digits$}")
        }
    };
    let exact = |written: &String| {
        let read = written.parse::<f64>().unwrap_or(f64::NAN);
        (read - value).abs() <= 1e-3 * step.max(value.abs() * 1e-9)
    };
    // All ticks of a linear axis have the digits of its step.
    let least = (0..12).find(|&digits| {
        let unit = if powers {
            value.abs().log10().floor()
        } else {
            0.0
        };
        let steps = step / 10.0_f64.powf(unit) * 10.0_f64.powi(digits);
        (steps - steps.round()).abs() < 1e-6 * steps.max(1.0)
    });
    let least = if powers || largest < 1e-3 {
        0
    } else {
        least.unwrap_or(0)
    };
    let mut digits = (usize::try_from(least).unwrap_or(0)..16).map(write);
    let written = digits.find(exact).unwrap_or_else(|| value.to_string());
    written.replace('-', "−")
}

pub(super) fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    if low <= high { (low, high) } else { (0.1, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        let ticks = axis.labelled_ticks().into_iter();
        ticks.map(|(_, label)| label).collect()
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(
            labels(&Axis::between("", -0.1, 1.1)),
            ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]
        );
        assert_eq!(
            labels(&Axis::between("", 0.0, 20.0)),
            ["0", "5", "10", "15", "20"]
        );
        assert_eq!(labels(&Axis::between("", 0.0, 1.1e6))[1..3], ["2e5", "4e5"]);
        assert_eq!(
            labels(&Axis::between("", 0.0, 0.9)),
            ["0.0", "0.2", "0.4", "0.6", "0.8"]
        );
        assert_eq!(
            labels(&Axis::between("", 95.0, 96.0).with_ticks(4)),
            ["95.00", "95.25", "95.50", "95.75", "96.00"]
        );
        assert_eq!(
            labels(&Axis::between("", -3e-7, 3e-7)),
            ["−3e−7", "−2e−7", "−1e−7", "0", "1e−7", "2e−7", "3e−7"]
        );
    }

    #[test]
    fn decades_are_thinned() {
        let axis = |low, high| Axis {
            logarithmic: true,
            ..Axis::between("", low, high)
        };
        assert_eq!(labels(&axis(0.5, 20.0)), ["0.5", "1", "2", "5", "10", "20"]);
        assert_eq!(labels(&axis(1e-3, 10.0)).len(), 5);
        let wide = labels(&axis(1e-15, 1.0));
        assert!((4..8).contains(&wide.len()), "{wide:?}");
    }
}
