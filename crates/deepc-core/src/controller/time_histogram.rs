//! How long decisions took, in fixed memory.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// Lower end of the first bucket.
const FIRST_NS: f64 = 100.0;
/// Upper over lower end of a bucket.
const RATIO: f64 = 1.05;
/// Buckets from 100 ns to over 100 s.
const BUCKETS: usize = 425;

/// Times in buckets that widen by 5 %, from 100 ns to 100 s (what is outside counts as at the
/// ends). A quantile is the middle of its bucket, so within 2.5 % of the time that was taken;
/// minimum and maximum are exact, to the nanosecond. Recording allocates nothing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "Summary", try_from = "Summary")]
pub struct TimeHistogram {
    counts: Vec<u64>,
    count: u64,
    min_ns: u64,
    max_ns: u64,
}

/// The histogram as it is written: buckets that are not empty, and what one wants to read. The
/// quantiles are not read back: they follow from the buckets.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Summary {
    count: u64,
    min_ns: Option<u64>,
    median_ns: Option<u64>,
    p99_ns: Option<u64>,
    max_ns: Option<u64>,
    /// (bucket, count), rising.
    buckets: Vec<(usize, u64)>,
}

impl TimeHistogram {
    /// No times yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            counts: vec![0; BUCKETS],
            count: 0,
            min_ns: u64::MAX,
            max_ns: 0,
        }
    }

    /// Adds a time.
    pub fn record(&mut self, time: Duration) {
        let ns = whole_ns(time);
        self.counts[bucket_of(ns)] += 1;
        self.count += 1;
        self.min_ns = self.min_ns.min(ns);
        self.max_ns = self.max_ns.max(ns);
    }

    /// Forgets all times.
    pub fn clear(&mut self) {
        self.counts.fill(0);
        (self.count, self.min_ns, self.max_ns) = (0, u64::MAX, 0);
    }

    /// Times recorded.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The shortest time.
    #[must_use]
    pub fn min(&self) -> Option<Duration> {
        (self.count > 0).then(|| Duration::from_nanos(self.min_ns))
    }

    /// The longest time.
    #[must_use]
    pub fn max(&self) -> Option<Duration> {
        (self.count > 0).then(|| Duration::from_nanos(self.max_ns))
    }

    /// The median.
    #[must_use]
    pub fn median(&self) -> Option<Duration> {
        self.quantile(0.5)
    }

    /// The time that 99 of 100 do not exceed.
    #[must_use]
    pub fn p99(&self) -> Option<Duration> {
        self.quantile(0.99)
    }

    /// The time that the given share of all times (0 to 1) does not exceed; `None` without times
    /// or for another share.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Option<Duration> {
        if self.count == 0 || !(0.0..=1.0).contains(&share) {
            return None;
        }
        // The rank-th smallest time, with rank = ⌈share·count⌉ of at least 1.
        let wanted = share * self.count as f64;
        let mut below = 0;
        let found = self.counts.iter().position(|&count| {
            below += count;
            below > 0 && below as f64 >= wanted
        });
        let middle = FIRST_NS * RATIO.powf(found.unwrap_or(BUCKETS - 1) as f64 + 0.5);
        let ns = middle.clamp(self.min_ns as f64, self.max_ns as f64);
        Some(Duration::from_secs_f64(ns * 1e-9))
    }
}

impl Default for TimeHistogram {
    fn default() -> Self {
        Self::new()
    }
}

/// The bucket of a time.
fn bucket_of(ns: u64) -> usize {
    let steps = (ns as f64 / FIRST_NS).ln() / RATIO.ln();
    // Rounds down, and takes what is below the first bucket (also −∞) to it.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let bucket = steps.max(0.0) as usize;
    bucket.min(BUCKETS - 1)
}

fn whole_ns(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

impl From<TimeHistogram> for Summary {
    fn from(times: TimeHistogram) -> Self {
        let buckets = times.counts.iter().copied().enumerate();
        Self {
            count: times.count,
            min_ns: times.min().map(whole_ns),
            median_ns: times.median().map(whole_ns),
            p99_ns: times.p99().map(whole_ns),
            max_ns: times.max().map(whole_ns),
            buckets: buckets.filter(|&(_, count)| count > 0).collect(),
        }
    }
}

impl TryFrom<Summary> for TimeHistogram {
    type Error = String;

    fn try_from(summary: Summary) -> Result<Self, String> {
        let mut times = Self::new();
        for &(bucket, count) in &summary.buckets {
            let entry = times
                .counts
                .get_mut(bucket)
                .ok_or_else(|| format!("bucket {bucket} of a time histogram of {BUCKETS}"))?;
            *entry = count;
        }
        let total = times
            .counts
            .iter()
            .try_fold(0_u64, |sum, &count| sum.checked_add(count));
        if total != Some(summary.count) {
            return Err(format!(
                "the buckets of a time histogram do not hold its {} times",
                summary.count
            ));
        }
        times.count = summary.count;
        times.min_ns = summary.min_ns.unwrap_or(u64::MAX);
        times.max_ns = summary.max_ns.unwrap_or(0);
        if times.count > 0 && times.min_ns > times.max_ns {
            return Err("a time histogram's minimum is above its maximum".into());
        }
        Ok(times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_within_the_stated_resolution() {
        let mut times = TimeHistogram::new();
        assert_eq!(times.median(), None);
        // 1000 times from 200 ns to 20 s, evenly in their logarithm.
        let time =
            |i: u32| Duration::from_secs_f64(200e-9 * 10_f64.powf(f64::from(i) * 8.0 / 999.0));
        // In an order that is not sorted: 7 and 1000 share no factor.
        (0..1000).for_each(|i| times.record(time(i * 7 % 1000)));
        for (share, rank) in [(0.5, 499), (0.99, 989), (0.001, 0), (0.25, 249)] {
            let found = times.quantile(share).unwrap().as_secs_f64();
            let error = (found / time(rank).as_secs_f64() - 1.0).abs();
            assert!(error < 0.0255, "share {share}: off by {error}");
        }
        assert_eq!(times.min(), Some(Duration::from_nanos(200)));
        let max = times.max().unwrap();
        assert_eq!(max.as_nanos(), time(999).as_nanos());
        assert_eq!(times.quantile(1.5), None);
        assert_eq!(times.quantile(f64::NAN), None);
    }

    #[test]
    fn times_beyond_the_ends_are_counted_and_bound_the_quantiles() {
        let mut times = TimeHistogram::new();
        times.record(Duration::ZERO);
        assert_eq!(times.median(), Some(Duration::ZERO));
        times.record(Duration::MAX);
        assert_eq!(times.count(), 2);
        assert_eq!(times.max(), Some(Duration::from_nanos(u64::MAX)));
    }
}
