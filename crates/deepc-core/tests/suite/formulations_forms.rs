//! Every option, by itself and with all others: the condensed form has the optimum of the sparse
//! form, which is the problem as the papers write it.

use crate::formulations_support;
use deepc_core::program::{
    AffineConstraint, Bounds, DeepcSettings, DisturbanceSlack, OutputBounds, Regularisation, Slack,
    Softness, Steps, Terminal,
};
use deepc_core::solver::{QpStatus, SoftPenalty};
use formulations_support::{
    ANOTHER_PLAN, SLACKS, Sizes, Study, accurate, check_same, fast, future, largest_gap, settings,
};

const OBJECTIVE: f64 = 1e-9;
const SIGNALS: f64 = 1e-6;

fn soft(linear: f64, quadratic: f64) -> Softness {
    Softness::Soft(SoftPenalty { linear, quadratic })
}

type Change = fn(&mut DeepcSettings);

/// Every option by itself. The last entry changes nothing.
const OPTIONS: [(&str, Change); 13] = [
    ("weights per step", weights_per_step),
    ("input changes", input_changes),
    ("rates", rates),
    ("hard affine", |s| affine(s, Softness::Hard, Steps::All)),
    ("soft affine", |s| affine(s, soft(2.0, 0.0), Steps::All)),
    ("affine at the end", |s| {
        affine(s, soft(0.5, 3.0), Steps::Last(2));
    }),
    ("affine at a step", |s| {
        affine(s, Softness::Hard, Steps::At(1));
    }),
    ("hard terminal", |s| terminal(s, Softness::Hard, 2)),
    ("soft terminal", |s| terminal(s, soft(0.5, 1.0), 3)),
    ("hard outputs", |s| {
        s.output_bounds[1] = OutputBounds::hard(-0.4, 0.3);
    }),
    ("linear outputs", |s| {
        s.output_bounds[1] = OutputBounds::soft(-0.4, 0.3, 1.5, 0.0);
    }),
    ("fixed input", |s| {
        s.input_bounds[1] = Bounds::between(0.05, 0.05);
    }),
    ("nothing", |_| ()),
];

fn weights_per_step(settings: &mut DeepcSettings) {
    let factor = |k: usize, i: usize| 0.2 + ((2 * k + 3 * i) % 5) as f64;
    let table = |offset| (0..5).map(move |k| vec![factor(k, offset), factor(k + 1, offset)]);
    settings.options.input_weight_factors = table(0).collect();
    settings.options.output_weight_factors = table(1).collect();
}

fn input_changes(settings: &mut DeepcSettings) {
    settings.options.input_change_weights = vec![0.0, 2.0];
}

fn rates(settings: &mut DeepcSettings) {
    let one_sided = Bounds {
        lower: None,
        upper: Some(0.12),
    };
    settings.options.input_change_bounds = vec![Bounds::between(-0.15, 0.15), one_sided];
}

fn affine(settings: &mut DeepcSettings, softness: Softness, steps: Steps) {
    settings.options.affine.push(AffineConstraint {
        inputs: vec![1.0, -0.5],
        outputs: vec![0.0, 0.6],
        bounds: Bounds::between(-0.05, 0.03),
        softness,
        steps,
    });
}

fn terminal(settings: &mut DeepcSettings, softness: Softness, steps: usize) {
    settings.options.terminal = Some(Terminal { steps, softness });
}

/// All options together, as far as they do not contradict each other.
fn everything(settings: &mut DeepcSettings) {
    weights_per_step(settings);
    input_changes(settings);
    rates(settings);
    affine(settings, Softness::Hard, Steps::At(1));
    affine(settings, soft(0.5, 3.0), Steps::Last(2));
    affine(settings, soft(0.0, 7.0), Steps::All);
    terminal(settings, Softness::Hard, 1);
    settings.output_bounds[0] = OutputBounds::soft(-0.4, 0.3, 1.5, 0.0);
}

