//! Without noise, three ways to the same inputs.

use deepc_core::controller::{Controller, DeepcController, Plant};
use deepc_core::faer::{Col, Mat};
use deepc_core::hankel::Horizons;
use deepc_core::program::{CondensedProgram, MeasuredDisturbances, Moment, PredictiveProgram};
use sysid::lmpc::{self, OffsetHandling};

use crate::plants::{
    LtiPlant, Offsets, SHIFTED, deepc_settings, horizon, matrices, model, model_at, predictor,
    settings, settings_at,
};
use crate::textbook::Textbook;

const STEPS: usize = 15;

fn targets(k: usize) -> ([f64; 2], [f64; 2]) {
    let inputs = [0.1, -0.1];
    match k {
        0..30 => (inputs, [1.0, 0.3]),
        30..60 => (inputs, [-0.6, -1.2]),
        _ => (inputs, [0.0, 0.5]),
    }
}

#[test]
fn lmpc_deepc_and_a_textbook_mpc_give_the_same_inputs() {
    for handling in [OffsetHandling::None, OffsetHandling::default()] {
        let mut lmpc_settings = settings();
        lmpc_settings.offset_handling = handling;
        let mut lmpc = lmpc::controller(&model(), &lmpc_settings, STEPS, horizon()).unwrap();
        let predictor = predictor(Horizons::new(4, STEPS));
        let mut deepc =
            DeepcController::condensed(&predictor, &deepc_settings(), horizon()).unwrap();
        let mut textbook = Textbook::new(matrices(), &lmpc_settings, STEPS);
        let start = [0.3, -0.2, 0.5];
        let mut plant = LtiPlant::at(Offsets::default()).with_state(start);
        let mut state = Col::from_fn(3, |i| start[i]);
        let mut reference = lmpc.new_reference();
        let mut last = [0.0; 2];
        let mut measured = 0.0;
        let (mut worst, mut input_bounds, mut output_bounds) = ([0.0_f64; 2], 0, 0);
        for k in 0..90 {
            let (u_r, y_r) = targets(k);
            reference.hold(&u_r, &y_r).unwrap();
            reference.hold_disturbances(&[measured]).unwrap();
            let ours = lmpc.decide(&reference).input.clone();
            let theirs = deepc.decide(&reference).input.clone();
            if k >= 4 {
                let (input, active) = textbook.decide(&state, last, measured, (u_r, y_r));
                input_bounds += u32::from(active[0]);
                output_bounds += u32::from(active[1]);
                for j in 0..2 {
                    worst[0] = worst[0].max((ours[j] - input[j]).abs());
                    worst[1] = worst[1].max((ours[j] - theirs[j]).abs());
                }
            }
            let mut output = [0.0; 2];
            plant.step(&ours, &mut output).unwrap();
            let disturbance = plant.measured_disturbances();
            measured = disturbance[0];
            lmpc.observe_with_disturbances(&ours, disturbance, &output);
            deepc.observe_with_disturbances(&ours, disturbance, &output);
            let u = Col::from_fn(3, |j| if j < 2 { ours[j] } else { measured });
            state = &matrices().a * &state + &matrices().b * u;
            last = [ours[0], ours[1]];
        }
        println!(
            "{handling:?}: to the textbook {:e}, to DeePC {:e}",
            worst[0], worst[1]
        );
        assert!(worst.iter().all(|gap| *gap < 1e-6), "{worst:?}");
        assert!(
            input_bounds > 20 && output_bounds > 10,
            "{input_bounds} steps with active input bounds, {output_bounds} with output bounds"
        );
    }
}

/// A model about (80, −3), (5, −40) does there what the same model does about 0.
#[test]
fn offsets_only_shift() {
    let mut here = lmpc::controller(&model(), &settings(), STEPS, horizon()).unwrap();
    let (model, settings) = (model_at(SHIFTED), settings_at(SHIFTED));
    let mut there = lmpc::controller(&model, &settings, STEPS, horizon()).unwrap();
    let (mut near, mut far) = (LtiPlant::at(Offsets::default()), LtiPlant::at(SHIFTED));
    let (mut reference, mut shifted) = (here.new_reference(), there.new_reference());
    let mut worst = 0.0_f64;
    for k in 0..90 {
        let (u, y) = targets(k);
        reference.hold(&u, &y).unwrap();
        let moved = |value: [f64; 2], by: [f64; 2]| [value[0] + by[0], value[1] + by[1]];
        shifted
            .hold(&moved(u, SHIFTED.inputs), &moved(y, SHIFTED.outputs))
            .unwrap();
        reference.hold_disturbances(&[0.1]).unwrap();
        shifted
            .hold_disturbances(&[0.1 + SHIFTED.disturbance])
            .unwrap();
        let ours = here.decide(&reference).input.clone();
        let theirs = there.decide(&shifted).input.clone();
        let (mut output, mut away) = ([0.0; 2], [0.0; 2]);
        near.step(&ours, &mut output).unwrap();
        far.step(&theirs, &mut away).unwrap();
        here.observe_with_disturbances(&ours, near.measured_disturbances(), &output);
        there.observe_with_disturbances(&theirs, far.measured_disturbances(), &away);
        for j in 0..2 {
            worst = worst.max((ours[j] - (theirs[j] - SHIFTED.inputs[j])).abs());
            worst = worst.max((output[j] - (away[j] - SHIFTED.outputs[j])).abs());
        }
    }
    println!("{worst:e}");
    assert!(worst < 1e-9, "{worst:e}");
}

/// What a program remembers of earlier references changes no bit: neither on a model nor on data.
#[test]
fn references_seen_before_leave_no_trace() {
    let window = Mat::from_fn(4, 2, |k, i| 0.1 * (k as f64 + 2.0 * i as f64).sin());
    let measured = Mat::from_fn(4, 1, |k, _| 0.2 * (k as f64).cos());
    let preview = Mat::from_fn(STEPS, 1, |k, _| 0.1 * (k as f64).sin());
    let input_reference = Mat::from_fn(STEPS, 2, |_, i| 0.1 * i as f64);
    let references: Vec<_> = [0.2, 0.9, 0.9, -0.5, 0.2]
        .iter()
        .map(|&level| Mat::from_fn(STEPS, 2, |k, _| level + 0.01 * k as f64))
        .collect();
    let predictor = predictor(Horizons::new(4, STEPS));
    let on_model = || lmpc::program(&model(), &settings(), STEPS).unwrap();
    let on_data = || CondensedProgram::new(&predictor, &deepc_settings()).unwrap();
    let makers: [&dyn Fn() -> CondensedProgram; 2] = [&on_model, &on_data];
    for make in makers {
        let mut seasoned = make();
        for output_reference in &references {
            let moment = Moment {
                past_inputs: window.as_ref(),
                past_outputs: window.as_ref(),
                input_reference: input_reference.as_ref(),
                output_reference: output_reference.as_ref(),
                disturbances: Some(MeasuredDisturbances {
                    past: measured.as_ref(),
                    preview: preview.as_ref(),
                }),
            };
            let mut fresh = make();
            seasoned.set_moment(&moment).unwrap();
            fresh.set_moment(&moment).unwrap();
            let (found, expected) = (seasoned.vectors(), fresh.vectors());
            assert_eq!(found.lower, expected.lower);
            assert_eq!(found.upper, expected.upper);
        }
    }
}
