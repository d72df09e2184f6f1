//! The contract of a controller, faults, and what the observer does with them.

use deepc_core::controller::contract::{check_controller, check_rate_limited_controller};
use deepc_core::controller::{
    Controller, Fault, Origin, Plant, ScheduleSettings, ScheduledController,
};
use deepc_core::predictor::Schedule;
use deepc_core::program::Bounds;
use sysid::lmpc::{self, LmpcController, LmpcSettings, OffsetHandling};

use crate::plants::{LtiPlant, Offsets, horizon, model, settings};

const STEPS: usize = 12;

fn controller_of(settings: &LmpcSettings) -> LmpcController {
    lmpc::controller(&model(), settings, STEPS, horizon()).unwrap()
}

/// A response that the model does not explain.
fn respond(k: usize, input: &[f64]) -> Vec<f64> {
    let ripple = (k as f64 * 0.7).sin();
    vec![0.8 * input[0] + 0.3 * ripple, input[1] - 0.2 * ripple]
}

#[test]
fn the_controller_keeps_its_contract() {
    for handling in [OffsetHandling::None, OffsetHandling::default()] {
        for past_steps in [None, Some(1), Some(4)] {
            let settings = LmpcSettings {
                offset_handling: handling,
                past_steps,
                ..settings()
            };
            let bounds = settings.input_bounds.clone();
            check_controller(
                &mut || Box::new(controller_of(&settings)),
                &bounds,
                &mut respond,
            )
            .unwrap();
            let mut limited = settings.clone();
            let changes = vec![Bounds::between(-0.1, 0.1), Bounds::between(-0.05, 0.2)];
            limited.options.input_change_bounds.clone_from(&changes);
            check_rate_limited_controller(
                &mut || Box::new(controller_of(&limited)),
                &bounds,
                &changes,
                &mut respond,
            )
            .unwrap();
        }
    }
}

/// Runs `steps` samples; `spoil` may change what is observed of sample k, or lose it.
fn run(
    controller: &mut dyn Controller,
    plant: &mut LtiPlant,
    steps: usize,
    spoil: impl Fn(usize, &mut [f64; 2]) -> bool,
) -> Vec<(Vec<f64>, Origin, Option<Fault>)> {
    let mut reference = controller.new_reference();
    let mut record = Vec::new();
    for k in 0..steps {
        reference.hold(&[0.0; 2], &[0.5, 0.2]).unwrap();
        let step = controller.decide(&reference);
        let input = step.input.clone();
        record.push((input.clone(), step.origin, step.fault));
        let mut output = [0.0; 2];
        plant.step(&input, &mut output).unwrap();
        if spoil(k, &mut output) {
            continue;
        }
        controller.observe_with_disturbances(&input, plant.measured_disturbances(), &output);
    }
    record
}

/// Where the disturbance held is right, a prediction replaces a missing output exactly: a controller
/// that saw all of the same samples decides the same whenever both plan.
#[test]
fn missing_outputs_and_lost_samples_leave_the_estimate_alone_on_an_exact_model() {
    let mut plant = LtiPlant::at(Offsets::default());
    plant.disturbance = Box::new(|_| 0.3);
    let (mut faulty, mut whole) = (controller_of(&settings()), controller_of(&settings()));
    let mut reference = faulty.new_reference();
    let (mut faults, mut compared) = (0, 0);
    for k in 0..60 {
        reference.hold(&[0.0; 2], &[0.5, 0.2]).unwrap();
        reference.hold_disturbances(&[0.3]).unwrap();
        let step = faulty.decide(&reference);
        let (input, fault) = (step.input.clone(), step.fault);
        let expected = &whole.decide(&reference).input;
        faults += u32::from(fault.is_some());
        if fault.is_none() && k >= 4 {
            compared += 1;
            for (u, v) in input.iter().zip(expected) {
                assert!((u - v).abs() < 1e-8, "step {k}: {u} and {v}");
            }
        }
        let mut output = [0.0; 2];
        plant.step(&input, &mut output).unwrap();
        let disturbance = plant.measured_disturbances();
        whole.observe_with_disturbances(&input, disturbance, &output);
        if k > 5 && k % 9 == 5 {
            continue;
        }
        if k % 9 == 7 {
            output[k % 2] = f64::NAN;
        }
        faulty.observe_with_disturbances(&input, disturbance, &output);
    }
    assert!(faults >= 10 && compared >= 40, "{faults}, {compared}");
}

