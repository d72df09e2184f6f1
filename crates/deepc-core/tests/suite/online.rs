//! Data that come in one sample at a time, against data that were there from the start.

use crate::common;
use common::Lti;
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons, PersistentlyExciting};
use deepc_core::predictor::{Memory, OnlineFactor, OnlineUpdate, Predictor, PredictorError};
use faer::{Mat, MatRef};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const M: usize = 2;
const Q: usize = 1;
const P: usize = 2;
const PAST: usize = 2;
const FUTURE: usize = 3;
const WINDOW: usize = PAST + FUTURE;
const ROWS: usize = (M + Q + P) * WINDOW;

fn signals(samples: usize, noise: f64, seed: u64) -> Mat<f64> {
    let system = Lti::random(3, M + Q, P, 0.9, seed);
    let (inputs, outputs) = common::record(&system, samples, noise, seed);
    Mat::from_fn(samples, M + Q + P, |k, i| match i.checked_sub(M + Q) {
        None => inputs[(k, i)] * [1.0, 1e3, 1e-2][i] + [0.0, 0.0, 0.3][i],
        Some(i) => outputs[(k, i)],
    })
}

/// One record per range of rows, the second number excluded.
fn dataset(all: &Mat<f64>, records: &[(usize, usize)]) -> Dataset {
    let names = common::names;
    let mut data =
        Dataset::with_disturbances(0.1, names("u", M), names("d", Q), names("y", P)).unwrap();
    for &(start, end) in records {
        let rows = all.subrows(start, end - start);
        data.push_record_with_disturbances(
            rows.subcols(0, M).to_owned(),
            rows.subcols(M, Q).to_owned(),
            rows.subcols(M + Q, P).to_owned(),
        )
        .unwrap();
    }
    data
}

fn built(data: &Dataset) -> HankelMatrix {
    HankelMatrix::build(data, Horizons::new(PAST, FUTURE)).unwrap()
}

fn exciting(data: &Dataset) -> PersistentlyExciting {
    built(data).assume_persistently_exciting()
}

fn push(online: &mut OnlineFactor, all: &Mat<f64>, k: usize) -> OnlineUpdate {
    let row: Vec<f64> = all.row(k).iter().copied().collect();
    let (inputs, others) = row.split_at(M);
    let (disturbances, outputs) = others.split_at(Q);
    online.push(inputs, disturbances, outputs)
}

/// Largest entry of the difference of two Gram matrices, rows scaled.
fn difference(found: MatRef<'_, f64>, expected: &Mat<f64>) -> f64 {
    let found = found * found.transpose();
    let mut largest = 0.0_f64;
    for i in 0..expected.nrows() {
        for j in 0..expected.ncols() {
            let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
            largest = largest.max((found[(i, j)] - expected[(i, j)]).abs() / size);
        }
    }
    largest
}

fn gram(h: MatRef<'_, f64>) -> Mat<f64> {
    h * h.transpose()
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24,
        rng_seed: RngSeed::Fixed(65),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// A record of 60 samples, then samples one by one with a gap before `gap`.
    #[test]
    fn updates_equal_a_rebuild(more in 1..=80_usize, gap in 0..=80_usize, seed in any::<u64>()) {
        let all = signals(60 + more, 0.1, seed);
        let gap = 60 + gap.min(more);
        let mut online = OnlineFactor::new(&exciting(&dataset(&all, &[(0, 60)])), Memory::Growing).unwrap();
        let mut missing = WINDOW;
        for k in 60..60 + more {
            if k == gap {
                online.lose_sample();
                missing = WINDOW;
            }
            missing = missing.saturating_sub(1);
            let expected = match missing {
                0 => OnlineUpdate::Added,
                missing => OnlineUpdate::Waiting { missing },
            };
            prop_assert_eq!(push(&mut online, &all, k), expected);
        }
        let mut expected = Mat::zeros(ROWS, ROWS);
        let mut columns = 0;
        for range in [(0, 60), (60, gap), (gap, 60 + more)] {
            if range.1 - range.0 >= WINDOW {
                let hankel = built(&dataset(&all, &[range]));
                expected += gram(hankel.stacked());
                columns += hankel.columns();
            }
        }
        let predictor = online.to_predictor();
        let error = difference(predictor.stacked(), &expected);
        prop_assert!(error < 1e-12, "{error:e}");
        prop_assert_eq!(predictor.reduction().columns_before, columns);
        prop_assert_eq!(online.rebuilds(), 0);
    }

    #[test]
    fn a_sliding_window_equals_a_rebuild(
        samples in ROWS + WINDOW..=3 * ROWS,
        more in 1..=200_usize,
        gap in 0..=200_usize,
        seed in any::<u64>(),
    ) {
        let first = 2 * ROWS;
        let total = first + more;
        let all = signals(total, 0.1, seed);
        let gap = first + gap.min(more);
        let memory = Memory::Sliding { samples };
        let mut online = OnlineFactor::new(&exciting(&dataset(&all, &[(0, first)])), memory).unwrap();
        for k in first..total {
            if k == gap {
                online.lose_sample();
            }
            push(&mut online, &all, k);
        }
        let start = total.saturating_sub(samples);
        let mut expected = Mat::zeros(ROWS, ROWS);
        let mut columns = 0;
        let (second, third) = (first.max(start), gap.max(start));
        for range in [(start, second), (second, third), (third, total)] {
            if range.1 - range.0 >= WINDOW {
                let hankel = built(&dataset(&all, &[range]));
                expected += gram(hankel.stacked());
                columns += hankel.columns();
            }
        }
        let predictor = online.to_predictor();
        prop_assert_eq!(predictor.reduction().columns_before, columns);
        let error = difference(predictor.stacked(), &expected);
        prop_assert!(error < 1e-11, "{error:e} after {} rebuilds", online.rebuilds());
    }

    #[test]
    fn forgetting_weighs_columns_by_their_age(
        more in 1..=60_usize,
        factor in 0.8..1.0_f64,
        seed in any::<u64>(),
    ) {
        let all = signals(60 + more, 0.1, seed);
        let data = dataset(&all, &[(0, 30), (30, 60)]);
        let mut online = OnlineFactor::new(&exciting(&data), Memory::Forgetting { factor }).unwrap();
        for k in 60..60 + more {
            push(&mut online, &all, k);
        }
        let mut ranges = vec![(0, 30), (30, 60)];
        if more >= WINDOW {
            ranges.push((60, 60 + more));
        }
        let hankel = built(&dataset(&all, &ranges));
        let h = hankel.stacked();
        let weights: Vec<f64> =
            (0..h.ncols()).map(|j| factor.powf((h.ncols() - 1 - j) as f64)).collect();
        let weighted = Mat::from_fn(h.nrows(), h.ncols(), |i, j| h[(i, j)] * weights[j].sqrt());
        let error = difference(online.to_predictor().stacked(), &gram(weighted.as_ref()));
        prop_assert!(error < 1e-12, "{error:e}");
        let columns: f64 = weights.iter().sum();
        prop_assert!((online.columns() - columns).abs() < 1e-9 * columns);
    }
}

