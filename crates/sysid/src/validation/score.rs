//! Fit and variance accounted for.

use serde::{Deserialize, Serialize};

/// How near a computed output is to the measured one, over all samples of all records together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Score {
    /// Samples compared.
    pub samples: usize,
    /// Root of the mean squared error, in the unit of the output.
    pub rms_error: f64,
    /// 100 (1 − ‖y − ŷ‖ / ‖y − mean y‖): 100 is perfect, 0 as good as the mean. None if the
    /// measured output is constant.
    pub fit_percent: Option<f64>,
    /// Variance accounted for, 100 (1 − var(y − ŷ) / var y): as the fit, but blind to an offset of
    /// the error. None if the measured output is constant.
    pub vaf_percent: Option<f64>,
}

/// Sums of a score, gathered record by record.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pairs: Vec<(f64, f64)>,
}

impl Tally {
    pub fn add(&mut self, measured: &[f64], computed: &[f64]) {
        let pairs = measured.iter().copied().zip(computed.iter().copied());
        self.pairs.extend(pairs);
    }

    /// Standard deviation of the measured output.
    pub fn spread(&self) -> f64 {
        deviation(self.pairs.iter().map(|pair| pair.0))
    }

    pub fn score(&self) -> Score {
        let samples = self.pairs.len();
        let errors = || {
            self.pairs
                .iter()
                .map(|(measured, computed)| measured - computed)
        };
        let squares: f64 = errors().map(|error| error * error).sum();
        let rms_error = (squares / samples.max(1) as f64).sqrt();
        let spread = self.spread();
        let percent = |error: f64, of: f64| (of > 0.0).then(|| 100.0 * (1.0 - error / of));
        Score {
            samples,
            rms_error,
            fit_percent: percent(rms_error, spread),
            vaf_percent: percent(deviation(errors()).powi(2), spread.powi(2)),
        }
    }
}

/// Standard deviation about the mean; 0 for equal values, whatever the mean's rounding.
fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count().max(1) as f64;
    let first = values.clone().next().unwrap_or(0.0);
    let mean = values.clone().map(|value| value - first).sum::<f64>() / count;
    let squares = values.map(|value| (value - first - mean).powi(2));
    (squares.sum::<f64>() / count).sqrt()
}
