//! From a parameter set of the reference model to a vehicle of ours, by fixed rules.
//!
//! Nothing is fitted: each value is the reference's own, or follows from it. What the reference does
//! not have is switched off: relaxation (at its least), rolling resistance, drag, gyroscopic
//! moments, lags, stops. What it has and we do not is left out: the sideways compliance between body
//! and axle, and the tyre's shifts by the sign of the camber.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Deserialize;
use vehicle_dyn::parameters::{
    AerodynamicParameters, GeometryParameters, MassParameters, PowertrainParameters,
    SteeringParameters, SuspensionParameters, TyreParameters, VehicleParameters, WheelParameters,
};
use vehicle_dyn::units::GRAVITY_M_S2;

/// Parameters of the `CommonRoad` multi-body model, by its own names (SI units; its axes are y to the
/// right and z down). What the conversion does not need is not read.
#[allow(non_snake_case, reason = "names of the reference")]
#[derive(Debug, Clone, Deserialize)]
pub struct ReferenceParameters {
    m: f64,
    m_s: f64,
    m_uf: f64,
    m_ur: f64,
    a: f64,
    b: f64,
    I_Phi_s: f64,
    I_y_s: f64,
    I_z: f64,
    I_xz_s: f64,
    K_sf: f64,
    K_sdf: f64,
    K_sr: f64,
    K_sdr: f64,
    T_f: f64,
    T_r: f64,
    K_tsf: f64,
    K_tsr: f64,
    K_zt: f64,
    h_raf: f64,
    h_rar: f64,
    h_s: f64,
    I_y_w: f64,
    K_lt: f64,
    R_w: f64,
    T_sb: f64,
    T_se: f64,
    D_f: f64,
    D_r: f64,
    tire: ReferenceTyre,
}

/// The lateral coefficients of the reference's tyre that the conversion needs.
#[allow(clippy::struct_field_names, reason = "names of the reference")]
#[derive(Debug, Clone, Deserialize)]
struct ReferenceTyre {
    p_cy1: f64,
    p_dy1: f64,
    p_ey1: f64,
    p_ky1: f64,
    p_hy3: f64,
    p_vy3: f64,
}

/// Least relaxation length a vehicle may have, m: the reference has none.
const LEAST_RELAXATION_M: f64 = 0.05;
/// Fastest lags and actuators a vehicle may have: the reference has none.
const LEAST_LAG_S: f64 = 0.005;
const FASTEST_ACTUATOR_HZ: f64 = 50.0;

