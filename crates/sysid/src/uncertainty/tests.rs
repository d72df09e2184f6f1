use super::*;
use crate::prediction_error::tests::{plant, records, structure};
use crate::prediction_error::{RefineSettings, refine};

/// Sample standard deviation over the mean standard error, and the share of |error| below 2
/// standard errors, per quantity.
struct Study {
    values: Vec<Vec<f64>>,
    errors: Vec<Vec<f64>>,
}

impl Study {
    fn ratios(&self) -> Vec<f64> {
        let runs = self.values.len() as f64;
        let ratio = |j: usize| {
            let mean = self.values.iter().map(|v| v[j]).sum::<f64>() / runs;
            let squares = self.values.iter().map(|v| (v[j] - mean).powi(2));
            let deviation = (squares.sum::<f64>() / (runs - 1.0)).sqrt();
            let error = self.errors.iter().map(|e| e[j]).sum::<f64>() / runs;
            error / deviation
        };
        (0..self.values[0].len()).map(ratio).collect()
    }
}

fn study(truth: &SystemMatrices, focus: Focus, samples: usize) -> (Study, usize) {
    let free = structure(&[true, false]);
    let mut study = Study {
        values: Vec::new(),
        errors: Vec::new(),
    };
    let mut coloured = 0;
    for seed in 0..100 {
        let data = records(truth, &[samples, samples / 2], 0.3, 100 + seed);
        let mut start = truth.clone();
        if focus == Focus::Simulation {
            start.k.fill(0.0);
        }
        let settings = RefineSettings::default();
        let refined = refine(&data, &start, &free, focus, &settings).unwrap();
        let uncertainty = Uncertainty::of(&data, &refined.matrices, &free).unwrap();
        coloured += usize::from(uncertainty.coloured);
        let gain = uncertainty.steady_state_gain();
        let mut values: Vec<f64> = Vec::new();
        let mut errors: Vec<f64> = Vec::new();
        let response = &uncertainty.frequency_response_error(&[0.35])[0];
        for l in 0..2 {
            for j in 0..2 {
                values.push(gain.value[(l, j)]);
                errors.push(gain.standard_error[(l, j)]);
                let z = response.response[(l, j)];
                values.push(z.re.hypot(z.im));
                errors.push(response.magnitude[(l, j)]);
            }
        }
        study.values.push(values);
        study.errors.push(errors);
    }
    (study, coloured)
}

#[test]
fn standard_errors_are_those_of_repeated_recordings() {
    let (study, coloured) = study(&plant(), Focus::Prediction, 400);
    let ratios = study.ratios();
    assert!(
        ratios.iter().all(|r| (0.75..1.25).contains(r)),
        "{ratios:?}"
    );
    // The test of whiteness has a size of 0.1 %.
    assert!(coloured <= 3, "{coloured}");
}

#[test]
fn standard_errors_allow_for_coloured_noise() {
    let mut truth = plant();
    // Noise with a long memory.
    truth.k = deepc_core::faer::mat![[1.0, 0.4], [-0.3, 0.9], [0.3, 0.3]];
    let (study, coloured) = study(&truth, Focus::Simulation, 800);
    let ratios = study.ratios();
    assert_eq!(coloured, 100);
    assert!(
        ratios.iter().all(|r| (0.75..1.25).contains(r)),
        "{ratios:?}"
    );
}

#[test]
fn a_barely_excited_input_has_a_large_standard_error() {
    let truth = plant();
    let mut data = records(&truth, &[1500], 0.3, 7);
    // Input 1 moved a thousandth of what the model says: its effect drowns.
    let mut quiet = truth.clone();
    for i in 0..3 {
        quiet.b[(i, 1)] *= 1e-3;
    }
    let drowned = records(&quiet, &[1500], 0.3, 7);
    data.records = drowned.records;
    let free = structure(&[true, false]);
    let settings = RefineSettings::default();
    let refined = refine(&data, &truth, &free, Focus::Prediction, &settings).unwrap();
    let uncertainty = Uncertainty::of(&data, &refined.matrices, &free).unwrap();
    let gain = uncertainty.steady_state_gain();
    for l in 0..2 {
        let ratio = |j| gain.value[(l, j)].abs() / gain.standard_error[(l, j)];
        assert!(ratio(0) > 20.0, "output {l}: {}", ratio(0));
        assert!(ratio(1) < 4.0, "output {l}: {}", ratio(1));
    }
}

#[test]
fn an_input_that_is_never_moved_has_an_infinite_one() {
    let truth = plant();
    let mut data = records(&truth, &[600], 0.3, 8);
    let mut quiet = truth.clone();
    quiet.b.col_mut(1).fill(0.0);
    data.records = records(&quiet, &[600], 0.3, 8).records;
    data.records[0].inputs.col_mut(1).fill(0.0);
    let free = structure(&[true, false]);
    let uncertainty = Uncertainty::of(&data, &truth, &free).unwrap();
    let gain = uncertainty.steady_state_gain();
    for l in 0..2 {
        assert!(gain.standard_error[(l, 0)] < 1.0);
        assert!(gain.standard_error[(l, 1)].is_infinite());
    }
}

#[test]
fn feedthrough_is_found_whether_or_not_it_was_fitted() {
    let truth = plant();
    for fitted in [true, false] {
        // Feedthrough of input 0 only: 0.3 and −0.2.
        let data = records(&truth, &[2500], 0.3, 9);
        let free = structure(&[fitted, false]);
        let settings = RefineSettings::default();
        let mut start = truth.clone();
        if !fitted {
            start.d.fill(0.0);
        }
        let refined = refine(&data, &start, &free, Focus::Prediction, &settings).unwrap();
        let uncertainty = Uncertainty::of(&data, &refined.matrices, &free).unwrap();
        let t = uncertainty.feedthrough_t();
        for l in 0..2 {
            assert!(t[(l, 0)].abs() > 8.0, "{}", t[(l, 0)]);
            if fitted {
                assert!(t[(l, 1)].abs() < 4.0, "{}", t[(l, 1)]);
                let error = uncertainty.free_feedthrough()[(l, 0)] - truth.d[(l, 0)];
                assert!(error.abs() < 0.05, "{error}");
            }
        }
    }
}

#[test]
fn values_are_the_models_own() {
    let truth = plant();
    let data = records(&truth, &[300], 0.3, 10);
    let inactive = InputStructure {
        dynamics: vec![true, false],
        feedthrough: vec![true, false],
    };
    let uncertainty = Uncertainty::of(&data, &truth, &inactive).unwrap();
    let gain = uncertainty.steady_state_gain();
    let response = &uncertainty.frequency_response_error(&[0.0])[0];
    // Sum of the impulse response.
    let mut expected = truth.d.col(0).to_owned();
    let mut x = truth.b.col(0).to_owned();
    for _ in 0..2000 {
        expected += &truth.c * &x;
        x = &truth.a * x;
    }
    for l in 0..2 {
        assert!((gain.value[(l, 0)] - expected[l]).abs() < 1e-10);
        assert!((response.response[(l, 0)].re - expected[l]).abs() < 1e-10);
        assert!((response.magnitude[(l, 0)] - gain.standard_error[(l, 0)]).abs() < 1e-10);
        assert!(gain.value[(l, 1)] == 0.0 && gain.standard_error[(l, 1)] == 0.0);
    }
}
