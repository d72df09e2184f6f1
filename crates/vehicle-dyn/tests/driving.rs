//! Speed control, brakes, steering and handling that a driver would notice.

mod common;

use common::{TICK_S, on_flat, sedan, step_steer};
use nalgebra::Vector3;
use vehicle_dyn::simulation::{Command, InitialPose, ReadyVehicle, Simulation, SimulationError};
use vehicle_dyn::terrain::{Ground, Terrain};
use vehicle_dyn::units::DEGREE;

#[test]
fn the_speed_controller_reaches_and_holds_the_target() {
    for (from_kmh, to_kmh) in [(100.0, 120.0), (120.0, 100.0), (30.0, 60.0)] {
        let mut simulation = on_flat(&sedan(), 0.85, from_kmh);
        let seen = simulation
            .step(Command::from_deg_kmh(0.0, to_kmh), 10.0)
            .expect("finite");
        let later = simulation
            .step(Command::from_deg_kmh(0.0, to_kmh), 10.0)
            .expect("finite");
        assert!(
            (seen.speed_kmh() - to_kmh).abs() < 2.0,
            "{} km/h",
            seen.speed_kmh()
        );
        assert!(
            (later.speed_kmh() - to_kmh).abs() < 0.5,
            "{} km/h",
            later.speed_kmh()
        );
    }
}

#[test]
fn a_ready_vehicle_starts_as_a_new_one_does() {
    let ready = ReadyVehicle::new(sedan()).expect("allowed");
    for (speed_kmh, yaw_rad) in [(105.0, 0.3), (60.0, -1.0), (105.0, 0.7)] {
        let pose = InitialPose {
            x_m: 2.0,
            y_m: -1.0,
            yaw_rad,
            speed_m_s: speed_kmh / 3.6,
        };
        let again = ready
            .simulation(Terrain::flat(0.85), pose)
            .expect("allowed");
        let new = Simulation::new(&sedan(), Terrain::flat(0.85), pose).expect("allowed");
        assert_eq!(again.state(), new.state());
        assert_eq!(again.observation(), new.observation());
    }
    let too_fast = InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s: 200.0,
    };
    let refused = ready.simulation(Terrain::flat(0.85), too_fast);
    assert!(matches!(refused, Err(SimulationError::Initial { .. })));
}

#[test]
fn full_acceleration_stays_within_the_engines_power() {
    let mut simulation = on_flat(&sedan(), 0.85, 60.0);
    for _ in 0..500 {
        let seen = simulation
            .step(Command::from_deg_kmh(0.0, 200.0), TICK_S)
            .expect("finite");
        let power = simulation.state().powertrain.drive_n * seen.speed_m_s;
        // The force lags behind the falling limit by engine_lag_s: at most a·τ/v = 6.6 % here.
        assert!(power <= 95_000.0 * 1.066, "{power} W");
    }
}

#[test]
fn full_braking_stops_the_vehicle_and_loads_the_front() {
    let mut simulation = on_flat(&sedan(), 0.85, 100.0);
    let mut seen = simulation.observation();
    let static_front = sedan().derived().static_load_front_n;
    for tick in 0..1000 {
        seen = simulation
            .step(Command::from_deg_kmh(0.0, 0.0), TICK_S)
            .expect("finite");
        if tick == 100 {
            assert!(
                (-9.2..-7.0).contains(&seen.longitudinal_acceleration_m_s2),
                "{seen:?}"
            );
            assert!(seen.wheel_loads_n[0] > 1.2 * static_front && seen.pitch_rad > 0.0);
        }
    }
    assert!(seen.speed_m_s.abs() < 0.05, "{} m/s", seen.speed_m_s);
}

#[test]
fn the_handwheel_follows_with_its_rate_limit() {
    let mut simulation = on_flat(&sedan(), 0.85, 50.0);
    let mut last = 0.0;
    for _ in 0..100 {
        let seen = simulation
            .step(Command::from_deg_kmh(400.0, 50.0), TICK_S)
            .expect("finite");
        let angle = seen.handwheel_actual_deg();
        assert!(
            angle - last <= 900.0 * TICK_S + 1e-9,
            "{} deg in a tick",
            angle - last
        );
        assert!((seen.road_wheel_rad * 17.0 - seen.handwheel_actual_rad).abs() < 1e-12);
        last = angle;
    }
    assert!((last - 260.0).abs() < 1.0, "end stop, but {last} deg");
}

