//! The model as users see it: simulation, prediction, initial states and coordinates.

use crate::common;
use common::{Noise, channel, inputs, largest_difference, plant, plant_with, run};
use deepc_core::faer::{Mat, mat};
use sysid::{InitialStateFor, StateSpace, SysidError, SystemMatrices};

const X0: [f64; 4] = [1.0, -2.0, 0.5, 3.0];

#[test]
fn simulation_is_the_documented_equations() {
    let (model, mut noise) = (plant(), Noise::new(1));
    let u = inputs(&model, 200, 0.5, &mut noise);
    let found = model.simulate(&X0, u.as_ref()).unwrap();
    let expected = run(&model, &X0, &u, &Mat::zeros(200, 2));
    assert!(largest_difference(&found, &expected) < 1e-11);
}

/// Second implementation: from every origin the filter's state is run ahead without outputs.
#[test]
fn predictions_are_those_of_a_restart_at_every_sample() {
    let (model, mut noise) = (plant(), Noise::new(2));
    let u = inputs(&model, 60, 0.3, &mut noise);
    let y = run(&model, &X0, &u, &noise.matrix(60, 2));
    let (steps, m) = (7, model.matrices());
    let all = model
        .predictions(steps, &X0, u.as_ref(), y.as_ref())
        .unwrap();
    assert_eq!(all.len(), steps);
    let channels: Vec<_> = model.inputs().iter().chain(model.disturbances()).collect();
    let du = |t: usize| Mat::from_fn(3, 1, |j, _| u[(t, j)] - channels[j].offset);
    let dy = |t: usize| Mat::from_fn(2, 1, |i, _| y[(t, i)] - model.outputs()[i].offset);
    let mut state = Mat::from_fn(4, 1, |i, _| X0[i]);
    for origin in 0..60 {
        // `state` has seen the outputs before `origin`.
        let mut x = state.clone();
        for ahead in 1..=steps.min(60 - origin) {
            let t = origin + ahead - 1;
            let expected = &m.c * &x + &m.d * du(t);
            for i in 0..2 {
                let found = all[ahead - 1][(t, i)] - model.outputs()[i].offset;
                let wrong = (found - expected[(i, 0)]).abs();
                assert!(wrong < 1e-11, "{ahead} ahead at {t}: {wrong:e}");
            }
            x = &m.a * &x + &m.b * du(t);
        }
        let e = dy(origin) - &m.c * &state - &m.d * du(origin);
        state = &m.a * &state + &m.b * du(origin) + &m.k * e;
    }
    let single = model.predict(5, &X0, u.as_ref(), y.as_ref()).unwrap();
    assert_eq!(single, all[4]);
}

#[test]
fn before_an_output_counts_predictions_are_the_simulation() {
    let (model, mut noise) = (plant(), Noise::new(3));
    let u = inputs(&model, 40, 0.3, &mut noise);
    let y = run(&model, &X0, &u, &noise.matrix(40, 2));
    let simulated = model.simulate(&X0, u.as_ref()).unwrap();
    let ahead = model.predict(9, &X0, u.as_ref(), y.as_ref()).unwrap();
    for t in 0..9 {
        assert!((ahead[(t, 0)] - simulated[(t, 0)]).abs() < 1e-11);
    }
    let output_error = plant_with(Mat::zeros(4, 2));
    let ahead = output_error
        .predict(3, &X0, u.as_ref(), y.as_ref())
        .unwrap();
    assert!(largest_difference(&ahead, &simulated) < 1e-11);
}

#[test]
fn noise_free_records_give_their_initial_state_back() {
    let (model, mut noise) = (plant(), Noise::new(4));
    for samples in [3, 20, 1000] {
        let u = inputs(&model, samples, 0.5, &mut noise);
        let y = run(&model, &X0, &u, &Mat::zeros(samples, 2));
        for purpose in [InitialStateFor::Simulation, InitialStateFor::Prediction] {
            let x0 = model
                .initial_state(u.as_ref(), y.as_ref(), purpose)
                .unwrap();
            for (found, expected) in x0.iter().zip(X0) {
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{samples} {purpose:?} {x0:?}"
                );
            }
        }
    }
}

