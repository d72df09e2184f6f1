//! The state of the vehicle: 14 degrees of freedom and the lags.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::powertrain::PowertrainState;

/// State of the vehicle. Wheels are ordered front left, front right, rear left, rear right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position of the sprung CG in world axes, m.
    pub position_m: Vector3<f64>,
    /// Orientation, body to world; kept at unit length.
    pub orientation: Quaternion<f64>,
    /// Velocity of the sprung CG in world axes, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular rate in body axes, rad/s.
    pub angular_rad_s: Vector3<f64>,
    /// Wheel travel along body z from the design height, bump positive, m.
    pub travel_m: [f64; 4],
    /// Rate of the wheel travel, m/s.
    pub travel_rate_m_s: [f64; 4],
    /// Wheel spin about the wheel axis, rad/s.
    pub spin_rad_s: [f64; 4],
    /// Relaxed slip `[s_x, s_y]` of each tyre (no unit).
    pub slip: [[f64; 2]; 4],
    /// Handwheel angle (rad) and inner rate (rad/s) of the steering actuator.
    pub steering: [f64; 2],
    /// Drive and brake force and the integral of the speed controller.
    pub powertrain: PowertrainState,
}

/// Time derivative of [`State`], field by field.
pub(crate) type StateRate = State;

impl State {
    /// `self + rate · step`, without restoring the quaternion's length.
    #[must_use]
    #[inline]
    pub(crate) fn advanced(&self, rate: &StateRate, step: f64) -> Self {
        let along = |value: &[f64; 4], rate: &[f64; 4]| {
            [
                value[0] + step * rate[0],
                value[1] + step * rate[1],
                value[2] + step * rate[2],
                value[3] + step * rate[3],
            ]
        };
        let slip_along = |i: usize| {
            [
                self.slip[i][0] + step * rate.slip[i][0],
                self.slip[i][1] + step * rate.slip[i][1],
            ]
        };
        let powertrain = PowertrainState {
            drive_n: self.powertrain.drive_n + step * rate.powertrain.drive_n,
            brake_n: self.powertrain.brake_n + step * rate.powertrain.brake_n,
            integral_m_s2: self.powertrain.integral_m_s2 + step * rate.powertrain.integral_m_s2,
        };
        Self {
            position_m: self.position_m + rate.position_m * step,
            orientation: self.orientation + rate.orientation * step,
            velocity_m_s: self.velocity_m_s + rate.velocity_m_s * step,
            angular_rad_s: self.angular_rad_s + rate.angular_rad_s * step,
            travel_m: along(&self.travel_m, &rate.travel_m),
            travel_rate_m_s: along(&self.travel_rate_m_s, &rate.travel_rate_m_s),
            spin_rad_s: along(&self.spin_rad_s, &rate.spin_rad_s),
            slip: [slip_along(0), slip_along(1), slip_along(2), slip_along(3)],
            steering: [
                self.steering[0] + step * rate.steering[0],
                self.steering[1] + step * rate.steering[1],
            ],
            powertrain,
        }
    }

    /// Rotation matrix from body to world axes, also for a quaternion of inexact length.
    #[must_use]
    pub fn rotation(&self) -> Matrix3<f64> {
        let (w, v) = (self.orientation.w, self.orientation.imag());
        let scale = 2.0 / self.orientation.norm_squared();
        let (x, y, z) = (v.x, v.y, v.z);
        Matrix3::new(
            1.0 - scale * (y * y + z * z),
            scale * (x * y - w * z),
            scale * (x * z + w * y),
            scale * (x * y + w * z),
            1.0 - scale * (x * x + z * z),
            scale * (y * z - w * x),
            scale * (x * z - w * y),
            scale * (y * z + w * x),
            1.0 - scale * (x * x + y * y),
        )
    }

    /// Turns the orientation to ZYX angles: yaw about z, then pitch about y, then roll about x.
    pub fn set_angles(&mut self, roll_rad: f64, pitch_rad: f64, yaw_rad: f64) {
        self.orientation =
            UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad).into_inner();
    }

    /// Whether every number of the state is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let vectors = self.position_m.sum()
            + self.orientation.norm_squared()
            + self.velocity_m_s.sum()
            + self.angular_rad_s.sum();
        let wheels: f64 = (0..4)
            .map(|i| {
                self.travel_m[i]
                    + self.travel_rate_m_s[i]
                    + self.spin_rad_s[i]
                    + self.slip[i][0]
                    + self.slip[i][1]
            })
            .sum();
        let lags = self.steering[0]
            + self.steering[1]
            + self.powertrain.drive_n
            + self.powertrain.brake_n
            + self.powertrain.integral_m_s2;
        (vectors + wheels + lags).is_finite()
    }
}
