//! Several inputs and several outputs: exact without noise, consistent with noise, the same model
//! in any units, clear errors.

use crate::subspace_support;
use deepc_core::data::Dataset;
use deepc_core::faer::Mat;
use deepc_core::hankel::FactorMethod;
use subspace_support::{
    dataset, difference, distance, generator, innovation_markov, markov, poles, random_system,
    record, rows,
};
use sysid::{
    InputMatrices, Offsets, OutputScaling, SubspaceSettings, SysidError, SystemMatrices,
    UnstablePoles, Weighting, subspace_model,
};

const WEIGHTINGS: [Weighting; 3] = [Weighting::Cva, Weighting::Moesp, Weighting::N4sid];

fn settings(past: usize, future: usize, order: usize, weighting: Weighting) -> SubspaceSettings {
    SubspaceSettings {
        past,
        future,
        order,
        weighting,
        input_matrices: InputMatrices::Subspace,
        factor: FactorMethod::BlockQr,
        offsets: Offsets::Free,
        output_scaling: OutputScaling::EachItsOwn,
        unstable_poles: UnstablePoles::Refuse,
    }
}

/// The linear system with constants added to every channel.
fn shifted(rows: &mut [Vec<f64>]) {
    for row in rows {
        for (j, value) in row.iter_mut().enumerate() {
            *value += 3.0 * j as f64 - 4.0;
        }
    }
}

#[test]
fn noise_free_plants_come_back_with_every_weighting_and_unequal_horizons() {
    for (seed, n, m, p) in [(1, 3, 2, 2), (2, 4, 1, 3), (3, 6, 3, 2), (4, 5, 2, 4)] {
        let mut rng = generator(seed);
        let truth = random_system(&mut rng, n, m, p);
        let mut rows = record(&mut rng, &truth, 700, 0.0);
        shifted(&mut rows);
        let data = dataset(0.1, m, &[&rows]);
        for weighting in WEIGHTINGS {
            for (past, future) in [(8, 8), (6, 11), (12, 5)] {
                for factor in [FactorMethod::BlockQr, FactorMethod::Gram] {
                    let mut settings = settings(past, future, n, weighting);
                    settings.factor = factor;
                    let found = subspace_model(&data, &settings).unwrap();
                    let model = found.model.matrices();
                    let case = format!("{n},{m},{p} {weighting:?} {past},{future} {factor:?}");
                    let apart = distance(&poles(model.a.as_ref()), &poles(truth.a.as_ref()));
                    assert!(apart < 1e-9, "{case}: poles differ by {apart:e}");
                    let apart = difference(&markov(model, 25), &markov(&truth, 25));
                    assert!(
                        apart < 1e-9,
                        "{case}: Markov parameters differ by {apart:e}"
                    );
                    assert_eq!(found.largest_order, n, "{case}");
                    assert_eq!(found.factor.method, FactorMethod::BlockQr, "{case}");
                }
            }
        }
    }
}

/// Outputs that are the same signal, or one and its multiple: all covariances are singular.
#[test]
fn an_output_given_twice_makes_nothing_undefined() {
    let mut rng = generator(5);
    let mut truth = random_system(&mut rng, 3, 2, 2);
    for j in 0..3 {
        truth.c[(1, j)] = -2.0 * truth.c[(0, j)];
    }
    for j in 0..2 {
        truth.d[(1, j)] = -2.0 * truth.d[(0, j)];
    }
    for noise in [0.0, 0.1] {
        let mut rows = record(&mut rng, &truth, 600, 0.0);
        for row in &mut rows {
            let disturbed = row[2] + noise * subspace_support::normal(&mut rng);
            (row[2], row[3]) = (disturbed, -2.0 * disturbed);
        }
        let data = dataset(0.1, 2, &[&rows]);
        for weighting in WEIGHTINGS {
            let found = subspace_model(&data, &settings(8, 8, 3, weighting)).unwrap();
            let model = found.model.matrices();
            assert!(found.predictor_radius < 1.0);
            let apart = difference(&markov(model, 20), &markov(&truth, 20));
            let limit = if noise == 0.0 { 1e-9 } else { 0.2 };
            assert!(apart < limit, "{weighting:?}, noise {noise}: {apart:e}");
        }
    }
}

