//! Rollover measures and the outcome of a run.

use serde::{Deserialize, Serialize};

use crate::simulation::Observation;
use crate::units::{DEGREE, GRAVITY_M_S2};

/// Roll angle beyond which a vehicle counts as rolled over, rad.
pub const ROLLOVER_ROLL_RAD: f64 = 60.0 * DEGREE;
/// Sideslip angle beyond which a moving vehicle counts as spun out, rad.
pub const SPIN_SIDESLIP_RAD: f64 = 60.0 * DEGREE;
/// Speed above which the sideslip angle is judged, m/s.
pub const SPIN_LEAST_SPEED_M_S: f64 = 5.0;

/// The paper's load transfer ratio `(Fz,R − Fz,L)/(m g)` of loads front left, front right, rear
/// left, rear right in N. Positive in a left turn; beyond ±1 in dynamic lift and on landing.
#[must_use]
pub fn load_transfer_ratio(loads_n: &[f64; 4], total_mass_kg: f64) -> f64 {
    right_minus_left(loads_n) / (total_mass_kg * GRAVITY_M_S2)
}

/// `(Fz,R − Fz,L)/ΣFz`, in [−1, 1]; zero in flight.
#[must_use]
pub fn load_transfer_of_sum(loads_n: &[f64; 4]) -> f64 {
    let sum = (loads_n[0] + loads_n[1]) + (loads_n[2] + loads_n[3]);
    if sum > 0.0 {
        right_minus_left(loads_n) / sum
    } else {
        0.0
    }
}

fn right_minus_left(loads_n: &[f64; 4]) -> f64 {
    (loads_n[1] - loads_n[0]) + (loads_n[3] - loads_n[2])
}

/// How a run ended, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// To the end, on the road, on its wheels.
    Completed,
    /// Further from the course than half the road's width.
    LeftRoad,
    /// Sideslip beyond 60° at more than 5 m/s.
    SpunOut,
    /// Roll beyond 60°.
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

/// Watches a run and decides its outcome: the worst of what happened.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OutcomeMonitor {
    half_width_m: f64,
    left_road_s: Option<f64>,
    spun_out_s: Option<f64>,
    rolled_over_s: Option<f64>,
    two_wheel_lift_s: Option<f64>,
}

impl OutcomeMonitor {
    /// A monitor for a road `road_width_m` wide.
    #[must_use]
    pub fn new(road_width_m: f64) -> Self {
        Self {
            half_width_m: 0.5 * road_width_m,
            left_road_s: None,
            spun_out_s: None,
            rolled_over_s: None,
            two_wheel_lift_s: None,
        }
    }

    /// Takes note of an instant. Returns whether the run goes on: it ends with a rollover or a
    /// spin, not with leaving the road.
    pub fn observe(&mut self, observation: &Observation, path_deviation_m: f64) -> bool {
        let time = observation.time_s;
        let note = |event: &mut Option<f64>, happened: bool| {
            if happened && event.is_none() {
                *event = Some(time);
            }
        };
        let speed = observation.speed_m_s.hypot(observation.lateral_speed_m_s);
        note(
            &mut self.left_road_s,
            path_deviation_m.abs() > self.half_width_m,
        );
        note(
            &mut self.spun_out_s,
            observation.sideslip_rad.abs() > SPIN_SIDESLIP_RAD && speed > SPIN_LEAST_SPEED_M_S,
        );
        note(
            &mut self.rolled_over_s,
            observation.roll_rad.abs() > ROLLOVER_ROLL_RAD,
        );
        note(&mut self.two_wheel_lift_s, observation.two_wheel_lift());
        !self.ended()
    }

    /// Whether the run is over.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.rolled_over_s.is_some() || self.spun_out_s.is_some()
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
}
