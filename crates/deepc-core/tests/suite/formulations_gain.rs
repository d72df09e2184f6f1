//! The optimum without constraints, from one constant matrix.

use crate::formulations_support;
use deepc_core::program::{CondensedProgram, DeepcSettings, PlanOrigin, Regularisation, Slack};
use faer::Mat;
use faer::prelude::SolveLstsq;
use formulations_support::{
    Situation, Sizes, Study, above, fast, future, largest_gap, product, settings, solve, unbounded,
};

const REGULARISATIONS: [fn() -> Regularisation; 5] = [
    || Regularisation::raw(0.5),
    || Regularisation::projection(0.3),
    || Regularisation::gamma(0.05, Some(2.0)),
    Regularisation::spc,
    Regularisation::none,
];

/// θ as the documentation of `optimum_gain` states it: z and the weighted references.
#[test]
fn the_unconstrained_plan_is_one_product() {
    let sizes = Sizes::SMALL.with_disturbances(1);
    let study = Study::new(sizes, 0.05, &[110], 22);
    for regularisation in REGULARISATIONS {
        let mut settings = unbounded(settings(sizes));
        settings.regularisation = regularisation();
        settings.options.input_change_weights = vec![0.3, 0.0];
        let mut program = CondensedProgram::new(&study.predictor, &settings).unwrap();
        for seed in 0..3 {
            let situation = study.situation(seed);
            let plan = solve(&mut program, &situation, fast);
            assert_eq!(
                (plan.origin, plan.iterations),
                (PlanOrigin::Unconstrained, 0)
            );
            let theta = [situation.known(), situation.reference()].concat();
            let gain = program.optimum_gain();
            assert_eq!(gain.ncols(), theta.len());
            let gap = largest_gap(&product(gain, &theta), &future(&plan));
            assert!(gap < 1e-12, "{gap:e}");
        }
    }
    // References without a weight are no part of θ.
    let mut settings = unbounded(settings(sizes));
    settings.output_weights[1] = 0.0;
    let program = CondensedProgram::new(&study.predictor, &settings).unwrap();
    let weighted = 3 * sizes.future;
    assert_eq!(program.optimum_gain().ncols(), sizes.known() + weighted);
}

/// f of the optimum without bounds and without slack: g = (what the past fixes) + Q₂h with Q₂ from
/// the complete QR decomposition of Zᵀ, and h by least squares, again by QR. Nothing is squared and
/// no gain is formed.
fn by_null_space(study: &Study, settings: &DeepcSettings, situation: &Situation) -> Vec<f64> {
    let [z, u, y] = study.blocks();
    let (sizes, known) = (study.sizes, situation.known());
    let qr = z.transpose().qr();
    let (q, r) = (qr.compute_Q(), qr.thin_R());
    // Rᵀa = z, row by row.
    let mut a = vec![0.0; known.len()];
    for i in 0..a.len() {
        let done: f64 = (0..i).map(|j| r[(j, i)] * a[j]).sum();
        a[i] = (known[i] - done) / r[(i, i)];
    }
    let fixed = product(q.subcols(0, a.len()), &a);
    let null = q.subcols(a.len(), q.ncols() - a.len());
    let f = above(u, y);
    let (start, directions) = (product(f.as_ref(), &fixed), &f * null);

    // Rows of the cost: weights, input changes, then ‖h‖² by itself.
    let (m, p, k) = (sizes.inputs, sizes.outputs, null.ncols());
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for (i, reference) in situation.reference().iter().enumerate() {
        let weight = match i.checked_sub(m * sizes.future) {
            None => settings.input_weights[i % m],
            Some(i) => settings.output_weights[i % p],
        };
        rows.push((weight, i, None));
        right.push(weight.sqrt() * (reference - start[i]));
    }
    for i in 0..m * sizes.future {
        let weight = settings.options.input_change_weights[i % m];
        let before = i.checked_sub(m);
        let newest = || situation.past_inputs[(sizes.past - 1, i)];
        let value = before.map_or_else(newest, |b| start[b]);
        rows.push((weight, i, before));
        right.push(weight.sqrt() * (value - start[i]));
    }
    let charge = settings.regularisation.lambda_g.sqrt();
    let stacked = Mat::from_fn(rows.len() + k, k, |i, j| match rows.get(i) {
        None => charge * f64::from(u8::from(i - rows.len() == j)),
        Some(&(weight, i, before)) => {
            let before = before.map_or(0.0, |b| directions[(b, j)]);
            weight.sqrt() * (directions[(i, j)] - before)
        }
    });
    right.resize(rows.len() + k, 0.0);
    let right = Mat::from_fn(right.len(), 1, |i, _| right[i]);
    let h = stacked.col_piv_qr().solve_lstsq(&right);
    let step = &directions * h;
    (0..start.len()).map(|i| start[i] + step[(i, 0)]).collect()
}

/// One output with next to no noise, so that the past repeats itself but for that, and one whose
/// noise is then explained by what little is left: a gain on z itself has entries of
/// 1/(the little noise) and loses digits that a triangular solve keeps.
#[test]
fn a_badly_spanned_past_keeps_its_digits() {
    let sizes = Sizes {
        past: 6,
        ..Sizes::SMALL
    };
    let mut fell_back = Vec::new();
    for noise in [1e-2, 1e-5, 1e-8, 1e-10] {
        let study = Study::build(sizes, &[noise, 0.05], &[150], 23, &[]);
        let mut settings = unbounded(settings(sizes));
        settings.regularisation = Regularisation::raw(10.0);
        settings.input_slack = Slack::Hard;
        settings.output_slack = Slack::Hard;
        settings.options.input_change_weights = vec![0.3, 0.2];
        let program = CondensedProgram::new(&study.predictor, &settings).unwrap();
        // On coordinates, u(−1) has columns of its own.
        let on_known = sizes.known() + sizes.future_rows();
        let columns = program.optimum_gain().ncols();
        assert!(columns == on_known || columns == on_known + sizes.inputs);
        fell_back.push(columns > on_known);
        for seed in 0..4 {
            let situation = study.situation(seed);
            let plan = study.condensed(&settings, &situation, fast);
            let expected = by_null_space(&study, &settings, &situation);
            let gap = largest_gap(&future(&plan), &expected);
            // Rounding of the data, 1e-16, is 1e-16/noise of the directions of noise.
            assert!(gap < 1e-14 + 1e-15 / noise, "{noise:e}, {seed}: {gap:e}");
        }
    }
    assert!(!fell_back[0] && fell_back[3], "{fell_back:?}");
}
