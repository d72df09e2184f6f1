//! Each part of the vehicle gets the constants that the file gives it.

use super::*;

fn assert_close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-12 * (1.0 + expected.abs()),
        "{found} instead of {expected}"
    );
}

/// The sedan with values that differ wherever two could be mistaken for each other.
fn vehicle() -> VehicleParameters {
    let mut vehicle = crate::vehicles::embedded("sedan").expect("embedded");
    vehicle.tyre.relaxation_length_longitudinal_m = 0.125;
    vehicle.tyre.relaxation_length_lateral_m = 0.5;
    vehicle.tyre.vertical_stiffness_front_n_per_m = 180_000.0;
    vehicle.wheel.spin_inertia_front_kg_m2 = 1.25;
    vehicle.wheel.spin_inertia_rear_kg_m2 = 2.0;
    vehicle.wheel.gyroscopic_inertia_rear_kg_m2 = 0.8;
    vehicle
}

#[test]
fn each_wheel_gets_the_constants_of_its_axle() {
    let vehicle = vehicle();
    let dynamics = Dynamics::new(&vehicle);
    for (i, wheel) in dynamics.wheels.iter().enumerate() {
        let pick = |front: f64, rear: f64| if i < 2 { front } else { rear };
        let [longitudinal, lateral] = wheel.inverse_relaxation;
        assert_close(longitudinal, 8.0);
        assert_close(lateral, 2.0);
        assert_close(wheel.radial.stiffness_n_per_m, pick(180_000.0, 190_000.0));
        assert_close(wheel.inverse_spin_inertia, pick(0.8, 0.5));
        assert_close(wheel.gyroscopic_inertia, pick(0.9, 0.8));
        assert_close(wheel.camber_thrust_ratio, 0.046);
        // B1 is the only difference between the formulas of the axles.
        let ratio = wheel.formula.stiffness_n(3000.0, 1.0)
            / dynamics.wheels[0].formula.stiffness_n(3000.0, 1.0);
        assert_close(ratio, pick(1.0, 13.5 / 11.0));
    }
}

#[test]
fn each_axle_gets_its_own_springs_dampers_and_roll_centre() {
    let vehicle = vehicle();
    let figures = vehicle.derived();
    let [front, rear] = Dynamics::new(&vehicle).axles;
    assert_close(front.spring_n_per_m, 25_000.0);
    assert_close(rear.spring_n_per_m, 22_000.0);
    assert_close(front.bump_n_s_per_m, 1500.0);
    assert_close(front.rebound_n_s_per_m, 2800.0);
    assert_close(rear.bump_n_s_per_m, 1400.0);
    assert_close(rear.rebound_n_s_per_m, 2600.0);
    for (axle, slope, gain) in [
        (front, 0.06 / (0.5 * 1.3868), 0.3937),
        (rear, 0.12 / (0.5 * 1.3640), 0.9055),
    ] {
        assert_close(axle.guidance.scrub_m_s([1.0, 0.0])[0], slope);
        assert_close(axle.guidance.lean([1.0, 0.0])[0], gain);
    }
    assert_close(front.anti_roll_n_per_m, 16_000.0 / (1.3868 * 1.3868));
    assert_close(rear.anti_roll_n_per_m, 6000.0 / (1.3640 * 1.3640));
    assert_close(
        rear.preload_n,
        figures.static_load_rear_n - 31.9 * GRAVITY_M_S2,
    );
}
