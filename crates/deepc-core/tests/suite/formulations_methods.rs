//! Every method against a second implementation, written here from the papers.

use crate::common;
use crate::formulations_support;
use common::Solved;
use deepc_core::program::{
    CondensedProgram, DeepcSettings, ProgramError, Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{QpMatrix, QpProblem, QpStatus, QpVectors, SoftPenalty, SolveBudget};
use faer::{Col, Mat, MatRef};
use formulations_support::{
    ANOTHER_PLAN, Independent, Situation, Sizes, Study, above, accurate, beside, check_optimum,
    fast, future, independent, largest_gap, product, settings,
};

const SITUATIONS: u64 = 4;

fn hard(sizes: Sizes, regularisation: Regularisation) -> DeepcSettings {
    let mut settings = settings(sizes);
    settings.regularisation = regularisation;
    settings.input_slack = Slack::Hard;
    settings.output_slack = Slack::Hard;
    settings
}

/// The plan of the control loop.
fn plan(study: &Study, settings: &DeepcSettings, situation: &Situation) -> Solved {
    study.condensed(settings, situation, fast)
}

/// Y X⁺, by singular values down to 1e-9 of the largest.
fn least_squares(y: MatRef<'_, f64>, x: MatRef<'_, f64>) -> Mat<f64> {
    let svd = x.thin_svd().unwrap();
    let sigma = svd.S().column_vector();
    let inverse = Mat::from_fn(x.ncols(), sigma.nrows(), |i, j| {
        if sigma[j] > 1e-9 * sigma[0] {
            svd.V()[(i, j)] / sigma[j]
        } else {
            0.0
        }
    });
    y * inverse * svd.U().transpose()
}

/// Subspace predictive control (Favoreel, De Moor, Gevers 1999): y = Φz + Γu by least squares.
fn textbook_spc(study: &Study, settings: &DeepcSettings, situation: &Situation) -> Independent {
    let [z, u, y] = study.blocks();
    let predictor = least_squares(y, above(z, u).as_ref());
    let phi = predictor.subcols(0, z.nrows());
    let gamma = predictor.subcols(z.nrows(), u.nrows());
    let start = [vec![0.0; u.nrows()], product(phi, &situation.known())].concat();
    let directions = above(Mat::<f64>::identity(u.nrows(), u.nrows()).as_ref(), gamma);
    let charge = vec![0.0; u.nrows()];
    let reference = situation.reference();
    independent(
        study.sizes,
        settings,
        &reference,
        &start,
        &directions,
        &charge,
    )
}

/// The same where the past has slack: y = Φ(z + σ) + Γu at the price of σ.
fn spc_with_slack(study: &Study, settings: &DeepcSettings, situation: &Situation) -> Independent {
    let [z, u, y] = study.blocks();
    let predictor = least_squares(y, above(z, u).as_ref());
    let phi = predictor.subcols(0, z.nrows());
    let gamma = predictor.subcols(z.nrows(), u.nrows());
    let start = [vec![0.0; u.nrows()], product(phi, &situation.known())].concat();
    let by_inputs = above(Mat::<f64>::identity(u.nrows(), u.nrows()).as_ref(), gamma);
    let by_slack = above(Mat::<f64>::zeros(u.nrows(), z.nrows()).as_ref(), phi);
    let directions = beside(by_inputs.as_ref(), by_slack.as_ref());
    let inputs = study.sizes.inputs * study.sizes.past;
    let mut charge = vec![0.0; u.nrows()];
    for i in 0..z.nrows() {
        let slack = if i < inputs {
            settings.input_slack
        } else {
            settings.output_slack
        };
        charge.push(1.0 / slack.compliance());
    }
    let reference = situation.reference();
    independent(
        study.sizes,
        settings,
        &reference,
        &start,
        &directions,
        &charge,
    )
}

/// Rows of `h` by Gram–Schmidt, twice: L of h = LQ.
fn lower_factor(h: &Mat<f64>) -> Mat<f64> {
    let rows = h.nrows();
    let mut l = Mat::zeros(rows, rows);
    let mut basis: Vec<Col<f64>> = Vec::new();
    for i in 0..rows {
        let mut rest = h.row(i).transpose().to_owned();
        for _ in 0..2 {
            for (j, q) in basis.iter().enumerate() {
                let part = q.transpose() * &rest;
                l[(i, j)] += part;
                rest -= faer::Scale(part) * q;
            }
        }
        let length = rest.norm_l2();
        l[(i, i)] = length;
        basis.push(faer::Scale(1.0 / length) * rest);
    }
    l
}

/// γ-DDPC (Breschi, Chiuso, Formentin 2023): LQ of the data divided by √J, γ₁ from the past,
/// β₂‖γ₂‖² + β₃‖γ₃‖², or γ₃ = 0.
fn textbook_gamma(
    study: &Study,
    settings: &DeepcSettings,
    situation: &Situation,
    beta_2: f64,
    beta_3: Option<f64>,
) -> Independent {
    let root = (study.columns() as f64).sqrt();
    let l = lower_factor(&(faer::Scale(1.0 / root) * study.predictor.stacked()));
    let [z, u, y] = study.blocks().map(|block| block.nrows());
    // L₁₁γ₁ = z, row by row.
    let known = situation.known();
    let mut gamma_1 = vec![0.0; z];
    for i in 0..z {
        let done: f64 = (0..i).map(|j| l[(i, j)] * gamma_1[j]).sum();
        gamma_1[i] = (known[i] - done) / l[(i, i)];
    }
    let start = product(l.submatrix(z, 0, u + y, z), &gamma_1);
    let used = u + if beta_3.is_some() { y } else { 0 };
    let directions = l.submatrix(z, z, u + y, used).to_owned();
    let mut charge = vec![beta_2; u];
    charge.resize(used, beta_3.unwrap_or_default());
    let reference = situation.reference();
    independent(
        study.sizes,
        settings,
        &reference,
        &start,
        &directions,
        &charge,
    )
}

/// Textbook model predictive control: the model is the plant, the state is known.
fn model_based(study: &Study, settings: &DeepcSettings, situation: &Situation) -> Independent {
    let Sizes {
        inputs: m,
        disturbances: q,
        future: steps,
        ..
    } = study.sizes;
    let response = |state: &Col<f64>, signals: &Mat<f64>| {
        let outputs = study.system.simulate(&mut state.clone(), signals);
        formulations_support::time_major(&outputs)
    };
    let expected = Mat::from_fn(steps, m + q, |k, i| {
        i.checked_sub(m).map_or(0.0, |i| situation.preview[(k, i)])
    });
    let start = [vec![0.0; m * steps], response(&situation.state, &expected)].concat();
    let rest = Col::zeros(study.sizes.order);
    let mut directions = Mat::zeros(start.len(), m * steps);
    for j in 0..m * steps {
        let impulse = Mat::from_fn(steps, m + q, |k, i| {
            f64::from(u8::from(i < m && k * m + i == j))
        });
        directions[(j, j)] = 1.0;
        for (i, value) in response(&rest, &impulse).into_iter().enumerate() {
            directions[(m * steps + i, j)] = value;
        }
    }
    let charge = vec![0.0; m * steps];
    let reference = situation.reference();
    independent(
        study.sizes,
        settings,
        &reference,
        &start,
        &directions,
        &charge,
    )
}

#[test]
fn spc_is_the_least_squares_predictor() {
    for q in 0..=2 {
        let sizes = Sizes::SMALL.with_disturbances(q);
        let study = Study::new(sizes, 0.1, &[150], 11);
        let settings = hard(sizes, Regularisation::spc());
        for seed in 0..SITUATIONS {
            let situation = study.situation(seed);
            let spc = textbook_spc(&study, &settings, &situation);
            let plan = plan(&study, &settings, &situation);
            check_optimum(&format!("{q}, {seed}"), &plan, &spc, 1e-9, 1e-7);
        }
    }
}

#[test]
fn spc_with_slack_trades_the_past_for_the_future() {
    let study = Study::new(Sizes::SMALL, 0.1, &[150], 12);
    let mut settings = hard(study.sizes, Regularisation::spc());
    settings.input_slack = Slack::Penalty(3.0);
    settings.output_slack = Slack::Penalty(5.0);
    let hard = hard(study.sizes, Regularisation::spc());
    for seed in 0..SITUATIONS {
        let situation = study.situation(seed);
        let expected = spc_with_slack(&study, &settings, &situation);
        let soft = plan(&study, &settings, &situation);
        check_optimum(&format!("{seed}"), &soft, &expected, 1e-9, 1e-7);
        let hard = plan(&study, &hard, &situation);
        assert!(largest_gap(&future(&hard), &expected.future) > ANOTHER_PLAN);
    }
}

#[test]
fn gamma_is_the_method_of_its_paper() {
    for q in 0..=1 {
        let sizes = Sizes::SMALL.with_disturbances(q);
        let study = Study::new(sizes, 0.1, &[150], 13);
        for (beta_2, beta_3) in [(0.02, Some(3.0)), (0.5, Some(0.1)), (0.1, None)] {
            let settings = hard(sizes, Regularisation::gamma(beta_2, beta_3));
            for seed in 0..SITUATIONS {
                let situation = study.situation(seed);
                let expected = textbook_gamma(&study, &settings, &situation, beta_2, beta_3);
                let plan = plan(&study, &settings, &situation);
                let what = format!("{q}, {beta_2}, {beta_3:?}, {seed}");
                check_optimum(&what, &plan, &expected, 1e-9, 1e-7);
            }
        }
    }
}

/// Distance of the plans of two regularisations.
fn distance(study: &Study, a: Regularisation, b: Regularisation) -> f64 {
    let (a, b) = (hard(study.sizes, a), hard(study.sizes, b));
    let gap = |seed| {
        let situation = study.situation(seed);
        let (a, b) = (plan(study, &a, &situation), plan(study, &b, &situation));
        assert!(
            a.is_usable() && b.is_usable(),
            "{:?}, {:?}",
            a.status,
            b.status
        );
        largest_gap(&future(&a), &future(&b))
    };
    (0..SITUATIONS).map(gap).fold(0.0, f64::max)
}

type Family = fn(f64) -> Regularisation;

/// Every limit is reached in proportion to what is left.
#[test]
fn methods_are_limits_of_each_other() {
    let study = Study::new(Sizes::SMALL.with_disturbances(1), 0.1, &[150], 14);
    let limits: [(&str, Family, Regularisation); 4] = [
        (
            "γ without γ₃",
            |left| Regularisation::gamma(0.1, Some(1.0 / left)),
            Regularisation::gamma(0.1, None),
        ),
        (
            "projection",
            |left| Regularisation::projection(1.0 / left),
            Regularisation::spc(),
        ),
        (
            "γ without γ₂",
            |left| Regularisation::gamma(left, None),
            Regularisation::spc(),
        ),
        (
            "γ as projection",
            |left| Regularisation::gamma(left, Some(2.0)),
            Regularisation::projection(2.0),
        ),
    ];
    for (what, family, limit) in limits {
        let near: Vec<_> = [1e-2, 1e-5, 1e-8]
            .into_iter()
            .map(|left| distance(&study, family(left), limit))
            .collect();
        assert!(near[0] > ANOTHER_PLAN, "{what}: {near:?}");
        assert!(near[1] < 1e-2 * near[0], "{what}: {near:?}");
        assert!(near[2] < 1e-6, "{what}: {near:?}");
    }
}

#[test]
fn without_noise_every_method_is_model_predictive_control() {
    for q in 0..=1 {
        let sizes = Sizes::SMALL.with_disturbances(q);
        let study = Study::new(sizes, 0.0, &[150], 15);
        for (regularisation, objective) in [
            (Regularisation::raw(1e-8), 1e-5),
            (Regularisation::projection(2.0), 1e-9),
            (Regularisation::spc(), 1e-9),
            (Regularisation::gamma(1e-10, None), 1e-5),
            (Regularisation::none(), 1e-9),
        ] {
            let settings = hard(sizes, regularisation);
            for seed in 0..SITUATIONS {
                let situation = study.situation(seed);
                let expected = model_based(&study, &settings, &situation);
                let plan = plan(&study, &settings, &situation);
                let what = format!("{:?}, {q}, {seed}", regularisation.part);
                check_optimum(&what, &plan, &expected, objective, 1e-5);
            }
        }
    }
}

/// min cost + `λ√J·Σt` over (g, t) with −t ≤ g ≤ t, u = `U_f g`, y = `Y_f g` and the past exact or
/// at its price.
fn epigraph(study: &Study, settings: &DeepcSettings, situation: &Situation) -> Vec<f64> {
    let [z, u, y] = study.blocks();
    let f = above(u, y);
    let columns = study.columns();
    let (known, reference) = (situation.known(), situation.reference());
    let sizes = study.sizes;
    let steps_of_inputs = sizes.inputs * sizes.future;
    let weights: Vec<f64> = (0..f.nrows())
        .map(|i| match i.checked_sub(steps_of_inputs) {
            None => settings.input_weights[i % sizes.inputs],
            Some(i) => settings.output_weights[i % sizes.outputs],
        })
        .collect();
    let prices: Vec<f64> = (0..known.len())
        .map(|i| match i.checked_sub(sizes.inputs * sizes.past) {
            None => settings.input_slack,
            Some(_) => settings.output_slack,
        })
        .map(|slack| match slack {
            Slack::Penalty(lambda) => lambda,
            Slack::Hard => 0.0,
        })
        .collect();
    let weighted = |rows: MatRef<'_, f64>, weights: &[f64]| {
        Mat::from_fn(rows.nrows(), columns, |i, j| weights[i] * rows[(i, j)])
    };
    let (cost_f, cost_z) = (weighted(f.as_ref(), &weights), weighted(z, &prices));
    let curvature = f.transpose() * &cost_f + z.transpose() * &cost_z;
    let pull_f = product(cost_f.transpose(), &reference);
    let pull_z = product(cost_z.transpose(), &known);
    let price = settings.regularisation.lambda_g;
    let hessian = Mat::from_fn(2 * columns, 2 * columns, |i, j| {
        if i < columns && j < columns {
            curvature[(i, j)] + curvature[(j, i)]
        } else {
            0.0
        }
    });
    let mut linear: Vec<f64> = pull_f
        .iter()
        .zip(&pull_z)
        .map(|(a, b)| -2.0 * (a + b))
        .collect();
    linear.resize(2 * columns, price);

    let mut rows: Vec<Vec<f64>> = vec![];
    let (mut lower, mut upper, mut soft) = (vec![], vec![], vec![]);
    let mut push = |row: Vec<f64>, l: f64, u: f64, penalty: Option<SoftPenalty>| {
        rows.push(row);
        lower.push(l);
        upper.push(u);
        soft.push(penalty);
    };
    let padded = |row: faer::RowRef<'_, f64>| {
        let mut row: Vec<f64> = row.iter().copied().collect();
        row.resize(2 * columns, 0.0);
        row
    };
    for (i, &price) in prices.iter().enumerate() {
        if price == 0.0 {
            push(padded(z.row(i)), known[i], known[i], None);
        }
    }
    for i in 0..f.nrows() {
        let (bounds, penalty) = match i.checked_sub(steps_of_inputs) {
            None => (settings.input_bounds[i % sizes.inputs], None),
            Some(i) => {
                let output = settings.output_bounds[i % sizes.outputs];
                (output.bounds, output.softness.penalty())
            }
        };
        push(
            padded(f.row(i)),
            bounds.lower_value(),
            bounds.upper_value(),
            penalty,
        );
    }
    for j in 0..columns {
        for sign in [1.0, -1.0] {
            let mut row = vec![0.0; 2 * columns];
            (row[j], row[columns + j]) = (sign, -1.0);
            push(row, f64::NEG_INFINITY, 0.0, None);
        }
    }
    let matrix = Mat::from_fn(rows.len(), 2 * columns, |i, j| rows[i][j]);
    let problem = QpProblem::new(QpMatrix::Dense(hessian), QpMatrix::Dense(matrix), soft).unwrap();
    let mut solver = accurate(&problem);
    let vectors = QpVectors {
        linear: &linear,
        lower: &lower,
        upper: &upper,
    };
    solver.update(vectors).unwrap();
    let solution = solver.solve(&SolveBudget::generous());
    assert_eq!(solution.status, QpStatus::Solved);
    solution.primal[..columns].to_vec()
}

