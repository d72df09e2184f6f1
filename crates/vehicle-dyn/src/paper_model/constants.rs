//! The symbols of the paper from the parameters of a vehicle.

use super::{Equations, PaperModelSettings, RollAxis, RollStiffness};
use crate::parameters::{SolidAxleParameters, VehicleParameters};
use crate::powertrain::{Powertrain, PowertrainState};
use crate::steering::SteeringActuator;
use crate::tyre::MagicFormula;
use crate::units::GRAVITY_M_S2;

/// Share of the peak force that drive and brake may ask of a tyre.
const LARGEST_SHARE: f64 = 0.95;

/// What one axle brings in.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axle {
    /// `l_f` or `−l_r`: position ahead of the vehicle's centre of gravity, m.
    pub ahead_m: f64,
    pub track_m: f64,
    /// Share of `K_s`, N m/rad.
    pub roll_stiffness: f64,
    /// Share of `D_s`, N m s/rad.
    pub roll_damping: f64,
    /// Height of the roll axis here, m.
    pub axis_height_m: f64,
    pub unsprung_kg: f64,
    pub unsprung_height_m: f64,
    /// Load of one wheel at rest, N.
    pub static_load_n: f64,
    /// Share of the sprung weight.
    pub sprung_share: f64,
    /// `R_w`, m.
    pub radius_m: f64,
    pub tyre: MagicFormula,
}

/// The vehicle with every constant computed once.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Constants {
    pub equations: Equations,
    /// m, kg.
    pub total_kg: f64,
    /// `m_SM`, kg.
    pub sprung_kg: f64,
    /// `m_uc`, kg.
    pub undercarriage_kg: f64,
    /// `h_SM`: centre of gravity of the sprung mass above the roll axis, m.
    pub roll_arm_m: f64,
    /// `I_xx,SM`, `I_yy,SM`, `I_zz,SM`, kg m².
    pub sprung_inertia: [f64; 3],
    /// `I_zz` of the whole vehicle upright, kg m².
    pub yaw_inertia: f64,
    /// `K_s`, N m/rad.
    pub roll_stiffness: f64,
    /// `D_s`, N m s/rad.
    pub roll_damping: f64,
    pub wheelbase_m: f64,
    pub cg_height_m: f64,
    pub sprung_cg_height_m: f64,
    pub friction: f64,
    pub drag_kg_per_m: f64,
    pub axles: [Axle; 2],
    /// What drive and brake may ask of a tyre.
    slip_limit: SlipLimit,
    pub steering: SteeringActuator,
    pub powertrain: Powertrain,
}

/// The rising branch of the shape `P(s_c)`, `s_c = C1 x`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SlipLimit {
    c1: f64,
    e1: f64,
    /// Largest force over the `F_P` of the formula.
    share: f64,
}

