//! Right-hand side of the equations of motion.

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::LongitudinalDemand;
use super::state::{State, StateRate};
use crate::chassis::{HubLoad, SprungBody, sum_corners};
use crate::parameters::VehicleParameters;
use crate::powertrain::Powertrain;
use crate::steering::SteeringActuator;
use crate::suspension::{AxleSuspension, Guidance, Pair};
use crate::terrain::Terrain;
use crate::tyre::{MagicFormula, RadialSpring};
use crate::units::GRAVITY_M_S2;
use crate::wheels::{Contact, Wheel, WheelMotion, spin_axis};

/// Sign of the side of each wheel: left is positive y.
const SIDE: [f64; 4] = [1.0, -1.0, 1.0, -1.0];

/// Inputs held over a control tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HeldInput {
    /// Handwheel command within its end stops, rad.
    pub handwheel_rad: f64,
    /// What engine and brakes are asked for.
    pub longitudinal: LongitudinalDemand,
}

impl HeldInput {
    /// Straight ahead with released pedals.
    pub const AT_REST: Self = Self {
        handwheel_rad: 0.0,
        longitudinal: LongitudinalDemand::Released,
    };
}

/// The vehicle with every constant computed once. All fields are fixed after construction.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Dynamics {
    pub body: SprungBody,
    pub unsprung_kg: [f64; 4],
    /// Wheel centres at the design height in body axes, m.
    pub hub_m: [Vector3<f64>; 4],
    pub axles: [AxleSuspension; 2],
    pub wheels: [Wheel; 4],
    pub steering: SteeringActuator,
    pub powertrain: Powertrain,
    /// Rolling radius at rest, which turns drive and brake forces into torques, m.
    pub nominal_radius_m: [f64; 2],
    /// Half the air density times the drag area, kg/m.
    pub drag_kg_per_m: f64,
    pub total_mass_kg: f64,
    pub gravity_m_s2: Vector3<f64>,
}

/// What all four wheels share at an instant.
struct Frame {
    /// Body to world.
    rotation: Matrix3<f64>,
    /// World to body.
    to_body: Matrix3<f64>,
    /// Velocity of the sprung CG in body axes, m/s.
    velocity_m_s: Vector3<f64>,
    /// Sine and cosine of the front wheels' angle.
    steer: [f64; 2],
    /// Rate of that angle, rad/s.
    steer_rate_rad_s: f64,
}

/// How the links move the two wheels of an axle.
struct AxleMotion {
    /// Tangents of the leans.
    lean: Pair,
    lean_rate_per_s: Pair,
    scrub_m_s: Pair,
}

impl AxleMotion {
    #[inline]
    fn new(suspension: &AxleSuspension, state: &State, axle: usize) -> Self {
        let pair = |of: &[f64; 4]| [of[2 * axle], of[2 * axle + 1]];
        let (travel, rate) = (pair(&state.travel_m), pair(&state.travel_rate_m_s));
        Self {
            lean: suspension.guidance.lean(travel),
            lean_rate_per_s: suspension.guidance.lean(rate),
            scrub_m_s: suspension.guidance.scrub_m_s(rate),
        }
    }
}

/// One wheel in body axes.
struct Corner {
    hub_m: Vector3<f64>,
    /// Spin axis, pointing left, and its rate, 1/s.
    axis: Vector3<f64>,
    axis_rate: Vector3<f64>,
    contact: Contact,
}

