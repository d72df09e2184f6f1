//! Figures of whole manoeuvres against theory and against traces made by hand.

mod common;

use std::ops::ControlFlow;

use common::{TICK_S, on_flat, sedan};
use vehicle_dyn::manoeuvre::{
    self, Figure, LEAD_IN_S, Manoeuvre, ManoeuvreFile, Performed, RunSettings, Trace, TraceRow,
};
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::Observation;
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2};

fn file(name: &str) -> ManoeuvreFile {
    manoeuvre::find(name).expect("embedded")
}

fn perform(name: &str, vehicle: &VehicleParameters) -> Performed {
    file(name)
        .perform(vehicle, RunSettings::default(), &mut |_| {
            ControlFlow::Continue(())
        })
        .expect("performed")
}

#[track_caller]
fn number(figures: &[Figure], name: &str) -> f64 {
    let figure = figures.iter().find(|figure| figure.name == name);
    let figure = figure.unwrap_or_else(|| panic!("no figure `{name}`"));
    figure.as_number().unwrap_or_else(|| panic!("{figure}"))
}

/// A trace of which only the given parts of each instant are of interest.
fn made(end_s: f64, set: impl Fn(f64, &mut Observation)) -> Trace {
    let base = on_flat(&sedan(), 0.85, 80.0).observation();
    let mut trace = Trace::new("made");
    let mut index = 0;
    while f64::from(index) * TICK_S <= end_s + 1e-9 {
        let time = f64::from(index) * TICK_S;
        let mut seen = Observation {
            time_s: time,
            ..base
        };
        set(time, &mut seen);
        let handwheel_command_rad = seen.handwheel_actual_rad;
        trace.rows.push(TraceRow {
            handwheel_command_rad,
            seen,
        });
        if !trace.note(&seen, manoeuvre::TWO_WHEEL_LIFT_M) {
            break;
        }
        index += 1;
    }
    trace
}

/// A vehicle as the theory of the linear single-track model has it: tyres whose cornering stiffness
/// is proportional to load, no camber, hardly any roll, no drag.
fn single_track() -> VehicleParameters {
    let mut vehicle = sedan();
    vehicle.tyre.stiffness_saturation_c2 = 0.0;
    vehicle.tyre.q_load = 0.0;
    vehicle.tyre.mu_tyre = 3.0;
    vehicle.tyre.stiffness_factor_b1_front = 4.5;
    vehicle.tyre.stiffness_factor_b1_rear = 5.5;
    vehicle.tyre.camber_thrust_ratio = 0.0;
    vehicle.tyre.rolling_resistance_coefficient = 0.0;
    vehicle.suspension.camber_gain_front_rad_per_m = 0.0;
    vehicle.suspension.camber_gain_rear_rad_per_m = 0.0;
    vehicle.mass.sprung_cg_height_m = 0.25;
    vehicle.aerodynamics.drag_area_m2 = 0.0;
    vehicle.powertrain.differential_coupling_nm_s_per_rad = 0.0;
    vehicle
}

#[test]
fn the_understeer_gradient_of_a_single_track_vehicle_is_that_of_theory() {
    let vehicle = single_track();
    let tyre = &vehicle.tyre;
    // Stiffness per load is B1·C1·D1, so what an axle needs per g does not depend on its load:
    // K = 1/(B1 C1 D1) in front less the same in the rear, rad/g.
    let per_g = |b1: f64| 1.0 / (b1 * tyre.shape_factor_c1 * tyre.mu_tyre * 0.85);
    let expected =
        (per_g(tyre.stiffness_factor_b1_front) - per_g(tyre.stiffness_factor_b1_rear)) / DEGREE;
    for name in ["iso-4138-constant-radius", "iso-4138-constant-speed"] {
        let mut file = file(name);
        // The theory is that of small slip angles.
        if let Manoeuvre::Circular(circular) = &mut file.manoeuvre {
            circular.gradient_from_g = 0.05;
            circular.gradient_to_g = 0.15;
            circular.end_lateral_acceleration_g = 0.2;
        }
        let done = file
            .perform(&vehicle, RunSettings::default(), &mut |_| {
                ControlFlow::Continue(())
            })
            .expect("performed");
        let found = number(&done.report.figures, "understeer gradient");
        println!("{name}: {found} deg/g, theory {expected} deg/g");
        assert!(
            (found / expected - 1.0).abs() < 0.03,
            "{name}: {found} deg/g instead of {expected} deg/g"
        );
    }
}

