//! Page matrices, selected columns and scheduled data sets.

use crate::common;
use common::Lti;
use deepc_core::data::Dataset;
use deepc_core::hankel::{
    Arrangement, HankelError, HankelMatrix, Horizons, PastWindow, PersistentlyExciting, stack,
};
use deepc_core::predictor::{Predictor, PredictorError, Schedule, ScheduledPredictors};
use faer::Mat;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(1982),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Records of a system with m inputs, q disturbances and white noise in all of them.
fn recorded(system: &Lti, m: usize, lengths: &[usize], noise: f64, seed: u64) -> Dataset {
    let q = system.b.ncols() - m;
    let names = common::names;
    let (u, d, y) = (names("u", m), names("d", q), names("y", system.c.nrows()));
    let mut data = Dataset::with_disturbances(0.1, u, d, y).unwrap();
    for (i, &samples) in lengths.iter().enumerate() {
        let (signals, outputs) = common::record(system, samples, noise, seed ^ (i as u64 + 1));
        data.push_record_with_disturbances(
            signals.subcols(0, m).to_owned(),
            signals.subcols(m, q).to_owned(),
            outputs,
        )
        .unwrap();
    }
    data
}

#[test]
fn page_columns_do_not_overlap_and_cross_no_record() {
    let data = recorded(&Lti::random(2, 3, 2, 0.9, 1), 2, &[23, 17], 0.1, 4);
    let horizons = Horizons::new(2, 3);
    let page = HankelMatrix::build_page(&data, horizons).unwrap();
    let hankel = HankelMatrix::build(&data, horizons).unwrap();
    assert_eq!(page.arrangement(), Arrangement::Page);
    assert_eq!(page.columns(), 4 + 3);
    let origins: Vec<_> = (0..8).map_while(|j| page.origin(j)).collect();
    let expected = [(1, 0), (1, 5), (1, 10), (1, 15), (2, 0), (2, 5), (2, 10)];
    assert_eq!(origins, expected);
    for (j, origin) in expected.into_iter().enumerate() {
        let same = (0..hankel.columns()).find(|&i| hankel.origin(i) == Some(origin));
        assert_eq!(page.stacked().col(j), hankel.stacked().col(same.unwrap()));
    }
    let predictor = Predictor::full(&page.assume_persistently_exciting());
    assert_eq!(predictor.reduction().columns_before, 7);
}

