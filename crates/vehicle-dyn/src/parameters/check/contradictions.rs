//! Values that are allowed one by one but do not make a vehicle together.

use crate::parameters::{ParameterError, VehicleParameters};
use crate::units::GRAVITY_M_S2;

/// Largest angle of the front wheels, deg.
const LARGEST_ROAD_WHEEL_DEG: f64 = 60.0;

pub(super) fn check(vehicle: &VehicleParameters, origin: &str) -> Result<(), ParameterError> {
    let require = |holds: bool, fields: String, reason: &str| {
        if holds {
            return Ok(());
        }
        Err(ParameterError::Contradiction {
            fields,
            reason: reason.to_owned(),
            origin: origin.to_owned(),
        })
    };
    let (mass, steering) = (&vehicle.mass, &vehicle.steering);
    let (roll, pitch, yaw) = (
        mass.sprung_roll_inertia_kg_m2,
        mass.sprung_pitch_inertia_kg_m2,
        mass.sprung_yaw_inertia_kg_m2,
    );
    let product = mass.sprung_roll_yaw_product_kg_m2;
    let inertias = format!(
        "mass.sprung_roll/pitch/yaw_inertia_kg_m2 = {roll}/{pitch}/{yaw}, \
         mass.sprung_roll_yaw_product_kg_m2 = {product}"
    );
    require(
        product * product < roll * yaw,
        inertias.clone(),
        "no body has a product of inertia this large: its square must be below roll times yaw \
         inertia",
    )?;
    require(
        roll + pitch >= yaw && pitch + yaw >= roll && roll + yaw >= pitch,
        inertias,
        "no body has these inertias: none may exceed the sum of the other two (is one of them for \
         the whole vehicle, or for another axis?)",
    )?;
    let tyre = &vehicle.tyre;
    require(
        tyre.crown_radius_m <= tyre.unloaded_radius_m,
        format!(
            "tyre.crown_radius_m = {} with tyre.unloaded_radius_m = {}",
            tyre.crown_radius_m, tyre.unloaded_radius_m
        ),
        "the tread's radius across the wheel must not exceed the radius of the wheel",
    )?;
    let track_rear = vehicle.geometry.track_rear_m;
    require(
        tyre.twin_spacing_rear_m < track_rear,
        format!(
            "tyre.twin_spacing_rear_m = {} with geometry.track_rear_m = {track_rear}",
            tyre.twin_spacing_rear_m
        ),
        "the inner tyres of left and right would overlap",
    )?;
    let suspension = &vehicle.suspension;
    for (axle, solid, gain) in [
        (
            "front",
            &suspension.solid_axle_front,
            suspension.camber_gain_front_rad_per_m,
        ),
        (
            "rear",
            &suspension.solid_axle_rear,
            suspension.camber_gain_rear_rad_per_m,
        ),
    ] {
        require(
            solid.is_none() || gain == 0.0,
            format!(
                "suspension.camber_gain_{axle}_rad_per_m = {gain} with suspension.solid_axle_{axle}"
            ),
            "the wheels of a solid axle lean with the axle: give 0",
        )?;
    }
    let limit = steering.handwheel_limit_deg;
    require(
        limit / steering.ratio <= LARGEST_ROAD_WHEEL_DEG,
        format!(
            "steering.handwheel_limit_deg = {limit} with steering.ratio = {}",
            steering.ratio
        ),
        "the front wheels would turn by more than 60 deg",
    )?;

    let figures = vehicle.derived();
    for (axle, load, stiffness) in [
        (
            "front",
            figures.static_load_front_n,
            vehicle.tyre.vertical_stiffness_front_n_per_m,
        ),
        (
            "rear",
            figures.static_load_rear_n,
            vehicle.tyre.vertical_stiffness_rear_n_per_m,
        ),
    ] {
        require(
            load / stiffness < 0.5 * vehicle.tyre.unloaded_radius_m,
            format!("tyre.vertical_stiffness_{axle}_n_per_m = {stiffness} under {load:.0} N"),
            "the tyre would be pressed in by more than half its radius at rest",
        )?;
    }
    let (front, rear) = (
        figures.roll_stiffness_front_nm_per_rad,
        figures.roll_stiffness_rear_nm_per_rad,
    );
    let gravity_moment = mass.sprung_mass_kg * GRAVITY_M_S2 * mass.sprung_cg_height_m;
    require(
        front > 0.0 && rear > 0.0 && front + rear > gravity_moment,
        format!(
            "roll stiffness {front:.0} N m/rad front and {rear:.0} rear (springs and \
             suspension.anti_roll_*)"
        ),
        &format!(
            "both must be positive and their sum above {gravity_moment:.0} N m/rad, or the body \
             falls over at rest"
        ),
    )
}
