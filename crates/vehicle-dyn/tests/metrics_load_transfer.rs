//! Load transfer ratio, quasi-static formula and load-transfer index against the simulation.

mod common;

use common::{TICK_S, on_flat, sedan};
use vehicle_dyn::metrics::{LoadTransferIndex, QuasiStaticTransfer, two_wheel_clearance_m};
use vehicle_dyn::parameters::{SolidAxleParameters, VehicleParameters};
use vehicle_dyn::simulation::{Command, Observation};

/// Share of the load transfer ratio by which both forms of the index may miss it in steady cornering up
/// to |LTR| = 0.85.
const STEADY_TOLERANCE: f64 = 0.01;
/// The same between there and lift-off.
const LAST_TOLERANCE: f64 = 0.04;

/// Cornering at a held handwheel until all is steady.
fn steady(vehicle: &VehicleParameters, handwheel_deg: f64, speed_kmh: f64) -> Observation {
    let mut simulation = on_flat(vehicle, 1.0, speed_kmh);
    let command = Command::from_deg_kmh(handwheel_deg, speed_kmh);
    for _ in 0..1200 {
        simulation.step(command, TICK_S).expect("finite");
    }
    simulation.observation()
}

fn index(vehicle: &VehicleParameters, seen: &Observation) -> f64 {
    LoadTransferIndex::new(vehicle).index(
        seen.roll_rad,
        seen.roll_rate_rad_s,
        seen.lateral_acceleration_m_s2,
    )
}

fn index_of_roll(vehicle: &VehicleParameters, seen: &Observation) -> f64 {
    LoadTransferIndex::new(vehicle).index_of_roll(seen.roll_rad, seen.roll_rate_rad_s)
}

fn quasi_static(vehicle: &VehicleParameters, seen: &Observation) -> f64 {
    QuasiStaticTransfer::new(vehicle).ltr(seen.lateral_acceleration_m_s2)
}

fn assert_steady(vehicle: &VehicleParameters, handwheel_deg: f64, speed_kmh: f64) {
    let seen = steady(vehicle, handwheel_deg, speed_kmh);
    let largest = seen.ltr.abs();
    assert!((0.05..0.95).contains(&largest), "{largest}");
    let share = if largest < 0.85 {
        STEADY_TOLERANCE
    } else {
        LAST_TOLERANCE
    };
    for found in [index(vehicle, &seen), index_of_roll(vehicle, &seen)] {
        assert!(
            (found - seen.ltr).abs() < share * largest,
            "index {found} at LTR {}",
            seen.ltr
        );
    }
}

#[test]
fn the_index_equals_the_load_transfer_ratio_in_steady_cornering() {
    for (handwheel_deg, speed_kmh) in [
        (8.0, 60.0),
        (-20.0, 70.0),
        (25.0, 80.0),
        (12.0, 100.0),
        (-38.0, 85.0),
        (50.0, 85.0),
        (55.0, 85.0),
    ] {
        assert_steady(&sedan(), handwheel_deg, speed_kmh);
    }
}

/// The sedan with a rear axle whose springs stand `spacing_m` apart, and its twin with independent
/// wheels and the anti-roll rate that makes up for it, as the plant takes both alike.
fn with_solid_rear_axle(spacing_m: f64) -> [VehicleParameters; 2] {
    let mut solid = sedan();
    solid.suspension.anti_roll_rear_nm_per_rad = 6000.0;
    solid.suspension.camber_gain_rear_rad_per_m = 0.0;
    let mut twin = solid.clone();
    solid.suspension.solid_axle_rear = Some(SolidAxleParameters {
        spring_spacing_m: spacing_m,
        damper_spacing_m: spacing_m,
    });
    let track = twin.geometry.track_rear_m;
    twin.suspension.anti_roll_rear_nm_per_rad +=
        0.5 * twin.suspension.spring_rate_rear_n_per_m * (spacing_m * spacing_m - track * track);
    assert!(twin.suspension.anti_roll_rear_nm_per_rad < 0.0);
    [solid, twin]
}

#[test]
fn springs_of_a_solid_axle_act_over_their_spacing_also_written_as_a_negative_anti_roll_rate() {
    let [solid, twin] = with_solid_rear_axle(1.0);
    assert_steady(&twin, 20.0, 60.0);
    let (solid, twin) = (
        LoadTransferIndex::new(&solid),
        LoadTransferIndex::new(&twin),
    );
    assert!((solid.per_roll_rad - twin.per_roll_rad).abs() < 1e-12);
    assert!((solid.roll_gradient_rad_per_m_s2 - twin.roll_gradient_rad_per_m_s2).abs() < 1e-12);
    // Dampers that stand closer damp the roll less; an anti-roll rate does not.
    assert!(solid.per_roll_rate_rad_s < twin.per_roll_rate_rad_s);
}

