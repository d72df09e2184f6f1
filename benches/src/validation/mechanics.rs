//! A vehicle against mechanics: weight, symmetry, the tilt table, energy and momentum, the step.

use anyhow::{Result, ensure};
use nalgebra::Vector3;
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::{
    Command, DEFAULT_SUBSTEP_S, InitialPose, LongitudinalDemand, Observation, Simulation,
};
use vehicle_dyn::terrain::Terrain;
use vehicle_dyn::units::GRAVITY_M_S2;

use super::Row;

pub(super) const TICK_S: f64 = 0.01;
pub(super) const FRICTION: f64 = 0.85;
pub(super) const AT_REST: Command = Command {
    handwheel_rad: 0.0,
    longitudinal: LongitudinalDemand::Released,
};

pub(super) fn on_flat(
    vehicle: &VehicleParameters,
    friction: f64,
    speed_m_s: f64,
) -> Result<Simulation> {
    with_substep(vehicle, friction, speed_m_s, DEFAULT_SUBSTEP_S)
}

pub(super) fn with_substep(
    vehicle: &VehicleParameters,
    friction: f64,
    speed_m_s: f64,
    substep_s: f64,
) -> Result<Simulation> {
    let pose = InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s,
    };
    let ground = Terrain::flat(friction);
    Ok(Simulation::with_substep(vehicle, ground, pose, substep_s)?)
}

/// All checks of this module.
///
/// # Errors
/// When a simulation fails.
pub fn rows(vehicle: &VehicleParameters) -> Result<Vec<Row>> {
    Ok(vec![
        weight(vehicle)?,
        symmetry(vehicle)?,
        tilt_table(vehicle)?,
        roll_decay(vehicle)?,
        flight(vehicle)?,
        halved_step(vehicle)?,
    ])
}

fn weight(vehicle: &VehicleParameters) -> Result<Row> {
    let loads = on_flat(vehicle, FRICTION, 0.0)?.observation().wheel_loads_n;
    let weight = vehicle.derived().total_mass_kg * GRAVITY_M_S2;
    Ok(Row::absolute(
        "sum of the wheel loads at rest over m g",
        "",
        1.0,
        1e-6,
        loads.iter().sum::<f64>() / weight,
    ))
}

/// Handwheel over time that swings to both sides and ends in a hold.
fn swing(vehicle: &VehicleParameters, time_s: f64) -> f64 {
    // About 0.5 g at 25 m/s on any wheelbase.
    let wheelbase = vehicle.derived().wheelbase_m;
    let amplitude = vehicle.steering.ratio * wheelbase * 0.5 * GRAVITY_M_S2 / (25.0 * 25.0);
    amplitude * (std::f64::consts::TAU * 0.5 * time_s.min(3.5)).sin()
}

fn drive(
    mut simulation: Simulation,
    vehicle: &VehicleParameters,
    sign: f64,
) -> Result<Vec<Observation>> {
    let mut seen = Vec::with_capacity(600);
    for tick in 0..600 {
        let command = Command {
            handwheel_rad: sign * swing(vehicle, TICK_S * f64::from(tick)),
            longitudinal: LongitudinalDemand::TargetSpeed(25.0),
        };
        seen.push(simulation.step(command, TICK_S)?);
    }
    Ok(seen)
}

fn symmetry(vehicle: &VehicleParameters) -> Result<Row> {
    let left = drive(on_flat(vehicle, FRICTION, 25.0)?, vehicle, 1.0)?;
    let right = drive(on_flat(vehicle, FRICTION, 25.0)?, vehicle, -1.0)?;
    let difference = left.iter().zip(&right).fold(0.0_f64, |largest, (l, r)| {
        largest.max((l.ltr + r.ltr).abs())
    });
    Ok(Row::absolute(
        "LTR plus LTR of mirrored steering, largest",
        "",
        0.0,
        1e-9,
        difference,
    ))
}

