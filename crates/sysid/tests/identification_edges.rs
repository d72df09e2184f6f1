//! Recordings and settings at the edge of what identification takes.

mod common;

use std::ops::ControlFlow;

use common::Noise;
use deepc_core::data::Dataset;
use sysid::{
    Focus, Identification, IdentificationReport, IdentificationSettings, RefineSettings,
    SysidError, identify, identify_with, refine_model,
};

/// Records of a plant of third order with two inputs and two outputs.
fn records(lengths: &[usize], noise: f64, output_scale: f64) -> Dataset {
    let mut random = Noise::new(7);
    let mut data = Dataset::new(0.1, ["a", "b"], ["p", "q"]).unwrap();
    for &samples in lengths {
        let (mut u, mut y, mut x) = (Vec::new(), Vec::new(), [0.0; 3]);
        for _ in 0..samples {
            let [a, b] = [random.normal(), random.normal()];
            for output in [x[0] + 0.3 * x[1], x[1] + 0.3 * x[2]] {
                y.push(output_scale * (output + noise * random.normal()));
            }
            x = [
                0.9 * x[0] + 0.2 * x[1] + a + 2.0 * b,
                -0.2 * x[0] + 0.9 * x[1] + 0.5 * a,
                0.6 * x[2] + b,
            ];
            u.extend([a, b]);
        }
        data.push_rows(&u, &y).unwrap();
    }
    data
}

fn with(data: &Dataset, settings: &IdentificationSettings) -> Result<Identification, SysidError> {
    identify_with(data, settings, &mut |_| ControlFlow::Continue(()))
}

#[test]
fn records_of_a_few_samples_do_not_change_the_order() {
    for lengths in [&[300, 300][..], &[300, 1, 1, 300, 1, 2, 3]] {
        let found = identify(&records(lengths, 0.1, 1.0)).unwrap();
        assert_eq!(found.model.order(), 3, "{lengths:?}\n{}", found.report);
    }
}

#[test]
fn limits_beyond_the_data_are_no_limits() {
    let data = records(&[200], 0.1, 1.0);
    let settings = IdentificationSettings {
        max_order: usize::MAX,
        steps_ahead: usize::MAX,
        ..IdentificationSettings::default()
    };
    let found = with(&data, &settings).unwrap();
    assert_eq!(found.model.order(), 3, "{}", found.report);
    assert_eq!(found.report.steps_ahead, 66);
}

#[test]
fn sizes_whose_squares_are_out_of_range_are_refused() {
    for (scale, allowed) in [
        (1e-140, true),
        (1e140, true),
        (1e-200, false),
        (1e200, false),
    ] {
        let found = identify(&records(&[120], 0.1, scale));
        match found {
            Ok(found) => assert!(allowed && found.model.order() == 3, "{scale:e}"),
            Err(error) => {
                let message = error.to_string();
                assert!(!allowed && message.contains("`p`"), "{scale:e}: {message}");
                assert!(message.contains("1e150"), "{message}");
            }
        }
    }
    let mut data = Dataset::new(0.1, ["u"], ["y"]).unwrap();
    let values: Vec<f64> = (0..200_u16).map(|k| f64::from(k * 7 % 11)).collect();
    let largest: Vec<f64> = values.iter().map(|v| (v - 5.0) * 3e307).collect();
    data.push_rows(&values, &largest).unwrap();
    let message = identify(&data).unwrap_err().to_string();
    assert!(message.contains("1e150"), "{message}");
}

#[test]
fn a_report_with_infinite_errors_survives_a_file() {
    let data = records(&[200], 0.1, 1.0);
    let settings = IdentificationSettings {
        without_effect: vec!["b".to_owned()],
        order: Some(2),
        ..IdentificationSettings::default()
    };
    let report = with(&data, &settings).unwrap().report;
    assert!(
        report
            .effects
            .iter()
            .any(|e| e.best_relative_error.is_infinite())
    );
    let text = serde_json::to_string(&report).unwrap();
    let again: IdentificationReport = serde_json::from_str(&text).unwrap();
    assert!(again.effects[2].best_relative_error.is_infinite());
    assert_eq!(again.order, report.order);
}

#[test]
fn an_output_that_stands_still_while_held_out_has_a_finite_fit() {
    let mut data = Dataset::new(0.1, ["u"], ["y"]).unwrap();
    let mut random = Noise::new(3);
    for record in 0..9 {
        let (mut u, mut y, mut x) = (Vec::new(), Vec::new(), 0.0);
        for _ in 0..50 {
            let input = if record % 3 == 1 {
                0.0
            } else {
                random.normal()
            };
            u.push(input);
            y.push(x);
            x = 0.9 * x + input;
        }
        data.push_rows(&u, &y).unwrap();
    }
    let found = identify(&data).unwrap();
    assert!(found.report.held_out_fit[0] > 99.9, "{}", found.report);
}

#[test]
fn the_largest_order_is_that_of_the_longest_horizon() {
    let settings = IdentificationSettings {
        horizons: Some(vec![5, 10]),
        ..IdentificationSettings::of_order(30)
    };
    let error = with(&records(&[300], 0.1, 1.0), &settings).unwrap_err();
    let SysidError::Order { largest, .. } = error else {
        panic!("{error}");
    };
    assert_eq!(largest, 18);
}

#[test]
fn a_recording_without_records_refines_nothing() {
    let model = identify(&records(&[200], 0.1, 1.0)).unwrap().model;
    let none = records(&[], 0.1, 1.0);
    let refined = refine_model(&none, &model, Focus::Prediction, &RefineSettings::default());
    let message = refined.unwrap_err().to_string();
    assert!(message.contains("at least one record"), "{message}");
}
