//! Sample covariances over several records, and correlations with their bands.

use serde::{Deserialize, Serialize};

/// A correlation over lags with the half-width of its confidence band at each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Correlation {
    /// Lags in samples.
    pub lags: Vec<i64>,
    /// Correlation coefficient at each lag.
    pub values: Vec<f64>,
    /// Half-width of the band around zero at each lag.
    pub bands: Vec<f64>,
}

impl Correlation {
    /// Lags within `range` whose correlation is outside the band.
    pub fn outside(&self, range: impl Fn(i64) -> bool) -> Vec<i64> {
        let all = self.lags.iter().zip(self.values.iter().zip(&self.bands));
        let outside = all.filter(|(lag, (value, band))| range(**lag) && value.abs() > **band);
        outside.map(|(lag, _)| *lag).collect()
    }
}

/// Records of one signal about their common mean.
pub(super) struct Centred {
    pub records: Vec<Vec<f64>>,
    pub samples: usize,
    pub mean: f64,
}

impl Centred {
    pub fn new<S: AsRef<[f64]>>(records: &[S]) -> Self {
        let values = || records.iter().flat_map(|r| r.as_ref().iter().copied());
        let samples = values().count();
        let first = values().next().unwrap_or(0.0);
        // Relative to the first value, so that a large offset does not cost digits.
        let mean = first + values().map(|v| v - first).sum::<f64>() / samples.max(1) as f64;
        let centred = records
            .iter()
            .map(|r| r.as_ref().iter().map(|v| v - mean).collect())
            .collect();
        Self {
            records: centred,
            samples,
            mean,
        }
    }

    /// r(τ) = Σ e(t) e(t−τ) / N for τ = 0..=`last`, pairs within records only.
    pub fn autocovariances(&self, last: usize) -> Vec<f64> {
        (0..=last).map(|lag| covariance(self, self, lag)).collect()
    }

    /// Number of pairs `lag` samples apart.
    pub fn pairs(&self, lag: usize) -> usize {
        let pairs = self.records.iter().map(|r| r.len().saturating_sub(lag));
        pairs.sum()
    }
}

/// Σ later(t) earlier(t−lag) / N over all records, pairs within records only.
pub(super) fn covariance(later: &Centred, earlier: &Centred, lag: usize) -> f64 {
    let records = later.records.iter().zip(&earlier.records);
    let sums = records.map(|(later, earlier)| {
        let later = later.iter().skip(lag);
        later.zip(earlier).map(|(a, b)| a * b).sum::<f64>()
    });
    sums.sum::<f64>() / later.samples.max(1) as f64
}