/// The vehicle with springs, bars and tyres so hard that nothing leans: what is left is geometry.
fn rigid(vehicle: &VehicleParameters) -> VehicleParameters {
    // The hardest a vehicle file may have.
    const HARDEST_SPRING_N_PER_M: f64 = 1e7;
    let mut vehicle = vehicle.clone();
    // As hard as the step of 1 ms allows for the lighter wheels.
    let unsprung = vehicle
        .mass
        .unsprung_mass_front_each_kg
        .min(vehicle.mass.unsprung_mass_rear_each_kg);
    let spring = (1.2e5 * unsprung).min(HARDEST_SPRING_N_PER_M);
    let tyre = (2.5e5 * unsprung).min(HARDEST_SPRING_N_PER_M);
    let suspension = &mut vehicle.suspension;
    suspension.spring_rate_front_n_per_m = spring;
    suspension.spring_rate_rear_n_per_m = spring;
    let damping = 600.0 * unsprung;
    suspension.damping_bump_front_n_s_per_m = damping;
    suspension.damping_rebound_front_n_s_per_m = damping;
    suspension.damping_bump_rear_n_s_per_m = damping;
    suspension.damping_rebound_rear_n_s_per_m = damping;
    for solid in [
        &mut suspension.solid_axle_front,
        &mut suspension.solid_axle_rear,
    ]
    .into_iter()
    .flatten()
    {
        solid.spring_spacing_m = 1.8;
        solid.damper_spacing_m = 1.8;
    }
    vehicle.tyre.vertical_stiffness_front_n_per_m = tyre;
    vehicle.tyre.vertical_stiffness_rear_n_per_m = tyre;
    vehicle.tyre.lateral_compliance_m_per_n = 0.0;
    vehicle.tyre.twin_spacing_rear_m = 0.0;
    vehicle
}

/// A table that tilts is gravity that turns. The angle at which both left wheels carry nothing.
fn tilt_table(vehicle: &VehicleParameters) -> Result<Row> {
    const RAMP_RAD_S: f64 = 0.02;
    let vehicle = rigid(vehicle);
    let mut simulation = on_flat(&vehicle, 2.0, 0.0)?;
    let mut found = f64::NAN;
    for tick in 0..6000 {
        let angle = RAMP_RAD_S * TICK_S * f64::from(tick);
        let gravity = Vector3::new(0.0, -angle.sin(), -angle.cos()) * GRAVITY_M_S2;
        simulation.set_gravity_m_s2(gravity)?;
        if simulation.step(AT_REST, TICK_S)?.two_wheel_lift() {
            found = angle;
            break;
        }
    }
    let figures = vehicle.derived();
    // Half the track where the centre of gravity is, between the axles.
    let share = figures.cg_to_front_axle_m / figures.wheelbase_m;
    let (front, rear) = (
        vehicle.geometry.track_front_m,
        vehicle.geometry.track_rear_m,
    );
    let half_track = 0.5 * (front * (1.0 - share) + rear * share);
    Ok(Row::relative(
        "lift-off on the tilt table, made rigid: atan(T/2h)",
        "deg",
        (half_track / figures.cg_height_m).atan().to_degrees(),
        1.0,
        found.to_degrees(),
    ))
}

/// The vehicle without anything that takes or gives energy.
fn lossless(vehicle: &VehicleParameters) -> VehicleParameters {
    let mut vehicle = vehicle.clone();
    let suspension = &mut vehicle.suspension;
    suspension.damping_bump_front_n_s_per_m = 0.0;
    suspension.damping_rebound_front_n_s_per_m = 0.0;
    suspension.damping_bump_rear_n_s_per_m = 0.0;
    suspension.damping_rebound_rear_n_s_per_m = 0.0;
    vehicle.tyre.vertical_damping_n_s_per_m = 0.0;
    vehicle.tyre.rolling_resistance_coefficient = 0.0;
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    vehicle
}

