//! What is taken from the channels before a model is made: what each choice promises.

use std::ops::ControlFlow;

use deepc_core::data::Dataset;
use deepc_core::faer::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sysid::{Channel, Identification, IdentificationSettings, OffsetChoice, identify_with};

/// Order of the plant.
const ORDER: usize = 3;

/// One step of a plant through the origin: two inputs, two outputs, the second input acts at once.
fn step(x: &mut [f64; ORDER], u: [f64; 2]) -> [f64; 2] {
    let [a, b, c] = *x;
    *x = [
        0.8 * a + 0.3 * b + 0.5 * u[0],
        -0.3 * a + 0.8 * b + 0.2 * u[1],
        0.5 * c + 0.4 * u[0] - 0.3 * u[1],
    ];
    [a + 0.5 * c + 0.3 * u[1], b - c]
}

/// Its steady-state gain: the response to a step after transients of 0.86 per sample are rounding.
fn true_gain() -> Mat<f64> {
    let mut gain = Mat::zeros(2, 2);
    for j in 0..2 {
        let (mut x, mut u) = ([0.0; ORDER], [0.0; 2]);
        u[j] = 1.0;
        let outputs = (0..400).map(|_| step(&mut x, u));
        let [first, second] = outputs.last().unwrap_or_default();
        (gain[(0, j)], gain[(1, j)]) = (first, second);
    }
    gain
}

/// A recording as it comes from the plant.
#[derive(Clone)]
struct Recording {
    /// Mean of what drives the plant.
    drive: [f64; 2],
    /// Added to what is written of the inputs, then of the outputs; the plant does not see it.
    written: [f64; 4],
    /// Units of what is written, in the same order.
    unit: [f64; 4],
    noise: f64,
}

impl Recording {
    const PLAIN: Self = Self {
        drive: [0.0; 2],
        written: [0.0; 4],
        unit: [1.0; 4],
        noise: 0.0,
    };

    fn make(&self) -> Dataset {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut x = [0.5, -1.0, 0.3];
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for _ in 0..600 {
            let u = self.drive.map(|mean| mean + random.random_range(-1.0..1.0));
            let y = step(&mut x, u).map(|y| {
                let noise: f64 = StandardNormal.sample(&mut random);
                y + self.noise * noise
            });
            let sample = [u[0], u[1], y[0], y[1]];
            let written = |i: usize| (sample[i] + self.written[i]) * self.unit[i];
            inputs.extend([written(0), written(1)]);
            outputs.extend([written(2), written(3)]);
        }
        dataset(&inputs, &outputs)
    }
}

fn dataset(inputs: &[f64], outputs: &[f64]) -> Dataset {
    let mut data = Dataset::new(0.1, ["a", "b"], ["p", "q"]).unwrap();
    data.push_rows(inputs, outputs).unwrap();
    data
}

