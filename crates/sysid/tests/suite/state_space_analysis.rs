//! Poles, zeros and responses of the model.

use crate::common;
use std::f64::consts::TAU;

use common::{channel, largest_difference, plant};
use deepc_core::faer::{Mat, c64, mat};
use sysid::{Mode, StateSpace, SysidError, SystemMatrices};

fn model(a: Mat<f64>, b: Mat<f64>, c: Mat<f64>, d: Mat<f64>) -> StateSpace {
    let (n, m, p) = (a.nrows(), b.ncols(), c.nrows());
    let named = |kind: &str, count: usize| {
        let names = (0..count).map(|i| channel(&format!("{kind}{i}"), 0.0, 1.0));
        names.collect::<Vec<_>>()
    };
    let k = Mat::zeros(n, p);
    let system = SystemMatrices { a, b, c, d, k };
    StateSpace::new(0.1, named("u", m), vec![], named("y", p), system).unwrap()
}

/// Responses of a model are its impulse response's Fourier sums; 600 samples leave 1e-12 of it.
#[test]
fn the_frequency_response_is_the_transform_of_the_impulse_response() {
    let model = plant();
    let frequencies = [0.0, 0.3, 1.7, 4.0, 5.0];
    let found = model.frequency_response(&frequencies).unwrap();
    let impulses = model.markov_parameters(600);
    for (frequency, found) in frequencies.iter().zip(&found) {
        for i in 0..2 {
            for j in 0..3 {
                let mut sum = c64::new(0.0, 0.0);
                for (k, impulse) in impulses.iter().enumerate() {
                    let angle = -TAU * frequency * model.sample_time_s() * k as f64;
                    sum += c64::new(angle.cos(), angle.sin()) * impulse[(i, j)];
                }
                assert!((sum - found[(i, j)]).norm() < 1e-9);
            }
        }
    }
}

#[test]
fn markov_parameters_are_the_impulse_response() {
    let model = plant();
    let parameters = model.markov_parameters(20);
    assert_eq!(parameters.len(), 21);
    for input in 0..3 {
        let rest: Vec<f64> = model
            .inputs()
            .iter()
            .chain(model.disturbances())
            .map(|c| c.offset)
            .collect();
        let impulse = Mat::from_fn(21, 3, |k, j| {
            rest[j] + f64::from(u8::from(k == 0 && j == input))
        });
        let y = model.simulate(&[0.0; 4], impulse.as_ref()).unwrap();
        for (k, parameter) in parameters.iter().enumerate() {
            for i in 0..2 {
                let found = y[(k, i)] - model.outputs()[i].offset;
                assert!((found - parameter[(i, input)]).abs() < 1e-11);
            }
        }
    }
}

#[test]
fn the_steady_state_gain_is_where_a_step_ends() {
    let model = plant();
    let gain = model.steady_state_gain().unwrap();
    let sum = model
        .markov_parameters(3000)
        .into_iter()
        .reduce(|a, b| a + b);
    assert!(largest_difference(&gain, &sum.unwrap()) < 1e-10);
    let rest = model.frequency_response(&[0.0]).unwrap();
    assert!((rest[0][(1, 2)] - c64::new(gain[(1, 2)], 0.0)).norm() < 1e-12);
}

#[test]
fn an_integrator_has_no_gain() {
    for a in [mat![[1.0, 0.1], [0.0, 1.0]], mat![[1.0, 0.0], [0.3, 0.5]]] {
        let model = model(a, mat![[0.0], [0.1]], mat![[1.0, 0.0]], mat![[0.0]]);
        let error = model.steady_state_gain();
        assert!(matches!(error, Err(SysidError::Integrator { distance }) if distance < 1e-7));
        assert!(model.frequency_response(&[0.0]).is_err());
        assert!(model.frequency_response(&[0.1]).is_ok());
    }
}

#[test]
fn frequencies_beyond_half_the_rate_are_refused() {
    for wrong in [-0.1, 5.1, f64::NAN] {
        let error = plant().frequency_response(&[1.0, wrong]);
        let Err(SysidError::Frequency { largest_hz, .. }) = error else {
            panic!("{error:?}")
        };
        assert!((largest_hz - 5.0).abs() < 1e-12);
    }
}