impl Dynamics {
    /// Prepares a checked vehicle.
    pub fn new(vehicle: &VehicleParameters) -> Self {
        let figures = vehicle.derived();
        let (mass, geometry, tyre) = (&vehicle.mass, &vehicle.geometry, &vehicle.tyre);
        let weight = figures.total_mass_kg * GRAVITY_M_S2;
        let (front, rear) = (
            geometry.sprung_cg_to_front_axle_m,
            geometry.sprung_cg_to_rear_axle_m,
        );
        let static_load = [figures.static_load_front_n, figures.static_load_rear_n];
        let radial = [
            tyre.vertical_stiffness_front_n_per_m,
            tyre.vertical_stiffness_rear_n_per_m,
        ];
        let deflection = [static_load[0] / radial[0], static_load[1] / radial[1]];
        let b1 = [
            tyre.stiffness_factor_b1_front,
            tyre.stiffness_factor_b1_rear,
        ];
        let wheel_inertia = [
            (
                vehicle.wheel.spin_inertia_front_kg_m2,
                vehicle.wheel.gyroscopic_inertia_front_kg_m2,
            ),
            (
                vehicle.wheel.spin_inertia_rear_kg_m2,
                vehicle.wheel.gyroscopic_inertia_rear_kg_m2,
            ),
        ];
        let wheel = |axle: usize| Wheel {
            formula: MagicFormula::new(tyre, b1[axle], weight),
            radial: RadialSpring {
                stiffness_n_per_m: radial[axle],
                damping_n_s_per_m: tyre.vertical_damping_n_s_per_m,
            },
            radius_m: tyre.unloaded_radius_m,
            crown_radius_m: tyre.crown_radius_m,
            half_twin_spacing_m: if axle == 0 {
                0.0
            } else {
                0.5 * tyre.twin_spacing_rear_m
            },
            lateral_compliance_m_per_n: tyre.lateral_compliance_m_per_n,
            camber_thrust_ratio: tyre.camber_thrust_ratio,
            inverse_relaxation: [
                1.0 / tyre.relaxation_length_longitudinal_m,
                1.0 / tyre.relaxation_length_lateral_m,
            ],
            rolling_resistance: tyre.rolling_resistance_coefficient,
            inverse_spin_inertia: 1.0 / wheel_inertia[axle].0,
            gyroscopic_inertia: wheel_inertia[axle].1,
        };
        let tracks = [geometry.track_front_m, geometry.track_rear_m];
        let stations = [front, -rear];
        let hub = |i: usize| {
            let axle = i / 2;
            let height = tyre.unloaded_radius_m - deflection[axle];
            Vector3::new(
                stations[axle],
                0.5 * SIDE[i] * tracks[axle],
                height - mass.sprung_cg_height_m,
            )
        };
        let product = mass.sprung_roll_yaw_product_kg_m2;
        let unsprung = [
            mass.unsprung_mass_front_each_kg,
            mass.unsprung_mass_rear_each_kg,
        ];
        Self {
            body: SprungBody {
                mass_kg: mass.sprung_mass_kg,
                inertia_kg_m2: Matrix3::new(
                    mass.sprung_roll_inertia_kg_m2,
                    0.0,
                    -product,
                    0.0,
                    mass.sprung_pitch_inertia_kg_m2,
                    0.0,
                    -product,
                    0.0,
                    mass.sprung_yaw_inertia_kg_m2,
                ),
            },
            unsprung_kg: [unsprung[0], unsprung[0], unsprung[1], unsprung[1]],
            hub_m: [0, 1, 2, 3].map(hub),
            axles: [0, 1].map(|axle| axle_suspension(vehicle, axle, static_load[axle])),
            wheels: [0, 1, 2, 3].map(|i| wheel(i / 2)),
            steering: SteeringActuator::new(&vehicle.steering),
            powertrain: Powertrain::new(&vehicle.powertrain, figures.total_mass_kg),
            nominal_radius_m: deflection.map(|rho| tyre.unloaded_radius_m - rho / 3.0),
            drag_kg_per_m: 0.5
                * vehicle.aerodynamics.air_density_kg_per_m3
                * vehicle.aerodynamics.drag_area_m2,
            total_mass_kg: figures.total_mass_kg,
            gravity_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2),
        }
    }

    /// Rate of the state and the contacts of the four wheels.
    pub fn rates(
        &self,
        state: &State,
        input: &HeldInput,
        terrain: &Terrain,
    ) -> (StateRate, [Contact; 4]) {
        let rotation = state.rotation();
        let steering_rates = self.steering.rates(state.steering, input.handwheel_rad);
        let frame = Frame {
            rotation,
            to_body: rotation.transpose(),
            velocity_m_s: rotation.transpose() * state.velocity_m_s,
            steer: self
                .steering
                .road_wheel_rad(state.steering[0])
                .sin_cos()
                .into(),
            steer_rate_rad_s: self.steering.road_wheel_rad(steering_rates[0]),
        };
        let omega = state.angular_rad_s;
        let [front, rear] = [0, 1].map(|axle| AxleMotion::new(&self.axles[axle], state, axle));
        let corner = |i: usize, axle: &AxleMotion| self.corner(i, state, &frame, axle, terrain);
        let corners = [
            corner(0, &front),
            corner(1, &front),
            corner(2, &rear),
            corner(3, &rear),
        ];
        let contacts = [
            corners[0].contact,
            corners[1].contact,
            corners[2].contact,
            corners[3].contact,
        ];

        let spin_rates = self.spin_rates(state, &contacts);
        let struts = self.struts(state, &contacts);
        let hub_load = |i: usize| HubLoad {
            mass_kg: self.unsprung_kg[i],
            position_m: corners[i].hub_m,
            rate_m_s: state.travel_rate_m_s[i],
            contact_force_n: contacts[i].force_n,
            contact_moment_nm: contacts[i].moment_nm,
            strut_n: struts[i],
        };
        let hubs = [hub_load(0), hub_load(1), hub_load(2), hub_load(3)];
        // What changes the wheels' angular momentum is taken from the body: torques between the
        // two are internal.
        let spin_moment = |i: usize| {
            (corners[i].axis * spin_rates[i] + corners[i].axis_rate * state.spin_rad_s[i])
                * -self.wheels[i].gyroscopic_inertia
        };
        let spin_moments = [
            spin_moment(0),
            spin_moment(1),
            spin_moment(2),
            spin_moment(3),
        ];
        let drag = frame.velocity_m_s * (-self.drag_kg_per_m * frame.velocity_m_s.norm());
        let gravity = frame.to_body * self.gravity_m_s2;
        let acceleration =
            self.body
                .accelerate(omega, gravity, &hubs, drag, sum_corners(&spin_moments));

        let forward_speed = forward_speed_m_s(&rotation, &state.velocity_m_s);
        let rate = StateRate {
            position_m: state.velocity_m_s,
            orientation: state.orientation * Quaternion::from_imag(omega * 0.5),
            velocity_m_s: rotation * acceleration.linear_m_s2,
            angular_rad_s: acceleration.angular_rad_s2,
            travel_m: state.travel_rate_m_s,
            travel_rate_m_s: acceleration.hubs_m_s2,
            spin_rad_s: spin_rates,
            slip: [
                contacts[0].slip_rate,
                contacts[1].slip_rate,
                contacts[2].slip_rate,
                contacts[3].slip_rate,
            ],
            steering: steering_rates,
            powertrain: self
                .powertrain
                .rates(&state.powertrain, forward_speed, input.longitudinal),
        };
        (rate, contacts)
    }

    /// Motion of wheel `i` and what the ground does to it.
    #[inline]
    fn corner(
        &self,
        i: usize,
        state: &State,
        frame: &Frame,
        axle: &AxleMotion,
        terrain: &Terrain,
    ) -> Corner {
        let omega = state.angular_rad_s;
        let mut hub = self.hub_m[i];
        hub.z += state.travel_m[i];
        let (steer, steer_rate) = if i < 2 {
            (frame.steer, frame.steer_rate_rad_s)
        } else {
            ([0.0, 1.0], 0.0)
        };
        let [axis, by_steer, by_lean] = spin_axis(steer, axle.lean[i % 2]);
        let lean_rate = axle.lean_rate_per_s[i % 2];
        let mut hub_velocity = frame.velocity_m_s + omega.cross(&hub);
        hub_velocity.z += state.travel_rate_m_s[i];

        let world = state.position_m + frame.rotation * hub;
        let ground = terrain.ground(world.x, world.y);
        let normal = ground.normal();
        let motion = WheelMotion {
            axis,
            velocity_m_s: hub_velocity,
            angular_rad_s: omega,
            lean_rate_per_s: lean_rate,
            turn_per_lean: axis.cross(&by_lean),
            scrub_m_s: axle.scrub_m_s[i % 2],
            height_m: (world.z - ground.height_m) * normal.z,
            normal: frame.to_body * normal,
            spin_rad_s: state.spin_rad_s[i],
            slip: state.slip[i],
        };
        Corner {
            hub_m: hub,
            axis,
            axis_rate: omega.cross(&axis) + by_steer * steer_rate + by_lean * lean_rate,
            contact: self.wheels[i].contact(&motion, &ground),
        }
    }

    fn spin_rates(&self, state: &State, contacts: &[Contact; 4]) -> [f64; 4] {
        let mut rates = [0.0; 4];
        for axle in 0..2 {
            let (left, right) = (2 * axle, 2 * axle + 1);
            let torques = self.powertrain.axle_torques_nm(
                axle,
                &state.powertrain,
                [state.spin_rad_s[left], state.spin_rad_s[right]],
                self.nominal_radius_m[axle],
            );
            for (wheel, torque) in [left, right].into_iter().zip(torques) {
                rates[wheel] = (torque + contacts[wheel].spin_moment_nm)
                    * self.wheels[wheel].inverse_spin_inertia;
            }
        }
        rates
    }

    fn struts(&self, state: &State, contacts: &[Contact; 4]) -> [f64; 4] {
        let axle = |axle: usize| {
            let (left, right) = (2 * axle, 2 * axle + 1);
            let forces = self.axles[axle].forces_n(
                [state.travel_m[left], state.travel_m[right]],
                [state.travel_rate_m_s[left], state.travel_rate_m_s[right]],
                [
                    contacts[left].tangential_n.y,
                    contacts[right].tangential_n.y,
                ],
            );
            let lean = self.axles[axle].guidance.lean_forces_n([
                contacts[left].lean_moment_nm,
                contacts[right].lean_moment_nm,
            ]);
            [forces[0] - lean[0], forces[1] - lean[1]]
        };
        let ([front_left, front_right], [rear_left, rear_right]) = (axle(0), axle(1));
        [front_left, front_right, rear_left, rear_right]
    }
}

