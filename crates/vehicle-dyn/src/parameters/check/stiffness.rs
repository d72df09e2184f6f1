//! Wheels that would hop faster than the integration step can follow.

use crate::parameters::{ParameterError, SolidAxleParameters, VehicleParameters};
use crate::simulation::DEFAULT_SUBSTEP_S;

/// Fastest rate of a wheel hop per step. RK4 is stable up to 2.8 for undamped motion and 2.78 for
/// overdamped motion. The wheels of one body can together reach twice the frequency of one of them
/// (the largest eigenvalue is at most the sum over four wheels), so 1 leaves room for that.
const LARGEST_RATE_PER_STEP: f64 = 1.0;

/// What one wheel hops on.
struct Corner {
    axle: &'static str,
    unsprung_kg: f64,
    tyre_n_per_m: f64,
    spring_n_per_m: f64,
    anti_roll_nm_per_rad: f64,
    damping_n_s_per_m: f64,
    /// Largest ratio of the motion at a spring or damper to that of the wheel: above 1 only on a
    /// solid axle whose springs stand wider than its wheels.
    motion_ratio: f64,
    track_m: f64,
    to_axle_m: f64,
}

impl Corner {
    /// Fastest rate of the hop, 1/s: its natural frequency, or the faster decay when it is
    /// overdamped. The tyre holds the wheel to the ground, suspension and stop hold it to the body.
    fn rate_per_s(&self, vehicle: &VehicleParameters) -> f64 {
        let mass = &vehicle.mass;
        let half_track = 0.5 * self.track_m;
        // How far the body gives way at this corner: 1/mass that the suspension meets there.
        let mobility = 1.0 / mass.sprung_mass_kg
            + half_track * half_track / mass.sprung_roll_inertia_kg_m2
            + self.to_axle_m * self.to_axle_m / mass.sprung_pitch_inertia_kg_m2;
        let inverse_unsprung = 1.0 / self.unsprung_kg;
        // An anti-roll bar is met twice over when left and right move against each other.
        let anti_roll = 2.0 * self.anti_roll_nm_per_rad.max(0.0) / (self.track_m * self.track_m);
        let lever = self.motion_ratio * self.motion_ratio;
        let springs = self.spring_n_per_m + vehicle.suspension.bump_stop_n_per_m;
        let suspension = lever * springs + anti_roll;
        let stiffness =
            self.tyre_n_per_m * inverse_unsprung + suspension * (inverse_unsprung + mobility);
        let half_damping = 0.5
            * (vehicle.tyre.vertical_damping_n_s_per_m * inverse_unsprung
                + lever * self.damping_n_s_per_m * (inverse_unsprung + mobility));
        let beyond = half_damping * half_damping - stiffness;
        if beyond > 0.0 {
            half_damping + beyond.sqrt()
        } else {
            stiffness.sqrt()
        }
    }
}

pub(super) fn check(vehicle: &VehicleParameters, origin: &str) -> Result<(), ParameterError> {
    let limit = LARGEST_RATE_PER_STEP / DEFAULT_SUBSTEP_S;
    for corner in corners(vehicle) {
        let rate = corner.rate_per_s(vehicle);
        if rate <= limit {
            continue;
        }
        let axle = corner.axle;
        return Err(ParameterError::Contradiction {
            fields: format!(
                "mass.unsprung_mass_{axle}_each_kg = {} with \
                 tyre.vertical_stiffness_{axle}_n_per_m = {}, \
                 suspension.spring_rate_{axle}_n_per_m = {}, \
                 suspension.bump_stop_n_per_m = {} and \
                 suspension.damping_*_{axle}_n_s_per_m up to {}",
                corner.unsprung_kg,
                corner.tyre_n_per_m,
                corner.spring_n_per_m,
                vehicle.suspension.bump_stop_n_per_m,
                corner.damping_n_s_per_m
            ),
            reason: format!(
                "the wheel would hop at a rate of {rate:.0} 1/s, and the simulation's step of \
                 {:.0} ms follows at most {limit:.0} 1/s: give a larger mass, or softer springs, \
                 stops and dampers",
                DEFAULT_SUBSTEP_S * 1e3
            ),
            origin: origin.to_owned(),
        });
    }
    Ok(())
}

fn corners(vehicle: &VehicleParameters) -> [Corner; 2] {
    let (mass, geometry) = (&vehicle.mass, &vehicle.geometry);
    let (suspension, tyre) = (&vehicle.suspension, &vehicle.tyre);
    let motion_ratio = |solid: &Option<SolidAxleParameters>, track_m: f64| {
        solid.as_ref().map_or(1.0, |axle| {
            (axle.spring_spacing_m.max(axle.damper_spacing_m) / track_m).max(1.0)
        })
    };
    [
        Corner {
            axle: "front",
            unsprung_kg: mass.unsprung_mass_front_each_kg,
            tyre_n_per_m: tyre.vertical_stiffness_front_n_per_m,
            spring_n_per_m: suspension.spring_rate_front_n_per_m,
            anti_roll_nm_per_rad: suspension.anti_roll_front_nm_per_rad,
            damping_n_s_per_m: suspension
                .damping_bump_front_n_s_per_m
                .max(suspension.damping_rebound_front_n_s_per_m),
            motion_ratio: motion_ratio(&suspension.solid_axle_front, geometry.track_front_m),
            track_m: geometry.track_front_m,
            to_axle_m: geometry.sprung_cg_to_front_axle_m,
        },
        Corner {
            axle: "rear",
            unsprung_kg: mass.unsprung_mass_rear_each_kg,
            tyre_n_per_m: tyre.vertical_stiffness_rear_n_per_m,
            spring_n_per_m: suspension.spring_rate_rear_n_per_m,
            anti_roll_nm_per_rad: suspension.anti_roll_rear_nm_per_rad,
            damping_n_s_per_m: suspension
                .damping_bump_rear_n_s_per_m
                .max(suspension.damping_rebound_rear_n_s_per_m),
            motion_ratio: motion_ratio(&suspension.solid_axle_rear, geometry.track_rear_m),
            track_m: geometry.track_rear_m,
            to_axle_m: geometry.sprung_cg_to_rear_axle_m,
        },
    ]
}
