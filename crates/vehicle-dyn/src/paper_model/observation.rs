//! State of the paper's model and what is measured of it.

use serde::Serialize;

use super::PaperModel;
use super::equations::Instant;
use crate::metrics;
use crate::powertrain::PowertrainState;

/// State of the paper's model; also, with the same fields per second, its rate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PaperState {
    /// World x of the undercarriage, m.
    pub x_m: f64,
    /// World y of the undercarriage, m.
    pub y_m: f64,
    /// Heading, continuous over full turns, rad.
    pub yaw_rad: f64,
    /// `v_x`: forward speed of the undercarriage, m/s.
    pub forward_speed_m_s: f64,
    /// `v_y`: lateral speed of the undercarriage, m/s.
    pub lateral_speed_m_s: f64,
    /// `r`: yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
    /// `φ`: roll angle, rad.
    pub roll_rad: f64,
    /// `p`: roll rate, rad/s.
    pub roll_rate_rad_s: f64,
    /// Handwheel angle (rad) and inner rate (rad/s) of the steering actuator.
    pub steering: [f64; 2],
    /// Drive and brake force and the integral of the speed controller.
    pub powertrain: PowertrainState,
}

impl PaperState {
    /// Whether every number of the state is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let sum = self.x_m
            + self.y_m
            + self.yaw_rad
            + self.forward_speed_m_s
            + self.lateral_speed_m_s
            + self.yaw_rate_rad_s
            + self.roll_rad
            + self.roll_rate_rad_s
            + self.steering[0]
            + self.steering[1]
            + self.powertrain.drive_n
            + self.powertrain.brake_n
            + self.powertrain.integral_m_s2;
        sum.is_finite()
    }

    /// `self + rate · step`.
    pub(super) fn advanced(&self, rate: &Self, step: f64) -> Self {
        let (power, power_rate) = (&self.powertrain, &rate.powertrain);
        Self {
            x_m: self.x_m + step * rate.x_m,
            y_m: self.y_m + step * rate.y_m,
            yaw_rad: self.yaw_rad + step * rate.yaw_rad,
            forward_speed_m_s: self.forward_speed_m_s + step * rate.forward_speed_m_s,
            lateral_speed_m_s: self.lateral_speed_m_s + step * rate.lateral_speed_m_s,
            yaw_rate_rad_s: self.yaw_rate_rad_s + step * rate.yaw_rate_rad_s,
            roll_rad: self.roll_rad + step * rate.roll_rad,
            roll_rate_rad_s: self.roll_rate_rad_s + step * rate.roll_rate_rad_s,
            steering: [
                self.steering[0] + step * rate.steering[0],
                self.steering[1] + step * rate.steering[1],
            ],
            powertrain: PowertrainState {
                drive_n: power.drive_n + step * power_rate.drive_n,
                brake_n: power.brake_n + step * power_rate.brake_n,
                integral_m_s2: power.integral_m_s2 + step * power_rate.integral_m_s2,
            },
        }
    }
}

/// What is measured of the paper's model. Names and signs are those of
/// [`crate::simulation::Observation`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PaperObservation {
    /// Simulated time, s.
    pub time_s: f64,
    /// World x of the vehicle's centre of gravity, m.
    pub x_m: f64,
    /// World y of the vehicle's centre of gravity, m.
    pub y_m: f64,
    /// Heading, continuous over full turns, rad.
    pub yaw_rad: f64,
    /// Roll angle of the sprung mass, right side down, rad.
    pub roll_rad: f64,
    /// Velocity of the centre of gravity along the heading, m/s.
    pub speed_m_s: f64,
    /// Velocity of the centre of gravity across the heading, positive to the left, m/s.
    pub lateral_speed_m_s: f64,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
    /// Roll rate, rad/s.
    pub roll_rate_rad_s: f64,
    /// Lateral force of the tyres over mass, positive to the left, m/s².
    pub lateral_acceleration_m_s2: f64,
    /// Longitudinal force of tyres and drag over mass, m/s².
    pub longitudinal_acceleration_m_s2: f64,
    /// Angle of the handwheel behind the steering actuator, rad.
    pub handwheel_actual_rad: f64,
    /// Angle of the front wheels `δ_f`, rad.
    pub road_wheel_rad: f64,
    /// Computed load of each wheel, N: front left, front right, rear left, rear right. Negative where
    /// the wheel would have to be held to the ground.
    pub wheel_loads_n: [f64; 4],
    /// The paper's load transfer ratio, `(Fz,R − Fz,L)/(m g)` (no unit). Beyond ±1 it says how far the
    /// assumption is left, not what a vehicle would do.
    pub ltr: f64,
    /// Whether all loads are positive, as the equations assume.
    pub all_wheels_loaded: bool,
}

impl PaperModel {
    pub(super) fn observed(&self, now: &Instant) -> PaperObservation {
        let (state, constants) = (&self.state, &self.constants);
        let (sin, cos) = state.roll_rad.sin_cos();
        // The sprung mass carries the common centre of gravity to the low side.
        let arm_m = constants.roll_arm_m * constants.sprung_kg / constants.total_kg;
        let offset_m = -arm_m * sin;
        let (yaw_sin, yaw_cos) = state.yaw_rad.sin_cos();
        PaperObservation {
            time_s: self.time_s(),
            x_m: state.x_m - yaw_sin * offset_m,
            y_m: state.y_m + yaw_cos * offset_m,
            yaw_rad: state.yaw_rad,
            roll_rad: state.roll_rad,
            speed_m_s: state.forward_speed_m_s - state.yaw_rate_rad_s * offset_m,
            lateral_speed_m_s: state.lateral_speed_m_s - arm_m * cos * state.roll_rate_rad_s,
            yaw_rate_rad_s: state.yaw_rate_rad_s,
            roll_rate_rad_s: state.roll_rate_rad_s,
            lateral_acceleration_m_s2: now.lateral_n / constants.total_kg,
            longitudinal_acceleration_m_s2: now.longitudinal_n / constants.total_kg,
            handwheel_actual_rad: state.steering[0],
            road_wheel_rad: constants.steering.road_wheel_rad(state.steering[0]),
            wheel_loads_n: now.loads_n,
            ltr: metrics::load_transfer_ratio(&now.loads_n, constants.total_kg),
            all_wheels_loaded: now.all_loaded(),
        }
    }
}
