//! What is wrong with the data, how much of it is allowed, and what to do.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::channel::{ChannelStatistics, RepeatedPair, Repetition, Role};
use super::feedback::{FEEDBACK_R_SQUARED, FeedbackTest};
use super::order::{Certainty, OrderEstimate};
use super::prediction::HoldOutPrediction;
use crate::hankel::ExcitationReport;

/// Share of samples at an extreme value, in runs, above which a channel is saturated.
pub const SATURATED_SHARE: f64 = 0.01;

/// A channel with no more different values than this is a switch, not saturated or quantised:
/// binary test signals are good inputs.
pub const SWITCH_VALUES: usize = 8;

/// An output is coarsely quantised if its standard deviation is fewer than this many steps.
pub const QUANTISATION_STEPS: f64 = 10.0;

/// Largest |mean| over standard deviation.
pub const OFFSET_RATIO: f64 = 10.0;

/// Largest ratio of the root mean squares of two channels.
pub const SCALE_RATIO: f64 = 1e3;

/// Smallest singular value of the input Hankel matrix, relative to the largest, that excites well.
pub const WEAK_EXCITATION: f64 = 1e-4;

/// Hold-out error over standard deviation above which predictions are poor …
pub const POOR_PREDICTION: f64 = 0.5;

/// … and above which they are worse than the channel's mean.
pub const USELESS_PREDICTION: f64 = 1.0;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know.
    Info,
    /// Control may be worse for it.
    Warning,
    /// Do not control with these data.
    Error,
}

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// A record is shorter than one window L.
    RecordTooShort,
    /// Too few windows of order L + n for persistent excitation.
    TooFewSamples,
    /// Enough windows, but the inputs do not excite.
    NotExciting,
    /// They excite, some directions hardly.
    WeakExcitation,
    /// NaN or infinite samples of a raw series.
    NotFinite,
    /// A channel never changes.
    Constant,
    /// A channel stands at its extreme value.
    Saturated,
    /// An output has few different values.
    Quantised,
    /// Samples of an output stand far off their neighbours.
    Spikes,
    /// A mean much larger than the deviation.
    Offset,
    /// Channels of very different sizes.
    Scaling,
    /// Two channels say the same.
    Repeated,
    /// An input was decided from outputs.
    Feedback,
    /// Too few samples to estimate order and lag.
    OrderUnknown,
    /// The order found is above the bound given.
    OrderAboveBound,
    /// `T_ini` is below the lag found.
    PastTooShort,
    /// Nothing could be predicted.
    NoPrediction,
    /// The hold-out is predicted badly.
    PoorPrediction,
}

/// One verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What was found.
    pub kind: FindingKind,
    /// How much it matters.
    pub severity: Severity,
    /// Channels it is about; empty if it is about all.
    pub channels: Vec<String>,
    /// What is wrong, in words.
    pub message: String,
    /// Number found.
    pub found: f64,
    /// Number allowed: the limit that `found` is beyond.
    pub allowed: f64,
    /// What to do about it.
    pub remedy: String,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "ERROR",
        })
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<8}", self.severity)?;
        if !self.channels.is_empty() {
            write!(f, "`{}`: ", self.channels.join("`, `"))?;
        }
        write!(f, "{}\n        → {}", self.message, self.remedy)
    }
}

