//! Check 1 of the validation list: loads at rest, no starting transient, mirror symmetry.

mod common;

use common::{TICK_S, drive, on_flat, sedan, step_steer, three_turns};
use vehicle_dyn::road::Course;
use vehicle_dyn::simulation::{
    Command, InitialPose, LongitudinalDemand, Simulation, SimulationError,
};
use vehicle_dyn::terrain::Terrain;

#[test]
fn wheel_loads_sum_to_the_weight_after_settling() {
    let weight = sedan().derived().total_mass_kg * 9.81;
    for speed_kmh in [0.0, 50.0, 100.0, 105.0, 120.0] {
        let loads: f64 = on_flat(&sedan(), 0.85, speed_kmh)
            .observation()
            .wheel_loads_n
            .iter()
            .sum();
        assert!(
            (loads / weight - 1.0).abs() < 1e-6,
            "{speed_kmh} km/h: {loads} N, {weight} N"
        );
    }
}

#[test]
fn the_vehicle_stands_at_its_design_height_with_its_static_loads() {
    let figures = sedan().derived();
    let seen = on_flat(&sedan(), 0.85, 0.0).observation();
    let [front_left, front_right, rear_left, rear_right] = seen.wheel_loads_n;
    for (found, expected) in [
        (front_left, figures.static_load_front_n),
        (front_right, figures.static_load_front_n),
        (rear_left, figures.static_load_rear_n),
        (rear_right, figures.static_load_rear_n),
    ] {
        assert!(
            (found / expected - 1.0).abs() < 1e-6,
            "{found} N instead of {expected} N"
        );
    }
    assert!((seen.z_m - figures.cg_height_m).abs() < 1e-6);
    assert!(seen.wheel_travel_m.iter().all(|travel| travel.abs() < 1e-6));
}

#[test]
fn a_straight_start_has_no_transient() {
    let speed_kmh = 105.0;
    let mut simulation = on_flat(&sedan(), 0.85, speed_kmh);
    let first = simulation.observation();
    for _ in 0..300 {
        let seen = simulation
            .step(Command::from_deg_kmh(0.0, speed_kmh), TICK_S)
            .expect("finite");
        assert!(
            seen.ltr.abs() < 1e-12,
            "LTR {} at {} s",
            seen.ltr,
            seen.time_s
        );
        assert!(
            (seen.speed_kmh() - speed_kmh).abs() < 0.01,
            "{} km/h",
            seen.speed_kmh()
        );
        for (now, start) in seen.wheel_loads_n.iter().zip(first.wheel_loads_n) {
            assert!(
                (now - start).abs() < 1.0,
                "{now} N after {start} N at {} s",
                seen.time_s
            );
        }
    }
}

#[test]
fn mirrored_steering_mirrors_the_load_transfer() {
    for (handwheel_deg, speed_kmh) in [(10.0, 60.0), (30.0, 105.0), (55.0, 105.0)] {
        let left = step_steer(on_flat(&sedan(), 0.85, speed_kmh), handwheel_deg, speed_kmh);
        let right = step_steer(
            on_flat(&sedan(), 0.85, speed_kmh),
            -handwheel_deg,
            speed_kmh,
        );
        for (l, r) in left.iter().zip(&right) {
            assert!(
                (l.ltr + r.ltr).abs() <= 1e-9,
                "{} and {} at {} s",
                l.ltr,
                r.ltr,
                l.time_s
            );
            assert!((l.y_m + r.y_m).abs() <= 1e-9 && (l.x_m - r.x_m).abs() <= 1e-9);
        }
    }
}

#[test]
fn the_driver_on_the_mirrored_course_mirrors_the_load_transfer_even_in_a_rollover() {
    let course = Course::new(&three_turns()).expect("valid course");
    for speed_kmh in [100.0, 105.0] {
        let plain = drive(on_flat(&sedan(), 0.85, speed_kmh), &course, speed_kmh, 35.0);
        let mirror = drive(
            on_flat(&sedan(), 0.85, speed_kmh),
            &course.mirrored(),
            speed_kmh,
            35.0,
        );
        assert_eq!(plain.len(), mirror.len());
        for (p, m) in plain.iter().zip(&mirror) {
            assert!(
                (p.ltr + m.ltr).abs() <= 1e-9,
                "{} and {} at {} s",
                p.ltr,
                m.ltr,
                p.time_s
            );
        }
    }
}