proptest! {
    #![proptest_config(config(24))]

    /// Coulson, Lygeros, Dörfler 2022: L-Page excitation of order n + 1 gives a Page
    /// matrix that spans all trajectories; the sample bound is tight.
    #[test]
    fn page_excitation_spans_all_trajectories(
        n in 1..=2_usize,
        q in 0..=1_usize,
        past in 1..=2_usize,
        seed in any::<u64>(),
    ) {
        let (m, p) = (2, 2);
        let window = past + 2;
        let horizons = Horizons::new(past, 2);
        let system = Lti::random(n, m + q, p, 0.9, seed);
        let needed = window * (((m + q) * window + 1) * (n + 1) - 1);
        let data = recorded(&system, m, &[needed], 0.0, seed);
        let page = HankelMatrix::build_page(&data, horizons).unwrap();
        let report = page.excitation(n).unwrap();
        prop_assert_eq!(report.samples_needed, needed);
        prop_assert_eq!(report.columns, report.columns_needed);
        prop_assert_eq!(report.order, window * (n + 1));
        prop_assert!(report.is_persistently_exciting(), "{}", report);
        prop_assert_eq!(report.stacked_rank, (m + q) * window + n, "{}", report);

        let short = recorded(&system, m, &[needed - 1], 0.0, seed);
        let error = HankelMatrix::build_page(&short, horizons)
            .unwrap()
            .require_persistently_exciting(n)
            .unwrap_err();
        let message = error.to_string();
        prop_assert!(matches!(error, HankelError::TooFewSamples(_)));
        prop_assert!(message.contains("L+1)(n+1) − 1)"), "{}", message);
        let needed = format!("at least {needed}");
        prop_assert!(message.contains(&needed), "{}", message);
    }

    /// The columns selected are the nearest, by brute force.
    #[test]
    fn selection_takes_the_nearest_columns(count in 1..=40_usize, seed in any::<u64>()) {
        let (past, m, q) = (3, 2, 1);
        let data = recorded(&Lti::random(2, m + q, 2, 0.9, seed), m, &[40, 30], 0.1, seed);
        let hankel = HankelMatrix::build(&data, Horizons::new(past, 4)).unwrap();
        // The past of column 11, moved a little: that column comes out nearest.
        let (record, start) = hankel.origin(11).unwrap();
        let record = &data.records()[record - 1];
        let inputs = record.inputs().subrows(start, past).to_owned() * faer::Scale(1.0 + 1e-9);
        let query = PastWindow {
            inputs: inputs.as_ref(),
            disturbances: record.disturbances().subrows(start, past),
            outputs: record.outputs().subrows(start, past),
        };
        let selection = hankel.select_columns(&query, count).unwrap();
        prop_assert_eq!(selection.columns.len(), count);
        prop_assert!(selection.columns.contains(&11));
        prop_assert!(selection.columns.is_sorted());
        prop_assert_eq!(selection.hankel.columns(), count);
        prop_assert_eq!(selection.hankel.arrangement(), Arrangement::Selection);
        let farthest = selection.distances.iter().copied().fold(0.0, f64::max);
        let deviations = deviations(&data);
        let stacked_query = [
            stack(query.inputs),
            stack(query.disturbances),
            stack(query.outputs),
        ]
        .concat();
        let channel = |row: usize| match row {
            0..=5 => row % 2,
            6..=8 => 2,
            _ => 3 + (row - 9) % 2,
        };
        for j in 0..hankel.columns() {
            let blocks = hankel.blocks();
            let past_rows = [blocks.past_inputs, blocks.past_disturbances, blocks.past_outputs];
            let column = past_rows.iter().flat_map(|block| block.col(j).iter());
            let squares = column.zip(&stacked_query).enumerate().map(|(row, (value, query))| {
                ((value - query) / deviations[channel(row)]).powi(2)
            });
            let distance = (squares.sum::<f64>() / 15.0).sqrt();
            match selection.columns.iter().position(|&c| c == j) {
                Some(place) => {
                    let found = selection.distances[place];
                    prop_assert!((found - distance).abs() < 1e-12 * (1.0 + distance));
                    prop_assert_eq!(selection.hankel.stacked().col(place), hankel.stacked().col(j));
                    prop_assert_eq!(selection.hankel.origin(place), hankel.origin(j));
                }
                None => prop_assert!(distance >= farthest - 1e-12),
            }
        }
    }
}

fn deviations(data: &Dataset) -> Vec<f64> {
    let series: Vec<Vec<f64>> = (0..5)
        .map(|channel| {
            let records = data.records().iter();
            let values = records.flat_map(|record| {
                let series = match channel {
                    0 | 1 => record.inputs().col(channel),
                    2 => record.disturbances().col(0),
                    _ => record.outputs().col(channel - 3),
                };
                series.iter().copied().collect::<Vec<_>>()
            });
            values.collect()
        })
        .collect();
    let deviation = |values: &Vec<f64>| {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
    };
    series.iter().map(deviation).collect()
}

#[test]
fn excitation_of_selected_columns_is_measured() {
    let (n, m, window) = (2, 3, 6);
    let data = recorded(&Lti::random(n, m, 2, 0.9, 6), 2, &[400], 0.0, 9);
    let hankel = HankelMatrix::build(&data, Horizons::new(2, 4)).unwrap();
    let record = &data.records()[0];
    let query = PastWindow {
        inputs: record.inputs().subrows(50, 2),
        disturbances: record.disturbances().subrows(50, 2),
        outputs: record.outputs().subrows(50, 2),
    };
    let many = hankel.select_columns(&query, 60).unwrap().hankel;
    let report = many.excitation(n).unwrap();
    assert_eq!((report.order, report.input_rank), (window, m * window));
    assert!(report.is_persistently_exciting(), "{report}");
    assert_eq!(report.stacked_rank, m * window + n);
    let few = hankel.select_columns(&query, m * window + n - 1).unwrap();
    let error = few.hankel.require_persistently_exciting(n).unwrap_err();
    assert!(matches!(error, HankelError::TooFewSamples(_)), "{error}");
}

