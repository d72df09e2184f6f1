//! Validation: fits against a second implementation, tests that keep their size and see what is
//! missing, and inputs that are refused.

use crate::common;
use common::{Noise, channel, dataset, inputs, plant, plant_with, push, run};
use deepc_core::data::Dataset;
use deepc_core::faer::{Mat, mat};
use sysid::{
    InitialStateFor, StateSpace, SysidError, SystemMatrices, Validation, ValidationSettings,
};

/// Innovations with the covariance of the model, T×p.
fn innovations(model: &StateSpace, samples: usize, noise: &mut Noise) -> Mat<f64> {
    let r = model.innovation_covariance();
    let l11 = r[(0, 0)].sqrt();
    let l21 = r[(1, 0)] / l11;
    let l22 = (r[(1, 1)] - l21 * l21).sqrt();
    let white = noise.matrix(samples, 2);
    Mat::from_fn(samples, 2, |k, i| match i {
        0 => l11 * white[(k, 0)],
        _ => l21 * white[(k, 0)] + l22 * white[(k, 1)],
    })
}

fn recorded(model: &StateSpace, lengths: &[usize], colour: f64, noise: &mut Noise) -> Dataset {
    let mut data = dataset(model);
    for &samples in lengths {
        let u = inputs(model, samples, colour, noise);
        let e = innovations(model, samples, noise);
        let x0: Vec<f64> = (0..model.order()).map(|_| noise.normal()).collect();
        let y = run(model, &x0, &u, &e);
        push(&mut data, &u, y);
    }
    data
}

fn settings(steps: usize, lags: usize) -> ValidationSettings {
    ValidationSettings {
        steps,
        lags,
        confidence: 0.99,
    }
}

#[test]
fn a_noise_free_record_is_explained_to_rounding() {
    let (model, mut noise) = (plant(), Noise::new(1));
    let mut data = dataset(&model);
    for samples in [120, 300] {
        let u = inputs(&model, samples, 0.5, &mut noise);
        push(
            &mut data,
            &u,
            run(&model, &[3.0, -1.0, 2.0, 0.5], &u, &Mat::zeros(samples, 2)),
        );
    }
    let validation = Validation::of(&model, &data, &settings(12, 20)).unwrap();
    for output in &validation.outputs {
        let simulation = output.simulation.unwrap();
        assert!(100.0 - simulation.fit_percent.unwrap() < 1e-9);
        assert!(100.0 - simulation.vaf_percent.unwrap() < 1e-9);
        assert_eq!((simulation.samples, output.prediction.len()), (420, 12));
        assert!(
            output
                .prediction
                .iter()
                .all(|s| 100.0 - s.fit_percent.unwrap() < 1e-9)
        );
        assert!(output.residual.whiteness.is_none());
        assert!(
            output.verdict[0].contains("rounding"),
            "{:?}",
            output.verdict
        );
    }
}

/// Fit and VAF from their definitions, with the predictions of the model over each record.
#[test]
fn scores_are_those_of_their_definitions() {
    let (model, mut noise) = (plant(), Noise::new(2));
    let data = recorded(&model, &[200, 90], 0.6, &mut noise);
    let validation = Validation::of(&model, &data, &settings(8, 20)).unwrap();
    for step in [1, 3, 8] {
        for i in 0..2 {
            let (mut measured, mut computed) = (Vec::new(), Vec::new());
            for record in data.records() {
                let (u, d, y) = (record.inputs(), record.disturbances(), record.outputs());
                let all = Mat::from_fn(record.samples(), 3, |k, j| {
                    if j < 2 { u[(k, j)] } else { d[(k, 0)] }
                });
                let x0 = model
                    .initial_state(all.as_ref(), y, InitialStateFor::Prediction)
                    .unwrap();
                let ahead = model.predict(step, &x0, all.as_ref(), y).unwrap();
                for k in step - 1..record.samples() {
                    measured.push(y[(k, i)]);
                    computed.push(ahead[(k, i)]);
                }
            }
            let n = measured.len() as f64;
            let mean = measured.iter().sum::<f64>() / n;
            let error: Vec<f64> = measured.iter().zip(&computed).map(|(y, c)| y - c).collect();
            let bias = error.iter().sum::<f64>() / n;
            let norm =
                |v: &[f64], about: f64| v.iter().map(|x| (x - about).powi(2)).sum::<f64>().sqrt();
            let fit = 100.0 * (1.0 - norm(&error, 0.0) / norm(&measured, mean));
            let vaf = 100.0 * (1.0 - (norm(&error, bias) / norm(&measured, mean)).powi(2));
            let found = validation.outputs[i].prediction[step - 1];
            assert_eq!(found.samples, measured.len());
            assert!((found.fit_percent.unwrap() - fit).abs() < 1e-9);
            assert!((found.vaf_percent.unwrap() - vaf).abs() < 1e-9);
        }
    }
}

