//! Hard bounds on the input changes, whoever decides.

use deepc_core::controller::{
    Controller, DeepcController, FallbackPolicy, Fault, Origin, Planner, RecedingHorizonSettings,
    contract, run_closed_loop,
};
use deepc_core::program::{Bounds, DeepcSettings, PredictiveProgram, SparseProgram};
use deepc_core::solver::QpStatus;

use crate::plants::{
    FaultySolver, LtiPlant, Mischief, Switch, horizon, predictor, settings, to_the_target,
};

/// One input may change by 0.05 either way, the other one only rise slowly.
fn changes() -> Vec<Bounds> {
    let slow_up = Bounds {
        lower: None,
        upper: Some(0.1),
    };
    vec![Bounds::between(-0.05, 0.05), slow_up]
}

fn limited(changes: &[Bounds]) -> DeepcSettings {
    let mut settings = settings();
    settings.options.input_change_bounds = changes.to_vec();
    settings
}

fn condensed(moves_per_solve: usize) -> DeepcController {
    DeepcController::condensed(&predictor(), &limited(&changes()), horizon(moves_per_solve))
        .unwrap()
}

/// In the sparse form, which asks its solver in every step; without a plan the user jumps.
fn jumping(policy: FallbackPolicy) -> (DeepcController, Switch) {
    let program = SparseProgram::new(&predictor(), &limited(&changes())).unwrap();
    let (solver, switch) = FaultySolver::new(program.qp());
    let horizon = RecedingHorizonSettings {
        fallback: policy,
        ..horizon(1)
    };
    let controller = DeepcController::new(Box::new(program), Box::new(solver), horizon).unwrap();
    let controller = controller.with_user_fallback(|context, input| {
        input.copy_from_slice(match context.step % 3 {
            0 => &[1e300, -1e300],
            1 => &[-f64::MAX, f64::MAX],
            _ => &[f64::NAN, 0.0],
        });
    });
    (controller, switch)
}

fn respond(k: usize, u: &[f64]) -> Vec<f64> {
    vec![u[0] + 0.1 * (k as f64).sin(), u[1] - 0.5 * u[0]]
}

#[test]
fn the_contract_holds_with_bounds_on_changes_under_every_fault() {
    let check = |make: &mut dyn FnMut() -> Box<dyn Controller>| {
        let bounds = settings().input_bounds;
        contract::check_rate_limited_controller(make, &bounds, &changes(), &mut respond).unwrap();
    };
    for moves in [1, 3] {
        check(&mut || Box::new(condensed(moves)));
    }
    let user_at_once = FallbackPolicy {
        max_plan_steps: Some(1),
        max_hold_steps: Some(1),
        second_solver_budget: None,
    };
    for policy in [FallbackPolicy::standard(), user_at_once] {
        for mischief in [Mischief::None, Mischief::Ends(QpStatus::NumericalError)] {
            check(&mut || {
                let (controller, switch) = jumping(policy);
                *switch.lock().unwrap() = mischief;
                Box::new(controller)
            });
        }
    }
}

#[test]
fn the_contract_notices_a_change_that_is_too_large() {
    let free = || DeepcController::condensed(&predictor(), &settings(), horizon(1)).unwrap();
    let violation = contract::check_rate_limited_controller(
        &mut || Box::new(free()),
        &settings().input_bounds,
        &changes(),
        &mut respond,
    );
    assert_eq!(violation.unwrap_err().clause, 2);
}

#[test]
fn passthrough_changes_no_faster_than_allowed() {
    let mut controller = condensed(1);
    let mut reference = controller.new_reference();
    let mut decide = |controller: &mut DeepcController, input: [f64; 2]| {
        reference.hold(&input, &[0.0; 2]).unwrap();
        let step = controller.decide(&reference);
        assert_eq!(step.origin, Origin::Passthrough);
        step.input.clone()
    };
    // Nothing was applied before the first sample.
    assert_eq!(decide(&mut controller, [0.3, 0.5]), [0.3, 0.5]);
    controller.observe(&[0.1, 0.2], &[0.0; 2]);
    // From what was applied, not from what was decided; falling is free.
    assert_eq!(decide(&mut controller, [0.7, 0.5]), [0.1 + 0.05, 0.2 + 0.1]);
    controller.observe(&[0.0, 0.2], &[0.0; 2]);
    assert_eq!(decide(&mut controller, [-0.3, -0.5]), [-0.05, -0.5]);
}

#[test]
fn the_input_bounds_win_over_those_of_the_changes() {
    let mut controller = condensed(1);
    let mut reference = controller.new_reference();
    reference.hold(&[0.0; 2], &[0.0; 2]).unwrap();
    controller.decide(&reference);
    // Far outside on both sides.
    controller.observe(&[2.0, -2.0], &[0.0; 2]);
    assert_eq!(controller.decide(&reference).input, [0.8, -0.5]);
}

#[test]
fn a_program_that_takes_over_starts_from_the_input_applied_last() {
    for moves in [1, 3] {
        let mut controller =
            DeepcController::condensed(&predictor(), &settings(), horizon(moves)).unwrap();
        let mut plant = LtiPlant::at_rest();
        // The plan has large moves ahead.
        run_closed_loop(&mut plant, &mut controller, 42, to_the_target).unwrap();
        let tight = [Bounds::between(-0.01, 0.01), Bounds::between(-0.01, 0.01)];
        let planner = Planner::condensed(&predictor(), &limited(&tight)).unwrap();
        let mut last = controller.step().input.clone();
        controller.switch_planner(planner).unwrap();
        // By the plan of the old program at first, and by none at all in the end.
        let reference = controller.new_reference();
        let mut origins = Vec::new();
        for k in 0..20 {
            let step = controller.decide(&reference);
            let (input, origin) = (step.input.clone(), step.origin);
            for (u, before) in input.iter().zip(&last) {
                assert!((u - before).abs() < 0.01 + 1e-12, "sample {k}, {origin:?}");
            }
            origins.push(origin);
            last.clone_from(&input);
            if k < 3 {
                controller.observe(&input, &[0.5, 0.1]);
            }
        }
        assert!(origins.contains(&Origin::Hold), "{origins:?}");
        assert_eq!(controller.step().fault, Some(Fault::MeasurementLost));
    }
}
