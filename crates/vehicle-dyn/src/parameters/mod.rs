//! A vehicle as data: the structures behind `vehicles/*.toml`.
//!
//! Every key carries its unit, unknown keys are refused, and every value is held against its
//! allowed range before a simulation may use it. Lengths refer to the vehicle standing at rest
//! at its design height. Axes are ISO 8855: x forward, y left, z up.

mod check;
mod derived;
mod error;
mod read;
pub mod schema;

pub use check::{Field, Interval, fields};
pub use derived::{CorneringFigures, DerivedFigures, Figure, Mode, NaturalModes};
pub use error::ParameterError;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::driver::DriverParameters;

/// One vehicle, as read from a TOML file. See `vehicles/README.md` for every field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VehicleParameters {
    /// Short name for logs and tables; no code depends on it.
    pub name: String,
    /// One sentence about what the vehicle is.
    pub description: String,
    /// Masses and inertias.
    pub mass: MassParameters,
    /// Axle positions, tracks and roll centres.
    pub geometry: GeometryParameters,
    /// Springs, dampers, stops, anti-roll bars and camber.
    pub suspension: SuspensionParameters,
    /// Tyre forces and vertical stiffness.
    pub tyre: TyreParameters,
    /// Rotational inertias of the wheels.
    pub wheel: WheelParameters,
    /// Steering ratio and actuator.
    pub steering: SteeringParameters,
    /// Engine, brakes and the low-level speed controller.
    pub powertrain: PowertrainParameters,
    /// Aerodynamic drag.
    pub aerodynamics: AerodynamicParameters,
    /// A driver who suits the vehicle: taken where a scenario names none, and where a command swaps
    /// the scenario's vehicle for this one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driver: Option<DriverParameters>,
}

/// Masses and inertias of the sprung body and the wheel assemblies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MassParameters {
    /// Mass carried by the springs, load included, kg.
    pub sprung_mass_kg: f64,
    /// Mass of one front wheel assembly (of a solid axle half the axle), kg. With its springs it must
    /// not hop faster than the 1 ms integration step follows (1000 1/s).
    pub unsprung_mass_front_each_kg: f64,
    /// Mass of one rear wheel assembly (of a solid axle half the axle), kg.
    pub unsprung_mass_rear_each_kg: f64,
    /// Roll inertia of the sprung mass about its own centre of gravity, kg m².
    pub sprung_roll_inertia_kg_m2: f64,
    /// Pitch inertia of the sprung mass about its own centre of gravity, kg m².
    pub sprung_pitch_inertia_kg_m2: f64,
    /// Yaw inertia of the sprung mass alone about its own centre of gravity, kg m². Published values
    /// are often the whole vehicle's: subtract mass times distance² of the wheels.
    pub sprung_yaw_inertia_kg_m2: f64,
    /// Product of inertia ∫ x z dm of the sprung mass with z up (z down changes its sign), kg m².
    pub sprung_roll_yaw_product_kg_m2: f64,
    /// Height of the centre of gravity of the sprung mass above the ground at rest, m.
    pub sprung_cg_height_m: f64,
}

/// Axle positions, tracks and roll centres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GeometryParameters {
    /// Distance from the centre of gravity of the sprung mass to the front axle, m.
    pub sprung_cg_to_front_axle_m: f64,
    /// Distance from the centre of gravity of the sprung mass to the rear axle, m; positive, too.
    pub sprung_cg_to_rear_axle_m: f64,
    /// Distance between the centres of the front wheels, m.
    pub track_front_m: f64,
    /// Distance between the centres of the rear wheels (of twin tyres between their middles), m.
    pub track_rear_m: f64,
    /// Height of the front roll centre above the ground at rest, m.
    pub roll_centre_height_front_m: f64,
    /// Height of the rear roll centre above the ground at rest, m.
    pub roll_centre_height_rear_m: f64,
}

