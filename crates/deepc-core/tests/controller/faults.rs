//! Faults injected into the closed loop: the input stays within its bounds, the fault is
//! reported, and the loop recovers.

use deepc_core::controller::{
    Controller, DeepcController, Fault, Origin, Plant, RecedingHorizonSettings, Reference,
};
use deepc_core::solver::{QpStatus, SolveBudget};

use crate::plants::{LtiPlant, Mischief, controller, faulty_controller, horizon, is_allowed};

/// What happens to one sample between plant and controller.
enum Observation {
    /// Observed as measured.
    Fine,
    /// The output is replaced.
    Output(Vec<f64>),
    /// The reported input is replaced.
    Input(Vec<f64>),
    Lost,
    Twice,
}

/// What a run looked like.
struct Story {
    origins: Vec<Origin>,
    faults: Vec<Option<Fault>>,
    last_output: [f64; 2],
}

impl Story {
    /// The loop is back at the target (1, 0.2) with fresh plans.
    fn ends_well(&self) {
        let [y, z] = self.last_output;
        assert!((y - 1.0).abs() < 0.05 && (z - 0.2).abs() < 0.05, "{y}, {z}");
        let last = self.origins.last();
        let fresh = [Some(&Origin::Solver), Some(&Origin::Unconstrained)];
        assert!(fresh.contains(&last), "{last:?}");
        assert_eq!(self.faults.last(), Some(&None));
    }

    fn count(&self, fault: Fault) -> usize {
        self.faults.iter().filter(|&&f| f == Some(fault)).count()
    }
}

/// Eighty samples towards (1, 0.2). `inject` gets the sample number and what was measured,
/// `refer` may spoil the reference.
fn run(
    controller: &mut DeepcController,
    mut inject: impl FnMut(usize, [f64; 2]) -> Observation,
    refer: impl Fn(usize, &mut Reference),
) -> Story {
    let mut plant = LtiPlant::at_rest();
    let mut story = Story {
        origins: Vec::new(),
        faults: Vec::new(),
        last_output: [0.0; 2],
    };
    for k in 0..80 {
        let mut reference = controller.new_reference();
        reference.hold(&[0.0, 0.0], &[1.0, 0.2]).unwrap();
        refer(k, &mut reference);
        let step = controller.decide(&reference);
        assert!(is_allowed(&step.input), "sample {k}: {:?}", step.input);
        story.origins.push(step.origin);
        story.faults.push(step.fault);
        let input = step.input.clone();
        let mut output = [0.0; 2];
        plant.step(&input, &mut output).unwrap();
        story.last_output = output;
        match inject(k, output) {
            Observation::Fine => controller.observe(&input, &output),
            Observation::Output(measured) => controller.observe(&input, &measured),
            Observation::Input(reported) => controller.observe(&reported, &output),
            Observation::Lost => {}
            Observation::Twice => {
                controller.observe(&input, &output);
                controller.observe(&input, &output);
            }
        }
    }
    story
}

fn unspoilt(_: usize, _: &mut Reference) {}

#[test]
fn a_failing_solver_is_survived_whatever_it_says() {
    for mischief in [
        Mischief::Nan,
        Mischief::Ends(QpStatus::IterationLimit),
        Mischief::Ends(QpStatus::TimeLimit),
        Mischief::Ends(QpStatus::NumericalError),
        Mischief::Ends(QpStatus::Infeasible),
        Mischief::Ends(QpStatus::InvalidData),
        Mischief::Ends(QpStatus::NotRun),
    ] {
        // Longer than the plan of 12 samples lasts, and once from the very first solve.
        for during in [10..30, 0..20] {
            let (mut controller, switch) = faulty_controller(horizon(1));
            let story = run(
                &mut controller,
                |k, _| {
                    // Set for the next decision.
                    let faulty = during.contains(&(k + 1));
                    *switch.lock().unwrap() = if faulty { mischief } else { Mischief::None };
                    Observation::Fine
                },
                unspoilt,
            );
            story.ends_well();
            let solves = during.end - during.start.max(4);
            assert_eq!(story.count(Fault::SolveFailed), solves, "{mischief:?}");
            let (plan, hold) = if during.start == 0 { (0, 16) } else { (11, 9) };
            let count = |origin| story.origins.iter().filter(|&&o| o == origin).count();
            assert_eq!(count(Origin::Fallback), plan, "{mischief:?}");
            assert_eq!(count(Origin::Hold), hold, "{mischief:?}");
        }
    }
}

#[test]
fn the_status_of_a_failed_solve_is_reported() {
    let (mut controller, switch) = faulty_controller(horizon(1));
    for (mischief, expected) in [
        (Mischief::Nan, QpStatus::NumericalError),
        (Mischief::Ends(QpStatus::TimeLimit), QpStatus::TimeLimit),
    ] {
        controller.reset();
        *switch.lock().unwrap() = mischief;
        run(&mut controller, |_, _| Observation::Fine, unspoilt);
        assert_eq!(controller.step().status, expected);
        assert_eq!(controller.step().tracking, None);
        assert_eq!(controller.step().residual.to_bits(), 0);
    }
}

