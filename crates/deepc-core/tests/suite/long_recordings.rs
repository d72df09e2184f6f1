//! Factors computed without holding the Hankel matrix, against the matrix.

use crate::common;
use common::Lti;
use deepc_core::data::Dataset;
use deepc_core::hankel::{
    FactorMethod, GRAM_CONDITION_LIMIT, HankelFactor, HankelMatrix, Horizons,
};
use deepc_core::predictor::{Predictor, ReductionMethod};
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, MeasuredDisturbances, Moment, OutputBounds,
    PredictiveProgram, ProgramOptions, Regularisation, Slack,
};
use faer::{Mat, MatRef};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Records of a random system with noise; the first input stands at `offset`.
fn noisy(m: usize, q: usize, p: usize, lengths: &[usize], offset: f64, seed: u64) -> Dataset {
    let system = Lti::random(3, m + q, p, 0.9, seed);
    let names = common::names;
    let mut data =
        Dataset::with_disturbances(0.1, names("u", m), names("d", q), names("y", p)).unwrap();
    for (i, &samples) in lengths.iter().enumerate() {
        let (mut signals, outputs) = common::record(&system, samples, 0.1, seed ^ (i as u64 + 1));
        for value in signals.col_as_slice_mut(0) {
            *value = offset + 0.3 * *value;
        }
        data.push_record_with_disturbances(
            signals.subcols(0, m).to_owned(),
            signals.subcols(m, q).to_owned(),
            outputs,
        )
        .unwrap();
    }
    data
}

/// Largest difference of `LLᵀ` and H Hᵀ, rows scaled to the size of their channels.
fn gram_error(lower: MatRef<'_, f64>, hankel: MatRef<'_, f64>) -> f64 {
    let exact = hankel * hankel.transpose();
    let found = lower * lower.transpose();
    let mut largest = 0.0_f64;
    for i in 0..exact.nrows() {
        for j in 0..exact.ncols() {
            let size = (exact[(i, i)] * exact[(j, j)]).sqrt();
            largest = largest.max((exact[(i, j)] - found[(i, j)]).abs() / size);
        }
    }
    largest
}

fn is_lower(matrix: MatRef<'_, f64>) -> bool {
    (0..matrix.ncols()).all(|j| (0..j).all(|i| matrix[(i, j)] == 0.0))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 32,
        rng_seed: RngSeed::Fixed(1979),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn displacement_gives_the_gram_matrix(
        m in 2..=3_usize,
        q in 0..=2_usize,
        p in 2..=3_usize,
        past in 1..=4_usize,
        future in 1..=5_usize,
        lengths in prop::collection::vec(0..=120_usize, 1..=3),
        seed in any::<u64>(),
    ) {
        let horizons = Horizons { past, future };
        let rows = (m + q + p) * horizons.window();
        let mut lengths: Vec<_> = lengths.iter().map(|l| l + horizons.window()).collect();
        lengths[0] += 3 * rows;
        let data = noisy(m, q, p, &lengths, 5.0, seed);
        let hankel = HankelMatrix::build(&data, horizons).unwrap();
        let factor = HankelFactor::stream(&data, horizons).unwrap();
        prop_assert_eq!(factor.report().method, FactorMethod::Gram, "{}", factor.report());
        prop_assert_eq!(factor.columns(), hankel.columns());
        prop_assert!(is_lower(factor.lower()));
        let error = gram_error(factor.lower(), hankel.stacked());
        prop_assert!(error < 1e-13, "{error:e}");
        let blocks = HankelFactor::stream_by(&data, horizons, FactorMethod::BlockQr).unwrap();
        prop_assert!(!blocks.report().fell_back);
        let error = gram_error(blocks.lower(), hankel.stacked());
        prop_assert!(error < 1e-13, "{error:e}");
    }

    /// Fewer columns than rows, and no window length that suits a block.
    #[test]
    fn short_recordings_have_as_many_columns_as_windows(
        columns in 1..=30_usize,
        seed in any::<u64>(),
    ) {
        let horizons = Horizons::new(2, 3);
        let data = noisy(2, 1, 2, &[columns + 4], 1.0, seed);
        let hankel = HankelMatrix::build(&data, horizons).unwrap();
        let factor = HankelFactor::stream(&data, horizons).unwrap();
        prop_assert_eq!(factor.lower().ncols(), columns.min(25));
        let error = gram_error(factor.lower(), hankel.stacked());
        prop_assert!(error < 1e-13, "{error:e}");
    }
}

