//! All that can be said about a recording before it controls anything.

use serde::{Deserialize, Serialize};

use super::channel::{ChannelReport, ChannelStatistics, RepeatedPair, channels, repeated};
use super::error::AssessmentError;
use super::feedback::{self, FeedbackTest};
use super::finding::{
    Finding, FindingKind, Severity, channel_findings, excitation_findings, feedback_finding,
    order_findings, prediction_findings, repetition_finding, scaling_finding,
};
use super::order::OrderEstimate;
use super::prediction::{HoldOutErrors, HoldOutPrediction, PredictionSettings};
use crate::data::{Dataset, Record};
use crate::hankel::{ExcitationReport, HankelError, HankelMatrix, Horizons};

/// What a report assumes and how it predicts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportOptions {
    /// Upper bound on the order n of the plant. Excitation is asked for order L + n, and no larger
    /// order is looked for.
    pub largest_order: usize,
    /// How to predict, and what to hold out.
    pub prediction: PredictionSettings,
}

impl ReportOptions {
    /// For a plant of at most this order; least-squares prediction of the last quarter.
    #[must_use]
    pub fn up_to_order(largest_order: usize) -> Self {
        Self {
            largest_order,
            prediction: PredictionSettings::least_squares(),
        }
    }
}

/// The data report. Plain data: text by `Display`, JSON by `serde`.
///
/// ```
/// use deepc_core::assessment::{DataReport, ReportOptions, Severity};
/// use deepc_core::data::Dataset;
/// use deepc_core::hankel::Horizons;
///
/// let (mut x, mut noise) = (0.0, 1_u32);
/// let mut data = Dataset::new(1.0, ["heater"], ["temperature"])?;
/// let (mut inputs, mut outputs) = (vec![], vec![]);
/// for _ in 0..400 {
///     noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
///     let u = f64::from(noise >> 16) / 32768.0 - 1.0;
///     x = 0.9 * x + 0.1 * u;
///     inputs.push(u);
///     outputs.push(x);
/// }
/// data.push_rows(&inputs, &outputs)?;
/// let report = DataReport::measure(&data, Horizons::new(2, 10), &ReportOptions::up_to_order(3))?;
/// assert!(report.worst() < Some(Severity::Error), "{report}");
/// assert_eq!(report.order.map(|o| (o.order, o.lag)), Some((1, 1)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataReport {
    /// Sample time, in seconds.
    pub sample_time_s: f64,
    /// Horizons `T_ini` and N.
    pub horizons: Horizons,
    /// Order bound n it was measured for.
    pub largest_order: usize,
    /// Samples of each record.
    pub record_samples: Vec<usize>,
    /// Every channel, inputs first.
    pub channels: Vec<ChannelReport>,
    /// Channels that repeat each other.
    pub repeated: Vec<RepeatedPair>,
    /// log₁₀ of the ratio of the largest and the smallest root mean square of a channel.
    pub scale_decades: f64,
    /// Excitation of order L + n; `None` if a record is shorter than L.
    pub excitation: Option<ExcitationReport>,
    /// Order and lag; `None` if there are too few samples to tell.
    pub order: Option<OrderEstimate>,
    /// Whether each input follows the outputs; empty if there are too few samples to tell.
    pub feedback: Vec<FeedbackTest>,
    /// Prediction of what was held out; `None` if it was not possible.
    pub prediction: Option<HoldOutPrediction>,
    /// What is wrong, the worst first.
    pub findings: Vec<Finding>,
}

