//! Figures of signals against signals whose figures are known in closed form.

use std::f64::consts::{PI, TAU};

use vehicle_dyn::manoeuvre::signal::{
    double_integral, first_peak, first_reach, linear_fit, mean, sine_fit, step_response, value_at,
};
use vehicle_dyn::manoeuvre::steering::{FishhookShape, RampHoldReturn, SineWithDwell};

/// Rounding of a handful of operations.
const ROUNDING: f64 = 1e-9;

fn sampled(end_s: f64, step_s: f64, value: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut signal = Vec::new();
    let mut index = 0;
    loop {
        let time = f64::from(index) * step_s;
        if time > end_s + 0.5 * step_s {
            return signal;
        }
        signal.push((time, value(time)));
        index += 1;
    }
}

#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found} instead of {expected} ± {tolerance}"
    );
}

#[test]
fn a_line_is_found_with_its_slope_and_intercept() {
    let points: Vec<(f64, f64)> = (0..30)
        .map(|i| 0.1 + 0.01 * f64::from(i))
        .map(|x| (x, 3.0 + 74.5 * x))
        .collect();
    let line = linear_fit(&points).expect("a line");
    assert_close(line.slope, 74.5, ROUNDING);
    assert_close(line.at(0.3), 3.0 + 74.5 * 0.3, ROUNDING);
    assert_eq!(line.points, 30);
    // Noise that is even about the line leaves it where it is.
    let noisy: Vec<(f64, f64)> = points
        .iter()
        .flat_map(|p| [(p.0, p.1 - 2.0), (p.0, p.1 + 2.0)])
        .collect();
    assert_close(linear_fit(&noisy).expect("a line").slope, 74.5, ROUNDING);
}

#[test]
fn no_line_through_less_than_two_places() {
    assert_eq!(linear_fit(&[]), None);
    assert_eq!(linear_fit(&[(1.0, 2.0)]), None);
    assert_eq!(linear_fit(&[(0.3, 2.0), (0.3, 5.0), (0.3, 9.0)]), None);
}

#[test]
fn between_samples_a_signal_is_straight_and_outside_it_is_nothing() {
    let signal = [(0.0, 1.0), (0.5, 3.0), (1.0, 3.0)];
    assert_eq!(value_at(&signal, 0.25), Some(2.0));
    assert_eq!(value_at(&signal, 1.0), Some(3.0));
    assert_eq!(value_at(&signal, 1.1), None);
    assert_eq!(value_at(&signal, -0.1), None);
    assert_eq!(value_at(&[], 0.0), None);
    assert_eq!(mean(&signal, 0.5, 1.0), Some(3.0));
    assert_eq!(mean(&signal, 0.6, 0.9), None);
}

#[test]
fn a_level_is_reached_where_the_line_between_samples_crosses_it() {
    let signal = [(0.0, 0.0), (1.0, 4.0), (2.0, 0.0), (3.0, 4.0)];
    assert_eq!(first_reach(&signal, 1.0, 0.0), Some(0.25));
    assert_eq!(first_reach(&signal, 1.0, 1.9), Some(2.25));
    assert_eq!(first_reach(&signal, 5.0, 0.0), None);
    assert_eq!(first_reach(&[], 1.0, 0.0), None);
}

/// Step response of `ω²/(s² + 2ζω s + ω²)` from `step_s` on.
fn second_order(time_s: f64, step_s: f64, omega: f64, zeta: f64) -> f64 {
    let t = time_s - step_s;
    if t <= 0.0 {
        return 0.0;
    }
    let root = (1.0 - zeta * zeta).sqrt();
    let damped = omega * root;
    1.0 - (-zeta * omega * t).exp() * ((damped * t).cos() + zeta / root * (damped * t).sin())
}

#[test]
fn step_figures_of_second_order_systems_are_those_of_theory() {
    for (omega, zeta, gain) in [(8.0, 0.5, 1.0), (12.0, 0.7, -3.5), (5.0, 0.3, 0.02)] {
        let step_s = 0.4;
        let signal = sampled(8.0, 0.002, |t| gain * second_order(t, step_s, omega, zeta));
        let found = step_response(&signal, step_s, gain).expect("figures");
        let root = (1.0_f64 - zeta * zeta).sqrt();
        assert_close(
            found.overshoot.expect("a peak"),
            (-PI * zeta / root).exp(),
            1e-4,
        );
        // The sample next to the peak.
        assert_close(
            found.peak_time_s.expect("a peak"),
            PI / (omega * root),
            0.002,
        );
        // By bisection on the closed form, which rises up to its peak.
        let (mut low, mut high) = (0.0, PI / (omega * root));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if second_order(middle, 0.0, omega, zeta) < 0.9 {
                low = middle;
            } else {
                high = middle;
            }
        }
        assert_close(found.response_time_s.expect("reaches 90 %"), low, 1e-4);
    }
}

