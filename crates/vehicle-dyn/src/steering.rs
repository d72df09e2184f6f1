//! Steering system: a second-order actuator with a rate limit between command and handwheel.

use crate::parameters::SteeringParameters;
use crate::units::DEGREE;

/// Constants of the steering actuator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteeringActuator {
    natural_rad_s: f64,
    damping_ratio: f64,
    rate_limit_rad_s: f64,
    limit_rad: f64,
    inverse_ratio: f64,
}

impl SteeringActuator {
    /// Prepares the actuator.
    #[must_use]
    pub fn new(steering: &SteeringParameters) -> Self {
        Self {
            natural_rad_s: std::f64::consts::TAU * steering.bandwidth_hz,
            damping_ratio: steering.damping_ratio,
            rate_limit_rad_s: steering.handwheel_rate_limit_deg_per_s * DEGREE,
            limit_rad: steering.handwheel_limit_deg * DEGREE,
            inverse_ratio: 1.0 / steering.ratio,
        }
    }

    /// The command within the handwheel's end stops, rad.
    #[must_use]
    pub fn limited_rad(&self, command_rad: f64) -> f64 {
        command_rad.clamp(-self.limit_rad, self.limit_rad)
    }

    /// Rate of the handwheel angle (rad/s) and of the actuator's inner rate (rad/s²) for
    /// `[angle, inner rate]` and a limited command.
    #[must_use]
    pub fn rates(&self, state: [f64; 2], command_rad: f64) -> [f64; 2] {
        let [angle, rate] = state;
        let natural = self.natural_rad_s;
        let acceleration =
            natural * natural * (command_rad - angle) - 2.0 * self.damping_ratio * natural * rate;
        // The inner rate must not wind up beyond what the handwheel can follow.
        let saturated = rate.abs() >= self.rate_limit_rad_s && acceleration * rate > 0.0;
        [
            rate.clamp(-self.rate_limit_rad_s, self.rate_limit_rad_s),
            if saturated { 0.0 } else { acceleration },
        ]
    }

    /// Angle of the front wheels, rad, for a handwheel angle.
    #[must_use]
    pub fn road_wheel_rad(&self, handwheel_rad: f64) -> f64 {
        handwheel_rad * self.inverse_ratio
    }
}
