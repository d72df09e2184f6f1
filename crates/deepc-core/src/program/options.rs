//! What a program may have beyond the paper's problem (eq. (deepc)). Everything is off by default.
//!
//! | option | adds | source |
//! |---|---|---|
//! | weights per step | `Σₖ ‖u(k) − u_r(k)‖²_{R(k)} + ‖y(k) − y_r(k)‖²_{Q(k)}` | the paper's Q and R are of this form (eq. (deepc)) |
//! | cost of input changes | `Σₖ ‖u(k) − u(k−1)‖²_S` | Maciejowski 2002, chapter 2 |
//! | bounds of input changes | Δl ≤ u(k) − u(k−1) ≤ Δu | Maciejowski 2002, chapter 2 |
//! | affine constraints | l ≤ cᵀu(k) + dᵀy(k) ≤ h | polyhedral 𝒰 × 𝒴 of eq. (deepc) |
//! | terminal condition | `u(k) = u_r(k)`, `y(k) = y_r(k)` in the last steps | Berberich, Köhler, Müller, Allgöwer 2021, problem (3) with its terminal equality |
//! | soft constraints | ρs + ½ws² per violation s | Kerrigan, Maciejowski 2000: exact for ρ above the multiplier of the hard constraint |
//! | measured disturbances | rows `D_p`, `D_f` that are known | as inputs that nobody decides (Lemma 1 of the paper holds for (u, d)) |
//!
//! **The condensed form is exact for all of them, alone and together**: costs of f = col(u, y) join
//! the curvature W, constraints are rows over f, and disturbances join what is known. Nothing here
//! touches g, which alone decides whether a problem can be condensed.

use serde::{Deserialize, Serialize};

use super::error::SettingsError;
use super::settings::{Bounds, Slack, Softness, check_bounds, check_penalty};

/// Costs and constraints beyond those of the paper, all absent by default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ProgramOptions {
    /// Factors on the input weights, one row of m per step of the horizon (N rows), each at
    /// least 0. Empty: all 1. The last row makes a terminal cost.
    pub input_weight_factors: Vec<Vec<f64>>,
    /// The same for the output weights, rows of p.
    pub output_weight_factors: Vec<Vec<f64>>,
    /// Weight of (u(k) − u(k−1))², one per input (m), at least 0, per unit squared and step; u(−1)
    /// is the input applied last. Empty: none.
    pub input_change_weights: Vec<f64>,
    /// Bounds on u(k) − u(k−1) per sample, in the input's unit, one per input (m); hard. Empty:
    /// none.
    pub input_change_bounds: Vec<Bounds>,
    /// Affine constraints on one step's inputs and outputs.
    pub affine: Vec<AffineConstraint>,
    /// Condition at the end of the horizon.
    pub terminal: Option<Terminal>,
    /// How the measured disturbances, past and previewed, are matched.
    pub disturbance_slack: DisturbanceSlack,
}

/// How measured disturbances are matched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct DisturbanceSlack(pub Slack);

impl Default for DisturbanceSlack {
    /// Exactly: they are measured.
    fn default() -> Self {
        Self(Slack::Hard)
    }
}

/// Steps of the horizon a constraint holds in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Steps {
    /// All N.
    #[default]
    All,
    /// The last so many, 1 to N.
    Last(usize),
    /// One, from 0 to N − 1.
    At(usize),
}

impl Steps {
    /// The range of steps, `None` if it does not fit a horizon of N.
    pub(super) fn range(self, horizon: usize) -> Option<std::ops::Range<usize>> {
        match self {
            Self::All => Some(0..horizon),
            Self::Last(count) if (1..=horizon).contains(&count) => Some(horizon - count..horizon),
            Self::At(step) if step < horizon => Some(step..step + 1),
            Self::Last(_) | Self::At(_) => None,
        }
    }
}

/// lower ≤ cᵀu(k) + dᵀy(k) ≤ upper in some steps of the horizon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AffineConstraint {
    /// c, one coefficient per input (m).
    pub inputs: Vec<f64>,
    /// d, one coefficient per output (p).
    pub outputs: Vec<f64>,
    /// Where.
    pub bounds: Bounds,
    /// How firm.
    pub softness: Softness,
    /// In which steps.
    #[serde(default)]
    pub steps: Steps,
}

