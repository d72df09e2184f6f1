//! A truck with solid axles and twin tyres as a whole: energy, momentum, symmetry, tilt table.

mod common;

use common::{TICK_S, on_flat, step_steer};
use nalgebra::Vector3;
use vehicle_dyn::parameters::{SolidAxleParameters, VehicleParameters};
use vehicle_dyn::simulation::{
    Command, DEFAULT_SUBSTEP_S, LongitudinalDemand, Observation, Simulation,
};
use vehicle_dyn::terrain::Terrain;
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2};
use vehicle_dyn::vehicles;

const NO_COMMAND: Command = Command {
    handwheel_rad: 0.0,
    longitudinal: LongitudinalDemand::Released,
};

fn truck() -> VehicleParameters {
    vehicles::embedded("utility-truck").expect("valid")
}

/// The truck without anything that takes or gives energy.
fn lossless() -> VehicleParameters {
    let mut vehicle = truck();
    let suspension = &mut vehicle.suspension;
    suspension.damping_bump_front_n_s_per_m = 0.0;
    suspension.damping_rebound_front_n_s_per_m = 0.0;
    suspension.damping_bump_rear_n_s_per_m = 0.0;
    suspension.damping_rebound_rear_n_s_per_m = 0.0;
    vehicle.tyre.vertical_damping_n_s_per_m = 0.0;
    vehicle.tyre.rolling_resistance_coefficient = 0.0;
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    vehicle
}

/// A number in [−1, 1] that follows from the two.
fn noise(seed: u32, index: u32) -> f64 {
    let mixed = (seed * 7919 + index * 104_729).wrapping_mul(2_654_435_761);
    f64::from(mixed >> 8) / f64::from(1 << 23) - 1.0
}

#[test]
fn random_motions_keep_their_energy() {
    // Body, axles and twins swing, lean, lift and land: forces of springs, stops, tyres and lean must
    // give back what they take.
    for seed in 1..=10 {
        let mut simulation = on_flat(&lossless(), 0.0, 0.0);
        let rest_j = simulation.energy().total_j();
        let mut state = *simulation.state();
        state.velocity_m_s = Vector3::new(noise(seed, 0), noise(seed, 1), 0.3 * noise(seed, 2));
        state.angular_rad_s = Vector3::new(
            0.5 * noise(seed, 3),
            0.1 * noise(seed, 4),
            0.2 * noise(seed, 5),
        );
        state.set_angles(0.03 * noise(seed, 6), 0.01 * noise(seed, 7), noise(seed, 8));
        state.travel_m = [9, 10, 11, 12].map(|i| 0.02 * noise(seed, i));
        state.travel_rate_m_s = [13, 14, 15, 16].map(|i| 0.5 * noise(seed, i));
        simulation.set_state(state).expect("finite");
        let start_j = simulation.energy().total_j();
        let mut worst = 0.0_f64;
        for _ in 0..300 {
            simulation.step(NO_COMMAND, TICK_S).expect("finite");
            worst = worst.max((simulation.energy().total_j() - start_j).abs());
        }
        let swing_j = start_j - rest_j;
        println!("seed {seed}: {worst:.2e} J of {swing_j:.0} J");
        assert!(
            swing_j > 500.0 && worst < 1e-3 * swing_j,
            "{worst} J of {swing_j} J"
        );
    }
}

#[test]
fn a_free_roll_decay_without_dampers_keeps_its_energy() {
    let mut simulation = on_flat(&lossless(), 0.0, 0.0);
    let rest_j = simulation.energy().total_j();
    let mut leaning = *simulation.state();
    leaning.angular_rad_s = Vector3::new(0.3, 0.0, 0.0);
    simulation.set_state(leaning).expect("finite");
    let swing_j = simulation.energy().total_j() - rest_j;
    let mut largest_roll = 0.0_f64;
    for _ in 0..1000 {
        let seen = simulation.step(NO_COMMAND, TICK_S).expect("finite");
        largest_roll = largest_roll.max(seen.roll_rad.abs());
    }
    let lost = (swing_j - (simulation.energy().total_j() - rest_j)) / swing_j / 10.0;
    println!("{lost:.1e} a second at {largest_roll:.3} rad");
    assert!(largest_roll > 0.01, "{largest_roll} rad");
    assert!(lost.abs() < 1e-3, "lost {lost} a second");
}