/// Energy of a roll without dampers over time: pairs of time (s) and energy over that at the start.
///
/// # Errors
/// When the simulation fails.
pub fn roll_energy(vehicle: &VehicleParameters, duration_s: f64) -> Result<Vec<(f64, f64)>> {
    let vehicle = lossless(vehicle);
    let mut simulation = on_flat(&vehicle, 0.0, 0.0)?;
    let at_rest = simulation.energy().total_j();
    let mut leaning = *simulation.state();
    let roll = 0.02;
    leaning.set_angles(roll, 0.0, 0.0);
    // The wheels stay down while the body leans.
    let tracks = [
        vehicle.geometry.track_front_m,
        vehicle.geometry.track_rear_m,
    ];
    leaning.travel_m = [0, 1, 2, 3].map(|i| [-1.0, 1.0][i % 2] * roll * 0.5 * tracks[i / 2]);
    simulation.set_state(leaning)?;
    let swing = simulation.energy().total_j() - at_rest;
    ensure!(swing > 0.0, "the leaning vehicle stores no energy");
    let mut energies = vec![(0.0, 1.0)];
    while simulation.time_s() < duration_s - 0.5 * TICK_S {
        simulation.step(AT_REST, TICK_S)?;
        let share = (simulation.energy().total_j() - at_rest) / swing;
        energies.push((simulation.time_s(), share));
    }
    Ok(energies)
}

fn roll_decay(vehicle: &VehicleParameters) -> Result<Row> {
    const DURATION_S: f64 = 10.0;
    let energies = roll_energy(vehicle, DURATION_S)?;
    let left = energies.last().map_or(f64::NAN, |last| last.1);
    Ok(Row::absolute(
        "energy of a roll without dampers lost in a second",
        "%",
        0.0,
        0.1,
        100.0 * (1.0 - left) / DURATION_S,
    ))
}

fn flight(vehicle: &VehicleParameters) -> Result<Row> {
    let mut vehicle = vehicle.clone();
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    let mut simulation = on_flat(&vehicle, FRICTION, 25.0)?;
    let mut flying = *simulation.state();
    flying.position_m.z += 30.0;
    flying.angular_rad_s = Vector3::new(1.5, -0.6, 0.9);
    flying.travel_rate_m_s = [0.5, -0.7, 0.2, 0.9];
    simulation.set_state(flying)?;
    let before = simulation.momentum();
    for _ in 0..10 {
        simulation.step(Command::from_deg_kmh(100.0, 120.0), 0.1)?;
    }
    let now = simulation.momentum();
    let change = (now.angular_kg_m2_s - before.angular_kg_m2_s).norm();
    Ok(Row::absolute(
        "angular momentum in a flight of 1 s with steering and engine at work: relative change",
        "",
        0.0,
        1e-5,
        change / before.angular_kg_m2_s.norm(),
    ))
}

/// Largest change of LTR between two steps, swinging to 0.5 g.
///
/// # Errors
/// When a simulation fails.
pub fn change_of_ltr(vehicle: &VehicleParameters, steps_s: [f64; 2]) -> Result<f64> {
    let run = |substep: f64| -> Result<Vec<Observation>> {
        drive(
            with_substep(vehicle, FRICTION, 25.0, substep)?,
            vehicle,
            1.0,
        )
    };
    let (one, other) = (run(steps_s[0])?, run(steps_s[1])?);
    Ok(one.iter().zip(&other).fold(0.0_f64, |largest, (a, b)| {
        largest.max((a.ltr - b.ltr).abs())
    }))
}

fn halved_step(vehicle: &VehicleParameters) -> Result<Row> {
    let difference = change_of_ltr(vehicle, [DEFAULT_SUBSTEP_S, 0.5 * DEFAULT_SUBSTEP_S])?;
    Ok(Row::absolute(
        "largest change of LTR with half the step, swinging to 0.5 g",
        "",
        0.0,
        1e-3,
        difference,
    ))
}
