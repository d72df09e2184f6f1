//! The data report as text.

use std::fmt;

use super::channel::{ChannelReport, Role};
use super::order::{Certainty, OrderEstimate};
use super::prediction::{HoldOutPrediction, PredictionMethod};
use super::report::DataReport;
use super::tuning::TuningCurve;

/// Steps of the horizon shown.
const STEPS_SHOWN: usize = 6;

impl fmt::Display for DataReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let samples: usize = self.record_samples.iter().sum();
        writeln!(
            f,
            "DATA    {samples} samples in {} record(s), {:.1} s at {} s; past {}, future {}, \
             order at most {}",
            self.record_samples.len(),
            samples as f64 * self.sample_time_s,
            self.sample_time_s,
            self.horizons.past,
            self.horizons.future,
            self.largest_order
        )?;
        if let Some(excitation) = &self.excitation {
            let verdict = if excitation.is_persistently_exciting() {
                "yes"
            } else {
                "NO"
            };
            write!(
                f,
                "EXCITES {verdict}: rank {} of {}, {} samples needed",
                excitation.input_rank, excitation.input_rank_needed, excitation.samples_needed
            )?;
            if let Some(gap) = excitation
                .input_gap
                .as_ref()
                .filter(|gap| gap.largest > 0.0)
            {
                let ratio = gap.last_counted / gap.largest;
                write!(f, ", weakest direction {ratio:.1e} of the strongest")?;
            }
            writeln!(f)?;
        }
        if let Some(order) = &self.order {
            write_order(f, order)?;
        }
        write_channels(f, &self.channels)?;
        for test in &self.feedback {
            match (test.partial_r_squared, test.p_value) {
                (Some(share), Some(p)) => writeln!(
                    f,
                    "FEEDBACK past outputs explain {:.1} % of what is new in `{}` (p = {p:.1e})",
                    100.0 * share.max(0.0),
                    test.name
                )?,
                _ => writeln!(
                    f,
                    "FEEDBACK not tested for `{}`: it follows from its past, or changes too seldom",
                    test.name
                )?,
            }
        }
        if let Some(prediction) = &self.prediction {
            write_prediction(f, prediction)?;
        }
        if self.findings.is_empty() {
            return write!(f, "FINDINGS none");
        }
        write!(f, "FINDINGS {}", self.findings.len())?;
        for finding in &self.findings {
            write!(f, "\n  {finding}")?;
        }
        Ok(())
    }
}

fn write_order(f: &mut fmt::Formatter<'_>, estimate: &OrderEstimate) -> fmt::Result {
    let certainty = match estimate.certainty {
        Certainty::Unsure => "unsure",
        Certainty::Likely => "likely",
        Certainty::Sure => "sure",
    };
    let size = |value: Option<f64>| value.map_or("none".into(), |v| format!("{v:.1e}"));
    writeln!(
        f,
        "ORDER   {}, lag {} ({certainty}: signal to noise {} counted, {} dropped)",
        estimate.order,
        estimate.lag,
        size(estimate.last_counted),
        size(estimate.first_dropped)
    )
}

fn write_channels(f: &mut fmt::Formatter<'_>, channels: &[ChannelReport]) -> fmt::Result {
    let width = channels.iter().map(|c| c.name.chars().count()).max();
    let width = width.unwrap_or(0).max(7);
    writeln!(
        f,
        "{:<width$}             {:>10} {:>10} {:>10} {:>10} {:>9} {:>7} {:>6}",
        "CHANNEL", "mean", "deviation", "least", "greatest", "different", "at edge", "spikes"
    )?;
    for channel in channels {
        let statistics = &channel.statistics;
        let role = match channel.role {
            Role::Input => "input",
            Role::Disturbance => "disturbance",
            Role::Output => "output",
        };
        writeln!(
            f,
            "{:<width$} {role:<11} {:>10.3e} {:>10.3e} {:>10.3e} {:>10.3e} {:>9} {:>6.1}% {:>6}",
            channel.name,
            statistics.mean,
            statistics.deviation,
            statistics.least.value,
            statistics.greatest.value,
            statistics.distinct_values,
            100.0 * statistics.least.share.max(statistics.greatest.share),
            statistics.spikes
        )?;
    }
    Ok(())
}

fn write_prediction(f: &mut fmt::Formatter<'_>, prediction: &HoldOutPrediction) -> fmt::Result {
    let method = match prediction.method {
        PredictionMethod::LeastSquares => "least squares",
        PredictionMethod::Weighted { .. } => "with the weights given",
    };
    writeln!(
        f,
        "HOLD-OUT {} windows of {} samples, predicted from {} others ({method})",
        prediction.windows, prediction.held_samples, prediction.training_samples
    )?;
    let width = prediction
        .outputs
        .iter()
        .map(|o| o.name.chars().count())
        .max();
    let width = width.unwrap_or(0).max(18);
    let horizon = prediction
        .outputs
        .first()
        .map_or(0, |output| output.rms.len());
    let mut steps: Vec<usize> = (1..=STEPS_SHOWN)
        .map(|i| (i * horizon).div_ceil(STEPS_SHOWN).saturating_sub(1))
        .collect();
    steps.dedup();
    write!(
        f,
        "{:<width$} {:>9} {:>9}",
        "ERROR/DEVIATION at", "all steps", "largest"
    )?;
    for step in &steps {
        write!(f, " {:>9}", step + 1)?;
    }
    writeln!(f)?;
    for output in &prediction.outputs {
        // A constant channel has no deviation to compare with: show its unit.
        let (overall, errors, unit) = match (output.normalised_overall, &output.normalised) {
            (Some(overall), Some(errors)) => (overall, errors, output.deviation),
            _ => (output.rms_overall, &output.rms, 1.0),
        };
        write!(
            f,
            "{:<width$} {overall:>9.2e} {:>9.2e}",
            output.name,
            output.largest / unit
        )?;
        for &step in &steps {
            write!(f, " {:>9.2e}", errors[step])?;
        }
        writeln!(f)?;
    }
    Ok(())
}

impl fmt::Display for TuningCurve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:>10} {:>10} {:>10} {:>10}  {} windows, {} side by side",
            "λ_g", "λ_y", "error", "± (1 s.e.)", self.windows, self.independent_windows
        )?;
        for (index, point) in self.points.iter().enumerate() {
            let choice = match (index == self.best, index == self.one_standard_error) {
                (true, true) => "  ← best, and within one standard error",
                (true, false) => "  ← best",
                (false, true) => "  ← within one standard error",
                (false, false) => "",
            };
            // d√s = ds/(2√s)
            let uncertainty = point.standard_error / (2.0 * point.error).max(f64::MIN_POSITIVE);
            writeln!(
                f,
                "{:>10.2e} {:>10.2e} {:>10.3e} {:>10.1e}{choice}",
                point.lambda_g, point.lambda_y, point.error, uncertainty
            )?;
        }
        for point in &self.refused {
            writeln!(
                f,
                "{:>10.2e} {:>10.2e} refused: {}",
                point.lambda_g, point.lambda_y, point.reason
            )?;
        }
        Ok(())
    }
}