const REGULARISATIONS: [fn() -> Regularisation; 4] = [
    || Regularisation::raw(0.5),
    || Regularisation::per_column(0.02),
    || Regularisation::projection(0.3),
    Regularisation::none,
];

/// Solves in three ways; the largest distance of the plans from `plain`.
fn compare(what: &str, study: &Study, settings: &DeepcSettings, plain: &DeepcSettings) -> f64 {
    let mut distance: f64 = 0.0;
    for seed in 0..2 {
        let what = format!("{what}, {seed}");
        let situation = study.situation(seed);
        let condensed = study.condensed(settings, &situation, accurate);
        let sparse = study.sparse(settings, &situation);
        check_same(&what, &condensed, &sparse, OBJECTIVE, SIGNALS);
        let loop_plan = study.condensed(settings, &situation, fast);
        check_same(&what, &loop_plan, &condensed, OBJECTIVE, SIGNALS);
        assert!(loop_plan.input_violation <= 1e-9, "{what}");
        let plain = study.condensed(plain, &situation, fast);
        distance = distance.max(largest_gap(&future(&condensed), &future(&plain)));
    }
    distance
}

#[test]
fn every_option_by_itself() {
    let study = Study::new(Sizes::SMALL, 0.05, &[80], 1);
    for (kind, regularisation) in REGULARISATIONS.iter().enumerate() {
        for (i, (name, change)) in OPTIONS.iter().enumerate() {
            let mut plain = settings(study.sizes);
            plain.regularisation = regularisation();
            (plain.input_slack, plain.output_slack) = SLACKS[(i + kind) % 4];
            let mut changed = plain.clone();
            change(&mut changed);
            let what = format!("{name}, {:?}", plain.regularisation.part);
            let distance = compare(&what, &study, &changed, &plain);
            assert_eq!(
                distance > ANOTHER_PLAN,
                *name != "nothing",
                "{what}: {distance:e}"
            );
        }
    }
}

#[test]
fn all_options_with_every_kind_of_slack() {
    let study = Study::new(Sizes::SMALL, 0.05, &[80], 2);
    for regularisation in REGULARISATIONS {
        for (input_slack, output_slack) in SLACKS {
            let mut plain = settings(study.sizes);
            plain.regularisation = regularisation();
            (plain.input_slack, plain.output_slack) = (input_slack, output_slack);
            let mut changed = plain.clone();
            everything(&mut changed);
            let what = format!(
                "{input_slack:?}, {output_slack:?}, {:?}",
                regularisation().part
            );
            assert!(
                compare(&what, &study, &changed, &plain) > ANOTHER_PLAN,
                "{what}"
            );
        }
    }
}

#[test]
fn previewed_disturbances_and_several_records() {
    for (q, disturbance_slack) in [
        (1, Slack::Hard),
        (1, Slack::Penalty(3.0)),
        (2, Slack::Hard),
        (2, Slack::Penalty(50.0)),
    ] {
        let sizes = Sizes::SMALL.with_disturbances(q);
        for records in [&[120][..], &[40, 9, 8, 50, 45]] {
            let study = Study::new(sizes, 0.05, records, 3);
            for (i, regularisation) in REGULARISATIONS.iter().enumerate() {
                let mut plain = settings(sizes);
                plain.regularisation = regularisation();
                plain.options.disturbance_slack = DisturbanceSlack(disturbance_slack);
                (plain.input_slack, plain.output_slack) = SLACKS[(i + q) % 4];
                let what = format!("{q}, {disturbance_slack:?}, {records:?}, {i}");
                compare(&what, &study, &plain, &plain);
                let mut changed = plain.clone();
                everything(&mut changed);
                compare(&what, &study, &changed, &plain);
            }
        }
    }
}

