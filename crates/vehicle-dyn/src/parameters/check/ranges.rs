//! One row per value: table, key, interval, unit. Messages, schema and documentation read it.

use super::interval::{Interval, above, within};
use crate::driver::DriverParameters;
use crate::parameters::{ParameterError, SolidAxleParameters, VehicleParameters};

/// A value of a vehicle file and what it may be.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Table of the file, such as `suspension.solid_axle_rear`.
    pub table: &'static str,
    /// Key in the table.
    pub key: &'static str,
    /// Allowed values.
    pub interval: Interval,
    /// Unit, empty for none.
    pub unit: &'static str,
    value: fn(&VehicleParameters) -> Option<f64>,
}

impl Field {
    /// The value, or `None` when the vehicle has no such table.
    #[must_use]
    pub fn value(&self, vehicle: &VehicleParameters) -> Option<f64> {
        (self.value)(vehicle)
    }

    /// Allowed values with their unit, such as `(0, 1e5] kg`.
    #[must_use]
    pub fn range(&self) -> String {
        let unit = self.unit;
        let space = if unit.is_empty() { "" } else { " " };
        format!("{}{space}{unit}", self.interval)
    }
}

/// Rows of a table that every vehicle has, then of one that it may have.
macro_rules! rows {
    ($table:ident { $($key:ident in $interval:expr, $unit:literal;)* }) => {
        [$(Field {
            table: stringify!($table),
            key: stringify!($key),
            interval: $interval,
            unit: $unit,
            value: |vehicle| Some(vehicle.$table.$key),
        }),*]
    };
    ($name:literal, $table:path { $($key:ident in $interval:expr, $unit:literal;)* }) => {
        [$(Field {
            table: $name,
            key: stringify!($key),
            interval: $interval,
            unit: $unit,
            value: |vehicle| $table(vehicle).map(|table| table.$key),
        }),*]
    };
}

fn solid_axle_front(vehicle: &VehicleParameters) -> Option<&SolidAxleParameters> {
    vehicle.suspension.solid_axle_front.as_ref()
}

fn solid_axle_rear(vehicle: &VehicleParameters) -> Option<&SolidAxleParameters> {
    vehicle.suspension.solid_axle_rear.as_ref()
}

fn driver(vehicle: &VehicleParameters) -> Option<&DriverParameters> {
    vehicle.driver.as_ref()
}

const INERTIA: Interval = above(0.0, 1e6);
const MASS: [Field; 8] = rows!(mass {
    sprung_mass_kg in above(0.0, 1e5), "kg";
    unsprung_mass_front_each_kg in above(0.0, 1e4), "kg";
    unsprung_mass_rear_each_kg in above(0.0, 1e4), "kg";
    sprung_roll_inertia_kg_m2 in INERTIA, "kg m²";
    sprung_pitch_inertia_kg_m2 in INERTIA, "kg m²";
    sprung_yaw_inertia_kg_m2 in INERTIA, "kg m²";
    sprung_roll_yaw_product_kg_m2 in within(-1e6, 1e6), "kg m²";
    sprung_cg_height_m in above(0.0, 5.0), "m";
});

const ROLL_CENTRE: Interval = within(-0.5, 2.0);
const GEOMETRY: [Field; 6] = rows!(geometry {
    sprung_cg_to_front_axle_m in above(0.0, 20.0), "m";
    sprung_cg_to_rear_axle_m in above(0.0, 20.0), "m";
    track_front_m in above(0.0, 5.0), "m";
    track_rear_m in above(0.0, 5.0), "m";
    roll_centre_height_front_m in ROLL_CENTRE, "m";
    roll_centre_height_rear_m in ROLL_CENTRE, "m";
});

// Below 1000 N/m a spring rate is most likely in N/mm.
const SPRING: Interval = within(1e3, 1e7);
const DAMPING: Interval = within(0.0, 2e5);
const SUSPENSION: [Field; 13] = rows!(suspension {
    spring_rate_front_n_per_m in SPRING, "N/m";
    spring_rate_rear_n_per_m in SPRING, "N/m";
    damping_bump_front_n_s_per_m in DAMPING, "N s/m";
    damping_rebound_front_n_s_per_m in DAMPING, "N s/m";
    damping_bump_rear_n_s_per_m in DAMPING, "N s/m";
    damping_rebound_rear_n_s_per_m in DAMPING, "N s/m";
    anti_roll_front_nm_per_rad in within(-1e7, 1e7), "N m/rad";
    anti_roll_rear_nm_per_rad in within(-1e7, 1e7), "N m/rad";
    travel_m in above(0.0, 1.0), "m";
    bump_stop_n_per_m in within(0.0, 1e8), "N/m";
    bump_stop_n_per_m2 in within(0.0, 1e10), "N/m²";
    camber_gain_front_rad_per_m in within(-5.0, 5.0), "rad/m";
    camber_gain_rear_rad_per_m in within(-5.0, 5.0), "rad/m";
});

// Closer than 0.1 m nothing stands beside a differential.
const SPACING: Interval = within(0.1, 5.0);
const SOLID_AXLE_FRONT: [Field; 2] = rows!("suspension.solid_axle_front", solid_axle_front {
    spring_spacing_m in SPACING, "m";
    damper_spacing_m in SPACING, "m";
});
const SOLID_AXLE_REAR: [Field; 2] = rows!("suspension.solid_axle_rear", solid_axle_rear {
    spring_spacing_m in SPACING, "m";
    damper_spacing_m in SPACING, "m";
});

