//! Order, lag and feedback on random systems with several inputs and outputs.

use crate::common;
use common::Lti;
use deepc_core::assessment::{
    Certainty, DataReport, FindingKind, OrderEstimate, ReportOptions, Severity,
};
use deepc_core::data::Dataset;
use deepc_core::hankel::{Horizons, block_hankel};
use faer::{Col, Mat};

fn report(data: &Dataset, largest_order: usize) -> DataReport {
    let options = ReportOptions::up_to_order(largest_order);
    DataReport::measure(data, Horizons::new(4, 6), &options).unwrap()
}

fn estimate(records: Vec<(Mat<f64>, Mat<f64>)>) -> OrderEstimate {
    report(&common::dataset(records), 8).order.unwrap()
}

/// Smallest depth at which the observability matrix has its full rank.
fn lag(system: &Lti) -> usize {
    let mut blocks: Vec<Mat<f64>> = Vec::new();
    let mut last = system.c.clone();
    for depth in 1.. {
        blocks.push(last.clone());
        last = &last * &system.a;
        let p = system.c.nrows();
        let stacked = Mat::from_fn(p * depth, system.order(), |i, j| blocks[i / p][(i % p, j)]);
        let s = stacked.singular_values().unwrap();
        if s.iter().filter(|&&v| v > 1e-9 * s[0]).count() == system.order() {
            return depth;
        }
        assert!(depth < 20);
    }
    unreachable!()
}

/// 40 dB: noise with a hundredth of each output's standard deviation.
fn with_noise(mut outputs: Mat<f64>, part: f64, seed: u64) -> Mat<f64> {
    let noise = common::gaussian(
        outputs.nrows(),
        outputs.ncols(),
        &mut common::rng(seed ^ 0x4d),
    );
    for i in 0..outputs.ncols() {
        let size = outputs.col(i).norm_l2() / (outputs.nrows() as f64).sqrt();
        for k in 0..outputs.nrows() {
            outputs[(k, i)] += part * size * noise[(k, i)];
        }
    }
    outputs
}

#[test]
fn order_and_lag_are_found_without_noise() {
    for n in 2..=6 {
        for (m, p) in [(2, 2), (2, 3), (3, 2)] {
            for seed in 0..6 {
                let system = Lti::random(n, m, p, 0.9, seed * 31 + n as u64);
                let found = estimate(vec![common::record(&system, 600, 0.0, seed)]);
                assert_eq!(
                    (found.order, found.lag),
                    (n, lag(&system)),
                    "n {n}, seed {seed}"
                );
                assert_eq!(found.certainty, Certainty::Sure);
            }
        }
    }
}

/// The same plant with one of its inputs measured and not decided.
#[test]
fn a_measured_disturbance_counts_as_an_input() {
    for seed in 0..6 {
        let system = Lti::random(3, 3, 2, 0.9, seed * 31 + 3);
        let (driven, outputs) = common::record(&system, 600, 0.0, seed);
        let (u, y) = (common::names("u", 2), common::names("y", 2));
        let mut data = Dataset::with_disturbances(0.1, u, ["d"], y).unwrap();
        data.push_record_with_disturbances(
            driven.subcols(0, 2).to_owned(),
            driven.subcols(2, 1).to_owned(),
            outputs,
        )
        .unwrap();
        let report = report(&data, 8);
        let found = report.order.unwrap();
        assert_eq!((found.order, found.lag), (3, lag(&system)), "seed {seed}");
        assert_eq!(report.channels.len(), 5);
        assert!(report.feedback.iter().all(|test| !test.feedback));
    }
}

#[test]
fn order_and_lag_are_found_at_40_decibels() {
    let (mut order, mut lags, mut all, mut sure_and_wrong) = (0, 0, 0, 0);
    for n in 2..=6 {
        for (m, p) in [(2, 2), (2, 3), (3, 2)] {
            for seed in 0..6 {
                let system = Lti::random(n, m, p, 0.9, seed * 31 + n as u64);
                let (u, y) = common::record(&system, 2000, 0.0, seed);
                let found = estimate(vec![(u, with_noise(y, 0.01, seed))]);
                all += 1;
                order += usize::from(found.order == n);
                lags += usize::from((found.order, found.lag) == (n, lag(&system)));
                // Noise may hide a weak state; it must not make one.
                assert!(found.order <= n, "n {n}, seed {seed}: {found:?}");
                sure_and_wrong +=
                    usize::from(found.order != n && found.certainty == Certainty::Sure);
            }
        }
    }
    println!("order {order}, order and lag {lags}, sure and wrong {sure_and_wrong} of {all}");
    assert!(order * 100 >= 95 * all, "{order} of {all}");
    assert!(lags * 100 >= 90 * all, "{lags} of {all}");
    // A state below the noise cannot be seen, nor that it is missing.
    assert!(sure_and_wrong * 100 <= 2 * all, "{sure_and_wrong} of {all}");
}

