//! Lasting differences between plant and model.

use deepc_core::controller::run_closed_loop;
use deepc_core::faer::mat;
use sysid::lmpc::{self, LmpcSettings, OffsetHandling};
use sysid::{Channel, StateSpace, SysidError, SystemMatrices};

use crate::plants::{LtiPlant, TS, horizon, settings, undisturbed_model};

/// Only changes of the inputs cost: the steady state is that of the output references.
fn free_inputs(offset_handling: OffsetHandling) -> LmpcSettings {
    let mut settings = LmpcSettings {
        offset_handling,
        ..settings()
    };
    settings.input_weights = vec![0.0; 2];
    settings
}

/// Largest error of the outputs at the end of a run with constant disturbances.
fn steady_error(handling: OffsetHandling, input_error: [f64; 2], output_error: [f64; 2]) -> f64 {
    let model = undisturbed_model();
    let settings = free_inputs(handling);
    let mut controller = lmpc::controller(&model, &settings, 15, horizon()).unwrap();
    let mut plant = LtiPlant::undisturbed();
    (plant.input_error, plant.output_error) = (input_error, output_error);
    let run = run_closed_loop(&mut plant, &mut controller, 600, |_, reference| {
        reference.hold(&[0.0; 2], &[0.5, 0.1])
    });
    let outputs = run.unwrap().outputs;
    let last = outputs.row(599);
    (last[0] - 0.5).abs().max((last[1] - 0.1).abs())
}

#[test]
fn an_output_disturbance_removes_steady_errors() {
    for (input_error, output_error) in [
        ([0.0, 0.0], [0.2, -0.1]),
        ([0.15, -0.1], [0.0, 0.0]),
        ([0.1, 0.05], [-0.1, 0.2]),
    ] {
        let with = steady_error(OffsetHandling::default(), input_error, output_error);
        let without = steady_error(OffsetHandling::None, input_error, output_error);
        println!("with {with:e}, without {without:e}");
        assert!(with < 1e-6, "{with:e}");
        assert!(without > 0.01, "{without:e}");
    }
}

#[test]
fn an_input_without_effect_stays_at_its_reference() {
    let model = undisturbed_model().without_effect_of(1);
    let mut controller = lmpc::controller(&model, &settings(), 15, horizon()).unwrap();
    let mut plant = LtiPlant::undisturbed();
    let run = run_closed_loop(&mut plant, &mut controller, 60, |_, reference| {
        reference.hold(&[0.0, 0.3], &[0.6, 0.0])
    });
    let inputs = run.unwrap().inputs;
    for k in 0..60 {
        assert!(
            (inputs[(k, 1)] - 0.3).abs() < 1e-9,
            "{k}: {}",
            inputs[(k, 1)]
        );
    }
    // The other one does its work.
    assert!(inputs[(20, 0)].abs() > 0.01);
}

fn scalar(pole: f64, gain: f64) -> StateSpace {
    let matrices = SystemMatrices {
        a: mat![[pole]],
        b: mat![[1.0]],
        c: mat![[1.0]],
        d: mat![[0.0]],
        k: mat![[gain]],
    };
    let (inputs, outputs) = (vec![Channel::new("u")], vec![Channel::new("y")]);
    StateSpace::new(TS, inputs, vec![], outputs, matrices).unwrap()
}

#[test]
fn models_that_cannot_be_used_are_refused_with_numbers() {
    let settings = LmpcSettings::new(&[1.0], &[1.0]);
    let plain = LmpcSettings {
        offset_handling: OffsetHandling::None,
        ..settings.clone()
    };
    let build = |model: &StateSpace, settings: &LmpcSettings, horizon| {
        lmpc::program(model, settings, horizon).err()
    };
    // An integrator: no output disturbance, but otherwise welcome.
    let error = build(&scalar(1.0, 0.5), &settings, 20).unwrap();
    assert!(
        matches!(error, SysidError::UndetectableOffset { distance, .. } if distance == 0.0),
        "{error}"
    );
    assert!(build(&scalar(1.0, 0.5), &plain, 20).is_none());
    // An observer that does not converge.
    let error = build(&scalar(0.9, 3.0), &plain, 20).unwrap();
    assert!(
        matches!(error, SysidError::Unstable { radius, .. } if (radius - 2.1).abs() < 1e-12),
        "{error}"
    );
    // An unstable plant, for as long as numbers last.
    let unstable = scalar(1.3, 0.8);
    assert!(build(&unstable, &settings, 70).is_none());
    let error = build(&unstable, &settings, 100).unwrap();
    assert!(
        matches!(
            error,
            SysidError::PredictionGrowth {
                longest: 70,
                horizon: 100,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn settings_are_checked_and_survive_a_file() {
    let wrong = |change: &dyn Fn(&mut LmpcSettings)| {
        let mut settings = settings();
        change(&mut settings);
        settings.check(2, 2, 15).unwrap_err().to_string()
    };
    for (message, part) in [
        (wrong(&|s| s.past_steps = Some(0)), "past_steps"),
        (wrong(&|s| s.input_weights = vec![1.0]), "input_weights"),
        (
            wrong(&|s| s.offset_handling = OffsetHandling::OutputDisturbance { drift: f64::NAN }),
            "drift",
        ),
    ] {
        assert!(message.contains(part), "{message}");
    }
    let text = serde_json::to_string(&settings()).unwrap();
    assert_eq!(
        serde_json::from_str::<LmpcSettings>(&text).unwrap(),
        settings()
    );
    let unknown = text.replacen('{', "{\"lambda_g\":1.0,", 1);
    assert!(serde_json::from_str::<LmpcSettings>(&unknown).is_err());
}
