//! What surrounds an optimum: its parts, its units, its errors.

use crate::common;
use crate::formulations_support;
use deepc_core::program::{
    AffineConstraint, Bounds, CondensedProgram, DeepcSettings, DisturbanceSlack, OutputBounds,
    PlanOrigin, PredictiveProgram, ProgramError, Recovered, Regularisation, Slack, Softness,
    SparseProgram, Steps, Terminal,
};
use deepc_core::solver::SoftPenalty;
use faer::Mat;
use formulations_support::{
    SLACKS, Situation, Sizes, Study, accurate, fast, largest_gap, product, settings, solve,
    time_major, unbounded,
};

const REGULARISATIONS: [fn() -> Regularisation; 7] = [
    || Regularisation::raw(0.5),
    || Regularisation::per_column(0.02),
    || Regularisation::projection(0.3),
    || Regularisation::gamma(0.05, Some(2.0)),
    || Regularisation::gamma(0.05, None),
    Regularisation::spc,
    Regularisation::none,
];

fn close(what: &str, a: f64, b: f64, scale: f64) {
    assert!((a - b).abs() <= 1e-9 * scale, "{what}: {a:e} and {b:e}");
}

/// The recovered variables are a point of the full problem, with the cost the program states.
fn check_recovered(
    what: &str,
    program: &dyn PredictiveProgram,
    settings: &DeepcSettings,
    situation: &Situation,
    study: &Study,
) {
    let recovered: Recovered = program.recover().unwrap();
    let sizes = study.sizes;
    let objective = program.objective().unwrap();
    let parts = recovered.parts;
    close(what, parts.total(), objective, objective);
    let plan = program.plan();
    let tracking = parts.input_tracking + parts.output_tracking + parts.input_change;
    close(what, tracking, plan.tracking, objective);
    close(what, parts.soft_bounds, plan.soft_penalty, objective);

    // H̄g = (z + σ, f); disturbances are matched exactly here.
    let shown = product(study.predictor.stacked(), &recovered.g);
    let mut expected = situation.known();
    let [u, y] = [&recovered.input_slack, &recovered.output_slack].map(time_major);
    let first_output = (sizes.inputs + sizes.disturbances) * sizes.past;
    for (i, slack) in u.iter().enumerate() {
        expected[i] += slack;
    }
    for (i, slack) in y.iter().enumerate() {
        expected[first_output + i] += slack;
    }
    expected.extend(time_major(&plan.inputs));
    expected.extend(time_major(&plan.outputs));
    let gap = largest_gap(&shown, &expected);
    assert!(gap < 1e-8, "{what}: the trajectory of g is {gap:e} away");

    for (slack, setting, part) in [
        (&u, settings.input_slack, parts.input_slack),
        (&y, settings.output_slack, parts.output_slack),
    ] {
        let squares: f64 = slack.iter().map(|s| s * s).sum();
        match setting {
            Slack::Hard => assert!(squares == 0.0 && part == 0.0, "{what}"),
            Slack::Penalty(lambda) => {
                assert!(squares > 0.0, "{what}");
                close(what, part, lambda * squares, objective);
            }
        }
    }
    if settings.regularisation == Regularisation::raw(0.5) {
        let norm: f64 = recovered.g.iter().map(|g| g * g).sum();
        close(what, parts.regularisation, 0.5 * norm, objective);
    }
    let charged =
        ![Regularisation::spc(), Regularisation::none()].contains(&settings.regularisation);
    assert_eq!(
        parts.regularisation > 1e-9 * objective,
        charged,
        "{what}: {parts:?}"
    );
}

