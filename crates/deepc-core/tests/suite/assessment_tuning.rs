//! Prediction of what was held out, and the weights chosen by it.

use crate::common;
use std::sync::atomic::{AtomicBool, Ordering};

use common::Lti;
use deepc_core::assessment::{
    AssessmentError, HoldOut, HoldOutErrors, PredictionSettings, TuningCurve, TuningSettings,
    hold_out_margin, logarithmic_grid, tune, tune_with,
};
use deepc_core::data::Dataset;
use deepc_core::hankel::Horizons;
use deepc_core::program::{Regularisation, Slack};

const HORIZONS: Horizons = Horizons { past: 5, future: 8 };

fn recording(samples: usize, noise: f64) -> Dataset {
    let system = Lti::random(4, 2, 3, 0.9, 42);
    common::dataset(vec![common::record(&system, samples, noise, 7)])
}

fn settings() -> TuningSettings {
    TuningSettings {
        lambda_g: logarithmic_grid(1e-8, 1e4, 13),
        lambda_y: vec![1.0],
        input_slack: Slack::Hard,
        hold_out: HoldOut::LastQuarter,
        windows: 100,
        seed: 3,
    }
}

#[test]
fn the_hold_out_of_a_linear_plant_is_predicted_exactly() {
    let system = Lti::random(4, 2, 3, 0.9, 42);
    let records: Vec<_> = (1..=3)
        .map(|i| common::record(&system, 150, 0.0, i))
        .collect();
    let data = common::dataset(records);
    for hold_out in [HoldOut::LastQuarter, HoldOut::Records(vec![2])] {
        let settings = PredictionSettings {
            hold_out: hold_out.clone(),
            ..PredictionSettings::least_squares()
        };
        let errors = HoldOutErrors::measure(&data, HORIZONS, &settings).unwrap();
        let summary = errors.summary();
        let (held, windows) = match hold_out {
            HoldOut::LastQuarter => (3 * 37, 3 * 25),
            HoldOut::Records(_) => (150, 138),
        };
        assert_eq!((summary.held_samples, summary.windows), (held, windows));
        assert_eq!(summary.training_samples, 450 - held);
        for output in &summary.outputs {
            assert!(output.largest < 1e-8 * output.deviation, "{output:?}");
        }
    }
}

/// A record that contradicts the others spoils the predictions only if it is learnt from.
#[test]
fn what_is_held_out_is_not_learnt_from() {
    let (one, other) = (Lti::random(3, 2, 2, 0.8, 1), Lti::random(3, 2, 2, 0.8, 2));
    let records = vec![
        common::record(&one, 300, 0.0, 1),
        common::record(&one, 300, 0.0, 2),
        common::record(&other, 300, 0.0, 3),
    ];
    let data = common::dataset(records);
    let error = |numbers: Vec<usize>| {
        let settings = PredictionSettings {
            hold_out: HoldOut::Records(numbers),
            ..PredictionSettings::least_squares()
        };
        let summary = HoldOutErrors::measure(&data, HORIZONS, &settings)
            .unwrap()
            .summary();
        summary.outputs[0].normalised_overall.unwrap()
    };
    assert!(error(vec![2]) > 1e-3);
    assert!(error(vec![3]) > 0.1);
    // Records 2 and 3 held out: 1 alone predicts 2 exactly, so the errors are those of 3.
    assert!(error(vec![2, 3]) > 0.1);
    let mut only_one = common::dataset(vec![common::record(&one, 300, 0.0, 1)]);
    only_one
        .append(common::dataset(vec![common::record(&one, 300, 0.0, 2)]))
        .unwrap();
    let settings = PredictionSettings {
        hold_out: HoldOut::Records(vec![2]),
        ..PredictionSettings::least_squares()
    };
    let exact = HoldOutErrors::measure(&only_one, HORIZONS, &settings)
        .unwrap()
        .summary();
    assert!(exact.outputs[0].normalised_overall.unwrap() < 1e-8);
}

