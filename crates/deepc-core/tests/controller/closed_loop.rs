//! Tracking, bounds, origins and the first line of defence.

use deepc_core::controller::{
    Controller, DeepcController, Fault, Origin, Plant, RecedingHorizonSettings, Reference,
    contract, run_closed_loop,
};
use deepc_core::program::{
    AffineConstraint, Bounds, CondensedProgram, OutputBounds, PredictiveProgram, Slack, Softness,
    SparseProgram, Steps,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, ClarabelSettings, ClarabelSolver, QpStatus, SoftPenalty,
    SolveBudget,
};

use crate::common;
use crate::plants::{LtiPlant, controller, horizon, predictor, settings, to_the_target};

#[test]
fn the_plant_under_test_keeps_the_plant_contract() {
    let inputs: Vec<_> = (0..20).map(|k| vec![f64::from(k).sin(), 0.1]).collect();
    contract::check_plant(&mut || Box::new(LtiPlant::at_rest()), &inputs).unwrap();
}

#[test]
fn the_deepc_controller_keeps_the_controller_contract() {
    for moves in [1, 3] {
        let mut respond =
            |k: usize, u: &[f64]| vec![u[0] + 0.1 * (k as f64).sin(), u[1] - 0.5 * u[0]];
        contract::check_controller(
            &mut || Box::new(controller(moves)),
            &settings().input_bounds,
            &mut respond,
        )
        .unwrap();
    }
}

#[test]
fn the_closed_loop_reaches_the_target_within_bounds_and_uses_all_origins() {
    let (mut plant, mut controller) = (LtiPlant::at_rest(), controller(1));
    let run = run_closed_loop(&mut plant, &mut controller, 80, to_the_target).unwrap();
    assert!(
        run.origins[..4]
            .iter()
            .all(|&origin| origin == Origin::Passthrough)
    );
    for origin in [Origin::Solver, Origin::Unconstrained] {
        assert!(run.origins.contains(&origin), "{origin:?} does not occur");
    }
    let bounds = settings().input_bounds;
    for (channel, bounds) in bounds.iter().enumerate() {
        assert!(
            run.inputs
                .col(channel)
                .iter()
                .all(|&u| bounds.violation(u) == 0.0)
        );
    }
    assert!(
        (run.outputs[(39, 0)] - 1.0).abs() < 0.05,
        "{}",
        run.outputs[(39, 0)]
    );
    assert!(
        (run.outputs[(39, 1)] - 0.2).abs() < 0.05,
        "{}",
        run.outputs[(39, 1)]
    );
    assert!(run.outputs.col(0).iter().all(|&y| y <= 1.05 + 1e-3));
    assert!(run.outputs.row(79).norm_max() < 0.02);
}

#[test]
fn both_forms_decide_the_same_in_closed_loop() {
    let predictor = predictor();
    let program = SparseProgram::new(&predictor, &settings()).unwrap();
    let solver = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
    let mut sparse = DeepcController::new(Box::new(program), Box::new(solver), horizon(1)).unwrap();
    let run = |controller: &mut DeepcController| {
        run_closed_loop(&mut LtiPlant::at_rest(), controller, 60, to_the_target).unwrap()
    };
    let (sparse, condensed) = (run(&mut sparse), run(&mut controller(1)));
    let difference = common::largest_difference(&sparse.inputs, &condensed.inputs);
    assert!(difference < 1e-5, "{difference:e}");
}

#[test]
fn moves_between_solves_come_from_the_plan() {
    let (mut plant, mut controller) = (LtiPlant::at_rest(), controller(3));
    let run = run_closed_loop(&mut plant, &mut controller, 40, to_the_target).unwrap();
    for (k, origin) in run.origins.iter().enumerate().skip(4) {
        let expected_from_plan = (k - 4) % 3 != 0;
        assert_eq!(
            *origin == Origin::Plan,
            expected_from_plan,
            "step {k}: {origin:?}"
        );
    }
}

/// A controller with a full window and a plan, and the reference it follows.
fn running() -> (LtiPlant, DeepcController, Reference) {
    let (mut plant, mut controller) = (LtiPlant::at_rest(), controller(1));
    run_closed_loop(&mut plant, &mut controller, 10, to_the_target).unwrap();
    let mut reference = controller.new_reference();
    to_the_target(10, &mut reference).unwrap();
    (plant, controller, reference)
}

