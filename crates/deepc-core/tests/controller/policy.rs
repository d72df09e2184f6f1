//! The order and limits of what acts when no plan can be made.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use deepc_core::controller::{
    Controller, DeepcController, FallbackPolicy, Fault, Origin, RecedingHorizonSettings, contract,
    run_closed_loop,
};
use deepc_core::program::{PredictiveProgram, SparseProgram};
use deepc_core::solver::{ClarabelSettings, ClarabelSolver, QpStatus, SolveBudget};

use crate::plants::{
    FaultySolver, LtiPlant, Mischief, Switch, faulty_controller, horizon, is_allowed, predictor,
    settings, to_the_target,
};

fn with_policy(policy: FallbackPolicy) -> RecedingHorizonSettings {
    RecedingHorizonSettings {
        fallback: policy,
        ..horizon(1)
    }
}

/// Plan for 2 samples, hold for 3.
fn short() -> RecedingHorizonSettings {
    with_policy(FallbackPolicy {
        max_plan_steps: Some(2),
        max_hold_steps: Some(3),
        second_solver_budget: None,
    })
}

/// After ten good samples the solver fails for `failures`; the origins from then on.
fn origins(
    controller: &mut DeepcController,
    switch: &Switch,
    failures: usize,
    more: usize,
) -> Vec<Origin> {
    let mut plant = LtiPlant::at_rest();
    *switch.lock().unwrap() = Mischief::None;
    run_closed_loop(&mut plant, controller, 10, to_the_target).unwrap();
    *switch.lock().unwrap() = Mischief::Ends(QpStatus::NumericalError);
    let bad = run_closed_loop(&mut plant, controller, failures, to_the_target).unwrap();
    *switch.lock().unwrap() = Mischief::None;
    let good = run_closed_loop(&mut plant, controller, more, to_the_target).unwrap();
    [bad.origins, good.origins].concat()
}

#[test]
fn plan_then_hold_then_the_user_each_within_its_limit() {
    let seen = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&seen);
    let (controller, switch) = faulty_controller(short());
    let mut controller = controller.with_user_fallback(move |context, input| {
        assert_eq!(context.past_inputs.shape(), (4, 2));
        assert_eq!(context.past_outputs.shape(), (4, 2));
        assert_eq!(context.past_disturbances.shape(), (4, 0));
        let newest = context.past_inputs.row(3);
        assert_eq!([newest[0], newest[1]].as_slice(), context.last_input);
        assert_eq!(input, context.last_input, "it finds the input applied last");
        assert_eq!(
            context.reference.outputs()[(0, 0)].to_bits(),
            1_f64.to_bits()
        );
        log.lock().unwrap().push((
            context.step,
            context.fault,
            context.status,
            context.fallback_steps,
        ));
        // Beyond the bounds, and NaN.
        input.copy_from_slice(&[7.0, f64::NAN]);
    });
    let found = origins(&mut controller, &switch, 7, 2);
    let expected = [
        [Origin::Fallback; 2].as_slice(),
        &[Origin::Hold; 3],
        &[Origin::User; 2],
        &[Origin::Solver; 2],
    ];
    assert_eq!(found, expected.concat());
    let (fault, status) = (Fault::SolveFailed, QpStatus::NumericalError);
    let expected = [(15, fault, status, 5), (16, fault, status, 6)];
    assert_eq!(*seen.lock().unwrap(), expected);
    let statistics = controller.statistics();
    assert_eq!(statistics.longest_fallback, 7);
    assert_eq!(statistics.fallback_steps, 0);
    // The limits count anew.
    let again = origins(&mut controller, &switch, 3, 1);
    let expected = [
        Origin::Fallback,
        Origin::Fallback,
        Origin::Hold,
        Origin::Solver,
    ];
    assert_eq!(again, expected);
}

#[test]
fn what_the_user_chooses_is_clipped_and_nan_is_replaced_by_the_last_input() {
    let (controller, switch) = faulty_controller(short());
    let mut controller = controller.with_user_fallback(|_, input| {
        input.copy_from_slice(&[7.0, f64::NAN]);
    });
    origins(&mut controller, &switch, 5, 0);
    let reference = controller.new_reference();
    let held = controller.step().input.clone();
    *switch.lock().unwrap() = Mischief::Nan;
    controller.observe(&held, &[0.5, 0.1]);
    let step = controller.decide(&reference);
    assert_eq!(
        (step.origin, step.origin_steps, step.fallback_steps),
        (Origin::User, 1, 6)
    );
    assert_eq!(
        step.input[0].to_bits(),
        0.8_f64.to_bits(),
        "the upper bound"
    );
    assert_eq!(step.input[1].to_bits(), held[1].to_bits());
    assert!(is_allowed(&step.input));
}

#[test]
fn without_a_user_the_input_is_held_on() {
    let (mut controller, switch) = faulty_controller(short());
    let found = origins(&mut controller, &switch, 9, 1);
    assert_eq!(found[..2], [Origin::Fallback; 2]);
    assert_eq!(found[2..9], [Origin::Hold; 7]);
    assert_eq!(found[9], Origin::Solver);
}

