//! `identify`: what it writes, and that it writes all of it or nothing.

use std::fmt::Write as _;
use std::path::Path;

use deepc_core::data::{CsvLayout, Dataset, OutputTiming};
use sysid::{InitialStateFor, StateSpace};

use super::{assert_says, fail, folder, read, succeed, write};

/// The gains of the plant below, one row per output.
const GAINS: [[f64; 2]; 2] = [[2.0, -1.0], [0.5, 3.0]];
/// Its poles, one per output.
const POLES: [f64; 2] = [0.8, 0.6];
const OFFSETS: [f64; 2] = [40.0, -7.0];

/// Uniform in ±0.5, the same on every machine.
pub(super) struct Noise(pub u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        #[expect(clippy::cast_precision_loss, reason = "32 bits")]
        let value = (self.0 >> 32) as f64;
        value / 2f64.powi(32) - 0.5
    }
}

/// Two tanks: each output is a first-order response to both inputs, one interval later, with noise.
pub(super) fn tanks(samples: usize, seed: u64) -> String {
    tanks_with(GAINS, samples, seed)
}

fn tanks_with(gains: [[f64; 2]; 2], samples: usize, seed: u64) -> String {
    let mut noise = Noise(seed);
    let mut text = "time_s,pump,valve,left,right\n".to_owned();
    let (mut states, mut held) = ([0.0; 2], [0.0; 2]);
    for k in 0..samples {
        for (input, period) in held.iter_mut().zip([3, 4]) {
            if k % period == 0 {
                *input = noise.next();
            }
        }
        let outputs: [f64; 2] =
            std::array::from_fn(|i| states[i] + OFFSETS[i] + 0.02 * noise.next());
        for (i, state) in states.iter_mut().enumerate() {
            let drive = gains[i][0] * held[0] + gains[i][1] * held[1];
            *state = POLES[i] * *state + (1.0 - POLES[i]) * drive;
        }
        #[expect(clippy::cast_precision_loss, reason = "small")]
        let time_s = 0.5 * k as f64;
        let [pump, valve] = held;
        let [left, right] = outputs;
        writeln!(text, "{time_s},{pump},{valve},{left},{right}").expect("a string takes all");
    }
    text
}

/// `identify` on the tanks.
pub(super) const TANKS: [&str; 8] = [
    "identify",
    "tanks.csv",
    "--inputs",
    "pump,valve",
    "--outputs",
    "left,right",
    "--max-order",
    "4",
];

pub(super) fn with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    TANKS.iter().chain(more).copied().collect()
}

fn layout() -> CsvLayout {
    CsvLayout {
        time: Some("time_s".into()),
        inputs: vec!["pump".into(), "valve".into()],
        disturbances: Vec::new(),
        outputs: vec!["left".into(), "right".into()],
        outputs_measured: OutputTiming::EndOfInterval,
        sample_time_s: 0.5,
    }
}

fn svgs(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let svgs = paths.filter(|path| path.extension().is_some_and(|e| e == "svg"));
    let names = svgs.filter_map(|path| Some(path.file_name()?.to_str()?.to_owned()));
    let mut svgs: Vec<String> = names.collect();
    svgs.sort();
    svgs
}

#[test]
fn a_recording_becomes_a_model_a_report_and_a_page() {
    let folder = folder();
    write(&folder.path().join("tanks.csv"), &tanks(400, 1));
    write(&folder.path().join("other.csv"), &tanks(300, 2));
    let printed = succeed(
        folder.path(),
        &with(&["--validate", "other.csv", "--out", "out/model"]),
    );
    assert_says(
        &printed,
        &[
            "order 2",
            "pump → left",
            "valve → right",
            "identified",
            "other.csv",
            "20 steps ahead",
            "out/model/model.json",
            "out/model/index.html",
        ],
    );
    let out = folder.path().join("out/model");
    assert_eq!(
        svgs(&out),
        [
            "frequency-1-1.svg",
            "frequency-1-2.svg",
            "frequency-2-1.svg",
            "frequency-2-2.svg",
            "horizon.svg",
            "measured-1.svg",
            "measured-2.svg",
            "order.svg",
            "poles.svg",
            "residuals-1.svg",
            "residuals-2.svg",
            "singular-values.svg",
            "step.svg",
        ]
    );
    let text = read(&out.join("report.txt"));
    assert_says(
        &text,
        &[
            "Orders tried",
            "VALIDATION 300 samples",
            "Poles",
            "time constant",
            "not seen",
        ],
    );
    let page = read(&out.join("index.html"));
    assert_says(
        &page,
        &["<svg", "model.json", "NRMSE", "recordings for validation"],
    );
    let matlab = read(&out.join("model.m"));
    assert_says(&matlab, &["model", "pump", "right"]);

    let model = StateSpace::load(out.join("model.json")).expect("the model can be read");
    let gain = model.steady_state_gain().expect("the model is stable");
    for (i, gains) in GAINS.iter().enumerate() {
        for (j, true_gain) in gains.iter().enumerate() {
            let found = gain[(i, j)];
            assert!((found - true_gain).abs() < 0.05, "{i}, {j}: {found}");
        }
    }
    let data = Dataset::read_csv(&layout(), &[folder.path().join("other.csv")]).expect("data");
    let record = &data.records()[0];
    let state = model
        .initial_state(
            record.inputs(),
            record.outputs(),
            InitialStateFor::Simulation,
        )
        .expect("a record as the model's");
    let simulated = model.simulate(&state, record.inputs()).expect("its inputs");
    for i in 0..2 {
        for k in 0..record.samples() {
            let error = simulated[(k, i)] - record.outputs()[(k, i)];
            assert!(error.abs() < 0.05, "output {i}, sample {k}: {error}");
        }
    }
}

