//! The entry point: what comes out of good and bad recordings.

use std::ops::ControlFlow;

use deepc_core::data::Dataset;
use deepc_core::faer::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sysid::{
    EffectVerdict, Feedthrough, Focus, IdentificationSettings, RefineSettings, SubspaceSettings,
    SysidError, UnstablePoles, Weighting, identify, identify_with, refine_model, subspace_model,
};

/// Third order, two inputs, two outputs; input 1 acts on output 0 within its own interval.
struct Plant {
    x: [f64; 3],
}

impl Plant {
    fn step(&mut self, u: [f64; 2]) -> [f64; 2] {
        let [a, b, c] = self.x;
        let y = [a + 0.5 * c + 0.3 * u[1], b - c];
        self.x = [
            0.8 * a + 0.3 * b + 0.5 * u[0],
            -0.3 * a + 0.8 * b + 0.2 * u[1],
            0.5 * c + 0.4 * u[0] - 0.3 * u[1],
        ];
        y
    }
}

struct Recipe {
    samples: usize,
    noise: f64,
    input_scale: [f64; 2],
    input_offset: [f64; 2],
    output_offset: [f64; 2],
    seed: u64,
}

impl Recipe {
    fn plain(samples: usize, noise: f64) -> Self {
        Self {
            samples,
            noise,
            input_scale: [1.0; 2],
            input_offset: [0.0; 2],
            output_offset: [0.0; 2],
            seed: 1,
        }
    }

    fn record(&self) -> Dataset {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut plant = Plant {
            x: [0.5, -1.0, 0.3],
        };
        let (mut u, mut y) = (Vec::new(), Vec::new());
        for _ in 0..self.samples {
            let input = [0, 1].map(|_| random.random_range(-1.0..1.0));
            let output = plant.step(input);
            for ((value, offset), scale) in
                input.iter().zip(self.input_offset).zip(self.input_scale)
            {
                u.push(offset + scale * value);
            }
            for (output, offset) in output.iter().zip(self.output_offset) {
                let noise: f64 = StandardNormal.sample(&mut random);
                y.push(offset + output + self.noise * noise);
            }
        }
        let mut data = Dataset::new(0.1, ["a", "b"], ["p", "q"]).unwrap();
        data.push_rows(&u, &y).unwrap();
        data
    }
}

/// Steady-state gain of the plant, computed by hand from (I − A)⁻¹.
fn true_gain() -> [[f64; 2]; 2] {
    // [0.2 −0.3; 0.3 0.2]⁻¹ = [0.2 0.3; −0.3 0.2]/0.13
    let a = |u: [f64; 2]| (0.2 * 0.5 * u[0] + 0.3 * 0.2 * u[1]) / 0.13;
    let b = |u: [f64; 2]| (-0.3 * 0.5 * u[0] + 0.2 * 0.2 * u[1]) / 0.13;
    let c = |u: [f64; 2]| 2.0 * (0.4 * u[0] - 0.3 * u[1]);
    let y = |u: [f64; 2]| [a(u) + 0.5 * c(u) + 0.3 * u[1], b(u) - c(u)];
    let (first, second) = (y([1.0, 0.0]), y([0.0, 1.0]));
    [[first[0], second[0]], [first[1], second[1]]]
}

fn assert_gain(gain: &Mat<f64>, tolerance: f64) {
    for (i, row) in true_gain().iter().enumerate() {
        for (j, &expected) in row.iter().enumerate() {
            let found = gain[(i, j)];
            assert!(
                (found - expected).abs() <= tolerance,
                "gain ({i}, {j}) is {found}, expected {expected}"
            );
        }
    }
}

fn with(
    settings: &IdentificationSettings,
    data: &Dataset,
) -> Result<sysid::Identification, SysidError> {
    identify_with(data, settings, &mut |_| ControlFlow::Continue(()))
}

