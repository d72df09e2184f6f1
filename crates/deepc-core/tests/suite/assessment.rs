//! The data report: every finding on data that have the fault, none on data that have not.

use crate::common;
use common::Lti;
use deepc_core::assessment::{
    DataReport, FindingKind, Repetition, ReportOptions, Role, SampleRange, Severity, screen,
};
use deepc_core::data::Dataset;
use deepc_core::hankel::Horizons;
use faer::{Col, Mat, mat};

const HORIZONS: Horizons = Horizons { past: 4, future: 8 };
const SAMPLES: usize = 800;

fn system() -> Lti {
    Lti::random(4, 2, 2, 0.9, 21)
}

fn clean(seed: u64) -> (Mat<f64>, Mat<f64>) {
    common::record(&system(), SAMPLES, 0.05, seed)
}

fn report(records: Vec<(Mat<f64>, Mat<f64>)>) -> DataReport {
    report_of(&common::dataset(records))
}

fn report_of(data: &Dataset) -> DataReport {
    DataReport::measure(data, HORIZONS, &ReportOptions::up_to_order(6)).unwrap()
}

fn kinds(report: &DataReport) -> Vec<FindingKind> {
    report.findings.iter().map(|finding| finding.kind).collect()
}

#[test]
fn clean_data_give_no_finding() {
    for seed in 0..20 {
        let report = report(vec![clean(seed)]);
        assert!(report.findings.is_empty(), "{report}");
        assert_eq!(report.worst(), None);
        assert_eq!(report.order.unwrap().order, 4);
    }
}

#[test]
fn binary_held_and_smooth_signals_give_no_channel_finding() {
    let channel_kinds = [
        FindingKind::Saturated,
        FindingKind::Quantised,
        FindingKind::Spikes,
        FindingKind::Constant,
        FindingKind::Repeated,
    ];
    let (noise, _) = clean(3);
    let binary = Mat::from_fn(SAMPLES, 2, |k, i| noise[(k, i)].signum());
    let held = Mat::from_fn(SAMPLES, 2, |k, i| noise[(k / 10 + 100 * i, i)].signum());
    let sines = Mat::from_fn(SAMPLES, 2, |k, i| {
        let t = k as f64 * (1.0 + i as f64);
        (0.01 * t).sin() + (0.13 * t).sin() + (1.7 * t).cos()
    });
    let slow = Lti {
        a: mat![[0.99, 0.1], [-0.1, 0.99]],
        b: mat![[0.1, 0.0], [0.0, 0.05]],
        c: mat![[1.0, 0.0], [0.0, 1.0]],
        d: Mat::zeros(2, 2),
    };
    for inputs in [binary, held, sines] {
        for system in [&system(), &slow] {
            let outputs = system.simulate(&mut Col::zeros(system.order()), &inputs);
            let report = report(vec![(inputs.clone(), outputs)]);
            let found = kinds(&report);
            assert!(
                !found.iter().any(|kind| channel_kinds.contains(kind)),
                "{report}"
            );
        }
    }
}

/// `spoil` clean data; the finding must name the channel.
fn expect(
    kind: FindingKind,
    severity: Severity,
    channels: &[&str],
    spoil: impl Fn(&mut Mat<f64>, &mut Mat<f64>),
) {
    let (mut inputs, mut outputs) = clean(1);
    spoil(&mut inputs, &mut outputs);
    let report = report(vec![(inputs, outputs)]);
    let finding = report.findings_of(kind).next();
    let finding = finding.unwrap_or_else(|| panic!("no {kind:?}: {report}"));
    assert_eq!(finding.severity, severity);
    assert_eq!(finding.channels, channels, "{report}");
    assert!(report.to_string().contains(&finding.message));
    assert!(finding.found.is_finite() && finding.allowed.is_finite());
    assert!(!finding.remedy.is_empty());
}