/// Suspension of both axles. Rates of independent wheels act at the wheel centre, motion ratios
/// included; those of a solid axle act where its own table says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuspensionParameters {
    /// Rate of one front spring at the wheel, or at the spring of a solid axle, N/m.
    pub spring_rate_front_n_per_m: f64,
    /// Rate of one rear spring at the wheel, or at the spring of a solid axle, N/m.
    pub spring_rate_rear_n_per_m: f64,
    /// Front damping while the wheel moves towards the body, of one wheel, or at one damper of a
    /// solid axle, N s/m.
    pub damping_bump_front_n_s_per_m: f64,
    /// Front damping while the wheel moves away from the body, N s/m.
    pub damping_rebound_front_n_s_per_m: f64,
    /// Rear damping while the wheel moves towards the body, N s/m.
    pub damping_bump_rear_n_s_per_m: f64,
    /// Rear damping while the wheel moves away from the body, N s/m.
    pub damping_rebound_rear_n_s_per_m: f64,
    /// Roll stiffness of the front anti-roll bar ("auxiliary roll stiffness"), N m per rad of the body
    /// against the axle. Negative only for a solid axle without a table of its own, whose springs
    /// stand closer than the wheels.
    pub anti_roll_front_nm_per_rad: f64,
    /// Roll stiffness of the rear anti-roll bar, N m per rad.
    pub anti_roll_rear_nm_per_rad: f64,
    /// Wheel travel from the design height to the stop, in both directions, m.
    pub travel_m: f64,
    /// Linear rate of the stops beyond `travel_m`, N/m.
    pub bump_stop_n_per_m: f64,
    /// Progressive rate of the stops beyond `travel_m`, N/m².
    pub bump_stop_n_per_m2: f64,
    /// Lean of a front wheel's top towards the vehicle per metre of bump, rad/m; 0 on a solid axle.
    pub camber_gain_front_rad_per_m: f64,
    /// Lean of a rear wheel's top towards the vehicle per metre of bump, rad/m; 0 on a solid axle.
    pub camber_gain_rear_rad_per_m: f64,
    /// Present when the front wheels share a solid axle. Springs and dampers of that axle then act
    /// where it says, not at the wheels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_axle_front: Option<SolidAxleParameters>,
    /// Present when the rear wheels share a solid axle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid_axle_rear: Option<SolidAxleParameters>,
}

/// Where the springs and dampers of a solid axle stand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidAxleParameters {
    /// Distance between the left and the right spring, m.
    pub spring_spacing_m: f64,
    /// Distance between the left and the right damper, m.
    pub damper_spacing_m: f64,
}

/// Tyres: the paper's combined-slip Magic Formula (eq. magic) with its constants as data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TyreParameters {
    /// Radius of the unloaded tyre, m.
    pub unloaded_radius_m: f64,
    /// Radial stiffness of one front wheel's tyre, N/m.
    pub vertical_stiffness_front_n_per_m: f64,
    /// Radial stiffness of one rear wheel's tyre, of twin tyres both together, N/m.
    pub vertical_stiffness_rear_n_per_m: f64,
    /// Distance between the middles of twin tyres on one rear wheel, m; 0 is a single tyre.
    /// Stiffness, damping and the force law are those of both tyres together.
    pub twin_spacing_rear_m: f64,
    /// Radius of the tread across the wheel, m: 0 is a thin disc, which stands on its edge when it
    /// leans; at `unloaded_radius_m` the contact stays under the wheel centre. Car tyres are nearer
    /// to the latter.
    pub crown_radius_m: f64,
    /// Sideways motion of the contact patch against the wheel per lateral force of one wheel, m/N;
    /// 0 is rigid. It narrows the stand of a cornering vehicle.
    pub lateral_compliance_m_per_n: f64,
    /// Radial damping of one wheel's tyre, N s/m.
    pub vertical_damping_n_s_per_m: f64,
    /// Peak friction of the tyre on a road of friction 1, at the load m g/4 (no unit). The road
    /// multiplies it, `D1 = mu_tyre · mu_road`: do not put the road's friction in here as well.
    pub mu_tyre: f64,
    /// Stiffness factor `B1` of the front tyres (no unit): `B1 · C1 · D1` is cornering stiffness over
    /// load at m g/4.
    pub stiffness_factor_b1_front: f64,
    /// Stiffness factor `B1` of the rear tyres (no unit).
    pub stiffness_factor_b1_rear: f64,
    /// Shape factor `C1` (no unit).
    pub shape_factor_c1: f64,
    /// Curvature factor `E1` (no unit).
    pub curvature_factor_e1: f64,
    /// Saturation `c2` of the cornering stiffness with load (no unit); 0 is proportional to load.
    pub stiffness_saturation_c2: f64,
    /// Loss of friction with load (no unit): at twice m g/4 friction is 0.740 · D1 for 1.5 (the paper),
    /// 0.875 for 1.1, 0.947 for 0.8, all of it for 0.
    pub q_load: f64,
    /// Side slip that one rad of camber is worth: camber stiffness over cornering stiffness (no
    /// unit). Positive pushes towards the side the wheel leans to, as real tyres do.
    pub camber_thrust_ratio: f64,
    /// Relaxation length of the lateral slip, m.
    pub relaxation_length_lateral_m: f64,
    /// Relaxation length of the longitudinal slip, m.
    pub relaxation_length_longitudinal_m: f64,
    /// Rolling resistance over vertical load (no unit).
    pub rolling_resistance_coefficient: f64,
}