impl Constants {
    /// Prepares a checked vehicle.
    pub fn new(vehicle: &VehicleParameters, friction: f64, settings: PaperModelSettings) -> Self {
        let figures = vehicle.derived();
        let (mass, geometry, tyre) = (&vehicle.mass, &vehicle.geometry, &vehicle.tyre);
        let total_kg = figures.total_mass_kg;
        let unsprung_kg = [
            2.0 * mass.unsprung_mass_front_each_kg,
            2.0 * mass.unsprung_mass_rear_each_kg,
        ];
        let undercarriage_kg = unsprung_kg[0] + unsprung_kg[1];
        let static_load_n = [figures.static_load_front_n, figures.static_load_rear_n];
        let radial = [
            tyre.vertical_stiffness_front_n_per_m,
            tyre.vertical_stiffness_rear_n_per_m,
        ];
        let deflection_m = [static_load_n[0] / radial[0], static_load_n[1] / radial[1]];
        let hub_height_m = deflection_m.map(|deflection| tyre.unloaded_radius_m - deflection);
        let (to_front, to_rear) = (
            geometry.sprung_cg_to_front_axle_m,
            geometry.sprung_cg_to_rear_axle_m,
        );
        let sprung_share = [
            to_rear / figures.wheelbase_m,
            to_front / figures.wheelbase_m,
        ];
        let axis_height_m = match settings.roll_axis {
            RollAxis::Undercarriage => {
                let centre = (unsprung_kg[0] * hub_height_m[0] + unsprung_kg[1] * hub_height_m[1])
                    / undercarriage_kg;
                [centre, centre]
            }
            RollAxis::RollCentres => [
                geometry.roll_centre_height_front_m,
                geometry.roll_centre_height_rear_m,
            ],
        };
        let axis_height = sprung_share[0] * axis_height_m[0] + sprung_share[1] * axis_height_m[1];
        let ahead_m = [
            figures.cg_to_front_axle_m,
            figures.cg_to_front_axle_m - figures.wheelbase_m,
        ];
        let tracks = [geometry.track_front_m, geometry.track_rear_m];
        let rolls = roll_rates(vehicle, settings.roll_stiffness);
        let b1 = [
            tyre.stiffness_factor_b1_front,
            tyre.stiffness_factor_b1_rear,
        ];
        let axle = |i: usize| Axle {
            ahead_m: ahead_m[i],
            track_m: tracks[i],
            roll_stiffness: rolls[i][0],
            roll_damping: rolls[i][1],
            axis_height_m: axis_height_m[i],
            unsprung_kg: unsprung_kg[i],
            unsprung_height_m: hub_height_m[i],
            static_load_n: static_load_n[i],
            sprung_share: sprung_share[i],
            radius_m: tyre.unloaded_radius_m - deflection_m[i] / 3.0,
            tyre: MagicFormula::new(tyre, b1[i], total_kg * GRAVITY_M_S2),
        };
        Self {
            equations: settings.equations,
            total_kg,
            sprung_kg: mass.sprung_mass_kg,
            undercarriage_kg,
            roll_arm_m: mass.sprung_cg_height_m - axis_height,
            sprung_inertia: [
                mass.sprung_roll_inertia_kg_m2,
                mass.sprung_pitch_inertia_kg_m2,
                mass.sprung_yaw_inertia_kg_m2,
            ],
            yaw_inertia: figures.total_yaw_inertia_kg_m2,
            roll_stiffness: rolls[0][0] + rolls[1][0],
            roll_damping: rolls[0][1] + rolls[1][1],
            wheelbase_m: figures.wheelbase_m,
            cg_height_m: figures.cg_height_m,
            sprung_cg_height_m: mass.sprung_cg_height_m,
            friction,
            drag_kg_per_m: 0.5
                * vehicle.aerodynamics.air_density_kg_per_m3
                * vehicle.aerodynamics.drag_area_m2,
            axles: [axle(0), axle(1)],
            slip_limit: SlipLimit::new(tyre.shape_factor_c1, tyre.curvature_factor_e1),
            steering: SteeringActuator::new(&vehicle.steering),
            powertrain: Powertrain::new(&vehicle.powertrain, total_kg),
        }
    }

    /// Drag at forward speed `speed_m_s`, N, positive against forward motion.
    pub fn drag_n(&self, speed_m_s: f64) -> f64 {
        self.drag_kg_per_m * speed_m_s * speed_m_s.abs()
    }

    /// Share of one wheel of an axle in the drive force.
    pub fn drive_share(&self, axle: usize) -> f64 {
        let unit = PowertrainState {
            drive_n: 1.0,
            ..PowertrainState::default()
        };
        self.powertrain.axle_torques_nm(axle, &unit, [0.0; 2], 1.0)[0]
    }

    /// Slip ratio `λ` at which a tyre of `axle` under `load_n`, rolling straight, gives `force_n`.
    pub fn slip_ratio(&self, axle: usize, load_n: f64, force_n: f64) -> f64 {
        let tyre = &self.axles[axle].tyre;
        let peak = tyre.peak_force_n(load_n, self.friction);
        if peak <= 0.0 || force_n == 0.0 {
            return 0.0;
        }
        let reduced = self.slip_limit.reduced_slip((force_n / peak).abs());
        (reduced * peak / tyre.stiffness_n(load_n, self.friction)).copysign(force_n)
    }
}

impl SlipLimit {
    fn new(c1: f64, e1: f64) -> Self {
        // The sine peaks at a right angle or, for c1 < 1 or e1 = 1, at the end of its argument.
        let end = if e1 < 1.0 {
            c1 * std::f64::consts::FRAC_PI_2
        } else {
            c1 * std::f64::consts::FRAC_PI_2.atan()
        };
        let peak = end.min(std::f64::consts::FRAC_PI_2).sin();
        Self {
            c1,
            e1,
            share: LARGEST_SHARE * peak,
        }
    }