#[test]
fn a_truck_in_flight_keeps_its_momentum() {
    let mut vehicle = truck();
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    let mut simulation = on_flat(&vehicle, 0.85, 70.0);
    let mut flying = *simulation.state();
    flying.position_m.z += 30.0;
    flying.angular_rad_s = Vector3::new(1.2, -0.4, 0.7);
    flying.velocity_m_s.y = 2.0;
    flying.travel_rate_m_s = [0.5, -0.7, 0.2, 0.9];
    simulation.set_state(flying).expect("finite");
    let before = simulation.momentum();
    let mass = vehicle.derived().total_mass_kg;
    for _ in 0..10 {
        let seen = simulation
            .step(Command::from_deg_kmh(100.0, 90.0), 0.1)
            .expect("finite");
        assert!(seen.wheel_loads_n.iter().all(|&load| load <= 0.0));
        let now = simulation.momentum();
        let falling = Vector3::new(0.0, 0.0, -mass * GRAVITY_M_S2 * seen.time_s);
        let linear = (now.linear_kg_m_s - before.linear_kg_m_s - falling).norm();
        let angular = (now.angular_kg_m2_s - before.angular_kg_m2_s).norm();
        assert!(linear < 1e-6 * before.linear_kg_m_s.norm(), "{linear}");
        assert!(
            angular < 1e-5 * before.angular_kg_m2_s.norm(),
            "{angular} of {}",
            before.angular_kg_m2_s.norm()
        );
    }
}

/// A fishhook: the handwheel to one side, after 0.8 s to the other, pedals released.
fn fishhook(handwheel_deg: f64, speed_kmh: f64) -> Vec<Observation> {
    let mut simulation = on_flat(&truck(), 0.85, speed_kmh);
    (0..400)
        .map(|tick| {
            let angle = if tick < 80 {
                handwheel_deg
            } else {
                -handwheel_deg
            };
            let command = Command {
                handwheel_rad: angle * DEGREE,
                ..NO_COMMAND
            };
            simulation.step(command, TICK_S).expect("finite")
        })
        .collect()
}

#[test]
fn mirrored_steering_gives_exactly_the_mirrored_load_transfer_even_in_a_rollover() {
    let [left, right] = [400.0, -400.0].map(|angle| fishhook(angle, 85.0));
    for (l, r) in left.iter().zip(&right) {
        assert!(
            (l.ltr + r.ltr).abs() <= 1e-9 && (l.roll_rad + r.roll_rad).abs() <= 1e-9,
            "{} and {} at {} s",
            l.ltr,
            r.ltr,
            l.time_s
        );
    }
    assert!(left.iter().any(Observation::two_wheel_lift), "it lifts");
}

/// The truck with hard springs, bars and tyres: one rigid body on six springs.
fn rigid(twin_spacing_m: f64) -> VehicleParameters {
    let mut vehicle = truck();
    let suspension = &mut vehicle.suspension;
    suspension.spring_rate_front_n_per_m = 1e7;
    suspension.spring_rate_rear_n_per_m = 1e7;
    suspension.anti_roll_front_nm_per_rad = 1e7;
    suspension.anti_roll_rear_nm_per_rad = 1e7;
    for axle in [
        &mut suspension.solid_axle_front,
        &mut suspension.solid_axle_rear,
    ] {
        *axle = Some(SolidAxleParameters {
            spring_spacing_m: 2.0,
            damper_spacing_m: 1.0,
        });
    }
    // Links at the road's height leave the moment to the springs.
    vehicle.geometry.roll_centre_height_front_m = 0.0;
    vehicle.geometry.roll_centre_height_rear_m = 0.0;
    vehicle.tyre.crown_radius_m = vehicle.tyre.unloaded_radius_m;
    vehicle.tyre.vertical_stiffness_front_n_per_m = 2e6;
    vehicle.tyre.vertical_stiffness_rear_n_per_m = 2e6;
    vehicle.tyre.lateral_compliance_m_per_n = 0.0;
    vehicle.tyre.twin_spacing_rear_m = twin_spacing_m;
    vehicle
}