#[test]
fn without_noise_the_plant_itself_comes_out() {
    let recipe = Recipe {
        input_offset: [80.0, -3.0],
        output_offset: [5.0, 1e4],
        ..Recipe::plain(600, 0.0)
    };
    let found = identify(&recipe.record()).unwrap();
    assert_eq!(found.model.order(), 3, "{}", found.report);
    assert_gain(&found.model.steady_state_gain().unwrap(), 1e-7);
    let mut radii: Vec<_> = found
        .model
        .poles()
        .unwrap()
        .iter()
        .map(|pole| pole.re.hypot(pole.im))
        .collect();
    radii.sort_by(f64::total_cmp);
    let pair = 0.73_f64.sqrt();
    for (found, expected) in radii.iter().zip([0.5, pair, pair]) {
        assert!((found - expected).abs() < 1e-8, "{found} for {expected}");
    }
}

#[test]
fn with_noise_order_feedthrough_and_gains_come_out() {
    let found = identify(&Recipe::plain(2000, 0.1).record()).unwrap();
    assert_eq!(found.model.order(), 3, "{}", found.report);
    assert!(found.model.is_stable().unwrap());
    assert_gain(&found.model.steady_state_gain().unwrap(), 0.05);
    let flag = |input: &str| {
        let effect = found.report.effects.iter().find(|e| e.input == input);
        effect.unwrap().feedthrough
    };
    assert!(!flag("a") && flag("b"), "{}", found.report);
    let known = |e: &sysid::InputEffect| e.verdict == EffectVerdict::Identified;
    assert!(found.report.effects.iter().all(known), "{}", found.report);
    assert!(found.report.warnings.is_empty(), "{}", found.report);
}

#[test]
fn the_same_recording_gives_the_same_bits() {
    let data = Recipe::plain(400, 0.1).record();
    let (first, second) = (identify(&data).unwrap(), identify(&data).unwrap());
    assert_eq!(first.model, second.model);
    assert_eq!(first.report, second.report);
}

#[test]
fn scales_of_the_inputs_change_the_units_only() {
    let plain = identify(&Recipe::plain(500, 0.05).record()).unwrap();
    let recipe = Recipe {
        input_scale: [1e8, 1e-8],
        ..Recipe::plain(500, 0.05)
    };
    let scaled = identify(&recipe.record()).unwrap();
    assert_eq!(plain.model.order(), scaled.model.order());
    let (a, b) = (
        plain.model.steady_state_gain().unwrap(),
        scaled.model.steady_state_gain().unwrap(),
    );
    for i in 0..2 {
        for (j, scale) in recipe.input_scale.iter().enumerate() {
            let (expected, found) = (a[(i, j)], b[(i, j)] * scale);
            assert!(
                (found - expected).abs() < 1e-6 * expected.abs(),
                "{found} for {expected}"
            );
        }
    }
}

#[test]
fn an_input_that_hardly_moves_is_called_unidentified() {
    let recipe = Recipe {
        input_scale: [1.0, 1.0],
        ..Recipe::plain(1500, 0.3)
    };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut plant, mut u, mut y) = (Plant { x: [0.0; 3] }, Vec::new(), Vec::new());
    for _ in 0..recipe.samples {
        let input = [
            random.random_range(-1.0..1.0),
            1e-3 * random.random_range(-1.0..1.0),
        ];
        u.extend(input);
        for output in plant.step(input) {
            let noise: f64 = StandardNormal.sample(&mut random);
            y.push(output + recipe.noise * noise);
        }
    }
    let mut data = Dataset::new(0.1, ["a", "b"], ["p", "q"]).unwrap();
    data.push_rows(&u, &y).unwrap();
    let found = identify(&data).unwrap();
    assert_eq!(
        found.report.unidentified_inputs(),
        ["b"],
        "{}",
        found.report
    );
    assert!(
        found.report.warnings.iter().any(|w| w.contains("`b`")),
        "{}",
        found.report
    );

    let settings = IdentificationSettings {
        without_effect: vec!["b".into()],
        ..IdentificationSettings::default()
    };
    let held = with(&settings, &data).unwrap();
    assert!(
        held.model
            .matrices()
            .b
            .col(1)
            .iter()
            .all(|&value| value == 0.0)
    );
    assert!(
        held.model
            .matrices()
            .d
            .col(1)
            .iter()
            .all(|&value| value == 0.0)
    );
    let verdict = |e: &&sysid::InputEffect| e.input == "b";
    let mut held_at_zero = held.report.effects.iter().filter(verdict);
    assert!(held_at_zero.all(|e| e.verdict == EffectVerdict::HeldAtZero));
}