#[test]
fn parts_add_up_and_g_gives_the_trajectory() {
    for q in 0..=1 {
        let sizes = Sizes::SMALL.with_disturbances(q);
        let study = Study::new(sizes, 0.05, &[110], 21);
        for regularisation in REGULARISATIONS {
            for (input_slack, output_slack) in SLACKS {
                let mut settings = settings(sizes);
                settings.regularisation = regularisation();
                (settings.input_slack, settings.output_slack) = (input_slack, output_slack);
                settings.options.input_change_weights = vec![0.3, 0.1];
                let situation = study.situation(2);
                let what = format!(
                    "{q}, {:?}, {input_slack:?}, {output_slack:?}",
                    regularisation()
                );
                let mut condensed = CondensedProgram::new(&study.predictor, &settings).unwrap();
                solve(&mut condensed, &situation, fast);
                check_recovered(&what, &condensed, &settings, &situation, &study);
                // Nothing is bounded: the same from the gain alone.
                let free = unbounded(settings.clone());
                let mut condensed = CondensedProgram::new(&study.predictor, &free).unwrap();
                let plan = solve(&mut condensed, &situation, fast);
                assert_eq!(plan.origin, PlanOrigin::Unconstrained);
                check_recovered(&what, &condensed, &settings, &situation, &study);
                if let Ok(mut sparse) = SparseProgram::new(&study.predictor, &settings) {
                    solve(&mut sparse, &situation, accurate);
                    check_recovered(&what, &sparse, &settings, &situation, &study);
                }
            }
        }
    }
}

#[test]
fn an_input_that_costs_nothing_is_refused() {
    let study = Study::new(Sizes::SMALL, 0.05, &[110], 24);
    for regularisation in REGULARISATIONS {
        let mut settings = settings(study.sizes);
        settings.regularisation = regularisation();
        settings.input_weights[1] = 0.0;
        settings.output_weights = vec![0.0, 0.0];
        let charged = matches!(
            regularisation().part,
            deepc_core::program::RegularisedPart::SquaredNorm
                | deepc_core::program::RegularisedPart::Gamma { .. }
        );
        let result = CondensedProgram::new(&study.predictor, &settings);
        match result.err() {
            None => assert!(charged, "{:?}", regularisation()),
            Some(error) => {
                assert!(!charged, "{:?}", regularisation());
                let message = error.to_string();
                assert!(
                    matches!(error, ProgramError::Undetermined { .. }),
                    "{message}"
                );
                assert!(message.contains("give every input a weight"), "{message}");
            }
        }
        // A price on its changes determines it.
        settings.options.input_change_weights = vec![0.0, 0.1];
        let all_outputs = matches!(
            regularisation().part,
            deepc_core::program::RegularisedPart::None
        );
        if !all_outputs {
            CondensedProgram::new(&study.predictor, &settings).unwrap();
        }
    }
}

fn soft(linear: f64, quadratic: f64) -> Softness {
    Softness::Soft(SoftPenalty { linear, quadratic })
}

fn affine(change: impl Fn(&mut AffineConstraint)) -> AffineConstraint {
    let mut constraint = AffineConstraint {
        inputs: vec![1.0, 0.0],
        outputs: vec![0.0, 1.0],
        bounds: Bounds::between(-1.0, 1.0),
        softness: Softness::Hard,
        steps: Steps::All,
    };
    change(&mut constraint);
    constraint
}

type Change = fn(&mut DeepcSettings);