/// Speed along the horizontal direction in which the vehicle points, m/s.
pub(crate) fn forward_speed_m_s(rotation: &Matrix3<f64>, velocity: &Vector3<f64>) -> f64 {
    let (x, y) = (rotation[(0, 0)], rotation[(1, 0)]);
    (x * velocity.x + y * velocity.y) / (x * x + y * y).sqrt().max(f64::MIN_POSITIVE)
}

fn axle_suspension(vehicle: &VehicleParameters, axle: usize, static_load_n: f64) -> AxleSuspension {
    let suspension = &vehicle.suspension;
    let geometry = &vehicle.geometry;
    let pick = |front: f64, rear: f64| if axle == 0 { front } else { rear };
    let track = pick(geometry.track_front_m, geometry.track_rear_m);
    let unsprung = pick(
        vehicle.mass.unsprung_mass_front_each_kg,
        vehicle.mass.unsprung_mass_rear_each_kg,
    );
    let anti_roll = pick(
        suspension.anti_roll_front_nm_per_rad,
        suspension.anti_roll_rear_nm_per_rad,
    );
    let roll_centre = pick(
        geometry.roll_centre_height_front_m,
        geometry.roll_centre_height_rear_m,
    );
    let solid = if axle == 0 {
        &suspension.solid_axle_front
    } else {
        &suspension.solid_axle_rear
    };
    let guidance = match solid {
        None => Guidance::Independent {
            jacking_slope: roll_centre / (0.5 * track),
            camber_gain_rad_per_m: pick(
                suspension.camber_gain_front_rad_per_m,
                suspension.camber_gain_rear_rad_per_m,
            ),
        },
        Some(solid) => Guidance::Solid {
            jacking_slope: roll_centre / track,
            inverse_track_per_m: 1.0 / track,
            spring_share: solid.spring_spacing_m / track,
            damper_share: solid.damper_spacing_m / track,
        },
    };
    AxleSuspension {
        preload_n: static_load_n - unsprung * GRAVITY_M_S2,
        spring_n_per_m: pick(
            suspension.spring_rate_front_n_per_m,
            suspension.spring_rate_rear_n_per_m,
        ),
        bump_n_s_per_m: pick(
            suspension.damping_bump_front_n_s_per_m,
            suspension.damping_bump_rear_n_s_per_m,
        ),
        rebound_n_s_per_m: pick(
            suspension.damping_rebound_front_n_s_per_m,
            suspension.damping_rebound_rear_n_s_per_m,
        ),
        anti_roll_n_per_m: anti_roll / (track * track),
        travel_m: suspension.travel_m,
        stop_n_per_m: suspension.bump_stop_n_per_m,
        stop_n_per_m2: suspension.bump_stop_n_per_m2,
        guidance,
    }
}

#[cfg(test)]
mod tests;
