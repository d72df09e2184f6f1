//! What an identification came to, in the few numbers of `summary.json`.

use std::fmt;

use serde::{Deserialize, Serialize};
use sysid::{EffectVerdict, IdentificationReport, InputEffect};

/// The model a controller predicts with; the whole report is in `identification.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelSummary {
    /// Order of the model.
    pub order: usize,
    /// Fit of its simulation on held-out samples, NRMSE in %.
    pub held_out_fit_percent: f64,
    /// What the recording says of every input's effect.
    pub effects: Vec<EffectSummary>,
}

/// What the recording says of an input's effect on an output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectSummary {
    /// Column of the input.
    pub input: String,
    /// Column of the output.
    pub output: String,
    /// Steady-state gain of the model, output per unit of the input.
    pub gain: f64,
    /// Its standard error; absent if the recording says nothing at all.
    pub standard_error: Option<f64>,
    /// Whether the gain can be trusted.
    pub verdict: EffectVerdict,
}

impl ModelSummary {
    /// The short form of a report.
    #[must_use]
    pub fn of_report(report: &IdentificationReport) -> Self {
        let worst = report.held_out_fit.iter().copied();
        Self {
            order: report.order,
            held_out_fit_percent: worst.fold(f64::INFINITY, f64::min),
            effects: report.effects.iter().map(EffectSummary::of).collect(),
        }
    }
}

impl EffectSummary {
    fn of(effect: &InputEffect) -> Self {
        let error = effect.standard_error;
        Self {
            input: effect.input.clone(),
            output: effect.output.clone(),
            gain: effect.gain,
            standard_error: error.is_finite().then_some(error),
            verdict: effect.verdict,
        }
    }
}

impl fmt::Display for EffectSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} → {} ", self.input, self.output)?;
        match self.verdict {
            EffectVerdict::HeldAtZero => return f.write_str("held at zero"),
            EffectVerdict::Identified => f.write_str("identified")?,
            EffectVerdict::SteadyStateNotIdentified => {
                f.write_str("steady state not identified")?;
            }
            EffectVerdict::NotIdentified => f.write_str("not identified, not even its sign")?,
        }
        write!(f, " ({:+.2e}", self.gain)?;
        match self.standard_error {
            Some(error) => write!(f, " ± {error:.1e})"),
            None => f.write_str(", error unknown)"),
        }
    }
}

impl fmt::Display for ModelSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "model of order {}, fit {:.1} %",
            self.order, self.held_out_fit_percent
        )?;
        self.effects
            .iter()
            .try_for_each(|effect| write!(f, "; {effect}"))
    }
}
