//! What a driver, a controller or a log sees of the simulation.

use serde::Serialize;

use crate::metrics;
use crate::units::{DEGREE, KMH};

/// Measured state at one instant. Axes ISO 8855; wheels front left, front right, rear left, rear
/// right; "CG" is that of the whole vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Observation {
    /// Time since the start, s.
    pub time_s: f64,
    /// World x of the CG, m.
    pub x_m: f64,
    /// World y of the CG, m.
    pub y_m: f64,
    /// Height of the CG, m.
    pub z_m: f64,
    /// Yaw angle, continuous over full turns, rad.
    pub yaw_rad: f64,
    /// Roll angle of the body, positive with the right side down, rad.
    pub roll_rad: f64,
    /// Pitch angle of the body, positive with the nose down, rad.
    pub pitch_rad: f64,
    /// Horizontal velocity of the CG along the heading, m/s.
    pub speed_m_s: f64,
    /// Horizontal velocity of the CG across the heading, positive to the left, m/s.
    pub lateral_speed_m_s: f64,
    /// Angle from the heading to the CG's horizontal velocity, positive to the left, rad; zero
    /// below walking pace.
    pub sideslip_rad: f64,
    /// Angular rate about the vertical, rad/s.
    pub yaw_rate_rad_s: f64,
    /// Angular rate of the body about its own x axis, rad/s.
    pub roll_rate_rad_s: f64,
    /// Lateral ground force over mass, across the heading, positive to the left, m/s².
    pub lateral_acceleration_m_s2: f64,
    /// Ground and drag force over mass along the heading, m/s².
    pub longitudinal_acceleration_m_s2: f64,
    /// Angle of the handwheel behind the steering actuator, rad.
    pub handwheel_actual_rad: f64,
    /// Mean angle of the front wheels, rad.
    pub road_wheel_rad: f64,
    /// Load of each wheel along the ground normal, N.
    pub wheel_loads_n: [f64; 4],
    /// Wheel travel from the design height, bump positive, m.
    pub wheel_travel_m: [f64; 4],
    /// Gap between the lowest point of each tyre and the ground, along the ground normal, m; zero
    /// for a wheel on the ground.
    pub wheel_clearance_m: [f64; 4],
    /// Spin of each wheel, rad/s.
    pub wheel_spin_rad_s: [f64; 4],
    /// Load transfer ratio of the paper, `(Fz,R − Fz,L)/(m g)` (no unit).
    pub ltr: f64,
    /// `(Fz,R − Fz,L)/ΣFz`, zero in flight (no unit).
    pub ltr_of_sum: f64,
}

impl Observation {
    /// Speed along the heading, km/h.
    #[must_use]
    pub fn speed_kmh(&self) -> f64 {
        self.speed_m_s / KMH
    }

    /// Angle of the handwheel behind the actuator, deg.
    #[must_use]
    pub fn handwheel_actual_deg(&self) -> f64 {
        self.handwheel_actual_rad / DEGREE
    }

    /// Which wheels are off the ground.
    #[must_use]
    pub fn wheels_lifted(&self) -> [bool; 4] {
        self.wheel_loads_n.map(|load| load <= 0.0)
    }

    /// Height that both wheels of one side have at least, on the side where it is larger, m; zero
    /// while each side has a wheel on the ground.
    #[must_use]
    pub fn pair_clearance_m(&self) -> f64 {
        metrics::two_wheel_clearance_m(&self.wheel_clearance_m)
    }

    /// Whether both wheels of one side carry nothing. A wheel on rough ground may carry nothing
    /// for a moment; [`Self::two_wheel_lift_above`] asks for a height.
    #[must_use]
    pub fn two_wheel_lift(&self) -> bool {
        metrics::two_wheels_unloaded(&self.wheel_loads_n)
    }

    /// Whether both wheels of one side are more than `height_m` off the ground; NHTSA's tests ask
    /// for [`metrics::NHTSA_TWO_WHEEL_LIFT_M`].
    #[must_use]
    pub fn two_wheel_lift_above(&self, height_m: f64) -> bool {
        self.pair_clearance_m() > height_m
    }
}
