//! Figures a vehicle engineer checks first: a wrong unit shows here.

mod axle;
mod cornering;
mod figures;
mod modes;

pub use cornering::CorneringFigures;
pub use figures::Figure;
pub use modes::{Mode, NaturalModes};

use serde::Serialize;

use super::{SolidAxleParameters, VehicleParameters};
use crate::units::GRAVITY_M_S2;

/// Figures computed from the parameters of a vehicle at rest on level ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DerivedFigures {
    /// Mass of the whole vehicle, kg.
    pub total_mass_kg: f64,
    /// Height of the centre of gravity of the whole vehicle, m.
    pub cg_height_m: f64,
    /// Distance from the centre of gravity of the whole vehicle to the front axle, m.
    pub cg_to_front_axle_m: f64,
    /// Distance between the axles, m.
    pub wheelbase_m: f64,
    /// Half the mean track over the height of the centre of gravity (no unit).
    pub static_stability_factor: f64,
    /// Load of one front wheel at rest, N.
    pub static_load_front_n: f64,
    /// Load of one rear wheel at rest, N.
    pub static_load_rear_n: f64,
    /// Yaw inertia of the whole vehicle about its centre of gravity, kg m².
    pub total_yaw_inertia_kg_m2: f64,
    /// Roll stiffness of the front suspension without tyres, N m/rad.
    pub roll_stiffness_front_nm_per_rad: f64,
    /// Roll stiffness of the rear suspension without tyres, N m/rad.
    pub roll_stiffness_rear_nm_per_rad: f64,
}

impl VehicleParameters {
    /// The figures that follow from the parameters.
    #[must_use]
    pub fn derived(&self) -> DerivedFigures {
        let mass = &self.mass;
        let geometry = &self.geometry;
        let suspension = &self.suspension;
        let (front, rear) = (
            geometry.sprung_cg_to_front_axle_m,
            geometry.sprung_cg_to_rear_axle_m,
        );
        let wheelbase = front + rear;
        let sprung = mass.sprung_mass_kg;
        let unsprung_front = 2.0 * mass.unsprung_mass_front_each_kg;
        let unsprung_rear = 2.0 * mass.unsprung_mass_rear_each_kg;
        let total = sprung + unsprung_front + unsprung_rear;
        let static_load_front = 0.5 * GRAVITY_M_S2 * (sprung * rear / wheelbase + unsprung_front);
        let static_load_rear = 0.5 * GRAVITY_M_S2 * (sprung * front / wheelbase + unsprung_rear);
        let hub_height_front = self.tyre.unloaded_radius_m
            - static_load_front / self.tyre.vertical_stiffness_front_n_per_m;
        let hub_height_rear = self.tyre.unloaded_radius_m
            - static_load_rear / self.tyre.vertical_stiffness_rear_n_per_m;
        let cg_height = (sprung * mass.sprung_cg_height_m
            + unsprung_front * hub_height_front
            + unsprung_rear * hub_height_rear)
            / total;
        let cg_to_front_axle = (sprung * front + unsprung_rear * wheelbase) / total;
        let cg_shift = front - cg_to_front_axle;
        let (half_front, half_rear) = (0.5 * geometry.track_front_m, 0.5 * geometry.track_rear_m);
        let spring_arm = |solid: &Option<SolidAxleParameters>, half_track: f64| {
            solid
                .as_ref()
                .map_or(half_track, |axle| 0.5 * axle.spring_spacing_m)
        };
        let spring_arm_front = spring_arm(&suspension.solid_axle_front, half_front);
        let spring_arm_rear = spring_arm(&suspension.solid_axle_rear, half_rear);
        let total_yaw_inertia = mass.sprung_yaw_inertia_kg_m2
            + unsprung_front * (front * front + half_front * half_front)
            + unsprung_rear * (rear * rear + half_rear * half_rear)
            - total * cg_shift * cg_shift;
        DerivedFigures {
            total_mass_kg: total,
            cg_height_m: cg_height,
            cg_to_front_axle_m: cg_to_front_axle,
            wheelbase_m: wheelbase,
            static_stability_factor: 0.5 * (half_front + half_rear) / cg_height,
            static_load_front_n: static_load_front,
            static_load_rear_n: static_load_rear,
            total_yaw_inertia_kg_m2: total_yaw_inertia,
            roll_stiffness_front_nm_per_rad: 2.0
                * suspension.spring_rate_front_n_per_m
                * spring_arm_front
                * spring_arm_front
                + suspension.anti_roll_front_nm_per_rad,
            roll_stiffness_rear_nm_per_rad: 2.0
                * suspension.spring_rate_rear_n_per_m
                * spring_arm_rear
                * spring_arm_rear
                + suspension.anti_roll_rear_nm_per_rad,
        }
    }
}