/// White residuals, slow inputs: 1 % of all lags are outside, and p-values are uniform.
#[test]
fn tests_of_the_true_model_keep_their_size() {
    let model = plant();
    let runs = 150;
    let (mut auto, mut cross, mut lags_auto, mut lags_cross) = (0, 0, 0, 0);
    let (mut white, mut effect, mut feedback) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..runs {
        let mut noise = Noise::new(1000 + seed);
        let data = recorded(&model, &[500, 300], 0.9, &mut noise);
        let validation = Validation::of(&model, &data, &settings(3, 25)).unwrap();
        for output in &validation.outputs {
            let whiteness = output.residual.whiteness.as_ref().unwrap();
            auto += whiteness.outside;
            lags_auto += 25;
            white.push(whiteness.portmanteau.p_value);
            for test in &output.residual.inputs {
                cross += test.outside;
                lags_cross += 51;
                effect.push(test.effect.p_value);
                feedback.push(test.feedback.p_value);
            }
        }
    }
    let share = |count: usize, of: usize| count as f64 / f64::from(u32::try_from(of).unwrap());
    let (auto, cross) = (share(auto, lags_auto), share(cross, lags_cross));
    println!("outside: {auto} {cross}");
    assert!((0.006..0.014).contains(&auto), "{auto}");
    assert!((0.006..0.014).contains(&cross), "{cross}");
    for (name, values) in [("white", white), ("effect", effect), ("feedback", feedback)] {
        let below = |limit: f64| share(values.iter().filter(|p| **p < limit).count(), values.len());
        let shares = [0.01, 0.1, 0.25, 0.5, 0.75, 0.9].map(below);
        println!("{name}: {} {shares:?}", values.len());
        assert!(shares[0] < 0.035, "{name} {shares:?}");
        assert!((0.05..0.17).contains(&shares[1]), "{name} {shares:?}");
        assert!((0.4..0.6).contains(&shares[3]), "{name} {shares:?}");
        assert!((0.82..0.96).contains(&shares[5]), "{name} {shares:?}");
    }
}

/// An output-error model leaves coloured residuals; slow inputs must not look like their cause.
#[test]
fn coloured_residuals_do_not_accuse_a_slow_input() {
    let strong = mat![[0.8, 0.1], [-0.3, 0.4], [0.5, 0.3], [0.1, 0.5]];
    let (truth, model) = (plant_with(strong), plant_with(Mat::zeros(4, 2)));
    let (mut rejected, mut tests, mut outside, mut lags) = (0, 0, 0, 0_usize);
    for seed in 0..100 {
        let mut noise = Noise::new(5000 + seed);
        let data = recorded(&truth, &[1500], 0.9, &mut noise);
        let validation = Validation::of(&model, &data, &settings(3, 25)).unwrap();
        for output in &validation.outputs {
            let whiteness = output.residual.whiteness.as_ref().unwrap();
            assert!(whiteness.portmanteau.p_value < 1e-6);
            assert!(output.verdict[0].contains("K = 0"), "{:?}", output.verdict);
            for test in &output.residual.inputs {
                tests += 1_usize;
                rejected += usize::from(!test.effect.passes(0.99));
                outside += test.outside;
                lags += 51;
            }
        }
    }
    let (rejected, outside) = (rejected as f64 / tests as f64, outside as f64 / lags as f64);
    println!("rejected {rejected}, outside {outside}");
    assert!((0.003..0.02).contains(&outside), "{outside}");
    assert!(rejected < 0.04, "{rejected}");
}