#[test]
fn the_ranks_are_those_of_the_stacked_hankel_matrix_less_the_inputs() {
    let system = Lti::random(5, 2, 2, 0.9, 4);
    let (u, y) = common::record(&system, 500, 0.0, 9);
    let found = estimate(vec![(u.clone(), y.clone())]);
    for rank in &found.ranks {
        let (hu, hy) = (
            block_hankel(&[u.as_ref()], rank.depth),
            block_hankel(&[y.as_ref()], rank.depth),
        );
        let stacked = Mat::from_fn(hu.nrows() + hy.nrows(), hu.ncols(), |i, j| {
            match i.checked_sub(hu.nrows()) {
                None => hu[(i, j)],
                Some(i) => hy[(i, j)],
            }
        });
        let s = stacked.singular_values().unwrap();
        let numerical = s.iter().filter(|&&v| v > 1e-10 * s[0]).count();
        assert_eq!(
            rank.order,
            numerical - 2 * rank.depth,
            "depth {}",
            rank.depth
        );
    }
}

#[test]
fn offsets_and_units_are_no_order() {
    let system = Lti::random(3, 2, 2, 0.9, 8);
    let (mut u, mut y) = common::record(&system, 800, 0.0, 2);
    for k in 0..800 {
        u[(k, 0)] += 40.0;
        u[(k, 1)] *= 1e6;
        y[(k, 1)] = 1e-5 * (y[(k, 1)] - 7.0);
    }
    let found = estimate(vec![(u, y)]);
    assert_eq!((found.order, found.lag), (3, lag(&system)));
}

#[test]
fn several_short_records_tell_what_one_long_one_does() {
    let system = Lti::random(4, 2, 2, 0.9, 5);
    let records = (0..10)
        .map(|seed| common::record(&system, 60, 0.0, seed))
        .collect();
    assert_eq!(estimate(records).order, 4);
}

#[test]
fn a_static_plant_has_order_zero() {
    let mut rng = common::rng(3);
    let u = common::gaussian(800, 2, &mut rng);
    let mut y = Mat::from_fn(800, 2, |k, i| u[(k, i)] - 2.0 * u[(k, 1 - i)]);
    y += faer::Scale(0.01) * common::gaussian(800, 2, &mut rng);
    let found = estimate(vec![(u, y)]);
    assert_eq!((found.order, found.lag), (0, 0));
}

#[test]
fn a_bound_below_the_order_and_a_past_below_the_lag_are_found() {
    let system = Lti::random(6, 2, 2, 0.9, 3);
    let data = common::dataset(vec![common::record(&system, 800, 0.0, 1)]);
    let low = report(&data, 3);
    assert_eq!(
        low.findings_of(FindingKind::OrderAboveBound).count(),
        1,
        "{low}"
    );
    let short = Horizons::new(1, 6);
    let short = DataReport::measure(&data, short, &ReportOptions::up_to_order(8)).unwrap();
    let finding = short.findings_of(FindingKind::PastTooShort).next().unwrap();
    assert_eq!((finding.found, finding.allowed), (1.0, lag(&system) as f64));
    let good = report(&data, 8);
    assert_eq!(good.findings_of(FindingKind::OrderAboveBound).count(), 0);
    assert_eq!(good.findings_of(FindingKind::PastTooShort).count(), 0);
}