#[test]
fn many_noisy_samples_bring_the_truth_closer() {
    let mut rng = generator(6);
    let truth = random_system(&mut rng, 4, 2, 2);
    let rows = record(&mut rng, &truth, 64_000, 0.5);
    for weighting in WEIGHTINGS {
        let error = |samples: usize| {
            let data = dataset(0.1, 2, &[&rows[..samples]]);
            let mut settings = settings(20, 12, 4, weighting);
            settings.factor = FactorMethod::Gram;
            let found = subspace_model(&data, &settings).unwrap();
            assert_eq!(found.gain_fallback, None);
            let model = found.model.matrices();
            // The innovation has unit covariance times 0.25.
            let covariance = found.model.innovation_covariance();
            let expected = Mat::<f64>::identity(2, 2) * deepc_core::faer::Scale(0.25);
            (
                difference(&markov(model, 20), &markov(&truth, 20)),
                difference(
                    &innovation_markov(model, 20),
                    &innovation_markov(&truth, 20),
                ),
                (covariance - expected).norm_max(),
            )
        };
        let (few, many) = (error(1000), error(64_000));
        // The errors fall as 1/√N: to an eighth.
        assert!(
            many.0 < 0.01 && many.0 < 0.4 * few.0,
            "{weighting:?}: {few:?}, {many:?}"
        );
        assert!(
            many.1 < 0.05 && many.1 < 0.6 * few.1,
            "{weighting:?}: {few:?}, {many:?}"
        );
        assert!(many.2 < 0.01, "{weighting:?}: {few:?}, {many:?}");
    }
}

#[test]
fn the_units_of_the_channels_do_not_matter() {
    let mut rng = generator(7);
    let truth = random_system(&mut rng, 3, 2, 2);
    let rows = record(&mut rng, &truth, 800, 0.1);
    let scaled = |units: [f64; 4]| -> Vec<Vec<f64>> {
        let times = |row: &Vec<f64>| row.iter().zip(units).map(|(x, unit)| x * unit).collect();
        rows.iter().map(times).collect()
    };
    let model = |rows: &[Vec<f64>], settings: &SubspaceSettings| {
        let data = dataset(0.1, 2, &[rows]);
        let found = subspace_model(&data, settings).unwrap();
        found.model.into_matrices()
    };
    let back = |model: SystemMatrices, units: [f64; 4]| SystemMatrices {
        b: Mat::from_fn(3, 2, |i, j| model.b[(i, j)] * units[j]),
        c: Mat::from_fn(2, 3, |i, j| model.c[(i, j)] / units[2 + i]),
        d: Mat::from_fn(2, 2, |i, j| model.d[(i, j)] * units[j] / units[2 + i]),
        k: Mat::from_fn(3, 2, |i, j| model.k[(i, j)] * units[2 + j]),
        ..model
    };
    for weighting in WEIGHTINGS {
        for factor in [FactorMethod::BlockQr, FactorMethod::Gram] {
            let mut settings = settings(10, 10, 3, weighting);
            settings.factor = factor;
            let expected = model(&rows, &settings);
            for units in [
                [1e8, 1e-8, 1.0, 1.0],
                [1.0, 1.0, 1e-8, 1e8],
                [1e8, 1e8, 1e8, 1e-8],
            ] {
                let found = back(model(&scaled(units), &settings), units);
                let apart = difference(&markov(&found, 20), &markov(&expected, 20));
                assert!(
                    apart < 1e-9,
                    "{weighting:?} {factor:?} {units:?}: {apart:e}"
                );
                let apart = difference(
                    &innovation_markov(&found, 20),
                    &innovation_markov(&expected, 20),
                );
                assert!(
                    apart < 1e-8,
                    "{weighting:?} {factor:?} {units:?}: {apart:e}"
                );
            }
            // As a tool without scales would, for inputs and for all outputs together.
            settings.output_scaling = OutputScaling::Common;
            let expected = model(&rows, &settings);
            for units in [[1e8, 1e-8, 1.0, 1.0], [1.0, 1e8, 1e-8, 1e-8]] {
                let found = back(model(&scaled(units), &settings), units);
                let apart = difference(&markov(&found, 20), &markov(&expected, 20));
                assert!(
                    apart < 1e-9,
                    "{weighting:?} {factor:?} {units:?}: {apart:e}"
                );
            }
        }
    }
}

