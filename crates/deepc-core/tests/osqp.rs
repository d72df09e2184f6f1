//! OSQP on the programs of `DeePC`: the same optimum as Clarabel's, in both forms, step after step.
#![cfg(feature = "osqp")]

mod common;

use common::Lti;
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, OutputBounds, PlanOrigin, PredictiveProgram,
    ProgramOptions, Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{
    ClarabelSettings, ClarabelSolver as Reference, OsqpSettings, OsqpSolver, QpSolver, QpStatus,
    SolveBudget, SolverError,
};
use faer::Mat;

const PAST: usize = 5;
const FUTURE: usize = 8;
const STEPS: usize = 25;

fn settings(slack: Slack) -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![0.1, 0.3],
        output_weights: vec![2.0, 0.5, 0.0],
        regularisation: Regularisation::raw(0.5),
        input_slack: slack,
        output_slack: Slack::Penalty(1e4),
        input_bounds: vec![
            Bounds::between(-0.3, 0.4),
            Bounds {
                lower: Some(-0.5),
                upper: None,
            },
        ],
        output_bounds: vec![
            OutputBounds::soft(-1.0, 1.0, 3.0, 2.0),
            OutputBounds::none(),
            OutputBounds::soft(-0.8, 0.7, 0.0, 5.0),
        ],
        options: ProgramOptions::default(),
    }
}

/// Consecutive moments of a recording that the predictor has not seen.
fn check_steps(program: &mut dyn PredictiveProgram, osqp: &mut dyn QpSolver) {
    let mut reference = Reference::new(program.qp(), ClarabelSettings::default()).unwrap();
    let (inputs, outputs) = common::record(&Lti::random(4, 2, 3, 0.85, 42), 80, 0.05, 9);
    let budget = SolveBudget::generous();
    let (mut solved, mut iterations) = (0, 0);
    for k in 0..STEPS {
        let input_reference = Mat::from_fn(FUTURE, 2, |t, i| 0.3 * ((k + t + i) as f64).sin());
        let output_reference =
            Mat::from_fn(FUTURE, 3, |t, i| ((k + t) as f64 * 0.2 + i as f64).cos());
        let moment = Moment {
            past_inputs: inputs.subrows(k, PAST),
            past_outputs: outputs.subrows(k, PAST),
            input_reference: input_reference.as_ref(),
            output_reference: output_reference.as_ref(),
            disturbances: None,
        };
        let plan = program.solve(&moment, osqp, &budget).unwrap().clone();
        assert_eq!(
            plan.status,
            QpStatus::Solved,
            "step {k}: {:e}",
            plan.residual
        );
        if plan.origin == PlanOrigin::Unconstrained {
            continue;
        }
        solved += 1;
        iterations += plan.iterations;
        let objective = program.objective().unwrap();
        let expected = program.solve(&moment, &mut reference, &budget).unwrap();
        let inputs = common::largest_difference(&plan.inputs, &expected.inputs);
        let expected = program.objective().unwrap();
        let gap = (objective - expected).abs() / expected;
        assert!(gap <= 1e-7, "step {k}: objective gap {gap:e}");
        assert!(inputs <= 1e-5, "step {k}: inputs {inputs:e}");
    }
    assert!(solved > STEPS / 2, "only {solved} steps needed a solver");
    println!("{solved} steps, {iterations} iterations");
}

fn predictor(noise: f64) -> Predictor {
    let system = Lti::random(4, 2, 3, 0.85, 42);
    let data = common::dataset(vec![common::record(&system, 150, noise, 3)]);
    Predictor::full(&common::exciting(&data, PAST, FUTURE, 4))
}

#[test]
fn both_forms_find_clarabels_optimum_with_slack_and_without() {
    for slack in [Slack::Penalty(1e3), Slack::Hard] {
        let predictor = predictor(0.05);
        let mut condensed = CondensedProgram::new(&predictor, &settings(slack)).unwrap();
        let mut osqp = OsqpSolver::new(condensed.qp(), OsqpSettings::default()).unwrap();
        check_steps(&mut condensed, &mut osqp);
        let mut sparse = SparseProgram::new(&predictor, &settings(slack)).unwrap();
        let mut osqp = OsqpSolver::new(sparse.qp(), OsqpSettings::default()).unwrap();
        check_steps(&mut sparse, &mut osqp);
    }
}

#[test]
fn a_past_no_trajectory_explains_is_proven_infeasible_in_the_sparse_form() {
    let mut settings = settings(Slack::Hard);
    settings.output_slack = Slack::Hard;
    let mut program = SparseProgram::new(&predictor(0.0), &settings).unwrap();
    let mut osqp = OsqpSolver::new(program.qp(), OsqpSettings::default()).unwrap();
    let zero = [
        Mat::zeros(PAST, 2),
        Mat::zeros(FUTURE, 2),
        Mat::zeros(FUTURE, 3),
    ];
    let mut past_outputs = Mat::zeros(PAST, 3);
    past_outputs[(2, 1)] = 0.5;
    let moment = Moment {
        past_inputs: zero[0].as_ref(),
        past_outputs: past_outputs.as_ref(),
        input_reference: zero[1].as_ref(),
        output_reference: zero[2].as_ref(),
        disturbances: None,
    };
    let budget = SolveBudget::generous();
    let plan = program.solve(&moment, &mut osqp, &budget).unwrap();
    assert_eq!(plan.status, QpStatus::Infeasible);
}

#[test]
fn settings_out_of_range_are_named() {
    let good = OsqpSettings::default();
    assert!(good.check().is_ok());
    let bad = [
        (
            OsqpSettings {
                tolerance: 1.0,
                ..good
            },
            "tolerance",
        ),
        (
            OsqpSettings {
                eps: f64::NAN,
                ..good
            },
            "eps",
        ),
        (
            OsqpSettings {
                check_interval: 0,
                ..good
            },
            "check_interval",
        ),
    ];
    for (settings, name) in bad {
        match settings.check() {
            Err(SolverError::Setting { field, .. }) => assert_eq!(field, name),
            other => panic!("{name}: {other:?}"),
        }
    }
}