#[test]
fn a_short_recording_says_how_long_it_should_be() {
    let error = identify(&Recipe::plain(20, 0.0).record()).unwrap_err();
    let message = error.to_string();
    assert!(message.contains("20 samples"), "{message}");
    let settings = IdentificationSettings {
        horizons: Some(vec![200]),
        ..IdentificationSettings::default()
    };
    let error = with(&settings, &Recipe::plain(500, 0.0).record()).unwrap_err();
    let SysidError::TooShort {
        longest,
        past,
        future,
        ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!((longest, past, future), (500, 200, 200));
}

#[test]
fn a_constant_channel_is_named_with_its_value() {
    let base = Recipe::plain(300, 0.0).record();
    let (u, y) = (base.records()[0].inputs(), base.records()[0].outputs());
    let mut data = Dataset::new(0.1, ["a", "b"], ["p", "q"]).unwrap();
    let constant = Mat::from_fn(300, 2, |k, j| if j == 1 { 100.0 } else { u[(k, j)] });
    data.push_record(constant, y.to_owned()).unwrap();
    let message = identify(&data).unwrap_err().to_string();
    assert!(
        message.contains("input `b` is constant at 100"),
        "{message}"
    );
}

#[test]
fn an_order_that_the_data_do_not_carry_is_refused_with_the_largest() {
    let data = Recipe::plain(500, 0.0).record();
    let error = with(&IdentificationSettings::of_order(400), &data).unwrap_err();
    assert!(
        matches!(error, SysidError::Order { order: 400, .. }),
        "{error}"
    );
    let message = error.to_string();
    assert!(
        message.contains("400") && message.contains("at most"),
        "{message}"
    );
}

#[test]
fn settings_out_of_range_are_named() {
    let data = Recipe::plain(300, 0.0).record();
    let base = IdentificationSettings::default;
    for (settings, part) in [
        (
            IdentificationSettings {
                order: Some(0),
                ..base()
            },
            "order",
        ),
        (
            IdentificationSettings {
                horizons: Some(vec![1]),
                ..base()
            },
            "horizons",
        ),
        (
            IdentificationSettings {
                stability_radius: 1.0,
                ..base()
            },
            "stability_radius",
        ),
        (IdentificationSettings { folds: 1, ..base() }, "folds"),
        (
            IdentificationSettings {
                feedthrough: Feedthrough::PerInput(vec![true]),
                ..base()
            },
            "feedthrough",
        ),
        (
            IdentificationSettings {
                without_effect: vec!["c".into()],
                ..base()
            },
            "`c`",
        ),
    ] {
        let message = with(&settings, &data).unwrap_err().to_string();
        assert!(message.contains(part), "{part}: {message}");
    }
}

#[test]
fn the_work_can_be_interrupted() {
    let data = Recipe::plain(300, 0.0).record();
    let mut calls = 0;
    let error = identify_with(&data, &IdentificationSettings::default(), &mut |progress| {
        calls += 1;
        assert!(progress.done < progress.total);
        if calls == 3 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .unwrap_err();
    assert!(
        matches!(error, SysidError::Interrupted { done: 2, .. }),
        "{error}"
    );
}

#[test]
fn a_diverging_recording_gives_a_stable_model_with_a_warning_or_an_error() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (mut x, mut u, mut y) = (0.0, Vec::new(), Vec::new());
    for _ in 0..400 {
        let input = random.random_range(-1.0..1.0);
        x = 1.02 * x + input;
        u.push(input);
        y.push(x);
    }
    let mut data = Dataset::new(0.1, ["u"], ["y"]).unwrap();
    data.push_rows(&u, &y).unwrap();
    if let Ok(found) = identify(&data) {
        assert!(found.model.is_stable().unwrap());
        assert!(!found.report.warnings.is_empty(), "{}", found.report);
    }
}

#[test]
fn measured_disturbances_are_inputs_that_nobody_decides() {
    let base = Recipe::plain(800, 0.02).record();
    let (u, y) = (base.records()[0].inputs(), base.records()[0].outputs());
    let mut data = Dataset::with_disturbances(0.1, ["a"], ["b"], ["p", "q"]).unwrap();
    let column = |j| u.subcols(j, 1).to_owned();
    data.push_record_with_disturbances(column(0), column(1), y.to_owned())
        .unwrap();
    let found = identify(&data).unwrap();
    assert_eq!(
        (found.model.inputs().len(), found.model.disturbances().len()),
        (1, 1)
    );
    assert_gain(&found.model.steady_state_gain().unwrap(), 0.05);
}

#[test]
fn an_unstable_subspace_estimate_is_refused_unless_asked_for() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (mut x, mut u, mut y) = (0.0, Vec::new(), Vec::new());
    for _ in 0..300 {
        let input = random.random_range(-1.0..1.0);
        u.push(input);
        y.push(x);
        x = 1.02 * x + input;
    }
    let mut data = Dataset::new(0.1, ["u"], ["y"]).unwrap();
    data.push_rows(&u, &y).unwrap();
    let mut settings = SubspaceSettings::new(5, 1);
    let error = subspace_model(&data, &settings).unwrap_err();
    let SysidError::Unstable { radius, limit, .. } = error else {
        panic!("{error}");
    };
    assert!((radius - 1.02).abs() < 1e-6 && limit > 0.99, "{error}");

    settings.unstable_poles = UnstablePoles::Keep;
    let kept = subspace_model(&data, &settings).unwrap();
    assert!((kept.radius - 1.02).abs() < 1e-6 && kept.moved_from.is_none());

    settings.unstable_poles = UnstablePoles::MoveInside { radius: 0.999 };
    let moved = subspace_model(&data, &settings).unwrap();
    assert!(moved.model.is_stable().unwrap());
    assert!((moved.radius - 1.0 / 1.02).abs() < 1e-6 && moved.moved_from.is_some());

    settings.unstable_poles = UnstablePoles::MoveInside { radius: 1.0 };
    let message = subspace_model(&data, &settings).unwrap_err().to_string();
    assert!(message.contains("unstable_poles"), "{message}");
}

#[test]
fn a_model_is_refined_on_its_own_channels_only() {
    let data = Recipe::plain(600, 0.1).record();
    let mut settings = SubspaceSettings::new(10, 3);
    settings.weighting = Weighting::Cva;
    let start = subspace_model(&data, &settings).unwrap().model;
    let without = start.clone().without_effect_of(1);
    let refine =
        |model| refine_model(&data, model, Focus::Prediction, &RefineSettings::default()).unwrap();
    let refined = refine(&start);
    assert!(refined.converged && refined.loss < refined.loss_before);
    assert_gain(&refined.model.steady_state_gain().unwrap(), 0.1);
    let zero = refine(&without).model;
    assert!(zero.matrices().b.col(1).iter().all(|&value| value == 0.0));

    let mut other = Dataset::new(0.2, ["a", "b"], ["p", "q"]).unwrap();
    other.push_rows(&[0.0; 20], &[0.0; 20]).unwrap();
    let wrong = refine_model(&other, &start, Focus::Gain, &RefineSettings::default());
    let message = wrong.unwrap_err().to_string();
    assert!(
        message.contains("0.2") && message.contains("0.1"),
        "{message}"
    );
    let mut other = Dataset::new(0.1, ["a", "c"], ["p", "q"]).unwrap();
    other.push_rows(&[0.0; 20], &[0.0; 20]).unwrap();
    let wrong = refine_model(&other, &start, Focus::Gain, &RefineSettings::default());
    assert!(matches!(wrong, Err(SysidError::ChannelsDiffer { .. })));
}