/// Both ways to the factor give the same model where the fast one is exact enough.
#[test]
fn the_fast_way_agrees_with_qr() {
    let mut rng = generator(8);
    let truth = random_system(&mut rng, 4, 2, 3);
    let parts: Vec<_> = (0..3).map(|_| record(&mut rng, &truth, 400, 0.2)).collect();
    let parts: Vec<&[Vec<f64>]> = parts.iter().map(Vec::as_slice).collect();
    let data = dataset(0.1, 2, &parts);
    for offsets in [Offsets::Means, Offsets::Free] {
        let model = |factor| {
            let mut settings = settings(9, 7, 4, Weighting::Cva);
            settings.factor = factor;
            settings.offsets = offsets.clone();
            let found = subspace_model(&data, &settings).unwrap();
            assert_eq!(found.factor.method, factor);
            found.model.into_matrices()
        };
        let (fast, exact) = (model(FactorMethod::Gram), model(FactorMethod::BlockQr));
        let apart = difference(&markov(&fast, 20), &markov(&exact, 20));
        assert!(apart < 1e-10, "{offsets:?}: {apart:e}");
    }
}

/// A measured disturbance is an input to the model, after the others.
#[test]
fn a_measured_disturbance_is_identified_as_an_input_is() {
    let mut rng = generator(12);
    let truth = random_system(&mut rng, 3, 2, 2);
    let rows = record(&mut rng, &truth, 300, 0.1);
    let part = |from, count| Mat::from_fn(rows.len(), count, |k, j| rows[k][from + j]);
    let mut data = Dataset::with_disturbances(0.1, ["u"], ["d"], ["y", "z"]).unwrap();
    data.push_record_with_disturbances(part(0, 1), part(1, 1), part(2, 2))
        .unwrap();
    let settings = settings(8, 8, 3, Weighting::Cva);
    let with = subspace_model(&data, &settings).unwrap().model;
    assert_eq!((with.inputs().len(), with.disturbances().len()), (1, 1));
    let as_input = subspace_model(&dataset(0.1, 2, &[&rows]), &settings).unwrap();
    let as_input = as_input.model.into_matrices();
    assert!(difference(&markov(with.matrices(), 20), &markov(&as_input, 20)) < 1e-14);
}

/// Records that begin anywhere: no window crosses from one to the next.
#[test]
fn records_are_not_run_into_each_other() {
    let mut rng = generator(9);
    let truth = random_system(&mut rng, 3, 2, 2);
    // One is too short for a window, and is left out.
    let parts: Vec<_> = [200, 150, 10, 220]
        .map(|samples| record(&mut rng, &truth, samples, 0.0))
        .to_vec();
    let parts: Vec<&[Vec<f64>]> = parts.iter().map(Vec::as_slice).collect();
    for weighting in WEIGHTINGS {
        let data = dataset(0.1, 2, &parts);
        let found = subspace_model(&data, &settings(8, 8, 3, weighting)).unwrap();
        let apart = difference(&markov(found.model.matrices(), 20), &markov(&truth, 20));
        assert!(apart < 1e-9, "{weighting:?}: {apart:e}");
        let joined: Vec<_> = parts.concat();
        let data = dataset(0.1, 2, &[&joined]);
        let found = subspace_model(&data, &settings(8, 8, 3, weighting)).unwrap();
        let apart = difference(&markov(found.model.matrices(), 20), &markov(&truth, 20));
        assert!(apart > 1e-3, "{weighting:?}: joined records give {apart:e}");
    }
}

fn error(data: &Dataset, settings: &SubspaceSettings) -> (String, SysidError) {
    let error = subspace_model(data, settings).unwrap_err();
    (error.to_string(), error)
}

