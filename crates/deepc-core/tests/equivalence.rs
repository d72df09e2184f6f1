//! Forms, reductions and records that must give the same optimum.

mod common;

use common::Solved;

use common::Lti;
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, Normalisation, OutputBounds,
    PredictiveProgram, ProgramOptions, Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, ClarabelSettings, ClarabelSolver, QpStatus, SolveBudget,
};
use faer::{Col, Mat};

const PAST: usize = 5;
const FUTURE: usize = 8;

fn settings(input_slack: Slack, output_slack: Slack) -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![0.1, 0.3],
        output_weights: vec![2.0, 0.5, 0.0],
        regularisation: Regularisation::raw(0.5),
        input_slack,
        output_slack,
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
            OutputBounds::soft(-2.0, 1.5, 0.0, 5.0),
        ],
        options: ProgramOptions::default(),
    }
}

fn system() -> Lti {
    Lti::random(4, 2, 3, 0.85, 42)
}

struct Situation {
    past_inputs: Mat<f64>,
    past_outputs: Mat<f64>,
    input_reference: Mat<f64>,
    output_reference: Mat<f64>,
    /// State at the moment of deciding.
    state: Col<f64>,
}

impl Situation {
    fn new(system: &Lti, noise: f64, seed: u64) -> Self {
        let mut rng = common::rng(seed);
        let past_inputs = common::gaussian(PAST, 2, &mut rng) * faer::Scale(0.4);
        let mut state = Col::from_fn(system.order(), |i| 0.3 * (seed as f64 + i as f64).sin());
        let mut past_outputs = system.simulate(&mut state, &past_inputs);
        past_outputs += faer::Scale(noise) * common::gaussian(PAST, 3, &mut rng);
        Self {
            past_inputs,
            past_outputs,
            input_reference: common::gaussian(FUTURE, 2, &mut rng) * faer::Scale(0.2),
            output_reference: common::gaussian(FUTURE, 3, &mut rng),
            state,
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

    fn condensed(&self, predictor: &Predictor, settings: &DeepcSettings) -> Solved {
        let mut program = CondensedProgram::new(predictor, settings).unwrap();
        let mut solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
        let budget = SolveBudget::generous();
        program.solve(&self.moment(), &mut solver, &budget).unwrap();
        Solved::of(&program)
    }

    fn sparse(&self, predictor: &Predictor, settings: &DeepcSettings) -> Solved {
        let mut program = SparseProgram::new(predictor, settings).unwrap();
        let mut solver = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
        let budget = SolveBudget::generous();
        program.solve(&self.moment(), &mut solver, &budget).unwrap();
        Solved::of(&program)
    }
}

fn check_same(what: &str, a: &Solved, b: &Solved, objective: f64, signals: f64) {
    assert!(
        a.is_usable() && b.is_usable(),
        "{what}: {:?}, {:?}",
        a.status,
        b.status
    );
    let gap = (a.objective - b.objective).abs() / a.objective.abs().max(1.0);
    let inputs = common::largest_difference(&a.inputs, &b.inputs);
    let outputs = common::largest_difference(&a.outputs, &b.outputs);
    println!("{what}: objective {gap:.1e}, inputs {inputs:.1e}, outputs {outputs:.1e}");
    assert!(
        gap <= objective,
        "{what}: objectives {} and {}",
        a.objective,
        b.objective
    );
    assert!(
        inputs <= signals && outputs <= signals,
        "{what}: {inputs:e}, {outputs:e}"
    );
}

fn predictor(noise: f64, samples: usize) -> Predictor {
    let data = common::dataset(vec![common::record(&system(), samples, noise, 3)]);
    Predictor::full(&common::exciting(&data, PAST, FUTURE, 4))
}

#[test]
fn the_condensed_form_is_the_sparse_form_for_every_kind_of_slack() {
    let predictor = predictor(0.05, 150);
    let slacks = [
        (Slack::Penalty(1e3), Slack::Penalty(1e4)),
        (Slack::Hard, Slack::Penalty(1e4)),
        (Slack::Penalty(1e2), Slack::Hard),
        (Slack::Hard, Slack::Hard),
    ];
    for (input_slack, output_slack) in slacks {
        let settings = settings(input_slack, output_slack);
        for seed in 0..4 {
            let situation = Situation::new(&system(), 0.05, seed);
            let condensed = situation.condensed(&predictor, &settings);
            let sparse = situation.sparse(&predictor, &settings);
            check_same(
                &format!("{input_slack:?}, {output_slack:?}, {seed}"),
                &condensed,
                &sparse,
                1e-7,
                1e-5,
            );
        }
    }
}

#[test]
fn the_condensed_form_is_the_sparse_form_for_data_without_noise() {
    let predictor = predictor(0.0, 150);
    for output_slack in [Slack::Penalty(1e4), Slack::Hard] {
        let settings = settings(Slack::Hard, output_slack);
        for seed in 0..4 {
            let situation = Situation::new(&system(), 0.0, seed);
            let condensed = situation.condensed(&predictor, &settings);
            let sparse = situation.sparse(&predictor, &settings);
            check_same(
                &format!("{output_slack:?}, {seed}"),
                &condensed,
                &sparse,
                1e-6,
                1e-4,
            );
        }
    }
}

#[test]
fn the_parts_of_the_objective_agree_between_the_forms_and_add_up() {
    let predictor = predictor(0.05, 150);
    let settings = settings(Slack::Penalty(1e3), Slack::Penalty(1e4));
    let situation = Situation::new(&system(), 0.05, 1);
    let mut condensed = CondensedProgram::new(&predictor, &settings).unwrap();
    let mut sparse = SparseProgram::new(&predictor, &settings).unwrap();
    let mut recovered = Vec::new();
    let programs: [&mut dyn PredictiveProgram; 2] = [&mut condensed, &mut sparse];
    for program in programs {
        assert!(program.recover().is_none());
        let mut solver = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
        program
            .solve(&situation.moment(), &mut solver, &SolveBudget::generous())
            .unwrap();
        let parts = program.recover().unwrap();
        let total = parts.parts.total();
        assert!((total - program.objective().unwrap()).abs() <= 1e-9 * total);
        recovered.push(parts);
    }
    let [a, b] = recovered.try_into().unwrap();
    let g: f64 =
        a.g.iter()
            .zip(&b.g)
            .map(|(x, y)| (x - y).abs())
            .fold(0.0, f64::max);
    assert!(g < 1e-6, "{g:e}");
    assert!(common::largest_difference(&a.input_slack, &b.input_slack) < 1e-6);
    assert!(common::largest_difference(&a.output_slack, &b.output_slack) < 1e-6);
}

#[test]
fn a_past_no_trajectory_explains_is_infeasible_without_slack_in_both_forms() {
    let predictor = predictor(0.0, 150);
    let settings = settings(Slack::Hard, Slack::Hard);
    let mut situation = Situation::new(&system(), 0.0, 1);
    situation.past_outputs[(2, 1)] += 0.5;
    let (condensed, sparse) = (
        situation.condensed(&predictor, &settings),
        situation.sparse(&predictor, &settings),
    );
    assert_eq!(condensed.status, QpStatus::Infeasible);
    assert!(condensed.past_inconsistency > 1e-3);
    assert_eq!(condensed.iterations, 0, "no solver needs to be asked");
    assert_eq!(sparse.status, QpStatus::Infeasible);
}

#[test]
fn exact_reduction_changes_nothing_and_truncation_reports_what_it_loses() {
    for noise in [0.0, 0.05] {
        let data = common::dataset(vec![common::record(&system(), 300, noise, 3)]);
        let exciting = common::exciting(&data, PAST, FUTURE, 4);
        let (full, exact) = (
            Predictor::full(&exciting),
            Predictor::exact(&exciting).unwrap(),
        );
        let rank = exact.reduction().columns_after;
        assert_eq!(
            rank,
            if noise > 0.0 {
                65
            } else {
                2 * (PAST + FUTURE) + 4
            }
        );
        assert!(exact.reduction().energy_lost < 1e-12);
        let settings = settings(Slack::Hard, Slack::Penalty(1e4));
        for seed in 0..3 {
            let situation = Situation::new(&system(), noise, seed);
            let a = situation.condensed(&full, &settings);
            let b = situation.condensed(&exact, &settings);
            check_same(&format!("noise {noise}, {seed}"), &a, &b, 1e-9, 1e-7);
            let c = situation.sparse(&exact, &settings);
            check_same(
                &format!("sparse, noise {noise}, {seed}"),
                &a,
                &c,
                1e-6,
                1e-4,
            );
        }
        let truncated = Predictor::truncated(&exciting, 10).unwrap();
        assert_eq!(truncated.stacked().ncols(), 10);
        assert!(truncated.reduction().energy_lost > 1e-2);
        let worst = truncated
            .reduction()
            .channel_energy_lost
            .iter()
            .map(|c| c.1);
        assert!(worst.fold(0.0, f64::max) >= truncated.reduction().energy_lost);
    }
}

/// Textbook model predictive control: the state is known, the model is the plant, the variables
/// are the inputs.
fn model_based(system: &Lti, situation: &Situation, settings: &DeepcSettings) -> Mat<f64> {
    use deepc_core::solver::{QpMatrix, QpProblem, QpSolver, QpVectors};
    let (m, p, n) = (2, 3, 2 * FUTURE);
    let response = |state: &Col<f64>, inputs: &Mat<f64>| {
        let outputs = system.simulate(&mut state.clone(), inputs);
        Col::from_fn(p * FUTURE, |i| outputs[(i / p, i % p)])
    };
    let free = response(&situation.state, &Mat::zeros(FUTURE, m));
    let mut forced = Mat::zeros(p * FUTURE, n);
    for j in 0..n {
        let impulse = Mat::from_fn(FUTURE, m, |k, i| if k * m + i == j { 1.0 } else { 0.0 });
        let column = response(&Col::zeros(system.order()), &impulse);
        forced.col_mut(j).copy_from(&column);
    }
    let q = Mat::from_fn(p * FUTURE, p * FUTURE, |i, j| {
        if i == j {
            settings.output_weights[i % p]
        } else {
            0.0
        }
    });
    let r = Mat::from_fn(n, n, |i, j| {
        if i == j {
            settings.input_weights[i % m]
        } else {
            0.0
        }
    });
    let hessian = faer::Scale(2.0) * (forced.transpose() * &q * &forced + &r);
    let hessian = Mat::from_fn(n, n, |i, j| 0.5 * (hessian[(i, j)] + hessian[(j, i)]));
    let output_error = Col::from_fn(p * FUTURE, |i| {
        free[i] - situation.output_reference[(i / p, i % p)]
    });
    let input_reference = Col::from_fn(n, |i| situation.input_reference[(i / m, i % m)]);
    let linear = faer::Scale(2.0) * (forced.transpose() * &q * output_error - &r * input_reference);
    let rows = Mat::from_fn(n + p * FUTURE, n, |i, j| match i.checked_sub(n) {
        None => f64::from(u8::from(i == j)),
        Some(i) => forced[(i, j)],
    });
    let mut soft = vec![None; n];
    let (mut lower, mut upper) = (Vec::new(), Vec::new());
    for i in 0..n {
        lower.push(settings.input_bounds[i % m].lower_value());
        upper.push(settings.input_bounds[i % m].upper_value());
    }
    for i in 0..p * FUTURE {
        let output = &settings.output_bounds[i % p];
        soft.push(output.softness.penalty());
        lower.push(output.bounds.lower_value() - free[i]);
        upper.push(output.bounds.upper_value() - free[i]);
    }
    let problem = QpProblem::new(QpMatrix::Dense(hessian), QpMatrix::Dense(rows), soft).unwrap();
    let mut solver = ActiveSet::new(&problem, ActiveSetSettings::default()).unwrap();
    let linear: Vec<f64> = linear.iter().copied().collect();
    let vectors = QpVectors {
        linear: &linear,
        lower: &lower,
        upper: &upper,
    };
    solver.update(vectors).unwrap();
    let solution = solver.solve(&SolveBudget::generous());
    assert_eq!(solution.status, QpStatus::Solved);
    Mat::from_fn(FUTURE, m, |k, i| solution.primal[k * m + i])
}

#[test]
fn without_noise_deepc_is_model_predictive_control() {
    let (system, predictor) = (system(), predictor(0.0, 400));
    let mut settings = settings(Slack::Hard, Slack::Hard);
    let mut distances = Vec::new();
    for lambda_g in [1e-3, 1e-5, 1e-7] {
        settings.regularisation.lambda_g = lambda_g;
        let mut largest: f64 = 0.0;
        for seed in 0..6 {
            let situation = Situation::new(&system, 0.0, seed);
            let plan = situation.condensed(&predictor, &settings);
            assert!(plan.is_usable(), "{:?}", plan.status);
            let inputs = model_based(&system, &situation, &settings);
            largest = largest.max(common::largest_difference(&plan.inputs, &inputs));
        }
        distances.push(largest);
    }
    println!("distance from model predictive control: {distances:?}");
    // λ_g is the only difference left, and its effect is proportional to it.
    assert!(distances[1] < 0.05 * distances[0] && distances[2] < 0.05 * distances[1]);
    assert!(distances[2] < 1e-6, "{distances:?}");
}

#[test]
fn several_records_without_noise_control_like_one() {
    let system = system();
    let mut settings = settings(Slack::Hard, Slack::Hard);
    settings.regularisation.lambda_g = 1e-7;
    let one = predictor(0.0, 400);
    let pieces = (0..8)
        .map(|i| common::record(&system, 40, 0.0, 100 + i))
        .collect();
    let several = Predictor::full(&common::exciting(&common::dataset(pieces), PAST, FUTURE, 4));
    assert_eq!(several.stacked().ncols(), 8 * (40 - PAST - FUTURE + 1));
    for seed in 0..4 {
        let situation = Situation::new(&system, 0.0, seed);
        let a = situation.condensed(&one, &settings);
        let b = situation.condensed(&several, &settings);
        check_same(&format!("records, {seed}"), &a, &b, 1e-5, 1e-5);
    }
}

#[test]
fn multiplying_every_weight_by_a_constant_changes_no_plan() {
    let predictor = predictor(0.05, 150);
    let situation = Situation::new(&system(), 0.05, 2);
    let scaled = |c: f64| {
        let mut scaled = settings(Slack::Penalty(1e3 * c), Slack::Penalty(1e4 * c));
        scaled.regularisation.lambda_g *= c;
        scaled.input_weights.iter_mut().for_each(|w| *w *= c);
        scaled.output_weights.iter_mut().for_each(|w| *w *= c);
        scaled.output_bounds = vec![
            OutputBounds::soft(-1.0, 1.0, 3.0 * c, 2.0 * c),
            OutputBounds::none(),
            OutputBounds::soft(-2.0, 1.5, 0.0, 5.0 * c),
        ];
        scaled
    };
    let expected = situation.condensed(&predictor, &scaled(1.0));
    for c in [1e-14, 1e-10, 1e-6, 1e6, 1e10] {
        let settings = scaled(c);
        let mut active = situation.condensed(&predictor, &settings);
        active.objective /= c;
        check_same(&format!("{c:e}, active"), &active, &expected, 1e-9, 1e-7);
        let mut sparse = situation.sparse(&predictor, &settings);
        sparse.objective /= c;
        check_same(&format!("{c:e}, sparse"), &sparse, &expected, 1e-7, 1e-5);
        let mut program = CondensedProgram::new(&predictor, &settings).unwrap();
        let mut direct = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
        let budget = SolveBudget::generous();
        program
            .solve(&situation.moment(), &mut direct, &budget)
            .unwrap();
        let mut direct = Solved::of(&program);
        direct.objective /= c;
        check_same(&format!("{c:e}, direct"), &direct, &expected, 1e-7, 1e-5);
    }
}

#[test]
fn per_column_regularisation_keeps_its_meaning_when_the_data_are_doubled() {
    let record = common::record(&system(), 150, 0.05, 3);
    let once = common::dataset(vec![record.clone()]);
    let twice = common::dataset(vec![record.clone(), record]);
    let build = |data: &Dataset| Predictor::full(&common::exciting(data, PAST, FUTURE, 4));
    let (once, twice) = (build(&once), build(&twice));
    let mut settings = settings(Slack::Hard, Slack::Penalty(1e4));
    let situation = Situation::new(&system(), 0.05, 2);
    settings.regularisation.normalisation = Normalisation::PerColumn;
    settings.regularisation.lambda_g = 0.01;
    let (a, b) = (
        situation.condensed(&once, &settings),
        situation.condensed(&twice, &settings),
    );
    check_same("per column", &a, &b, 1e-9, 1e-8);
    // The same as raw with λ_g·J.
    settings.regularisation.normalisation = Normalisation::Raw;
    settings.regularisation.lambda_g = 0.01 * once.stacked().ncols() as f64;
    check_same(
        "raw",
        &a,
        &situation.condensed(&once, &settings),
        1e-9,
        1e-8,
    );
    let doubled = situation.condensed(&twice, &settings);
    assert!(common::largest_difference(&a.inputs, &doubled.inputs) > 1e-4);
}

#[test]
fn units_of_a_channel_do_not_matter() {
    let (inputs, outputs) = common::record(&system(), 150, 0.05, 3);
    let scale = [1e6, 1e-6];
    let scaled = Mat::from_fn(inputs.nrows(), 2, |k, i| inputs[(k, i)] * scale[i]);
    let plain = settings(Slack::Hard, Slack::Penalty(1e4));
    let mut other = plain.clone();
    for (i, scale) in scale.iter().enumerate() {
        other.input_weights[i] /= scale * scale;
        other.input_bounds[i].lower = other.input_bounds[i].lower.map(|b| b * scale);
        other.input_bounds[i].upper = other.input_bounds[i].upper.map(|b| b * scale);
    }
    let horizons = Horizons {
        past: PAST,
        future: FUTURE,
    };
    let build = |inputs: Mat<f64>| {
        let data = common::dataset(vec![(inputs, outputs.clone())]);
        let hankel = HankelMatrix::build(&data, horizons).unwrap();
        Predictor::exact(&hankel.require_persistently_exciting(4).unwrap()).unwrap()
    };
    let (plain_data, scaled_data) = (build(inputs), build(scaled));
    assert_eq!(plain_data.stacked().shape(), scaled_data.stacked().shape());
    for seed in 0..3 {
        let mut situation = Situation::new(&system(), 0.05, seed);
        let a = situation.condensed(&plain_data, &plain);
        for (i, scale) in scale.iter().enumerate() {
            situation
                .past_inputs
                .col_mut(i)
                .iter_mut()
                .for_each(|u| *u *= scale);
            situation
                .input_reference
                .col_mut(i)
                .iter_mut()
                .for_each(|u| *u *= scale);
        }
        let b = situation.condensed(&scaled_data, &other);
        assert!(
            a.is_usable() && b.is_usable(),
            "{:?}, {:?}",
            a.status,
            b.status
        );
        assert!((a.objective - b.objective).abs() <= 1e-9 * a.objective);
        for (i, scale) in scale.iter().enumerate() {
            for k in 0..FUTURE {
                assert!((a.inputs[(k, i)] - b.inputs[(k, i)] / scale).abs() < 1e-8);
            }
        }
    }
}
