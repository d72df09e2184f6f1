//! The paper's model on its own: conservation, symmetry, statics, and what it refuses.
#![allow(clippy::float_cmp)] // Mirrored runs are compared to the last bit.

mod common;
#[path = "paper_model/plants.rs"]
mod plants;

use common::sedan;
use plants::{FRICTION, TICK_S, pose};
use proptest::prelude::*;
use vehicle_dyn::paper_model::{
    Equations, PaperModel, PaperModelSettings, PaperObservation, PaperState, RollAxis,
    RollStiffness,
};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::{Command, LongitudinalDemand, SimulationError};

const PAPER: PaperModelSettings = PaperModelSettings::PAPER;
const MATCHED: PaperModelSettings = PaperModelSettings::MATCHED;

fn model(vehicle: &VehicleParameters, speed_kmh: f64, settings: PaperModelSettings) -> PaperModel {
    let pose = pose(speed_kmh / 3.6);
    PaperModel::with_settings(vehicle, FRICTION, pose, settings).expect("valid")
}

/// Energy, and momentum in world axes, of the free vehicle.
fn free(settings: PaperModelSettings) -> [f64; 3] {
    let mut vehicle = sedan();
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    for damping in [
        &mut vehicle.suspension.damping_bump_front_n_s_per_m,
        &mut vehicle.suspension.damping_rebound_front_n_s_per_m,
        &mut vehicle.suspension.damping_bump_rear_n_s_per_m,
        &mut vehicle.suspension.damping_rebound_rear_n_s_per_m,
    ] {
        *damping = 0.0;
    }
    let mut model = PaperModel::with_settings(&vehicle, 0.0, pose(20.0), settings).expect("valid");
    model
        .set_state(PaperState {
            lateral_speed_m_s: 1.0,
            yaw_rate_rad_s: 1.5,
            roll_rad: 0.3,
            roll_rate_rad_s: 1.0,
            ..*model.state()
        })
        .expect("finite");
    let energy = model.energy_j();
    let world = |seen: PaperObservation| {
        let (sin, cos) = seen.yaw_rad.sin_cos();
        [
            seen.speed_m_s * cos - seen.lateral_speed_m_s * sin,
            seen.speed_m_s * sin + seen.lateral_speed_m_s * cos,
        ]
    };
    let before = world(model.observation());
    let mut worst = [0.0_f64; 3];
    for _ in 0..300 {
        let command = Command {
            handwheel_rad: 0.0,
            longitudinal: LongitudinalDemand::Released,
        };
        let now = world(model.step(command, TICK_S).expect("finite"));
        worst[0] = worst[0].max((model.energy_j() - energy).abs());
        worst[1] = worst[1].max((now[0] - before[0]).abs());
        worst[2] = worst[2].max((now[1] - before[1]).abs());
    }
    worst
}

#[test]
fn derived_equations_keep_energy_and_momentum_and_printed_ones_do_not() {
    // No friction, dampers or drag: two bodies on a spring, swinging by 17° while they spin.
    let [energy, x, y] = free(PaperModelSettings {
        equations: Equations::Derived,
        ..PAPER
    });
    // The swing holds some 1e4 J; RK4 at 1 ms loses nothing visible of it.
    assert!(energy < 1e-4, "{energy} J");
    assert!(x < 1e-9 && y < 1e-9, "{x} and {y} m/s");
    let [energy, x, y] = free(PAPER);
    assert!(
        energy > 10.0 && x.max(y) > 1e-2,
        "{energy} J, {x} and {y} m/s"
    );
}

#[test]
fn printed_equations_differ_from_derived_ones_in_second_order_only() {
    let derived = PaperModelSettings {
        equations: Equations::Derived,
        ..PAPER
    };
    let difference = |handwheel_deg: f64| {
        let (mut first, mut second) =
            (model(&sedan(), 90.0, PAPER), model(&sedan(), 90.0, derived));
        let mut worst = 0.0_f64;
        for _ in 0..300 {
            let command = Command::from_deg_kmh(handwheel_deg, 90.0);
            let a = first.step(command, TICK_S).expect("finite");
            let b = second.step(command, TICK_S).expect("finite");
            worst = worst.max((a.ltr - b.ltr).abs());
        }
        worst
    };
    // An odd motion: its first error is of third order, so half the angle leaves an eighth.
    let (small, large) = (difference(10.0), difference(20.0));
    assert!(large < 1e-3, "{large}");
    let ratio = large / small;
    assert!((6.0..10.0).contains(&ratio), "{ratio}");
}

