//! Measured disturbances in data, Hankel matrices and excitation.

use crate::common;
use common::Lti;
use deepc_core::data::{CsvLayout, Dataset, OutputTiming};
use deepc_core::hankel::{Block, ExcitingRole, HankelError, HankelMatrix, Horizons, block_hankel};
use deepc_core::predictor::Predictor;
use faer::{Mat, mat};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Splits the first `m` columns from the rest.
fn split(signals: &Mat<f64>, m: usize) -> (Mat<f64>, Mat<f64>) {
    let others = signals.ncols() - m;
    (
        signals.subcols(0, m).to_owned(),
        signals.subcols(m, others).to_owned(),
    )
}

/// A system with m + q inputs of which the last q are disturbances.
fn recorded(system: &Lti, m: usize, lengths: &[usize], seed: u64) -> Dataset {
    let q = system.b.ncols() - m;
    let p = system.c.nrows();
    let names = common::names;
    let mut data =
        Dataset::with_disturbances(0.1, names("u", m), names("d", q), names("y", p)).unwrap();
    for (i, &samples) in lengths.iter().enumerate() {
        let (signals, outputs) = common::record(system, samples, 0.0, seed ^ (i as u64 + 1));
        let (inputs, disturbances) = split(&signals, m);
        data.push_record_with_disturbances(inputs, disturbances, outputs)
            .unwrap();
    }
    data
}

#[test]
fn files_keep_disturbances_and_their_timing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.csv");
    let data = recorded(&Lti::random(2, 3, 2, 0.9, 1), 2, &[30], 5);
    data.write_csv(1, &file, "t").unwrap();
    let mut layout = CsvLayout {
        time: Some("t".into()),
        inputs: common::names("u", 2),
        disturbances: common::names("d", 1),
        outputs: common::names("y", 2),
        outputs_measured: OutputTiming::EndOfInterval,
        sample_time_s: 0.1,
    };
    let record = &data.records()[0];
    let back = Dataset::read_csv(&layout, &[&file]).unwrap();
    assert_eq!(back.disturbance_names(), ["d1"]);
    assert_eq!(back.records()[0].inputs(), record.inputs());
    assert_eq!(back.records()[0].disturbances(), record.disturbances());
    assert_eq!(back.records()[0].outputs(), record.outputs());

    // A disturbance acts over the interval of the input in its row, not of the output.
    layout.outputs_measured = OutputTiming::StartOfInterval;
    let shifted = Dataset::read_csv(&layout, &[&file]).unwrap();
    let shifted = &shifted.records()[0];
    assert_eq!(shifted.samples(), 29);
    assert_eq!(shifted.inputs(), record.inputs().subrows(0, 29));
    assert_eq!(shifted.disturbances(), record.disturbances().subrows(0, 29));
    assert_eq!(shifted.outputs(), record.outputs().subrows(1, 29));
}

#[test]
fn a_layout_without_disturbances_has_none() {
    let text = r#"{"time": "t", "inputs": ["u"], "outputs": ["y"],
        "outputs_measured": "end_of_interval", "sample_time_s": 0.1}"#;
    let layout: CsvLayout = serde_json::from_str(text).unwrap();
    assert!(layout.disturbances.is_empty());
}

#[test]
fn wrong_disturbances_are_reported_by_name_and_count() {
    let says = |result: Result<(), deepc_core::data::DataError>, part: &str| {
        let message = result.unwrap_err().to_string();
        assert!(message.contains(part), "`{part}` is not in: {message}");
    };
    let mut data = Dataset::with_disturbances(0.1, ["u"], ["wind", "load"], ["y"]).unwrap();
    let zeros = |rows, columns| Mat::<f64>::zeros(rows, columns);
    says(
        data.push_record(zeros(4, 1), zeros(4, 1)),
        "record 1 has 0 disturbance columns, expected 2",
    );
    says(
        data.push_rows(&[0.0; 4], &[0.0; 4]),
        "record 1 has 0 disturbance columns, expected 2",
    );
    says(
        data.push_record_with_disturbances(zeros(4, 1), zeros(3, 2), zeros(4, 1)),
        "4 input samples and 3 disturbance samples",
    );
    let bad = mat![[0.0, 0.0], [0.0, f64::NAN]];
    says(
        data.push_record_with_disturbances(zeros(2, 1), bad, zeros(2, 1)),
        "channel `load` is NaN at sample 1 of record 1",
    );
    assert!(data.records().is_empty());
    let twice = Dataset::with_disturbances(0.1, ["u"], ["u"], ["y"]);
    says(twice.map(|_| ()), "`u` is used twice");
    let unnamed = Dataset::with_disturbances(0.1, ["u"], ["d", " "], ["y"]);
    says(unnamed.map(|_| ()), "disturbance channel 1");
    let other = Dataset::with_disturbances(0.1, ["u"], ["wind"], ["y"]).unwrap();
    says(data.append(other), "disturbance channels differ");
}