#[test]
fn noisy_data_have_an_interior_optimum_and_a_finite_curve() {
    let curve = tune(&recording(240, 0.5), HORIZONS, &settings()).unwrap();
    println!("{curve}");
    assert_eq!(curve.points.len(), 13);
    assert!(curve.refused.is_empty());
    for point in &curve.points {
        let numbers = [point.error, point.mean_square, point.standard_error];
        assert!(
            numbers.iter().all(|v| v.is_finite() && *v > 0.0),
            "{point:?}"
        );
    }
    assert!(curve.best > 0 && curve.best < 12, "{}", curve.best);
    let (best, cautious) = (curve.best(), curve.cautious());
    assert!(best.error < 0.98 * curve.points[0].error);
    assert!(best.error < 0.9 * curve.points[12].error);
    assert!(cautious.lambda_g >= best.lambda_g);
    assert!(cautious.mean_square <= best.mean_square + best.standard_error);
}

#[test]
fn data_without_noise_want_little_regularisation() {
    let curve = tune(&recording(240, 0.0), HORIZONS, &settings()).unwrap();
    assert!(curve.points[0].error < 1e-6, "{curve}");
    assert!(curve.best <= 1, "{curve}");
}

#[test]
fn a_grid_point_is_judged_as_the_same_weights_alone() {
    let data = recording(240, 0.5);
    let two = TuningSettings {
        lambda_g: vec![1e-3, 0.1],
        lambda_y: vec![0.5, 10.0],
        input_slack: Slack::Penalty(100.0),
        ..settings()
    };
    let curve = tune(&data, HORIZONS, &two).unwrap();
    let point = &curve.points[2];
    assert_eq!((point.lambda_g, point.lambda_y), (0.1, 0.5));
    let weights = PredictionSettings::weighted(
        Regularisation::per_column(0.1),
        Slack::Penalty(100.0),
        Slack::Penalty(0.5),
    );
    let summary = HoldOutErrors::measure(&data, HORIZONS, &weights)
        .unwrap()
        .summary();
    assert_eq!(summary.windows, curve.windows);
    for (output, error) in summary.outputs.iter().zip(&point.output_errors) {
        assert!((output.rms_overall - error).abs() < 1e-12 * error);
    }
    let squares = summary
        .outputs
        .iter()
        .map(|o| o.normalised_overall.unwrap().powi(2));
    let mean = squares.sum::<f64>() / 3.0;
    assert!((mean - point.mean_square).abs() < 1e-12 * mean);
}

/// With hard input slack only the ratio of the two weights matters.
#[test]
fn equal_ratios_predict_alike() {
    let pairs = TuningSettings {
        lambda_g: vec![0.1, 1.0],
        lambda_y: vec![0.2, 2.0],
        ..settings()
    };
    let curve = tune(&recording(240, 0.5), HORIZONS, &pairs).unwrap();
    let (a, b) = (curve.points[0].error, curve.points[3].error);
    assert!((a - b).abs() < 1e-9 * a, "{a} {b}");
    assert!((a - curve.points[1].error).abs() > 1e-4 * a);
}

#[test]
fn the_seed_decides_the_windows_and_nothing_else_does() {
    let data = recording(1000, 0.5);
    let few = |seed| TuningSettings {
        windows: 20,
        seed,
        ..settings()
    };
    let curve = tune(&data, HORIZONS, &few(1)).unwrap();
    assert_eq!((curve.windows, curve.independent_windows), (20, 19));
    assert_eq!(curve, tune(&data, HORIZONS, &few(1)).unwrap());
    assert_ne!(curve, tune(&data, HORIZONS, &few(2)).unwrap());
}

#[test]
fn the_curve_goes_to_csv_and_json() {
    let curve = tune(&recording(240, 0.5), HORIZONS, &settings()).unwrap();
    let value = serde_json::to_value(&curve).unwrap();
    assert_eq!(serde_json::from_value::<TuningCurve>(value).unwrap(), curve);
    let mut file = Vec::new();
    curve.write_csv(&mut file).unwrap();
    let mut table = csv::Reader::from_reader(file.as_slice());
    let header = table.headers().unwrap().clone();
    assert_eq!(&header[0], "lambda_g");
    assert_eq!(&header[8], "error_y3");
    let rows: Vec<_> = table.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 13);
    assert!(["best", "both"].contains(&&rows[curve.best][5]));
    for (row, point) in rows.iter().zip(&curve.points) {
        assert_eq!(row[2].parse(), Ok(point.error));
    }
}