#[test]
fn a_neutral_vehicle_has_no_understeer() {
    let mut vehicle = single_track();
    vehicle.tyre.stiffness_factor_b1_rear = vehicle.tyre.stiffness_factor_b1_front;
    let done = perform("iso-4138-constant-radius", &vehicle);
    let found = number(&done.report.figures, "understeer gradient");
    assert!(found.abs() < 0.05, "{found} deg/g");
}

#[test]
fn slowly_increasing_steer_recovers_the_slope_of_a_made_trace() {
    let Manoeuvre::SlowlyIncreasingSteer(manoeuvre) = file("slowly-increasing-steer").manoeuvre
    else {
        panic!("another kind")
    };
    for sign in [1.0, -1.0] {
        // 2 deg of play and 70 deg/g; beyond 0.4 g the vehicle slides and the angle runs away.
        let trace = made(6.0, |time, seen| {
            let acceleration_g = (0.1 * time).min(0.4);
            let angle = 2.0 + 70.0 * acceleration_g + (time - 4.0).max(0.0) * 100.0;
            seen.lateral_acceleration_m_s2 = sign * acceleration_g * GRAVITY_M_S2;
            seen.handwheel_actual_rad = sign * angle * DEGREE;
        });
        let line = manoeuvre.line(&trace, sign).expect("a line");
        assert!((line.slope - 70.0).abs() < 1e-9, "{line:?}");
        assert!((line.at(0.3) - 23.0).abs() < 1e-9, "{line:?}");
        assert_eq!(manoeuvre.line(&trace, -sign), None, "the other direction");
    }
}

/// Yaw rate that follows the handwheel with a gain and then decays with a time constant.
fn dwell_trace(sign: f64, tail_per_s: f64, roll_at_s: f64) -> (Trace, f64) {
    let wave = manoeuvre::steering::SineWithDwell {
        amplitude_deg: 100.0,
        frequency_hz: 0.7,
        dwell_s: 0.5,
    };
    let end_s = wave.end_s();
    let trace = made(LEAD_IN_S + end_s + 2.5, |time, seen| {
        let since = time - LEAD_IN_S;
        seen.handwheel_actual_rad = sign * wave.at(since) * DEGREE;
        // The dwell's yaw rate of −30 deg/s ebbs away from the end of the dwell on.
        let ebb = (-(since - wave.dwell_end_s()).max(0.0) * tail_per_s).exp();
        let yaw_rate = if since < wave.dwell_end_s() {
            0.3 * wave.at(since)
        } else {
            -30.0 * ebb
        };
        seen.yaw_rate_rad_s = sign * yaw_rate * DEGREE;
        seen.lateral_acceleration_m_s2 = if since > 0.0 { sign * 4.0 } else { 0.0 };
        seen.y_m = if since > 0.0 {
            sign * 2.0 * since * since
        } else {
            0.0
        };
        if time > roll_at_s {
            seen.roll_rad = sign * 1.2;
        }
    });
    (trace, end_s - wave.dwell_end_s())
}

#[test]
fn yaw_rate_ratio_and_displacement_are_read_where_the_rule_says() {
    let Manoeuvre::SineWithDwell(manoeuvre) = file("sine-with-dwell").manoeuvre else {
        panic!("another kind")
    };
    for sign in [1.0, -1.0] {
        let (trace, quarter_s) = dwell_trace(sign, 1.0, f64::INFINITY);
        let figures = manoeuvre.figures(&trace, sign, 100.0, 20.0, 1263.0);
        // Completion of steer is found up to the last hundredth of the amplitude, about 2 ms.
        for after in [1.0, 1.75] {
            let name = format!("yaw rate ratio {after:.2} s after completion of steer");
            let expected = 100.0 * (-(quarter_s + after)).exp();
            let found = number(&figures, &name);
            assert!(
                (found / expected - 1.0).abs() < 0.005,
                "{name}: {found} instead of {expected}"
            );
        }
        // From the begin of steer (5 deg) on, 4 m/s² make 2 t² m.
        let name = "lateral displacement 1.07 s after begin of steer";
        let found = number(&figures, name);
        assert!((found - 2.0 * 1.07 * 1.07).abs() < 1e-6, "{found}");
        let judged = figures
            .iter()
            .find(|figure| figure.name == name)
            .expect("there");
        assert_eq!(judged.met, Some(true), "5 A, 2.29 m");
        let light = manoeuvre.figures(&trace, sign, 100.0, 25.0, 1263.0);
        let unjudged = light
            .iter()
            .find(|figure| figure.name == name)
            .expect("there");
        assert_eq!(unjudged.requirement, None, "4 A is not judged");
    }
}

