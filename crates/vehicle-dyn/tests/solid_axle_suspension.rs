//! The suspension of a solid axle by itself: its forces do the work of its energy and its guidance.

use proptest::prelude::*;
use vehicle_dyn::suspension::{AxleSuspension, Guidance, Pair};

const TRACK_M: f64 = 1.86;
const SPRING_SPACING_M: f64 = 1.0;
const DAMPER_SPACING_M: f64 = 1.2;
const ROLL_CENTRE_M: f64 = 0.65;
const ANTI_ROLL_NM_PER_RAD: f64 = 85_943.7;

fn axle(guidance: Guidance) -> AxleSuspension {
    AxleSuspension {
        preload_n: 4850.0,
        spring_n_per_m: 700_000.0,
        bump_n_s_per_m: 20_000.0,
        rebound_n_s_per_m: 40_000.0,
        anti_roll_n_per_m: ANTI_ROLL_NM_PER_RAD / (TRACK_M * TRACK_M),
        travel_m: 0.03,
        stop_n_per_m: 1e6,
        stop_n_per_m2: 1e7,
        guidance,
    }
}

fn solid() -> AxleSuspension {
    axle(Guidance::Solid {
        jacking_slope: ROLL_CENTRE_M / TRACK_M,
        inverse_track_per_m: 1.0 / TRACK_M,
        spring_share: SPRING_SPACING_M / TRACK_M,
        damper_share: DAMPER_SPACING_M / TRACK_M,
    })
}

fn independent() -> AxleSuspension {
    axle(Guidance::Independent {
        jacking_slope: ROLL_CENTRE_M / (0.5 * TRACK_M),
        camber_gain_rad_per_m: 0.5,
    })
}

fn dot(one: Pair, other: Pair) -> f64 {
    one[0] * other[0] + one[1] * other[1]
}

/// Power of what dampers take, from their own motion.
fn damping_w(suspension: &AxleSuspension, rate: Pair) -> f64 {
    let share = match suspension.guidance {
        Guidance::Solid { damper_share, .. } => damper_share,
        Guidance::Independent { .. } => 1.0,
    };
    let (mean, half) = (0.5 * (rate[0] + rate[1]), 0.5 * share * (rate[0] - rate[1]));
    [mean + half, mean - half]
        .map(|speed: f64| {
            let damping = if speed > 0.0 {
                suspension.bump_n_s_per_m
            } else {
                suspension.rebound_n_s_per_m
            };
            damping * speed * speed
        })
        .iter()
        .sum()
}

proptest! {
    #[test]
    fn the_power_of_the_forces_is_that_of_energy_dampers_and_links(
        travel in [-0.06..0.06_f64, -0.06..0.06_f64],
        rate in [-1.0..1.0_f64, -1.0..1.0_f64],
        lateral in [-2e4..2e4_f64, -2e4..2e4_f64],
    ) {
        for suspension in [solid(), independent()] {
            let power = dot(suspension.forces_n(travel, rate, lateral), rate);
            let step = 1e-7;
            let moved = |sign: f64| {
                suspension.energy_j([0, 1].map(|i| travel[i] + sign * step * rate[i]))
            };
            let stored = (moved(1.0) - moved(-1.0)) / (2.0 * step);
            let links = dot(lateral, suspension.guidance.scrub_m_s(rate));
            let expected = stored + damping_w(&suspension, rate) - links;
            prop_assert!(
                (power - expected).abs() < 1e-5 * (power.abs() + expected.abs() + 1e4),
                "{power} W, {expected} W"
            );
        }
    }

    #[test]
    fn lean_forces_do_the_work_of_the_moments(
        rate in [-1.0..1.0_f64, -1.0..1.0_f64],
        moment in [-1e4..1e4_f64, -1e4..1e4_f64],
    ) {
        for suspension in [solid(), independent()] {
            let guidance = suspension.guidance;
            let by_force = dot(guidance.lean_forces_n(moment), rate);
            let by_moment = dot(moment, guidance.lean(rate));
            prop_assert!((by_force - by_moment).abs() < 1e-9 * (1e4 + by_force.abs()));
        }
    }
}

#[test]
fn the_roll_stiffness_has_the_springs_at_their_spacing() {
    // Roll of the body against the axle by a small angle, without touching the stops.
    let angle = 1e-3;
    let travel = 0.5 * TRACK_M * angle;
    let [left, right] = solid().forces_n([travel, -travel], [0.0; 2], [0.0; 2]);
    let moment = 0.5 * TRACK_M * (left - right);
    let expected = 2.0 * 700_000.0 * (0.5 * SPRING_SPACING_M).powi(2) + ANTI_ROLL_NM_PER_RAD;
    assert!((moment / angle / expected - 1.0).abs() < 1e-9);
    // Together, the wheels have the whole rate.
    let [left, right] = solid().forces_n([travel, travel], [0.0; 2], [0.0; 2]);
    assert!((0.5 * (left + right) - 4850.0 - 700_000.0 * travel).abs() < 1e-6);
}

#[test]
fn the_roll_damping_has_the_dampers_at_their_spacing() {
    let rate = 0.5 * TRACK_M * 0.1;
    let still = solid().forces_n([0.0; 2], [0.0; 2], [0.0; 2]);
    let [left, right] = solid().forces_n([0.0; 2], [rate, -rate], [0.0; 2]);
    let moment = 0.5 * TRACK_M * (left - still[0] - (right - still[1]));
    let expected = (20_000.0 + 40_000.0) * (0.5 * DAMPER_SPACING_M).powi(2) * 0.1;
    assert!((moment / expected - 1.0).abs() < 1e-9, "{moment} N m");
}

#[test]
fn a_lateral_force_acts_at_the_roll_centre() {
    // The links' pair turns the body by force times height, wherever the force comes from.
    for lateral in [[8e3, 0.0], [0.0, 8e3], [3e3, 5e3]] {
        let [left, right] = solid().forces_n([0.0; 2], [0.0; 2], lateral);
        let moment = 0.5 * TRACK_M * (left - right);
        assert!((moment + 8e3 * ROLL_CENTRE_M).abs() < 1e-6, "{moment} N m");
    }
}

#[test]
fn springs_as_far_apart_as_the_wheels_are_those_of_independent_wheels() {
    let wide = axle(Guidance::Solid {
        jacking_slope: 0.0,
        inverse_track_per_m: 1.0 / TRACK_M,
        spring_share: 1.0,
        damper_share: 1.0,
    });
    let free = axle(Guidance::Independent {
        jacking_slope: 0.0,
        camber_gain_rad_per_m: 0.0,
    });
    for (travel, rate) in [
        ([0.02, -0.01], [0.3, -0.1]),
        ([0.05, 0.01], [-0.2, 0.4]),
        ([-0.04, -0.02], [0.0, 0.1]),
    ] {
        let (one, other) = (
            wide.forces_n(travel, rate, [0.0; 2]),
            free.forces_n(travel, rate, [0.0; 2]),
        );
        for (a, b) in one.iter().zip(other) {
            assert!((a - b).abs() < 1e-8 * b.abs(), "{one:?} {other:?}");
        }
        assert!((wide.energy_j(travel) - free.energy_j(travel)).abs() < 1e-9);
    }
}