/// The least-squares solution leaves a residual that no initial state explains.
#[test]
fn the_residual_is_orthogonal_to_every_initial_state() {
    let (model, mut noise) = (plant(), Noise::new(5));
    let u = inputs(&model, 700, 0.5, &mut noise);
    let y = run(&model, &X0, &u, &noise.matrix(700, 2));
    let x0 = model
        .initial_state(u.as_ref(), y.as_ref(), InitialStateFor::Prediction)
        .unwrap();
    let sum_of_squares = |x0: &[f64]| {
        let ahead = model.predict(1, x0, u.as_ref(), y.as_ref()).unwrap();
        let residual = &y - &ahead;
        (0..2)
            .map(|i| residual.col(i).squared_norm_l2() / model.outputs()[i].scale.powi(2))
            .sum::<f64>()
    };
    let best = sum_of_squares(&x0);
    for i in 0..4 {
        let mut moved = x0.clone();
        moved[i] += 1e-3;
        let above = sum_of_squares(&moved) - best;
        moved[i] -= 2e-3;
        let below = sum_of_squares(&moved) - best;
        assert!(above > 0.0 && below > 0.0);
        // A parabola's two sides are equal at its bottom.
        assert!((above - below).abs() < 1e-3 * above, "{above:e} {below:e}");
    }
}

/// A double integrator beside a pole at 1 − 1e-9 over 20 000 samples.
#[test]
fn poles_on_the_circle_do_not_spoil_the_initial_state() {
    let model = StateSpace::new(
        0.01,
        vec![channel("u", 0.0, 1.0)],
        vec![],
        vec![channel("y", 0.0, 1.0), channel("z", 0.0, 1.0)],
        SystemMatrices {
            a: mat![[1.0, 0.01, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0 - 1e-9]],
            b: mat![[0.0], [0.01], [0.02]],
            c: mat![[1.0, 0.0, 0.3], [0.0, 0.0, 1.0]],
            d: Mat::zeros(2, 1),
            k: Mat::zeros(3, 2),
        },
    )
    .unwrap();
    let mut noise = Noise::new(6);
    let u = noise.matrix(20_000, 1);
    let y = run(&model, &X0[..3], &u, &Mat::zeros(20_000, 2));
    let purpose = InitialStateFor::Simulation;
    let x0 = model
        .initial_state(u.as_ref(), y.as_ref(), purpose)
        .unwrap();
    for (found, expected) in x0.iter().zip(X0) {
        assert!((found - expected).abs() < 1e-7, "{x0:?}");
    }
}

#[test]
fn a_record_beyond_the_range_of_numbers_is_an_error() {
    let mut system = plant().into_matrices();
    system.a *= deepc_core::faer::Scale(3.0);
    let base = plant();
    let (inputs_of, disturbances) = (base.inputs().to_vec(), base.disturbances().to_vec());
    let outputs = base.outputs().to_vec();
    let model = StateSpace::new(0.1, inputs_of, disturbances, outputs, system).unwrap();
    assert!(!model.is_stable().unwrap());
    let mut noise = Noise::new(7);
    let (u, y) = (noise.matrix(5000, 3), noise.matrix(5000, 2));
    let error = model.initial_state(u.as_ref(), y.as_ref(), InitialStateFor::Simulation);
    let Err(SysidError::Unstable { radius, .. }) = error else {
        panic!("{error:?}")
    };
    assert!((radius - model.spectral_radius().unwrap()).abs() < 1e-12 && radius > 2.0);
}

#[test]
fn an_unseen_state_stays_at_zero() {
    let mut system = plant().into_matrices();
    for i in 0..3 {
        system.a[(i, 3)] = 0.0;
    }
    system.c.col_mut(3).fill(0.0);
    let base = plant();
    let (inputs_of, disturbances) = (base.inputs().to_vec(), base.disturbances().to_vec());
    let outputs = base.outputs().to_vec();
    let model = StateSpace::new(0.1, inputs_of, disturbances, outputs, system).unwrap();
    let mut noise = Noise::new(8);
    let u = inputs(&model, 100, 0.0, &mut noise);
    let y = run(&model, &X0, &u, &Mat::zeros(100, 2));
    let purpose = InitialStateFor::Simulation;
    let x0 = model
        .initial_state(u.as_ref(), y.as_ref(), purpose)
        .unwrap();
    assert!((x0[0] - X0[0]).abs() < 1e-9 && x0[3] == 0.0, "{x0:?}");
}

