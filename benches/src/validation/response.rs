//! Numbers read off a response: gains, rise times, frequency responses.

/// Time from `start_s` until `signal` first reaches 90 % of its last value, s; NaN when it never
/// does.
#[must_use]
pub fn rise_time_s(time_s: &[f64], signal: &[f64], start_s: f64) -> f64 {
    let Some(&last) = signal.last() else {
        return f64::NAN;
    };
    time_s
        .iter()
        .zip(signal)
        .find(|&(&time, &value)| time >= start_s && value / last >= 0.9)
        .map_or(f64::NAN, |(time, _)| time - start_s)
}

/// Gain and phase (deg) from `input` to `output` around `frequency_hz`: the cross spectrum over the
/// input's power spectrum, both summed over a band of ±15 % (the H1 estimate).
///
/// The signals are sampled at `sample_time_s` and must begin and end at rest, as a chirp does.
#[must_use]
pub fn frequency_response(
    input: &[f64],
    output: &[f64],
    sample_time_s: f64,
    frequency_hz: f64,
) -> [f64; 2] {
    const BAND: f64 = 0.15;
    const LINES: i32 = 31;
    let (mut real, mut imaginary, mut power) = (0.0, 0.0, 0.0);
    for line in 0..LINES {
        let offset = 2.0 * f64::from(line) / f64::from(LINES - 1) - 1.0;
        let omega = std::f64::consts::TAU * frequency_hz * (1.0 + BAND * offset) * sample_time_s;
        let [u, v] = fourier(input, omega);
        let [y, z] = fourier(output, omega);
        real += y * u + z * v;
        imaginary += z * u - y * v;
        power += u * u + v * v;
    }
    let (real, imaginary) = (real / power, imaginary / power);
    [real.hypot(imaginary), imaginary.atan2(real).to_degrees()]
}

/// Real and imaginary part of the Fourier sum at `omega` rad per sample.
fn fourier(signal: &[f64], omega: f64) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for (k, value) in signal.iter().enumerate() {
        let (sin, cos) = (omega * k as f64).sin_cos();
        sums[0] += value * cos;
        sums[1] -= value * sin;
    }
    sums
}

/// Root mean square of `one − other` over that of `one`.
#[must_use]
pub fn relative_difference(one: &[f64], other: &[f64]) -> f64 {
    let mut difference = 0.0;
    let mut size = 0.0;
    for (a, b) in one.iter().zip(other) {
        difference += (a - b) * (a - b);
        size += a * a;
    }
    (difference / size).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frequency_response_of_a_known_lag_is_found() {
        // First-order lag of 0.1 s, driven by a chirp from 0.1 to 3 Hz.
        let (step, lag) = (0.01, 0.1);
        let growth = 30.0_f64.ln() / 25.0;
        let input: Vec<f64> = (0..2500)
            .map(|k| {
                let time = step * f64::from(k);
                let turns = 0.1 * ((growth * time).exp() - 1.0) / growth;
                (std::f64::consts::TAU * turns).sin()
            })
            .collect();
        let mut state = 0.0;
        let keep = (-step / lag).exp();
        let output: Vec<f64> = input
            .iter()
            .map(|u| {
                let seen = state;
                state = keep * state + 3.0 * (1.0 - keep) * u;
                seen
            })
            .collect();
        for frequency in [0.2, 0.5, 1.0] {
            let [gain, phase] = frequency_response(&input, &output, step, frequency);
            let omega = std::f64::consts::TAU * frequency;
            let held = 0.5 * omega * step;
            let expected = 3.0 / (1.0 + (omega * lag).powi(2)).sqrt();
            let expected_phase = -((omega * lag).atan() + held).to_degrees();
            assert!((gain / expected - 1.0).abs() < 0.03, "{gain} {expected}");
            assert!(
                (phase - expected_phase).abs() < 2.0,
                "{phase} {expected_phase}"
            );
        }
    }

    #[test]
    fn the_rise_time_is_the_first_passing_of_90_per_cent() {
        let time: Vec<f64> = (0..10).map(f64::from).collect();
        let signal = [0.0, 0.0, 0.5, 0.95, 0.8, 1.2, 1.0, 1.0, 1.0, 1.0];
        assert!((rise_time_s(&time, &signal, 1.0) - 2.0).abs() < 1e-12);
        assert!(rise_time_s(&time, &[f64::NAN; 10], 1.0).is_nan());
    }
}