#[test]
fn bad_requests_are_refused_with_numbers() {
    let mut rng = generator(10);
    let truth = random_system(&mut rng, 3, 2, 2);
    let rows = record(&mut rng, &truth, 300, 0.0);
    let data = dataset(0.1, 2, &[&rows]);
    let base = settings(8, 8, 3, Weighting::Cva);

    let (text, found) = error(&dataset(0.1, 2, &[&rows[..70]]), &base);
    assert!(
        matches!(
            found,
            SysidError::TooShort {
                longest: 70,
                window: 16,
                ..
            }
        ),
        "{text}"
    );
    let (text, found) = error(&dataset(0.1, 2, &[&rows[..10], &rows[..12]]), &base);
    assert!(
        matches!(found, SysidError::TooShort { longest: 12, .. }),
        "{text}"
    );
    // Just enough is enough: 65 rows with the ones, 65 columns.
    subspace_model(&dataset(0.1, 2, &[&rows[..80]]), &base).unwrap();

    let (text, found) = error(
        &data,
        &SubspaceSettings {
            order: 15,
            ..base.clone()
        },
    );
    assert!(
        matches!(
            found,
            SysidError::Order {
                order: 15,
                largest: 3,
                ..
            }
        ),
        "{text}"
    );
    assert!(text.contains("horizon"), "{text}");
    let (text, found) = error(
        &data,
        &SubspaceSettings {
            order: 4,
            ..base.clone()
        },
    );
    assert!(
        matches!(
            found,
            SysidError::Order {
                order: 4,
                largest: 3,
                ..
            }
        ),
        "{text}"
    );
    assert!(text.contains("singular value 4"), "{text}");
    let (text, found) = error(
        &data,
        &SubspaceSettings {
            order: 0,
            ..base.clone()
        },
    );
    assert!(
        matches!(found, SysidError::Order { order: 0, .. }),
        "{text}"
    );
}

#[test]
fn settings_and_inputs_that_do_not_do_are_refused_with_numbers() {
    let mut rng = generator(11);
    let truth = random_system(&mut rng, 3, 2, 2);
    let rows = record(&mut rng, &truth, 300, 0.0);
    let data = dataset(0.1, 2, &[&rows]);
    let base = settings(8, 8, 3, Weighting::Cva);

    for (past, future) in [(0, 8), (8, 1), (8, 0), (usize::MAX, 8)] {
        let (text, found) = error(&data, &settings(past, future, 1, Weighting::Cva));
        let expected = matches!(
            found,
            SysidError::Setting { .. } | SysidError::TooShort { .. }
        );
        assert!(expected, "{past},{future}: {text}");
    }
    let offsets = Offsets::Given {
        inputs: vec![0.0],
        outputs: vec![0.0; 2],
    };
    let (text, found) = error(
        &data,
        &SubspaceSettings {
            offsets,
            ..base.clone()
        },
    );
    assert!(
        matches!(
            found,
            SysidError::Setting {
                field: "offsets.inputs",
                ..
            }
        ),
        "{text}"
    );

    // Two tones excite four directions per input.
    let mut tones = rows.clone();
    for (k, row) in tones.iter_mut().enumerate() {
        let t = k as f64;
        row[0] = (0.3 * t).sin() + (0.7 * t).cos();
        row[1] = (0.3 * t).cos() - (0.7 * t).cos();
    }
    let (text, found) = error(&dataset(0.1, 2, &[&tones]), &base);
    assert!(
        matches!(
            found,
            SysidError::NotExciting {
                rank: 4,
                needed: 16,
                ..
            }
        ),
        "{text}"
    );

    // A channel that stands still.
    let mut still = rows.clone();
    for row in &mut still {
        row[1] = 80.0;
    }
    let (text, found) = error(&dataset(0.1, 2, &[&still]), &base);
    assert!(matches!(found, SysidError::Constant { .. }), "{text}");
}

/// Records 1 to 4 identify, record 5 validates: better than running them into each other.
#[test]
fn records_of_the_reference_set_are_used_together() {
    let all = rows("syn4_multirecord");
    let record = |number: u8| -> Vec<Vec<f64>> {
        let number = f64::from(number);
        let of = all.iter().filter(|row| (row[0] - number).abs() < 0.5);
        of.map(|row| row[1..].to_vec()).collect()
    };
    let parts: Vec<_> = (1..=4).map(record).collect();
    let parts: Vec<&[Vec<f64>]> = parts.iter().map(Vec::as_slice).collect();
    let fit = |records: &[&[Vec<f64>]]| {
        let data = dataset(0.01, 2, records);
        let mut settings = settings(40, 40, 4, Weighting::Cva);
        settings.offsets = Offsets::Given {
            inputs: vec![0.0, 80.0],
            outputs: vec![0.0],
        };
        let found = subspace_model(&data, &settings).unwrap();
        let check = dataset(0.01, 2, &[&record(5)]);
        subspace_support::simulation_fit(&found.model, &check.records()[0])[0]
    };
    let joined = parts.concat();
    let (apart, together) = (fit(&parts), fit(&[&joined]));
    assert!(
        apart > together + 1.0,
        "{apart} with boundaries, {together} without"
    );
}
