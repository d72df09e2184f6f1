//! The size of the original study: 2 inputs, 1 output, `T_ini` = N = 100, T = 3200, heavy slack
//! weights, and a channel at an offset of 100.

use crate::common;
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, OutputBounds, PlanOrigin, PredictiveProgram,
    ProgramOptions, Regularisation, Slack,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, ClarabelSettings, ClarabelSolver, QpSolver, SolveBudget,
};
use faer::prelude::SolveLstsq;
use faer::{Col, Mat};

const PAST: usize = 100;
const FUTURE: usize = 100;

fn predictor() -> Predictor {
    let data = common::dataset(vec![common::coloured_recording(3200, 1)]);
    let predictor = Predictor::full(&common::exciting(&data, PAST, FUTURE, 10));
    assert_eq!(predictor.stacked().shape(), (600, 3001));
    predictor
}

fn settings() -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![1.0, 5e-4],
        output_weights: vec![0.3],
        regularisation: Regularisation::raw(100.0),
        input_slack: Slack::Penalty(1e8),
        output_slack: Slack::Penalty(1e8),
        input_bounds: vec![Bounds::none(), Bounds::none()],
        output_bounds: vec![OutputBounds::none()],
        options: ProgramOptions::default(),
    }
}

struct Situation {
    past_inputs: Mat<f64>,
    past_outputs: Mat<f64>,
    input_reference: Mat<f64>,
    output_reference: Mat<f64>,
}

impl Situation {
    /// From a recording the predictor has not seen.
    fn at(start: usize) -> Self {
        let (inputs, outputs) = common::coloured_recording(800, 2);
        let hold = 1.5 * inputs[(start + PAST, 0)];
        Self {
            past_inputs: inputs.subrows(start, PAST).to_owned(),
            past_outputs: outputs.subrows(start, PAST).to_owned(),
            input_reference: Mat::from_fn(FUTURE, 2, |_, i| if i == 0 { hold } else { 105.0 }),
            output_reference: Mat::zeros(FUTURE, 1),
        }
    }

    fn moment(&self) -> Moment<'_> {
        Moment {
            past_inputs: self.past_inputs.as_ref(),
            past_outputs: self.past_outputs.as_ref(),
            input_reference: self.input_reference.as_ref(),
            output_reference: self.output_reference.as_ref(),
            disturbances: None,
        }
    }
}

/// The unconstrained optimum as a least-squares problem in the coordinates of g on an
/// orthonormal basis of the data's row space, solved by QR: shares nothing with the condensed
/// form but the data. Returns (objective, u as N×2).
fn least_squares(predictor: &Predictor, situation: &Situation) -> (f64, Mat<f64>) {
    let h = predictor.stacked();
    let factor = h.transpose().qr();
    let reduced = factor.thin_R().transpose().to_owned();
    let n = reduced.ncols();
    let series = |matrix: &Mat<f64>| {
        let rows = matrix
            .row_iter()
            .map(|row| row.iter().copied().collect::<Vec<_>>());
        rows.flatten().collect::<Vec<f64>>()
    };
    let target: Vec<f64> = [
        &situation.past_inputs,
        &situation.past_outputs,
        &situation.input_reference,
        &situation.output_reference,
    ]
    .into_iter()
    .flat_map(series)
    .collect();
    let settings = settings();
    let steps: Vec<f64> = settings.input_weights.repeat(FUTURE);
    let mut weights = vec![1e8; 300];
    weights.extend(steps);
    weights.extend(vec![settings.output_weights[0]; FUTURE]);
    let lhs = Mat::from_fn(n + 600, n, |i, j| match i.checked_sub(n) {
        None => {
            if i == j {
                settings.regularisation.lambda_g.sqrt()
            } else {
                0.0
            }
        }
        Some(row) => weights[row].sqrt() * reduced[(row, j)],
    });
    let rhs = Col::from_fn(n + 600, |i| match i.checked_sub(n) {
        None => 0.0,
        Some(row) => weights[row].sqrt() * target[row],
    });
    let qr = lhs.qr();
    let mut g = qr.solve_lstsq(&rhs);
    for _ in 0..2 {
        let residual = &rhs - &lhs * &g;
        g += qr.solve_lstsq(&residual);
    }
    let objective = (&lhs * &g - &rhs).squared_norm_l2();
    let w = reduced * &g;
    (
        objective,
        Mat::from_fn(FUTURE, 2, |k, i| w[300 + 2 * k + i]),
    )
}

