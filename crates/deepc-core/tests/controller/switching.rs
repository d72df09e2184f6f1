//! Programs that take over from each other in the running loop.

use deepc_core::controller::{
    Controller, DeepcController, Fault, Origin, Planner, Plant, ScheduleContext, ScheduleSettings,
    ScheduledController, contract, run_closed_loop,
};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::{Predictor, Schedule, ScheduledPredictors};
use deepc_core::program::{CondensedProgram, DeepcSettings, PredictiveProgram};
use deepc_core::solver::{ActiveSet, ActiveSetSettings};

use crate::common;
use crate::plants::{
    LtiPlant, controller, disturbed_predictor, horizon, learn, predictor, settings, to_the_target,
};

fn planner(predictor: &Predictor, settings: &DeepcSettings) -> Planner {
    let program = CondensedProgram::new(predictor, settings).unwrap();
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    Planner::new(Box::new(program), Box::new(solver)).unwrap()
}

#[test]
fn a_program_that_takes_over_keeps_the_window_and_decides_as_if_it_had_always_been_there() {
    let mut other = settings();
    other.output_weights = vec![3.0, 0.5];
    let (mut plant, mut switched) = (LtiPlant::at_rest(), controller(1));
    run_closed_loop(&mut plant, &mut switched, 10, to_the_target).unwrap();
    let old = switched
        .switch_planner(planner(&predictor(), &other))
        .unwrap();
    assert_eq!(old.program().stage(), &settings().stage());
    assert_eq!(switched.program().stage(), &other.stage());

    // A controller of the other program that saw the same samples.
    let mut fresh =
        DeepcController::with_planner(planner(&predictor(), &other), horizon(1)).unwrap();
    let mut twin = LtiPlant::at_rest();
    let mut first = controller(1);
    let mut reference = first.new_reference();
    for k in 0..10 {
        to_the_target(k, &mut reference).unwrap();
        let (input, mut output) = (first.decide(&reference).input.clone(), [0.0; 2]);
        twin.step(&input, &mut output).unwrap();
        first.observe(&input, &output);
        fresh.observe(&input, &output);
    }
    let expected = fresh.decide(&reference).input.clone();
    let found = switched.decide(&reference);
    assert!(matches!(
        found.origin,
        Origin::Solver | Origin::Unconstrained
    ));
    for (u, v) in found.input.iter().zip(&expected) {
        assert!((u - v).abs() < 1e-9, "{u}, {v}");
    }
}

#[test]
fn the_old_plan_is_followed_when_the_new_program_cannot_plan_at_once() {
    let (mut plant, mut controller) = (LtiPlant::at_rest(), controller(1));
    run_closed_loop(&mut plant, &mut controller, 9, to_the_target).unwrap();
    let mut reference = controller.new_reference();
    to_the_target(9, &mut reference).unwrap();
    let planned = controller.decide(&reference).predicted_inputs().to_owned();
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    controller
        .switch_program(Box::new(program), Box::new(solver))
        .unwrap();
    // The sample is lost.
    let step = controller.decide(&reference);
    assert_eq!(
        (step.origin, step.fault),
        (Origin::Fallback, Some(Fault::MeasurementLost))
    );
    assert!((step.input[0] - planned[(1, 0)]).abs() < 1e-12);
    assert_eq!(step.predicted_outputs().nrows(), 11);
}

#[test]
fn a_program_of_another_shape_or_clock_is_refused_and_nothing_changes() {
    let mut controller = controller(1);
    let message = controller
        .switch_planner(planner(&disturbed_predictor(), &settings()))
        .err()
        .unwrap()
        .to_string();
    assert!(
        message.contains("2 inputs, 2 measured disturbances"),
        "{message}"
    );
    assert!(
        message.contains("the running one 2, 0, 2, 4 and 12"),
        "{message}"
    );

    let (inputs, outputs) = {
        let system = common::Lti::random(3, 2, 2, 0.9, 5);
        common::record(&system, 200, 0.0, 5)
    };
    let mut slow = Dataset::new(0.2, common::names("u", 2), common::names("y", 2)).unwrap();
    slow.push_record(inputs, outputs).unwrap();
    let hankel = HankelMatrix::build(&slow, Horizons::new(4, 12)).unwrap();
    let slow = Predictor::exact(&hankel.require_persistently_exciting(3).unwrap()).unwrap();
    let result = controller.switch_planner(planner(&slow, &settings()));
    let message = result.err().unwrap().to_string();
    assert!(
        message.contains("0.2 s, the running one's 0.1 s"),
        "{message}"
    );

    let run = run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 40, to_the_target);
    assert!((run.unwrap().outputs[(39, 0)] - 1.0).abs() < 0.05);
}