/// Findings about one channel by itself.
pub(super) fn channel_findings(
    name: &str,
    role: Role,
    statistics: &ChannelStatistics,
) -> Vec<Finding> {
    let finding = |kind, severity, (found, allowed), message, remedy: &str| Finding {
        kind,
        severity,
        channels: vec![name.to_owned()],
        message,
        found,
        allowed,
        remedy: remedy.into(),
    };
    let mut findings = Vec::new();
    if statistics.constant {
        let (severity, remedy) = match role {
            Role::Input => (Severity::Error, "shake it while recording, or leave it out"),
            Role::Disturbance => (
                Severity::Error,
                "record while it moves, or leave it out: what it does cannot be learnt",
            ),
            Role::Output => (Severity::Warning, "check the sensor, or leave it out"),
        };
        findings.push(finding(
            FindingKind::Constant,
            severity,
            (statistics.distinct_values as f64, 2.0),
            format!("constant at {:.6}", statistics.mean),
            remedy,
        ));
        return findings;
    }
    let switch = statistics.distinct_values <= SWITCH_VALUES;
    for (word, extreme) in [
        ("least", &statistics.least),
        ("greatest", &statistics.greatest),
    ] {
        if !switch && extreme.share > SATURATED_SHARE {
            findings.push(finding(
                FindingKind::Saturated,
                Severity::Warning,
                (extreme.share, SATURATED_SHARE),
                format!(
                    "stands at its {word} value {:.6} in {:.1} % of the samples, {} in a row",
                    extreme.value,
                    100.0 * extreme.share,
                    extreme.longest_run
                ),
                match role {
                    Role::Input => "record what was applied, not what was asked for; shake less",
                    Role::Disturbance => "use a wider sensor range",
                    Role::Output => "use a wider sensor range, or shake less",
                },
            ));
        }
    }
    if role == Role::Output {
        let steps = statistics.deviation / statistics.resolution;
        // Values that repeat, on average: continuous ones are all different.
        let repeated = 2 * statistics.distinct_values <= statistics.samples;
        if repeated && steps < QUANTISATION_STEPS {
            findings.push(finding(
                FindingKind::Quantised,
                Severity::Warning,
                (steps, QUANTISATION_STEPS),
                format!(
                    "{} different values only; its deviation is {steps:.1} steps of {:.3e}",
                    statistics.distinct_values, statistics.resolution
                ),
                "use a finer sensor, or treat the steps as noise with a smaller `λ_y`",
            ));
        }
        if !switch && statistics.spikes > 0 {
            findings.push(finding(
                FindingKind::Spikes,
                Severity::Warning,
                (statistics.spikes as f64, 0.0),
                format!(
                    "{} sample(s) stand alone far off their neighbours",
                    statistics.spikes
                ),
                "repair or cut them: one of them spoils as many windows as it has samples",
            ));
        }
    }
    if let Some(ratio) = statistics
        .offset_ratio()
        .filter(|&ratio| ratio > OFFSET_RATIO)
    {
        findings.push(finding(
            FindingKind::Offset,
            Severity::Warning,
            (ratio, OFFSET_RATIO),
            format!(
                "mean {:.6} is {ratio:.0} times its deviation {:.3e}",
                statistics.mean, statistics.deviation
            ),
            "subtract the operating point from the data and from references and bounds",
        ));
    }
    findings
}

/// A finding about the data as a whole.
fn about_data(
    kind: FindingKind,
    severity: Severity,
    (found, allowed): (f64, f64),
    message: String,
    remedy: &str,
) -> Finding {
    Finding {
        kind,
        severity,
        channels: Vec::new(),
        message,
        found,
        allowed,
        remedy: remedy.into(),
    }
}

/// Findings about the excitation of order L + n.
pub(super) fn excitation_findings(report: &ExcitationReport) -> Vec<Finding> {
    let order = report.window.saturating_add(report.plant_order);
    if report.columns < report.columns_needed {
        return vec![about_data(
            FindingKind::TooFewSamples,
            Severity::Error,
            (report.columns as f64, report.columns_needed as f64),
            format!(
                "{} samples in {} record(s) give {} windows of L + n = {order}, {} are needed",
                report.samples, report.records, report.columns, report.columns_needed
            ),
            &format!(
                "record at least {} samples in one record, or shorten the horizons",
                report.samples_needed
            ),
        )];
    }
    if !report.is_persistently_exciting() {
        let mut poor = about_data(
            FindingKind::NotExciting,
            Severity::Error,
            (report.input_rank as f64, report.input_rank_needed as f64),
            format!(
                "the inputs do not excite to order L + n = {order}: rank {} of {}",
                report.input_rank, report.input_rank_needed
            ),
            "shake every input with noise of its own",
        );
        let channels = report.input_channels.iter().filter(|c| c.rank < order);
        poor.channels = channels.map(|c| c.name.clone()).collect();
        return vec![poor];
    }
    let Some(gap) = &report.input_gap else {
        return Vec::new();
    };
    let ratio = gap.last_counted / gap.largest;
    if ratio >= WEAK_EXCITATION {
        return Vec::new();
    }
    vec![about_data(
        FindingKind::WeakExcitation,
        Severity::Warning,
        (ratio, WEAK_EXCITATION),
        format!("the weakest direction of the inputs has {ratio:.1e} of the strongest"),
        "remove offsets, or shake with a wider band: noise drowns weak directions",
    )]
}

