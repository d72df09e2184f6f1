//! The derived figures of every embedded vehicle against its simulation.

mod common;

use common::{TICK_S, on_flat};
use nalgebra::Vector3;
use vehicle_dyn::parameters::{Mode, VehicleParameters};
use vehicle_dyn::simulation::{Command, LongitudinalDemand, Observation, Simulation};
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2, KMH};
use vehicle_dyn::vehicles;

const FRICTION: f64 = 0.85;
const NO_COMMAND: Command = Command {
    handwheel_rad: 0.0,
    longitudinal: LongitudinalDemand::Released,
};

fn all() -> impl Iterator<Item = VehicleParameters> {
    vehicles::names()
        .into_iter()
        .map(|name| vehicles::embedded(name).expect("valid"))
}

/// Without drag, rolling resistance and differential: nothing has to be driven in a steady turn.
fn coasting(vehicle: &VehicleParameters) -> VehicleParameters {
    let mut vehicle = vehicle.clone();
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    vehicle.tyre.rolling_resistance_coefficient = 0.0;
    vehicle.powertrain.differential_coupling_nm_s_per_rad = 0.0;
    vehicle
}

fn assert_near(vehicle: &VehicleParameters, what: &str, found: f64, derived: f64, tolerance: f64) {
    println!(
        "{:14} {what:22} simulated {found:9.4}, derived {derived:9.4}, {:+.2} %",
        vehicle.name,
        (found / derived - 1.0) * 100.0
    );
    assert!(
        (found / derived - 1.0).abs() < tolerance,
        "{}: {what}: {found} simulated, {derived} derived",
        vehicle.name
    );
}

/// A steady turn: the handwheel held for 12 s at a held speed.
fn steady(vehicle: &VehicleParameters, handwheel_deg: f64, speed_kmh: f64) -> Observation {
    let mut simulation = on_flat(vehicle, FRICTION, speed_kmh);
    simulation
        .step(Command::from_deg_kmh(0.0, speed_kmh), 5.0)
        .expect("finite");
    for tick in 1..=100 {
        let angle = handwheel_deg * 0.01 * f64::from(tick);
        simulation
            .step(Command::from_deg_kmh(angle, speed_kmh), TICK_S)
            .expect("finite");
    }
    simulation
        .step(Command::from_deg_kmh(handwheel_deg, speed_kmh), 10.0)
        .expect("finite")
}

/// ISO 4138 with constant speed, in the linear range: two steady turns near 0.04 g.
#[test]
fn roll_gradient_load_transfer_and_understeer_gradient_are_those_of_steady_turns() {
    for vehicle in all() {
        let derived = vehicle.cornering_figures(FRICTION);
        let speed_kmh = 70.0;
        let seen = steady(&coasting(&vehicle), 5.0, speed_kmh);
        let acceleration_g = seen.lateral_acceleration_m_s2 / GRAVITY_M_S2;
        assert!(acceleration_g > 0.01 && acceleration_g < 0.1);
        let gradient = seen.roll_rad / DEGREE / acceleration_g;
        assert_near(
            &vehicle,
            "roll gradient",
            gradient,
            derived.roll_gradient_deg_per_g,
            0.02,
        );
        let ltr = seen.ltr / acceleration_g;
        assert_near(&vehicle, "load transfer", ltr, derived.ltr_per_g, 0.02);
        let wheelbase = vehicle.derived().wheelbase_m;
        let curve = wheelbase * seen.yaw_rate_rad_s / seen.speed_m_s;
        let understeer = (seen.road_wheel_rad - curve) / DEGREE / acceleration_g;
        assert_near(
            &vehicle,
            "understeer gradient",
            understeer,
            derived.understeer_gradient_deg_per_g,
            0.05,
        );
        let loads = seen.wheel_loads_n;
        let front = (loads[1] - loads[0]) / (loads[1] - loads[0] + loads[3] - loads[2]);
        let share = derived.load_transfer_share_front;
        assert_near(&vehicle, "front share", front, share, 0.02);
    }
}

