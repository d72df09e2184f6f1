//! The receding-horizon controller in closed loop.

mod common;

use common::Lti;
use deepc_core::controller::{
    Controller, ControllerError, DeepcController, Fault, Origin, Plant, PlantError,
    RecedingHorizonSettings, Reference, contract, run_closed_loop,
};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcProgram, DeepcSettings, Normalisation, OutputBounds,
    Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{
    ActiveRows, ClarabelDirect, ClarabelSettings, QpProblem, QpSolution, QpSolver, QpStatus,
    QpVectors, SolveBudget, SolverError,
};
use faer::{Col, Mat};

/// Two coupled, slightly oscillating modes; two inputs, two outputs.
fn system() -> Lti {
    Lti {
        a: faer::mat![[0.9, 0.2, 0.0], [-0.15, 0.85, 0.1], [0.0, 0.0, 0.7]],
        b: faer::mat![[0.1, 0.0], [0.0, 0.2], [0.3, 0.1]],
        c: faer::mat![[1.0, 0.0, 0.2], [0.0, 1.0, 0.0]],
        d: Mat::zeros(2, 2),
    }
}

struct LtiPlant {
    system: Lti,
    x: Col<f64>,
}

impl LtiPlant {
    fn at_rest() -> Self {
        let system = system();
        Self {
            x: Col::zeros(system.order()),
            system,
        }
    }
}

impl Plant for LtiPlant {
    fn inputs(&self) -> usize {
        2
    }

    fn outputs(&self) -> usize {
        2
    }

    fn sample_time_s(&self) -> f64 {
        0.1
    }

    fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
        self.check_lengths(input, output)?;
        // y(k) is measured at the end of the interval of u(k).
        let u = Col::from_fn(2, |i| input[i]);
        self.x = &self.system.a * &self.x + &self.system.b * u;
        let y = &self.system.c * &self.x;
        output.copy_from_slice(&[y[0], y[1]]);
        Ok(())
    }
}

fn predictor() -> Predictor {
    let mut plant = LtiPlant::at_rest();
    let inputs = common::gaussian(200, 2, &mut common::rng(1));
    let mut outputs = Mat::zeros(200, 2);
    for k in 0..200 {
        let mut y = [0.0; 2];
        plant
            .step(&[inputs[(k, 0)], inputs[(k, 1)]], &mut y)
            .unwrap();
        (outputs[(k, 0)], outputs[(k, 1)]) = (y[0], y[1]);
    }
    Predictor::exact(&common::exciting(
        &common::dataset(vec![(inputs, outputs)]),
        4,
        12,
        3,
    ))
    .unwrap()
}

fn settings() -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![0.01, 0.01],
        output_weights: vec![1.0, 1.0],
        regularisation: Regularisation {
            lambda_g: 1e-6,
            normalisation: Normalisation::PerColumn,
        },
        input_slack: Slack::Penalty(1e6),
        output_slack: Slack::Penalty(1e6),
        input_bounds: vec![Bounds::between(-0.4, 0.8), Bounds::between(-0.5, 0.5)],
        output_bounds: vec![
            OutputBounds::soft(-1.0, 1.05, 100.0, 10.0),
            OutputBounds::none(),
        ],
    }
}

fn horizon(moves_per_solve: usize) -> RecedingHorizonSettings {
    RecedingHorizonSettings {
        moves_per_solve,
        budget: SolveBudget::generous(),
    }
}

fn controller(moves_per_solve: usize) -> DeepcController {
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let solver = ActiveRows::new(program.qp(), ClarabelSettings::default()).unwrap();
    DeepcController::new(
        Box::new(program),
        Box::new(solver),
        horizon(moves_per_solve),
    )
    .unwrap()
}

fn to_the_target(k: usize, reference: &mut Reference) -> Result<(), ControllerError> {
    reference.hold(&[0.0, 0.0], if k < 40 { &[1.0, 0.2] } else { &[0.0, 0.0] })
}

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
    let solver = ClarabelDirect::new(program.qp(), ClarabelSettings::default()).unwrap();
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
fn a_failed_solve_with_a_plan_at_hand_follows_the_plan() {
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let solver = Failing {
        inner: ClarabelDirect::new(program.qp(), ClarabelSettings::default()).unwrap(),
        solves: 0,
    };
    let mut controller =
        DeepcController::new(Box::new(program), Box::new(solver), horizon(1)).unwrap();
    let run = run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 6, to_the_target).unwrap();
    assert_eq!(run.origins[4..], [Origin::Solver, Origin::Fallback]);
    let step = controller.step();
    assert_eq!(step.fault, Some(Fault::SolveFailed));
    assert_eq!(step.status, QpStatus::InvalidData);
}

/// Solves once, then breaks down.
struct Failing {
    inner: ClarabelDirect,
    solves: u32,
}

impl QpSolver for Failing {
    fn name(&self) -> &'static str {
        "failing"
    }
    fn problem(&self) -> &QpProblem {
        self.inner.problem()
    }
    fn update(&mut self, vectors: QpVectors<'_>) -> Result<(), SolverError> {
        self.inner.update(vectors)
    }
    fn solve(&mut self, budget: &SolveBudget) -> &QpSolution {
        self.solves += 1;
        if self.solves > 1 {
            // NaN in q is a solver's own way to fail.
            let variables = vec![f64::NAN; self.problem().variable_count()];
            let rows = vec![0.0; self.problem().row_count()];
            let broken = QpVectors {
                linear: &variables,
                lower: &rows,
                upper: &rows,
            };
            self.inner.update(broken).unwrap();
        }
        self.inner.solve(budget)
    }
    fn solution(&self) -> &QpSolution {
        self.inner.solution()
    }
    fn forget(&mut self) {
        self.inner.forget();
    }
}

#[test]
fn a_solver_of_another_program_of_the_same_size_is_refused() {
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let mut other = settings();
    other.input_weights[0] *= 2.0;
    let other = CondensedProgram::new(&predictor(), &other).unwrap();
    let solver = ActiveRows::new(other.qp(), ClarabelSettings::default()).unwrap();
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
    let solver = ActiveRows::new(program.qp(), ClarabelSettings::default()).unwrap();
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
    let solver = ActiveRows::new(program.qp(), ClarabelSettings::default()).unwrap();
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
fn a_spent_budget_falls_back() {
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let solver = ClarabelDirect::new(program.qp(), ClarabelSettings::default()).unwrap();
    let tight = RecedingHorizonSettings {
        moves_per_solve: 1,
        budget: SolveBudget {
            max_iterations: 1,
            max_time_s: 1.0,
        },
    };
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
    let solver = ClarabelDirect::new(other.qp(), ClarabelSettings::default()).unwrap();
    let error = DeepcController::new(Box::new(program), Box::new(solver), horizon(1));
    let message = error.err().unwrap().to_string();
    assert!(
        message.contains("set it up with this program's `qp()`"),
        "{message}"
    );
}