/// s² + 2·0.2·(2π·3)·s + (2π·3)² sampled at 0.01 s.
#[test]
fn modes_give_frequency_damping_and_time_constant_back() {
    let (ts, frequency, damping) = (0.01_f64, 3.0_f64, 0.2_f64);
    let omega = TAU * frequency;
    let decay = (-damping * omega * ts).exp();
    let angle = omega * (1.0 - damping * damping).sqrt() * ts;
    let mode = Mode::new(c64::new(decay * angle.cos(), decay * angle.sin()), ts);
    assert!((mode.natural_frequency_hz - frequency).abs() < 1e-12);
    assert!((mode.damping - damping).abs() < 1e-12);
    assert!((mode.time_constant_s - 1.0 / (damping * omega)).abs() < 1e-12);
    let row = mode.to_string();
    assert!(
        row.contains("3.0000 Hz") && row.contains("damping  0.2000"),
        "{row}"
    );
    let slow = Mode::new(c64::new(1.0 - 1e-12, 0.0), 1.0);
    assert!((slow.time_constant_s * 1e-12 - 1.0).abs() < 1e-3);
    let integrator = Mode::new(c64::new(1.0, 0.0), 1.0);
    assert!(integrator.time_constant_s.is_infinite() && integrator.damping > 0.999);
    let delay = Mode::new(c64::new(0.0, 0.0), 1.0);
    assert!(delay.time_constant_s == 0.0 && delay.natural_frequency_hz.is_infinite());
    let grows = Mode::new(c64::new(1.5, 0.1), 1.0);
    assert!(grows.damping < 0.0 && grows.time_constant_s < 0.0);
}

#[test]
fn poles_are_sorted_and_the_predictor_is_a_minus_kc() {
    let model = plant();
    let poles = model.poles().unwrap();
    assert!(poles.is_sorted_by(|a, b| a.norm() >= b.norm() - 1e-12));
    assert!((poles[0].norm() - model.spectral_radius().unwrap()).abs() < 1e-15);
    assert!(poles[0].im > 0.0 && poles[1].im < 0.0 && model.is_stable().unwrap());
    let m = model.matrices();
    let predictor = &m.a - &m.k * &m.c;
    let values = predictor.eigenvalues().unwrap();
    let radius = values.iter().map(|z| z.norm()).fold(0.0, f64::max);
    assert!((model.predictor_radius().unwrap() - radius).abs() < 1e-12);
    assert_eq!(model.modes().unwrap().len(), 4);
}

fn assert_zeros(found: &[c64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for z in expected {
        let nearest = found.iter().map(|f| (f - c64::new(*z, 0.0)).norm());
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest < tolerance, "{z}: {found:?}");
    }
}

/// Companion form of (z − z1)(z − z2)… over a polynomial.
fn from_polynomials(numerator: &[f64], denominator: &[f64]) -> StateSpace {
    let n = denominator.len();
    let a = Mat::from_fn(n, n, |i, j| {
        if i == 0 {
            -denominator[j]
        } else {
            f64::from(u8::from(i == j + 1))
        }
    });
    let b = Mat::from_fn(n, 1, |i, _| f64::from(u8::from(i == 0)));
    let c = Mat::from_fn(1, n, |_, j| match (j + numerator.len()).checked_sub(n) {
        Some(index) => numerator[index],
        None => 0.0,
    });
    model(a, b, c, mat![[0.0]])
}

#[test]
fn zeros_of_one_channel_are_the_roots_of_its_numerator() {
    // (z − 0.5)(z + 2) = z² + 1.5 z − 1 over order 4: two zeros at infinity.
    let system = from_polynomials(&[1.0, 1.5, -1.0], &[-0.3, 0.2, 0.1, -0.05]);
    assert_zeros(&system.zeros().unwrap(), &[0.5, -2.0], 1e-10);
    let tiny = from_polynomials(&[1e-7, 1.5e-7, -1e-7], &[-0.3, 0.2, 0.1, -0.05]);
    assert_zeros(&tiny.channel_zeros(0, 0).unwrap(), &[0.5, -2.0], 1e-10);
    let none = from_polynomials(&[0.7], &[-0.3, 0.2, 0.1, -0.05]);
    assert_zeros(&none.zeros().unwrap(), &[], 0.0);
}