impl DataReport {
    /// Measures. Poor data are findings, not errors.
    ///
    /// # Errors
    /// A horizon is 0, the data set has no records, a setting of the prediction is out of range,
    /// or a decomposition does not converge.
    pub fn measure(
        dataset: &Dataset,
        horizons: Horizons,
        options: &ReportOptions,
    ) -> Result<Self, AssessmentError> {
        let mut findings = Vec::new();
        let excitation = match HankelMatrix::build(dataset, horizons) {
            Ok(hankel) => Some(hankel.excitation(options.largest_order)?),
            Err(HankelError::RecordTooShort {
                record,
                samples,
                window,
                ..
            }) => {
                findings.push(Finding {
                    kind: FindingKind::RecordTooShort,
                    severity: Severity::Error,
                    channels: Vec::new(),
                    message: format!(
                        "record {record} has {samples} samples, one window of past + future \
                         needs {window}"
                    ),
                    found: samples as f64,
                    allowed: window as f64,
                    remedy: "leave the record out, or shorten the horizons".into(),
                });
                None
            }
            Err(error) => return Err(error.into()),
        };
        let all = channels(dataset);
        let statistics: Vec<_> = all
            .iter()
            .map(|(_, _, stretches)| ChannelStatistics::measure(stretches))
            .collect();
        let repeated = repeated(&all, &statistics);
        let order = OrderEstimate::measure(dataset, &all, &statistics, options.largest_order)?;
        let feedback = feedback::measure(dataset, &all, &statistics);
        let (prediction, missing) = predict(dataset, horizons, &options.prediction)?;
        let reports: Vec<_> = all
            .into_iter()
            .zip(statistics)
            .map(|((name, role, _), statistics)| ChannelReport {
                name,
                role,
                statistics,
            })
            .collect();
        let scales: Vec<_> = reports
            .iter()
            .filter(|channel| channel.statistics.rms > 0.0)
            .map(|channel| (channel.name.clone(), channel.statistics.rms))
            .collect();

        findings.extend(excitation.iter().flat_map(excitation_findings));
        for channel in &reports {
            let about = channel_findings(&channel.name, channel.role, &channel.statistics);
            findings.extend(about);
        }
        findings.extend(repeated.iter().map(repetition_finding));
        findings.extend(scaling_finding(&scales));
        findings.extend(feedback.iter().filter_map(feedback_finding));
        let past = horizons.past;
        findings.extend(order_findings(order.as_ref(), options.largest_order, past));
        findings.extend(prediction_findings(prediction.as_ref(), &missing));
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        Ok(Self {
            sample_time_s: dataset.sample_time_s(),
            horizons,
            largest_order: options.largest_order,
            record_samples: dataset.records().iter().map(Record::samples).collect(),
            scale_decades: decades(&scales),
            channels: reports,
            repeated,
            excitation,
            order,
            feedback,
            prediction,
            findings,
        })
    }

    /// The gravest severity found; `None` if nothing was.
    #[must_use]
    pub fn worst(&self) -> Option<Severity> {
        self.findings.iter().map(|finding| finding.severity).max()
    }

    /// Findings of a kind.
    pub fn findings_of(&self, kind: FindingKind) -> impl Iterator<Item = &Finding> + '_ {
        self.findings
            .iter()
            .filter(move |finding| finding.kind == kind)
    }
}

/// The prediction, or why there is none. Settings out of range are errors of the caller.
fn predict(
    dataset: &Dataset,
    horizons: Horizons,
    settings: &PredictionSettings,
) -> Result<(Option<HoldOutPrediction>, String), AssessmentError> {
    use crate::program::ProgramError;
    match HoldOutErrors::measure(dataset, horizons, settings) {
        Ok(errors) => {
            let summary = errors.summary();
            let finite = summary
                .outputs
                .iter()
                .all(|output| output.largest.is_finite());
            let missing = "the predictions are not finite".to_owned();
            Ok((finite.then_some(summary), missing))
        }
        Err(
            error @ (AssessmentError::HoldOutTooShort { .. }
            | AssessmentError::TrainingTooShort { .. }
            | AssessmentError::Program(
                ProgramError::InputsNotExciting { .. }
                | ProgramError::SlackLost { .. }
                | ProgramError::Factorisation { .. },
            )),
        ) => Ok((None, error.to_string())),
        Err(error) => Err(error),
    }
}

fn decades(scales: &[(String, f64)]) -> f64 {
    let largest = scales.iter().map(|s| s.1).fold(0.0, f64::max);
    let smallest = scales.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    if scales.is_empty() {
        0.0
    } else {
        (largest / smallest).log10()
    }
}