const RADIAL: Interval = within(1e4, 1e8);
// Shorter lengths make the slip faster than the 1 ms step can follow at speed.
const RELAXATION: Interval = within(0.05, 5.0);
const TYRE: [Field; 18] = rows!(tyre {
    unloaded_radius_m in above(0.05, 2.0), "m";
    vertical_stiffness_front_n_per_m in RADIAL, "N/m";
    vertical_stiffness_rear_n_per_m in RADIAL, "N/m";
    twin_spacing_rear_m in within(0.0, 1.0), "m";
    crown_radius_m in within(0.0, 2.0), "m";
    lateral_compliance_m_per_n in within(0.0, 1e-3), "m/N";
    vertical_damping_n_s_per_m in within(0.0, 1e5), "N s/m";
    mu_tyre in above(0.0, 3.0), "";
    stiffness_factor_b1_front in above(0.0, 100.0), "";
    stiffness_factor_b1_rear in above(0.0, 100.0), "";
    // Beyond C1 = 2 the force would change sign with growing slip.
    shape_factor_c1 in within(0.5, 2.0), "";
    curvature_factor_e1 in within(-20.0, 1.0), "";
    stiffness_saturation_c2 in within(0.0, 20.0), "";
    q_load in within(0.0, 2.0), "";
    camber_thrust_ratio in within(-1.0, 1.0), "";
    relaxation_length_lateral_m in RELAXATION, "m";
    relaxation_length_longitudinal_m in RELAXATION, "m";
    rolling_resistance_coefficient in within(0.0, 0.5), "";
});

const WHEEL: [Field; 4] = rows!(wheel {
    spin_inertia_front_kg_m2 in within(0.05, 1e3), "kg m²";
    spin_inertia_rear_kg_m2 in within(0.05, 1e3), "kg m²";
    gyroscopic_inertia_front_kg_m2 in within(0.0, 1e3), "kg m²";
    gyroscopic_inertia_rear_kg_m2 in within(0.0, 1e3), "kg m²";
});

const STEERING: [Field; 5] = rows!(steering {
    ratio in within(1.0, 60.0), "";
    bandwidth_hz in within(0.2, 50.0), "Hz";
    damping_ratio in within(0.1, 5.0), "";
    handwheel_rate_limit_deg_per_s in above(0.0, 1e4), "deg/s";
    handwheel_limit_deg in above(0.0, 2e3), "deg";
});

const SHARE: Interval = within(0.0, 1.0);
const LAG: Interval = within(0.005, 10.0);
const POWERTRAIN: [Field; 10] = rows!(powertrain {
    // Below 1000 W a power is most likely in kW.
    max_power_w in within(1e3, 1e7), "W";
    max_drive_force_n in above(0.0, 1e7), "N";
    drive_share_front in SHARE, "";
    engine_lag_s in LAG, "s";
    differential_coupling_nm_s_per_rad in within(0.0, 500.0), "N m s/rad";
    max_brake_force_n in above(0.0, 1e7), "N";
    brake_share_front in SHARE, "";
    brake_lag_s in LAG, "s";
    speed_gain_per_s in above(0.0, 20.0), "1/s";
    speed_integral_gain_per_s2 in within(0.0, 20.0), "1/s²";
});

const AERODYNAMICS: [Field; 2] = rows!(aerodynamics {
    drag_area_m2 in within(0.0, 50.0), "m²";
    air_density_kg_per_m3 in within(0.0, 5.0), "kg/m³";
});

const fn driver_interval(row: usize) -> Interval {
    let (_, low, high, _) = DriverParameters::RANGES[row];
    within(low, high)
}

// The driver's own table holds these ranges; here they get a place in the file.
const DRIVER: [Field; 7] = rows!("driver", driver {
    preview_time_s in driver_interval(0), "s";
    preview_gain_deg_per_m in driver_interval(1), "deg/m";
    error_rate_gain_deg_s_per_m in driver_interval(2), "deg s/m";
    integral_gain_deg_per_m_s in driver_interval(3), "deg/(m s)";
    lag_s in driver_interval(4), "s";
    handwheel_limit_deg in driver_interval(5), "deg";
    handwheel_rate_limit_deg_per_s in driver_interval(6), "deg/s";
});

/// Every number of a vehicle file, table by table in the file's order.
const TABLES: [&[Field]; 11] = [
    &MASS,
    &GEOMETRY,
    &SUSPENSION,
    &SOLID_AXLE_FRONT,
    &SOLID_AXLE_REAR,
    &TYRE,
    &WHEEL,
    &STEERING,
    &POWERTRAIN,
    &AERODYNAMICS,
    &DRIVER,
];

/// Every number of a vehicle file with its allowed range, in the file's order.
pub fn fields() -> impl Iterator<Item = &'static Field> {
    TABLES.into_iter().flatten()
}

pub(super) fn check(vehicle: &VehicleParameters, origin: &str) -> Result<(), ParameterError> {
    for field in fields() {
        let Some(value) = field.value(vehicle) else {
            continue;
        };
        if !field.interval.contains(value) {
            return Err(ParameterError::OutOfRange {
                field: format!("{}.{}", field.table, field.key),
                value,
                range: field.range(),
                origin: origin.to_owned(),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::DRIVER;
    use crate::driver::DriverParameters;

    #[test]
    fn the_rows_of_the_driver_are_in_the_order_of_its_own_table() {
        for (field, (name, ..)) in DRIVER.iter().zip(DriverParameters::RANGES) {
            assert_eq!(field.key, name);
        }
    }
}