/// A fault that cannot be repaired empties the window; when it is full again the state is
/// estimated anew, and nothing of the time before is left.
#[test]
fn after_an_outage_the_state_is_estimated_from_the_new_window() {
    let plant = || LtiPlant::at(Offsets::default());
    let mut controller = controller_of(&settings());
    let mut body = plant();
    run(&mut controller, &mut body, 20, |_, _| false);
    // Longer than any plan lasts.
    run(&mut controller, &mut body, 2 * STEPS, |_, output| {
        *output = [f64::NAN; 2];
        true
    });
    let after = run(&mut controller, &mut body, 30, |_, _| false);
    let first = after.iter().position(|(_, _, fault)| fault.is_none());
    assert!(first.is_some_and(|first| first <= 6), "{first:?}");
    // The plant is followed again: the outputs end where they should, as without the outage.
    let mut untouched = controller_of(&settings());
    let mut twin = plant();
    let expected = run(&mut untouched, &mut twin, 20 + 2 * STEPS + 30, |_, _| false);
    let (last, other) = (after.last().unwrap(), expected.last().unwrap());
    for (u, v) in last.0.iter().zip(&other.0) {
        assert!((u - v).abs() < 1e-3, "{u} and {v}");
    }
}

#[test]
fn equal_calls_give_equal_bits_and_reset_starts_anew() {
    let mut first = controller_of(&settings());
    let mut second = controller_of(&settings());
    let runs: Vec<_> = [&mut first, &mut second]
        .into_iter()
        .map(|controller| {
            let mut plant = LtiPlant::at(Offsets::default());
            run(controller, &mut plant, 40, |_, _| false)
        })
        .collect();
    assert_eq!(runs[0], runs[1]);
    first.reset();
    let mut plant = LtiPlant::at(Offsets::default());
    let again = run(&mut first, &mut plant, 40, |_, _| false);
    assert_eq!(runs[0], again);
}

/// A program that takes over starts from the window, also one that acted before.
#[test]
fn a_program_switched_to_knows_the_present_state() {
    let planner = || lmpc::planner(&model(), &settings(), STEPS).unwrap();
    let mut switched = controller_of(&settings());
    let mut plant = LtiPlant::at(Offsets::default());
    let mut alone = controller_of(&settings());
    let mut twin = LtiPlant::at(Offsets::default());
    let mut spare = planner();
    for _ in 0..4 {
        let found = run(&mut switched, &mut plant, 10, |_, _| false);
        let expected = run(&mut alone, &mut twin, 10, |_, _| false);
        for (found, expected) in found.iter().zip(&expected) {
            for (u, v) in found.0.iter().zip(&expected.0) {
                assert!((u - v).abs() < 1e-7, "{u} and {v}");
            }
        }
        spare = switched.switch_planner(spare).unwrap();
    }
}

/// Two equal models take turns: as one controller that never changes.
#[test]
fn a_scheduled_model_follows_while_another_acts() {
    let planner = || lmpc::planner(&model(), &settings(), STEPS).unwrap();
    let schedule = ScheduleSettings {
        ranges: Schedule {
            signal: "y1".into(),
            edges: vec![0.2],
            hysteresis: 0.0,
        },
        min_steps: 1,
        start: 0,
    };
    let planners = vec![planner(), planner()];
    let mut scheduled =
        ScheduledController::new(planners, horizon(), schedule, |now| now.output[0]).unwrap();
    let mut alone = controller_of(&settings());
    let mut plant = LtiPlant::at(Offsets::default());
    let mut twin = LtiPlant::at(Offsets::default());
    let found = run(&mut scheduled, &mut plant, 60, |_, _| false);
    let expected = run(&mut alone, &mut twin, 60, |_, _| false);
    for (found, expected) in found.iter().zip(&expected) {
        for (u, v) in found.0.iter().zip(&expected.0) {
            assert!((u - v).abs() < 1e-7, "{u} and {v}");
        }
    }
    assert_eq!(scheduled.data_set(), 1);
}
