//! One row per value: field, value, interval, unit.

use crate::parameters::{ParameterError, SolidAxleParameters, VehicleParameters};

/// An allowed interval; its upper end belongs to it.
#[derive(Clone, Copy)]
struct Interval {
    low: f64,
    low_belongs: bool,
    high: f64,
}

/// `low < value ≤ high`.
const fn above(low: f64, high: f64) -> Interval {
    Interval {
        low,
        low_belongs: false,
        high,
    }
}

/// `low ≤ value ≤ high`.
const fn within(low: f64, high: f64) -> Interval {
    Interval {
        low,
        low_belongs: true,
        high,
    }
}

impl Interval {
    /// NaN is in no interval.
    fn contains(self, value: f64) -> bool {
        value <= self.high && (value > self.low || (self.low_belongs && value >= self.low))
    }
}

impl std::fmt::Display for Interval {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bracket = if self.low_belongs { '[' } else { '(' };
        write!(
            formatter,
            "{bracket}{}, {}]",
            short(self.low),
            short(self.high)
        )
    }
}

/// `1e5` instead of `100000`, but `0.5` as it is.
fn short(value: f64) -> String {
    if value.abs() >= 1e4 {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

type Row<'a> = (&'a str, f64, Interval, &'a str);

pub(super) fn check(vehicle: &VehicleParameters, origin: &str) -> Result<(), ParameterError> {
    check_rows("mass", &mass_rows(vehicle), origin)?;
    check_rows("geometry", &geometry_rows(vehicle), origin)?;
    check_rows("suspension", &suspension_rows(vehicle), origin)?;
    let suspension = &vehicle.suspension;
    for (table, axle) in [
        ("suspension.solid_axle_front", &suspension.solid_axle_front),
        ("suspension.solid_axle_rear", &suspension.solid_axle_rear),
    ] {
        if let Some(axle) = axle {
            check_rows(table, &solid_axle_rows(axle), origin)?;
        }
    }
    check_rows("tyre", &tyre_rows(vehicle), origin)?;
    check_rows("wheel", &wheel_rows(vehicle), origin)?;
    check_rows("steering", &steering_rows(vehicle), origin)?;
    check_rows("powertrain", &powertrain_rows(vehicle), origin)?;
    check_rows("aerodynamics", &aerodynamics_rows(vehicle), origin)
}

fn check_rows(table: &str, rows: &[Row<'_>], origin: &str) -> Result<(), ParameterError> {
    match rows
        .iter()
        .find(|(_, value, interval, _)| !interval.contains(*value))
    {
        None => Ok(()),
        Some((key, value, interval, unit)) => Err(ParameterError::OutOfRange {
            field: format!("{table}.{key}"),
            value: *value,
            range: format!("{interval} {unit}").trim_end().to_owned(),
            origin: origin.to_owned(),
        }),
    }
}

fn mass_rows(vehicle: &VehicleParameters) -> [Row<'_>; 8] {
    let v = &vehicle.mass;
    let inertia = above(0.0, 1e6);
    [
        ("sprung_mass_kg", v.sprung_mass_kg, above(0.0, 1e5), "kg"),
        (
            "unsprung_mass_front_each_kg",
            v.unsprung_mass_front_each_kg,
            above(0.0, 1e4),
            "kg",
        ),
        (
            "unsprung_mass_rear_each_kg",
            v.unsprung_mass_rear_each_kg,
            above(0.0, 1e4),
            "kg",
        ),
        (
            "sprung_roll_inertia_kg_m2",
            v.sprung_roll_inertia_kg_m2,
            inertia,
            "kg m²",
        ),
        (
            "sprung_pitch_inertia_kg_m2",
            v.sprung_pitch_inertia_kg_m2,
            inertia,
            "kg m²",
        ),
        (
            "sprung_yaw_inertia_kg_m2",
            v.sprung_yaw_inertia_kg_m2,
            inertia,
            "kg m²",
        ),
        (
            "sprung_roll_yaw_product_kg_m2",
            v.sprung_roll_yaw_product_kg_m2,
            within(-1e6, 1e6),
            "kg m²",
        ),
        (
            "sprung_cg_height_m",
            v.sprung_cg_height_m,
            above(0.0, 5.0),
            "m",
        ),
    ]
}

fn geometry_rows(vehicle: &VehicleParameters) -> [Row<'_>; 6] {
    let v = &vehicle.geometry;
    let roll_centre = within(-0.5, 2.0);
    [
        (
            "sprung_cg_to_front_axle_m",
            v.sprung_cg_to_front_axle_m,
            above(0.0, 20.0),
            "m",
        ),
        (
            "sprung_cg_to_rear_axle_m",
            v.sprung_cg_to_rear_axle_m,
            above(0.0, 20.0),
            "m",
        ),
        ("track_front_m", v.track_front_m, above(0.0, 5.0), "m"),
        ("track_rear_m", v.track_rear_m, above(0.0, 5.0), "m"),
        (
            "roll_centre_height_front_m",
            v.roll_centre_height_front_m,
            roll_centre,
            "m",
        ),
        (
            "roll_centre_height_rear_m",
            v.roll_centre_height_rear_m,
            roll_centre,
            "m",
        ),
    ]
}

fn suspension_rows(vehicle: &VehicleParameters) -> [Row<'_>; 13] {
    let v = &vehicle.suspension;
    // Below 1000 N/m a spring rate is most likely in N/mm.
    let spring = within(1e3, 1e7);
    let damping = within(0.0, 2e5);
    let anti_roll = within(-1e7, 1e7);
    let camber = within(-5.0, 5.0);
    let (bump_front, rebound_front) = (
        v.damping_bump_front_n_s_per_m,
        v.damping_rebound_front_n_s_per_m,
    );
    let (bump_rear, rebound_rear) = (
        v.damping_bump_rear_n_s_per_m,
        v.damping_rebound_rear_n_s_per_m,
    );
    [
        (
            "spring_rate_front_n_per_m",
            v.spring_rate_front_n_per_m,
            spring,
            "N/m",
        ),
        (
            "spring_rate_rear_n_per_m",
            v.spring_rate_rear_n_per_m,
            spring,
            "N/m",
        ),
        ("damping_bump_front_n_s_per_m", bump_front, damping, "N s/m"),
        (
            "damping_rebound_front_n_s_per_m",
            rebound_front,
            damping,
            "N s/m",
        ),
        ("damping_bump_rear_n_s_per_m", bump_rear, damping, "N s/m"),
        (
            "damping_rebound_rear_n_s_per_m",
            rebound_rear,
            damping,
            "N s/m",
        ),
        (
            "anti_roll_front_nm_per_rad",
            v.anti_roll_front_nm_per_rad,
            anti_roll,
            "N m/rad",
        ),
        (
            "anti_roll_rear_nm_per_rad",
            v.anti_roll_rear_nm_per_rad,
            anti_roll,
            "N m/rad",
        ),
        ("travel_m", v.travel_m, above(0.0, 1.0), "m"),
        (
            "bump_stop_n_per_m",
            v.bump_stop_n_per_m,
            within(0.0, 1e8),
            "N/m",
        ),
        (
            "bump_stop_n_per_m2",
            v.bump_stop_n_per_m2,
            within(0.0, 1e10),
            "N/m²",
        ),
        (
            "camber_gain_front_rad_per_m",
            v.camber_gain_front_rad_per_m,
            camber,
            "rad/m",
        ),
        (
            "camber_gain_rear_rad_per_m",
            v.camber_gain_rear_rad_per_m,
            camber,
            "rad/m",
        ),
    ]
}

fn solid_axle_rows(v: &SolidAxleParameters) -> [Row<'_>; 2] {
    let spacing = above(0.0, 5.0);
    [
        ("spring_spacing_m", v.spring_spacing_m, spacing, "m"),
        ("damper_spacing_m", v.damper_spacing_m, spacing, "m"),
    ]
}

fn tyre_rows(vehicle: &VehicleParameters) -> [Row<'_>; 18] {
    let v = &vehicle.tyre;
    let radial = within(1e4, 1e8);
    let (radial_front, radial_rear) = (
        v.vertical_stiffness_front_n_per_m,
        v.vertical_stiffness_rear_n_per_m,
    );
    // Shorter lengths make the slip faster than the 1 ms step can follow at speed.
    let relaxation = within(0.05, 5.0);
    let (lateral, longitudinal) = (
        v.relaxation_length_lateral_m,
        v.relaxation_length_longitudinal_m,
    );
    let rolling = v.rolling_resistance_coefficient;
    [
        (
            "unloaded_radius_m",
            v.unloaded_radius_m,
            above(0.05, 2.0),
            "m",
        ),
        (
            "vertical_stiffness_front_n_per_m",
            radial_front,
            radial,
            "N/m",
        ),
        (
            "vertical_stiffness_rear_n_per_m",
            radial_rear,
            radial,
            "N/m",
        ),
        (
            "twin_spacing_rear_m",
            v.twin_spacing_rear_m,
            within(0.0, 1.0),
            "m",
        ),
        ("crown_radius_m", v.crown_radius_m, within(0.0, 2.0), "m"),
        (
            "lateral_compliance_m_per_n",
            v.lateral_compliance_m_per_n,
            within(0.0, 1e-3),
            "m/N",
        ),
        (
            "vertical_damping_n_s_per_m",
            v.vertical_damping_n_s_per_m,
            within(0.0, 1e5),
            "N s/m",
        ),
        ("mu_tyre", v.mu_tyre, above(0.0, 3.0), ""),
        (
            "stiffness_factor_b1_front",
            v.stiffness_factor_b1_front,
            above(0.0, 100.0),
            "",
        ),
        (
            "stiffness_factor_b1_rear",
            v.stiffness_factor_b1_rear,
            above(0.0, 100.0),
            "",
        ),
        // Beyond C1 = 2 the force would change sign with growing slip.
        ("shape_factor_c1", v.shape_factor_c1, within(0.5, 2.0), ""),
        (
            "curvature_factor_e1",
            v.curvature_factor_e1,
            within(-20.0, 1.0),
            "",
        ),
        (
            "stiffness_saturation_c2",
            v.stiffness_saturation_c2,
            within(0.0, 20.0),
            "",
        ),
        ("q_load", v.q_load, within(0.0, 2.0), ""),
        (
            "camber_thrust_ratio",
            v.camber_thrust_ratio,
            within(-1.0, 1.0),
            "",
        ),
        ("relaxation_length_lateral_m", lateral, relaxation, "m"),
        (
            "relaxation_length_longitudinal_m",
            longitudinal,
            relaxation,
            "m",
        ),
        (
            "rolling_resistance_coefficient",
            rolling,
            within(0.0, 0.5),
            "",
        ),
    ]
}

fn wheel_rows(vehicle: &VehicleParameters) -> [Row<'_>; 4] {
    let v = &vehicle.wheel;
    let (front, rear) = (v.spin_inertia_front_kg_m2, v.spin_inertia_rear_kg_m2);
    // The bare wheel is a part of what resists spinning up.
    let unit = "kg m² (at most the spin inertia)";
    [
        (
            "spin_inertia_front_kg_m2",
            front,
            within(0.05, 1e3),
            "kg m²",
        ),
        ("spin_inertia_rear_kg_m2", rear, within(0.05, 1e3), "kg m²"),
        (
            "gyroscopic_inertia_front_kg_m2",
            v.gyroscopic_inertia_front_kg_m2,
            within(0.0, front),
            unit,
        ),
        (
            "gyroscopic_inertia_rear_kg_m2",
            v.gyroscopic_inertia_rear_kg_m2,
            within(0.0, rear),
            unit,
        ),
    ]
}

fn steering_rows(vehicle: &VehicleParameters) -> [Row<'_>; 5] {
    let v = &vehicle.steering;
    let rate = v.handwheel_rate_limit_deg_per_s;
    [
        ("ratio", v.ratio, within(1.0, 60.0), ""),
        ("bandwidth_hz", v.bandwidth_hz, within(0.2, 50.0), "Hz"),
        ("damping_ratio", v.damping_ratio, within(0.1, 5.0), ""),
        (
            "handwheel_rate_limit_deg_per_s",
            rate,
            above(0.0, 1e4),
            "deg/s",
        ),
        (
            "handwheel_limit_deg",
            v.handwheel_limit_deg,
            above(0.0, 2e3),
            "deg",
        ),
    ]
}

fn powertrain_rows(vehicle: &VehicleParameters) -> [Row<'_>; 10] {
    let v = &vehicle.powertrain;
    let share = within(0.0, 1.0);
    let lag = within(0.005, 10.0);
    let coupling = v.differential_coupling_nm_s_per_rad;
    let integral = v.speed_integral_gain_per_s2;
    [
        // Below 1000 W a power is most likely in kW.
        ("max_power_w", v.max_power_w, within(1e3, 1e7), "W"),
        (
            "max_drive_force_n",
            v.max_drive_force_n,
            above(0.0, 1e7),
            "N",
        ),
        ("drive_share_front", v.drive_share_front, share, ""),
        ("engine_lag_s", v.engine_lag_s, lag, "s"),
        (
            "differential_coupling_nm_s_per_rad",
            coupling,
            within(0.0, 500.0),
            "N m s/rad",
        ),
        (
            "max_brake_force_n",
            v.max_brake_force_n,
            above(0.0, 1e7),
            "N",
        ),
        ("brake_share_front", v.brake_share_front, share, ""),
        ("brake_lag_s", v.brake_lag_s, lag, "s"),
        (
            "speed_gain_per_s",
            v.speed_gain_per_s,
            above(0.0, 20.0),
            "1/s",
        ),
        (
            "speed_integral_gain_per_s2",
            integral,
            within(0.0, 20.0),
            "1/s²",
        ),
    ]
}

fn aerodynamics_rows(vehicle: &VehicleParameters) -> [Row<'_>; 2] {
    let v = &vehicle.aerodynamics;
    [
        ("drag_area_m2", v.drag_area_m2, within(0.0, 50.0), "m²"),
        (
            "air_density_kg_per_m3",
            v.air_density_kg_per_m3,
            within(0.0, 5.0),
            "kg/m³",
        ),
    ]
}