#[test]
fn the_signs_of_a_left_turn_are_all_positive() {
    let seen = *step_steer(on_flat(&sedan(), 0.85, 80.0), 25.0, 80.0)
        .last()
        .expect("not empty");
    assert!(seen.road_wheel_rad > 0.0 && seen.yaw_rate_rad_s > 0.0);
    assert!(seen.lateral_acceleration_m_s2 > 0.0 && seen.roll_rad > 0.0 && seen.ltr > 0.0);
    let [front_left, front_right, rear_left, rear_right] = seen.wheel_loads_n;
    assert!(front_right > front_left && rear_right > rear_left);
}

#[test]
fn the_same_inputs_give_the_same_bits() {
    let course = Course::new(&three_turns()).expect("valid course");
    let runs = [0, 1].map(|_| drive(on_flat(&sedan(), 0.85, 105.0), &course, 105.0, 35.0));
    assert_eq!(runs[0], runs[1]);
}

#[test]
fn a_clone_goes_its_own_way_from_the_same_state() {
    let mut simulation = on_flat(&sedan(), 0.85, 90.0);
    simulation
        .step(Command::from_deg_kmh(20.0, 90.0), 0.5)
        .expect("finite");
    let mut copy = simulation.clone();
    let straight = copy
        .step(Command::from_deg_kmh(0.0, 90.0), 1.0)
        .expect("finite");
    let turning = simulation
        .step(Command::from_deg_kmh(20.0, 90.0), 1.0)
        .expect("finite");
    assert!(turning.yaw_rate_rad_s > 2.0 * straight.yaw_rate_rad_s);
    assert!((turning.time_s - 1.5).abs() < 1e-12 && (straight.time_s - 1.5).abs() < 1e-12);
}

#[test]
fn yaw_is_continuous_over_full_turns() {
    let mut simulation = on_flat(&sedan(), 0.85, 30.0);
    let mut last = simulation.observation().yaw_rad;
    for _ in 0..4000 {
        let seen = simulation
            .step(Command::from_deg_kmh(80.0, 30.0), TICK_S)
            .expect("finite");
        assert!((seen.yaw_rad - last).abs() < 0.1);
        last = seen.yaw_rad;
    }
    assert!(last > 3.0 * std::f64::consts::PI, "turned by {last} rad");
}

#[test]
fn a_command_that_is_no_number_stops_the_run_with_its_time_and_leaves_the_state() {
    let mut simulation = on_flat(&sedan(), 0.85, 100.0);
    simulation
        .step(Command::from_deg_kmh(5.0, 100.0), 1.25)
        .expect("finite");
    let before = *simulation.state();
    let message = |command| {
        simulation
            .clone()
            .step(command, TICK_S)
            .expect_err("NaN")
            .to_string()
    };
    assert_eq!(
        message(Command {
            handwheel_rad: f64::NAN,
            longitudinal: LongitudinalDemand::TargetSpeed(20.0),
        }),
        "command handwheel_rad = NaN at 1.25 s: must be a finite number; the simulation stopped \
         before it"
    );
    assert!(
        message(Command {
            handwheel_rad: 0.0,
            longitudinal: LongitudinalDemand::TargetSpeed(f64::NAN),
        })
        .contains("1.25 s")
    );
    assert_eq!(before, *simulation.state());
}

#[test]
fn unusable_starts_and_ticks_are_refused() {
    let flat = || Terrain::flat(0.85);
    let start = |pose| {
        Simulation::new(&sedan(), flat(), pose)
            .expect_err("refused")
            .to_string()
    };
    let usable = InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s: 20.0,
    };
    assert_eq!(
        start(InitialPose {
            speed_m_s: -3.0,
            ..usable
        }),
        "initial speed_m_s = -3: must be in [0, 150] m/s"
    );
    assert!(
        start(InitialPose {
            yaw_rad: f64::NAN,
            ..usable
        })
        .contains("yaw_rad = NaN")
    );
    let mut simulation = Simulation::new(&sedan(), flat(), usable).expect("usable");
    let command = Command::from_deg_kmh(0.0, 72.0);
    for tick_s in [0.0, -0.01, 0.0105, f64::NAN, 1e9] {
        let error = simulation.step(command, tick_s).expect_err("refused");
        assert!(matches!(error, SimulationError::TimeStep { .. }), "{error}");
    }
}