fn identified(data: &Dataset, offsets: OffsetChoice, order: Option<usize>) -> Identification {
    let settings = IdentificationSettings {
        offsets,
        order,
        ..IdentificationSettings::default()
    };
    identify_with(data, &settings, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn gain(found: &Identification) -> Mat<f64> {
    found.model.steady_state_gain().unwrap()
}

fn gain_error(found: &Identification) -> f64 {
    (gain(found) - true_gain()).norm_max()
}

fn offsets(found: &Identification) -> Vec<f64> {
    let channels = found.model.inputs().iter().chain(found.model.outputs());
    channels.map(|channel| channel.offset).collect()
}

fn warns_of(found: &Identification, channel: &str) -> bool {
    let name = format!("`{channel}` has mean");
    found.report.warnings.iter().any(|w| w.contains(&name))
}

#[test]
fn none_is_exact_for_a_plant_through_the_origin() {
    let near = Recording::PLAIN;
    let far = Recording {
        drive: [100.0, -20.0],
        ..Recording::PLAIN
    };
    for recording in [near, far] {
        let found = identified(&recording.make(), OffsetChoice::None, None);
        assert_eq!(found.model.order(), ORDER, "{}", found.report);
        let error = gain_error(&found);
        assert!(error < 1e-7, "{error}: {}", found.report);
        assert_eq!(offsets(&found), [0.0; 4]);
        assert!(found.report.to_string().contains("through the origin"));
        let away = recording.drive[0] > 1.0;
        assert_eq!(warns_of(&found, "a"), away, "{}", found.report);
        for share in found.report.effects.iter().map(|effect| effect.share) {
            assert!((0.0..1.5).contains(&share), "{}", found.report);
        }
    }
}

#[test]
fn about_an_operating_point_offsets_have_to_be_found() {
    let recording = Recording {
        drive: [0.4, -0.2],
        written: [80.0, -3.0, 5.0, 1e4],
        ..Recording::PLAIN
    };
    let data = recording.make();
    let found = identified(&data, OffsetChoice::Found, Some(ORDER));
    assert!(gain_error(&found) < 1e-7, "{}", found.report);
    assert!(!warns_of(&found, "a"), "{}", found.report);

    // Neither of the others is claimed to be exact; both say what they did.
    let means = identified(&data, OffsetChoice::Means, Some(ORDER));
    assert!(
        (1e-7..0.1).contains(&gain_error(&means)),
        "{}",
        means.report
    );
    assert!(means.report.to_string().contains("means, nothing else"));
    let none = identified(&data, OffsetChoice::None, Some(ORDER));
    assert!(gain_error(&none) > 1e-3, "{}", none.report);
    for channel in ["a", "b", "p", "q"] {
        assert!(warns_of(&none, channel), "{channel}: {}", none.report);
    }
}

#[test]
fn means_are_none_on_data_whose_means_were_removed() {
    let recording = Recording {
        written: [80.0, -3.0, 5.0, 1e4],
        noise: 0.1,
        ..Recording::PLAIN
    };
    let data = recording.make();
    let record = &data.records()[0];
    let mean = |series: &[f64]| {
        let samples = 600.0;
        let mean = series.iter().sum::<f64>() / samples;
        mean + series.iter().map(|value| value - mean).sum::<f64>() / samples
    };
    let (u, y) = (record.inputs(), record.outputs());
    let columns = [u.col(0), u.col(1), y.col(0), y.col(1)];
    let columns: Vec<Vec<f64>> = columns.map(|c| c.iter().copied().collect()).into();
    let means: Vec<f64> = columns.iter().map(|column| mean(column)).collect();
    let rows = |pair: [usize; 2]| -> Vec<f64> {
        let of_row = |k| pair.map(|i: usize| columns[i][k] - means[i]);
        (0..600).flat_map(of_row).collect()
    };
    let removed = dataset(&rows([0, 1]), &rows([2, 3]));

    let means_removed = identified(&data, OffsetChoice::Means, None);
    let none = identified(&removed, OffsetChoice::None, None);
    assert_eq!(means_removed.model.matrices(), none.model.matrices());
    assert_eq!(offsets(&means_removed), means);
    assert_eq!(offsets(&none), [0.0; 4]);
    let scales = |channels: &[Channel]| channels.iter().map(|c| c.scale).collect::<Vec<_>>();
    let outputs = [&means_removed, &none].map(|found| scales(found.model.outputs()));
    assert_eq!(outputs[0], outputs[1]);
}

#[test]
fn none_does_not_see_units_but_sees_a_shift() {
    let recording = Recording {
        drive: [3.0, 0.0],
        noise: 0.1,
        ..Recording::PLAIN
    };
    // Powers of two: not even rounding may differ.
    let units = [64.0, 2f64.powi(-30), 2f64.powi(20), -0.5];
    let scaled = Recording {
        unit: units,
        ..recording.clone()
    };
    let shifted = Recording {
        written: [1.0, 0.0, 0.0, 0.0],
        ..recording.clone()
    };
    let of = |recording: &Recording| {
        gain(&identified(
            &recording.make(),
            OffsetChoice::None,
            Some(ORDER),
        ))
    };
    let (plain, scaled) = (of(&recording), of(&scaled));
    let back = Mat::from_fn(2, 2, |i, j| scaled[(i, j)] * units[j] / units[2 + i]);
    let difference = (&plain - back).norm_max();
    assert!(difference <= 1e-9 * plain.norm_max(), "{difference}");
    let moved = (&plain - of(&shifted)).norm_max();
    assert!(moved > 0.1, "{moved}");
}

#[test]
fn a_file_names_the_choice_or_leaves_it_out() {
    let read = serde_json::from_str::<IdentificationSettings>;
    assert_eq!(read("{}").unwrap().offsets, OffsetChoice::Found);
    for (word, choice) in [
        ("found", OffsetChoice::Found),
        ("means", OffsetChoice::Means),
        ("none", OffsetChoice::None),
    ] {
        let text = format!("{{\"offsets\": \"{word}\"}}");
        assert_eq!(read(&text).unwrap().offsets, choice);
    }
    let message = read("{\"offsets\": \"raw\"}").unwrap_err().to_string();
    for part in ["`raw`", "`found`", "`means`", "`none`"] {
        assert!(message.contains(part), "{message}");
    }
}