/// G = [1/(z−a), 2/(z−a); 1/(z−b), c/(z−b)·…]: with D of rank one and known determinant.
#[test]
fn zeros_of_two_by_two_are_those_of_the_determinant() {
    // G = [1/(z−0.5), 1/(z−0.2); 1/(z−0.3), 2/(z−0.2)]:
    // det = [2(z−0.3) − (z−0.5)] / ((z−0.5)(z−0.3)(z−0.2)) = (z − 0.1)/(…), one zero at 0.1.
    // The pole at 0.2 is shared by both channels of the second input, so that order 3 is minimal.
    let a = mat![[0.5, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.2]];
    let b = mat![[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let c = mat![[1.0, 0.0, 1.0], [0.0, 1.0, 2.0]];
    let plain = model(a.clone(), b.clone(), c.clone(), Mat::zeros(2, 2));
    assert_zeros(&plain.zeros().unwrap(), &[0.1], 1e-12);
    // With D = I, det of (D + G) vanishes at the eigenvalues of A − B C.
    let direct = model(a.clone(), b.clone(), c.clone(), Mat::identity(2, 2));
    let expected = (&a - &b * &c).eigenvalues().unwrap();
    let found = direct.zeros().unwrap();
    assert_eq!(found.len(), 3);
    for z in expected {
        assert!(found.iter().any(|f| (f - z).norm() < 1e-12), "{found:?}");
    }
    // D of rank one: three states, two zeros; at each the system matrix is singular.
    let half = model(a, b, c, mat![[1.0, 0.0], [0.0, 0.0]]);
    let found = half.zeros().unwrap();
    assert_eq!(found.len(), 2);
    for z in found {
        assert!(smallest_singular_value(&half, z) < 1e-12);
    }
}

fn smallest_singular_value(model: &StateSpace, z: c64) -> f64 {
    let (s, n) = (model.matrices(), model.order());
    let pencil = Mat::from_fn(n + s.outputs(), n + s.inputs(), |i, j| {
        let value = match (i < n, j < n) {
            (true, true) => s.a[(i, j)],
            (true, false) => s.b[(i, j - n)],
            (false, true) => s.c[(i - n, j)],
            (false, false) => s.d[(i - n, j - n)],
        };
        let diagonal = if i == j && i < n {
            z
        } else {
            c64::new(0.0, 0.0)
        };
        c64::new(value, 0.0) - diagonal
    });
    *pencil.singular_values().unwrap().last().unwrap()
}

#[test]
fn unequal_numbers_have_zeros_per_channel() {
    let model = plant();
    assert!(model.zeros().unwrap().is_empty());
    for output in 0..2 {
        for input in 0..3 {
            for z in model.channel_zeros(output, input).unwrap() {
                // At a zero the channel's response to z^k is nothing: D + C (zI − A)⁻¹ B = 0.
                let value = transfer(&model, z)[(output, input)];
                assert!(value.norm() < 1e-9, "{output} {input} {z} {value}");
            }
        }
    }
    assert_eq!(model.channel_zeros(0, 0).unwrap().len(), 4);
    assert_eq!(model.channel_zeros(0, 1).unwrap().len(), 3);
    assert!(matches!(
        model.channel_zeros(2, 0),
        Err(SysidError::NoSuchChannel {
            index: 2,
            count: 2,
            ..
        })
    ));
}

fn transfer(model: &StateSpace, z: c64) -> Mat<c64> {
    use deepc_core::faer::linalg::solvers::Solve;
    let (s, n) = (model.matrices(), model.order());
    let complex =
        |m: &Mat<f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0));
    let shift = Mat::from_fn(n, n, |i, j| if i == j { z } else { c64::new(0.0, 0.0) });
    let shifted = shift - complex(&s.a);
    complex(&s.d) + complex(&s.c) * shifted.partial_piv_lu().solve(complex(&s.b))
}

