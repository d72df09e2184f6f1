use deepc_core::faer::linalg::solvers::SolveLstsq;

use super::*;
use crate::prediction_error::tests::{plant, records, structure};
use crate::prediction_error::{Focus, RefineSettings, refine};
use crate::uncertainty::Uncertainty;

#[test]
fn exact_data_give_b_d_and_every_initial_state() {
    let mut truth = plant();
    truth.k.fill(0.0);
    let data = records(&truth, &[300, 40, 200], 0.0, 1);
    let free = structure(&[true, false]);
    let fit = fit_inputs(&data, truth.a.as_ref(), truth.c.as_ref(), &free).unwrap();
    assert!((&fit.b - &truth.b).norm_max() < 1e-12);
    assert!((&fit.d - &truth.d).norm_max() < 1e-12);
    assert!(fit.loss < 1e-26, "{}", fit.loss);
    let initial = fit_initial_states(&data, &truth).unwrap();
    for ((record, fitted), initial) in data.records.iter().zip(&fit.initial_states).zip(&initial) {
        for states in [fitted, initial] {
            let simulated = truth.simulate(states, record.inputs.as_ref());
            assert!((simulated - &record.outputs).norm_max() < 1e-12);
        }
    }
}

#[test]
fn noisy_data_give_the_dense_least_squares_solution() {
    let truth = plant();
    let data = records(&truth, &[60, 50], 0.4, 2);
    let free = structure(&[true, false]);
    let fit = fit_inputs(&data, truth.a.as_ref(), truth.c.as_ref(), &free).unwrap();
    // The simulation is linear in B, D and the initial states: one column for each.
    let none = SystemMatrices {
        b: Mat::zeros(3, 2),
        d: Mat::zeros(2, 2),
        k: Mat::zeros(3, 2),
        ..truth.clone()
    };
    let unknowns = 6 + 2 + 3 + 3;
    let mut m = Mat::zeros(220, unknowns);
    let mut y = Mat::zeros(220, 1);
    for column in 0..unknowns {
        let (mut model, mut initial) = (none.clone(), [[0.0; 3]; 2]);
        match column {
            0..6 => model.b[(column / 2, column % 2)] = 1.0,
            6..8 => model.d[(column - 6, 0)] = 1.0,
            _ => initial[(column - 8) / 3][(column - 8) % 3] = 1.0,
        }
        let mut row = 0;
        for (record, initial) in data.records.iter().zip(&initial) {
            let simulated = model.simulate(initial, record.inputs.as_ref());
            for k in 0..record.samples() {
                for l in 0..2 {
                    m[(row, column)] = simulated[(k, l)];
                    y[(row, 0)] = record.outputs[(k, l)];
                    row += 1;
                }
            }
        }
    }
    let x = m.qr().solve_lstsq(&y);
    let residual = &m * &x - y;
    for column in 0..6 {
        let error = fit.b[(column / 2, column % 2)] - x[(column, 0)];
        assert!(error.abs() < 1e-11, "{column}: {error:e}");
    }
    for l in 0..2 {
        assert!((fit.d[(l, 0)] - x[(6 + l, 0)]).abs() < 1e-11);
        assert!(fit.d[(l, 1)] == 0.0);
    }
    for (index, initial) in fit.initial_states.iter().enumerate() {
        for (i, value) in initial.iter().enumerate() {
            assert!((value - x[(8 + 3 * index + i, 0)]).abs() < 1e-11);
        }
    }
    let loss = residual.squared_norm_l2() / 220.0;
    assert!((fit.loss - loss).abs() < 1e-12 * loss);
}

#[test]
fn inactive_inputs_stay_at_zero_and_the_basis_of_a_does_not_matter() {
    let mut truth = plant();
    truth.k.fill(0.0);
    truth.b.col_mut(1).fill(0.0);
    let data = records(&truth, &[500], 0.0, 3);
    let scale = [1e6, 1e-3, 1.0];
    let a = Mat::from_fn(3, 3, |i, j| truth.a[(i, j)] * scale[i] / scale[j]);
    let c = Mat::from_fn(2, 3, |i, j| truth.c[(i, j)] / scale[j]);
    let inactive = InputStructure {
        dynamics: vec![true, false],
        feedthrough: vec![true, false],
    };
    let fit = fit_inputs(&data, a.as_ref(), c.as_ref(), &inactive).unwrap();
    for (i, scale) in scale.iter().enumerate() {
        let error = fit.b[(i, 0)] / scale - truth.b[(i, 0)];
        assert!(error.abs() < 1e-11, "{i}: {error:e}");
        assert!(fit.b[(i, 1)] == 0.0);
    }
    assert!(fit.d.col(1).norm_max() == 0.0);
}

