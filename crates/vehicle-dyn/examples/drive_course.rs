//! Drives the sedan with its driver alone over the course of the shipped scenario, and prints
//! the largest |LTR| of each turn and the outcome: `cargo run --release -p vehicle-dyn --example drive_course -- 105`.

use std::error::Error;

use toml::Table;
use vehicle_dyn::driver::Driver;
use vehicle_dyn::metrics::OutcomeMonitor;
use vehicle_dyn::road::{Course, Segment};
use vehicle_dyn::simulation::{Command, InitialPose, Simulation};
use vehicle_dyn::terrain::Terrain;
use vehicle_dyn::units::KMH;
use vehicle_dyn::vehicles;

const SCENARIO: &str = include_str!("../../../scenarios/sedan-s1.toml");
const DURATION_S: f64 = 35.0;
const TICK_S: f64 = 0.01;

fn main() -> Result<(), Box<dyn Error>> {
    let speed_kmh: f64 = std::env::args()
        .nth(1)
        .as_deref()
        .unwrap_or("105")
        .parse()?;
    let scenario: Table = SCENARIO.parse()?;
    let course = Course::new(&scenario["course"].clone().try_into()?)?;
    let pose = InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s: speed_kmh * KMH,
    };
    let mut simulation = Simulation::new(&vehicles::embedded("sedan")?, Terrain::flat(0.85), pose)?;
    let mut driver = Driver::new(&scenario["driver"].clone().try_into()?)?;
    let mut monitor = OutcomeMonitor::new(course.width_m());

    // Stations where each turn begins; what happens up to the next turn is counted to it.
    let mut starts = Vec::new();
    let mut station = 0.0;
    for segment in &course.description().segments {
        if matches!(segment, Segment::Turn { .. }) {
            starts.push(station);
        }
        station += segment.length_m();
    }
    let mut largest = vec![0.0_f64; starts.len()];
    let mut seen = simulation.observation();
    while seen.time_s < DURATION_S {
        let action = driver.step(&course, &seen, TICK_S);
        let command = Command::from_deg_kmh(action.handwheel_deg, speed_kmh);
        seen = simulation.step(command, TICK_S)?;
        let passed = starts
            .iter()
            .filter(|start| **start <= action.location.station_m)
            .count();
        if let Some(turn) = passed.checked_sub(1) {
            largest[turn] = largest[turn].max(seen.ltr.abs());
        }
        if !monitor.observe(&seen, action.location.lateral_offset_m) {
            break;
        }
    }
    for (turn, ltr) in largest.iter().enumerate() {
        println!("turn {}: largest |LTR| {ltr:.3}", turn + 1);
    }
    println!("{} at {:.2} s", monitor.outcome(), seen.time_s);
    Ok(())
}