#[test]
fn a_mirrored_run_is_mirrored_to_the_last_bit() {
    for settings in [PAPER, MATCHED] {
        let (mut left, mut right) = (
            model(&sedan(), 100.0, settings),
            model(&sedan(), 100.0, settings),
        );
        for tick in 0..600 {
            let angle = 70.0 * (0.02 * f64::from(tick)).sin();
            let target = if tick < 200 { 100.0 } else { 60.0 };
            let a = left
                .step(Command::from_deg_kmh(angle, target), TICK_S)
                .expect("finite");
            let b = right
                .step(Command::from_deg_kmh(-angle, target), TICK_S)
                .expect("finite");
            let [fl, fr, rl, rr] = b.wheel_loads_n;
            let mirrored = PaperObservation {
                y_m: -b.y_m,
                yaw_rad: -b.yaw_rad,
                roll_rad: -b.roll_rad,
                lateral_speed_m_s: -b.lateral_speed_m_s,
                yaw_rate_rad_s: -b.yaw_rate_rad_s,
                roll_rate_rad_s: -b.roll_rate_rad_s,
                lateral_acceleration_m_s2: -b.lateral_acceleration_m_s2,
                handwheel_actual_rad: -b.handwheel_actual_rad,
                road_wheel_rad: -b.road_wheel_rad,
                wheel_loads_n: [fr, fl, rr, rl],
                ltr: -b.ltr,
                ..b
            };
            assert_eq!(a, mirrored, "tick {tick}");
        }
        assert!(left.observation().roll_rad.abs() > 0.01, "it did turn");
    }
}

#[test]
fn steady_load_transfer_is_that_of_the_moments_about_the_ground() {
    // (F_z,R − F_z,L) T/2 = m a_y h_CG + m_SM g h_SM sin φ, with one track for both axles.
    let mut vehicle = sedan();
    vehicle.geometry.track_rear_m = vehicle.geometry.track_front_m;
    let figures = vehicle.derived();
    for settings in [PAPER, MATCHED] {
        let mut model = model(&vehicle, 80.0, settings);
        let command = Command::from_deg_kmh(30.0, 80.0);
        for _ in 0..5 {
            model.step(command, 10.0).expect("finite");
        }
        let seen = model.observation();
        let arm = match settings.roll_axis {
            RollAxis::RollCentres => {
                let share = vehicle.geometry.sprung_cg_to_rear_axle_m / figures.wheelbase_m;
                vehicle.mass.sprung_cg_height_m
                    - share * vehicle.geometry.roll_centre_height_front_m
                    - (1.0 - share) * vehicle.geometry.roll_centre_height_rear_m
            }
            RollAxis::Undercarriage => {
                let unsprung = figures.total_mass_kg - vehicle.mass.sprung_mass_kg;
                let moment = figures.total_mass_kg * figures.cg_height_m
                    - vehicle.mass.sprung_mass_kg * vehicle.mass.sprung_cg_height_m;
                vehicle.mass.sprung_cg_height_m - moment / unsprung
            }
        };
        let weight = figures.total_mass_kg * 9.81;
        let moment = figures.total_mass_kg * seen.lateral_acceleration_m_s2 * figures.cg_height_m
            + vehicle.mass.sprung_mass_kg * 9.81 * arm * seen.roll_rad.sin();
        let expected = moment / (0.5 * vehicle.geometry.track_front_m * weight);
        // The printed fifth equation has cos φ = 1 in places, and front and rear roll centres stand
        // at different heights in an axle's share of force that yaw changes a little.
        let ratio = seen.ltr / expected;
        assert!((ratio - 1.0).abs() < 5e-3, "{ratio} with {settings:?}");
        let sum: f64 = seen.wheel_loads_n.iter().sum();
        assert!((sum / weight - 1.0).abs() < 1e-9, "{sum} N");
    }
}

