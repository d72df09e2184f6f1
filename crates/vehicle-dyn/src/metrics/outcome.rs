//! How a run ended, and the rules that decide it.

use serde::{Deserialize, Serialize};

use super::two_wheels_unloaded;
use crate::simulation::Observation;
use crate::units::DEGREE;

/// Roll angle beyond which a vehicle counts as rolled over, rad.
pub const ROLLOVER_ROLL_RAD: f64 = 60.0 * DEGREE;
/// Sideslip angle beyond which a moving vehicle counts as spun out, rad.
pub const SPIN_SIDESLIP_RAD: f64 = 60.0 * DEGREE;
/// Speed above which the sideslip angle is judged, m/s.
pub const SPIN_LEAST_SPEED_M_S: f64 = 5.0;

/// How a run ended, from best to worst: the worst that happened is the outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// To the end, on the road, on its wheels.
    Completed,
    /// Further from the course than half the road's width.
    LeftRoad,
    /// Sideslip beyond 60° at more than 5 m/s, in the standard rules.
    SpunOut,
    /// Roll beyond 60°, in the standard rules.
    RolledOver,
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Completed => "completed",
            Self::LeftRoad => "left_road",
            Self::SpunOut => "spun_out",
            Self::RolledOver => "rolled_over",
        })
    }
}

/// The thresholds that decide an outcome, and what a run stops at.
///
/// Roll is judged against gravity, not against the road: gravity decides whether a vehicle tips, and
/// banks of roads are far below the threshold. A vehicle that rolls on beyond 180°, or over its nose,
/// has passed the threshold and stays rolled over. Load transfer decides nothing: wheels lift for a
/// moment, and land with |LTR| above 1, without a rollover.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutcomeRules {
    /// Roll angle against gravity beyond which a vehicle has rolled over, rad; 60° in the standard
    /// rules.
    pub rollover_roll_rad: f64,
    /// Sideslip angle beyond which a moving vehicle has spun out, rad; 60° in the standard rules.
    /// Driving backwards is a sideslip of 180°.
    pub spin_sideslip_rad: f64,
    /// Horizontal speed above which the sideslip angle is judged, m/s; 5 in the standard rules.
    pub spin_least_speed_m_s: f64,
    /// The mildest outcome that ends a run; `spun_out` in the standard rules, so that a vehicle
    /// that has left the road goes on.
    pub ends_at: Outcome,
}

/// A rule out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("outcome_rules.{field} = {value}: must be {range}")]
pub struct OutcomeRulesError {
    /// Field of [`OutcomeRules`].
    pub field: &'static str,
    /// What was found.
    pub value: String,
    /// What is allowed, with its unit.
    pub range: &'static str,
}

impl OutcomeRules {
    /// The rules of this project's documents: [`ROLLOVER_ROLL_RAD`], [`SPIN_SIDESLIP_RAD`] above
    /// [`SPIN_LEAST_SPEED_M_S`], end at a spin or a rollover.
    pub const STANDARD: Self = Self {
        rollover_roll_rad: ROLLOVER_ROLL_RAD,
        spin_sideslip_rad: SPIN_SIDESLIP_RAD,
        spin_least_speed_m_s: SPIN_LEAST_SPEED_M_S,
        ends_at: Outcome::SpunOut,
    };

    /// Checks every rule against its range.
    ///
    /// # Errors
    /// [`OutcomeRulesError`] with field, value and range.
    pub fn check(&self) -> Result<(), OutcomeRulesError> {
        for (field, value, low, high, range) in [
            (
                "rollover_roll_rad",
                self.rollover_roll_rad,
                0.1,
                3.1,
                "in [0.1, 3.1] rad",
            ),
            (
                "spin_sideslip_rad",
                self.spin_sideslip_rad,
                0.1,
                3.1,
                "in [0.1, 3.1] rad",
            ),
            (
                "spin_least_speed_m_s",
                self.spin_least_speed_m_s,
                1.0,
                150.0,
                "in [1, 150] m/s",
            ),
        ] {
            if !(low..=high).contains(&value) {
                return Err(OutcomeRulesError {
                    field,
                    value: value.to_string(),
                    range,
                });
            }
        }
        if self.ends_at == Outcome::Completed {
            return Err(OutcomeRulesError {
                field: "ends_at",
                value: self.ends_at.to_string(),
                range: "left_road, spun_out or rolled_over",
            });
        }
        Ok(())
    }
}

