//! The validation as text.

use std::fmt;

use super::{OutputValidation, Score, Validation};

/// Steps of the horizon shown.
const STEPS_SHOWN: usize = 6;

impl fmt::Display for Validation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let samples: usize = self.record_samples.iter().sum();
        let stable = if self.spectral_radius < 1.0 {
            "stable"
        } else {
            "UNSTABLE"
        };
        write!(
            f,
            "VALIDATION {samples} samples in {} record(s) at {} s; order {}, {stable} (spectral \
             radius {:.6}, of the predictor {:.6})",
            self.record_samples.len(),
            self.sample_time_s,
            self.order,
            self.spectral_radius,
            self.predictor_radius
        )?;
        for output in &self.outputs {
            write_output(f, output)?;
        }
        Ok(())
    }
}

fn write_output(f: &mut fmt::Formatter<'_>, output: &OutputValidation) -> fmt::Result {
    write!(f, "\n`{}`\n  simulation: ", output.name)?;
    match &output.simulation {
        None => write!(f, "left the range of numbers")?,
        Some(score) => write!(
            f,
            "fit {}, VAF {}, rms error {:.3e}",
            percent(score.fit_percent),
            percent(score.vaf_percent),
            score.rms_error
        )?,
    }
    write!(f, "\n  fit of predictions:")?;
    for (index, score) in shown(&output.prediction) {
        let end = if index == 0 { " step" } else { "" };
        write!(f, " {}{end} {}", index + 1, percent(score.fit_percent))?;
        if index + 1 < output.prediction.len() {
            write!(f, ",")?;
        }
    }
    for sentence in &output.verdict {
        write!(f, "\n  {sentence}")?;
    }
    Ok(())
}

/// A few steps spread over the horizon, the first and the last among them.
fn shown(scores: &[Score]) -> Vec<(usize, &Score)> {
    let last = scores.len().saturating_sub(1);
    let parts = STEPS_SHOWN.min(scores.len()).max(2) - 1;
    let mut indices: Vec<usize> = (0..=parts).map(|part| part * last / parts).collect();
    indices.dedup();
    let shown = indices
        .into_iter()
        .filter_map(|i| Some((i, scores.get(i)?)));
    shown.collect()
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(
        || "undefined (constant output)".to_owned(),
        |value| format!("{value:.2} %"),
    )
}
