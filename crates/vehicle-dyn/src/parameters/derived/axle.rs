//! What the formulas for small motions need of one axle.

use nalgebra::Matrix3;

use crate::parameters::{DerivedFigures, SolidAxleParameters, VehicleParameters};
use crate::units::GRAVITY_M_S2;

/// One axle with both wheels, at rest.
///
/// Small motions that differ between left and right are described by the roll angle `φ` of the body
/// and, for each axle, the travel `d` of its left wheel; the right wheel has `−d`. A wheel then
/// leans against the ground by `γ = φ + λ d`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axle {
    /// Station ahead of the sprung centre of gravity, m.
    pub station_m: f64,
    pub half_track_m: f64,
    /// One wheel assembly, kg.
    pub unsprung_kg: f64,
    /// Load of one wheel at rest, N.
    pub load_n: f64,
    pub tyre_n_per_m: f64,
    pub tyre_n_s_per_m: f64,
    pub half_twin_spacing_m: f64,
    /// Spring rate per wheel travel when both wheels move together, then when they move against
    /// each other (anti-roll bar included), N/m.
    pub spring_n_per_m: [f64; 2],
    /// The same of the dampers, mean of bump and rebound, N s/m.
    pub damping_n_s_per_m: [f64; 2],
    /// Lean per travel `λ`, rad/m.
    pub lean_per_m: f64,
    /// Sideways motion of the contact point per travel (no unit).
    pub jacking_slope: f64,
    /// Height of the sprung centre of gravity above the wheel centres, m.
    pub drop_m: f64,
    /// Height of the wheel centre above the point about which it leans, m.
    pub lean_radius_m: f64,
    /// Angular momentum of one spinning wheel over the vehicle's speed, kg m.
    pub spin_kg_m: f64,
}

pub(super) fn axles(vehicle: &VehicleParameters, figures: &DerivedFigures) -> [Axle; 2] {
    let (mass, geometry) = (&vehicle.mass, &vehicle.geometry);
    let (suspension, tyre) = (&vehicle.suspension, &vehicle.tyre);
    let front = Side {
        station_m: geometry.sprung_cg_to_front_axle_m,
        track_m: geometry.track_front_m,
        unsprung_kg: mass.unsprung_mass_front_each_kg,
        load_n: figures.static_load_front_n,
        tyre_n_per_m: tyre.vertical_stiffness_front_n_per_m,
        twin_spacing_m: 0.0,
        spring_n_per_m: suspension.spring_rate_front_n_per_m,
        damping_n_s_per_m: suspension.damping_bump_front_n_s_per_m
            + suspension.damping_rebound_front_n_s_per_m,
        anti_roll_nm_per_rad: suspension.anti_roll_front_nm_per_rad,
        camber_gain_rad_per_m: suspension.camber_gain_front_rad_per_m,
        roll_centre_m: geometry.roll_centre_height_front_m,
        gyroscopic_kg_m2: vehicle.wheel.gyroscopic_inertia_front_kg_m2,
        solid: suspension.solid_axle_front.as_ref(),
    };
    let rear = Side {
        station_m: -geometry.sprung_cg_to_rear_axle_m,
        track_m: geometry.track_rear_m,
        unsprung_kg: mass.unsprung_mass_rear_each_kg,
        load_n: figures.static_load_rear_n,
        tyre_n_per_m: tyre.vertical_stiffness_rear_n_per_m,
        twin_spacing_m: tyre.twin_spacing_rear_m,
        spring_n_per_m: suspension.spring_rate_rear_n_per_m,
        damping_n_s_per_m: suspension.damping_bump_rear_n_s_per_m
            + suspension.damping_rebound_rear_n_s_per_m,
        anti_roll_nm_per_rad: suspension.anti_roll_rear_nm_per_rad,
        camber_gain_rad_per_m: suspension.camber_gain_rear_rad_per_m,
        roll_centre_m: geometry.roll_centre_height_rear_m,
        gyroscopic_kg_m2: vehicle.wheel.gyroscopic_inertia_rear_kg_m2,
        solid: suspension.solid_axle_rear.as_ref(),
    };
    [front.axle(vehicle), rear.axle(vehicle)]
}