/// The last steps of the horizon stand at the reference: u(k) = `u_r(k)`, y(k) = `y_r(k)` (Berberich,
/// Köhler, Müller, Allgöwer 2021: at least as many steps as the plant's lag make the loop stable
/// for data without noise).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terminal {
    /// How many steps, 1 to N.
    pub steps: usize,
    /// How firm. Hard ends in infeasibility when the reference cannot be reached.
    pub softness: Softness,
}

impl ProgramOptions {
    /// Checks every field, for m inputs, p outputs and N steps.
    pub(super) fn check(
        &self,
        inputs: usize,
        outputs: usize,
        horizon: usize,
    ) -> Result<(), SettingsError> {
        for (field, factors, channels) in [
            ("input_weight_factors", &self.input_weight_factors, inputs),
            (
                "output_weight_factors",
                &self.output_weight_factors,
                outputs,
            ),
        ] {
            check_factors(field, factors, channels, horizon)?;
        }
        for (field, found) in [
            ("input_change_weights", self.input_change_weights.len()),
            ("input_change_bounds", self.input_change_bounds.len()),
        ] {
            if found != 0 && found != inputs {
                return Err(SettingsError::Length {
                    field,
                    expected: inputs,
                    found,
                });
            }
        }
        for (index, &found) in self.input_change_weights.iter().enumerate() {
            check_weight("input_change_weights", index, found)?;
        }
        for (index, bounds) in self.input_change_bounds.iter().enumerate() {
            check_bounds("input_change_bounds", index, bounds)?;
        }
        for (index, constraint) in self.affine.iter().enumerate() {
            constraint.check(index, inputs, outputs, horizon)?;
        }
        if let Some(terminal) = &self.terminal {
            if Steps::Last(terminal.steps).range(horizon).is_none() {
                return Err(SettingsError::Steps {
                    field: "terminal",
                    index: 0,
                    found: terminal.steps,
                    horizon,
                });
            }
            check_penalty("terminal.softness", 0, terminal.softness)?;
        }
        self.disturbance_slack.0.check("disturbance_slack")
    }
}

impl AffineConstraint {
    fn check(
        &self,
        index: usize,
        inputs: usize,
        outputs: usize,
        horizon: usize,
    ) -> Result<(), SettingsError> {
        for (field, expected, found) in [
            ("inputs", inputs, self.inputs.len()),
            ("outputs", outputs, self.outputs.len()),
        ] {
            if expected != found {
                return Err(SettingsError::AffineLength {
                    field,
                    index,
                    expected,
                    found,
                });
            }
        }
        let mut coefficients = self.inputs.iter().chain(&self.outputs);
        if let Some(&found) = coefficients.clone().find(|c| !c.is_finite()) {
            return Err(SettingsError::Coefficient { index, found });
        }
        if coefficients.all(|&c| c == 0.0) {
            return Err(SettingsError::NoCoefficient { index });
        }
        check_bounds("affine", index, &self.bounds)?;
        check_penalty("affine.softness", index, self.softness)?;
        if self.steps.range(horizon).is_none() {
            let (Steps::Last(found) | Steps::At(found)) = self.steps else {
                return Ok(());
            };
            return Err(SettingsError::Steps {
                field: "affine.steps",
                index,
                found,
                horizon,
            });
        }
        Ok(())
    }
}

fn check_factors(
    field: &'static str,
    factors: &[Vec<f64>],
    channels: usize,
    horizon: usize,
) -> Result<(), SettingsError> {
    if factors.is_empty() {
        return Ok(());
    }
    if factors.len() != horizon {
        return Err(SettingsError::Rows {
            field,
            expected: horizon,
            found: factors.len(),
        });
    }
    for (step, row) in factors.iter().enumerate() {
        if row.len() != channels {
            return Err(SettingsError::RowLength {
                field,
                step,
                expected: channels,
                found: row.len(),
            });
        }
        let improper = |found: &f64| !found.is_finite() || *found < 0.0;
        if let Some(index) = row.iter().position(improper) {
            return Err(SettingsError::Factor {
                field,
                step,
                index,
                found: row[index],
            });
        }
    }
    Ok(())
}

pub(super) fn check_weight(
    field: &'static str,
    index: usize,
    found: f64,
) -> Result<(), SettingsError> {
    if found.is_finite() && found >= 0.0 {
        return Ok(());
    }
    Err(SettingsError::Weight {
        field,
        index,
        found,
    })
}
