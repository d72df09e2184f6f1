//! Settings of a `DeePC` problem. There are no defaults for weights: a default λ is a hidden
//! decision.

use serde::{Deserialize, Serialize};

use super::error::SettingsError;
use super::options::ProgramOptions;
use super::regularisation::{Regularisation, RegularisedPart};
use super::stage_settings::StageSettings;
use crate::solver::SoftPenalty;

/// How the past is matched: `λ_u‖σ_u‖²` and `λ_y‖σ_y‖²` of the paper's eq. (deepc), or not at all.
/// The condensed form is exact for both.
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

    /// Checks the range of a penalty.
    pub(super) fn check(&self, field: &'static str) -> Result<(), SettingsError> {
        match *self {
            Self::Penalty(found) if !(found.is_finite() && found > 0.0) => {
                Err(SettingsError::Lambda { field, found })
            }
            Self::Penalty(_) | Self::Hard => Ok(()),
        }
    }
}

/// Bounds of one signal in every step of the horizon, in its unit. Absent or infinite: no bound. A
/// bound in single steps is an [`super::AffineConstraint`] with [`super::Steps::At`].
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
    /// Costs and constraints beyond the paper's.
    #[serde(default)]
    pub options: ProgramOptions,
}

impl DeepcSettings {
    /// Weights and regularisation, with the same slack for past inputs and outputs, and nothing
    /// else: no bounds, no options. To be completed with
    /// `DeepcSettings { input_bounds: …, ..DeepcSettings::new(…) }`.
    #[must_use]
    pub fn new(
        input_weights: &[f64],
        output_weights: &[f64],
        regularisation: Regularisation,
        slack: Slack,
    ) -> Self {
        Self {
            input_weights: input_weights.to_vec(),
            output_weights: output_weights.to_vec(),
            regularisation,
            input_slack: slack,
            output_slack: slack,
            input_bounds: vec![Bounds::none(); input_weights.len()],
            output_bounds: vec![OutputBounds::none(); output_weights.len()],
            options: ProgramOptions::default(),
        }
    }

    /// What does not depend on how the future is predicted.
    #[must_use]
    pub fn stage(&self) -> StageSettings {
        StageSettings {
            input_weights: self.input_weights.clone(),
            output_weights: self.output_weights.clone(),
            input_bounds: self.input_bounds.clone(),
            output_bounds: self.output_bounds.clone(),
            options: self.options.clone(),
        }
    }

    /// Checks every field against its range, for m inputs, p outputs and a horizon of N steps.
    ///
    /// # Errors
    /// Names the first field that is out of range.
    pub fn check(
        &self,
        inputs: usize,
        outputs: usize,
        horizon: usize,
    ) -> Result<(), SettingsError> {
        self.stage().check(inputs, outputs, horizon)?;
        check_regularisation(&self.regularisation)?;
        self.input_slack.check("input_slack")?;
        self.output_slack.check("output_slack")
    }
}

pub(super) fn check_regularisation(regularisation: &Regularisation) -> Result<(), SettingsError> {
    let found = regularisation.lambda_g;
    if regularisation.charges() && !(found.is_finite() && found > 0.0) {
        return Err(SettingsError::Lambda {
            field: "regularisation.lambda_g",
            found,
        });
    }
    if !regularisation.charges() && found != 0.0 {
        return Err(SettingsError::UnusedLambda { found });
    }
    if let RegularisedPart::Gamma {
        lambda_3: Some(found),
    } = regularisation.part
        && !(found.is_finite() && found > 0.0)
    {
        return Err(SettingsError::Lambda {
            field: "regularisation.part.gamma.lambda_3",
            found,
        });
    }
    Ok(())
}

pub(super) fn check_penalty(
    field: &'static str,
    index: usize,
    softness: Softness,
) -> Result<(), SettingsError> {
    match softness.penalty().filter(|penalty| !penalty.is_valid()) {
        None => Ok(()),
        Some(penalty) => Err(SettingsError::Penalty {
            field,
            index,
            linear: penalty.linear,
            quadratic: penalty.quadratic,
        }),
    }
}

pub(super) fn check_bounds(
    field: &'static str,
    index: usize,
    bounds: &Bounds,
) -> Result<(), SettingsError> {
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
