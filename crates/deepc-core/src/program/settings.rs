//! Settings of a `DeePC` problem. There are no defaults for weights: a default λ is a hidden
//! decision.

use serde::{Deserialize, Serialize};

use super::error::SettingsError;
use crate::solver::SoftPenalty;

/// What `λ_g` multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normalisation {
    /// `λ_g‖g‖²` with H as it is, as the papers write it. Its meaning changes with the length of
    /// the recording: twice the columns J act like half the `λ_g`.
    Raw,
    /// `λ_g‖g‖²` with H/√J in place of H, that is `λ_g·J` of the raw form. Its meaning does not
    /// change when more data of the same kind are recorded.
    PerColumn,
}

/// Weight of the squared 2-norm of g.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regularisation {
    /// `λ_g`, finite and above 0.
    pub lambda_g: f64,
    /// What it multiplies.
    pub normalisation: Normalisation,
}

impl Regularisation {
    /// `lambda_g`·‖g‖² with H as it is.
    #[must_use]
    pub fn raw(lambda_g: f64) -> Self {
        Self {
            lambda_g,
            normalisation: Normalisation::Raw,
        }
    }

    /// `lambda_g`·‖g‖² with H/√J in place of H.
    #[must_use]
    pub fn per_column(lambda_g: f64) -> Self {
        Self {
            lambda_g,
            normalisation: Normalisation::PerColumn,
        }
    }

    /// `λ_g` of the raw form, for a Hankel matrix of J columns (before any reduction).
    #[must_use]
    pub fn raw_lambda_g(&self, columns: usize) -> f64 {
        match self.normalisation {
            Normalisation::Raw => self.lambda_g,
            Normalisation::PerColumn => self.lambda_g * columns as f64,
        }
    }
}

/// How the past is matched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slack {
    /// λ‖σ‖², finite and above 0.
    Penalty(f64),
    /// σ = 0: the data must explain the past exactly.
    Hard,
}

impl Slack {
    /// 1/λ; 0 for [`Slack::Hard`].
    #[must_use]
    pub fn compliance(&self) -> f64 {
        match self {
            Self::Penalty(lambda) => 1.0 / lambda,
            Self::Hard => 0.0,
        }
    }
}

/// Bounds of one input over the whole horizon; always hard. Absent or infinite: no bound.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Lower bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lower: Option<f64>,
    /// Upper bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upper: Option<f64>,
}

impl Bounds {
    /// No bounds.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// From `lower` to `upper`.
    #[must_use]
    pub fn between(lower: f64, upper: f64) -> Self {
        Self {
            lower: Some(lower),
            upper: Some(upper),
        }
    }

    /// Lower bound, −∞ if there is none.
    #[must_use]
    pub fn lower_value(&self) -> f64 {
        self.lower.unwrap_or(f64::NEG_INFINITY)
    }

    /// Upper bound, +∞ if there is none.
    #[must_use]
    pub fn upper_value(&self) -> f64 {
        self.upper.unwrap_or(f64::INFINITY)
    }

    /// Whether a finite bound is set.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        self.lower_value().is_finite() || self.upper_value().is_finite()
    }

    /// The value nearest to `value` within the bounds.
    #[must_use]
    pub fn clip(&self, value: f64) -> f64 {
        value.max(self.lower_value()).min(self.upper_value())
    }

    /// How far `value` is outside; 0 inside.
    #[must_use]
    pub fn violation(&self, value: f64) -> f64 {
        (self.lower_value() - value)
            .max(value - self.upper_value())
            .max(0.0)
    }
}

/// What happens when a bound cannot be met.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Softness {
    /// The problem is infeasible.
    Hard,
    /// It is violated by s ≥ 0 at the price linear·s + ½·quadratic·s² in every step of the
    /// horizon, added to the objective. With `linear` large enough s is 0 whenever that is
    /// possible.
    Soft(SoftPenalty),
}

impl Softness {
    /// The penalty; `None` if hard.
    #[must_use]
    pub fn penalty(&self) -> Option<SoftPenalty> {
        match self {
            Self::Hard => None,
            Self::Soft(penalty) => Some(*penalty),
        }
    }
}

/// Bounds of one output over the whole horizon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputBounds {
    /// Where.
    pub bounds: Bounds,
    /// How firm.
    pub softness: Softness,
}