#[test]
fn progress_is_told_and_a_flag_stops_the_run() {
    let data = recording(240, 0.5);
    let cancel = AtomicBool::new(false);
    let mut told = Vec::new();
    let result = tune_with(&data, HORIZONS, &settings(), &cancel, |progress| {
        told.push(progress.done);
        cancel.store(progress.done == 4, Ordering::Relaxed);
    });
    assert_eq!(told, [1, 2, 3, 4]);
    let error = result.unwrap_err();
    assert!(
        matches!(error, AssessmentError::Interrupted { done: 4, total: 13 }),
        "{error}"
    );
}

#[test]
fn bad_settings_are_refused_with_their_numbers() {
    let data = recording(240, 0.1);
    let refuse = |change: &dyn Fn(&mut TuningSettings), words: &[&str]| {
        let mut bad = settings();
        change(&mut bad);
        let message = tune(&data, HORIZONS, &bad).unwrap_err().to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    refuse(&|s| s.lambda_g.clear(), &["`lambda_g` is empty"]);
    refuse(&|s| s.lambda_y.clear(), &["`lambda_y` is empty"]);
    refuse(&|s| s.lambda_g[2] = -0.5, &["`lambda_g[2]` is -0.5"]);
    refuse(&|s| s.lambda_y[0] = f64::NAN, &["`lambda_y[0]` is NaN"]);
    refuse(&|s| s.windows = 1, &["`windows` is 1", "at least 2"]);
    refuse(
        &|s| s.hold_out = HoldOut::Records(vec![2]),
        &["record 2", "1 to 1"],
    );
    refuse(
        &|s| s.hold_out = HoldOut::Records(vec![1]),
        &["0 samples", "needs 13"],
    );
    refuse(
        &|s| s.hold_out = HoldOut::Records(vec![]),
        &["hold-out is too short", "0 samples"],
    );
    refuse(
        &|s| s.input_slack = Slack::Penalty(-1.0),
        &["none of the 13", "`input_slack` is -1"],
    );
    let short = recording(48, 0.1);
    let message = tune(&short, HORIZONS, &settings()).unwrap_err().to_string();
    assert!(
        message.contains("12 samples") && message.contains("needs 13"),
        "{message}"
    );
    let message = tune(&data, Horizons::new(0, 4), &settings())
        .unwrap_err()
        .to_string();
    assert!(message.contains("past horizon is 0"), "{message}");
}

#[test]
fn the_margin_is_the_conformal_quantile() {
    let data = recording(600, 0.3);
    let weights = PredictionSettings::least_squares();
    let errors = HoldOutErrors::measure(&data, HORIZONS, &weights).unwrap();
    let margin = hold_out_margin(&data, HORIZONS, &weights, 0.9).unwrap();
    assert_eq!(margin.windows, 138);
    for (output, found) in margin.outputs.iter().enumerate() {
        for (step, &value) in found.per_step.iter().enumerate() {
            let below = errors
                .errors_of(output, step)
                .filter(|e| e.abs() <= value)
                .count();
            // ⌈139·0.9⌉
            assert_eq!(below, 126);
            assert!(value <= found.flat);
        }
        assert!(found.per_step.contains(&found.flat));
    }
    let message = errors.margin(0.999).unwrap_err().to_string();
    assert!(
        message.contains("at least 999") && message.contains("there are 138"),
        "{message}"
    );
    assert!(
        errors
            .margin(1.0)
            .unwrap_err()
            .to_string()
            .contains("level is 1")
    );
    assert!(errors.margin(f64::NAN).is_err());
}

/// The promise of the quantile, on recordings it has not seen.
#[test]
fn new_errors_stay_within_the_margin_as_often_as_promised() {
    let system = Lti::random(4, 2, 3, 0.9, 42);
    let records: Vec<_> = (0..3)
        .map(|i| common::record(&system, 2000, 0.3, i))
        .collect();
    let data = common::dataset(records);
    let held = |number| PredictionSettings {
        hold_out: HoldOut::Records(vec![number]),
        ..PredictionSettings::least_squares()
    };
    let margin = hold_out_margin(&data, HORIZONS, &held(2), 0.9).unwrap();
    let fresh = HoldOutErrors::measure(&data, HORIZONS, &held(3)).unwrap();
    for (output, found) in margin.outputs.iter().enumerate() {
        for (step, &value) in found.per_step.iter().enumerate() {
            let within = fresh
                .errors_of(output, step)
                .filter(|e| e.abs() <= value)
                .count();
            let share = within as f64 / fresh.windows() as f64;
            assert!((0.86..0.94).contains(&share), "{output} {step}: {share}");
        }
    }
}
