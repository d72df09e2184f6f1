//! Data without noise, one slack hard and the other soft, over many sizes of the weights.

use crate::common;
use common::Lti;
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, OutputBounds, Plan, PredictiveProgram,
    ProgramError, ProgramOptions, Regularisation, Slack,
};
use deepc_core::solver::{ActiveSet, ActiveSetSettings, QpStatus, SolveBudget};
use faer::{Col, Mat};

const PAST: usize = 10;
const FUTURE: usize = 10;
const SAMPLES: usize = 400;

/// Largest error of a recovered trajectory; the signals are of size 100. What a slack of 0.001 at
/// a price of 1e8 leaves open beside a g at a price of 1e-10.
const TRAJECTORY_TOLERANCE: f64 = 1e-4;

struct Study {
    predictor: Predictor,
    past_inputs: Mat<f64>,
    past_outputs: Mat<f64>,
    input_reference: Mat<f64>,
    output_reference: Mat<f64>,
}

impl Study {
    /// Two inputs, the second at 100 ± 1, and three outputs; `data_noise` in the recording,
    /// `past_noise` in the measured past that is to be explained.
    fn new(data_noise: f64, input_noise: f64, output_noise: f64) -> Self {
        let system = Lti::random(4, 2, 3, 0.9, 7);
        let mut rng = common::rng(1);
        let mut inputs = common::gaussian(SAMPLES, 2, &mut rng);
        for k in 0..SAMPLES {
            inputs[(k, 1)] += 100.0;
        }
        let mut outputs = system.simulate(&mut Col::zeros(4), &inputs);
        outputs += faer::Scale(data_noise) * common::gaussian(SAMPLES, 3, &mut rng);
        let data = common::dataset(vec![(inputs.clone(), outputs.clone())]);
        let start = SAMPLES / 2;
        let now = start + PAST;
        let noisy = |series: &Mat<f64>, noise: f64, seed| {
            let noise =
                faer::Scale(noise) * common::gaussian(PAST, series.ncols(), &mut common::rng(seed));
            series.subrows(start, PAST) + noise
        };
        Self {
            predictor: Predictor::full(&common::exciting(&data, PAST, FUTURE, 4)),
            past_inputs: noisy(&inputs, input_noise, 5),
            past_outputs: noisy(&outputs, output_noise, 6),
            input_reference: Mat::from_fn(FUTURE, 2, |_, i| if i == 0 { 0.0 } else { 100.0 }),
            output_reference: Mat::from_fn(FUTURE, 3, |k, i| outputs[(now + k, i)] + 0.5),
        }
    }