#[test]
fn every_fault_is_found_and_named() {
    use FindingKind as K;
    use Severity::{Error, Warning};
    expect(K::Constant, Error, &["u2"], |u, _| u.col_mut(1).fill(7.0));
    expect(K::NotExciting, Error, &["u2"], |u, _| {
        u.col_mut(1).fill(7.0);
    });
    expect(K::Constant, Warning, &["y1"], |_, y| y.col_mut(0).fill(0.1));
    expect(K::Saturated, Warning, &["y2"], |_, y| {
        y.col_mut(1).iter_mut().for_each(|v| *v = v.min(0.5));
    });
    expect(K::Quantised, Warning, &["y1"], |_, y| {
        let size = y.col(0).norm_max();
        y.col_mut(0)
            .iter_mut()
            .for_each(|v| *v = (*v / size * 6.0).round() * size / 6.0);
    });
    expect(K::Spikes, Warning, &["y1"], |_, y| {
        let size = y.col(0).norm_max();
        y[(100, 0)] += 5.0 * size;
        y[(400, 0)] -= 5.0 * size;
    });
    expect(K::Offset, Warning, &["y2"], |_, y| {
        let size = y.col(1).norm_max();
        y.col_mut(1).iter_mut().for_each(|v| *v += 100.0 * size);
    });
    expect(K::WeakExcitation, Warning, &[], |u, _| {
        u.col_mut(0).iter_mut().for_each(|v| *v += 1e5);
    });
    expect(K::Scaling, Warning, &["y1", "u1"], |u, y| {
        u.col_mut(0).iter_mut().for_each(|v| *v *= 1e4);
        y.col_mut(0).iter_mut().for_each(|v| *v *= 1e-4);
    });
    expect(K::Repeated, Error, &["u1", "u2"], |u, _| {
        for k in 0..u.nrows() {
            u[(k, 1)] = -3.0 * u[(k, 0)];
        }
    });
    expect(K::Repeated, Warning, &["y1", "y2"], |_, y| {
        for k in 0..y.nrows() {
            y[(k, 1)] = 2.0 * y[(k, 0)] + 1.0;
        }
    });
    expect(K::Repeated, Warning, &["u1", "y1"], |u, y| {
        for k in 0..y.nrows() {
            y[(k, 0)] = u[(k, 0)];
        }
    });
    // Outputs that have nothing to do with the inputs.
    expect(K::PoorPrediction, Error, &["y1"], |_, y| {
        let noise = common::gaussian(y.nrows(), 1, &mut common::rng(99));
        for k in 0..y.nrows() {
            y[(k, 0)] = noise[(k, 0)];
        }
    });
}

#[test]
fn repetitions_are_told_apart() {
    let (mut inputs, mut outputs) = clean(1);
    for k in 0..SAMPLES {
        inputs[(k, 1)] = inputs[(k, 0)];
        outputs[(k, 0)] = -1e-3 * inputs[(k, 0)];
        outputs[(k, 1)] = 5.0 + inputs[(k, 0)];
    }
    let report = report(vec![(inputs, outputs)]);
    let found: Vec<_> = report
        .repeated
        .iter()
        .map(|pair| {
            (
                pair.first.0.as_str(),
                pair.second.0.as_str(),
                pair.repetition,
            )
        })
        .collect();
    assert_eq!(found.len(), 6);
    assert_eq!(found[0], ("u1", "u2", Repetition::Equal));
    assert_eq!(found[1], ("u1", "y1", Repetition::Proportional));
    assert_eq!(found[2], ("u1", "y2", Repetition::Correlated));
}

#[test]
fn short_recordings_are_reported_and_do_not_fail() {
    let (inputs, outputs) = clean(1);
    let cut = |samples| {
        let part = |series: &Mat<f64>| series.subrows(0, samples).to_owned();
        report(vec![(part(&inputs), part(&outputs))])
    };
    let tiny = cut(5);
    assert!(
        kinds(&tiny).contains(&FindingKind::RecordTooShort),
        "{tiny}"
    );
    assert!(tiny.excitation.is_none() && tiny.prediction.is_none() && tiny.order.is_none());
    let short = cut(40);
    let finding = short
        .findings_of(FindingKind::TooFewSamples)
        .next()
        .unwrap();
    assert!(finding.remedy.contains("53 samples"), "{short}");
    assert!(
        kinds(&short).contains(&FindingKind::NoPrediction),
        "{short}"
    );
    assert!(kinds(&cut(1)).contains(&FindingKind::RecordTooShort));
}