#[test]
fn a_spent_budget_is_survived() {
    for (max_iterations, max_time_s) in [(1, f64::INFINITY), (1000, 1e-12)] {
        let tight = RecedingHorizonSettings::every_sample(SolveBudget {
            max_iterations,
            max_time_s,
        });
        let (mut controller, _) = faulty_controller(tight);
        let story = run(&mut controller, |_, _| Observation::Fine, unspoilt);
        assert_eq!(story.count(Fault::SolveFailed), 76);
        assert!(story.origins[4..].iter().all(|&o| o == Origin::Hold));
    }
}

#[test]
fn bad_measurements_are_survived_wherever_and_however_long() {
    let nan = f64::NAN;
    // One channel, all of them, infinities, a wrong length; alone, longer than the plan, at the
    // start.
    let spoil: [fn([f64; 2]) -> Vec<f64>; 5] = [
        |y| vec![y[0], f64::NAN],
        |_| vec![f64::NAN; 2],
        |y| vec![f64::INFINITY, y[1]],
        |y| vec![y[0]],
        |_| Vec::new(),
    ];
    for (kind, spoil) in spoil.iter().enumerate() {
        for during in [15..16, 15..45, 0..10, 2..3] {
            let inject = |k, y| {
                if during.contains(&k) {
                    Observation::Output(spoil(y))
                } else {
                    Observation::Fine
                }
            };
            let story = run(&mut controller(1), inject, unspoilt);
            story.ends_well();
            let fault = if kind < 3 {
                Fault::MeasurementNotFinite
            } else {
                Fault::MeasurementShape
            };
            assert_eq!(story.count(fault), during.len(), "{during:?}, kind {kind}");
        }
    }
    for during in [15..16, 15..45, 0..10] {
        let lose = |k, _| {
            if during.contains(&k) {
                Observation::Lost
            } else {
                Observation::Fine
            }
        };
        let story = run(&mut controller(1), lose, unspoilt);
        story.ends_well();
        assert_eq!(story.count(Fault::MeasurementLost), during.len());
        let report = |k, _| {
            if during.contains(&k) {
                Observation::Input(vec![nan, 0.0])
            } else {
                Observation::Fine
            }
        };
        let story = run(&mut controller(1), report, unspoilt);
        story.ends_well();
        assert_eq!(story.count(Fault::MeasurementNotFinite), during.len());
    }
}

#[test]
fn one_bad_sample_costs_almost_nothing_and_the_window_says_how_long_it_stays() {
    let mut controller = controller(1);
    let story = run(
        &mut controller,
        |k, y| match k {
            15 => Observation::Output(vec![y[0], f64::NAN]),
            _ => Observation::Fine,
        },
        unspoilt,
    );
    // The prediction that took its place is exact: nothing disturbs the plant.
    assert_eq!(story.origins[16], Origin::Fallback);
    assert!(!story.origins[17..].iter().any(|o| o.is_fallback()));
    assert_eq!(controller.statistics().steps_with_repairs, 4);
}

#[test]
fn an_outage_beyond_the_plan_ends_with_a_fresh_window() {
    let story = run(
        &mut controller(1),
        |k, _| match k {
            15..45 => Observation::Lost,
            _ => Observation::Fine,
        },
        unspoilt,
    );
    // The plan of sample 15 has 11 moves left. It and its predictions end with sample 26, so the
    // window fills again with samples 45 to 48.
    assert!(story.origins[16..27].iter().all(|&o| o == Origin::Fallback));
    assert!(story.origins[27..49].iter().all(|&o| o == Origin::Hold));
    assert!(
        story.faults[46..49]
            .iter()
            .all(|&f| f == Some(Fault::WindowRefilling))
    );
    assert!(matches!(
        story.origins[49],
        Origin::Solver | Origin::Unconstrained
    ));
    assert_eq!(story.faults[49], None);
}

#[test]
fn the_policy_goes_on_where_it_was_while_the_window_refills() {
    let lose = |k, _| match k {
        15..45 => Observation::Lost,
        _ => Observation::Fine,
    };
    // A reference input that would show if it reached the plant.
    let refer = |_, reference: &mut Reference| reference.hold(&[0.7, 0.4], &[1.0, 0.2]).unwrap();
    let mut controller = controller(1).with_user_fallback(|_, input| input.fill(0.125));
    let story = run(&mut controller, lose, refer);
    assert!(story.origins[..4].iter().all(|&o| o == Origin::Passthrough));
    // The standard policy holds for 10 samples, once, and the user chooses until there is a plan.
    assert!(story.origins[27..37].iter().all(|&o| o == Origin::Hold));
    assert!(story.origins[37..49].iter().all(|&o| o == Origin::User));
    assert!(!story.origins[49].is_fallback());
    assert_eq!(story.count(Fault::WindowRefilling), 3);
    assert_eq!(controller.statistics().faults.window_refilling, 3);
    assert_eq!(controller.statistics().origins.passthrough, 4);

    // After a reset the window fills for the first time.
    controller.reset();
    let story = run(&mut controller, |_, _| Observation::Fine, refer);
    assert!(story.origins[..4].iter().all(|&o| o == Origin::Passthrough));
    assert_eq!(story.count(Fault::WindowRefilling), 0);
}

