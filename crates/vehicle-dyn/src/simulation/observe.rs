//! From the state to what is measured.

use nalgebra::Vector3;

use super::dynamics::HeldInput;
use super::{Observation, Simulation};
use crate::chassis::sum_corners;
use crate::metrics;

/// Speed below which the sideslip angle is reported as zero, m/s.
const SIDESLIP_SPEED_M_S: f64 = 1.0;

impl Simulation {
    /// Measured state at this instant.
    #[must_use]
    pub fn observation(&self) -> Observation {
        let (state, dynamics) = (&self.state, &self.dynamics);
        // Contacts follow from the state alone, so any input will do.
        let input = HeldInput::AT_REST;
        let (_, contacts) = dynamics.rates(state, &input, &self.terrain);
        let rotation = state.rotation();
        let (position, velocity) = self.centre_of_gravity();
        let level = (rotation[(0, 0)].powi(2) + rotation[(1, 0)].powi(2)).sqrt();
        let heading = if level > 0.0 {
            Vector3::new(rotation[(0, 0)] / level, rotation[(1, 0)] / level, 0.0)
        } else {
            Vector3::x()
        };
        let left = Vector3::new(-heading.y, heading.x, 0.0);
        let (speed, lateral_speed) = (velocity.dot(&heading), velocity.dot(&left));
        let sideslip = if speed.hypot(lateral_speed) > SIDESLIP_SPEED_M_S {
            lateral_speed.atan2(speed)
        } else {
            0.0
        };
        let drag = state.velocity_m_s * (-dynamics.drag_kg_per_m * state.velocity_m_s.norm());
        let ground = sum_corners(&contacts.map(|contact| contact.force_n));
        let acceleration = (rotation * ground + drag) / dynamics.total_mass_kg;
        let loads = contacts.map(|contact| contact.load_n);
        Observation {
            time_s: self.time_s(),
            x_m: position.x,
            y_m: position.y,
            z_m: position.z,
            yaw_rad: self.yaw_rad,
            roll_rad: rotation[(2, 1)].atan2(rotation[(2, 2)]),
            pitch_rad: (-rotation[(2, 0)]).atan2(level),
            speed_m_s: speed,
            lateral_speed_m_s: lateral_speed,
            sideslip_rad: sideslip,
            yaw_rate_rad_s: (rotation * state.angular_rad_s).z,
            roll_rate_rad_s: state.angular_rad_s.x,
            lateral_acceleration_m_s2: acceleration.dot(&left),
            longitudinal_acceleration_m_s2: acceleration.dot(&heading),
            handwheel_actual_rad: state.steering[0],
            road_wheel_rad: dynamics.steering.road_wheel_rad(state.steering[0]),
            wheel_loads_n: loads,
            wheel_travel_m: state.travel_m,
            wheel_clearance_m: contacts.map(|contact| contact.clearance_m),
            wheel_spin_rad_s: state.spin_rad_s,
            ltr: metrics::load_transfer_ratio(&loads, dynamics.total_mass_kg),
            ltr_of_sum: metrics::load_transfer_of_sum(&loads),
        }
    }

    /// Position (m) and velocity (m/s) of the whole vehicle's CG in world axes.
    pub(super) fn centre_of_gravity(&self) -> (Vector3<f64>, Vector3<f64>) {
        let (state, dynamics) = (&self.state, &self.dynamics);
        let rotation = state.rotation();
        let weighted = [0, 1, 2, 3].map(|i| self.hub_m(i) * dynamics.unsprung_kg[i]);
        let rates = [0, 1, 2, 3].map(|i| {
            let rate = state.travel_rate_m_s[i] * dynamics.unsprung_kg[i];
            state.angular_rad_s.cross(&weighted[i]) + Vector3::new(0.0, 0.0, rate)
        });
        let inverse_mass = 1.0 / dynamics.total_mass_kg;
        (
            state.position_m + rotation * sum_corners(&weighted) * inverse_mass,
            state.velocity_m_s + rotation * sum_corners(&rates) * inverse_mass,
        )
    }

    /// Wheel centre `i` in body axes, m.
    pub(super) fn hub_m(&self, i: usize) -> Vector3<f64> {
        let mut hub = self.dynamics.hub_m[i];
        hub.z += self.state.travel_m[i];
        hub
    }
}