/// An offset of 1e5 deviations costs ten digits in a Gram matrix that is not centred: its
/// smallest singular values would be noise.
#[test]
fn offsets_cost_no_digits() {
    let horizons = Horizons::new(3, 4);
    let data = noisy(2, 1, 2, &[400, 300], 3e4, 11);
    let gram = HankelFactor::stream(&data, horizons).unwrap();
    let exact = HankelFactor::stream_by(&data, horizons, FactorMethod::BlockQr).unwrap();
    assert_eq!(gram.report().method, FactorMethod::Gram);
    let without = noisy(2, 1, 2, &[400, 300], 0.0, 11);
    let without = HankelFactor::stream(&without, horizons).unwrap();
    let condition = |factor: &HankelFactor| factor.report().gram_condition.unwrap();
    assert!((condition(&gram) / condition(&without) - 1.0).abs() < 0.1);
    // The rows of H in the coordinates of an orthonormal basis: equal up to a rotation. Triangular
    // factors with a positive diagonal are unique.
    let normalised = |factor: &HankelFactor| {
        let lower = factor.lower();
        Mat::from_fn(lower.nrows(), lower.ncols(), |i, j| {
            lower[(i, j)] * lower[(j, j)].signum()
        })
    };
    let (a, b) = (normalised(&gram), normalised(&exact));
    for j in 0..a.ncols() {
        let error = (a.col(j) - b.col(j)).norm_l2() / b.col(j).norm_l2();
        assert!(error < 1e-9, "column {j}: {error:e}");
    }
}

#[test]
fn data_without_noise_fall_back_and_keep_their_rank() {
    let (n, m, p) = (3, 3, 2);
    let system = Lti::random(n, m, p, 0.9, 4);
    let records = [300, 200].map(|samples| common::record(&system, samples, 0.0, samples as u64));
    let data = common::dataset(records.to_vec());
    let horizons = Horizons::new(4, 6);
    let factor = HankelFactor::stream(&data, horizons).unwrap();
    assert_eq!(factor.report().method, FactorMethod::BlockQr);
    assert!(factor.report().fell_back, "{}", factor.report());
    assert!(factor.report().to_string().contains("fell back"));
    let streamed = factor.excitation(n).unwrap();
    let hankel = HankelMatrix::build(&data, horizons).unwrap();
    let dense = hankel.excitation(n).unwrap();
    assert_eq!(streamed.stacked_rank, m * 10 + n);
    assert_eq!(streamed.stacked_rank, dense.stacked_rank);
    assert!(streamed.is_persistently_exciting());
    assert!(gram_error(factor.lower(), hankel.stacked()) < 1e-13);
}

#[test]
fn streamed_excitation_is_that_of_the_matrix() {
    let horizons = Horizons::new(4, 5);
    let exciting = noisy(2, 1, 2, &[250, 180], 4.0, 8);
    let mut poor = Dataset::new(0.1, ["u1", "u2"], ["y1", "y2"]).unwrap();
    let (mut inputs, outputs) = common::record(&Lti::random(3, 2, 2, 0.9, 6), 300, 0.1, 2);
    for k in 0..300 {
        inputs[(k, 0)] = 2.0;
        inputs[(k, 1)] = (0.3 * k as f64).sin();
    }
    poor.push_record(inputs, outputs).unwrap();
    for data in [exciting, poor] {
        let dense = HankelMatrix::build(&data, horizons).unwrap();
        let dense = dense.excitation(3).unwrap();
        let factor = HankelFactor::stream(&data, horizons).unwrap();
        let streamed = factor.excitation(3).unwrap();
        assert_eq!(streamed.input_rank, dense.input_rank);
        assert_eq!(streamed.stacked_rank, dense.stacked_rank);
        assert_eq!(streamed.columns, dense.columns);
        assert_eq!(streamed.input_channels, dense.input_channels);
        assert_eq!(streamed.samples_needed, dense.samples_needed);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b;
        let (a, b) = (streamed.input_gap.unwrap(), dense.input_gap.unwrap());
        assert!(close(a.largest, b.largest) && close(a.last_counted, b.last_counted));
        assert_eq!(
            factor.require_persistently_exciting(3).is_ok(),
            dense.input_rank == dense.input_rank_needed
        );
    }
}