/// Tilts the table to the right until the two left wheels carry nothing; the angle in rad.
fn lift_angle_rad(vehicle: &VehicleParameters) -> f64 {
    const RAMP_RAD_S: f64 = 0.02;
    let mut simulation = on_flat(vehicle, 2.0, 0.0);
    for tick in 0..6000 {
        let angle = RAMP_RAD_S * TICK_S * f64::from(tick);
        let gravity = Vector3::new(0.0, -angle.sin(), -angle.cos()) * GRAVITY_M_S2;
        simulation.set_gravity_m_s2(gravity).expect("finite");
        let seen = simulation.step(NO_COMMAND, TICK_S).expect("finite");
        if seen.two_wheel_lift() {
            return angle;
        }
    }
    panic!("no lift up to 1.2 rad");
}

/// Roll stiffness of each axle of the rigid truck, N m/rad.
const RIGID_NM_PER_RAD: f64 = 3e7;

/// Half the width on which the rigid truck stands, and its roll angle, when its last left wheel
/// lifts (m, rad).
///
/// Each axle keeps its load `W`. It leans by `γ` on its tyres; a single wheel at `±a` lifts at
/// `γ = W/(2 a k)`, and the inner of twins, at `−(a − b)`, when the two right ones at `a ∓ b` with
/// `k/2` each carry `W = k γ (2a − b)`. The load then stands at `e = a`; that of twins at
/// `e = a + b · k b γ/W`, and at the outer edge `a + b` once the right wheel stands on its outer tyre
/// alone. The body rolls further by `W e/K` on its springs. The later axle decides the roll angle;
/// the other one goes on to lean until its moment fits to it.
fn stand_at_lift(vehicle: &VehicleParameters) -> [f64; 2] {
    let figures = vehicle.derived();
    let k = vehicle.tyre.vertical_stiffness_rear_n_per_m;
    let axles = [
        (
            0.5 * vehicle.geometry.track_front_m,
            0.0,
            2.0 * figures.static_load_front_n,
        ),
        (
            0.5 * vehicle.geometry.track_rear_m,
            0.5 * vehicle.tyre.twin_spacing_rear_m,
            2.0 * figures.static_load_rear_n,
        ),
    ];
    let stands_at =
        |(a, b, load): (f64, f64, f64), lean: f64| a + b * (k * b * lean / load).min(1.0);
    let roll = axles
        .map(|axle| {
            let (a, b, load) = axle;
            let lean = load / (k * (2.0 * a - b));
            lean + load * stands_at(axle, lean) / RIGID_NM_PER_RAD
        })
        .into_iter()
        .fold(0.0, f64::max);
    let moments: f64 = axles
        .iter()
        .map(|&axle| {
            let mut lean = roll;
            for _ in 0..50 {
                lean = roll - axle.2 * stands_at(axle, lean) / RIGID_NM_PER_RAD;
            }
            axle.2 * stands_at(axle, lean)
        })
        .sum();
    [moments / (axles[0].2 + axles[1].2), roll]
}

#[test]
fn a_rigid_truck_lifts_on_the_tilt_table_where_its_outer_tyres_stand() {
    for spacing in [0.0, 0.3, 0.6] {
        let vehicle = rigid(spacing);
        let [half_width, roll] = stand_at_lift(&vehicle);
        // The centre of gravity leans out over the wheels by roll times height.
        let height = vehicle.derived().cg_height_m;
        let expected = (half_width / height - roll).atan();
        let found = lift_angle_rad(&vehicle);
        println!("spacing {spacing} m: {found:.4} rad, {expected:.4} rad, {half_width:.4} m");
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{spacing} m: {found} rad instead of {expected} rad"
        );
    }
}

#[test]
fn the_truck_itself_lifts_on_the_tilt_table_near_its_quasi_static_lift_off() {
    // A table takes load off the wheels as it tilts, a turn does not: the two agree only roughly.
    let found = lift_angle_rad(&truck());
    let expected = truck().cornering_figures(2.0).lift_off_g.atan();
    println!("{found:.4} rad, {expected:.4} rad");
    assert!((found / expected - 1.0).abs() < 0.05);
}