#[test]
fn a_yaw_rate_that_does_not_ebb_fails_and_one_that_is_zero_gives_no_ratio() {
    let Manoeuvre::SineWithDwell(manoeuvre) = file("sine-with-dwell").manoeuvre else {
        panic!("another kind")
    };
    let name = "yaw rate ratio 1.00 s after completion of steer";
    let of = |trace: &Trace| {
        let figures = manoeuvre.figures(trace, 1.0, 100.0, 20.0, 1263.0);
        let ratio = figures
            .iter()
            .find(|figure| figure.name == name)
            .expect("there");
        (ratio.as_number(), ratio.met)
    };
    let (spinning, _) = dwell_trace(1.0, 0.0, f64::INFINITY);
    let (ratio, met) = of(&spinning);
    assert!((ratio.expect("a ratio") - 100.0).abs() < 1e-6);
    assert_eq!(met, Some(false));

    let mut still = spinning;
    for row in &mut still.rows {
        row.seen.yaw_rate_rad_s = 0.0;
    }
    assert_eq!(of(&still), (None, None));
}

#[test]
fn a_run_that_ends_in_a_rollover_fails_and_says_what_is_missing() {
    let Manoeuvre::SineWithDwell(manoeuvre) = file("sine-with-dwell").manoeuvre else {
        panic!("another kind")
    };
    let (rolled, _) = dwell_trace(1.0, 1.0, 1.2);
    assert_eq!(rolled.ended, Outcome::RolledOver);
    let figures = manoeuvre.figures(&rolled, 1.0, 100.0, 20.0, 1263.0);
    let upright = figures
        .iter()
        .find(|figure| figure.name == "stayed on its wheels");
    assert_eq!(upright.expect("there").met, Some(false));
    let missing = figures.iter().filter(|figure| figure.as_number().is_none());
    for figure in missing.filter(|figure| figure.as_flag().is_none()) {
        assert!(figure.note.is_some(), "{figure}");
    }
    let ratio = figures
        .iter()
        .find(|figure| figure.name.starts_with("yaw rate ratio"));
    assert_eq!(ratio.expect("there").met, None);
}

#[test]
fn step_figures_of_a_made_trace_are_those_of_its_second_order_system() {
    let Manoeuvre::StepSteer(manoeuvre) = file("iso-7401-step").manoeuvre else {
        panic!("another kind")
    };
    // The handwheel takes 0.1 s; half of it is the time of reference, from which the responses run.
    let (omega, zeta) = (7.0_f64, 0.6_f64);
    let root = (1.0 - zeta * zeta).sqrt();
    let zero_s = LEAD_IN_S + 0.05;
    let response = |time: f64| {
        let t = (time - zero_s).max(0.0);
        let damped = omega * root;
        1.0 - (-zeta * omega * t).exp() * ((damped * t).cos() + zeta / root * (damped * t).sin())
    };
    for sign in [1.0, -1.0] {
        let trace = made(LEAD_IN_S + 6.0, |time, seen| {
            let share = ((time - LEAD_IN_S) / 0.1).clamp(0.0, 1.0);
            seen.handwheel_actual_rad = sign * 30.0 * share * DEGREE;
            seen.yaw_rate_rad_s = sign * 10.0 * response(time) * DEGREE;
            seen.lateral_acceleration_m_s2 = sign * 4.0 * response(time);
            seen.roll_rad = 0.0;
            seen.sideslip_rad = sign * -0.5 * DEGREE * response(time);
        });
        let figures = manoeuvre.figures(&trace, sign);
        let peak_s = std::f64::consts::PI / (omega * root);
        let close = |name: &str, expected: f64, tolerance: f64| {
            let found = number(&figures, name);
            assert!(
                (found - expected).abs() < tolerance,
                "{name}: {found}, not {expected}"
            );
        };
        close("yaw rate gain", 10.0 / 30.0, 1e-4);
        close("lateral acceleration gain", 4.0 / 30.0, 1e-4);
        close("yaw rate peak response time", peak_s, 0.01);
        close(
            "yaw rate overshoot",
            100.0 * (-std::f64::consts::PI * zeta / root).exp(),
            0.05,
        );
        close("TB factor", -0.5 * peak_s, 0.01);
        let roll = figures
            .iter()
            .find(|figure| figure.name == "roll angle response time");
        assert_eq!(
            roll.expect("there").as_number(),
            None,
            "a body that does not roll"
        );
    }
}
