//! Every channel by itself, and pairs of channels that say the same.

use faer::MatRef;
use serde::{Deserialize, Serialize};

use crate::data::{Dataset, Record};
use crate::hankel::RANK_TOLERANCE;

/// So many equal samples in a row at the extreme value are a saturation, fewer are chance.
pub const SATURATION_RUN: usize = 3;

/// Two channels count as the same above this magnitude of their correlation.
pub const REPEATED_CORRELATION: f64 = 1.0 - 1e-6;

/// A sample is a spike if it stands off the median of the five samples around it by this many
/// typical such distances (1.4826 × their median) …
const SPIKE_DISTANCES: f64 = 10.0;

/// … and by this many robust standard deviations of the channel.
const SPIKE_DEVIATIONS: f64 = 3.0;

/// What a channel is to the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Input.
    Input,
    /// Measured disturbance.
    Disturbance,
    /// Output.
    Output,
}

/// Samples that stay at the least or greatest value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Extreme {
    /// The value.
    pub value: f64,
    /// Share of all samples that stand at it in runs of at least [`SATURATION_RUN`].
    pub share: f64,
    /// Samples of the longest run.
    pub longest_run: usize,
}

/// Statistics of one channel over all records, in the channel's unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelStatistics {
    /// Samples.
    pub samples: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation about the mean.
    pub deviation: f64,
    /// Root mean square.
    pub rms: f64,
    /// Least value.
    pub least: Extreme,
    /// Greatest value.
    pub greatest: Extreme,
    /// Whether it never changes (by more than [`RANK_TOLERANCE`] of its size).
    pub constant: bool,
    /// Number of different values.
    pub distinct_values: usize,
    /// Smallest distance between different values; 0 if there is only one.
    pub resolution: f64,
    /// Longest run of equal samples.
    pub longest_run: usize,
    /// Samples that stand alone far off their neighbours.
    pub spikes: usize,
}

/// One channel of a data set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelReport {
    /// Channel name.
    pub name: String,
    /// What it is to the controller.
    pub role: Role,
    /// Statistics.
    pub statistics: ChannelStatistics,
}

/// How two channels are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Repetition {
    /// Every sample is equal.
    Equal,
    /// One is a multiple of the other.
    Proportional,
    /// One is a multiple of the other plus an offset, up to [`REPEATED_CORRELATION`].
    Correlated,
}

/// Two channels that say the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RepeatedPair {
    /// Name and role of the one.
    pub first: (String, Role),
    /// Name and role of the other.
    pub second: (String, Role),
    /// How.
    pub repetition: Repetition,
    /// Their correlation, −1 to 1.
    pub correlation: f64,
}

/// Samples of one channel, one slice per uninterrupted stretch.
pub(super) type Stretches<'a> = Vec<&'a [f64]>;

/// Name, role and samples of every channel: inputs, disturbances, outputs.
pub(super) fn channels(dataset: &Dataset) -> Vec<(String, Role, Stretches<'_>)> {
    fn all<'a>(
        dataset: &'a Dataset,
        names: &'a [String],
        role: Role,
        series: fn(&'a Record) -> MatRef<'a, f64>,
    ) -> impl Iterator<Item = (String, Role, Stretches<'a>)> {
        names.iter().enumerate().map(move |(channel, name)| {
            let records = dataset.records().iter();
            // A record owns its matrices: every column is a slice.
            let stretches = records.filter_map(|record| {
                let column = series(record).col(channel);
                column.try_as_col_major().map(faer::ColRef::as_slice)
            });
            (name.clone(), role, stretches.collect())
        })
    }
    all(dataset, dataset.input_names(), Role::Input, Record::inputs)
        .chain(all(
            dataset,
            dataset.disturbance_names(),
            Role::Disturbance,
            Record::disturbances,
        ))
        .chain(all(
            dataset,
            dataset.output_names(),
            Role::Output,
            Record::outputs,
        ))
        .collect()
}