#[test]
fn the_one_norm_is_its_epigraph() {
    let study = Study::new(Sizes::SMALL, 0.1, &[70], 16);
    for (input_slack, output_slack) in formulations_support::SLACKS {
        let mut settings = settings(study.sizes);
        settings.regularisation = Regularisation::one_norm(0.5);
        (settings.input_slack, settings.output_slack) = (input_slack, output_slack);
        let mut other = settings.clone();
        other.regularisation = Regularisation::per_column(0.05);
        for seed in 0..2 {
            let situation = study.situation(seed);
            let mut program = SparseProgram::new(&study.predictor, &settings).unwrap();
            let sparse = formulations_support::solve(&mut program, &situation, accurate);
            assert!(
                sparse.is_usable(),
                "{:?} {:e}",
                sparse.status,
                sparse.residual
            );
            let g = epigraph(&study, &settings, &situation);
            let [_, u, y] = study.blocks();
            let expected = product(above(u, y).as_ref(), &g);
            let gap = largest_gap(&future(&sparse), &expected);
            assert!(
                gap < 1e-6,
                "{input_slack:?}, {output_slack:?}, {seed}: {gap:e}"
            );
            let recovered = deepc_core::program::PredictiveProgram::recover(&program).unwrap();
            let norm: f64 = g.iter().map(|g| g.abs()).sum();
            let charge = settings.regularisation.lambda_g * norm;
            assert!((recovered.parts.regularisation - charge).abs() < 1e-7 * charge);
            // Few columns are used, which no squared norm does.
            let used = recovered.g.iter().filter(|g| g.abs() > 1e-7).count();
            assert!(
                used < study.columns() / 2 + 1,
                "{used} of {}",
                study.columns()
            );
            let squared = study.sparse(&other, &situation);
            assert!(largest_gap(&future(&squared), &expected) > ANOTHER_PLAN);
        }
    }
}

#[test]
fn forms_refuse_what_they_cannot_have() {
    let study = Study::new(Sizes::SMALL, 0.1, &[70], 17);
    let build = |regularisation| {
        let settings = hard(study.sizes, regularisation);
        let condensed = CondensedProgram::new(&study.predictor, &settings);
        let sparse = SparseProgram::new(&study.predictor, &settings);
        (condensed.err(), sparse.err())
    };
    let check = |error: Option<ProgramError>, parts: [&str; 3]| {
        let message = error.unwrap().to_string();
        for part in parts {
            assert!(message.contains(part), "`{part}` is not in: {message}");
        }
    };
    let (condensed, sparse) = build(Regularisation::one_norm(0.1));
    check(
        condensed,
        ["the condensed form", "one_norm", "SparseProgram"],
    );
    assert!(sparse.is_none());
    for (regularisation, name) in [
        (Regularisation::spc(), "spc"),
        (Regularisation::gamma(0.1, None), "gamma"),
    ] {
        let (condensed, sparse) = build(regularisation);
        assert!(condensed.is_none());
        check(sparse, ["the sparse form", name, "CondensedProgram"]);
    }
}