#[test]
fn a_nan_measurement_is_bridged_by_the_plan_and_reported() {
    let (mut plant, mut controller, reference) = running();
    let step = controller.decide(&reference);
    let (input, planned) = (step.input.clone(), step.predicted_inputs().to_owned());
    let mut output = [0.0; 2];
    plant.step(&input, &mut output).unwrap();
    controller.observe(&input, &[output[0], f64::NAN]);
    let step = controller.decide(&reference);
    assert_eq!(step.origin, Origin::Fallback);
    assert_eq!(step.fault, Some(Fault::MeasurementNotFinite));
    assert_eq!(step.repaired_samples, 1);
    for (channel, bounds) in settings().input_bounds.iter().enumerate() {
        assert_eq!(
            step.input[channel].to_bits(),
            bounds.clip(planned[(1, channel)]).to_bits()
        );
    }
    let input = step.input.clone();
    plant.step(&input, &mut output).unwrap();
    controller.observe(&input, &output);
    let step = controller.decide(&reference);
    assert!(
        matches!(step.origin, Origin::Solver | Origin::Unconstrained),
        "{:?}",
        step.origin
    );
    assert_eq!((step.fault, step.repaired_samples), (None, 1));
}

#[test]
fn without_measurements_the_plan_is_followed_to_its_end_and_its_last_input_held() {
    let (_, mut controller, reference) = running();
    let plan = controller.decide(&reference).predicted_inputs().to_owned();
    for row in 1..12 {
        let step = controller.decide(&reference);
        assert_eq!(
            (step.origin, step.fault),
            (Origin::Fallback, Some(Fault::MeasurementLost))
        );
        assert!((step.input[0] - plan[(row, 0)]).abs() < 1e-12);
    }
    let last = controller.step().input.clone();
    for _ in 0..3 {
        let step = controller.decide(&reference);
        assert_eq!(step.origin, Origin::Hold);
        assert_eq!(step.input, last, "the input applied last is held");
    }
}

#[test]
fn an_input_reported_with_a_lost_output_is_the_one_held() {
    let mut controller = controller(1);
    let reference = controller.new_reference();
    controller.decide(&reference);
    // Somebody else applied another input, and no output was measured.
    let applied = [0.25, -0.125];
    controller.observe(&applied, &[f64::NAN; 2]);
    let step = controller.decide(&reference);
    assert_eq!(
        (step.origin, step.fault),
        (Origin::Hold, Some(Fault::MeasurementNotFinite))
    );
    assert_eq!(step.input, applied);
}

#[test]
fn a_bad_sample_long_before_a_decision_does_not_block_it() {
    let mut controller = controller(1);
    controller.observe(&[0.0; 2], &[f64::NAN, 0.0]);
    for _ in 0..20 {
        controller.observe(&[0.0; 2], &[0.0; 2]);
    }
    let reference = controller.new_reference();
    let step = controller.decide(&reference);
    assert_eq!(step.fault, None);
    assert!(
        matches!(step.origin, Origin::Solver | Origin::Unconstrained),
        "{:?}",
        step.origin
    );
}

#[test]
fn a_solver_of_another_program_of_the_same_size_is_refused() {
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let mut other = settings();
    other.input_weights[0] *= 2.0;
    let other = CondensedProgram::new(&predictor(), &other).unwrap();
    let solver = ActiveSet::new(other.qp(), ActiveSetSettings::default()).unwrap();
    let message = DeepcController::new(Box::new(program), Box::new(solver), horizon(1))
        .err()
        .expect("the weights differ")
        .to_string();
    assert!(message.contains("another program of"), "{message}");
}

#[test]
fn an_infeasible_hard_output_bound_falls_back_and_says_so() {
    let mut settings = settings();
    // The start is outside, no input can change that at once, and without slack the data leave
    // no doubt about the start.
    settings.output_bounds[1] = OutputBounds::hard(0.9, 1.0);
    (settings.input_slack, settings.output_slack) = (Slack::Hard, Slack::Hard);
    let program = CondensedProgram::new(&predictor(), &settings).unwrap();
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    let mut controller =
        DeepcController::new(Box::new(program), Box::new(solver), horizon(1)).unwrap();
    let run = run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 6, to_the_target).unwrap();
    assert_eq!(run.origins[5], Origin::Hold);
    let step = controller.step();
    assert_eq!(
        (step.fault, step.status),
        (Some(Fault::SolveFailed), QpStatus::Infeasible)
    );
}