impl ChannelStatistics {
    /// All values finite; at least one.
    pub(super) fn measure(stretches: &[&[f64]]) -> Self {
        let values = || stretches.iter().flat_map(|s| s.iter().copied());
        let samples = values().count();
        let count = samples.max(1) as f64;
        let mean = values().sum::<f64>() / count;
        let rms = (values().map(|v| v * v).sum::<f64>() / count).sqrt();
        let deviation = (values().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
        let mut sorted: Vec<f64> = values().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let least = sorted.first().copied().unwrap_or(0.0);
        let greatest = sorted.last().copied().unwrap_or(0.0);
        let gaps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
        // Equal values that a conversion printed apart are one value.
        let same = 1e-12 * rms.max(greatest - least);
        let gaps: Vec<f64> = gaps.filter(|&gap| gap > same).collect();
        Self {
            samples,
            mean,
            deviation,
            rms,
            least: extreme(stretches, least, same),
            greatest: extreme(stretches, greatest, same),
            constant: greatest - least <= RANK_TOLERANCE * rms,
            distinct_values: if samples == 0 { 0 } else { gaps.len() + 1 },
            resolution: gaps.iter().copied().reduce(f64::min).unwrap_or(0.0),
            longest_run: stretches
                .iter()
                .flat_map(|s| s.chunk_by(|a, b| (a - b).abs() <= same))
                .map(<[f64]>::len)
                .max()
                .unwrap_or(0),
            spikes: spikes(stretches, &sorted, deviation),
        }
    }

    /// |mean| over standard deviation; `None` for a constant channel.
    #[must_use]
    pub fn offset_ratio(&self) -> Option<f64> {
        (!self.constant && self.deviation > 0.0).then(|| self.mean.abs() / self.deviation)
    }
}

fn extreme(stretches: &[&[f64]], value: f64, same: f64) -> Extreme {
    let at_it = |v: &f64| (v - value).abs() <= same;
    let runs = stretches
        .iter()
        .flat_map(|s| s.chunk_by(|a, b| at_it(a) && at_it(b)))
        .filter(|run| at_it(&run[0]))
        .map(<[f64]>::len);
    let samples: usize = stretches.iter().map(|s| s.len()).sum();
    let long: usize = runs.clone().filter(|&run| run >= SATURATION_RUN).sum();
    Extreme {
        value,
        share: long as f64 / samples.max(1) as f64,
        longest_run: runs.max().unwrap_or(0),
    }
}

/// Isolated outliers: a step or a ramp is none, because the median follows it.
fn spikes(stretches: &[&[f64]], sorted: &[f64], deviation: f64) -> usize {
    let distances: Vec<f64> = stretches
        .iter()
        .flat_map(|s| s.windows(5))
        .map(|window| {
            let mut around = [window[0], window[1], window[2], window[3], window[4]];
            around.sort_unstable_by(f64::total_cmp);
            (window[2] - around[2]).abs()
        })
        .collect();
    let center = median(sorted);
    let mut spread: Vec<f64> = sorted.iter().map(|v| (v - center).abs()).collect();
    spread.sort_unstable_by(f64::total_cmp);
    let robust = 1.4826 * median(&spread);
    // More than half of the samples are equal: the plain deviation is all there is.
    let size = if robust > 0.0 { robust } else { deviation };
    let mut ordered = distances.clone();
    ordered.sort_unstable_by(f64::total_cmp);
    let typical = 1.4826 * median(&ordered);
    let limit = (SPIKE_DISTANCES * typical).max(SPIKE_DEVIATIONS * size);
    distances
        .iter()
        .filter(|&&d| limit > 0.0 && d > limit)
        .count()
}

fn median(sorted: &[f64]) -> f64 {
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Pairs of channels that change together; constant ones are left out.
pub(super) fn repeated(
    channels: &[(String, Role, Stretches<'_>)],
    statistics: &[ChannelStatistics],
) -> Vec<RepeatedPair> {
    let mut pairs = Vec::new();
    for (i, (first, first_role, a)) in channels.iter().enumerate() {
        for (j, (second, second_role, b)) in channels.iter().enumerate().skip(i + 1) {
            let (one, other) = (&statistics[i], &statistics[j]);
            if one.constant || other.constant {
                continue;
            }
            let both = || a.iter().zip(b).flat_map(|(x, y)| x.iter().zip(y.iter()));
            let product: f64 = both().map(|(x, y)| (x - one.mean) * (y - other.mean)).sum();
            let correlation =
                product / (one.samples.max(1) as f64 * one.deviation * other.deviation);
            if correlation.abs() <= REPEATED_CORRELATION {
                continue;
            }
            // Up to rounding, of a copy that went through another unit.
            let factor = correlation.signum() * other.rms / one.rms;
            let multiple =
                |factor: f64| both().all(|(x, y)| (y - factor * x).abs() <= 1e-9 * other.rms);
            let repetition = if multiple(1.0) {
                Repetition::Equal
            } else if multiple(factor) {
                Repetition::Proportional
            } else {
                Repetition::Correlated
            };
            pairs.push(RepeatedPair {
                first: (first.clone(), *first_role),
                second: (second.clone(), *second_role),
                repetition,
                correlation: correlation.clamp(-1.0, 1.0),
            });
        }
    }
    pairs
}