/// u = −K y(t−1) + dither, y with process and measurement noise.
fn closed_loop(gain: f64, dither: f64, noise: f64, samples: usize, seed: u64) -> Dataset {
    let system = Lti {
        d: Mat::zeros(2, 2),
        ..Lti::random(3, 2, 2, 0.6, 12)
    };
    let size = system.c.norm_l2() * system.b.norm_l2();
    let mut rng = common::rng(seed);
    let shake = common::gaussian(samples, 2, &mut rng);
    let (process, measured) = (
        common::gaussian(samples, 3, &mut rng),
        common::gaussian(samples, 2, &mut rng),
    );
    let (mut u, mut y) = (Mat::zeros(samples, 2), Mat::<f64>::zeros(samples, 2));
    let mut x = Col::<f64>::zeros(3);
    for k in 0..samples {
        for i in 0..2 {
            let last = if k > 0 { y[(k - 1, i)] } else { 0.0 };
            u[(k, i)] = dither * shake[(k, i)] - gain / size * last;
        }
        let input = u.row(k).transpose().to_owned();
        x = &system.a * &x + &system.b * &input;
        for i in 0..3 {
            x[i] += noise * process[(k, i)];
        }
        let output = &system.c * &x;
        for i in 0..2 {
            y[(k, i)] = output[i] + noise * measured[(k, i)];
        }
    }
    common::dataset(vec![(u, y)])
}

#[test]
fn feedback_is_found() {
    for seed in 0..20 {
        let report = report(&closed_loop(0.3, 0.02, 0.3, 1000, seed), 4);
        let found: Vec<_> = report.findings_of(FindingKind::Feedback).collect();
        assert_eq!(found.len(), 2, "{report}");
        assert!(found.iter().all(|f| f.severity == Severity::Warning));
    }
}

/// A controller that acts at every fifth sample.
#[test]
fn feedback_of_held_inputs_is_found() {
    let system = Lti {
        d: Mat::zeros(2, 2),
        ..Lti::random(3, 2, 2, 0.6, 12)
    };
    let mut rng = common::rng(4);
    let (shake, noise) = (
        common::gaussian(2000, 2, &mut rng),
        common::gaussian(2000, 2, &mut rng),
    );
    let (mut u, mut y) = (Mat::<f64>::zeros(2000, 2), Mat::<f64>::zeros(2000, 2));
    let mut x = Col::<f64>::zeros(3);
    for k in 0..2000 {
        for i in 0..2 {
            u[(k, i)] = match k.checked_sub(1) {
                Some(last) if k % 5 == 0 => 0.02 * shake[(k, i)] - 0.05 * y[(last, i)],
                Some(last) => u[(last, i)],
                None => 0.0,
            };
        }
        x = &system.a * &x + &system.b * u.row(k).transpose().to_owned();
        let output = &system.c * &x;
        for i in 0..2 {
            y[(k, i)] = output[i] + 0.5 * noise[(k, i)];
        }
    }
    let report = report(&common::dataset(vec![(u, y)]), 4);
    assert_eq!(
        report.findings_of(FindingKind::Feedback).count(),
        2,
        "{report}"
    );
}

#[test]
fn inputs_without_feedback_raise_no_alarm() {
    let (mut white, mut significant, mut held) = (0, 0, 0);
    let runs = 300;
    for seed in 0..runs {
        let data = closed_loop(0.0, 1.0, 0.3, 400, seed);
        let options = ReportOptions::up_to_order(2);
        let measure = |data| DataReport::measure(data, Horizons::new(1, 1), &options).unwrap();
        let report = measure(&data);
        white += report.findings_of(FindingKind::Feedback).count();
        significant += report
            .feedback
            .iter()
            .filter(|t| t.p_value < Some(0.05))
            .count();
        if seed < 40 {
            // Random steps held for 5 samples: far from autoregressive, and new at few samples.
            let (u, _) = common::record(&Lti::random(3, 2, 2, 0.8, 1), 1000, 0.0, seed);
            let binary = seed % 2 == 0;
            let steps = Mat::from_fn(1000, 2, |k, i| {
                let value = u[(k / 5, i)];
                if binary { value.signum() } else { value }
            });
            let system = Lti::random(3, 2, 2, 0.8, 1);
            let y = system.simulate(&mut Col::zeros(3), &steps);
            let data = common::dataset(vec![(steps, with_noise(y, 0.1, seed))]);
            let report = measure(&data);
            held += report.findings_of(FindingKind::Feedback).count();
        }
    }
    println!(
        "white {white}, significant at 5 %: {significant} of {}, held {held}",
        2 * runs
    );
    assert_eq!((white, held), (0, 0));
    // The p value is one: 5 % of 600 are 30, with a standard deviation of 5.3.
    assert!(
        (14..=46).contains(&significant),
        "{significant} of {}",
        2 * runs
    );
}