/// Watches a run and decides its outcome: the worst of what happened.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OutcomeMonitor {
    rules: OutcomeRules,
    half_width_m: f64,
    left_road_s: Option<f64>,
    spun_out_s: Option<f64>,
    rolled_over_s: Option<f64>,
    two_wheel_lift_s: Option<f64>,
    not_finite_s: Option<f64>,
}

impl OutcomeMonitor {
    /// A monitor with the standard rules for a road `road_width_m` wide.
    #[must_use]
    pub fn new(road_width_m: f64) -> Self {
        Self::standing_by(road_width_m, OutcomeRules::STANDARD)
    }

    /// A monitor with rules of one's own for a road `road_width_m` wide.
    ///
    /// # Errors
    /// [`OutcomeRulesError`] when a rule is out of range.
    pub fn with_rules(road_width_m: f64, rules: OutcomeRules) -> Result<Self, OutcomeRulesError> {
        rules.check()?;
        Ok(Self::standing_by(road_width_m, rules))
    }

    fn standing_by(road_width_m: f64, rules: OutcomeRules) -> Self {
        Self {
            rules,
            half_width_m: 0.5 * road_width_m,
            left_road_s: None,
            spun_out_s: None,
            rolled_over_s: None,
            two_wheel_lift_s: None,
            not_finite_s: None,
        }
    }

    /// Takes note of an instant. Returns whether the run goes on: with the standard rules it ends
    /// with a rollover or a spin, not with leaving the road.
    ///
    /// An instant whose roll, sideslip, speed or path deviation is not finite decides nothing and
    /// ends the run: a rollover could not be seen any more ([`Self::not_finite_s`]).
    pub fn observe(&mut self, observation: &Observation, path_deviation_m: f64) -> bool {
        let time = observation.time_s;
        let note = |event: &mut Option<f64>, happened: bool| {
            if happened && event.is_none() {
                *event = Some(time);
            }
        };
        let speed = observation.speed_m_s.hypot(observation.lateral_speed_m_s);
        let judged = [
            observation.roll_rad,
            observation.sideslip_rad,
            speed,
            path_deviation_m,
        ];
        if !judged.iter().all(|value| value.is_finite()) {
            note(&mut self.not_finite_s, true);
            return false;
        }
        note(
            &mut self.left_road_s,
            path_deviation_m.abs() > self.half_width_m,
        );
        note(
            &mut self.spun_out_s,
            observation.sideslip_rad.abs() > self.rules.spin_sideslip_rad
                && speed > self.rules.spin_least_speed_m_s,
        );
        note(
            &mut self.rolled_over_s,
            observation.roll_rad.abs() > self.rules.rollover_roll_rad,
        );
        note(
            &mut self.two_wheel_lift_s,
            two_wheels_unloaded(&observation.wheel_loads_n),
        );
        !self.ended()
    }

    /// Whether the run is over.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.not_finite_s.is_some() || self.outcome() >= self.rules.ends_at
    }

    /// The outcome so far.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        if self.rolled_over_s.is_some() {
            Outcome::RolledOver
        } else if self.spun_out_s.is_some() {
            Outcome::SpunOut
        } else if self.left_road_s.is_some() {
            Outcome::LeftRoad
        } else {
            Outcome::Completed
        }
    }

    /// When `outcome` first happened, s. Never set for [`Outcome::Completed`].
    #[must_use]
    pub fn time_of_s(&self, outcome: Outcome) -> Option<f64> {
        match outcome {
            Outcome::Completed => None,
            Outcome::LeftRoad => self.left_road_s,
            Outcome::SpunOut => self.spun_out_s,
            Outcome::RolledOver => self.rolled_over_s,
        }
    }

    /// When both wheels of one side were first off the ground, s.
    #[must_use]
    pub fn two_wheel_lift_s(&self) -> Option<f64> {
        self.two_wheel_lift_s
    }

    /// When an instant could not be judged, s. A run in which this is set has no outcome:
    /// [`Self::outcome`] is only what was seen before.
    #[must_use]
    pub fn not_finite_s(&self) -> Option<f64> {
        self.not_finite_s
    }
}