#[test]
fn the_sedan_understeers_and_rolls_outwards() {
    // Yaw gain below that of a neutral vehicle, v/L, and falling with speed against it.
    let wheelbase = sedan().derived().wheelbase_m;
    let mut last_ratio = 1.0;
    for speed_kmh in [36.0, 72.0, 105.0] {
        let seen = step_steer(on_flat(&sedan(), 0.85, speed_kmh), 5.0, speed_kmh);
        let last = seen.last().expect("not empty");
        let ratio = last.yaw_rate_rad_s / last.road_wheel_rad / (last.speed_m_s / wheelbase);
        assert!(
            ratio < last_ratio && ratio > 0.4,
            "{ratio} at {speed_kmh} km/h"
        );
        last_ratio = ratio;
        let gradient = last.roll_rad / DEGREE / (last.lateral_acceleration_m_s2 / 9.81);
        assert!((8.0..11.0).contains(&gradient), "{gradient} deg/g");
    }
}

#[test]
fn a_lifted_driven_wheel_does_not_race_away() {
    let mut simulation = on_flat(&sedan(), 0.85, 105.0);
    for _ in 0..250 {
        let seen = simulation
            .step(Command::from_deg_kmh(80.0, 105.0), TICK_S)
            .expect("finite");
        if seen.roll_rad.abs() > 1.0 {
            break;
        }
        for spin in seen.wheel_spin_rad_s {
            assert!(
                (40.0..150.0).contains(&spin),
                "{spin} rad/s at {} s",
                seen.time_s
            );
        }
    }
}

#[test]
fn a_vehicle_on_a_banked_plane_starts_parallel_to_it_and_leans_on_its_low_side() {
    let plane = Ground {
        height_m: 3.0,
        gradient_x: 0.0,
        gradient_y: 0.08,
        friction: 0.85,
    };
    let mut simulation =
        Simulation::new(&sedan(), Terrain::Plane(plane), common::pose(0.0)).expect("valid");
    let seen = simulation.observation();
    assert!(
        (seen.roll_rad - 0.08_f64.atan()).abs() < 1e-6,
        "left side high: {}",
        seen.roll_rad
    );
    assert!((seen.z_m - 3.0 - 0.724).abs() < 0.01);
    let stop = Command::from_deg_kmh(0.0, 0.0);
    let rested = simulation.step(stop, 5.0).expect("finite");
    // tan θ = 0.08 is a lateral acceleration of 0.08 g: LTR of about 1.2 per g.
    assert!((0.08..0.12).contains(&rested.ltr), "{}", rested.ltr);
    let loads: f64 = rested.wheel_loads_n.iter().sum();
    let expected = sedan().derived().total_mass_kg * 9.81 * 0.08_f64.atan().cos();
    assert!(
        (loads / expected - 1.0).abs() < 1e-3,
        "{loads} N instead of {expected} N"
    );
}

#[test]
fn a_vehicle_turned_on_a_slope_stands_upright_on_it() {
    let plane = Ground {
        height_m: 3.0,
        gradient_x: 0.12,
        gradient_y: -0.07,
        friction: 0.85,
    };
    let level = on_flat(&sedan(), 0.85, 60.0).observation();
    for yaw_rad in [1.1_f64, -2.0] {
        let pose = InitialPose {
            x_m: 20.0,
            y_m: -10.0,
            yaw_rad,
            ..common::pose(60.0)
        };
        let simulation = Simulation::new(&sedan(), Terrain::Plane(plane), pose).expect("valid");
        let rotation = simulation.state().rotation();
        // Its pitch on the level (drive and drag) stays; its own up axis is else the plane's normal.
        let up = rotation * Vector3::z();
        let off = up.dot(&plane.normal()).acos();
        assert!((off - level.pitch_rad.abs()).abs() < 1e-6, "{off} rad off");
        // It heads where it was asked to, up to what the slope foreshortens.
        let ahead = rotation * Vector3::x();
        assert!((ahead.y.atan2(ahead.x) - yaw_rad).abs() < 0.01, "{ahead}");
        assert!((simulation.state().velocity_m_s.dot(&plane.normal())).abs() < 1e-6);
        // Laid onto the plane, each wheel is pressed in as on the level.
        for (found, expected) in simulation
            .observation()
            .wheel_loads_n
            .into_iter()
            .zip(level.wheel_loads_n)
        {
            assert!(
                (found - expected).abs() < 0.1,
                "{found} instead of {expected} N"
            );
        }
    }
}
