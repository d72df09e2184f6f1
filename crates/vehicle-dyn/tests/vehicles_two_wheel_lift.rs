//! Which of the embedded vehicles lift two wheels on a flat road of friction 0.85, in manoeuvres like
//! those of NHTSA (J-turn, fishhook with roll-rate feedback), and which never do.

mod common;

use common::{TICK_S, on_flat};
use nalgebra::Vector3;
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::{Command, LongitudinalDemand, Observation, Simulation};
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2};
use vehicle_dyn::vehicles;

const FRICTION: f64 = 0.85;
const MPH_KMH: f64 = 1.609_344;
/// Roll rate below which the fishhook's steering reverses (NHTSA), rad/s.
const REVERSAL_RAD_S: f64 = 1.5 * DEGREE;

/// Height of both wheels of a side that counts as two-wheel lift (NHTSA: two inches), m.
const TWO_WHEEL_LIFT_M: f64 = 0.0508;

/// Steps with both pedals released.
fn released(handwheel_deg: f64) -> Command {
    Command {
        handwheel_rad: handwheel_deg * DEGREE,
        longitudinal: LongitudinalDemand::Released,
    }
}

/// Handwheel angle at 0.3 g in a slowly increasing steer at 50 mph, deg.
fn angle_at_0_3_g_deg(vehicle: &VehicleParameters) -> f64 {
    let speed_kmh = 50.0 * MPH_KMH;
    let mut simulation = on_flat(vehicle, FRICTION, speed_kmh);
    let mut angle = 0.0;
    loop {
        let seen = simulation
            .step(Command::from_deg_kmh(angle, speed_kmh), TICK_S)
            .expect("finite");
        if seen.lateral_acceleration_m_s2 >= 0.3 * GRAVITY_M_S2 {
            return angle;
        }
        assert!(angle < 200.0, "no 0.3 g");
        angle += 13.5 * TICK_S;
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Manoeuvre {
    JTurn,
    Fishhook,
}

/// Worst of what was seen in a manoeuvre of 5 s at a handwheel amplitude.
#[derive(Debug, Clone, Copy, Default)]
struct Worst {
    two_wheel_lift: bool,
    /// Height under the lower of two lifted wheels of one side, m.
    gap_m: f64,
    ltr: f64,
    roll_deg: f64,
    acceleration_g: f64,
}

impl Worst {
    fn note(&mut self, seen: &Observation, gap_m: f64) {
        self.two_wheel_lift |= seen.two_wheel_lift();
        self.gap_m = self.gap_m.max(gap_m);
        self.ltr = self.ltr.max(seen.ltr.abs());
        self.roll_deg = self.roll_deg.max(seen.roll_rad.abs() / DEGREE);
        self.acceleration_g = self
            .acceleration_g
            .max(seen.lateral_acceleration_m_s2.abs() / GRAVITY_M_S2);
    }

    fn or(self, other: Self) -> Self {
        Self {
            two_wheel_lift: self.two_wheel_lift || other.two_wheel_lift,
            gap_m: self.gap_m.max(other.gap_m),
            ltr: self.ltr.max(other.ltr),
            roll_deg: self.roll_deg.max(other.roll_deg),
            acceleration_g: self.acceleration_g.max(other.acceleration_g),
        }
    }
}

/// Height under the lower of the two wheels of that side which is higher off the ground, m.
fn gap_m(vehicle: &VehicleParameters, simulation: &Simulation) -> f64 {
    let figures = vehicle.derived();
    let geometry = &vehicle.geometry;
    let tyre = &vehicle.tyre;
    let state = simulation.state();
    let rotation = state.rotation();
    let gap = |wheel: usize| {
        let (x, track, load, stiffness) = if wheel < 2 {
            (
                geometry.sprung_cg_to_front_axle_m,
                geometry.track_front_m,
                figures.static_load_front_n,
                tyre.vertical_stiffness_front_n_per_m,
            )
        } else {
            (
                -geometry.sprung_cg_to_rear_axle_m,
                geometry.track_rear_m,
                figures.static_load_rear_n,
                tyre.vertical_stiffness_rear_n_per_m,
            )
        };
        let side = if wheel.is_multiple_of(2) { 0.5 } else { -0.5 };
        let at_rest = tyre.unloaded_radius_m - load / stiffness;
        let z = at_rest - vehicle.mass.sprung_cg_height_m + state.travel_m[wheel];
        let hub = state.position_m + rotation * Vector3::new(x, side * track, z);
        hub.z - tyre.unloaded_radius_m
    };
    gap(0).min(gap(2)).max(gap(1).min(gap(3)))
}

fn drive(
    vehicle: &VehicleParameters,
    manoeuvre: Manoeuvre,
    amplitude_deg: f64,
    speed_mph: f64,
) -> Worst {
    const RATE_DEG_S: f64 = 720.0;
    let mut simulation = on_flat(vehicle, FRICTION, speed_mph * MPH_KMH);
    let mut worst = Worst::default();
    let (mut angle, mut target, mut dwell_s) = (0.0_f64, amplitude_deg, 0.0);
    for _ in 0..500 {
        let step = RATE_DEG_S * TICK_S;
        angle += (target - angle).clamp(-step, step);
        let seen = simulation.step(released(angle), TICK_S).expect("finite");
        worst.note(&seen, gap_m(vehicle, &simulation));
        if seen.roll_rad.abs() > 1.05 {
            break;
        }
        // The fishhook reverses when the roll has settled, at the latest after half a second.
        let arrived = (angle - target).abs() < 1e-9 && target > 0.0;
        if manoeuvre == Manoeuvre::Fishhook && arrived {
            dwell_s += TICK_S;
            let settled = seen.roll_rate_rad_s.abs() < REVERSAL_RAD_S;
            if (settled && dwell_s > 0.05) || dwell_s > 0.5 {
                target = -amplitude_deg;
            }
        }
    }
    worst
}

/// The worst over multiples of the angle at 0.3 g, at most the handwheel's limit, and speeds.
fn worst_of(
    vehicle: &VehicleParameters,
    manoeuvre: Manoeuvre,
    multiples: &[f64],
    speeds_mph: &[f64],
) -> Worst {
    let angle = angle_at_0_3_g_deg(vehicle);
    let mut worst = Worst::default();
    for multiple in multiples {
        let amplitude = (multiple * angle).min(vehicle.steering.handwheel_limit_deg);
        for &speed_mph in speeds_mph {
            worst = worst.or(drive(vehicle, manoeuvre, amplitude, speed_mph));
        }
    }
    println!("{} {manoeuvre:?}: {worst:.3?}", vehicle.name);
    worst
}

/// The amplitudes and speeds of NHTSA's two manoeuvres.
fn nhtsa(vehicle: &VehicleParameters) -> [Worst; 2] {
    [
        worst_of(
            vehicle,
            Manoeuvre::JTurn,
            &[8.0],
            &[35.0, 40.0, 45.0, 50.0, 55.0, 60.0],
        ),
        worst_of(
            vehicle,
            Manoeuvre::Fishhook,
            &[5.5, 6.5],
            &[35.0, 40.0, 45.0, 50.0],
        ),
    ]
}

#[test]
fn vehicles_without_load_never_lift_two_wheels() {
    for name in ["sedan-unladen", "hmmwv"] {
        let vehicle = vehicles::embedded(name).expect("valid");
        for worst in nhtsa(&vehicle) {
            assert!(worst.gap_m < TWO_WHEEL_LIFT_M, "{name}: {worst:?}");
        }
    }
}

#[test]
fn the_hmmwv_keeps_its_wheels_down_whatever_the_driver_does() {
    let vehicle = vehicles::embedded("hmmwv").expect("valid");
    for manoeuvre in [Manoeuvre::JTurn, Manoeuvre::Fishhook] {
        let worst = worst_of(
            &vehicle,
            manoeuvre,
            &[3.0, 4.0, 5.5, 6.5, 8.0, f64::INFINITY],
            &[35.0, 40.0, 45.0, 50.0, 55.0, 60.0],
        );
        assert!(!worst.two_wheel_lift && worst.ltr < 0.9, "{worst:?}");
    }
}

#[test]
fn laden_vehicles_lift_two_wheels() {
    for name in ["sedan", "suv", "utility-truck", "utility-truck-laden"] {
        let vehicle = vehicles::embedded(name).expect("valid");
        let [j_turn, fishhook] = nhtsa(&vehicle);
        let worst = j_turn.or(fishhook);
        assert!(worst.gap_m > TWO_WHEEL_LIFT_M, "{name}: {worst:?}");
    }
}
