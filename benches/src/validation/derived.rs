//! Figures derived from a vehicle's parameters against its simulation.

use anyhow::Result;
use nalgebra::Vector3;
use vehicle_dyn::parameters::{Mode, VehicleParameters};
use vehicle_dyn::simulation::{Command, Observation, Simulation, State};
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2};

use super::Row;
use super::mechanics::{AT_REST, FRICTION, on_flat};

const SPEED_KMH: f64 = 70.0;

/// Gradients of steady turns and frequencies of free swings.
///
/// # Errors
/// When a simulation fails.
pub fn rows(vehicle: &VehicleParameters) -> Result<Vec<Row>> {
    let mut rows = gradients(vehicle)?;
    rows.extend(frequencies(vehicle)?);
    Ok(rows)
}

/// The vehicle without drag, rolling resistance and differential: a steady turn needs no drive, and the
/// axles' slip angles alone make it understeer, as the derived gradient assumes.
pub(super) fn free_rolling(vehicle: &VehicleParameters) -> VehicleParameters {
    let mut vehicle = vehicle.clone();
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    vehicle.tyre.rolling_resistance_coefficient = 0.0;
    vehicle.powertrain.differential_coupling_nm_s_per_rad = 0.0;
    vehicle
}

/// A steady turn at little lateral acceleration.
fn steady_turn(vehicle: &VehicleParameters) -> Result<Observation> {
    const HANDWHEEL_DEG: f64 = 5.0;
    let mut simulation = on_flat(&free_rolling(vehicle), FRICTION, SPEED_KMH / 3.6)?;
    for tick in 1..=100 {
        let angle = HANDWHEEL_DEG * 0.01 * f64::from(tick);
        simulation.step(Command::from_deg_kmh(angle, SPEED_KMH), 0.01)?;
    }
    Ok(simulation.step(Command::from_deg_kmh(HANDWHEEL_DEG, SPEED_KMH), 10.0)?)
}

fn gradients(vehicle: &VehicleParameters) -> Result<Vec<Row>> {
    let derived = vehicle.cornering_figures(FRICTION);
    let seen = steady_turn(vehicle)?;
    let acceleration_g = seen.lateral_acceleration_m_s2 / GRAVITY_M_S2;
    let curve = vehicle.derived().wheelbase_m * seen.yaw_rate_rad_s / seen.speed_m_s;
    Ok(vec![
        Row::relative(
            "roll gradient of a steady turn: the derived figure",
            "deg/g",
            derived.roll_gradient_deg_per_g,
            2.0,
            seen.roll_rad / DEGREE / acceleration_g,
        ),
        Row::relative(
            "LTR per lateral acceleration of a steady turn: the derived figure",
            "1/g",
            derived.ltr_per_g,
            2.0,
            seen.ltr / acceleration_g,
        ),
        Row::relative(
            "understeer gradient of a steady turn: the derived figure",
            "deg/g",
            derived.understeer_gradient_deg_per_g,
            5.0,
            (seen.road_wheel_rad - curve) / DEGREE / acceleration_g,
        ),
    ])
}

fn undamped(vehicle: &VehicleParameters) -> VehicleParameters {
    let mut vehicle = vehicle.clone();
    let suspension = &mut vehicle.suspension;
    suspension.damping_bump_front_n_s_per_m = 0.0;
    suspension.damping_rebound_front_n_s_per_m = 0.0;
    suspension.damping_bump_rear_n_s_per_m = 0.0;
    suspension.damping_rebound_rear_n_s_per_m = 0.0;
    vehicle.tyre.vertical_damping_n_s_per_m = 0.0;
    vehicle
}

/// A frequency: its name, the derived mode, what sets it swinging and what is watched.
type Swing = (&'static str, Mode, fn(&mut State), fn(&Simulation) -> f64);

fn frequencies(vehicle: &VehicleParameters) -> Result<Vec<Row>> {
    let modes = vehicle.natural_modes();
    let free = undamped(vehicle);
    let swings: [Swing; 3] = [
        (
            "heave",
            modes.heave,
            |state| state.velocity_m_s.z += 0.05,
            |simulation| simulation.state().position_m.z,
        ),
        (
            "pitch",
            modes.pitch,
            |state| state.angular_rad_s = Vector3::new(0.0, 0.02, 0.0),
            |simulation| simulation.observation().pitch_rad,
        ),
        (
            "roll",
            modes.roll,
            |state| state.angular_rad_s = Vector3::new(0.05, 0.0, 0.0),
            |simulation| simulation.observation().roll_rad,
        ),
    ];
    swings
        .into_iter()
        .map(|(name, mode, disturb, signal)| {
            let found = strongest_hz(&swing(&free, disturb, signal)?, mode.frequency_hz);
            Ok(Row::relative(
                format!("frequency of a free {name} without dampers: the derived figure"),
                "Hz",
                mode.frequency_hz,
                2.0,
                found,
            ))
        })
        .collect()
}

const SAMPLE_S: f64 = 0.02;
/// Long enough to tell modes apart that lie 0.07 Hz from each other.
const SAMPLES: u32 = 3000;

fn swing(
    vehicle: &VehicleParameters,
    disturb: fn(&mut State),
    signal: fn(&Simulation) -> f64,
) -> Result<Vec<f64>> {
    let mut simulation = on_flat(vehicle, 0.0, 0.0)?;
    let rest = signal(&simulation);
    let mut state = *simulation.state();
    disturb(&mut state);
    simulation.set_state(state)?;
    (0..SAMPLES)
        .map(|_| {
            simulation.step(AT_REST, SAMPLE_S)?;
            Ok(signal(&simulation) - rest)
        })
        .collect()
}

/// The strongest frequency within 20 % of `around_hz`, Hz.
fn strongest_hz(signal: &[f64], around_hz: f64) -> f64 {
    const STEPS: i32 = 200;
    let power = |hertz: f64| {
        let omega = std::f64::consts::TAU * hertz * SAMPLE_S;
        let (mut re, mut im) = (0.0, 0.0);
        for (k, value) in signal.iter().enumerate() {
            // A Hann window keeps neighbours apart.
            let share = (k as f64 + 0.5) / signal.len() as f64;
            let weight = value * (std::f64::consts::PI * share).sin().powi(2);
            let (sin, cos) = (omega * k as f64).sin_cos();
            re += weight * cos;
            im += weight * sin;
        }
        re * re + im * im
    };
    let mut best = (f64::NAN, f64::NEG_INFINITY);
    for step in -STEPS..=STEPS {
        let hertz = around_hz * (1.0 + 0.2 * f64::from(step) / f64::from(STEPS));
        let found = power(hertz);
        if found > best.1 {
            best = (hertz, found);
        }
    }
    best.0
}