#[test]
fn other_coordinates_are_the_same_model() {
    let (model, mut noise) = (plant(), Noise::new(9));
    let t = noise.matrix(4, 4);
    let u = inputs(&model, 80, 0.3, &mut noise);
    let y = run(&model, &[0.0; 4], &u, &noise.matrix(80, 2));
    let expected = model.predict(4, &[0.0; 4], u.as_ref(), y.as_ref()).unwrap();
    for other in [
        model.transformed(t.as_ref()).unwrap(),
        model.balanced().unwrap(),
    ] {
        let found = other.predict(4, &[0.0; 4], u.as_ref(), y.as_ref()).unwrap();
        assert!(largest_difference(&found, &expected) < 1e-10);
        for (a, b) in model.poles().unwrap().iter().zip(other.poles().unwrap()) {
            assert!((a - b).norm() < 1e-11);
        }
    }
    let singular = mat![
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [1.0, 1.0, 1.0, 0.0]
    ];
    assert!(matches!(
        model.transformed(singular.as_ref()),
        Err(SysidError::Numerical { .. })
    ));
    assert!(matches!(
        model.transformed(mat![[1.0]].as_ref()),
        Err(SysidError::MatrixShape { .. })
    ));
}

/// Both Gramians of the balanced form, summed term by term, are the Hankel singular values.
#[test]
fn the_balanced_form_has_equal_gramians() {
    let model = plant().balanced().unwrap();
    let values = plant().hankel_singular_values().unwrap();
    assert!(values.is_sorted_by(|a, b| a >= b));
    let system = model.matrices();
    let u: Vec<_> = model.inputs().iter().chain(model.disturbances()).collect();
    let y = model.outputs();
    let b = Mat::from_fn(4, 3, |i, j| system.b[(i, j)] * u[j].scale);
    let c = Mat::from_fn(2, 4, |i, j| system.c[(i, j)] / y[i].scale);
    let (mut p, mut q) = (&b * b.transpose(), c.transpose() * &c);
    let (mut reach, mut observe) = (b, c);
    for _ in 0..2000 {
        reach = &system.a * &reach;
        observe = &observe * &system.a;
        p += &reach * reach.transpose();
        q += observe.transpose() * &observe;
    }
    for i in 0..4 {
        for j in 0..4 {
            let expected = if i == j { values[i] } else { 0.0 };
            assert!((p[(i, j)] - expected).abs() < 1e-9 * values[0]);
            assert!((q[(i, j)] - expected).abs() < 1e-9 * values[0]);
        }
    }
}

#[test]
fn series_of_the_wrong_shape_are_named() {
    let model = plant();
    let text = |result: Result<Mat<f64>, SysidError>| result.unwrap_err().to_string();
    let two = Mat::<f64>::zeros(5, 2);
    let found = text(model.simulate(&X0, two.as_ref()));
    assert!(found.contains("5×2") && found.contains("T×3"), "{found}");
    let u = Mat::<f64>::zeros(5, 3);
    let found = text(model.simulate(&X0[..3], u.as_ref()));
    assert!(found.contains("3×1") && found.contains("4×1"), "{found}");
    let found = text(model.predict(0, &X0, u.as_ref(), two.as_ref()));
    assert!(found.contains("steps"), "{found}");
    let found = text(model.predict(2, &X0, u.as_ref(), u.as_ref()));
    assert!(found.contains("5×3") && found.contains("5×2"), "{found}");
    let mut bad = u.clone();
    bad[(3, 1)] = f64::NAN;
    let found = text(model.simulate(&X0, bad.as_ref()));
    assert!(found.contains("NaN in row 3, column 1"), "{found}");
}