    fn program(
        &self,
        lambda_g: f64,
        input_slack: Slack,
        output_slack: Slack,
    ) -> Result<CondensedProgram, ProgramError> {
        let settings = DeepcSettings {
            input_weights: vec![0.1; 2],
            output_weights: vec![1.0; 3],
            regularisation: Regularisation::raw(lambda_g),
            input_slack,
            output_slack,
            input_bounds: vec![Bounds::between(-0.2, 0.2), Bounds::between(99.5, 100.2)],
            output_bounds: vec![OutputBounds::none(); 3],
            options: ProgramOptions::default(),
        };
        CondensedProgram::new(&self.predictor, &settings)
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

    fn plan(&self, lambda_g: f64, input_slack: Slack, output_slack: Slack) -> Plan {
        let mut program = self.program(lambda_g, input_slack, output_slack).unwrap();
        let mut solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
        let budget = SolveBudget::generous();
        let plan = program.solve(&self.moment(), &mut solver, &budget).unwrap();
        assert_eq!(plan.status, QpStatus::Solved, "{lambda_g:e}");
        let (plan, parts) = (plan.clone(), program.recover().unwrap());
        let total = parts.parts.total();
        let objective = program.objective().unwrap();
        let error = (total - objective).abs() / objective;
        assert!(error <= 1e-6, "{lambda_g:e}: parts {total}, {error:e}");
        for (slack, values) in [
            (input_slack, &parts.input_slack),
            (output_slack, &parts.output_slack),
        ] {
            assert_eq!(slack == Slack::Hard, values.norm_max() == 0.0);
        }
        // The trajectory is one of the data's, and starts where it should.
        let trajectory = self.predictor.stacked() * Col::from_fn(parts.g.len(), |j| parts.g[j]);
        let (first_output, first_future) = (2 * PAST, 5 * PAST);
        for k in 0..PAST {
            for i in 0..2 {
                let start = self.past_inputs[(k, i)] + parts.input_slack[(k, i)];
                let error = trajectory[2 * k + i] - start;
                assert!(
                    error.abs() < TRAJECTORY_TOLERANCE,
                    "{lambda_g:e}: {error:e}"
                );
            }
            for i in 0..3 {
                let start = self.past_outputs[(k, i)] + parts.output_slack[(k, i)];
                let error = trajectory[first_output + 3 * k + i] - start;
                assert!(
                    error.abs() < TRAJECTORY_TOLERANCE,
                    "{lambda_g:e}: {error:e}"
                );
            }
        }
        for k in 0..FUTURE {
            for i in 0..2 {
                let error = trajectory[first_future + 2 * k + i] - plan.inputs[(k, i)];
                assert!(
                    error.abs() < TRAJECTORY_TOLERANCE,
                    "{lambda_g:e}: {error:e}"
                );
            }
        }
        plan
    }

    /// Plans over seven sizes of `λ_g`, which should only be a vanishing perturbation.
    fn check_sweep(&self, input_slack: Slack, output_slack: Slack) {
        let mut previous: Option<Plan> = None;
        for exponent in [-2, -3, -4, -5, -6, -8, -10] {
            let lambda_g = 10_f64.powi(exponent);
            let plan = self.plan(lambda_g, input_slack, output_slack);
            assert!(plan.past_inconsistency < 1e-12);
            if let Some(previous) = previous {
                let step = common::largest_difference(&plan.inputs, &previous.inputs);
                println!("{lambda_g:e}: {step:e}");
                assert!(step <= 10.0 * lambda_g.max(1e-7), "{lambda_g:e}: {step:e}");
            }
            previous = Some(plan);
        }
    }
}

#[test]
fn the_plan_is_continuous_in_lambda_g_with_hard_inputs_and_soft_outputs() {
    for noise in [0.0, 1e-3, 0.1] {
        Study::new(0.0, 0.0, noise).check_sweep(Slack::Hard, Slack::Penalty(1e8));
    }
}

#[test]
fn the_plan_is_continuous_in_lambda_g_with_soft_inputs_and_hard_outputs() {
    // The hard outputs determine the inputs here, so all of the noise is slack; a larger one
    // would leave more open than the tolerances above at the smallest λ_g.
    for noise in [0.0, 1e-3] {
        Study::new(0.0, noise, 0.0).check_sweep(Slack::Penalty(1e8), Slack::Hard);
    }
}

#[test]
fn hard_slack_is_the_limit_of_a_growing_penalty() {
    for lambda_g in [1e-2, 1e-4, 1e-6, 1e-8] {
        let study = Study::new(0.0, 0.0, 1e-3);
        let soft = Slack::Penalty(1e4);
        let limit = study.plan(lambda_g, Slack::Penalty(1e12), soft);
        let hard = study.plan(lambda_g, Slack::Hard, soft);
        let apart = common::largest_difference(&limit.inputs, &hard.inputs);
        println!("inputs hard, {lambda_g:e}: {apart:e}");
        assert!(apart <= 1e-6, "{lambda_g:e}: {apart:e}");
        let study = Study::new(0.0, 1e-3, 0.0);
        let limit = study.plan(lambda_g, soft, Slack::Penalty(1e12));
        let hard = study.plan(lambda_g, soft, Slack::Hard);
        let apart = common::largest_difference(&limit.inputs, &hard.inputs);
        println!("outputs hard, {lambda_g:e}: {apart:e}");
        assert!(apart <= 1e-6, "{lambda_g:e}: {apart:e}");
    }
}

#[test]
fn a_slack_penalty_lost_in_rounding_is_refused_with_its_numbers() {
    let huge = Slack::Penalty(1e20);
    let study = Study::new(0.0, 0.0, 0.0);
    for input_slack in [huge, Slack::Hard] {
        let Err(error) = study.program(1e-6, input_slack, huge) else {
            panic!("{input_slack:?} is accepted");
        };
        assert!(matches!(error, ProgramError::SlackLost { .. }), "{error}");
        let message = error.to_string();
        for part in ["1e20", "pivot", "lower the penalty", "`hard`"] {
            assert!(message.contains(part), "{message}");
        }
    }
    // Noise in the data spans every past: the penalty is as good as hard.
    let noisy = Study::new(0.05, 0.0, 0.01);
    let (soft, hard) = (
        noisy.plan(1e-6, huge, huge),
        noisy.plan(1e-6, Slack::Hard, Slack::Hard),
    );
    let apart = common::largest_difference(&soft.inputs, &hard.inputs);
    assert!(apart <= 1e-8, "{apart:e}");
}

/// A penalty just inside what is accepted still gives an accurate plan.
#[test]
fn large_penalties_that_are_accepted_are_accurate() {
    let study = Study::new(0.0, 0.0, 1e-3);
    let expected = study.plan(1e-6, Slack::Hard, Slack::Penalty(1e4));
    for penalty in [1e6, 1e8, 1e10, 1e12] {
        let plan = study.plan(1e-6, Slack::Hard, Slack::Penalty(penalty));
        let apart = common::largest_difference(&plan.inputs, &expected.inputs);
        println!("{penalty:e}: {apart:e}");
        assert!(apart <= 2e-3, "{penalty:e}: {apart:e}");
    }
}

#[test]
fn the_gain_gives_the_unconstrained_plan() {
    let study = Study::new(0.02, 0.0, 0.02);
    let settings = DeepcSettings {
        input_weights: vec![0.1, 0.3],
        output_weights: vec![2.0, 0.5, 0.0],
        regularisation: Regularisation::raw(0.1),
        input_slack: Slack::Hard,
        output_slack: Slack::Penalty(1e3),
        input_bounds: vec![Bounds::none(); 2],
        output_bounds: vec![OutputBounds::none(); 3],
        options: ProgramOptions::default(),
    };
    let mut program = CondensedProgram::new(&study.predictor, &settings).unwrap();
    let gain = program.reference_gain();
    assert_eq!(gain.shape(), (5 * FUTURE, 5 * FUTURE));
    let mut optimum = |step: Option<usize>| -> Col<f64> {
        let mut moment_data = (
            study.input_reference.clone(),
            study.output_reference.clone(),
        );
        match step {
            Some(i) if i < 2 * FUTURE => moment_data.0[(i / 2, i % 2)] += 1.0,
            Some(i) => moment_data.1[((i - 2 * FUTURE) / 3, (i - 2 * FUTURE) % 3)] += 1.0,
            None => {}
        }
        let moment = Moment {
            input_reference: moment_data.0.as_ref(),
            output_reference: moment_data.1.as_ref(),
            disturbances: None,
            ..study.moment()
        };
        program.set_moment(&moment).unwrap();
        assert!(program.plan_unconstrained());
        let plan = program.plan();
        Col::from_fn(5 * FUTURE, |i| match i.checked_sub(2 * FUTURE) {
            None => plan.inputs[(i / 2, i % 2)],
            Some(i) => plan.outputs[(i / 3, i % 3)],
        })
    };
    // f* = f0 + GW(r − f0): a step of reference j moves the optimum by column j of GW.
    let base = optimum(None);
    let weight = |j: usize| match j.checked_sub(2 * FUTURE) {
        None => settings.input_weights[j % 2],
        Some(j) => settings.output_weights[j % 3],
    };
    for j in 0..5 * FUTURE {
        let moved = optimum(Some(j)) - &base;
        for i in 0..5 * FUTURE {
            let error = moved[i] - gain[(i, j)] * weight(j);
            assert!(error.abs() < 1e-9, "({i}, {j}): {error:e}");
        }
    }
}