/// The whole way round: what the program is built from is the same matrix, up to rotation, as if
/// all data had been there.
#[test]
fn the_predictor_of_updates_is_that_of_all_data() {
    let all = signals(200, 0.1, 7);
    let mut online =
        OnlineFactor::new(&exciting(&dataset(&all, &[(0, 80)])), Memory::Growing).unwrap();
    for k in 80..200 {
        push(&mut online, &all, k);
    }
    let predictor = online.to_predictor();
    let expected = Predictor::compact(&exciting(&dataset(&all, &[(0, 80), (80, 200)])));
    let normalised = |predictor: &Predictor| {
        let matrix = predictor.stacked();
        Mat::from_fn(ROWS, ROWS, |i, j| matrix[(i, j)] * matrix[(j, j)].signum())
    };
    let (found, expected) = (normalised(&predictor), normalised(&expected));
    for i in 0..ROWS {
        let error = (found.row(i) - expected.row(i)).norm_l2() / expected.row(i).norm_l2();
        assert!(error < 1e-10, "row {i}: {error:e}");
    }
    assert_eq!(predictor.disturbance_names(), ["d1"]);
}

/// Ten thousand samples through a short window: rounding stays where it is.
#[test]
fn a_sliding_window_does_not_drift() {
    let samples = 120;
    let total = 10_000;
    let all = signals(total, 0.05, 13);
    let memory = Memory::Sliding { samples };
    let mut online = OnlineFactor::new(&exciting(&dataset(&all, &[(0, 200)])), memory).unwrap();
    let mut rebuilt = 0;
    for k in 200..total {
        rebuilt += usize::from(push(&mut online, &all, k) == OnlineUpdate::Rebuilt);
    }
    assert_eq!(online.rebuilds(), rebuilt);
    assert!(rebuilt < 500, "{rebuilt} rebuilds");
    let expected = gram(built(&dataset(&all, &[(total - samples, total)])).stacked());
    let error = difference(online.to_predictor().stacked(), &expected);
    assert!(error < 1e-10, "{error:e}");
}

/// Without noise no downdate can be trusted; the window is right all the same.
#[test]
fn a_sliding_window_without_noise_is_rebuilt() {
    let all = signals(300, 0.0, 5);
    let samples = 60;
    let memory = Memory::Sliding { samples };
    let mut online = OnlineFactor::new(&exciting(&dataset(&all, &[(0, 100)])), memory).unwrap();
    for k in 100..300 {
        push(&mut online, &all, k);
    }
    // Every window that left, but for those that would have crossed the two records.
    assert_eq!(online.rebuilds(), 200 - (WINDOW - 1));
    let expected = gram(built(&dataset(&all, &[(240, 300)])).stacked());
    let error = difference(online.to_predictor().stacked(), &expected);
    assert!(error < 1e-13, "{error:e}");
}

#[test]
fn bad_samples_are_refused_and_begin_a_new_record() {
    let all = signals(120, 0.1, 3);
    let mut online =
        OnlineFactor::new(&exciting(&dataset(&all, &[(0, 100)])), Memory::Growing).unwrap();
    let before = online.columns();
    let nan = online.push(&[0.0, f64::NAN], &[0.0], &[0.0, 0.0]);
    assert_eq!(nan, OnlineUpdate::Refused);
    let short = online.push(&[0.0, 0.0], &[], &[0.0, 0.0]);
    assert_eq!(short, OnlineUpdate::Refused);
    let next = push(&mut online, &all, 100);
    let missing = WINDOW - 1;
    assert_eq!(next, OnlineUpdate::Waiting { missing });
    assert!((online.columns() - before).abs() < 1e-12);
    assert!(online.condition_guess().is_finite());
}

#[test]
fn settings_are_checked() {
    let data = exciting(&dataset(&signals(80, 0.1, 3), &[(0, 80)]));
    for factor in [0.0, -0.5, 1.01, f64::NAN] {
        let found = OnlineFactor::new(&data, Memory::Forgetting { factor });
        assert!(matches!(
            found,
            Err(PredictorError::ForgettingFactor { .. })
        ));
    }
    let samples = ROWS + WINDOW - 2;
    let found = OnlineFactor::new(&data, Memory::Sliding { samples });
    assert!(matches!(
        found,
        Err(PredictorError::SlidingWindow { needed, .. }) if needed == samples + 1
    ));
}