#[test]
fn without_other_recordings_it_says_that_the_model_judges_itself() {
    let folder = folder();
    write(&folder.path().join("tanks.csv"), &tanks(300, 3));
    let printed = succeed(folder.path(), &with(&["--json", "--out", "."]));
    let report: serde_json::Value = serde_json::from_str(&printed).expect("--json prints JSON");
    assert_eq!(report["validated_on"], "same_recording");
    assert_eq!(report["identification"]["order"], 2);
    assert_eq!(report["poles"].as_array().map(Vec::len), Some(2));
    assert_eq!(printed, read(&folder.path().join("report.json")));
    for file in ["report.txt", "index.html"] {
        let text = read(&folder.path().join(file));
        assert_says(&text, &["which flatters it", "--validate"]);
    }
}

#[test]
fn an_input_that_does_nothing_stands_out_and_can_be_held_at_zero() {
    let folder = folder();
    let idle = tanks_with([[2.0, 0.0], [0.5, 3.0]], 400, 4).replacen("valve", "idle", 1);
    write(&folder.path().join("tanks.csv"), &idle);
    let base = [
        "identify",
        "tanks.csv",
        "--inputs",
        "pump,idle",
        "--outputs",
        "left",
        "--order",
        "1",
        "--out",
        ".",
    ];
    let printed = succeed(folder.path(), &base);
    assert_says(
        &printed,
        &[
            "NOT identified",
            "warning: ",
            "effect of idle",
            "--without-effect idle",
        ],
    );
    let page = read(&folder.path().join("index.html"));
    assert_says(
        &page,
        &["class=\"unknown\"", "NOT identified", "(not identified)"],
    );

    let held = [&base[..], &["--without-effect", "idle"]].concat();
    assert_says(&succeed(folder.path(), &held), &["held at zero"]);
    let model = StateSpace::load(folder.path().join("model.json")).expect("a model");
    let gain = model.steady_state_gain().expect("the model is stable");
    assert!(gain[(0, 1)].abs() <= 0.0, "{}", gain[(0, 1)]);
    assert!(
        !folder.path().join("frequency-1-2.svg").exists(),
        "there is no response to draw, and the one of the last run is gone"
    );
}

#[test]
fn offsets_can_be_the_means_or_none() {
    let folder = folder();
    write(&folder.path().join("tanks.csv"), &tanks(300, 8));
    let offsets = |choice: &str| {
        let printed = succeed(folder.path(), &with(&["--offsets", choice, "--out", "."]));
        let model = StateSpace::load(folder.path().join("model.json")).expect("a model");
        let outputs: Vec<f64> = model.outputs().iter().map(|c| c.offset).collect();
        (printed, outputs)
    };
    for choice in ["found", "means"] {
        let (_, outputs) = offsets(choice);
        for (offset, true_offset) in outputs.iter().zip(OFFSETS) {
            assert!((offset - true_offset).abs() < 0.5, "{choice}: {offset}");
        }
    }
    let (printed, outputs) = offsets("none");
    assert_eq!(outputs, [0.0, 0.0]);
    assert_says(
        &printed,
        &["warning: the model goes through the origin", "`left`"],
    );
    let page = read(&folder.path().join("index.html"));
    assert_says(&page, &["raw data"]);
    let message = fail(folder.path(), &with(&["--offsets", "raw"]));
    assert_says(&message, &["--offsets", "'raw'", "found, means, none"]);
}

#[test]
fn results_of_an_earlier_run_are_replaced_and_other_files_kept() {
    let folder = folder();
    write(&folder.path().join("tanks.csv"), &tanks(300, 6));
    write(&folder.path().join("drawing.svg"), "mine");
    write(&folder.path().join("measured-7.svg"), "of an earlier run");
    succeed(folder.path(), &with(&["--out", "."]));
    assert!(!folder.path().join("measured-7.svg").exists());
    assert_eq!(read(&folder.path().join("drawing.svg")), "mine");
    assert_eq!(read(&folder.path().join("tanks.csv")), tanks(300, 6));
}

#[test]
fn the_same_recordings_give_the_same_bytes() {
    let folder = folder();
    write(&folder.path().join("tanks.csv"), &tanks(250, 7));
    write(&folder.path().join("more.csv"), &tanks(150, 8));
    for out in ["a", "b"] {
        succeed(folder.path(), &with(&["more.csv", "--out", out]));
    }
    for name in [
        "model.json",
        "model.m",
        "report.json",
        "report.txt",
        "index.html",
    ] {
        let file = |out: &str| read(&folder.path().join(out).join(name));
        assert_eq!(file("a"), file("b"), "{name}");
    }
    let report = read(&folder.path().join("a/report.txt"));
    assert_says(&report, &["400 samples in 2 records"]);
}

#[test]
fn disturbances_and_early_outputs_are_understood() {
    let folder = folder();
    // Outputs of a row are those at the start of its interval.
    write(&folder.path().join("tanks.csv"), &tanks(400, 9));
    let arguments = [
        "identify",
        "tanks.csv",
        "--inputs",
        "pump",
        "--disturbances",
        "valve",
        "--outputs",
        "left,right",
        "--outputs-at-start",
        "--order",
        "2",
        "--out",
        ".",
    ];
    assert_says(&succeed(folder.path(), &arguments), &["valve → right"]);
    let model = StateSpace::load(folder.path().join("model.json")).expect("a model");
    assert_eq!(model.disturbances().len(), 1);
    // What an input does within its own interval.
    assert!((model.matrices().d[(0, 0)] - GAINS[0][0] * (1.0 - POLES[0])).abs() < 0.02);
}
