//! One wheel on the ground by itself: slip, camber, scrub and what happens off the ground.

mod common;

use common::{TICK_S, on_flat, sedan};
use nalgebra::Vector3;
use vehicle_dyn::simulation::Command;
use vehicle_dyn::suspension::{AxleSuspension, Guidance};
use vehicle_dyn::terrain::Ground;
use vehicle_dyn::tyre::{MagicFormula, RadialSpring};
use vehicle_dyn::wheels::{Contact, Wheel, WheelMotion, spin_axis};

const LATERAL_RELAXATION_M: f64 = 0.4;
const LONGITUDINAL_RELAXATION_M: f64 = 0.12;
const DEFLECTION_M: f64 = 0.016;
const SPEED_M_S: f64 = 25.0;
const ROAD: Ground = Ground {
    height_m: 0.0,
    gradient_x: 0.0,
    gradient_y: 0.0,
    friction: 0.85,
};

fn wheel() -> Wheel {
    let tyre = sedan().tyre;
    Wheel {
        formula: MagicFormula::new(&tyre, tyre.stiffness_factor_b1_front, 12_393.0),
        radial: RadialSpring {
            stiffness_n_per_m: 190_000.0,
            damping_n_s_per_m: 0.0,
        },
        radius_m: 0.344,
        crown_radius_m: 0.0,
        half_twin_spacing_m: 0.0,
        lateral_compliance_m_per_n: 0.0,
        camber_thrust_ratio: 0.05,
        inverse_relaxation: [1.0 / LONGITUDINAL_RELAXATION_M, 1.0 / LATERAL_RELAXATION_M],
        rolling_resistance: 0.01,
        inverse_spin_inertia: 1.0 / 1.7,
        gyroscopic_inertia: 0.9,
    }
}

/// Rolling straight ahead, upright, without slip.
fn rolling() -> WheelMotion {
    WheelMotion {
        axis: Vector3::y(),
        velocity_m_s: Vector3::new(SPEED_M_S, 0.0, 0.0),
        angular_rad_s: Vector3::zeros(),
        lean_rate_per_s: 0.0,
        turn_per_lean: Vector3::zeros(),
        scrub_m_s: 0.0,
        height_m: 0.344 - DEFLECTION_M,
        normal: Vector3::z(),
        spin_rad_s: SPEED_M_S / wheel().rolling_radius_m(DEFLECTION_M),
        slip: [0.0; 2],
    }
}

fn contact(motion: &WheelMotion) -> Contact {
    wheel().contact(motion, &ROAD)
}

/// `found` is `expected` up to rounding.
fn assert_close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() <= 1e-9 * (1.0 + expected.abs()),
        "{found} instead of {expected}"
    );
}

#[test]
fn braking_and_cornering_share_one_friction_circle() {
    let peak = wheel().formula.peak_force_n(190_000.0 * DEFLECTION_M, 0.85);
    let force = |slip: [f64; 2]| contact(&WheelMotion { slip, ..rolling() }).tangential_n;
    for size in [0.05, 0.1, 0.5, 3.0] {
        let alone = [force([-size, 0.0]).x, force([0.0, size]).y];
        let both = force([-size, size]);
        // Each component is that of the whole slip, √2 as large, times its share in it.
        let root = 2.0_f64.sqrt();
        let whole = force([0.0, root * size]).y;
        assert_close(both.x, -whole / root);
        assert_close(both.y, whole / root);
        assert!(both.norm() <= peak * (1.0 + 1e-9), "{both} above {peak} N");
        assert!(both.x > 0.9 * alone[0] && both.y < 0.9 * alone[1]);
    }
}

#[test]
fn each_slip_rises_by_63_percent_over_its_own_relaxation_length() {
    const STEP_S: f64 = 1e-6;
    // The wheel spins 2 % too fast and drifts to the left at 0.5 m/s.
    let mut motion = rolling();
    motion.spin_rad_s *= 1.02;
    motion.velocity_m_s.y = 0.5;
    let steady = [0.02, -0.02];
    let expected = 1.0 - (-1.0_f64).exp();
    let wheel = wheel();
    for (direction, length_m) in [LONGITUDINAL_RELAXATION_M, LATERAL_RELAXATION_M]
        .into_iter()
        .enumerate()
    {
        motion.slip = [0.0; 2];
        let mut travelled = 0.0;
        while travelled < length_m {
            let rate = wheel.contact(&motion, &ROAD).slip_rate;
            motion.slip = [0, 1].map(|i: usize| motion.slip[i] + STEP_S * rate[i]);
            travelled += STEP_S * SPEED_M_S;
        }
        let risen = motion.slip[direction] / steady[direction];
        assert!((risen - expected).abs() < 1e-3, "{direction}: {risen}");
    }
}

#[test]
fn a_leaning_wheel_pushes_towards_the_side_it_leans_to() {
    for lean_left in [0.05_f64, -0.05] {
        // A wheel whose top leans to the left has its left-pointing axis dipping.
        let axis = Vector3::new(0.0, lean_left.cos(), -lean_left.sin());
        let seen = contact(&WheelMotion { axis, ..rolling() });
        // The ratio says which side slip the lean is worth.
        let as_slip = 0.05 * lean_left.sin();
        let expected = wheel()
            .formula
            .force_n(seen.load_n, ROAD.friction, [0.0, as_slip])[1];
        assert!(expected * lean_left > 0.0 && expected.abs() > 50.0);
        assert_close(seen.tangential_n.y, expected);
    }
}

