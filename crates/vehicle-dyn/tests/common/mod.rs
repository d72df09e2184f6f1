//! What several test files share.
#![allow(dead_code)] // Each test file uses its own part.

use vehicle_dyn::driver::{Driver, DriverParameters};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::{Course, CourseDescription, Segment, TurnDirection};
use vehicle_dyn::simulation::{Command, InitialPose, Observation, Simulation};
use vehicle_dyn::terrain::Terrain;
use vehicle_dyn::units::KMH;

pub const TICK_S: f64 = 0.01;

pub fn sedan() -> VehicleParameters {
    vehicle_dyn::vehicles::embedded("sedan").expect("the embedded sedan is valid")
}

pub fn pose(speed_kmh: f64) -> InitialPose {
    InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s: speed_kmh * KMH,
    }
}

pub fn on_flat(vehicle: &VehicleParameters, friction: f64, speed_kmh: f64) -> Simulation {
    Simulation::new(vehicle, Terrain::flat(friction), pose(speed_kmh)).expect("valid set-up")
}

/// A part of the shipped scenario, so that what is tested is what is shipped.
fn shipped<T: serde::de::DeserializeOwned>(keys: &[&str]) -> T {
    let scenario: toml::Table = include_str!("../../../../scenarios/sedan-s1.toml")
        .parse()
        .expect("the shipped scenario is TOML");
    let value = keys
        .iter()
        .fold(toml::Value::Table(scenario), |table, key| {
            table[*key].clone()
        });
    value.try_into().expect("a valid part of the scenario")
}

/// The driver of the shipped scenario, calibrated for the sedan.
pub fn sedan_driver() -> DriverParameters {
    shipped(&["driver"])
}

pub fn turn(turn: TurnDirection, radius_m: f64, arc_m: f64, clothoid_m: f64) -> Segment {
    Segment::Turn {
        turn,
        radius_m,
        arc_m,
        clothoid_m,
    }
}

pub fn straight(straight_m: f64) -> Segment {
    Segment::Straight { straight_m }
}

/// The course of the shipped scenario: left, right, left.
pub fn three_turns() -> CourseDescription {
    shipped(&["course"])
}

/// The recording course of the shipped scenario: five turns.
pub fn five_turns() -> CourseDescription {
    shipped(&["recording", "course"])
}

/// Drives a course with the driver alone and returns what was observed, tick by tick.
pub fn drive(
    mut simulation: Simulation,
    course: &Course,
    speed_kmh: f64,
    duration_s: f64,
) -> Vec<Observation> {
    let mut driver = Driver::new(&sedan_driver()).expect("valid driver");
    let mut seen = vec![simulation.observation()];
    while let Some(last) = seen
        .last()
        .filter(|o| o.time_s < duration_s && o.roll_rad.abs() < 1.05)
    {
        let action = driver.step(course, last, TICK_S);
        let command = Command::from_deg_kmh(action.handwheel_deg, speed_kmh);
        seen.push(simulation.step(command, TICK_S).expect("finite"));
    }
    seen
}

/// A step steer: straight for half a second, then the handwheel turned at once.
pub fn step_steer(
    mut simulation: Simulation,
    handwheel_deg: f64,
    speed_kmh: f64,
) -> Vec<Observation> {
    (0..400)
        .map(|tick| {
            let angle = if tick < 50 { 0.0 } else { handwheel_deg };
            simulation
                .step(Command::from_deg_kmh(angle, speed_kmh), TICK_S)
                .expect("finite")
        })
        .collect()
}