/// The model without the slow pair of poles of the plant.
#[test]
fn a_missing_mode_is_seen_and_its_input_named() {
    let truth = StateSpace::new(
        0.1,
        vec![channel("u1", 0.0, 1.0), channel("u2", 5.0, 1.0)],
        vec![],
        vec![channel("y1", 0.0, 1.0), channel("y2", 1.0, 1.0)],
        SystemMatrices {
            a: mat![[0.8, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.7]],
            b: mat![[1.0, 0.0], [0.0, 1.0], [0.0, 0.4]],
            c: mat![[1.0, 0.0, 1.0], [0.3, 1.0, 0.0]],
            d: Mat::zeros(2, 2),
            k: Mat::zeros(3, 2),
        },
    )
    .unwrap()
    .with_innovation_covariance(mat![[0.09, 0.0], [0.0, 0.09]])
    .unwrap();
    let m = truth.matrices();
    let poorer = SystemMatrices {
        a: m.a.get(..2, ..2).to_owned(),
        b: m.b.get(..2, ..).to_owned(),
        c: m.c.get(.., ..2).to_owned(),
        d: m.d.clone(),
        k: Mat::zeros(2, 2),
    };
    let (u, y) = (truth.inputs().to_vec(), truth.outputs().to_vec());
    let model = StateSpace::new(0.1, u, vec![], y, poorer).unwrap();
    let data = recorded(&truth, &[400, 400], 0.0, &mut Noise::new(3));
    let validation = Validation::of(&model, &data, &ValidationSettings::default()).unwrap();
    let text = validation.to_string();
    let [first, second] = &validation.outputs[..] else {
        panic!()
    };
    assert!(first.residual.inputs[0].effect.p_value > 0.001, "{text}");
    assert!(first.residual.inputs[1].effect.p_value < 1e-20, "{text}");
    assert!(
        second
            .residual
            .inputs
            .iter()
            .all(|t| t.effect.p_value > 0.001),
        "{text}"
    );
    let missing = "input `u2` still explains the residuals at lags 1 to ";
    assert!(
        first.verdict.iter().any(|s| s.starts_with(missing)),
        "{text}"
    );
    assert!(
        !second.verdict.iter().any(|s| s.contains("missing")),
        "{text}"
    );
    assert!(second.verdict[0].contains("are white"), "{text}");
    let truth = Validation::of(&truth, &data, &ValidationSettings::default()).unwrap();
    let fit = |v: &Validation| v.outputs[0].simulation.unwrap().fit_percent.unwrap();
    assert!(fit(&truth) > fit(&validation) + 3.0);
}

#[test]
fn a_missing_feedthrough_a_wrong_offset_and_feedback_are_told_apart() {
    let truth = plant();
    let mut noise = Noise::new(4);
    let data = recorded(&truth, &[2000], 0.0, &mut noise);
    let mut system = truth.matrices().clone();
    system.d[(1, 2)] = 0.0;
    let rebuilt = |system: SystemMatrices, shift: f64| {
        let mut outputs = truth.outputs().to_vec();
        outputs[0].offset += shift;
        let (u, d) = (truth.inputs().to_vec(), truth.disturbances().to_vec());
        StateSpace::new(0.1, u, d, outputs, system).unwrap()
    };
    let no_direct = rebuilt(system, 0.0);
    let validation = Validation::of(&no_direct, &data, &settings(5, 15)).unwrap();
    let test = &validation.outputs[1].residual.inputs[2];
    let largest = test
        .correlation
        .values
        .iter()
        .map(|v| v.abs())
        .fold(0.0, f64::max);
    assert!(
        test.effect.p_value < 1e-20 && (test.correlation.values[15].abs() - largest).abs() < 1e-15
    );
    let shifted = rebuilt(truth.matrices().clone(), 0.2);
    let validation = Validation::of(&shifted, &data, &settings(5, 15)).unwrap();
    let text = validation.to_string();
    assert!(
        validation.outputs[0]
            .verdict
            .iter()
            .any(|s| s.contains("offsets")),
        "{text}"
    );

    // u(k+1) answers e(k).
    let mut u = inputs(&truth, 2000, 0.0, &mut noise);
    let e = innovations(&truth, 2000, &mut noise);
    for k in 1..2000 {
        u[(k, 1)] += e[(k - 1, 0)];
    }
    let mut data = dataset(&truth);
    push(&mut data, &u, run(&truth, &[0.0; 4], &u, &e));
    let validation = Validation::of(&truth, &data, &settings(5, 15)).unwrap();
    let text = validation.to_string();
    let later = "the residuals move with later values of input `pump` at lag -1 ";
    assert!(
        validation.outputs[0]
            .verdict
            .iter()
            .any(|s| s.starts_with(later)),
        "{text}"
    );
    assert!(
        validation.outputs[0].residual.inputs[1].effect.passes(0.99),
        "{text}"
    );
}

/// Two records that end and begin far apart: pairs and predictions across the boundary would show.
#[test]
fn records_are_independent_of_their_order() {
    let (model, mut noise) = (plant(), Noise::new(5));
    let lengths = [150, 80, 220];
    let one = recorded(&model, &lengths, 0.7, &mut noise);
    let mut other = dataset(&model);
    for record in one.records().iter().rev() {
        other
            .push_record_with_disturbances(
                record.inputs().to_owned(),
                record.disturbances().to_owned(),
                record.outputs().to_owned(),
            )
            .unwrap();
    }
    let a = Validation::of(&model, &one, &settings(10, 20)).unwrap();
    let b = Validation::of(&model, &other, &settings(10, 20)).unwrap();
    for (a, b) in a.outputs.iter().zip(&b.outputs) {
        for (a, b) in a.prediction.iter().zip(&b.prediction) {
            assert!((a.fit_percent.unwrap() - b.fit_percent.unwrap()).abs() < 1e-9);
        }
        let values = |v: &sysid::OutputValidation| v.residual.inputs[0].correlation.values.clone();
        for (a, b) in values(a).iter().zip(values(b)) {
            assert!((a - b).abs() < 1e-9);
        }
    }
}