impl OutputBounds {
    /// No bounds.
    #[must_use]
    pub fn none() -> Self {
        Self {
            bounds: Bounds::none(),
            softness: Softness::Hard,
        }
    }

    /// Hard bounds.
    #[must_use]
    pub fn hard(lower: f64, upper: f64) -> Self {
        Self {
            bounds: Bounds::between(lower, upper),
            softness: Softness::Hard,
        }
    }

    /// Soft bounds with the price linear·s + ½·quadratic·s².
    #[must_use]
    pub fn soft(lower: f64, upper: f64, linear: f64, quadratic: f64) -> Self {
        Self {
            bounds: Bounds::between(lower, upper),
            softness: Softness::Soft(SoftPenalty { linear, quadratic }),
        }
    }
}

/// Settings of a `DeePC` problem with m inputs and p outputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeepcSettings {
    /// Diagonal of R, one weight per input (m), at least 0, per unit squared and step.
    pub input_weights: Vec<f64>,
    /// Diagonal of Q, one weight per output (p), at least 0, per unit squared and step.
    pub output_weights: Vec<f64>,
    /// Regularisation of g.
    pub regularisation: Regularisation,
    /// `λ_u`, weight of the slack on the past inputs, or hard.
    pub input_slack: Slack,
    /// `λ_y`, weight of the slack on the past outputs, or hard.
    pub output_slack: Slack,
    /// Bounds of every input (m).
    pub input_bounds: Vec<Bounds>,
    /// Bounds of every output (p).
    pub output_bounds: Vec<OutputBounds>,
}

impl DeepcSettings {
    /// Checks every field against its range, for m inputs and p outputs.
    ///
    /// # Errors
    /// Names the first field that is out of range.
    pub fn check(&self, inputs: usize, outputs: usize) -> Result<(), SettingsError> {
        for (field, expected, found) in [
            ("input_weights", inputs, self.input_weights.len()),
            ("output_weights", outputs, self.output_weights.len()),
            ("input_bounds", inputs, self.input_bounds.len()),
            ("output_bounds", outputs, self.output_bounds.len()),
        ] {
            if expected != found {
                return Err(SettingsError::Length {
                    field,
                    expected,
                    found,
                });
            }
        }
        let proper_weight = |value: f64| value.is_finite() && value >= 0.0;
        for (field, weights) in [
            ("input_weights", &self.input_weights),
            ("output_weights", &self.output_weights),
        ] {
            for (index, &found) in weights.iter().enumerate() {
                if !proper_weight(found) {
                    return Err(SettingsError::Weight {
                        field,
                        index,
                        found,
                    });
                }
            }
        }
        let mut lambdas = vec![("regularisation.lambda_g", self.regularisation.lambda_g)];
        for (field, slack) in [
            ("input_slack", self.input_slack),
            ("output_slack", self.output_slack),
        ] {
            if let Slack::Penalty(lambda) = slack {
                lambdas.push((field, lambda));
            }
        }
        for (field, found) in lambdas {
            if !(found.is_finite() && found > 0.0) {
                return Err(SettingsError::Lambda { field, found });
            }
        }
        let input_bounds = self
            .input_bounds
            .iter()
            .map(|bounds| ("input_bounds", bounds));
        for (index, (field, bounds)) in input_bounds.enumerate() {
            check_bounds(field, index, bounds)?;
        }
        for (index, output) in self.output_bounds.iter().enumerate() {
            check_bounds("output_bounds", index, &output.bounds)?;
            if let Some(penalty) = output.softness.penalty().filter(|p| !p.is_valid()) {
                return Err(SettingsError::Penalty {
                    index,
                    linear: penalty.linear,
                    quadratic: penalty.quadratic,
                });
            }
        }
        Ok(())
    }
}

fn check_bounds(field: &'static str, index: usize, bounds: &Bounds) -> Result<(), SettingsError> {
    let (lower, upper) = (bounds.lower_value(), bounds.upper_value());
    let empty = lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY;
    if lower.is_nan() || upper.is_nan() || empty {
        return Err(SettingsError::Bounds {
            field,
            index,
            lower,
            upper,
        });
    }
    Ok(())
}