/// Rotational inertias of the wheels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WheelParameters {
    /// Inertia that resists spinning up one front wheel, driveline included, kg m².
    pub spin_inertia_front_kg_m2: f64,
    /// Inertia that resists spinning up one rear wheel, driveline included, kg m².
    pub spin_inertia_rear_kg_m2: f64,
    /// Inertia of one bare front wheel: what gyrates, kg m².
    pub gyroscopic_inertia_front_kg_m2: f64,
    /// Inertia of one bare rear wheel: what gyrates, kg m².
    pub gyroscopic_inertia_rear_kg_m2: f64,
}

/// Steering system: both front wheels turn by the handwheel angle over the ratio.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteeringParameters {
    /// Handwheel angle over road-wheel angle (no unit).
    pub ratio: f64,
    /// Natural frequency of the second-order actuator, Hz.
    pub bandwidth_hz: f64,
    /// Damping ratio of the actuator (no unit).
    pub damping_ratio: f64,
    /// Limit of the handwheel rate, deg/s.
    pub handwheel_rate_limit_deg_per_s: f64,
    /// Limit of the handwheel angle, deg.
    pub handwheel_limit_deg: f64,
}

/// Engine, brakes and the controller that holds the target speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowertrainParameters {
    /// Largest engine power at the wheels, W.
    pub max_power_w: f64,
    /// Largest drive force at low speed, N.
    pub max_drive_force_n: f64,
    /// Share of the drive force at the front axle, 0 is rear-wheel drive (no unit).
    pub drive_share_front: f64,
    /// Time constant of the drive force, s.
    pub engine_lag_s: f64,
    /// Torque per difference in wheel speed between left and right driven wheel, N m s/rad;
    /// 0 is an open differential.
    pub differential_coupling_nm_s_per_rad: f64,
    /// Largest brake force of all wheels together, N.
    pub max_brake_force_n: f64,
    /// Share of the brake force at the front axle (no unit).
    pub brake_share_front: f64,
    /// Time constant of the brake force, s.
    pub brake_lag_s: f64,
    /// Acceleration asked per speed error, (m/s²)/(m/s).
    pub speed_gain_per_s: f64,
    /// Growth of the asked acceleration per speed error, (m/s²)/m.
    pub speed_integral_gain_per_s2: f64,
}

/// Aerodynamic drag, against the velocity, applied at the centre of gravity of the sprung mass.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AerodynamicParameters {
    /// Drag coefficient times frontal area, m².
    pub drag_area_m2: f64,
    /// Density of the air, kg/m³.
    pub air_density_kg_per_m3: f64,
}