#[test]
fn a_report_survives_json() {
    let (mut inputs, mut outputs) = clean(1);
    inputs.col_mut(1).fill(7.0);
    outputs[(100, 0)] += 1e3;
    for report in [report(vec![clean(2)]), report(vec![(inputs, outputs)])] {
        let value = serde_json::to_value(&report).unwrap();
        assert_eq!(serde_json::from_value::<DataReport>(value).unwrap(), report);
        let text = serde_json::to_string(&report).unwrap();
        let read: DataReport = serde_json::from_str(&text).unwrap();
        assert_eq!(read.findings.len(), report.findings.len());
        assert_eq!(read.to_string(), report.to_string());
    }
}

#[test]
fn the_text_fits_a_terminal_and_says_the_main_things() {
    let text = report(vec![clean(2)]).to_string();
    println!("{text}");
    assert!(
        text.lines().all(|line| line.chars().count() <= 100),
        "{text}"
    );
    for words in [
        "EXCITES yes",
        "ORDER   4, lag 2",
        "y2",
        "HOLD-OUT",
        "FINDINGS none",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn a_report_needs_horizons_and_records() {
    let data = common::dataset(vec![clean(1)]);
    let options = ReportOptions::up_to_order(4);
    assert!(DataReport::measure(&data, Horizons::new(0, 3), &options).is_err());
    let empty = Dataset::new(0.1, ["u"], ["y"]).unwrap();
    assert!(DataReport::measure(&empty, HORIZONS, &options).is_err());
    let mut no_windows = options.clone();
    no_windows.prediction.windows = 0;
    let message = DataReport::measure(&data, HORIZONS, &no_windows)
        .unwrap_err()
        .to_string();
    assert!(message.contains("`windows` is 0"), "{message}");
}

#[test]
fn raw_series_are_screened_for_what_is_not_finite() {
    let (_, mut outputs) = clean(5);
    for k in [0, 50, 51, 52] {
        outputs[(k, 1)] = f64::NAN;
    }
    outputs[(SAMPLES - 1, 1)] = f64::INFINITY;
    let screening = screen(&["good", "broken"], Role::Output, outputs.as_ref()).unwrap();
    let broken = &screening.channels[1];
    let range = |first, last| SampleRange { first, last };
    assert_eq!(
        broken.gaps,
        [range(0, 0), range(50, 52), range(SAMPLES - 1, SAMPLES - 1)]
    );
    assert_eq!((broken.not_finite, broken.samples), (5, SAMPLES));
    assert_eq!(broken.statistics.as_ref().unwrap().samples, SAMPLES - 5);
    assert!(screening.channels[0].gaps.is_empty());
    assert_eq!(screening.findings.len(), 1);
    let finding = &screening.findings[0];
    assert_eq!(
        (finding.kind, finding.severity),
        (FindingKind::NotFinite, Severity::Error)
    );
    assert!(finding.message.contains("5 of 800"), "{finding}");
    assert!(finding.message.contains("sample 0"), "{finding}");

    let nothing = Mat::from_fn(10, 1, |_, _| f64::NAN);
    let screening = screen(&["dead"], Role::Input, nothing.as_ref()).unwrap();
    assert!(screening.channels[0].statistics.is_none());
    assert_eq!(screening.channels[0].gaps, [range(0, 9)]);
    assert!(screen(&["one"], Role::Input, outputs.as_ref()).is_err());
    let empty = Mat::<f64>::zeros(0, 1);
    assert!(
        screen(&["none"], Role::Input, empty.as_ref())
            .unwrap()
            .findings
            .is_empty()
    );
}