#[test]
fn step_figures_say_what_a_signal_does_not_have() {
    let half = sampled(3.0, 0.01, |t| 0.5 * (1.0 - (-t).exp()));
    let found = step_response(&half, 0.0, 1.0).expect("figures");
    assert_eq!(found.response_time_s, None, "never reaches 90 %");
    assert_eq!(found.peak_time_s, None, "rises to its end");
    assert_eq!(found.overshoot, Some(0.0));
    assert_eq!(
        step_response(&half, 0.0, 0.0),
        None,
        "nothing to compare with"
    );
    assert_eq!(step_response(&half, 0.0, f64::NAN), None);
    let empty = step_response(&[], 0.0, 1.0).expect("figures");
    assert_eq!((empty.response_time_s, empty.overshoot), (None, None));
}

#[test]
fn integrated_twice_an_acceleration_is_a_distance() {
    let constant = sampled(2.0, 0.01, |_| 3.0);
    let found = double_integral(&constant, 0.305, 1.375).expect("covered");
    assert_close(found, 0.5 * 3.0 * 1.07 * 1.07, ROUNDING);
    let ramp = sampled(2.0, 0.01, |t| 6.0 * t);
    assert_close(
        double_integral(&ramp, 0.0, 1.07).expect("covered"),
        1.07_f64.powi(3),
        ROUNDING,
    );
    assert_eq!(
        double_integral(&ramp, 1.5, 2.5),
        None,
        "the run ended before"
    );
}

#[test]
fn the_first_peak_is_no_ripple_and_above_zero() {
    let signal = sampled(2.0, 0.01, |t| -(TAU * t).sin());
    let (time, value) = first_peak(&signal, 0.1, 0.05).expect("a peak");
    assert_close(time, 0.75, 0.005);
    assert_close(value, 1.0, 1e-3);
    assert_eq!(first_peak(&sampled(2.0, 0.01, |_| 0.0), 0.1, 0.05), None);
    assert_eq!(
        first_peak(&sampled(1.0, 0.01, |t| -2.0 + t), 0.1, 0.05),
        None
    );
    assert_eq!(first_peak(&[], 0.0, 0.05), None);
}

#[test]
fn a_sine_is_found_below_a_mean_and_a_drift() {
    for (frequency, amplitude, phase) in [(0.2, 2.0, -0.4), (1.3, 0.01, 2.9), (3.0, 50.0, -3.0)] {
        let signal = sampled(12.0, 0.01, |t| {
            7.0 - 0.3 * t + amplitude * (TAU * frequency * t + phase).sin()
        });
        let found = sine_fit(&signal, frequency, 2.0, f64::MAX).expect("a sine");
        assert_close(found.amplitude, amplitude, 1e-8 * amplitude);
        assert_close(found.phase_rad, phase, 1e-8);
    }
    assert_eq!(sine_fit(&[(0.0, 1.0); 4], 1.0, 0.0, 1.0), None);
}

#[test]
fn the_sine_with_dwell_is_exact_in_time() {
    let wave = SineWithDwell {
        amplitude_deg: 100.0,
        frequency_hz: 0.7,
        dwell_s: 0.5,
    };
    let period = 1.0 / 0.7;
    for (time, angle) in [
        (-1.0, 0.0),
        (0.0, 0.0),
        (period / 12.0, 50.0),
        (0.25 * period, 100.0),
        (0.5 * period, 0.0),
        (0.75 * period, -100.0),
        (0.75 * period + 0.2, -100.0),
        (0.75 * period + 0.5, -100.0),
        (period * 11.0 / 12.0 + 0.5, -50.0),
        (period + 0.5, 0.0),
        (5.0, 0.0),
    ] {
        assert_close(wave.at(time), angle, ROUNDING);
    }
    assert_close(wave.end_s(), period + 0.5, ROUNDING);
    assert_close(wave.dwell_end_s(), 0.75 * period + 0.5, ROUNDING);
}

#[test]
fn a_j_turn_ramps_holds_and_returns() {
    let shape = RampHoldReturn {
        amplitude_deg: 160.0,
        rate_deg_per_s: 1000.0,
        hold_s: 4.0,
        return_s: 2.0,
    };
    for (time, angle) in [
        (-0.1, 0.0),
        (0.08, 80.0),
        (0.16, 160.0),
        (4.16, 160.0),
        (5.16, 80.0),
        (6.16, 0.0),
        (9.0, 0.0),
    ] {
        assert_close(shape.at(time), angle, ROUNDING);
    }
    assert_close(shape.end_s(), 6.16, ROUNDING);
}

#[test]
fn a_fishhook_reverses_where_it_is_told() {
    let shape = FishhookShape {
        amplitude_deg: 144.0,
        rate_deg_per_s: 720.0,
        hold_s: 3.0,
        return_s: 2.0,
    };
    assert_close(shape.first_ramp_s(), 0.2, ROUNDING);
    assert_close(shape.at(30.0, None), 144.0, ROUNDING);
    let reversal = Some(0.45);
    for (time, angle) in [
        (0.1, 72.0),
        (0.45, 144.0),
        (0.65, 0.0),
        (0.85, -144.0),
        (3.85, -144.0),
        (4.85, -72.0),
        (5.85, 0.0),
        (8.0, 0.0),
    ] {
        assert_close(shape.at(time, reversal), angle, ROUNDING);
    }
    assert_close(shape.end_s(0.45), 5.85, ROUNDING);
}