#[test]
fn a_model_without_states_is_its_feedthrough() {
    let gain = mat![[2.0, -1.0], [0.5, 3.0]];
    let model = model(
        Mat::zeros(0, 0),
        Mat::zeros(0, 2),
        Mat::zeros(2, 0),
        gain.clone(),
    );
    assert!(model.poles().unwrap().is_empty() && model.zeros().unwrap().is_empty());
    assert!(model.spectral_radius().unwrap() < 1e-300);
    assert_eq!(model.steady_state_gain().unwrap(), gain);
    let response = model.frequency_response(&[1.0]).unwrap();
    assert_eq!(response[0][(1, 0)], c64::new(0.5, 0.0));
    assert_eq!(
        StateSpace::from_json(&model.to_json().unwrap()).unwrap(),
        model
    );
    assert!(model.balanced().is_ok() && model.hankel_singular_values().unwrap().is_empty());
}

/// Printed to four digits by `zero`, `dcgain` and `hsvd` (channels over their scales) of GNU Octave
/// 7.3 with its control package, from the script that `to_matlab` wrote.
#[test]
fn another_program_finds_the_same_zeros_gains_and_hankel_singular_values() {
    let model = plant();
    assert_zeros(
        &model.channel_zeros(0, 1).unwrap(),
        &[1.2890, 0.9279, 0.6021],
        6e-5,
    );
    let gain = mat![[2.0717, 0.1564, -0.9304], [-0.5751, -1.6893, -0.3888]];
    assert!(largest_difference(&model.steady_state_gain().unwrap(), &gain) < 6e-5);
    let found = model.hankel_singular_values().unwrap();
    for (found, expected) in found.iter().zip([2.2641, 1.7014, 0.3340, 0.1346]) {
        assert!((found - expected).abs() < 6e-5);
    }
}

/// Systems with two inputs and two outputs: generic ones have n − 2 zeros, with a rank deficient
/// first Markov parameter fewer. Units of states, inputs and outputs move none of them.
#[test]
fn zeros_of_random_systems_make_the_system_matrix_singular_in_any_units() {
    for seed in 0..40 {
        let mut noise = common::Noise::new(seed);
        let a = noise.matrix(6, 6) * 0.3;
        let mut b = noise.matrix(6, 2);
        let c = noise.matrix(2, 6);
        let mut expected = 4;
        if seed % 2 == 1 {
            // C B of rank one: another zero goes to infinity.
            let first = &c * b.col(0);
            let wanted = noise.matrix(6, 1);
            let reached = &c * wanted.col(0);
            let solve = |r: f64, s: f64| {
                // A vector of the plane of two rows of C with C v = (r, s).
                let gram = &c * c.transpose();
                let determinant = gram[(0, 0)] * gram[(1, 1)] - gram[(0, 1)] * gram[(1, 0)];
                let x = (gram[(1, 1)] * r - gram[(0, 1)] * s) / determinant;
                let y = (gram[(0, 0)] * s - gram[(1, 0)] * r) / determinant;
                Mat::from_fn(6, 1, |i, _| c[(0, i)] * x + c[(1, i)] * y)
            };
            let correction = solve(2.0 * first[0] - reached[0], 2.0 * first[1] - reached[1]);
            for i in 0..6 {
                b[(i, 1)] = wanted[(i, 0)] + correction[(i, 0)];
            }
            expected = 3;
        }
        let plain = model(a.clone(), b.clone(), c.clone(), Mat::zeros(2, 2));
        let zeros = plain.zeros().unwrap();
        assert_eq!(zeros.len(), expected, "seed {seed}: {zeros:?}");
        for z in &zeros {
            let size = 1.0 + z.norm();
            assert!(
                smallest_singular_value(&plain, *z) < 1e-10 * size,
                "seed {seed}: {z}"
            );
        }
        let (state, units) = (1e7, [1e8, 1e-6]);
        let b = Mat::from_fn(6, 2, |i, j| b[(i, j)] * state * units[j]);
        let c = Mat::from_fn(2, 6, |i, j| c[(i, j)] / state * units[1 - i]);
        let scaled = model(a, b, c, Mat::zeros(2, 2)).zeros().unwrap();
        assert_eq!(scaled.len(), expected, "seed {seed}");
        for z in zeros {
            let nearest = scaled.iter().map(|other| (other - z).norm());
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(
                nearest < 1e-7 * (1.0 + z.norm()),
                "seed {seed}: {z} {nearest:e}"
            );
        }
    }
}