#[test]
fn a_preview_moves_the_plan() {
    let sizes = Sizes::SMALL.with_disturbances(1);
    let study = Study::new(sizes, 0.02, &[120], 5);
    let settings = settings(sizes);
    let mut situation = study.situation(1);
    let before = study.condensed(&settings, &situation, fast);
    situation.preview[(4, 0)] += 1.0;
    let after = study.condensed(&settings, &situation, fast);
    assert!(largest_gap(&future(&before), &future(&after)) > 1e-3);
}

/// Contradictions are found by both forms.
#[test]
fn contradictions_are_infeasible_in_both_forms() {
    let study = Study::new(Sizes::SMALL, 0.05, &[80], 1);
    let contradictions: [(&str, Change); 3] = [
        ("terminal input beyond its bounds", |s| {
            terminal(s, Softness::Hard, 1);
            s.input_bounds[0] = Bounds::between(0.3, 0.4);
        }),
        ("rate against bound", |s| {
            s.options.input_change_bounds = vec![Bounds::between(-0.01, 0.01), Bounds::none()];
            s.input_bounds[0] = Bounds::between(0.35, 0.4);
        }),
        ("affine against bound", |s| {
            s.options.affine.push(AffineConstraint {
                inputs: vec![1.0, 1.0],
                outputs: vec![0.0, 0.0],
                bounds: Bounds {
                    lower: None,
                    upper: Some(-0.7),
                },
                softness: Softness::Hard,
                steps: Steps::At(2),
            });
        }),
    ];
    for (what, change) in contradictions {
        let mut settings = settings(study.sizes);
        change(&mut settings);
        let situation = study.situation(0);
        for plan in [
            study.condensed(&settings, &situation, accurate),
            study.condensed(&settings, &situation, fast),
            study.sparse(&settings, &situation),
        ] {
            assert_eq!(plan.status, QpStatus::Infeasible, "{what}");
            assert!(plan.objective.is_nan());
        }
    }
}

/// One step, one channel, few columns, no bound: nothing may be assumed about sizes.
#[test]
fn degenerate_sizes() {
    for (order, m, q, p, past, future, samples) in [
        (1, 1, 0, 1, 1, 1, 30),
        (1, 1, 0, 1, 1, 4, 40),
        (2, 1, 0, 1, 3, 1, 40),
        (2, 2, 2, 2, 2, 1, 60),
        (1, 1, 1, 1, 1, 1, 30),
        // Fewer columns than rows: J = 16 of 32, and J = 2.
        (3, 2, 0, 2, 3, 5, 23),
        (3, 2, 1, 2, 2, 2, 5),
    ] {
        let sizes = Sizes {
            order,
            inputs: m,
            disturbances: q,
            outputs: p,
            past,
            future,
        };
        let study = Study::new(sizes, 0.05, &[samples], 7);
        let scarce = study.columns() < study.predictor.stacked().nrows();
        for (i, regularisation) in REGULARISATIONS.iter().enumerate() {
            let mut plain = settings(sizes);
            plain.regularisation = regularisation();
            // Scarce data explain no past exactly.
            if scarce {
                plain.options.disturbance_slack = DisturbanceSlack(Slack::Penalty(1e3));
            } else {
                (plain.input_slack, plain.output_slack) = SLACKS[i % 4];
            }
            // Inputs fixed by scarce data cannot meet hard bounds.
            let free = formulations_support::unbounded(plain.clone());
            let mut bounded = if scarce { free.clone() } else { plain };
            bounded.output_bounds = settings(sizes).output_bounds;
            for settings in [free, bounded] {
                for seed in 0..2 {
                    let what = format!("{sizes:?}, {:?}, {seed}", settings.regularisation.part);
                    let situation = study.situation(seed);
                    let sparse = study.sparse(&settings, &situation);
                    for solver in [accurate, fast] {
                        let condensed = study.condensed(&settings, &situation, solver);
                        check_same(&what, &condensed, &sparse, OBJECTIVE, SIGNALS);
                    }
                }
            }
        }
    }
}
