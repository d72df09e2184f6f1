//! Forces of one axle, and what the speed controller asks of engine and brakes.

mod common;

use common::sedan;
use vehicle_dyn::parameters::PowertrainParameters;
use vehicle_dyn::powertrain::{LongitudinalDemand, Powertrain, PowertrainState};
use vehicle_dyn::suspension::{AxleSuspension, Guidance, Pair};

const MASS_KG: f64 = 1000.0;

const AXLE: AxleSuspension = AxleSuspension {
    preload_n: 3000.0,
    spring_n_per_m: 25_000.0,
    bump_n_s_per_m: 1500.0,
    rebound_n_s_per_m: 2800.0,
    anti_roll_n_per_m: 8000.0,
    travel_m: 0.08,
    stop_n_per_m: 200_000.0,
    stop_n_per_m2: 4e6,
    guidance: Guidance::Independent {
        jacking_slope: 0.1,
        camber_gain_rad_per_m: 0.4,
    },
};

fn powertrain() -> PowertrainParameters {
    PowertrainParameters {
        max_power_w: 100_000.0,
        max_drive_force_n: 6000.0,
        drive_share_front: 0.3,
        engine_lag_s: 0.25,
        differential_coupling_nm_s_per_rad: 20.0,
        max_brake_force_n: 11_000.0,
        brake_share_front: 0.6,
        brake_lag_s: 0.1,
        speed_gain_per_s: 2.0,
        speed_integral_gain_per_s2: 0.15,
    }
}

fn assert_pair(found: Pair, expected: Pair) {
    for (found, expected) in found.into_iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
            "{found} instead of {expected}"
        );
    }
}

#[test]
fn dampers_push_against_bump_and_pull_harder_against_rebound() {
    let rest = [0.0; 2];
    // Left in bump: 1500 · 0.2 more; right in rebound: 2800 · 0.2 less.
    assert_pair(AXLE.forces_n(rest, [0.2, -0.2], rest), [3300.0, 2440.0]);
    assert_pair(AXLE.forces_n(rest, [-0.2, 0.2], rest), [2440.0, 3300.0]);
}

#[test]
fn the_anti_roll_bar_lifts_the_body_where_it_is_low() {
    // 25000 · 0.01 of the spring and 8000 · 0.02 of the bar.
    let forces = AXLE.forces_n([0.01, -0.01], [0.0; 2], [0.0; 2]);
    assert_pair(forces, [3410.0, 2590.0]);
}

#[test]
fn the_stops_are_progressive_in_both_directions() {
    // 0.01 m beyond: 2000 + 400 N.
    let beyond = AxleSuspension {
        anti_roll_n_per_m: 0.0,
        ..AXLE
    };
    let forces = beyond.forces_n([0.09, -0.09], [0.0; 2], [0.0; 2]);
    assert_pair(forces, [3000.0 + 2250.0 + 2400.0, 3000.0 - 2250.0 - 2400.0]);
}

#[test]
fn the_links_lift_the_outer_side_and_pull_down_the_inner_one() {
    // A left turn: the tyres push to the left, the right side is the outer one.
    let forces = AXLE.forces_n([0.0; 2], [0.0; 2], [1000.0, 2000.0]);
    assert_pair(forces, [2900.0, 3200.0]);
}

#[test]
fn engine_and_brakes_answer_each_with_its_own_lag() {
    let powertrain = Powertrain::new(&powertrain(), MASS_KG);
    let state = PowertrainState {
        drive_n: 500.0,
        brake_n: 300.0,
        integral_m_s2: 0.0,
    };
    // 1 m/s too slow with a gain of 2 asks for 2000 N.
    let faster = powertrain.rates(&state, 20.0, LongitudinalDemand::TargetSpeed(21.0));
    assert_pair(
        [faster.drive_n, faster.brake_n],
        [1500.0 / 0.25, -300.0 / 0.1],
    );
    let slower = powertrain.rates(&state, 20.0, LongitudinalDemand::TargetSpeed(19.0));
    assert_pair(
        [slower.drive_n, slower.brake_n],
        [-500.0 / 0.25, 1700.0 / 0.1],
    );
}

#[test]
fn the_speed_controller_does_not_wind_up_what_engine_and_brakes_cannot_give() {
    let powertrain = Powertrain::new(&powertrain(), MASS_KG);
    let growth = |integral_m_s2: f64, target_m_s: f64| {
        let state = PowertrainState {
            integral_m_s2,
            ..PowertrainState::default()
        };
        powertrain
            .rates(&state, 20.0, LongitudinalDemand::TargetSpeed(target_m_s))
            .integral_m_s2
    };
    // At 20 m/s the engine gives 5000 N and the brakes 11000 N: within that the integral grows.
    assert_pair([growth(0.0, 22.0), growth(0.0, 15.0)], [0.3, -0.75]);
    // 10 m/s asks for 20000 N.
    assert_pair([growth(0.0, 30.0), growth(0.0, 10.0)], [0.0, 0.0]);
    // What was wound up before may always unwind.
    assert_pair([growth(10.0, 19.0), growth(-20.0, 21.0)], [-0.15, 0.15]);
}

#[test]
fn drive_and_brake_forces_are_split_between_axles_and_sides() {
    let powertrain = Powertrain::new(&powertrain(), MASS_KG);
    let state = PowertrainState {
        drive_n: 1000.0,
        brake_n: 400.0,
        integral_m_s2: 0.0,
    };
    let radius_m = 0.3;
    // Half of 30 % of 1000 N less half of 60 % of 400 N, times 0.3 m; then the rear's.
    let front = powertrain.axle_torques_nm(0, &state, [60.0, 60.0], radius_m);
    assert_pair(front, [0.3 * (150.0 - 120.0); 2]);
    let rear = powertrain.axle_torques_nm(1, &state, [60.0, 60.0], radius_m);
    assert_pair(rear, [0.3 * (350.0 - 80.0); 2]);
    // The differential takes from the faster wheel and gives to the slower.
    let apart = powertrain.axle_torques_nm(1, &state, [60.0, 61.0], radius_m);
    assert_pair(apart, [81.0 + 20.0, 81.0 - 20.0]);
    // Brakes act against the spin, whichever way it is.
    let backwards = powertrain.axle_torques_nm(1, &state, [-60.0, -60.0], radius_m);
    assert_pair(backwards, [0.3 * (350.0 + 80.0); 2]);
}

#[test]
fn an_axle_without_drive_is_not_coupled() {
    let rear_driven = Powertrain::new(
        &PowertrainParameters {
            drive_share_front: 0.0,
            ..powertrain()
        },
        sedan().derived().total_mass_kg,
    );
    let state = PowertrainState {
        drive_n: 1000.0,
        ..PowertrainState::default()
    };
    let front = rear_driven.axle_torques_nm(0, &state, [60.0, 61.0], 0.3);
    assert_pair(front, [0.0; 2]);
    let rear = rear_driven.axle_torques_nm(1, &state, [60.0, 60.0], 0.3);
    assert_pair(rear, [150.0; 2]);
}