    /// The `s_c` of the rising branch with `P(s_c) = share`, at most the limit.
    fn reduced_slip(&self, share: f64) -> f64 {
        const ROUNDS: usize = 60;
        let share = share.min(self.share);
        let wanted = (share.asin() / self.c1).tan();
        // x (1 − E1) + E1 atan x = wanted; the left side rises with x and bends one way only, so
        // Newton's steps from `wanted` approach the root from one side.
        let mut x = wanted;
        for _ in 0..ROUNDS {
            if self.e1 == 0.0 {
                break;
            }
            let error = x * (1.0 - self.e1) + self.e1 * x.atan() - wanted;
            let change = error / (1.0 - self.e1 + self.e1 / (1.0 + x * x));
            x -= change;
            if change.abs() <= 1e-15 * x {
                break;
            }
        }
        x * self.c1
    }
}

/// Roll stiffness (N m/rad) and roll damping (N m s/rad) of both axles.
fn roll_rates(vehicle: &VehicleParameters, choice: RollStiffness) -> [[f64; 2]; 2] {
    let figures = vehicle.derived();
    let (suspension, geometry, tyre) = (&vehicle.suspension, &vehicle.geometry, &vehicle.tyre);
    let spacing = |solid: &Option<SolidAxleParameters>, track: f64| {
        solid.as_ref().map_or(track, |axle| axle.damper_spacing_m)
    };
    let front = spacing(&suspension.solid_axle_front, geometry.track_front_m);
    let rear = spacing(&suspension.solid_axle_rear, geometry.track_rear_m);
    // One side moves in bump while the other rebounds, so both rates add up.
    let damping = [
        0.25 * front
            * front
            * (suspension.damping_bump_front_n_s_per_m
                + suspension.damping_rebound_front_n_s_per_m),
        0.25 * rear
            * rear
            * (suspension.damping_bump_rear_n_s_per_m + suspension.damping_rebound_rear_n_s_per_m),
    ];
    let stiffness = [
        figures.roll_stiffness_front_nm_per_rad,
        figures.roll_stiffness_rear_nm_per_rad,
    ];
    // Each of twin tyres carries half the stiffness at its own distance from the middle.
    let tyre_stiffness = [
        0.5 * tyre.vertical_stiffness_front_n_per_m * geometry.track_front_m.powi(2),
        0.5 * tyre.vertical_stiffness_rear_n_per_m
            * (geometry.track_rear_m.powi(2) + tyre.twin_spacing_rear_m.powi(2)),
    ];
    [0, 1].map(|i| match choice {
        RollStiffness::Suspension => [stiffness[i], damping[i]],
        RollStiffness::WithTyres => {
            // The suspension turns by this share of the roll, and so does the damper.
            let share = tyre_stiffness[i] / (tyre_stiffness[i] + stiffness[i]);
            [stiffness[i] * share, damping[i] * share * share]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tyre::shape;

    #[test]
    fn the_slip_gives_the_force_that_was_asked_up_to_the_limit() {
        for c1 in [0.5, 0.8, 1.0, 1.4, 2.0] {
            for e1 in [-20.0, -3.0, -0.1, 0.0, 0.5, 0.9, 0.999, 1.0] {
                let limit = SlipLimit::new(c1, e1);
                let mut last = 0.0;
                for percent in 1..=100 {
                    let share = limit.share * f64::from(percent) / 100.0;
                    let slip = limit.reduced_slip(share);
                    let [found, slope] = shape(slip, c1, e1);
                    assert!((found - share).abs() < 1e-9, "{found}, {share}: {c1} {e1}");
                    assert!(
                        slope > 0.0 && slip > last,
                        "on the rising branch: {c1} {e1}"
                    );
                    last = slip;
                }
                let beyond = limit.reduced_slip(3.0);
                assert!(
                    (beyond - last).abs() <= 1e-9 * last,
                    "{beyond}, {last}: {c1} {e1}"
                );
            }
        }
    }
}