#[test]
fn all_exact_predictors_have_the_same_optimum() {
    let (past, future) = (5, 8);
    let horizons = Horizons::new(past, future);
    let data = noisy(2, 1, 2, &[400, 300], 50.0, 21);
    let hankel = HankelMatrix::build(&data, horizons).unwrap();
    let exciting = hankel.require_persistently_exciting(3).unwrap();
    let factor = HankelFactor::stream(&data, horizons).unwrap();
    assert_eq!(factor.report().method, FactorMethod::Gram);
    let factor = factor.require_persistently_exciting(3).unwrap();
    let predictors = [
        Predictor::full(&exciting),
        Predictor::compact(&exciting),
        Predictor::streamed(&factor),
        Predictor::exact(&exciting).unwrap(),
    ];
    let settings = DeepcSettings {
        input_weights: vec![0.1, 0.2],
        output_weights: vec![1.0, 3.0],
        regularisation: Regularisation::per_column(1e-3),
        input_slack: Slack::Penalty(1e4),
        output_slack: Slack::Penalty(1e4),
        input_bounds: vec![Bounds::none(); 2],
        output_bounds: vec![OutputBounds::none(); 2],
        options: ProgramOptions::default(),
    };
    let record = &data.records()[0];
    let input_reference = Mat::from_fn(future, 2, |_, i| 50.0 * (1 - i) as f64);
    let output_reference = Mat::from_fn(future, 2, |k, i| (k + i) as f64 / 10.0);
    let optimum = |predictor: &Predictor| {
        let mut program = CondensedProgram::new(predictor, &settings).unwrap();
        let moment = Moment {
            past_inputs: record.inputs().subrows(40, past),
            past_outputs: record.outputs().subrows(40, past),
            input_reference: input_reference.as_ref(),
            output_reference: output_reference.as_ref(),
            disturbances: Some(MeasuredDisturbances {
                past: record.disturbances().subrows(40, past),
                preview: record.disturbances().subrows(40 + past, future),
            }),
        };
        program.set_moment(&moment).unwrap();
        assert!(program.plan_unconstrained());
        common::Solved::of(&program)
    };
    let expected = optimum(&predictors[0]);
    for predictor in &predictors[1..] {
        let found = optimum(predictor);
        let name = predictor.reduction();
        assert_eq!(predictor.reduction().columns_before, 700 - 24);
        let error = (found.objective / expected.objective - 1.0).abs();
        assert!(error <= 1e-9, "{name}: {error:e}");
        for (found, expected) in [
            (&found.inputs, &expected.inputs),
            (&found.outputs, &expected.outputs),
        ] {
            assert!((found - expected).norm_max() < 1e-8, "{name}");
        }
    }
    for predictor in &predictors[1..3] {
        assert_eq!(predictor.reduction().method, ReductionMethod::Compact);
        assert_eq!(predictor.stacked().shape(), (5 * 13, 5 * 13));
        assert!(is_lower(predictor.stacked()));
    }
}

/// Where the Gram matrix is worse than its limit, QR decides.
#[test]
fn a_badly_conditioned_recording_falls_back() {
    let system = Lti::random(3, 2, 2, 0.9, 4);
    let data = common::dataset(vec![common::record(&system, 400, 1e-7, 5)]);
    let horizons = Horizons::new(4, 6);
    let factor = HankelFactor::stream(&data, horizons).unwrap();
    let report = factor.report();
    assert!(report.fell_back);
    assert!(
        report
            .gram_condition
            .is_none_or(|c| c > GRAM_CONDITION_LIMIT)
    );
    let hankel = HankelMatrix::build(&data, horizons).unwrap();
    assert!(gram_error(factor.lower(), hankel.stacked()) < 1e-13);
    let rank = factor.excitation(3).unwrap().stacked_rank;
    assert_eq!(rank, hankel.excitation(3).unwrap().stacked_rank);
}