#[test]
fn a_window_that_fills_before_the_first_decision_is_full_for_the_first_time() {
    let mut controller = controller(1);
    (0..4).for_each(|_| controller.observe(&[0.1, 0.0], &[0.0; 2]));
    controller.observe(&[0.1, 0.0], &[f64::NAN; 2]);
    controller.observe(&[0.1, 0.0], &[0.0; 2]);
    let reference = controller.new_reference();
    let step = controller.decide(&reference);
    assert_eq!(
        (step.origin, step.fault),
        (Origin::Hold, Some(Fault::WindowRefilling))
    );
    assert_eq!(step.input, [0.1, 0.0]);
}

#[test]
fn absurd_but_finite_measurements_are_survived() {
    for absurd in [1e300, -1e300, f64::MAX, 1e30] {
        let story = run(
            &mut controller(1),
            |k, y| match k {
                15..17 => Observation::Output(vec![absurd, y[1]]),
                _ => Observation::Fine,
            },
            unspoilt,
        );
        story.ends_well();
    }
}

#[test]
fn a_sample_observed_twice_is_survived() {
    let story = run(
        &mut controller(1),
        |k, _| {
            if k % 9 == 5 && k < 60 {
                Observation::Twice
            } else {
                Observation::Fine
            }
        },
        unspoilt,
    );
    story.ends_well();
}

#[test]
fn bad_references_are_survived() {
    type Spoil = fn(&mut Reference);
    let cases: [(Fault, Spoil); 4] = [
        (Fault::ReferenceNotFinite, |r| {
            r.hold(&[0.0; 2], &[1.0, f64::NAN]).unwrap();
        }),
        (Fault::ReferenceNotFinite, |r| {
            r.hold(&[f64::INFINITY, 0.0], &[1.0, 0.0]).unwrap();
        }),
        (Fault::ReferenceShape, |r| *r = Reference::zeros(11, 2, 2)),
        (Fault::ReferenceShape, |r| {
            *r = Reference::with_disturbances(12, 2, 1, 2);
            r.hold_disturbances(&[0.0]).unwrap();
        }),
    ];
    for (fault, spoil) in cases {
        for during in [15..16, 15..45, 0..10] {
            let refer = |k, reference: &mut Reference| {
                if during.contains(&k) {
                    spoil(reference);
                }
            };
            let story = run(&mut controller(1), |_, _| Observation::Fine, refer);
            story.ends_well();
            assert_eq!(story.count(fault), during.len(), "{during:?}");
        }
    }
}

#[test]
fn several_moves_per_solve_survive_the_same() {
    let story = run(
        &mut controller(4),
        |k, y| match k {
            15..45 if k % 3 == 0 => Observation::Lost,
            15..45 => Observation::Output(vec![y[0], f64::NAN]),
            _ => Observation::Fine,
        },
        unspoilt,
    );
    let [y, z] = story.last_output;
    assert!((y - 1.0).abs() < 0.05 && (z - 0.2).abs() < 0.05, "{y}, {z}");
}

#[test]
fn a_frozen_sensor_is_reported_and_does_not_stop_control() {
    let watching = RecedingHorizonSettings {
        frozen_after: Some(5),
        ..horizon(1)
    };
    let (mut controller, _) = faulty_controller(watching);
    let mut stuck = 0.0;
    let story = run(
        &mut controller,
        |k, y| {
            // A little noise, as real sensors have.
            let noise = 1e-6 * (k as f64 * 0.7).sin();
            if k <= 20 || k > 40 {
                stuck = y[1] + noise;
            }
            Observation::Output(vec![y[0] + noise, stuck])
        },
        unspoilt,
    );
    story.ends_well();
    // The values of samples 20 to 40 are the same; the fifth repetition is that of sample 25.
    for (k, fault) in story.faults.iter().enumerate() {
        let expected = (26..=41).contains(&k).then_some(Fault::MeasurementFrozen);
        assert_eq!(*fault, expected, "sample {k}");
    }
    assert!(story.origins[4..].iter().all(|&o| o == Origin::Solver));
    assert_eq!(controller.statistics().faults.measurement_frozen, 16);
    assert_eq!(controller.frozen_outputs().next(), None);
}