#[test]
fn blocks_are_hankel_matrices_of_their_signals() {
    let data = recorded(&Lti::random(2, 4, 3, 0.9, 3), 2, &[20, 15], 9);
    let (past, future) = (3, 4);
    let hankel = HankelMatrix::build(&data, Horizons { past, future }).unwrap();
    let shape = hankel.shape();
    assert_eq!((shape.rows(), shape.known_rows()), (7 * 7, 7 * 3 + 2 * 4));
    let blocks = hankel.blocks();
    let records = data.records();
    let whole = |of: fn(&deepc_core::data::Record) -> faer::MatRef<'_, f64>| {
        let all: Vec<_> = records.iter().map(of).collect();
        block_hankel(&all, past + future)
    };
    let inputs = whole(deepc_core::data::Record::inputs);
    let disturbances = whole(deepc_core::data::Record::disturbances);
    let outputs = whole(deepc_core::data::Record::outputs);
    assert_eq!(blocks.past_inputs, inputs.subrows(0, 2 * past));
    assert_eq!(blocks.future_inputs, inputs.subrows(2 * past, 2 * future));
    assert_eq!(blocks.past_disturbances, disturbances.subrows(0, 2 * past));
    assert_eq!(
        blocks.future_disturbances,
        disturbances.subrows(2 * past, 2 * future)
    );
    assert_eq!(blocks.past_outputs, outputs.subrows(0, 3 * past));
    assert_eq!(blocks.future_outputs, outputs.subrows(3 * past, 3 * future));

    let exciting = hankel.assume_persistently_exciting();
    let predictor = Predictor::full(&exciting);
    assert_eq!(predictor.disturbance_names(), ["d1", "d2"]);
    assert_eq!(
        predictor.blocks().future_disturbances,
        disturbances.subrows(2 * past, 2 * future)
    );
    let rows = shape.rows_of(Block::FutureDisturbances);
    assert_eq!(rows.end, shape.known_rows());
    let lost = Predictor::exact(&exciting).unwrap();
    assert_eq!(lost.reduction().channel_energy_lost.len(), 7);
    assert_eq!(lost.reduction().channel_energy_lost[2].0, "d1");
}