#[test]
fn travel_about_the_roll_centre_scrubs_the_tyre_sideways() {
    for scrub_m_s in [0.03, -0.03] {
        let seen = contact(&WheelMotion {
            scrub_m_s,
            ..rolling()
        });
        // Moving left is a slip that pushes to the right.
        assert_close(seen.slip_rate[1], -scrub_m_s / LATERAL_RELAXATION_M);
    }
}

#[test]
fn the_jacking_pair_does_no_work_of_its_own_at_a_wheel_that_points_ahead() {
    let slope = 0.15;
    let axle = AxleSuspension {
        preload_n: 0.0,
        spring_n_per_m: 0.0,
        bump_n_s_per_m: 0.0,
        rebound_n_s_per_m: 0.0,
        anti_roll_n_per_m: 0.0,
        travel_m: 0.1,
        stop_n_per_m: 0.0,
        stop_n_per_m2: 0.0,
        guidance: Guidance::Independent {
            jacking_slope: slope,
            camber_gain_rad_per_m: 0.0,
        },
    };
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        for steer in [0.0_f64, 0.1] {
            let slip = [0.01, 0.03];
            let rate = 0.3;
            let motion = WheelMotion {
                axis: spin_axis(steer.sin_cos().into(), 0.0)[0],
                velocity_m_s: Vector3::new(SPEED_M_S, -0.4, 0.0),
                scrub_m_s: sign * slope * rate,
                slip,
                ..rolling()
            };
            let seen = contact(&motion);
            let mut lateral = [0.0; 2];
            lateral[side] = seen.tangential_n.y;
            // The pair pushes the body up and the wheel down.
            let pair_w = -axle.forces_n([0.0; 2], [0.0; 2], lateral)[side] * rate;
            let forward = Vector3::new(steer.cos(), steer.sin(), 0.0);
            let left = Vector3::new(-steer.sin(), steer.cos(), 0.0);
            let speed = motion.velocity_m_s.dot(&forward);
            let lateral_speed = -seen.slip_rate[1] * LATERAL_RELAXATION_M - speed * slip[1];
            let longitudinal_n = seen.tangential_n.dot(&forward);
            let slipping_w = longitudinal_n * speed + seen.tangential_n.dot(&left) * lateral_speed;
            let given_w = seen.tangential_n.dot(&motion.velocity_m_s) + pair_w;
            // Steered wheels scrub along their own direction too, which the slip leaves out.
            let left_out_w = longitudinal_n * sign * slope * rate * steer.sin();
            assert!(pair_w.abs() > 50.0, "{pair_w} W");
            assert_close(given_w, slipping_w + left_out_w);
        }
    }
}

#[test]
fn sliding_without_rolling_is_a_slip_of_ten_and_not_an_infinite_one() {
    for (motion, steady) in [
        (
            WheelMotion {
                velocity_m_s: Vector3::new(0.0, 1.0, 0.0),
                spin_rad_s: 0.0,
                ..rolling()
            },
            [0.0, -10.0],
        ),
        (
            WheelMotion {
                velocity_m_s: Vector3::zeros(),
                spin_rad_s: 8.0,
                ..rolling()
            },
            [10.0, 0.0],
        ),
    ] {
        let rate = |share: f64| {
            let slip = steady.map(|s: f64| share * s);
            contact(&WheelMotion { slip, ..motion }).slip_rate
        };
        let (at_rest, halfway, settled) = (rate(0.0), rate(0.5), rate(1.0));
        for i in 0..2 {
            assert_close(halfway[i], 0.5 * at_rest[i]);
            assert_close(settled[i], 0.0);
        }
        assert!(at_rest[0].abs() + at_rest[1].abs() > 1.0);
    }
}

#[test]
fn a_wheel_off_the_ground_carries_nothing_and_loses_its_slip() {
    let slip = [0.1, -0.2];
    let seen = contact(&WheelMotion {
        height_m: 0.35,
        velocity_m_s: Vector3::new(SPEED_M_S, 6.0, 0.0),
        slip,
        ..rolling()
    });
    assert!(seen.deflection_m < 0.0);
    assert_close(seen.force_n.norm() + seen.spin_moment_nm.abs(), 0.0);
    // Whatever the wheel does: the carcass springs back within about 10 ms.
    assert_close(seen.slip_rate[0], -100.0 * slip[0]);
    assert_close(seen.slip_rate[1], -100.0 * slip[1]);
}

#[test]
fn a_vehicle_that_flies_sideways_lands_without_the_slip_of_its_flight() {
    let mut simulation = on_flat(&sedan(), 0.85, 90.0);
    let mut flying = *simulation.state();
    flying.position_m.z += 1.0;
    flying.velocity_m_s.y = 6.0;
    flying.slip = [[0.05, -0.24]; 4];
    simulation.set_state(flying).expect("finite");
    for _ in 0..20 {
        let seen = simulation
            .step(Command::from_deg_kmh(0.0, 90.0), TICK_S)
            .expect("finite");
        assert!(seen.wheel_loads_n.iter().all(|&load| load <= 0.0));
    }
    for slip in simulation.state().slip {
        assert!(slip[0].abs() + slip[1].abs() < 1e-6, "{slip:?}");
    }
}