#[test]
fn bad_queries_are_reported() {
    let data = recorded(&Lti::random(2, 3, 2, 0.9, 6), 2, &[40], 0.0, 9);
    let hankel = HankelMatrix::build(&data, Horizons::new(2, 4)).unwrap();
    let (inputs, disturbances, mut outputs) = (
        Mat::<f64>::zeros(2, 2),
        Mat::<f64>::zeros(2, 1),
        Mat::<f64>::zeros(2, 2),
    );
    let query = PastWindow {
        inputs: inputs.as_ref(),
        disturbances: disturbances.as_ref(),
        outputs: outputs.as_ref(),
    };
    for count in [0, 36] {
        let message = hankel
            .select_columns(&query, count)
            .unwrap_err()
            .to_string();
        assert!(message.contains("1 to 35"), "{message}");
    }
    let wrong = PastWindow {
        disturbances: outputs.as_ref(),
        ..query
    };
    let message = hankel.select_columns(&wrong, 5).unwrap_err().to_string();
    assert!(
        message.contains("the past of the disturbances of the query is 2×2, expected 2×1"),
        "{message}"
    );
    outputs[(1, 0)] = f64::NAN;
    let query = PastWindow {
        inputs: inputs.as_ref(),
        disturbances: disturbances.as_ref(),
        outputs: outputs.as_ref(),
    };
    let message = hankel.select_columns(&query, 5).unwrap_err().to_string();
    assert!(message.contains("NaN at sample 1, channel 0"), "{message}");
}

fn schedule() -> Schedule {
    Schedule {
        signal: "d1".into(),
        edges: vec![0.0, 1.0],
        hysteresis: 0.1,
    }
}

/// A disturbance that walks through the ranges; values say which sample they are.
fn walking() -> Dataset {
    let signal = [-1.0, -0.5, 0.05, 0.2, 0.5, 1.05, 1.2, 2.0, 2.0, 0.95, 0.5];
    let samples = signal.len();
    let mut data = Dataset::with_disturbances(0.1, ["u1"], ["d1"], ["y1"]).unwrap();
    data.push_record_with_disturbances(
        Mat::from_fn(samples, 1, |k, _| k as f64),
        Mat::from_fn(samples, 1, |k, _| signal[k]),
        Mat::from_fn(samples, 1, |k, _| 100.0 + k as f64),
    )
    .unwrap();
    data
}

#[test]
fn a_data_set_is_parted_where_it_leaves_a_range() {
    let parts = schedule().part(&walking(), 2).unwrap();
    let first_inputs = |part: &Dataset| -> Vec<(f64, usize)> {
        let records = part.records().iter();
        records.map(|r| (r.inputs()[(0, 0)], r.samples())).collect()
    };
    let found: Vec<_> = parts.iter().map(first_inputs).collect();
    let expected = [vec![(0.0, 3)], vec![(2.0, 4), (9.0, 2)], vec![(5.0, 5)]];
    assert_eq!(found, expected);
    assert_eq!(
        parts[1].records()[1].outputs(),
        faer::mat![[109.0], [110.0]]
    );
    let longer = schedule().part(&walking(), 5).unwrap();
    assert!(longer[0].records().is_empty() && longer[1].records().is_empty());
    assert_eq!(longer[2].records().len(), 1);
    let mut unknown = schedule();
    unknown.signal = "speed".into();
    let message = unknown.part(&walking(), 2).unwrap_err().to_string();
    assert!(
        message.contains("`speed`") && message.contains("d1"),
        "{message}"
    );
}

#[test]
fn predictors_of_a_schedule_fit_together() {
    let predictor = |m: usize, future: usize| {
        let data = recorded(&Lti::random(2, 3, 2, 0.9, 6), m, &[80], 0.1, 9);
        let hankel = HankelMatrix::build(&data, Horizons::new(2, future)).unwrap();
        let exciting: PersistentlyExciting = hankel.assume_persistently_exciting();
        Predictor::compact(&exciting)
    };
    let three = vec![predictor(2, 4), predictor(2, 4), predictor(2, 4)];
    let scheduled = ScheduledPredictors::new(schedule(), three).unwrap();
    assert_eq!(scheduled.predictors().len(), scheduled.schedule().ranges());
    let two = vec![predictor(2, 4), predictor(2, 4)];
    let error = ScheduledPredictors::new(schedule(), two).unwrap_err();
    assert!(error.to_string().contains("2 predictor(s) for 3 range(s)"));
    let horizons = vec![predictor(2, 4), predictor(2, 4), predictor(2, 5)];
    let error = ScheduledPredictors::new(schedule(), horizons).unwrap_err();
    assert!(
        matches!(
            error,
            PredictorError::RangesDiffer {
                range: 2,
                what: "sizes"
            }
        ),
        "{error}"
    );
}