impl ReferenceParameters {
    /// Reads a `NAME.parameters.json`.
    ///
    /// # Errors
    /// When the file is missing or lacks a parameter.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read the parameters {}", path.display()))?;
        serde_json::from_str(&text)
            .with_context(|| format!("{} is no parameter set of the model", path.display()))
    }

    /// Reads a `NAME.parameters.json` and converts it to a vehicle that passes every check.
    ///
    /// # Errors
    /// As [`Self::read`], and when what the set converts to is no possible vehicle.
    pub fn read_vehicle(path: &Path, name: &str) -> Result<VehicleParameters> {
        let vehicle = Self::read(path)?.vehicle(name);
        vehicle.check().with_context(|| {
            format!(
                "{} converts to no possible vehicle: fields below are those of the converted one, \
                 computed by the rules in benches/src/reference/parameters.rs",
                path.display()
            )
        })?;
        Ok(vehicle)
    }

    /// The vehicle with these parameters.
    #[must_use]
    pub fn vehicle(&self, name: &str) -> VehicleParameters {
        let wheelbase = self.a + self.b;
        // The reference measures heights with unpressed tyres, and stands lower at rest.
        let [load_front, load_rear] = self.reference_loads_n();
        let (sunk_front, sunk_rear) = (load_front / self.K_zt, load_rear / self.K_zt);
        let sunk = (self.b * sunk_front + self.a * sunk_rear) / wheelbase;
        // `a` and `b` are those of the whole vehicle in the reference's yaw equation.
        let to_front = (self.m * self.a - self.m_ur * wheelbase) / self.m_s;
        VehicleParameters {
            name: name.to_owned(),
            description: format!("{name} of the CommonRoad multi-body model, converted"),
            mass: self.mass(sunk),
            geometry: GeometryParameters {
                sprung_cg_to_front_axle_m: to_front,
                sprung_cg_to_rear_axle_m: wheelbase - to_front,
                track_front_m: self.T_f,
                track_rear_m: self.T_r,
                roll_centre_height_front_m: self.h_raf - sunk_front,
                roll_centre_height_rear_m: self.h_rar - sunk_rear,
            },
            suspension: self.suspension(),
            tyre: self.tyre(),
            wheel: WheelParameters {
                spin_inertia_front_kg_m2: self.I_y_w,
                spin_inertia_rear_kg_m2: self.I_y_w,
                gyroscopic_inertia_front_kg_m2: 0.0,
                gyroscopic_inertia_rear_kg_m2: 0.0,
            },
            // The reference commands the angle of the front wheels.
            steering: SteeringParameters {
                ratio: 1.0,
                bandwidth_hz: FASTEST_ACTUATOR_HZ,
                damping_ratio: 0.8,
                handwheel_rate_limit_deg_per_s: 1e4,
                handwheel_limit_deg: 60.0,
            },
            powertrain: PowertrainParameters {
                max_power_w: 1e7,
                max_drive_force_n: 1e6,
                drive_share_front: self.T_se,
                engine_lag_s: LEAST_LAG_S,
                differential_coupling_nm_s_per_rad: 0.0,
                max_brake_force_n: 1e6,
                brake_share_front: self.T_sb,
                brake_lag_s: LEAST_LAG_S,
                speed_gain_per_s: 2.0,
                speed_integral_gain_per_s2: 0.0,
            },
            aerodynamics: AerodynamicParameters {
                drag_area_m2: 0.0,
                air_density_kg_per_m3: 1.2,
            },
            driver: None,
        }
    }

    /// Loads of one front and one rear wheel at rest in the reference, N. They are not quite those of
    /// its centre of gravity: it puts the *sprung* mass at `a` and `b`.
    fn reference_loads_n(&self) -> [f64; 2] {
        let wheelbase = self.a + self.b;
        [(self.b, self.m_uf), (self.a, self.m_ur)]
            .map(|(arm, unsprung)| 0.5 * GRAVITY_M_S2 * (self.m_s * arm / wheelbase + unsprung))
    }

    fn mass(&self, sunk_m: f64) -> MassParameters {
        let (half_front, half_rear) = (0.5 * self.T_f, 0.5 * self.T_r);
        // Wheels, and the body's centre off the whole vehicle's.
        let wheelbase = self.a + self.b;
        let to_front = (self.m * self.a - self.m_ur * wheelbase) / self.m_s;
        let wheels = self.m_uf * (self.a * self.a + half_front * half_front)
            + self.m_ur * (self.b * self.b + half_rear * half_rear)
            + self.m_s * (self.a - to_front).powi(2);
        MassParameters {
            sprung_mass_kg: self.m_s,
            unsprung_mass_front_each_kg: 0.5 * self.m_uf,
            unsprung_mass_rear_each_kg: 0.5 * self.m_ur,
            sprung_roll_inertia_kg_m2: self.I_Phi_s,
            sprung_pitch_inertia_kg_m2: self.I_y_s,
            sprung_yaw_inertia_kg_m2: self.I_z - wheels,
            // z down becomes z up.
            sprung_roll_yaw_product_kg_m2: -self.I_xz_s,
            sprung_cg_height_m: self.h_s - sunk_m,
        }
    }

    fn suspension(&self) -> SuspensionParameters {
        SuspensionParameters {
            spring_rate_front_n_per_m: self.K_sf,
            spring_rate_rear_n_per_m: self.K_sr,
            damping_bump_front_n_s_per_m: self.K_sdf,
            damping_rebound_front_n_s_per_m: self.K_sdf,
            damping_bump_rear_n_s_per_m: self.K_sdr,
            damping_rebound_rear_n_s_per_m: self.K_sdr,
            anti_roll_front_nm_per_rad: -self.K_tsf,
            anti_roll_rear_nm_per_rad: -self.K_tsr,
            travel_m: 1.0,
            bump_stop_n_per_m: 0.0,
            bump_stop_n_per_m2: 0.0,
            camber_gain_front_rad_per_m: -self.D_f,
            camber_gain_rear_rad_per_m: -self.D_r,
            solid_axle_front: None,
            solid_axle_rear: None,
        }
    }

    fn tyre(&self) -> TyreParameters {
        let tyre = &self.tire;
        let stiffness = tyre.p_ky1.abs();
        let b1 = stiffness / (tyre.p_cy1 * tyre.p_dy1);
        // Cornering stiffness grows with the load; each axle keeps the one it has in the reference.
        let [reference_front, reference_rear] = self.reference_loads_n();
        let share = 0.5 * self.m * GRAVITY_M_S2 / (self.a + self.b);
        let (load_front, load_rear) = (share * self.b, share * self.a);
        TyreParameters {
            unloaded_radius_m: self.R_w,
            vertical_stiffness_front_n_per_m: self.K_zt,
            vertical_stiffness_rear_n_per_m: self.K_zt,
            twin_spacing_rear_m: 0.0,
            // The reference's contact does not move with the camber.
            crown_radius_m: self.R_w,
            lateral_compliance_m_per_n: self.K_lt,
            vertical_damping_n_s_per_m: 0.0,
            mu_tyre: tyre.p_dy1,
            stiffness_factor_b1_front: b1 * reference_front / load_front,
            stiffness_factor_b1_rear: b1 * reference_rear / load_rear,
            shape_factor_c1: tyre.p_cy1,
            curvature_factor_e1: tyre.p_ey1,
            stiffness_saturation_c2: 0.0,
            q_load: 0.0,
            // The reference pushes away from the lean: side force per load and rad of camber, over
            // side force per load and rad of slip.
            camber_thrust_ratio: (tyre.p_ky1 * tyre.p_hy3 + tyre.p_vy3) / stiffness,
            relaxation_length_lateral_m: LEAST_RELAXATION_M,
            relaxation_length_longitudinal_m: LEAST_RELAXATION_M,
            rolling_resistance_coefficient: 0.0,
        }
    }
}