#[test]
fn the_user_may_come_first() {
    let (controller, switch) = faulty_controller(with_policy(FallbackPolicy {
        max_plan_steps: Some(0),
        max_hold_steps: Some(0),
        second_solver_budget: None,
    }));
    let mut controller = controller.with_user_fallback(|_, input| input.fill(0.1));
    let found = origins(&mut controller, &switch, 2, 1);
    assert_eq!(found, [Origin::User, Origin::User, Origin::Solver]);
}

#[test]
fn a_plan_that_was_left_is_neither_followed_nor_believed() {
    let (mut controller, switch) = faulty_controller(short());
    origins(&mut controller, &switch, 3, 0);
    assert_eq!(controller.step().origin, Origin::Hold);
    assert_eq!(controller.step().predicted_inputs().nrows(), 0);
    // The plan of sample 9 would predict this sample, but another input acted.
    let input = controller.step().input.clone();
    controller.observe(&input, &[f64::NAN; 2]);
    let reference = controller.new_reference();
    let step = controller.decide(&reference);
    assert_eq!((step.origin, step.repaired_samples), (Origin::Hold, 0));
    controller.observe(&input, &[0.0; 2]);
    let step = controller.decide(&reference);
    assert_eq!(
        (step.origin, step.fault),
        (Origin::Hold, Some(Fault::WindowRefilling))
    );
}

#[test]
fn the_user_is_told_the_decision_whatever_happens_to_the_statistics() {
    let (controller, switch) = faulty_controller(with_policy(FallbackPolicy {
        max_plan_steps: Some(0),
        max_hold_steps: Some(0),
        second_solver_budget: None,
    }));
    let seen = Arc::new(Mutex::new(Vec::new()));
    let log = Arc::clone(&seen);
    let mut controller =
        controller.with_user_fallback(move |context, _| log.lock().unwrap().push(context.step));
    origins(&mut controller, &switch, 2, 0);
    controller.reset_statistics();
    origins(&mut controller, &switch, 1, 0);
    controller.reset();
    origins(&mut controller, &switch, 1, 0);
    assert_eq!(*seen.lock().unwrap(), [10, 11, 22, 10]);
}

#[test]
fn a_second_solver_plans_as_the_first_would_have() {
    let (mut healthy, _) = faulty_controller(horizon(1));
    let (controller, switch) = faulty_controller(horizon(1));
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let second = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
    let mut controller = controller.with_second_solver(Box::new(second)).unwrap();
    *switch.lock().unwrap() = Mischief::Ends(QpStatus::TimeLimit);
    let run = |controller: &mut DeepcController| {
        run_closed_loop(&mut LtiPlant::at_rest(), controller, 60, to_the_target).unwrap()
    };
    let (expected, found) = (run(&mut healthy), run(&mut controller));
    assert!(
        found.origins[4..]
            .iter()
            .all(|&o| o == Origin::SecondSolver)
    );
    assert_eq!(expected.inputs, found.inputs);
    let step = controller.step();
    assert_eq!(step.fault, Some(Fault::SolveFailed));
    assert_eq!(
        (step.status, step.second_status),
        (QpStatus::TimeLimit, QpStatus::Solved)
    );
    assert_eq!((step.origin_steps, step.fallback_steps), (56, 0));
    assert!(step.tracking.is_some());
    let healthy = healthy.step();
    assert_eq!(step.iterations, 2 * healthy.iterations, "of both solvers");
}

#[test]
fn when_both_solvers_fail_the_plan_is_followed() {
    let (controller, first) = faulty_controller(horizon(1));
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let (second, switch) = FaultySolver::new(program.qp());
    let mut controller = controller.with_second_solver(Box::new(second)).unwrap();
    let mut plant = LtiPlant::at_rest();
    run_closed_loop(&mut plant, &mut controller, 6, to_the_target).unwrap();
    *first.lock().unwrap() = Mischief::Nan;
    *switch.lock().unwrap() = Mischief::Ends(QpStatus::IterationLimit);
    let run = run_closed_loop(&mut plant, &mut controller, 2, to_the_target).unwrap();
    assert_eq!(run.origins, [Origin::Fallback; 2]);
    assert_eq!(controller.step().status, QpStatus::NumericalError);
    assert_eq!(controller.step().second_status, QpStatus::IterationLimit);
}

#[test]
fn a_second_solver_has_its_own_budget_and_its_own_program_is_refused() {
    let (controller, switch) = faulty_controller(with_policy(FallbackPolicy {
        second_solver_budget: Some(SolveBudget {
            max_iterations: 1,
            max_time_s: f64::INFINITY,
        }),
        ..FallbackPolicy::standard()
    }));
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let second = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
    let mut controller = controller.with_second_solver(Box::new(second)).unwrap();
    origins(&mut controller, &switch, 1, 0);
    assert_eq!(controller.step().second_status, QpStatus::IterationLimit);

    let mut other = settings();
    other.output_weights[1] = 2.0;
    let other = SparseProgram::new(&predictor(), &other).unwrap();
    let second = ClarabelSolver::new(other.qp(), ClarabelSettings::default()).unwrap();
    let message = controller
        .with_second_solver(Box::new(second))
        .err()
        .unwrap()
        .to_string();
    assert!(message.contains("another program of"), "{message}");
}