#[test]
fn the_unconstrained_optimum_is_that_of_an_independent_least_squares_solution() {
    let predictor = predictor();
    let mut program = CondensedProgram::new(&predictor, &settings()).unwrap();
    for start in [0, 150, 400] {
        let situation = Situation::at(start);
        let (objective, inputs) = least_squares(&predictor, &situation);
        program.set_moment(&situation.moment()).unwrap();
        assert!(program.plan_unconstrained());
        let plan = program.plan();
        let gap = (program.objective().unwrap() - objective).abs() / objective;
        let distance = common::largest_difference(&plan.inputs, &inputs);
        println!("objective {objective:.6}, gap {gap:.1e}, inputs {distance:.1e}");
        assert!(gap <= 1e-9, "objective gap {gap:e}");
        assert!(distance <= 1e-6, "inputs {distance:e}");
    }
}

#[test]
fn recovered_g_and_slacks_satisfy_the_equations_and_add_up_to_the_objective() {
    let predictor = predictor();
    let mut program = CondensedProgram::new(&predictor, &settings()).unwrap();
    let situation = Situation::at(200);
    program.set_moment(&situation.moment()).unwrap();
    assert!(program.plan_unconstrained());
    let recovered = program.recover().unwrap();
    let gap = (recovered.parts.total() - program.objective().unwrap()).abs();
    assert!(gap <= 1e-9 * program.objective().unwrap(), "{gap:e}");
    let g = Col::from_fn(recovered.g.len(), |i| recovered.g[i]);
    let future = predictor.blocks().future_inputs * &g;
    let past = predictor.blocks().past_outputs * &g;
    for k in 0..100 {
        for i in 0..2 {
            let difference = future[2 * k + i] - program.plan().inputs[(k, i)];
            assert!(difference.abs() < 1e-8, "{difference:e}");
        }
        let explained = situation.past_outputs[(k, 0)] + recovered.output_slack[(k, 0)];
        assert!((past[k] - explained).abs() < 1e-9);
    }
}

#[test]
fn bounded_steps_are_certified_and_agree_between_solvers() {
    let predictor = predictor();
    let mut settings = settings();
    settings.input_bounds = vec![Bounds::between(-40.0, 40.0), Bounds::between(90.0, 110.0)];
    settings.output_bounds = vec![OutputBounds::soft(-0.6, 0.6, 1e4, 1e4)];
    let mut program = CondensedProgram::new(&predictor, &settings).unwrap();
    let mut active = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    let mut direct = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
    let mut solved = 0;
    for start in (0..600).step_by(25) {
        let situation = Situation::at(start);
        let budget = SolveBudget::generous();
        let plan = program
            .solve(&situation.moment(), &mut active, &budget)
            .unwrap()
            .clone();
        let objective = program.objective();
        assert!(plan.is_usable(), "{start}: {:?}", plan.status);
        if plan.origin == PlanOrigin::Unconstrained {
            continue;
        }
        solved += 1;
        assert!(plan.residual <= 1e-9, "{start}: {:e}", plan.residual);
        assert!(plan.input_violation <= 1e-7);
        if solved % 5 == 1 {
            direct.update(program.vectors()).unwrap();
            let other = direct.solve(&budget);
            assert!(other.status.is_usable());
            program.accept(other);
            let objective = objective.unwrap();
            let gap = (objective - program.objective().unwrap()).abs() / objective;
            let distance = common::largest_difference(&plan.inputs, &program.plan().inputs);
            println!("{start}: gap {gap:.1e}, inputs {distance:.1e}");
            assert!(gap <= 1e-7, "{start}: {gap:e}");
            assert!(distance <= 1e-3, "{start}: {distance:e}");
        }
    }
    assert!(solved >= 10, "only {solved} steps needed a solver");
}
