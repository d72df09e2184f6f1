//! Values that are allowed one by one but do not make a vehicle together.

use crate::parameters::{DerivedFigures, ParameterError, VehicleParameters};
use crate::units::GRAVITY_M_S2;

/// Largest angle of the front wheels, deg.
const LARGEST_ROAD_WHEEL_DEG: f64 = 60.0;

pub(super) fn check(vehicle: &VehicleParameters, origin: &str) -> Result<(), ParameterError> {
    let origin = Origin(origin);
    origin.inertias(vehicle)?;
    origin.wheels(vehicle)?;
    origin.axles(vehicle)?;
    origin.steering(vehicle)?;
    let figures = vehicle.derived();
    origin.tyre_deflection(vehicle, &figures)?;
    origin.roll_stiffness(vehicle, &figures)
}

/// What messages name as the place of the values.
struct Origin<'a>(&'a str);

impl Origin<'_> {
    fn require(
        &self,
        holds: bool,
        fields: impl FnOnce() -> String,
        reason: impl Into<String>,
    ) -> Result<(), ParameterError> {
        if holds {
            return Ok(());
        }
        Err(ParameterError::Contradiction {
            fields: fields(),
            reason: reason.into(),
            origin: self.0.to_owned(),
        })
    }

    fn inertias(&self, vehicle: &VehicleParameters) -> Result<(), ParameterError> {
        let mass = &vehicle.mass;
        let (roll, pitch, yaw) = (
            mass.sprung_roll_inertia_kg_m2,
            mass.sprung_pitch_inertia_kg_m2,
            mass.sprung_yaw_inertia_kg_m2,
        );
        let product = mass.sprung_roll_yaw_product_kg_m2;
        let inertias = || {
            format!(
                "mass.sprung_roll/pitch/yaw_inertia_kg_m2 = {roll}/{pitch}/{yaw}, \
                 mass.sprung_roll_yaw_product_kg_m2 = {product}"
            )
        };
        self.require(
            product * product < roll * yaw,
            inertias,
            "no body has a product of inertia this large: its square must be below roll times yaw \
             inertia",
        )?;
        self.require(
            roll + pitch >= yaw && pitch + yaw >= roll && roll + yaw >= pitch,
            inertias,
            "no body has these inertias: none may exceed the sum of the other two (is one of them \
             for the whole vehicle, or for another axis?)",
        )
    }

    fn wheels(&self, vehicle: &VehicleParameters) -> Result<(), ParameterError> {
        let tyre = &vehicle.tyre;
        self.require(
            tyre.crown_radius_m <= tyre.unloaded_radius_m,
            || {
                format!(
                    "tyre.crown_radius_m = {} with tyre.unloaded_radius_m = {}",
                    tyre.crown_radius_m, tyre.unloaded_radius_m
                )
            },
            "the tread's radius across the wheel must not exceed the radius of the wheel",
        )?;
        let wheel = &vehicle.wheel;
        for (axle, gyroscopic, spin) in [
            (
                "front",
                wheel.gyroscopic_inertia_front_kg_m2,
                wheel.spin_inertia_front_kg_m2,
            ),
            (
                "rear",
                wheel.gyroscopic_inertia_rear_kg_m2,
                wheel.spin_inertia_rear_kg_m2,
            ),
        ] {
            self.require(
                gyroscopic <= spin,
                || {
                    format!(
                        "wheel.gyroscopic_inertia_{axle}_kg_m2 = {gyroscopic} with \
                         wheel.spin_inertia_{axle}_kg_m2 = {spin}"
                    )
                },
                "the bare wheel is a part of what resists spinning up, so its inertia must not be \
                 the larger one",
            )?;
        }
        Ok(())
    }

    fn axles(&self, vehicle: &VehicleParameters) -> Result<(), ParameterError> {
        let track_rear = vehicle.geometry.track_rear_m;
        let spacing = vehicle.tyre.twin_spacing_rear_m;
        self.require(
            spacing < track_rear,
            || {
                format!(
                    "tyre.twin_spacing_rear_m = {spacing} with geometry.track_rear_m = {track_rear}"
                )
            },
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
            self.require(
                solid.is_none() || gain == 0.0,
                || {
                    format!(
                        "suspension.camber_gain_{axle}_rad_per_m = {gain} with \
                         suspension.solid_axle_{axle}"
                    )
                },
                "the wheels of a solid axle lean with the axle: give 0",
            )?;
        }
        Ok(())
    }

    fn steering(&self, vehicle: &VehicleParameters) -> Result<(), ParameterError> {
        let steering = &vehicle.steering;
        let limit = steering.handwheel_limit_deg;
        self.require(
            limit / steering.ratio <= LARGEST_ROAD_WHEEL_DEG,
            || {
                format!(
                    "steering.handwheel_limit_deg = {limit} with steering.ratio = {}",
                    steering.ratio
                )
            },
            "the front wheels would turn by more than 60 deg",
        )
    }

    fn tyre_deflection(
        &self,
        vehicle: &VehicleParameters,
        figures: &DerivedFigures,
    ) -> Result<(), ParameterError> {
        let tyre = &vehicle.tyre;
        for (axle, load, stiffness) in [
            (
                "front",
                figures.static_load_front_n,
                tyre.vertical_stiffness_front_n_per_m,
            ),
            (
                "rear",
                figures.static_load_rear_n,
                tyre.vertical_stiffness_rear_n_per_m,
            ),
        ] {
            self.require(
                load / stiffness < 0.5 * tyre.unloaded_radius_m,
                || {
                    format!(
                        "tyre.vertical_stiffness_{axle}_n_per_m = {stiffness} under {load:.0} N"
                    )
                },
                "the tyre would be pressed in by more than half its radius at rest",
            )?;
        }
        Ok(())
    }

    fn roll_stiffness(
        &self,
        vehicle: &VehicleParameters,
        figures: &DerivedFigures,
    ) -> Result<(), ParameterError> {
        let (front, rear) = (
            figures.roll_stiffness_front_nm_per_rad,
            figures.roll_stiffness_rear_nm_per_rad,
        );
        let mass = &vehicle.mass;
        let gravity_moment = mass.sprung_mass_kg * GRAVITY_M_S2 * mass.sprung_cg_height_m;
        self.require(
            front > 0.0 && rear > 0.0 && front + rear > gravity_moment,
            || {
                format!(
                    "roll stiffness {front:.0} N m/rad front and {rear:.0} rear (springs and \
                     suspension.anti_roll_*)"
                )
            },
            format!(
                "both must be positive and their sum above {gravity_moment:.0} N m/rad, or the \
                 body falls over at rest"
            ),
        )
    }
}