#[test]
fn the_index_follows_the_ratio_in_a_step_steer() {
    let vehicle = sedan();
    let seen = common::step_steer(on_flat(&vehicle, 1.0, 80.0), 25.0, 80.0);
    let worst = |measure: fn(&VehicleParameters, &Observation) -> f64| {
        let errors = seen.iter().map(|o| (measure(&vehicle, o) - o.ltr).abs());
        errors.fold(0.0, f64::max)
    };
    let largest = seen.iter().map(|o| o.ltr.abs()).fold(0.0, f64::max);
    // The index misses the ratio by the unsprung masses' inertia, the quasi-static formula by the roll.
    assert!(worst(index) < 0.025, "{}", worst(index));
    assert!(worst(index_of_roll) < 0.025, "{}", worst(index_of_roll));
    assert!(worst(quasi_static) > 0.1, "{}", worst(quasi_static));
    assert!((0.4..0.85).contains(&largest), "{largest}");
}

#[test]
fn the_index_goes_on_where_wheels_lift() {
    let vehicle = sedan();
    let mut simulation = on_flat(&vehicle, 0.85, 100.0);
    let mut seen = vec![simulation.observation()];
    while seen
        .last()
        .is_some_and(|o| o.roll_rad.abs() < 1.0 && o.time_s < 20.0)
    {
        let command = Command::from_deg_kmh(60.0, 100.0);
        seen.push(simulation.step(command, TICK_S).expect("finite"));
    }
    let lift = seen
        .iter()
        .position(Observation::two_wheel_lift)
        .expect("lifts");
    let at_lift = index(&vehicle, &seen[lift]);
    assert!((at_lift - 1.0).abs() < 0.1, "{at_lift}");
    let last = seen.last().expect("not empty");
    assert!(last.roll_rad > 1.0, "rolls over: {last:?}");
    // Near 45° the tyres lose their lateral force, and the index a part of its own.
    // The loads' ratio falls again, that of the sum stands still, and the index tells how far it is.
    let tipping: Vec<f64> = seen
        .iter()
        .filter(|o| (0.2..0.75).contains(&o.roll_rad))
        .map(|o| index(&vehicle, o))
        .collect();
    assert!(tipping[0] > 1.3 && tipping.is_sorted());
    let late = seen.iter().find(|o| o.roll_rad > 0.7).expect("on its way");
    assert!(late.ltr < 0.9 && late.ltr_of_sum > 0.999, "{late:?}");
    assert!(index(&vehicle, late) > 4.0);
}

#[test]
fn a_lifted_wheel_shows_the_gap_under_it() {
    let vehicle = sedan();
    let mut simulation = on_flat(&vehicle, 0.85, 100.0);
    for _ in 0..150 {
        let seen = simulation
            .step(Command::from_deg_kmh(60.0, 100.0), TICK_S)
            .expect("finite");
        for wheel in 0..4 {
            let gap = seen.wheel_clearance_m[wheel];
            assert!(gap >= 0.0);
            assert!(gap == 0.0 || seen.wheel_loads_n[wheel] == 0.0);
        }
        let height = two_wheel_clearance_m(&seen.wheel_clearance_m);
        assert_eq!(seen.two_wheel_lift_above(0.05), height > 0.05);
        assert!(seen.two_wheel_lift() || height == 0.0);
    }
    let [front_left, front_right, rear_left, rear_right] =
        simulation.observation().wheel_clearance_m;
    // Rolled by the angle over a track of 1.4 m: the left wheels hang in the air.
    let lifted = 1.4 * simulation.observation().roll_rad.sin();
    assert!(front_left > 0.2 && (front_left - lifted).abs() < 0.2 * lifted);
    assert!(rear_left > 0.2 && front_right == 0.0 && rear_right == 0.0);
    for (gaps, expected) in [
        ([0.1, 0.0, 0.2, 0.3], 0.1),
        ([0.0, 0.4, 0.2, 0.3], 0.3),
        ([0.5, 0.0, 0.0, 0.5], 0.0_f64),
    ] {
        assert_eq!(two_wheel_clearance_m(&gaps).to_bits(), expected.to_bits());
    }
}

#[test]
fn the_quasi_static_formula_is_that_of_a_rigid_vehicle() {
    let vehicle = sedan();
    let formula = QuasiStaticTransfer::new(&vehicle);
    let at_lift_off = vehicle.derived().static_stability_factor * 9.81;
    assert!((formula.ltr(at_lift_off) - 1.0).abs() < 1e-12);
    assert!((formula.ltr(-at_lift_off) + 1.0).abs() < 1e-12);
    for handwheel_deg in [8.0, -20.0] {
        let seen = steady(&vehicle, handwheel_deg, 60.0);
        let ratio = formula.ltr(seen.lateral_acceleration_m_s2) / seen.ltr;
        // What rolls outwards transfers more than the rigid formula says.
        assert!((0.8..0.95).contains(&ratio), "{ratio}");
    }
}
