//! Energy and momentum of the vehicle: what conservation checks need.

use nalgebra::Vector3;
use serde::Serialize;

use super::Simulation;
use super::dynamics::HeldInput;
use crate::wheels::spin_axis;

/// Mechanical energy of the vehicle, J.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Energy {
    /// Of body, unsprung masses and spinning wheels.
    pub kinetic_j: f64,
    /// In gravity, from the world's origin.
    pub gravitational_j: f64,
    /// In springs, stops, anti-roll bars and tyres; the preload's work is counted from the design
    /// height, so it can be negative.
    pub elastic_j: f64,
}

impl Energy {
    /// The sum, J.
    #[must_use]
    pub fn total_j(&self) -> f64 {
        self.kinetic_j + self.gravitational_j + self.elastic_j
    }
}

/// Momentum of the vehicle in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Momentum {
    /// Linear, kg m/s.
    pub linear_kg_m_s: Vector3<f64>,
    /// Angular about the CG of the whole vehicle, kg m²/s.
    pub angular_kg_m2_s: Vector3<f64>,
}

impl Simulation {
    /// Mechanical energy at this instant.
    #[must_use]
    pub fn energy(&self) -> Energy {
        let (state, dynamics) = (&self.state, &self.dynamics);
        let rotation = state.rotation();
        let body_velocity = rotation.transpose() * state.velocity_m_s;
        let inertia = &dynamics.body.inertia_kg_m2;
        let omega = state.angular_rad_s;
        let mut kinetic = 0.5 * dynamics.body.mass_kg * body_velocity.norm_squared()
            + 0.5 * omega.dot(&(inertia * omega));
        let gravity = dynamics.gravity_m_s2;
        let mut gravitational = -dynamics.body.mass_kg * gravity.dot(&state.position_m);
        let input = HeldInput::AT_REST;
        let (_, contacts) = dynamics.rates(state, &input, &self.terrain);
        let mut elastic = 0.0;
        for (i, contact) in contacts.iter().enumerate() {
            let hub = self.hub_m(i);
            let mut velocity = body_velocity + omega.cross(&hub);
            velocity.z += state.travel_rate_m_s[i];
            let wheel = &dynamics.wheels[i];
            kinetic += 0.5 * dynamics.unsprung_kg[i] * velocity.norm_squared()
                + 0.5 / wheel.inverse_spin_inertia * state.spin_rad_s[i].powi(2);
            gravitational -=
                dynamics.unsprung_kg[i] * gravity.dot(&(state.position_m + rotation * hub));
            elastic += contact.elastic_j;
        }
        for (axle, wheels) in dynamics.axles.iter().zip([[0, 1], [2, 3]]) {
            elastic += axle.energy_j(wheels.map(|i: usize| state.travel_m[i]));
        }
        Energy {
            kinetic_j: kinetic,
            gravitational_j: gravitational,
            elastic_j: elastic,
        }
    }

    /// Linear and angular momentum at this instant.
    #[must_use]
    pub fn momentum(&self) -> Momentum {
        let (state, dynamics) = (&self.state, &self.dynamics);
        let rotation = state.rotation();
        let to_body = rotation.transpose();
        let (centre, centre_velocity) = self.centre_of_gravity();
        let body_arm = to_body * (state.position_m - centre);
        let body_velocity = to_body * (state.velocity_m_s - centre_velocity);
        let omega = state.angular_rad_s;
        let mut angular = dynamics.body.inertia_kg_m2 * omega
            + body_arm.cross(&body_velocity) * dynamics.body.mass_kg;
        let steer: [f64; 2] = dynamics
            .steering
            .road_wheel_rad(state.steering[0])
            .sin_cos()
            .into();
        for i in 0..4 {
            let hub = self.hub_m(i);
            let mut velocity = body_velocity + omega.cross(&hub);
            velocity.z += state.travel_rate_m_s[i];
            angular += (body_arm + hub).cross(&velocity) * dynamics.unsprung_kg[i];
            let axle = 2 * (i / 2);
            let travel = [state.travel_m[axle], state.travel_m[axle + 1]];
            let lean = dynamics.axles[i / 2].guidance.lean(travel)[i % 2];
            let [axis, ..] = spin_axis(if i < 2 { steer } else { [0.0, 1.0] }, lean);
            angular += axis * (dynamics.wheels[i].gyroscopic_inertia * state.spin_rad_s[i]);
        }
        Momentum {
            linear_kg_m_s: centre_velocity * dynamics.total_mass_kg,
            angular_kg_m2_s: rotation * angular,
        }
    }
}
