//! Every vehicle's own driver keeps it on a gentle course; the truck weaves with the sedan's.

mod common;

use common::{TICK_S, on_flat, straight, turn};
use vehicle_dyn::driver::{Driver, DriverParameters};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::{Course, CourseDescription, TurnDirection};
use vehicle_dyn::simulation::{Command, Observation};
use vehicle_dyn::units::DEGREE;
use vehicle_dyn::vehicles;

const SPEED_KMH: f64 = 100.0;

/// Two gentle turns (0.2 g at 100 km/h), then 15 s of straight road.
fn gentle() -> Course {
    Course::new(&CourseDescription {
        width_m: 7.0,
        segments: vec![
            straight(100.0),
            turn(TurnDirection::Left, 400.0, 80.0, 60.0),
            straight(50.0),
            turn(TurnDirection::Right, 400.0, 80.0, 60.0),
            straight(700.0),
        ],
    })
    .expect("valid course")
}

/// What was seen, with the distance from the centre line in m.
fn drive(vehicle: &VehicleParameters, parameters: &DriverParameters) -> Vec<(Observation, f64)> {
    let course = gentle();
    let mut driver = Driver::new(parameters).expect("valid driver");
    let mut simulation = on_flat(vehicle, 0.85, SPEED_KMH);
    let mut seen = simulation.observation();
    let mut all = Vec::new();
    for _ in 0..3700 {
        let action = driver.step(&course, &seen, TICK_S);
        all.push((seen, action.location.lateral_offset_m));
        let command = Command::from_deg_kmh(action.handwheel_deg, SPEED_KMH);
        seen = simulation.step(command, TICK_S).expect("finite");
        if seen.roll_rad.abs() > 1.0 {
            break;
        }
    }
    all
}

/// Largest yaw rate on the straight after the turns, from 25 s on, rad/s.
fn weaving_rad_s(run: &[(Observation, f64)]) -> f64 {
    run.iter()
        .filter(|(seen, _)| seen.time_s > 25.0)
        .fold(0.0, |most: f64, (seen, _)| {
            most.max(seen.yaw_rate_rad_s.abs())
        })
}

fn farthest_m(run: &[(Observation, f64)]) -> f64 {
    run.iter()
        .fold(0.0, |most: f64, (_, off)| most.max(off.abs()))
}

#[test]
fn every_vehicle_follows_a_gentle_course_with_its_own_driver() {
    for name in vehicles::names() {
        let vehicle = vehicles::embedded(name).expect("valid");
        let run = drive(&vehicle, &vehicle.driver.expect("its own driver"));
        let (weaving, farthest) = (weaving_rad_s(&run), farthest_m(&run));
        println!("{name}: {farthest:.2} m off, {weaving:.5} rad/s at the end");
        assert!(
            farthest < 1.0 && weaving < 2e-3 && run.len() == 3700,
            "{name}: {farthest} m, {weaving} rad/s"
        );
    }
}

/// How often the vehicle swings back by more than 0.1 deg/s after the last turn.
fn swings(run: &[(Observation, f64)]) -> usize {
    const NOTICED_RAD_S: f64 = 0.1 * DEGREE;
    let mut side = 0.0;
    let mut count: usize = 0;
    // The last turn is left behind after 19 s.
    for (seen, _) in run.iter().filter(|(seen, _)| seen.time_s > 19.0) {
        let rate = seen.yaw_rate_rad_s;
        if rate.abs() > NOTICED_RAD_S && rate * side <= 0.0 {
            side = rate.signum();
            count += 1;
        }
    }
    // The turn itself is the first.
    count.saturating_sub(1)
}

#[test]
fn the_truck_weaves_with_the_preview_of_the_sedan() {
    let truck = vehicles::embedded("utility-truck").expect("valid");
    let own = truck.driver.expect("its own driver");
    let sedan = vehicles::embedded("sedan").expect("valid").driver;
    let sedan = sedan.expect("its own driver");
    let short_sighted = DriverParameters {
        preview_time_s: sedan.preview_time_s,
        ..own
    };
    let far_sighted = DriverParameters {
        preview_time_s: own.preview_time_s,
        ..sedan
    };
    let seen = |driver: &DriverParameters| {
        let run = drive(&truck, driver);
        let seen = (swings(&run), farthest_m(&run));
        println!("{} swings, {:.2} m off", seen.0, seen.1);
        seen
    };
    for driver in [own, far_sighted] {
        let (count, off) = seen(&driver);
        assert!(count <= 1 && off < 0.5, "{count} swings, {off} m");
    }
    for driver in [short_sighted, sedan] {
        let (count, off) = seen(&driver);
        assert!(count >= 3 && off > 1.0, "{count} swings, {off} m");
    }
}