/// What is wrong, and what its message must say.
const OUT_OF_RANGE: [(Change, &[&str]); 27] = [
    (
        |s| s.regularisation.lambda_g = 0.0,
        &["`regularisation.lambda_g` is 0", "above 0"],
    ),
    (
        |s| s.regularisation.lambda_g = f64::NAN,
        &["`regularisation.lambda_g` is NaN", "finite"],
    ),
    (
        |s| s.regularisation.part = deepc_core::program::RegularisedPart::Spc,
        &["`regularisation.lambda_g` is 0.5", "give 0"],
    ),
    (
        |s| s.regularisation = Regularisation::gamma(0.1, Some(-2.0)),
        &["gamma.lambda_3` is -2", "above 0"],
    ),
    (
        |s| s.regularisation = Regularisation::gamma(0.1, Some(f64::INFINITY)),
        &["gamma.lambda_3` is inf", "finite"],
    ),
    (
        |s| s.options.input_weight_factors = vec![vec![1.0; 2]; 4],
        &[
            "`input_weight_factors` has 4 rows, expected 5",
            "one per step",
        ],
    ),
    (
        |s| s.options.output_weight_factors = vec![vec![1.0; 3]; 5],
        &["`output_weight_factors[0]` has 3 entries, expected 2"],
    ),
    (
        |s| s.options.input_weight_factors = vec![vec![1.0, -0.5]; 5],
        &["`input_weight_factors[0][1]` is -0.5", "at least 0"],
    ),
    (
        |s| s.options.output_weight_factors = vec![vec![f64::INFINITY, 0.0]; 5],
        &["`output_weight_factors[0][0]` is inf", "finite"],
    ),
    (
        |s| s.options.input_change_weights = vec![1.0; 3],
        &["`input_change_weights` has 3 entries, expected 2"],
    ),
    (
        |s| s.options.input_change_weights = vec![1.0, -1e-3],
        &["`input_change_weights[1]` is -0.001", "at least 0"],
    ),
    (
        |s| s.options.input_change_bounds = vec![Bounds::none()],
        &["`input_change_bounds` has 1 entries, expected 2"],
    ),
    (
        |s| s.options.input_change_bounds = vec![Bounds::none(), Bounds::between(0.2, 0.1)],
        &["`input_change_bounds[1]` is 0.2 to 0.1", "must not exceed"],
    ),
    (
        |s| {
            s.options.input_change_bounds = vec![Bounds::between(f64::NAN, 0.1), Bounds::none()];
        },
        &["`input_change_bounds[0]` is NaN to 0.1"],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.inputs = vec![1.0])],
        &["`affine[0].inputs` has 1 entries, expected 2"],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.outputs = vec![1.0; 4])],
        &["`affine[0].outputs` has 4 entries, expected 2"],
    ),
    (
        |s| s.options.affine = vec![affine(|_| ()), affine(|c| c.outputs[1] = f64::NAN)],
        &["`affine[1]` has the coefficient NaN", "finite"],
    ),
    (
        |s| {
            let zero = |c: &mut AffineConstraint| (c.inputs[0], c.outputs[1]) = (0.0, 0.0);
            s.options.affine = vec![affine(|_| ()), affine(|_| ()), affine(zero)];
        },
        &["`affine[2]` has no coefficient other than 0"],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.bounds = Bounds::between(1.0, -1.0))],
        &["`affine[0]` is 1 to -1", "must not exceed"],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.softness = soft(0.0, 0.0))],
        &[
            "`affine.softness[0]` has linear 0 and quadratic 0",
            "one above 0",
        ],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.steps = Steps::Last(6))],
        &["`affine.steps[0]` speaks of 6, but the horizon has 5 steps"],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.steps = Steps::Last(0))],
        &["`affine.steps[0]` speaks of 0, but the horizon has 5 steps"],
    ),
    (
        |s| s.options.affine = vec![affine(|c| c.steps = Steps::At(5))],
        &["`affine.steps[0]` speaks of 5, but the horizon has 5 steps"],
    ),
    (
        |s| {
            let softness = Softness::Hard;
            s.options.terminal = Some(Terminal { steps: 6, softness });
        },
        &["`terminal[0]` speaks of 6, but the horizon has 5 steps"],
    ),
    (
        |s| {
            let softness = soft(-1.0, 2.0);
            s.options.terminal = Some(Terminal { steps: 1, softness });
        },
        &["`terminal.softness[0]` has linear -1 and quadratic 2"],
    ),
    (
        |s| s.options.disturbance_slack = DisturbanceSlack(Slack::Penalty(0.0)),
        &["`disturbance_slack` is 0", "above 0", "hard"],
    ),
    (
        |s| s.output_bounds[1] = OutputBounds::soft(0.0, 1.0, f64::NAN, 1.0),
        &[
            "`output_bounds.softness[1]` has linear NaN and quadratic 1",
            "finite",
        ],
    ),
];