/// Without dampers, for the frequency is that without damping.
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

/// The strongest frequency between two frequencies in a signal, Hz.
fn strongest_hz(signal: &[f64], sample_s: f64, low: f64, high: f64) -> f64 {
    let count = signal.len() as f64;
    let power = |hertz: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (k, value) in signal.iter().enumerate() {
            let share = (k as f64 + 0.5) / count;
            // A Hann window keeps neighbours apart.
            let weight = value * (std::f64::consts::PI * share).sin().powi(2);
            let (sin, cos) = (std::f64::consts::TAU * hertz * k as f64 * sample_s).sin_cos();
            re += weight * cos;
            im += weight * sin;
        }
        re * re + im * im
    };
    let steps = 400;
    (0..=steps)
        .map(|step| low + (high - low) * f64::from(step) / f64::from(steps))
        .max_by(|a, b| power(*a).total_cmp(&power(*b)))
        .expect("not empty")
}

/// Lets the vehicle swing from a disturbed state on ground without friction and samples it.
fn swing(
    vehicle: &VehicleParameters,
    disturb: impl Fn(&mut vehicle_dyn::simulation::State),
    signal: impl Fn(&Simulation) -> f64,
    sample_s: f64,
    duration_s: f64,
) -> Vec<f64> {
    let mut simulation = on_flat(vehicle, 0.0, 0.0);
    let rest = signal(&simulation);
    let mut state = *simulation.state();
    disturb(&mut state);
    simulation.set_state(state).expect("finite");
    let mut seen = Vec::new();
    while simulation.time_s() < duration_s {
        simulation.step(NO_COMMAND, sample_s).expect("finite");
        seen.push(signal(&simulation) - rest);
    }
    seen
}

#[test]
fn natural_frequencies_are_those_of_the_free_vehicle() {
    // Heave and pitch of the sedan lie 0.07 Hz apart.
    const BODY_S: f64 = 0.02;
    const DURATION_S: f64 = 60.0;
    for vehicle in all() {
        let modes = vehicle.natural_modes();
        let free = undamped(&vehicle);
        let near = |what: &str, mode: Mode, (sample_s, signal): (f64, Vec<f64>)| {
            let frequency = mode.frequency_hz;
            let found = strongest_hz(&signal, sample_s, 0.8 * frequency, 1.2 * frequency);
            assert_near(&vehicle, what, found, frequency, 0.02);
        };
        let heave = swing(
            &free,
            |state| state.velocity_m_s.z += 0.05,
            |s| s.state().position_m.z,
            BODY_S,
            DURATION_S,
        );
        near("heave", modes.heave, (BODY_S, heave));
        let pitch = swing(
            &free,
            |state| state.angular_rad_s = Vector3::new(0.0, 0.02, 0.0),
            |s| s.observation().pitch_rad,
            BODY_S,
            DURATION_S,
        );
        near("pitch", modes.pitch, (BODY_S, pitch));
        let roll = swing(
            &free,
            |state| state.angular_rad_s = Vector3::new(0.05, 0.0, 0.0),
            |s| s.observation().roll_rad,
            BODY_S,
            DURATION_S,
        );
        near("roll", modes.roll, (BODY_S, roll));
        let hop = |wheel: usize| {
            swing(
                &free,
                |state| {
                    state.travel_rate_m_s[wheel] = 0.05;
                    state.travel_rate_m_s[wheel + 1] = 0.05;
                },
                |s| s.state().travel_m[wheel] + s.state().travel_m[wheel + 1],
                1e-3,
                3.0,
            )
        };
        near("front hop", modes.hop_front, (1e-3, hop(0)));
        near("rear hop", modes.hop_rear, (1e-3, hop(2)));
    }
}