#[test]
fn plain_data_survive_serialisation() {
    let (model, mut noise) = (plant(), Noise::new(6));
    let data = recorded(&model, &[200], 0.5, &mut noise);
    let validation = Validation::of(&model, &data, &settings(5, 10)).unwrap();
    let json = serde_json::to_string(&validation).unwrap();
    assert_eq!(
        serde_json::from_str::<Validation>(&json).unwrap(),
        validation
    );
}

#[test]
fn an_unstable_model_says_so() {
    let model = StateSpace::new(
        1.0,
        vec![channel("u", 0.0, 1.0)],
        vec![],
        vec![channel("y", 0.0, 1.0)],
        SystemMatrices {
            a: mat![[1.5]],
            b: mat![[1.0]],
            c: mat![[1.0]],
            d: mat![[0.0]],
            k: mat![[1.2]],
        },
    )
    .unwrap();
    let mut noise = Noise::new(7);
    let mut data = dataset(&model);
    push(&mut data, &noise.matrix(3000, 1), noise.matrix(3000, 1));
    let validation = Validation::of(&model, &data, &settings(5, 10)).unwrap();
    assert!(validation.outputs[0].simulation.is_none());
    let text = validation.to_string();
    assert!(
        text.contains("UNSTABLE") && text.contains("left the range"),
        "{text}"
    );
    let (u, y) = (model.inputs().to_vec(), model.outputs().to_vec());
    let mut system = model.into_matrices();
    system.k = mat![[0.0]];
    let open = StateSpace::new(1.0, u, vec![], y, system).unwrap();
    let error = Validation::of(&open, &data, &settings(5, 10)).unwrap_err();
    assert!(error.to_string().contains("1.500000"), "{error}");
}

#[test]
fn constant_channels_are_no_failure() {
    let model = plant();
    let mut data = dataset(&model);
    let u = Mat::from_fn(100, 3, |_, j| [80.0, -3.0, 1.0][j]);
    let y = Mat::from_fn(100, 2, |k, i| if i == 0 { 12.0 } else { (k as f64).sin() });
    push(&mut data, &u, y);
    let validation = Validation::of(&model, &data, &settings(5, 10)).unwrap();
    let first = &validation.outputs[0];
    assert!(first.simulation.unwrap().fit_percent.is_none());
    assert!(first.residual.inputs.is_empty());
    assert!(
        validation
            .to_string()
            .contains("undefined (constant output)")
    );
}

#[test]
fn data_that_do_not_fit_the_model_are_refused() {
    let (model, mut noise) = (plant(), Noise::new(8));
    let data = recorded(&model, &[40], 0.5, &mut noise);
    let error = |data: &Dataset, settings: &ValidationSettings| {
        Validation::of(&model, data, settings).unwrap_err()
    };
    let short = error(&data, &settings(20, 25));
    assert!(
        matches!(
            short,
            SysidError::TooShortToValidate {
                longest: 40,
                needed: 56,
                ..
            }
        ),
        "{short}"
    );
    let short = error(&data, &settings(60, 5));
    assert!(
        matches!(short, SysidError::TooShortToValidate { needed: 66, .. }),
        "{short}"
    );
    assert!(Validation::of(&model, &data, &settings(5, 10)).is_ok());
    assert!(
        error(&dataset(&model), &settings(5, 10))
            .to_string()
            .contains("0 samples")
    );
    for (wrong, name) in [
        (settings(0, 10), "steps"),
        (settings(5, 0), "lags"),
        (
            ValidationSettings {
                confidence: 99.0,
                ..settings(5, 10)
            },
            "confidence",
        ),
        (
            ValidationSettings {
                confidence: f64::NAN,
                ..settings(5, 10)
            },
            "confidence",
        ),
    ] {
        let found = error(&data, &wrong).to_string();
        assert!(found.contains(name), "{found}");
    }
    let other =
        Dataset::with_disturbances(0.1, ["pump", "valve"], ["load"], ["level", "flow"]).unwrap();
    let found = error(&other, &settings(5, 10)).to_string();
    assert!(
        found.contains(r#"["valve", "pump"]"#) && found.contains(r#"["pump", "valve"]"#),
        "{found}"
    );
    let other =
        Dataset::with_disturbances(0.2, ["valve", "pump"], ["load"], ["level", "flow"]).unwrap();
    let found = error(&other, &settings(5, 10)).to_string();
    assert!(
        found.contains("0.1 s") && found.contains("0.2 s"),
        "{found}"
    );
}