#[test]
fn the_body_rolls_on_springs_at_their_spacing_in_series_with_the_tyres() {
    let mut vehicle = truck();
    // Without links, patch shift and push on leaning wheels it is springs and tyres alone.
    vehicle.geometry.roll_centre_height_front_m = 0.0;
    vehicle.geometry.roll_centre_height_rear_m = 0.0;
    vehicle.tyre.lateral_compliance_m_per_n = 0.0;
    vehicle.tyre.crown_radius_m = vehicle.tyre.unloaded_radius_m;
    let figures = vehicle.derived();
    let series = |suspension: f64, tyre: f64, half_track: f64, half_twin: f64| {
        let tyres = 2.0 * tyre * (half_track.powi(2) + half_twin.powi(2));
        suspension * tyres / (suspension + tyres)
    };
    let front = series(
        2.0 * 250_000.0 * 0.445_f64.powi(2) + 28_647.9,
        980_000.0,
        1.015,
        0.0,
    );
    let rear = series(
        2.0 * 700_000.0 * 0.5_f64.powi(2) + 85_943.7,
        1_960_000.0,
        0.93,
        0.15,
    );
    let drop = |load: f64, stiffness: f64| {
        vehicle.mass.sprung_cg_height_m - (vehicle.tyre.unloaded_radius_m - load / stiffness)
    };
    let tilt = 0.01;
    let sprung_n = |load: f64, unsprung_kg: f64| 2.0 * (load - unsprung_kg * GRAVITY_M_S2);
    let mut falling = 0.0;
    for (load, unsprung, stiffness) in [
        (figures.static_load_front_n, 285.0, 980_000.0),
        (figures.static_load_rear_n, 367.5, 1_960_000.0),
    ] {
        falling += sprung_n(load, unsprung) * drop(load, stiffness);
    }
    let moment = figures.total_mass_kg * GRAVITY_M_S2 * tilt * figures.cg_height_m;
    let expected = moment / (front + rear - falling);

    let mut simulation = on_flat(&vehicle, 2.0, 0.0);
    let gravity = Vector3::new(0.0, -f64::sin(tilt), -f64::cos(tilt)) * GRAVITY_M_S2;
    simulation.set_gravity_m_s2(gravity).expect("finite");
    let mut seen = simulation.observation();
    for _ in 0..40 {
        seen = simulation.step(NO_COMMAND, 0.5).expect("finite");
    }
    println!("{:.6} rad, {expected:.6} rad", seen.roll_rad);
    assert!((seen.roll_rad / expected - 1.0).abs() < 0.01);
}

#[test]
fn an_axle_with_springs_at_its_wheels_drives_like_an_independent_one() {
    // Where lean and links play no part: roll centres in the road, treads round as a ball, no camber
    // thrust. Twins would resist the lean, so there are none.
    let mut solid = truck();
    solid.geometry.roll_centre_height_front_m = 0.0;
    solid.geometry.roll_centre_height_rear_m = 0.0;
    solid.tyre.crown_radius_m = solid.tyre.unloaded_radius_m;
    solid.tyre.camber_thrust_ratio = 0.0;
    solid.tyre.lateral_compliance_m_per_n = 0.0;
    solid.tyre.twin_spacing_rear_m = 0.0;
    // What gyrates would feel the lean's rate.
    solid.wheel.gyroscopic_inertia_front_kg_m2 = 0.0;
    solid.wheel.gyroscopic_inertia_rear_kg_m2 = 0.0;
    let mut independent = solid.clone();
    let at_wheels = |track_m: f64| {
        Some(SolidAxleParameters {
            spring_spacing_m: track_m,
            damper_spacing_m: track_m,
        })
    };
    solid.suspension.solid_axle_front = at_wheels(solid.geometry.track_front_m);
    solid.suspension.solid_axle_rear = at_wheels(solid.geometry.track_rear_m);
    independent.suspension.solid_axle_front = None;
    independent.suspension.solid_axle_rear = None;
    let runs =
        [solid, independent].map(|vehicle| step_steer(on_flat(&vehicle, 0.85, 60.0), 120.0, 60.0));
    let worst = largest_difference(&runs[0], &runs[1]);
    let largest = runs[0].iter().fold(0.0_f64, |most, o| most.max(o.ltr));
    println!("LTR {largest:.3}, difference {worst:.1e}");
    assert!(largest > 0.3 && worst < 1e-3, "{worst}");
}