fn schedule(edge: f64, hysteresis: f64) -> Schedule {
    Schedule {
        signal: "gain".into(),
        edges: vec![edge],
        hysteresis,
    }
}

/// Two data sets of the plant, whose input gain is 1 in the first and 4 in the second.
fn two_data_sets(
    schedule: ScheduleSettings,
    signal: impl FnMut(&ScheduleContext<'_>) -> f64 + Send + 'static,
) -> ScheduledController {
    let mut strong = LtiPlant::at_rest();
    strong.gain = 4.0;
    let planners = [predictor(), learn(strong)].map(|p| planner(&p, &settings()));
    ScheduledController::new(planners.into(), horizon(1), schedule, signal).unwrap()
}

/// Scheduled by an external signal, the gain.
fn scheduled(min_steps: usize) -> ScheduledController {
    let schedule = ScheduleSettings {
        ranges: schedule(2.5, 0.5),
        min_steps,
        start: 0,
    };
    two_data_sets(schedule, |context| context.external.unwrap_or(1.0))
}

/// Output error of a run in which the gain changes from 1 to 4 after 20 samples and back after
/// 40 more, and which data set acted when. `announce` tells the controller.
fn with_changing_gain<C: Controller>(
    controller: &mut C,
    announce: impl Fn(&mut C, f64),
) -> (f64, Vec<usize>) {
    let mut plant = LtiPlant::at_rest();
    let mut reference = controller.new_reference();
    let (mut cost, mut acted) = (0.0, Vec::new());
    for k in 0..80 {
        plant.gain = gain_at(k);
        announce(controller, plant.gain);
        let target = if k % 20 < 10 { [1.0, 0.2] } else { [0.2, -0.2] };
        reference.hold(&[0.0; 2], &target).unwrap();
        let step = controller.decide(&reference);
        acted.push(step.data_set);
        let (input, mut output) = (step.input.clone(), [0.0; 2]);
        plant.step(&input, &mut output).unwrap();
        controller.observe(&input, &output);
        if k >= 20 {
            cost += (output[0] - target[0]).powi(2) + (output[1] - target[1]).powi(2);
        }
    }
    (cost, acted)
}

fn gain_at(k: usize) -> f64 {
    if (20..60).contains(&k) { 4.0 } else { 1.0 }
}

#[test]
fn the_data_set_for_the_operating_point_acts_and_controls_better_than_one_for_all() {
    let (fixed_cost, _) = with_changing_gain(&mut controller(1), |_, _| ());
    let mut scheduled = scheduled(0);
    let (cost, acted) =
        with_changing_gain(&mut scheduled, ScheduledController::set_external_signal);
    for (k, set) in acted.iter().enumerate() {
        assert_eq!(*set, usize::from((20..60).contains(&k)), "sample {k}");
    }
    assert!(1.2 * cost < fixed_cost, "{cost}, {fixed_cost}");
    assert_eq!(scheduled.statistics().steps, 80);
    assert_eq!(scheduled.statistics().longest_fallback, 0);
}

#[test]
fn from_predictors_it_is_the_same_as_from_planners() {
    let mut strong = LtiPlant::at_rest();
    strong.gain = 4.0;
    let predictors =
        ScheduledPredictors::new(schedule(2.5, 0.5), vec![predictor(), learn(strong)]).unwrap();
    let signal = |context: &ScheduleContext<'_>| context.external.unwrap_or(1.0);
    let mut short =
        ScheduledController::from_predictors(&predictors, &settings(), horizon(1), 3, signal)
            .unwrap();
    let announce = ScheduledController::set_external_signal;
    let expected = with_changing_gain(&mut scheduled(3), announce);
    let found = with_changing_gain(&mut short, announce);
    assert_eq!(found.0.to_bits(), expected.0.to_bits());
    assert_eq!(found.1, expected.1);

    let mut wrong = settings();
    wrong.output_weights = vec![1.0];
    let result = ScheduledController::from_predictors(&predictors, &wrong, horizon(1), 0, signal);
    let message = result.err().unwrap().to_string();
    assert!(message.contains("`output_weights`"), "{message}");
}

#[test]
fn a_switch_waits_for_the_band_to_be_left_and_the_least_time_to_pass() {
    let mut controller = scheduled(3);
    let reference = controller.new_reference();
    let mut acted = Vec::new();
    // Up into the band, beyond it, back into it, below it.
    for signal in [1.0, 2.9, 2.9, 2.9, 3.1, 3.1, 1.0, 1.0, 1.0, 1.0, 1.0] {
        controller.set_external_signal(signal);
        let step = controller.decide(&reference);
        acted.push(step.data_set);
        controller.observe(&[0.0; 2], &[0.0; 2]);
    }
    // Three decisions, 4 to 6, and not one more.
    assert_eq!(acted, [0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0]);
    assert_eq!(controller.data_set(), 0);
}

#[test]
fn the_data_set_to_start_with_gives_way_at_once_and_the_next_one_after_its_time() {
    let mut controller = scheduled(3);
    let reference = controller.new_reference();
    controller.observe(&[0.0; 2], &[0.0; 2]);
    let mut acted = Vec::new();
    for signal in [4.0, 1.0, 1.0, 4.0, 1.0, 1.0, 4.0] {
        controller.set_external_signal(signal);
        acted.push(controller.decide(&reference).data_set);
        controller.observe(&[0.0; 2], &[0.0; 2]);
    }
    assert_eq!(acted, [1, 1, 1, 1, 0, 0, 0]);
}

#[test]
fn a_signal_that_is_nan_is_reported_and_the_data_set_stays() {
    let mut controller = scheduled(0);
    let reference = controller.new_reference();
    for k in 0..12 {
        controller.set_external_signal(if k < 8 { 4.0 } else { f64::NAN });
        let step = controller.decide(&reference);
        let expected = (k >= 8).then_some(Fault::ScheduleNotFinite);
        assert_eq!(step.fault, expected, "sample {k}");
        assert!(!step.origin.is_fallback());
        assert_eq!(step.data_set, usize::from(k > 0));
        controller.observe(&[0.0; 2], &[0.0; 2]);
    }
    controller.reset();
    assert_eq!(
        (controller.data_set(), controller.statistics().steps),
        (0, 0)
    );
}

#[test]
fn the_scheduled_controller_keeps_the_controller_contract() {
    let mut respond = |k: usize, u: &[f64]| vec![u[0] + 0.1 * (k as f64).sin(), u[1] - 0.5 * u[0]];
    let mut make = || -> Box<dyn Controller> { Box::new(by_output()) };
    contract::check_controller(&mut make, &settings().input_bounds, &mut respond).unwrap();
}

/// Switches by the first output, which crosses the boundary often.
fn by_output() -> ScheduledController {
    let schedule = ScheduleSettings {
        ranges: schedule(0.0, 0.005),
        min_steps: 0,
        start: 1,
    };
    two_data_sets(schedule, |context| context.output[0])
}

#[test]
fn data_sets_that_do_not_belong_together_are_refused() {
    let settings_of = ScheduleSettings {
        ranges: schedule(0.0, 0.05),
        min_steps: 0,
        start: 0,
    };
    let refused = |predictors: &[Predictor]| {
        let planners = predictors.iter().map(|p| planner(p, &settings())).collect();
        ScheduledController::new(planners, horizon(1), settings_of.clone(), |_| 0.0)
            .err()
            .unwrap()
            .to_string()
    };
    let message = refused(&[predictor(), disturbed_predictor()]);
    assert!(message.contains("only programs of one shape"), "{message}");
    let message = refused(&[predictor()]);
    assert!(message.contains("2 ranges for 1 data sets"), "{message}");
    let message = refused(&[]);
    assert!(message.contains("2 ranges for 0 data sets"), "{message}");
    let says = |change: fn(&mut ScheduleSettings), part: &str| {
        let mut settings = settings_of.clone();
        change(&mut settings);
        let message = settings.check(2).unwrap_err().to_string();
        assert!(message.contains(part), "`{part}` is not in: {message}");
    };
    says(|s| s.start = 2, "`start` is data set 2; there are 2");
    says(|s| s.ranges.edges[0] = f64::NAN, "NaN");
    says(|s| s.ranges.hysteresis = -1.0, "-1");
}