/// Decay of the roll of a damped vehicle from its energy-like envelope, as a damping ratio.
#[test]
fn the_roll_damping_ratio_is_that_of_the_decay() {
    for vehicle in all() {
        let mode = vehicle.natural_modes().roll;
        let mut even = vehicle.clone();
        // The linear ratio has the mean of bump and rebound.
        let suspension = &mut even.suspension;
        let front = 0.5
            * (suspension.damping_bump_front_n_s_per_m
                + suspension.damping_rebound_front_n_s_per_m);
        let rear = 0.5
            * (suspension.damping_bump_rear_n_s_per_m + suspension.damping_rebound_rear_n_s_per_m);
        suspension.damping_bump_front_n_s_per_m = front;
        suspension.damping_rebound_front_n_s_per_m = front;
        suspension.damping_bump_rear_n_s_per_m = rear;
        suspension.damping_rebound_rear_n_s_per_m = rear;
        let rates = swing(
            &even,
            |state| state.angular_rad_s = Vector3::new(0.05, 0.0, 0.0),
            |s| s.observation().roll_rad,
            1e-3,
            4.0,
        );
        // The first two peaks to the two sides.
        let peaks: Vec<f64> = rates
            .windows(3)
            .filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0)
            .map(|w| w[1].abs())
            .take(2)
            .collect();
        let decrement = (peaks[0] / peaks[1]).ln() / std::f64::consts::PI;
        let found = decrement / (1.0 + decrement * decrement).sqrt();
        assert_near(&vehicle, "roll damping", found, mode.damping_ratio, 0.15);
    }
}

/// The quasi-static lift-off against a slowly tightening turn on a road with grip to spare.
#[test]
fn the_lift_off_is_that_of_a_slowly_tightening_turn() {
    for vehicle in all() {
        let derived = vehicle.cornering_figures(2.0);
        let mut grippy = vehicle.clone();
        grippy.tyre.q_load = 0.0;
        let speed_kmh = 70.0;
        let mut simulation = on_flat(&grippy, 2.0, speed_kmh);
        let mut angle = 0.0;
        let lifted_g = loop {
            let seen = simulation
                .step(Command::from_deg_kmh(angle, speed_kmh), TICK_S)
                .expect("finite");
            if seen.two_wheel_lift() {
                break seen.lateral_acceleration_m_s2 / GRAVITY_M_S2;
            }
            assert!(seen.roll_rad.abs() < 0.5 && angle < 300.0, "{seen:?}");
            angle += 5.0 * TICK_S;
        };
        assert_near(&vehicle, "lift-off", lifted_g, derived.lift_off_g, 0.06);
    }
}

#[test]
fn characteristic_speed_is_where_the_yaw_gain_is_largest() {
    for vehicle in all() {
        let Some(speed) = vehicle.cornering_figures(FRICTION).characteristic_speed_m_s else {
            continue;
        };
        // r/δ = v/(L + K v²) is largest at √(L/K), where it is v/(2 L).
        let seen = steady(&coasting(&vehicle), 2.0, speed / KMH);
        let gain = seen.yaw_rate_rad_s / seen.road_wheel_rad;
        let expected = speed / (2.0 * vehicle.derived().wheelbase_m);
        assert_near(&vehicle, "yaw gain", gain, expected, 0.03);
    }
}

#[test]
fn the_top_speed_is_what_full_power_reaches() {
    for vehicle in all() {
        let figures = vehicle.figures(FRICTION);
        let top = figures
            .iter()
            .find(|figure| figure.name == "top speed by power")
            .expect("listed")
            .value;
        let mut simulation = on_flat(&vehicle, 1.0, 0.95 * top);
        let command = Command {
            handwheel_rad: 0.0,
            longitudinal: LongitudinalDemand::Acceleration(50.0),
        };
        let mut seen = simulation.observation();
        for _ in 0..18 {
            seen = simulation.step(command, 10.0).expect("finite");
        }
        // Slip of the driven wheels takes a little.
        assert_near(&vehicle, "top speed", seen.speed_kmh(), top, 0.03);
    }
}