/// The parameters of one axle as the file has them.
struct Side<'a> {
    station_m: f64,
    track_m: f64,
    unsprung_kg: f64,
    load_n: f64,
    tyre_n_per_m: f64,
    twin_spacing_m: f64,
    spring_n_per_m: f64,
    /// Sum of bump and rebound.
    damping_n_s_per_m: f64,
    anti_roll_nm_per_rad: f64,
    camber_gain_rad_per_m: f64,
    roll_centre_m: f64,
    gyroscopic_kg_m2: f64,
    solid: Option<&'a SolidAxleParameters>,
}

impl Side<'_> {
    fn axle(&self, vehicle: &VehicleParameters) -> Axle {
        let tyre = &vehicle.tyre;
        let half_track = 0.5 * self.track_m;
        let hub = tyre.unloaded_radius_m - self.load_n / self.tyre_n_per_m;
        let share = |spacing: fn(&SolidAxleParameters) -> f64| {
            self.solid
                .map_or(1.0, |axle| (spacing(axle) / self.track_m).powi(2))
        };
        let damping = 0.5 * self.damping_n_s_per_m;
        Axle {
            station_m: self.station_m,
            half_track_m: half_track,
            unsprung_kg: self.unsprung_kg,
            load_n: self.load_n,
            tyre_n_per_m: self.tyre_n_per_m,
            tyre_n_s_per_m: tyre.vertical_damping_n_s_per_m,
            half_twin_spacing_m: 0.5 * self.twin_spacing_m,
            spring_n_per_m: [
                self.spring_n_per_m,
                self.spring_n_per_m * share(|axle| axle.spring_spacing_m)
                    + 0.5 * self.anti_roll_nm_per_rad / (half_track * half_track),
            ],
            damping_n_s_per_m: [damping, damping * share(|axle| axle.damper_spacing_m)],
            lean_per_m: if self.solid.is_some() {
                1.0 / half_track
            } else {
                self.camber_gain_rad_per_m
            },
            jacking_slope: self.roll_centre_m / half_track,
            drop_m: vehicle.mass.sprung_cg_height_m - hub,
            lean_radius_m: hub - tyre.crown_radius_m,
            spin_kg_m: self.gyroscopic_kg_m2
                / (tyre.unloaded_radius_m - self.load_n / self.tyre_n_per_m / 3.0),
        }
    }
}

/// Adds the energy `½ value (at · q)²` of a motion that is linear in `q = (φ, d_front, d_rear)`.
pub(super) fn add_square(matrix: &mut Matrix3<f64>, value: f64, axle: usize, at: [f64; 2]) {
    let index = 1 + axle;
    matrix[(0, 0)] += value * at[0] * at[0];
    matrix[(0, index)] += value * at[0] * at[1];
    matrix[(index, 0)] += value * at[0] * at[1];
    matrix[(index, index)] += value * at[1] * at[1];
}

/// How an axle stands on its wheels in a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stand {
    /// Whether the inner wheel is off the ground: a constant load then stands on the outer one.
    pub lifted: bool,
    /// How many wheels stand on both of their twin tyres: 2 at rest.
    pub twins: f64,
}

impl Stand {
    pub const AT_REST: Self = Self {
        lifted: false,
        twins: 2.0,
    };
}

/// Stiffness in roll over `(φ, d_front, d_rear)`: second derivative of the energy in tyres, springs,
/// bars and gravity.
pub(super) fn roll_stiffness(axles: &[Axle; 2], stands: [Stand; 2]) -> Matrix3<f64> {
    let mut stiffness = Matrix3::zeros();
    for (i, (axle, stand)) in axles.iter().zip(stands).enumerate() {
        let lean = [1.0, axle.lean_per_m];
        let twins = stand.twins * axle.tyre_n_per_m * axle.half_twin_spacing_m.powi(2);
        if !stand.lifted {
            let press = [axle.half_track_m, 1.0];
            add_square(&mut stiffness, 2.0 * axle.tyre_n_per_m, i, press);
        }
        add_square(&mut stiffness, twins, i, lean);
        add_square(&mut stiffness, 2.0 * axle.spring_n_per_m[1], i, [0.0, 1.0]);
        // The load pushes a leaning wheel over, and the sprung weight the body.
        let falling = -2.0 * axle.load_n * axle.lean_radius_m;
        add_square(&mut stiffness, falling, i, lean);
        let sprung_n = 2.0 * (axle.load_n - axle.unsprung_kg * GRAVITY_M_S2);
        add_square(&mut stiffness, -sprung_n * axle.drop_m, i, [1.0, 0.0]);
    }
    stiffness
}