#[test]
fn settings_out_of_range_name_field_number_and_range() {
    let study = Study::new(Sizes::SMALL, 0.05, &[80], 25);
    for (change, parts) in OUT_OF_RANGE {
        let mut settings = settings(study.sizes);
        change(&mut settings);
        for error in [
            CondensedProgram::new(&study.predictor, &settings).err(),
            SparseProgram::new(&study.predictor, &settings).err(),
        ] {
            let error = error.unwrap_or_else(|| panic!("{parts:?} was accepted"));
            assert!(matches!(error, ProgramError::Settings(_)), "{error}");
            for part in parts {
                assert!(
                    error.to_string().contains(part),
                    "`{part}` is not in: {error}"
                );
            }
        }
    }
}

/// Channels in other units are the same problem.
#[test]
fn units_change_nothing() {
    let sizes = Sizes::SMALL;
    for scales in [[1e6, 1e-6, 1e6, 1e-6], [1e-6, 1e-6, 1e6, 1e6]] {
        let plain_study = Study::new(sizes, 0.05, &[110], 26);
        let scaled_study = Study::scaled(sizes, 0.05, &[110], 26, &scales);
        for regularisation in [
            Regularisation::raw(0.5),
            Regularisation::projection(0.3),
            Regularisation::gamma(0.1, Some(3.0)),
            Regularisation::spc(),
            Regularisation::none(),
        ] {
            let mut plain = settings(sizes);
            plain.regularisation = regularisation;
            plain.input_slack = Slack::Hard;
            plain.output_slack = Slack::Hard;
            plain.output_bounds[1] = OutputBounds::hard(-3.0, 3.0);
            let mut scaled = plain.clone();
            let times = |bounds: Bounds, scale: f64| Bounds {
                lower: bounds.lower.map(|b| b * scale),
                upper: bounds.upper.map(|b| b * scale),
            };
            for i in 0..2 {
                scaled.input_weights[i] /= scales[i] * scales[i];
                scaled.input_bounds[i] = times(plain.input_bounds[i], scales[i]);
                let scale = scales[2 + i];
                scaled.output_weights[i] /= scale * scale;
                let output = &mut scaled.output_bounds[i];
                output.bounds = times(output.bounds, scale);
                if let Softness::Soft(penalty) = &mut output.softness {
                    penalty.linear /= scale;
                    penalty.quadratic /= scale * scale;
                }
            }
            for seed in 0..4 {
                let mut situation = plain_study.situation(seed);
                let a = plain_study.condensed(&plain, &situation, fast);
                situation.scale(&scales);
                let b = scaled_study.condensed(&scaled, &situation, fast);
                let what = format!("{:?}, {scales:?}, {seed}", regularisation.part);
                assert!(
                    a.is_usable() && b.is_usable(),
                    "{what}: {:?} {:?}",
                    a.status,
                    b.status
                );
                close(&what, a.objective, b.objective, a.objective);
                let unscaled = |series: &Mat<f64>, scales: &[f64]| {
                    Mat::from_fn(series.nrows(), 2, |k, i| series[(k, i)] / scales[i])
                };
                let inputs = unscaled(&b.inputs, &scales[..2]);
                let outputs = unscaled(&b.outputs, &scales[2..]);
                assert!(
                    common::largest_difference(&a.inputs, &inputs) < 1e-7,
                    "{what}"
                );
                assert!(
                    common::largest_difference(&a.outputs, &outputs) < 1e-7,
                    "{what}"
                );
                for (i, bounds) in scaled.input_bounds.iter().enumerate() {
                    for k in 0..sizes.future {
                        let beyond = bounds.violation(b.inputs[(k, i)]);
                        assert!(beyond <= 1e-9 * scales[i], "{what}: {beyond:e}");
                    }
                }
                assert!(b.output_violation[1] <= 1e-9 * scales[3], "{what}");
            }
        }
    }
}
