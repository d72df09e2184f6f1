//! Measured disturbances in the control loop, with and without preview.

use deepc_core::controller::{
    ClosedLoopRun, Controller, ControllerError, DeepcController, Fault, Origin, Plant, Reference,
    contract, run_closed_loop,
};
use faer::Mat;

use crate::plants::{LtiPlant, controller, controller_from, disturbed_predictor, settings};

/// Two square waves of different periods.
fn waves(k: usize) -> [f64; 2] {
    let wave = |period: usize| if k % period < period / 2 { 0.5 } else { -0.5 };
    [wave(16), wave(22)]
}

fn run(
    measures: bool,
    controller: &mut DeepcController,
    refer: impl FnMut(usize, &mut Reference) -> Result<(), ControllerError>,
) -> ClosedLoopRun {
    run_closed_loop(
        &mut LtiPlant::disturbed(measures, waves),
        controller,
        120,
        refer,
    )
    .unwrap()
}

fn cost(run: &ClosedLoopRun) -> f64 {
    run.outputs.as_ref().subrows(20, 100).squared_norm_l2()
}

#[test]
fn a_previewed_disturbance_is_compensated_better_than_a_measured_one_than_an_unmeasured_one() {
    let predictor = disturbed_predictor();
    let ahead = |k: usize, reference: &mut Reference| {
        let preview = Mat::from_fn(12, 2, |i, channel| waves(k + i)[channel]);
        reference.preview_disturbances(preview.as_ref())
    };
    let nothing = |_: usize, _: &mut Reference| Ok(());
    let previewed = run(true, &mut controller_from(&predictor), ahead);
    let measured = run(true, &mut controller_from(&predictor), nothing);
    let unmeasured = run(false, &mut controller(1), nothing);
    let (previewed_cost, measured_cost, unmeasured_cost) =
        (cost(&previewed), cost(&measured), cost(&unmeasured));
    assert!(
        2.0 * previewed_cost < measured_cost && 1.2 * measured_cost < unmeasured_cost,
        "{previewed_cost}, {measured_cost}, {unmeasured_cost}"
    );
    for k in [0, 50, 119] {
        for (channel, wave) in waves(k).into_iter().enumerate() {
            assert_eq!(
                measured.disturbances[(k, channel)].to_bits(),
                wave.to_bits()
            );
        }
    }
    assert_eq!(unmeasured.disturbances.shape(), (120, 0));
}

#[test]
fn a_perfect_preview_makes_the_prediction_exact() {
    let mut controller = controller_from(&disturbed_predictor());
    let mut plant = LtiPlant::disturbed(true, waves);
    let mut reference = controller.new_reference();
    let mut predicted = [f64::NAN; 2];
    for k in 0..60 {
        let preview = Mat::from_fn(12, 2, |i, channel| waves(k + i)[channel]);
        reference.preview_disturbances(preview.as_ref()).unwrap();
        let step = controller.decide(&reference);
        if k >= 4 {
            predicted = [0, 1].map(|channel| step.predicted_outputs()[(0, channel)]);
        }
        let (input, mut output) = (step.input.clone(), [0.0; 2]);
        plant.step(&input, &mut output).unwrap();
        for (y, prediction) in output.iter().zip(predicted).skip(if k < 4 { 2 } else { 0 }) {
            assert!(
                (y - prediction).abs() < 1e-4,
                "sample {k}: {y}, {prediction}"
            );
        }
        controller.observe_with_disturbances(&input, plant.measured_disturbances(), &output);
    }
}