#[test]
fn springs_closer_than_the_wheels_are_a_negative_bar_between_them() {
    // The way to write a solid axle without a table of its own, for the roll stiffness at least.
    let truck = truck();
    let mut equivalent = truck.clone();
    let bar = |rate: f64, spacing: f64, track: f64| {
        2.0 * rate * ((0.5 * spacing).powi(2) - (0.5 * track).powi(2))
    };
    equivalent.suspension.solid_axle_front = None;
    equivalent.suspension.solid_axle_rear = None;
    equivalent.suspension.anti_roll_front_nm_per_rad += bar(250_000.0, 0.89, 2.03);
    equivalent.suspension.anti_roll_rear_nm_per_rad += bar(700_000.0, 1.0, 1.86);
    let (one, other) = (truck.derived(), equivalent.derived());
    for (a, b) in [
        (
            one.roll_stiffness_front_nm_per_rad,
            other.roll_stiffness_front_nm_per_rad,
        ),
        (
            one.roll_stiffness_rear_nm_per_rad,
            other.roll_stiffness_rear_nm_per_rad,
        ),
    ] {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn the_tyres_compliance_narrows_the_stand_by_its_shift() {
    // A rigid truck in a steady turn: the patches move by c F, so the moment Σ N c F is lost.
    let turn = |compliance: f64| {
        let mut vehicle = rigid(0.0);
        vehicle.tyre.lateral_compliance_m_per_n = compliance;
        let mut simulation = on_flat(&vehicle, 0.85, 60.0);
        for tick in 0..100 {
            let angle = 0.8 * f64::from(tick);
            simulation
                .step(Command::from_deg_kmh(angle, 60.0), TICK_S)
                .expect("finite");
        }
        let seen = simulation
            .step(Command::from_deg_kmh(80.0, 60.0), 8.0)
            .expect("finite");
        (vehicle, seen)
    };
    let (vehicle, stiff) = turn(0.0);
    let compliance = 1.5e-5;
    let (_, soft) = turn(compliance);
    let figures = vehicle.derived();
    let mass = figures.total_mass_kg;
    let per_acceleration =
        |seen: &Observation| seen.ltr / (seen.lateral_acceleration_m_s2 / GRAVITY_M_S2);
    let found = per_acceleration(&soft) - per_acceleration(&stiff);
    // Each axle's force stands on its wheels nearly as its load does.
    let share = figures.cg_to_front_axle_m / figures.wheelbase_m;
    let loads = soft.wheel_loads_n;
    let mut lost = 0.0;
    for (left, right, part) in [
        (loads[0], loads[1], 1.0 - share),
        (loads[2], loads[3], share),
    ] {
        let force = mass * GRAVITY_M_S2 * part;
        lost += compliance * force * (left * left + right * right) / (left + right);
    }
    let half_track = 0.5
        * (vehicle.geometry.track_front_m * (1.0 - share) + vehicle.geometry.track_rear_m * share);
    let expected = lost / half_track / (mass * GRAVITY_M_S2);
    println!("{found:.4} 1/g, {expected:.4} 1/g, LTR {:.3}", soft.ltr);
    assert!(soft.ltr > 0.3);
    assert!((found / expected - 1.0).abs() < 0.05);
}

fn largest_difference(one: &[Observation], other: &[Observation]) -> f64 {
    one.iter()
        .zip(other)
        .map(|(a, b)| (a.ltr - b.ltr).abs())
        .fold(0.0, f64::max)
}

#[test]
fn halving_the_step_changes_the_trucks_load_transfer_by_less_than_1e_3() {
    for (handwheel_deg, speed_kmh) in [(60.0, 60.0), (150.0, 80.0), (250.0, 95.0)] {
        let runs = [1.0, 0.5].map(|factor| {
            let simulation = Simulation::with_substep(
                &truck(),
                Terrain::flat(0.85),
                common::pose(speed_kmh),
                factor * DEFAULT_SUBSTEP_S,
            )
            .expect("valid set-up");
            let mut seen = step_steer(simulation, handwheel_deg, speed_kmh);
            seen.retain(|o| o.roll_rad.abs() < 60.0 * DEGREE);
            seen
        });
        let difference = largest_difference(&runs[0], &runs[1]);
        println!("{handwheel_deg} deg at {speed_kmh} km/h: {difference:.1e}");
        assert!(
            difference < 1e-3,
            "{difference} at {handwheel_deg} deg, {speed_kmh} km/h"
        );
    }
}