#[test]
fn a_disturbance_that_rests_is_reported_with_what_to_record() {
    let system = Lti::random(2, 3, 2, 0.9, 3);
    let (signals, _) = common::record(&system, 120, 0.0, 4);
    let (inputs, mut disturbances) = split(&signals, 2);
    disturbances.col_mut(0).fill(7.0);
    let outputs = Mat::from_fn(120, 2, |k, i| inputs[(k, i)] + (k as f64).sin());
    let mut data =
        Dataset::with_disturbances(0.1, ["valve", "heater"], ["load"], ["level", "flow"]).unwrap();
    data.push_record_with_disturbances(inputs, disturbances, outputs)
        .unwrap();
    let hankel = HankelMatrix::build(&data, Horizons::new(3, 4)).unwrap();
    let report = hankel.excitation(2).unwrap();
    assert_eq!(report.input_rank_needed, 3 * 9);
    assert_eq!(report.samples_needed, 4 * 9 - 1);
    assert_eq!(report.input_channels[2].role, ExcitingRole::Disturbance);
    assert_eq!(report.input_channels[2].constant, Some(7.0));
    assert!(
        report
            .to_string()
            .contains("disturbance `load` is constant")
    );
    let error = hankel.require_persistently_exciting(2).unwrap_err();
    let message = error.to_string();
    for part in [
        "channel `load` is constant at 7",
        "record while `load` varies by itself",
        "at least 35 samples",
    ] {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    assert!(!message.contains("noise"), "{message}");
}

#[test]
fn sample_bounds_count_disturbances() {
    let data = recorded(&Lti::random(3, 3, 2, 0.9, 3), 2, &[34], 2);
    let hankel = HankelMatrix::build(&data, Horizons::new(3, 3)).unwrap();
    let error = hankel.require_persistently_exciting(3).unwrap_err();
    assert!(matches!(
        &error,
        HankelError::TooFewSamples(report)
            if (report.samples, report.samples_needed) == (34, 35)
    ));
    let message = error.to_string();
    assert!(
        message.contains("2 input(s), 1 measured disturbance(s)"),
        "{message}"
    );
    assert!(error.to_string().contains("(m+q+1)(L+n) − 1"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 32,
        rng_seed: RngSeed::Fixed(45),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// The fundamental lemma with (u, d) as the input, in both directions.
    #[test]
    fn exciting_inputs_and_disturbances_give_rank_mq_l_plus_n(
        n in 1..=4_usize,
        m in 2..=3_usize,
        q in 1..=2_usize,
        p in 2..=3_usize,
        extra in 0..=3_usize,
        seed in any::<u64>(),
    ) {
        let window = n.max(2) + extra;
        let system = Lti::random(n, m + q, p, 0.9, seed);
        let needed = (m + q + 1) * (window + n) - 1;
        let horizons = Horizons::new(1, window - 1);
        let measure = |lengths: &[usize]| {
            let data = recorded(&system, m, lengths, seed);
            HankelMatrix::build(&data, horizons).unwrap().excitation(n).unwrap()
        };
        let report = measure(&[needed]);
        prop_assert_eq!(report.samples_needed, needed);
        prop_assert!(report.is_persistently_exciting(), "{}", report);
        prop_assert_eq!(report.stacked_rank, (m + q) * window + n, "{}", report);
        prop_assert_eq!(report.stacked_rank_without_noise, (m + q) * window + n);
        let short = measure(&[needed - 1]);
        prop_assert!(!short.is_persistently_exciting());

        // Several records, each too short by itself.
        let depth = window + n;
        let records = vec![2 * depth - 1; 2 * (m + q)];
        let together = measure(&records);
        prop_assert!(together.is_persistently_exciting(), "{}", together);
        prop_assert_eq!(together.stacked_rank, (m + q) * window + n);
    }

    /// A disturbance that copies an input hides which of them moved the plant.
    #[test]
    fn a_disturbance_that_copies_an_input_does_not_excite(seed in any::<u64>()) {
        let (n, window) = (2, 4);
        let system = Lti::random(n, 3, 2, 0.9, seed);
        let (mut signals, _) = common::record(&system, 100, 0.0, seed);
        for k in 0..signals.nrows() {
            signals[(k, 2)] = -0.5 * signals[(k, 1)];
        }
        let outputs = system.simulate(&mut faer::Col::zeros(n), &signals);
        let (inputs, disturbances) = split(&signals, 2);
        let mut data = Dataset::with_disturbances(
            0.1,
            common::names("u", 2),
            ["d"],
            common::names("y", 2),
        )
        .unwrap();
        data.push_record_with_disturbances(inputs, disturbances, outputs).unwrap();
        let hankel = HankelMatrix::build(&data, Horizons::new(2, window - 2)).unwrap();
        let report = hankel.excitation(n).unwrap();
        prop_assert!(!report.is_persistently_exciting());
        prop_assert_eq!(report.input_rank, 2 * (window + n));
        prop_assert!(report.stacked_rank < 3 * window + n);
        let message = hankel.require_persistently_exciting(n).unwrap_err().to_string();
        prop_assert!(message.contains("move together"), "{}", message);
        prop_assert!(message.contains("record while `d` varies by itself"), "{}", message);
    }
}