#[test]
fn equal_inputs_share_the_effect_and_unseen_states_get_none() {
    let mut truth = plant();
    truth.k.fill(0.0);
    let mut data = records(&truth, &[200], 0.0, 4);
    // A fourth state that no output sees, and two inputs that are one.
    let a = Mat::from_fn(4, 4, |i, j| match (i, j) {
        (3, 3) => 0.9,
        (3, _) | (_, 3) => 0.0,
        _ => truth.a[(i, j)],
    });
    let c = Mat::from_fn(2, 4, |i, j| if j < 3 { truth.c[(i, j)] } else { 0.0 });
    let first = data.records[0].inputs.col(0).to_owned();
    data.records[0].inputs.col_mut(1).copy_from(&first);
    let mut initial = vec![1.0, -2.0, 0.5];
    data.records[0].outputs = truth.simulate(&initial, data.records[0].inputs.as_ref());
    let free = structure(&[true, true]);
    let fit = fit_inputs(&data, a.as_ref(), c.as_ref(), &free).unwrap();
    assert!(fit.loss < 1e-24, "{}", fit.loss);
    assert!((fit.b.col(0) - fit.b.col(1)).norm_max() < 1e-10);
    assert!(fit.b.row(3).norm_max() < 1e-10);
    initial.push(0.0);
    for (found, expected) in fit.initial_states[0].iter().zip(&initial) {
        assert!((found - expected).abs() < 1e-10);
    }
}

#[test]
fn a_slightly_unstable_model_is_fitted_and_a_wild_one_refused() {
    let mut truth = plant();
    truth.k.fill(0.0);
    truth.a[(2, 2)] = 1.001;
    let data = records(&truth, &[2000], 0.0, 5);
    let free = structure(&[true, false]);
    let fit = fit_inputs(&data, truth.a.as_ref(), truth.c.as_ref(), &free).unwrap();
    assert!((&fit.b - &truth.b).norm_max() < 1e-10);
    truth.a[(2, 2)] = 2.0;
    let error = fit_inputs(&data, truth.a.as_ref(), truth.c.as_ref(), &free);
    assert!(matches!(error, Err(SysidError::Unstable { .. })));
}

#[test]
fn no_state_no_input_and_a_single_sample_are_no_trouble() {
    let mut truth = plant();
    truth.k.fill(0.0);
    let data = records(&truth, &[100, 1], 0.1, 6);
    let both = structure(&[true, true]);
    let none = InputStructure {
        dynamics: vec![false, false],
        feedthrough: vec![false, false],
    };
    let fit = fit_inputs(&data, truth.a.as_ref(), truth.c.as_ref(), &none).unwrap();
    assert!(fit.b.norm_max() == 0.0 && fit.loss > 0.1);
    let (a, c) = (Mat::<f64>::zeros(0, 0), Mat::<f64>::zeros(2, 0));
    let fit = fit_inputs(&data, a.as_ref(), c.as_ref(), &both).unwrap();
    assert!(fit.initial_states == [Vec::<f64>::new(), Vec::new()] && fit.loss > 0.1);
    let fixed = SystemMatrices {
        a,
        b: fit.b,
        c,
        d: fit.d,
        k: Mat::zeros(0, 2),
    };
    assert!(fit_initial_states(&data, &fixed).unwrap()[0].is_empty());
    for (model, structure) in [(&fixed, &both), (&truth, &none)] {
        for focus in [Focus::Simulation, Focus::Prediction, Focus::Gain] {
            let settings = RefineSettings::default();
            let refined = refine(&data, model, structure, focus, &settings).unwrap();
            assert!(refined.loss.is_finite() && refined.loss <= refined.loss_before);
            let uncertainty = Uncertainty::of(&data, &refined.matrices, structure).unwrap();
            assert!(
                uncertainty
                    .steady_state_gain()
                    .value
                    .as_ref()
                    .is_all_finite()
            );
        }
    }
}
