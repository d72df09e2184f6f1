//! Another input than the planned one acted, and the controller was told.

use deepc_core::controller::{Controller, DeepcController, Fault, Origin, Reference};
use deepc_core::controller::{Plant, run_closed_loop};

use crate::plants::{LtiPlant, controller, to_the_target};

/// After ten samples: the input decided for the next one, what the plant makes of `applied` to it,
/// and the reference.
fn running(
    moves_per_solve: usize,
    applied: impl Fn(&[f64]) -> Vec<f64>,
) -> (DeepcController, Vec<f64>, [f64; 2], Reference) {
    let (mut plant, mut controller) = (LtiPlant::at_rest(), controller(moves_per_solve));
    run_closed_loop(&mut plant, &mut controller, 10, to_the_target).unwrap();
    let mut reference = controller.new_reference();
    to_the_target(10, &mut reference).unwrap();
    let applied = applied(&controller.decide(&reference).input);
    let mut output = [0.0; 2];
    plant.step(&applied, &mut output).unwrap();
    (controller, applied, output, reference)
}

/// Somebody else moves the second input.
fn another(decided: &[f64]) -> Vec<f64> {
    vec![decided[0], 0.25 - decided[1]]
}

/// What is reported by a converter of 16 bits for the range of ±1.
fn rounded(decided: &[f64]) -> Vec<f64> {
    let step = 1.0 / 32_768.0;
    decided.iter().map(|u| (u / step).round() * step).collect()
}

#[test]
fn a_plan_that_was_not_applied_is_not_followed() {
    let (mut controller, applied, output, _) = running(1, another);
    controller.observe(&applied, &output);
    let foreign = Reference::zeros(3, 2, 2);
    let step = controller.decide(&foreign);
    assert_eq!(
        (step.origin, step.fault),
        (Origin::Hold, Some(Fault::ReferenceShape))
    );
    assert_eq!(step.input, applied);
    assert_eq!(step.predicted_outputs().nrows(), 0);
}

#[test]
fn a_plan_that_was_not_applied_repairs_no_sample() {
    let (mut controller, applied, output, reference) = running(1, another);
    // The output of the sample itself is lost, which the plan would predict wrongly.
    controller.observe(&applied, &[output[0], f64::NAN]);
    let step = controller.decide(&reference);
    assert_eq!(
        (step.origin, step.fault, step.repaired_samples),
        (Origin::Hold, Some(Fault::MeasurementNotFinite), 0)
    );
    controller.observe(&applied, &output);
    let step = controller.decide(&reference);
    assert_eq!(step.fault, Some(Fault::WindowRefilling));

    // A later one is lost, in which the planned input acted again.
    let (mut controller, applied, output, reference) = running(3, another);
    let plan = controller.step().predicted_inputs().to_owned();
    controller.observe(&applied, &output);
    controller.observe(&[plan[(1, 0)], plan[(1, 1)]], &[f64::NAN; 2]);
    let step = controller.decide(&reference);
    assert_eq!((step.origin, step.repaired_samples), (Origin::Hold, 0));
}

#[test]
fn between_solves_a_new_plan_is_made_at_once() {
    for (applied, expected) in [
        (another as fn(&[f64]) -> Vec<f64>, false),
        (rounded, true),
        (<[f64]>::to_vec, true),
    ] {
        let (mut controller, applied, output, reference) = running(4, applied);
        controller.observe(&applied, &output);
        let origin = controller.decide(&reference).origin;
        assert_eq!(origin == Origin::Plan, expected, "{origin:?}");
        assert!(!origin.is_fallback());
    }
}

#[test]
fn rounding_leaves_the_plan_in_force() {
    let (mut controller, applied, output, reference) = running(1, rounded);
    let planned = controller.step().predicted_inputs().to_owned();
    assert_ne!(applied, controller.step().input);
    controller.observe(&applied, &[output[0], f64::NAN]);
    let step = controller.decide(&reference);
    assert_eq!((step.origin, step.repaired_samples), (Origin::Fallback, 1));
    assert!((step.input[0] - planned[(1, 0)]).abs() < 1e-9);
}