#[test]
fn it_brakes_and_holds_speed_as_the_full_plant_does() {
    let mut slow = model(&sedan(), 100.0, PAPER);
    let braking = Command {
        handwheel_rad: 0.0,
        longitudinal: LongitudinalDemand::Acceleration(-3.0),
    };
    let seen = slow.step(braking, 1.0).expect("finite");
    let drag = 0.5 * 1.2 * 0.75 * seen.speed_m_s.powi(2) / sedan().derived().total_mass_kg;
    let expected = -3.0 - drag;
    assert!(
        (seen.longitudinal_acceleration_m_s2 - expected).abs() < 0.01,
        "{seen:?}"
    );
    assert!(seen.wheel_loads_n[0] > sedan().derived().static_load_front_n);
    // Full braking to a halt, and it stays there.
    let stop = Command::from_deg_kmh(0.0, 0.0);
    let halted = slow.step(stop, 10.0).expect("finite");
    assert!(halted.speed_m_s.abs() < 0.05, "{} m/s", halted.speed_m_s);
    let mut quick = model(&sedan(), 60.0, PAPER);
    let seen = quick
        .step(Command::from_deg_kmh(0.0, 90.0), 10.0)
        .expect("finite");
    let later = quick
        .step(Command::from_deg_kmh(0.0, 90.0), 10.0)
        .expect("finite");
    assert!((seen.speed_m_s * 3.6 - 90.0).abs() < 2.0, "{seen:?}");
    assert!((later.speed_m_s * 3.6 - 90.0).abs() < 0.5, "{later:?}");
}

#[test]
fn it_says_when_a_wheel_would_lift_and_goes_on() {
    let mut vehicle = sedan();
    vehicle.tyre.q_load = 0.0;
    vehicle.tyre.mu_tyre = 2.0;
    let mut model = model(&vehicle, 105.0, MATCHED);
    assert!(model.all_wheels_loaded() && model.first_unloaded_s().is_none());
    let mut first = None;
    for _ in 0..300 {
        let seen = model
            .step(Command::from_deg_kmh(150.0, 105.0), TICK_S)
            .expect("finite");
        let lost = seen.wheel_loads_n.iter().any(|&load| load <= 0.0);
        assert_eq!(seen.all_wheels_loaded, !lost);
        if lost && first.is_none() {
            first = Some(seen.time_s);
        }
    }
    let (told, seen) = (
        model.first_unloaded_s().expect("told"),
        first.expect("seen"),
    );
    assert!(
        told <= seen && told > seen - TICK_S,
        "{told} s, seen at {seen} s"
    );
    // A new state starts anew.
    let upright = PaperState {
        forward_speed_m_s: 20.0,
        ..PaperState::default()
    };
    model.set_state(upright).expect("finite");
    assert!(model.all_wheels_loaded() && model.first_unloaded_s().is_none());
}

#[test]
fn bad_input_is_refused_with_its_time_and_leaves_the_state() {
    let mut model = model(&sedan(), 80.0, PAPER);
    model
        .step(Command::from_deg_kmh(20.0, 80.0), 0.5)
        .expect("finite");
    let before = *model.state();
    let refused = model.step(Command::from_deg_kmh(f64::NAN, 80.0), TICK_S);
    let message = refused.expect_err("refused").to_string();
    assert!(
        message.contains("handwheel_rad") && message.contains("0.50 s"),
        "{message}"
    );
    for command in [
        Command::from_deg_kmh(0.0, f64::NAN),
        Command::from_deg_kmh(0.0, 1000.0),
    ] {
        assert!(matches!(
            model.step(command, TICK_S),
            Err(SimulationError::Command { .. })
        ));
    }
    assert!(matches!(
        model.step(Command::from_deg_kmh(0.0, 80.0), 0.0105),
        Err(SimulationError::TimeStep { .. })
    ));
    let broken = PaperState {
        roll_rad: f64::NAN,
        ..before
    };
    assert!(model.set_state(broken).is_err());
    assert_eq!(*model.state(), before);

    for friction in [-0.1, f64::NAN, 3.5] {
        let refused = PaperModel::new(&sedan(), friction, pose(20.0));
        let message = refused.expect_err("refused").to_string();
        assert!(
            message.contains("friction") && message.contains("[0, 3]"),
            "{message}"
        );
    }
    let mut vehicle = sedan();
    vehicle.mass.sprung_mass_kg = -1.0;
    assert!(PaperModel::new(&vehicle, 0.85, pose(20.0)).is_err());
    assert!(PaperModel::new(&sedan(), 0.85, pose(f64::NAN)).is_err());
}