#[test]
fn a_late_plan_is_marked_and_used_unless_it_shall_be_discarded() {
    for discard_late in [false, true] {
        let (mut controller, switch) = faulty_controller(RecedingHorizonSettings {
            // Far above what a solve takes here, even on a busy machine.
            deadline_s: Some(1.0),
            discard_late,
            ..horizon(1)
        });
        let mut plant = LtiPlant::at_rest();
        run_closed_loop(&mut plant, &mut controller, 6, to_the_target).unwrap();
        assert!(!controller.step().late);
        *switch.lock().unwrap() = Mischief::Sleeps(Duration::from_millis(1050));
        run_closed_loop(&mut plant, &mut controller, 1, to_the_target).unwrap();
        let step = controller.step();
        assert!(step.late);
        assert_eq!(step.status, QpStatus::Solved);
        let expected = if discard_late {
            (Origin::Fallback, Some(Fault::DeadlineMissed))
        } else {
            (Origin::Solver, None)
        };
        assert_eq!((step.origin, step.fault), expected);
        assert_eq!(step.tracking.is_none(), discard_late);
        assert_eq!(controller.statistics().deadline_misses, 1);
    }
}

#[test]
fn the_contract_holds_with_every_policy() {
    let mut respond = |k: usize, u: &[f64]| vec![u[0] + 0.1 * (k as f64).sin(), u[1] - 0.5 * u[0]];
    for policy in [FallbackPolicy::standard(), short().fallback] {
        let make = || -> Box<dyn Controller> {
            let (controller, switch) = faulty_controller(with_policy(policy));
            *switch.lock().unwrap() = Mischief::Nan;
            Box::new(controller.with_user_fallback(|context, input| {
                input.fill(if context.step % 2 == 0 {
                    f64::NAN
                } else {
                    1e300
                });
            }))
        };
        contract::check_controller(&mut { make }, &settings().input_bounds, &mut respond).unwrap();
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let says = |change: fn(&mut RecedingHorizonSettings), part: &str| {
        let mut settings = horizon(1);
        change(&mut settings);
        let message = settings.check(12).unwrap_err().to_string();
        assert!(message.contains(part), "`{part}` is not in: {message}");
    };
    says(|s| s.deadline_s = Some(0.0), "`deadline_s` is 0 s");
    says(|s| s.deadline_s = Some(f64::NAN), "`deadline_s` is NaN s");
    says(
        |s| s.discard_late = true,
        "`discard_late` is set without `deadline_s`",
    );
    says(|s| s.frozen_after = Some(0), "`frozen_after` is 0");
    says(|s| s.budget.max_iterations = 0, "`budget` is 0 iterations");
    says(
        |s| {
            s.fallback.second_solver_budget = Some(SolveBudget {
                max_iterations: 1,
                max_time_s: -1.0,
            });
        },
        "`fallback.second_solver_budget` is 1 iterations and -1 s",
    );
}

#[test]
fn settings_written_before_there_was_a_policy_are_read() {
    let text = r#"{"moves_per_solve": 1, "budget": {"max_iterations": 9, "max_time_s": 0.5}}"#;
    let read: RecedingHorizonSettings = serde_json::from_str(text).unwrap();
    let budget = SolveBudget {
        max_iterations: 9,
        max_time_s: 0.5,
    };
    assert_eq!(read, RecedingHorizonSettings::every_sample(budget));
    let written = serde_json::to_string(&read).unwrap();
    assert_eq!(
        serde_json::from_str::<RecedingHorizonSettings>(&written).unwrap(),
        read
    );
    assert!(written.contains("\"max_hold_steps\":10"), "{written}");
    let misspelt = text.replace("budget", "buget");
    assert!(serde_json::from_str::<RecedingHorizonSettings>(&misspelt).is_err());
}

#[test]
fn a_policy_written_in_part_keeps_the_other_standard_limits_and_null_means_none() {
    let read = |text: &str| serde_json::from_str::<FallbackPolicy>(text);
    let standard = FallbackPolicy::standard();
    assert_eq!(read("{}").unwrap(), standard);
    let expected = FallbackPolicy {
        max_plan_steps: Some(3),
        ..standard
    };
    assert_eq!(read(r#"{"max_plan_steps": 3}"#).unwrap(), expected);
    let for_ever = FallbackPolicy {
        max_hold_steps: None,
        ..standard
    };
    assert_eq!(read(r#"{"max_hold_steps": null}"#).unwrap(), for_ever);
    assert!(read(r#"{"max_holds": 3}"#).is_err());
    for policy in [standard, expected, for_ever] {
        let written = serde_json::to_string(&policy).unwrap();
        assert_eq!(read(&written).unwrap(), policy, "{written}");
    }
}