#[test]
fn a_soft_output_bound_that_cannot_be_met_is_violated_and_the_amount_reported() {
    let mut settings = settings();
    settings.output_bounds[1] = OutputBounds::soft(0.9, 1.0, 100.0, 10.0);
    let program = CondensedProgram::new(&predictor(), &settings).unwrap();
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    let mut controller =
        DeepcController::new(Box::new(program), Box::new(solver), horizon(1)).unwrap();
    let run = run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 6, to_the_target).unwrap();
    assert_eq!(run.origins[5], Origin::Solver);
    let step = controller.step();
    let missing = 0.9
        - step
            .predicted_outputs()
            .col(1)
            .iter()
            .fold(f64::INFINITY, |a, &b| a.min(b));
    assert!(missing > 0.1);
    assert!(
        (step.predicted_violation - missing).abs() < 1e-9,
        "{}",
        step.predicted_violation
    );
}

#[test]
fn an_affine_constraint_that_cannot_be_met_is_violated_and_the_amount_reported() {
    let mut settings = settings();
    settings.options.affine = vec![AffineConstraint {
        inputs: vec![0.0; 2],
        outputs: vec![1.0, -2.0],
        bounds: Bounds {
            lower: Some(5.0),
            upper: None,
        },
        softness: Softness::Soft(SoftPenalty {
            linear: 10.0,
            quadratic: 1.0,
        }),
        steps: Steps::All,
    }];
    let mut controller = DeepcController::condensed(&predictor(), &settings, horizon(2)).unwrap();
    let mut plant = LtiPlant::at_rest();
    let mut largest = 0.0_f64;
    for k in 0..8 {
        run_closed_loop(&mut plant, &mut controller, 1, to_the_target).unwrap();
        let step = controller.step();
        if k < 4 {
            assert_eq!(step.constraint_violation.to_bits(), 0);
            continue;
        }
        let outputs = step.predicted_outputs();
        let missing = (0..outputs.nrows()).map(|i| 5.0 - outputs[(i, 0)] + 2.0 * outputs[(i, 1)]);
        let missing = missing.fold(0.0, f64::max);
        if k % 2 == 0 {
            assert!(missing > 1.0 && (step.constraint_violation - missing).abs() < 1e-9);
        } else {
            // A later move of the same plan: what it violates over its whole horizon.
            assert_eq!(step.origin, Origin::Plan);
            assert!(step.constraint_violation >= missing - 1e-9);
        }
        largest = largest.max(step.constraint_violation);
    }
    let statistics = controller.statistics();
    assert_eq!(
        statistics.largest_constraint_violation.to_bits(),
        largest.to_bits()
    );
    // No output has bounds that are violated: the two are told apart.
    assert!(controller.step().predicted_violation < largest);
    let step = controller.decide(&Reference::zeros(3, 2, 2));
    assert!(step.origin.is_fallback());
    controller.reset();
    assert_eq!(controller.step().constraint_violation.to_bits(), 0);
}

#[test]
fn a_spent_budget_falls_back() {
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let solver = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
    let tight = RecedingHorizonSettings::every_sample(SolveBudget {
        max_iterations: 1,
        max_time_s: 1.0,
    });
    let mut controller = DeepcController::new(Box::new(program), Box::new(solver), tight).unwrap();
    let run = run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 6, to_the_target).unwrap();
    assert_eq!(run.origins[5], Origin::Hold);
    assert_eq!(controller.step().status, QpStatus::IterationLimit);
}

#[test]
fn settings_and_pairs_that_do_not_fit_are_refused_with_numbers() {
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let message = horizon(13).check(12).unwrap_err().to_string();
    assert!(
        message.contains("13") && message.contains("12"),
        "{message}"
    );
    let other = SparseProgram::new(&predictor(), &settings()).unwrap();
    let solver = ClarabelSolver::new(other.qp(), ClarabelSettings::default()).unwrap();
    let error = DeepcController::new(Box::new(program), Box::new(solver), horizon(1));
    let message = error.err().unwrap().to_string();
    assert!(
        message.contains("set it up with this program's `qp()`"),
        "{message}"
    );
}