/// Vehicles around the sedan, of many kinds.
fn vehicles() -> impl Strategy<Value = VehicleParameters> {
    let scale = 0.6..1.6_f64;
    (
        (scale.clone(), scale.clone(), scale.clone(), 0.8..1.2_f64),
        (scale.clone(), 0.7..1.3_f64, 0.7..1.3_f64),
        (-5.0..0.9_f64, 0.8..1.9_f64, 0.0..4.0_f64, 0.0..1.5_f64),
        (0.0..1.0_f64, -0.1..0.4_f64),
    )
        .prop_map(|(body, rest, tyre, other)| {
            let mut vehicle = sedan();
            vehicle.mass.sprung_mass_kg *= body.0;
            vehicle.mass.sprung_roll_inertia_kg_m2 *= body.1;
            vehicle.suspension.spring_rate_front_n_per_m *= body.2.max(body.0);
            vehicle.suspension.spring_rate_rear_n_per_m *= body.2.max(body.0);
            vehicle.mass.sprung_cg_height_m *= body.3;
            vehicle.geometry.track_front_m *= rest.0.max(0.8);
            vehicle.geometry.sprung_cg_to_front_axle_m *= rest.1;
            vehicle.tyre.stiffness_factor_b1_rear *= rest.2.max(1.0);
            vehicle.tyre.curvature_factor_e1 = tyre.0;
            vehicle.tyre.shape_factor_c1 = tyre.1;
            vehicle.tyre.stiffness_saturation_c2 = tyre.2;
            vehicle.tyre.q_load = tyre.3;
            vehicle.powertrain.drive_share_front = other.0;
            vehicle.geometry.roll_centre_height_rear_m = other.1;
            vehicle
        })
        .prop_filter("a possible vehicle", |vehicle| vehicle.check().is_ok())
}

fn any_settings() -> impl Strategy<Value = PaperModelSettings> {
    (any::<bool>(), any::<bool>(), any::<bool>()).prop_map(|(printed, level, rigid)| {
        PaperModelSettings {
            equations: if printed {
                Equations::Printed
            } else {
                Equations::Derived
            },
            roll_axis: if level {
                RollAxis::Undercarriage
            } else {
                RollAxis::RollCentres
            },
            roll_stiffness: if rigid {
                RollStiffness::Suspension
            } else {
                RollStiffness::WithTyres
            },
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_vehicle_runs_straight_and_turns_to_both_sides_alike(
        vehicle in vehicles(),
        settings in any_settings(),
        handwheel_deg in 5.0..120.0_f64,
        speed_kmh in 20.0..130.0_f64,
    ) {
        let mut straight = model(&vehicle, speed_kmh, settings);
        let (mut left, mut right) = (straight.clone(), straight.clone());
        for _ in 0..100 {
            let seen = straight
                .step(Command::from_deg_kmh(0.0, speed_kmh), TICK_S)
                .expect("finite");
            prop_assert_eq!(seen.y_m, 0.0);
            prop_assert_eq!(seen.ltr, 0.0);
            prop_assert!((seen.speed_m_s * 3.6 - speed_kmh).abs() < 1e-6);
            let a = left
                .step(Command::from_deg_kmh(handwheel_deg, speed_kmh), TICK_S)
                .expect("finite");
            let b = right
                .step(Command::from_deg_kmh(-handwheel_deg, speed_kmh), TICK_S)
                .expect("finite");
            prop_assert_eq!(a.ltr, -b.ltr);
            prop_assert_eq!(a.y_m, -b.y_m);
            prop_assert_eq!(a.yaw_rate_rad_s, -b.yaw_rate_rad_s);
        }
        prop_assert!(left.observation().yaw_rad > 0.0);
    }
}
