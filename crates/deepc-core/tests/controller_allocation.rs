//! Deciding and observing allocate nothing, whatever goes wrong. The counting allocator of
//! `allocation-counter` serves this test binary alone.

mod common;
#[path = "controller/plants.rs"]
#[allow(dead_code)]
mod plants;

use allocation_counter::measure;
use deepc_core::controller::{Controller, DeepcController, RecedingHorizonSettings, Reference};
use deepc_core::program::{
    AffineConstraint, Bounds, CondensedProgram, PredictiveProgram, ProgramOptions, Softness, Steps,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, SoftPenalty, SolveBudget,
};
use plants::{controller_from, disturbed_predictor, horizon, predictor, settings};

/// Two hundred samples with every kind of fault; what they allocate.
fn allocations(controller: &mut dyn Controller) -> u64 {
    let q = controller.disturbances();
    let mut reference = controller.new_reference();
    let mut bad = controller.new_reference();
    bad.hold(&[0.0; 2], &[f64::NAN; 2]).unwrap();
    let foreign = Reference::zeros(3, 2, 2);
    let mut fallbacks = 0;
    let info = measure(|| {
        for k in 0..200_u32 {
            let target = if k % 40 < 20 { [1.0, 0.2] } else { [-1.0, 0.0] };
            reference.hold(&[0.0; 2], &target).unwrap();
            let reference = match k % 23 {
                7 => &bad,
                8 => &foreign,
                _ => &reference,
            };
            let step = controller.decide(reference);
            fallbacks += u32::from(step.origin.is_fallback());
            let mut input = [step.input[0], step.input[1]];
            let mut output = [0.5 * input[0] + 0.1 * f64::from(k).sin(), input[1]];
            let mut disturbance = [0.1, f64::from(k % 5)];
            match k % 29 {
                3 => output[1] = f64::NAN,
                4 => input[0] = f64::INFINITY,
                5 => disturbance[0] = f64::NAN,
                6 => continue,
                _ => {}
            }
            let length = if k % 31 == 9 { 1 } else { 2 };
            controller.observe_with_disturbances(&input, &disturbance[..q], &output[..length]);
            // An outage longer than any plan.
            if (100..120).contains(&k) {
                controller.observe_with_disturbances(&[], &[], &[]);
            }
        }
        controller.reset();
    });
    assert!(fallbacks > 20, "{fallbacks} steps fell back");
    info.count_total
}

#[test]
fn a_step_allocates_nothing() {
    let mut controllers: Vec<DeepcController> = [predictor(), disturbed_predictor()]
        .iter()
        .map(controller_from)
        .collect();
    // Rate limits, a cost of changes and an affine constraint.
    let mut limited = settings();
    limited.options = ProgramOptions {
        input_change_weights: vec![0.1; 2],
        input_change_bounds: vec![Bounds::between(-0.2, 0.2); 2],
        affine: vec![AffineConstraint {
            inputs: vec![1.0, 1.0],
            outputs: vec![0.0, 0.5],
            bounds: Bounds::between(-1.0, 1.0),
            softness: Softness::Soft(SoftPenalty {
                linear: 10.0,
                quadratic: 1.0,
            }),
            steps: Steps::All,
        }],
        ..ProgramOptions::default()
    };
    controllers.push(DeepcController::condensed(&predictor(), &limited, horizon(1)).unwrap());
    // A first solver that gives up at once, and a second one.
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let first = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    let second = Admm::new(program.qp(), AdmmSettings::default()).unwrap();
    let mut tight = RecedingHorizonSettings {
        budget: SolveBudget {
            max_iterations: 1,
            max_time_s: f64::INFINITY,
        },
        deadline_s: Some(1e-9),
        frozen_after: Some(3),
        ..horizon(2)
    };
    tight.fallback.second_solver_budget = Some(SolveBudget::generous());
    tight.fallback.max_plan_steps = Some(1);
    tight.fallback.max_hold_steps = Some(1);
    let controller = DeepcController::new(Box::new(program), Box::new(first), tight).unwrap();
    let controller = controller.with_second_solver(Box::new(second)).unwrap();
    controllers.push(controller.with_user_fallback(|_, input| input.fill(0.1)));
    for (kind, controller) in controllers.iter_mut().enumerate() {
        assert_eq!(allocations(controller), 0, "controller {kind}");
    }
}