#[test]
fn a_missing_disturbance_is_held_reported_and_does_not_stop_control() {
    let mut controller = controller_from(&disturbed_predictor());
    let reference = controller.new_reference();
    let decide = |controller: &mut DeepcController| {
        let step = controller.decide(&reference);
        (step.origin, step.fault, step.repaired_samples)
    };
    // The first disturbance is bad, and there is none to hold: the sample is lost.
    let input = [0.0; 2];
    controller.observe_with_disturbances(&input, &[0.1, f64::NAN], &[0.0; 2]);
    let found = decide(&mut controller);
    assert_eq!(found, (Origin::Hold, Some(Fault::MeasurementNotFinite), 0));
    for _ in 0..4 {
        controller.observe_with_disturbances(&input, &[0.1, 0.2], &[0.0; 2]);
    }
    let (origin, fault, _) = decide(&mut controller);
    assert!(
        matches!(origin, Origin::Solver | Origin::Unconstrained),
        "{origin:?}"
    );
    assert_eq!(fault, None);
    let good = controller.step().input.clone();
    controller.observe_with_disturbances(&good, &[0.1, f64::NAN], &[0.0; 2]);
    let (origin, fault, repaired) = decide(&mut controller);
    assert!(
        matches!(origin, Origin::Solver | Origin::Unconstrained),
        "{origin:?}"
    );
    assert_eq!((fault, repaired), (Some(Fault::DisturbanceNotFinite), 1));
    let with_held = controller.step().input.clone();

    // It decides as it would with the held value.
    let mut twin = controller_from(&disturbed_predictor());
    for _ in 0..4 {
        twin.observe_with_disturbances(&input, &[0.1, 0.2], &[0.0; 2]);
    }
    twin.decide(&reference);
    twin.observe_with_disturbances(&good, &[0.1, 0.2], &[0.0; 2]);
    assert_eq!(twin.decide(&reference).input, with_held);

    controller.observe(&good, &[0.0; 2]);
    let (_, fault, _) = decide(&mut controller);
    assert_eq!(
        fault,
        Some(Fault::MeasurementShape),
        "the disturbances are missing"
    );
    let mut ahead = controller.new_reference();
    ahead.hold_disturbances(&[0.0, f64::NAN]).unwrap();
    controller.observe_with_disturbances(&good, &[0.1, 0.2], &[0.0; 2]);
    let step = controller.decide(&ahead);
    assert_eq!(step.fault, Some(Fault::ReferenceNotFinite));
}

#[test]
fn a_preview_of_what_is_measured_is_the_default() {
    let (mut by_default, mut by_hand) = (
        controller_from(&disturbed_predictor()),
        controller_from(&disturbed_predictor()),
    );
    let mut reference = by_hand.new_reference();
    reference.hold_disturbances(&[0.3, -0.2]).unwrap();
    let plain = Reference::zeros(12, 2, 2);
    for k in 0..20 {
        let output = [0.1 * f64::from(k).sin(), 0.05];
        for controller in [&mut by_default, &mut by_hand] {
            controller.observe_with_disturbances(&[0.1, 0.0], &[0.3, -0.2], &output);
        }
        let expected = by_hand.decide(&reference).input.clone();
        assert_eq!(by_default.decide(&plain).input, expected);
    }
}

#[test]
fn the_contract_holds_with_disturbances() {
    let predictor = disturbed_predictor();
    let mut respond = |k: usize, u: &[f64]| vec![u[0] + 0.1 * (k as f64).sin(), u[1] - 0.5 * u[0]];
    contract::check_controller(
        &mut || Box::new(controller_from(&predictor)),
        &settings().input_bounds,
        &mut respond,
    )
    .unwrap();
    let inputs: Vec<_> = (0..20).map(|k| vec![f64::from(k).sin(), 0.1]).collect();
    contract::check_plant(&mut || Box::new(LtiPlant::disturbed(true, waves)), &inputs).unwrap();
}

#[test]
fn a_plant_that_does_not_measure_what_the_controller_needs_is_refused() {
    let mut controller = controller_from(&disturbed_predictor());
    let refer = |_: usize, _: &mut Reference| Ok::<(), ControllerError>(());
    let result = run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 1, refer);
    let message = result.unwrap_err().to_string();
    assert!(message.contains("0 measured disturbances"), "{message}");
    assert!(message.contains("the controller 2, 2, 2"), "{message}");
}
