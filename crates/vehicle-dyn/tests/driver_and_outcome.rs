//! The driver on the course, and how a run is judged.

mod common;

use common::{TICK_S, drive, on_flat, sedan, sedan_driver, straight, three_turns};
use vehicle_dyn::driver::{Driver, DriverParameters};
use vehicle_dyn::metrics::{self, Outcome, OutcomeMonitor};
use vehicle_dyn::road::{Course, CourseDescription, Segment};
use vehicle_dyn::simulation::{Command, Observation};

fn course() -> Course {
    Course::new(&three_turns()).expect("valid course")
}

fn worst(seen: &[Observation]) -> f64 {
    seen.iter().map(|o| o.ltr.abs()).fold(0.0, f64::max)
}

/// Stations at which the third turn begins and ends, m.
fn third_turn() -> std::ops::Range<f64> {
    let description = three_turns();
    let begins: f64 = description.segments[..5]
        .iter()
        .map(Segment::length_m)
        .sum();
    begins..begins + description.segments[5].length_m()
}

#[test]
fn the_driver_of_the_sedan_rolls_over_in_the_third_turn_at_105_and_survives_at_100() {
    let course = course();
    for speed_kmh in [95.0, 100.0, 102.0] {
        let seen = drive(on_flat(&sedan(), 0.85, speed_kmh), &course, speed_kmh, 35.0);
        assert!(worst(&seen) < 0.97, "{speed_kmh} km/h: {}", worst(&seen));
        assert!(!seen.iter().any(Observation::two_wheel_lift));
    }
    let seen = drive(on_flat(&sedan(), 0.85, 105.0), &course, 105.0, 35.0);
    let last = seen.last().expect("not empty");
    assert!(
        last.roll_rad > 1.0 && (last.time_s - 22.93).abs() < 0.05,
        "{last:?}"
    );
    let lifted = seen
        .iter()
        .find(|o| o.two_wheel_lift())
        .expect("lifts before it rolls");
    let station = course.locate(lifted.x_m, lifted.y_m, None).station_m;
    assert!(third_turn().contains(&station), "{station} m");
}

#[test]
fn the_driver_of_the_sedan_lifts_two_wheels_at_104_and_comes_down_again() {
    let course = course();
    let seen = drive(on_flat(&sedan(), 0.85, 104.0), &course, 104.0, 35.0);
    let on_two_wheels: Vec<&Observation> = seen.iter().filter(|o| o.two_wheel_lift()).collect();
    assert!(on_two_wheels.len() > 100, "{} ticks", on_two_wheels.len());
    let lifted = on_two_wheels[0];
    let station = course.locate(lifted.x_m, lifted.y_m, None).station_m;
    assert!(third_turn().contains(&station), "{station} m");
    let last = seen.last().expect("not empty");
    assert!(last.time_s > 34.9 && last.roll_rad.abs() < 0.01, "{last:?}");
}

#[test]
fn the_driver_keeps_to_the_middle_of_the_road_at_a_moderate_speed() {
    let course = course();
    let mut hint = None;
    for seen in drive(on_flat(&sedan(), 0.85, 80.0), &course, 80.0, 40.0) {
        let location = course.locate(seen.x_m, seen.y_m, hint);
        hint = Some(location.station_m);
        assert!(location.lateral_offset_m.abs() < 1.0, "{location:?}");
    }
    assert!(hint.expect("driven") > 800.0);
}

#[test]
fn the_driver_comes_back_from_beside_the_road() {
    let road = CourseDescription {
        width_m: 7.0,
        segments: vec![straight(2000.0)],
    };
    let course = Course::new(&road).expect("valid");
    let mut simulation = on_flat(&sedan(), 0.85, 100.0);
    let mut beside = *simulation.state();
    beside.position_m.y = 2.0;
    simulation.set_state(beside).expect("finite");
    let seen = drive(simulation, &course, 100.0, 15.0);
    assert!(seen[200].y_m.abs() < 0.5, "{} m after 2 s", seen[200].y_m);
    assert!(seen.last().expect("not empty").y_m.abs() < 1e-3);
}

#[test]
fn handwheel_and_its_rate_stay_within_the_drivers_limits() {
    let course = course();
    let limits = DriverParameters {
        handwheel_limit_deg: 15.0,
        handwheel_rate_limit_deg_per_s: 40.0,
        ..sedan_driver()
    };
    let mut driver = Driver::new(&limits).expect("valid");
    let mut simulation = on_flat(&sedan(), 0.85, 60.0);
    let mut seen = simulation.observation();
    let mut last = 0.0;
    for _ in 0..2000 {
        let angle = driver.step(&course, &seen, TICK_S).handwheel_deg;
        assert!(angle.abs() <= 15.0 + 1e-9 && (angle - last).abs() <= 0.4 + 1e-9);
        last = angle;
        seen = simulation
            .step(Command::from_deg_kmh(angle, 60.0), TICK_S)
            .expect("finite");
    }
}