/// Findings about pairs of channels.
pub(super) fn repetition_finding(pair: &RepeatedPair) -> Finding {
    let how = match pair.repetition {
        Repetition::Equal => "are equal",
        Repetition::Proportional => "are proportional",
        Repetition::Correlated => "move together",
    };
    let (severity, remedy) = match (pair.first.1, pair.second.1) {
        (Role::Input, Role::Input) => (
            Severity::Error,
            "shake them independently of each other, or keep one of them",
        ),
        (Role::Output, Role::Output) => (Severity::Warning, "keep one of them"),
        (Role::Output, _) | (_, Role::Output) => (
            Severity::Warning,
            "an output that only repeats an input or a disturbance: leave it out",
        ),
        _ => (
            Severity::Error,
            "the data cannot tell what either of them does: record while they move \
             independently, or leave one out",
        ),
    };
    Finding {
        kind: FindingKind::Repeated,
        severity,
        channels: vec![pair.first.0.clone(), pair.second.0.clone()],
        message: format!("{how} (correlation {:.7})", pair.correlation),
        found: pair.correlation.abs(),
        allowed: super::channel::REPEATED_CORRELATION,
        remedy: remedy.into(),
    }
}

/// `scales`: name and root mean square of every channel that is not zero.
pub(super) fn scaling_finding(scales: &[(String, f64)]) -> Option<Finding> {
    let by_size = |a: &&(String, f64), b: &&(String, f64)| a.1.total_cmp(&b.1);
    let smallest = scales.iter().min_by(by_size)?;
    let largest = scales.iter().max_by(by_size)?;
    let ratio = largest.1 / smallest.1;
    (ratio > SCALE_RATIO).then(|| Finding {
        kind: FindingKind::Scaling,
        severity: Severity::Warning,
        channels: vec![smallest.0.clone(), largest.0.clone()],
        message: format!("root mean squares {:.2e} and {:.2e}", smallest.1, largest.1),
        found: ratio,
        allowed: SCALE_RATIO,
        remedy: "choose units that bring channels to similar sizes: slack and g weigh all alike"
            .into(),
    })
}

pub(super) fn feedback_finding(test: &FeedbackTest) -> Option<Finding> {
    let r_squared = test.partial_r_squared.filter(|_| test.feedback)?;
    Some(Finding {
        kind: FindingKind::Feedback,
        severity: Severity::Warning,
        channels: vec![test.name.clone()],
        message: format!(
            "past outputs explain {:.0} % of what is new in this input: it was recorded in \
             closed loop, and noise biases the predictions",
            100.0 * r_squared
        ),
        found: r_squared,
        allowed: FEEDBACK_R_SQUARED,
        remedy: "record without feedback, or shake the input much more than feedback moves it"
            .into(),
    })
}

pub(super) fn order_findings(
    estimate: Option<&OrderEstimate>,
    bound: usize,
    past: usize,
) -> Vec<Finding> {
    let Some(estimate) = estimate else {
        return vec![about_data(
            FindingKind::OrderUnknown,
            Severity::Info,
            (0.0, 0.0),
            "too few samples to estimate order and lag".into(),
            "record longer",
        )];
    };
    let mut findings = Vec::new();
    if estimate.order > bound {
        findings.push(about_data(
            FindingKind::OrderAboveBound,
            Severity::Warning,
            (estimate.order as f64, bound as f64),
            format!(
                "the plant's order seems to be {}, above the bound {bound}",
                estimate.order
            ),
            "raise `largest_order` and measure again",
        ));
    }
    if past < estimate.lag && estimate.certainty > Certainty::Unsure {
        findings.push(about_data(
            FindingKind::PastTooShort,
            Severity::Warning,
            (past as f64, estimate.lag as f64),
            format!("T_ini = {past} is shorter than the lag {}", estimate.lag),
            "lengthen the past, or the state of the plant is not known",
        ));
    }
    findings
}

/// `missing`: why there is no prediction.
pub(super) fn prediction_findings(
    prediction: Option<&HoldOutPrediction>,
    missing: &str,
) -> Vec<Finding> {
    let Some(prediction) = prediction else {
        return vec![Finding {
            kind: FindingKind::NoPrediction,
            severity: Severity::Warning,
            channels: Vec::new(),
            message: format!("no hold-out prediction: {missing}"),
            found: 0.0,
            allowed: 1.0,
            remedy: "without it nobody knows how well these data predict".into(),
        }];
    };
    let poor = prediction.outputs.iter().filter_map(|output| {
        let error = output.normalised_overall?;
        let (severity, allowed) = if error > USELESS_PREDICTION {
            (Severity::Error, USELESS_PREDICTION)
        } else {
            (Severity::Warning, POOR_PREDICTION)
        };
        (error > POOR_PREDICTION).then(|| Finding {
            kind: FindingKind::PoorPrediction,
            severity,
            channels: vec![output.name.clone()],
            message: format!("hold-out error is {error:.2} of its deviation"),
            found: error,
            allowed,
            remedy: "more data, less noise, a longer past, or a measured disturbance as an input; \
                     a plant that is not linear over the recording needs a narrower range"
                .into(),
        })
    });
    poor.collect()
}
