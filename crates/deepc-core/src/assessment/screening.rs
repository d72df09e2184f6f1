//! Raw series, before they can be a data set.

use faer::MatRef;
use serde::{Deserialize, Serialize};

use super::channel::{ChannelStatistics, Role};
use super::error::AssessmentError;
use super::finding::{Finding, FindingKind, Severity, channel_findings};

/// Samples `first` to `last`, both counted from 0 and both included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleRange {
    /// First sample.
    pub first: usize,
    /// Last sample.
    pub last: usize,
}

/// One raw channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelScreening {
    /// Channel name.
    pub name: String,
    /// Samples, finite or not.
    pub samples: usize,
    /// Samples that are NaN or infinite.
    pub not_finite: usize,
    /// Where they stand.
    pub gaps: Vec<SampleRange>,
    /// Statistics of the finite samples; `None` if there is none.
    pub statistics: Option<ChannelStatistics>,
}

/// A raw series, looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Screening {
    /// Every channel.
    pub channels: Vec<ChannelScreening>,
    /// What is wrong.
    pub findings: Vec<Finding>,
}

/// Looks at a T×c series (rows are time) that may hold NaN and infinities, which a
/// [`crate::data::Dataset`] refuses. `role` says what the channels are to be.
///
/// # Errors
/// There is not one name per column.
pub fn screen(
    names: &[impl AsRef<str>],
    role: Role,
    series: MatRef<'_, f64>,
) -> Result<Screening, AssessmentError> {
    if names.len() != series.ncols() {
        return Err(AssessmentError::Names {
            names: names.len(),
            columns: series.ncols(),
        });
    }
    let (mut channels, mut findings) = (Vec::new(), Vec::new());
    for (column, name) in names.iter().enumerate() {
        let values: Vec<f64> = series.col(column).iter().copied().collect();
        let channel = ChannelScreening::of(name.as_ref(), &values);
        if let Some(first) = channel.gaps.first() {
            findings.push(not_finite(&channel, *first));
        }
        if let Some(statistics) = &channel.statistics {
            findings.extend(channel_findings(&channel.name, role, statistics));
        }
        channels.push(channel);
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    Ok(Screening { channels, findings })
}

impl ChannelScreening {
    fn of(name: &str, values: &[f64]) -> Self {
        let (mut gaps, mut stretches, mut start) = (Vec::new(), Vec::new(), 0);
        for run in values.chunk_by(|a, b| a.is_finite() == b.is_finite()) {
            if run[0].is_finite() {
                stretches.push(run);
            } else {
                gaps.push(SampleRange {
                    first: start,
                    last: start + run.len() - 1,
                });
            }
            start += run.len();
        }
        Self {
            name: name.into(),
            samples: values.len(),
            not_finite: gaps.iter().map(|gap| gap.last - gap.first + 1).sum(),
            statistics: (!stretches.is_empty()).then(|| ChannelStatistics::measure(&stretches)),
            gaps,
        }
    }
}

fn not_finite(channel: &ChannelScreening, first: SampleRange) -> Finding {
    let place = if first.first == first.last {
        format!("sample {}", first.first)
    } else {
        format!("samples {} to {}", first.first, first.last)
    };
    Finding {
        kind: FindingKind::NotFinite,
        severity: Severity::Error,
        channels: vec![channel.name.clone()],
        message: format!(
            "{} of {} samples are not finite, in {} place(s), the first at {place}",
            channel.not_finite,
            channel.samples,
            channel.gaps.len()
        ),
        found: channel.not_finite as f64,
        allowed: 0.0,
        remedy: "cut the recording into records at these samples, or repair them".into(),
    }
}