#[test]
fn the_drivers_integral_rests_while_another_hand_steers() {
    let road = CourseDescription {
        width_m: 7.0,
        segments: vec![straight(2000.0)],
    };
    let course = Course::new(&road).expect("valid");
    let only_integral = DriverParameters {
        preview_gain_deg_per_m: 0.0,
        error_rate_gain_deg_s_per_m: 0.0,
        integral_gain_deg_per_m_s: 2.0,
        lag_s: 0.0,
        ..sedan_driver()
    };
    let mut simulation = on_flat(&sedan(), 0.85, 50.0);
    let mut beside = *simulation.state();
    beside.position_m.y = -1.0;
    simulation.set_state(beside).expect("finite");
    let seen = simulation.observation();
    let after = |overridden: bool| {
        let mut driver = Driver::new(&only_integral).expect("valid");
        let mut angle = 0.0;
        for _ in 0..100 {
            angle = driver.step(&course, &seen, TICK_S).handwheel_deg;
            driver.notify_applied(if overridden { angle - 30.0 } else { angle }, 0.5);
        }
        angle
    };
    assert!((after(false) - 2.0).abs() < 1e-6, "{}", after(false));
    assert!(after(true).abs() < 0.05, "{}", after(true));
}

#[test]
fn driver_parameters_out_of_range_are_refused_with_their_range() {
    let wrong = DriverParameters {
        preview_time_s: 0.0,
        ..sedan_driver()
    };
    assert_eq!(
        Driver::new(&wrong).expect_err("refused").to_string(),
        "driver.preview_time_s = 0: must be in [0.05, 10] s"
    );
    let wrong = DriverParameters {
        lag_s: f64::NAN,
        ..sedan_driver()
    };
    assert!(
        Driver::new(&wrong)
            .expect_err("refused")
            .to_string()
            .starts_with("driver.lag_s = NaN")
    );
}

#[test]
fn the_load_transfer_ratio_is_the_papers() {
    let weight = 1000.0 * 9.81;
    let loads = [0.1 * weight, 0.3 * weight, 0.2 * weight, 0.4 * weight];
    assert!((metrics::load_transfer_ratio(&loads, 1000.0) - 0.4).abs() < 1e-12);
    // m g stays the paper's constant when the loads do not sum to it.
    let landing = [0.0, 1.5 * weight, 0.0, 0.0];
    assert!((metrics::load_transfer_ratio(&landing, 1000.0) - 1.5).abs() < 1e-12);
    assert!((metrics::load_transfer_of_sum(&landing) - 1.0).abs() < 1e-12);
    assert!(metrics::load_transfer_of_sum(&[0.0; 4]).abs() < f64::MIN_POSITIVE);
}

#[test]
fn the_worst_outcome_wins_and_each_has_its_time() {
    let calm = on_flat(&sedan(), 0.85, 50.0).observation();
    let mut monitor = OutcomeMonitor::new(7.0);
    assert!(monitor.observe(&calm, 3.4));
    assert_eq!(monitor.outcome(), Outcome::Completed);
    assert!(
        monitor.observe(
            &Observation {
                time_s: 1.0,
                ..calm
            },
            -3.6
        ),
        "leaving does not end it"
    );
    assert!(monitor.observe(
        &Observation {
            time_s: 2.0,
            ..calm
        },
        0.0
    ));
    assert_eq!(monitor.outcome(), Outcome::LeftRoad);
    assert_eq!(monitor.time_of_s(Outcome::LeftRoad), Some(1.0));
    let spun = Observation {
        time_s: 3.0,
        sideslip_rad: -1.1,
        ..calm
    };
    assert!(!monitor.observe(&spun, 0.0));
    assert_eq!(monitor.outcome(), Outcome::SpunOut);
    let rolled = Observation {
        time_s: 4.0,
        roll_rad: 1.06,
        ..calm
    };
    assert!(!monitor.observe(&rolled, 0.0));
    assert_eq!(monitor.outcome(), Outcome::RolledOver);
    assert_eq!(monitor.time_of_s(Outcome::RolledOver), Some(4.0));
    assert_eq!(monitor.time_of_s(Outcome::SpunOut), Some(3.0));
    assert_eq!(Outcome::RolledOver.to_string(), "rolled_over");
}

#[test]
fn a_slow_vehicle_does_not_spin_out() {
    let calm = on_flat(&sedan(), 0.85, 10.0).observation();
    let mut monitor = OutcomeMonitor::new(7.0);
    assert!(monitor.observe(
        &Observation {
            sideslip_rad: 2.0,
            ..calm
        },
        0.0
    ));
    assert_eq!(monitor.outcome(), Outcome::Completed);
}
