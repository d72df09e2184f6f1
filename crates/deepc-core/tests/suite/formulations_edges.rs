//! Moments at the edge of what can be planned.

use crate::common;
use common::Lti;
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, OutputBounds, Plan, PredictiveProgram,
    Regularisation, Slack,
};
use deepc_core::solver::{ActiveSet, ActiveSetSettings, QpStatus, SolveBudget};
use faer::{Col, Mat, mat};

const PAST: usize = 6;
const FUTURE: usize = 5;

/// Two inputs that act a sample late, two outputs, no noise.
fn late() -> Lti {
    Lti {
        a: mat![[0.8, 0.1, 0.0], [-0.1, 0.7, 0.2], [0.0, 0.0, 0.5]],
        b: mat![[1.0, 0.0], [0.0, 1.0], [0.5, 0.2]],
        c: mat![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        d: Mat::zeros(2, 2),
    }
}

fn predictor() -> Predictor {
    let data = common::dataset(vec![common::record(&late(), 200, 0.0, 1)]);
    Predictor::exact(&common::exciting(&data, PAST, FUTURE, 3)).unwrap()
}

fn settings() -> DeepcSettings {
    let regularisation = Regularisation::per_column(1e-6);
    DeepcSettings::new(&[0.1; 2], &[1.0; 2], regularisation, Slack::Hard)
}

fn plan(settings: &DeepcSettings, past_inputs: &Mat<f64>, past_outputs: &Mat<f64>) -> Plan {
    let mut program = CondensedProgram::new(&predictor(), settings).unwrap();
    let mut solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    let zero = Mat::zeros(FUTURE, 2);
    let moment = Moment {
        past_inputs: past_inputs.as_ref(),
        past_outputs: past_outputs.as_ref(),
        input_reference: zero.as_ref(),
        output_reference: zero.as_ref(),
        disturbances: None,
    };
    program
        .solve(&moment, &mut solver, &SolveBudget::generous())
        .unwrap()
        .clone()
}

#[test]
fn nan_is_invalid_also_where_no_constraint_meets_it() {
    let slacks = [Slack::Hard, Slack::Penalty(1e4)];
    for slack in slacks {
        let settings = DeepcSettings {
            input_slack: slack,
            output_slack: slack,
            ..settings()
        };
        let mut past = Mat::zeros(PAST, 2);
        past[(2, 1)] = f64::NAN;
        let plan = plan(&settings, &Mat::zeros(PAST, 2), &past);
        assert_eq!(plan.status, QpStatus::InvalidData, "{slack:?}");
        assert!(!plan.is_usable());
    }
}

/// At rest there is nothing but the last digit of the sensors, which no trajectory explains.
#[test]
fn a_past_that_is_all_quantisation_is_consistent() {
    let noise = common::gaussian(PAST, 2, &mut common::rng(3)) * faer::Scale(1e-9);
    let small = plan(&settings(), &Mat::zeros(PAST, 2), &noise);
    assert_eq!(small.status, QpStatus::Solved);
    let large = plan(
        &settings(),
        &Mat::zeros(PAST, 2),
        &(noise * faer::Scale(1e9)),
    );
    assert_eq!(large.status, QpStatus::Infeasible);
}

/// The first output is decided already: a hard bound on it is met or not, whatever it would cost to
/// move it along rounding.
#[test]
fn an_output_that_nothing_can_move_makes_its_bound_infeasible() {
    let system = late();
    let mut x = Col::from_fn(3, |_| 1.0);
    let inputs = Mat::from_fn(PAST, 2, |k, i| ((k + i) as f64).sin());
    let outputs = system.simulate(&mut x, &inputs);
    let next = &system.c * &x;
    for (limit, expected) in [
        (next[0].abs() * 1.001, QpStatus::Solved),
        (next[0].abs() * 0.999, QpStatus::Infeasible),
    ] {
        let settings = DeepcSettings {
            output_bounds: vec![OutputBounds::hard(-limit, limit), OutputBounds::none()],
            input_bounds: vec![Bounds::none(); 2],
            ..settings()
        };
        let plan = plan(&settings, &inputs, &outputs);
        assert_eq!(plan.status, expected, "{limit} for {}", next[0]);
    }
}
