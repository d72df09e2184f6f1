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
