//! Outputs predicted from a past and given inputs.

use crate::common;
use common::Lti;
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons, stack};
use deepc_core::predictor::Predictor;
use deepc_core::program::{OutputPredictor, ProgramError, Regularisation, Slack};
use faer::prelude::Solve;
use faer::{Col, Mat};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const HORIZONS: Horizons = Horizons { past: 5, future: 8 };

fn recording(samples: usize, noise: f64) -> Dataset {
    let system = Lti::random(4, 2, 3, 0.9, 42);
    common::dataset(vec![common::record(&system, samples, noise, 7)])
}

fn predictor(data: &Dataset) -> Predictor {
    let hankel = HankelMatrix::build(data, HORIZONS).unwrap();
    Predictor::exact(&hankel.assume_persistently_exciting()).unwrap()
}

#[test]
fn the_future_of_a_linear_plant_is_predicted_exactly() {
    let system = Lti::random(4, 2, 3, 0.9, 42);
    let predictor = predictor(&recording(200, 0.0));
    let slacks = [
        (Slack::Hard, Slack::Hard),
        (Slack::Penalty(1e6), Slack::Penalty(1e6)),
    ];
    for (input_slack, output_slack) in slacks {
        let weight = Regularisation::per_column(1e-6);
        let mut outputs =
            OutputPredictor::new(&predictor, weight, input_slack, output_slack).unwrap();
        let inputs = common::gaussian(13, 2, &mut common::rng(1));
        let measured = system.simulate(&mut Col::from_fn(4, |i| i as f64 - 1.0), &inputs);
        let predicted = outputs
            .predict(
                inputs.subrows(0, 5),
                measured.subrows(0, 5),
                inputs.subrows(5, 8),
                None,
            )
            .unwrap();
        let error = common::largest_difference(&predicted, &measured.subrows(5, 8).to_owned());
        assert!(error < 1e-8, "{error:e}");
    }
}

/// The optimality conditions of the problem as it is written, solved for g at once.
#[test]
fn the_prediction_is_the_optimum_of_the_problem_as_written() {
    let data = recording(120, 0.3);
    let hankel = HankelMatrix::build(&data, HORIZONS).unwrap();
    let (up, yp) = (
        hankel.blocks().past_inputs.to_owned(),
        hankel.blocks().past_outputs.to_owned(),
    );
    let (uf, yf) = (
        hankel.blocks().future_inputs.to_owned(),
        hankel.blocks().future_outputs.to_owned(),
    );
    let (lambda_g, lambda_u, lambda_y) = (0.7, 20.0, 3.0);
    let columns = hankel.columns();
    let mut rng = common::rng(11);
    let past_inputs = common::gaussian(5, 2, &mut rng);
    let past_outputs = common::gaussian(5, 3, &mut rng);
    let future_inputs = common::gaussian(8, 2, &mut rng);
    let vector = |series: &Mat<f64>| {
        let stacked = stack(series.as_ref());
        Col::from_fn(stacked.len(), |i| stacked[i])
    };
    // [λ_g I + λ_u UpᵀUp + λ_y YpᵀYp, Ufᵀ; Uf, 0] [g; ν] = [λ_u Upᵀu + λ_y Ypᵀy; u_f]
    let hessian = faer::Scale(lambda_u) * (up.transpose() * &up)
        + faer::Scale(lambda_y) * (yp.transpose() * &yp);
    let linear = faer::Scale(lambda_u) * (up.transpose() * vector(&past_inputs))
        + faer::Scale(lambda_y) * (yp.transpose() * vector(&past_outputs));
    let wanted = vector(&future_inputs);
    let size = columns + uf.nrows();
    let kkt = Mat::from_fn(size, size, |i, j| {
        match (i.checked_sub(columns), j.checked_sub(columns)) {
            (None, None) => hessian[(i, j)] + if i == j { lambda_g } else { 0.0 },
            (Some(i), None) => uf[(i, j)],
            (None, Some(j)) => uf[(j, i)],
            (Some(_), Some(_)) => 0.0,
        }
    });
    let right = Col::from_fn(size, |i| match i.checked_sub(columns) {
        None => linear[i],
        Some(i) => wanted[i],
    });
    let solution = kkt.partial_piv_lu().solve(&right);
    let expected = &yf * solution.subrows(0, columns);

    let full = Predictor::full(&hankel.clone().assume_persistently_exciting());
    for predictor in [full, predictor(&data)] {
        let mut outputs = OutputPredictor::new(
            &predictor,
            Regularisation::raw(lambda_g),
            Slack::Penalty(lambda_u),
            Slack::Penalty(lambda_y),
        )
        .unwrap();
        let predicted = outputs
            .predict(
                past_inputs.as_ref(),
                past_outputs.as_ref(),
                future_inputs.as_ref(),
                None,
            )
            .unwrap();
        let error = (vector(&predicted) - &expected).norm_max();
        assert!(error < 1e-10 * expected.norm_max(), "{error:e}");
    }
}

#[test]
fn inputs_that_do_not_excite_are_refused_by_name() {
    let system = Lti::random(2, 2, 2, 0.8, 6);
    let (mut u, _) = common::record(&system, 200, 0.0, 2);
    u.col_mut(1).fill(0.5);
    let y = system.simulate(&mut Col::zeros(2), &u);
    let predictor = predictor(&common::dataset(vec![(u, y)]));
    let weight = Regularisation::per_column(1.0);
    let error = OutputPredictor::new(&predictor, weight, Slack::Hard, Slack::Hard).unwrap_err();
    assert!(
        matches!(error, ProgramError::InputsNotExciting { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("input `u2`"), "{error}");
}

#[test]
fn bad_weights_and_shapes_are_refused() {
    let predictor = predictor(&recording(200, 0.1));
    let new = |lambda, slack| {
        OutputPredictor::new(
            &predictor,
            Regularisation::per_column(lambda),
            slack,
            Slack::Hard,
        )
    };
    let message = new(-1.0, Slack::Hard).unwrap_err().to_string();
    assert!(
        message.contains("`regularisation.lambda_g` is -1"),
        "{message}"
    );
    let message = new(1.0, Slack::Penalty(0.0)).unwrap_err().to_string();
    assert!(message.contains("`input_slack` is 0"), "{message}");
    let mut good = new(1.0, Slack::Hard).unwrap();
    let (u, y, f) = (Mat::zeros(5, 2), Mat::zeros(4, 3), Mat::zeros(8, 2));
    let message = good
        .predict(u.as_ref(), y.as_ref(), f.as_ref(), None)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("the past of the outputs is 4×3, expected 5×3"),
        "{message}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 64,
        rng_seed: RngSeed::Fixed(1999),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Data without noise and a past as long as the lag or longer: what follows is certain.
    #[test]
    fn any_linear_plant_is_predicted(
        n in 1..=5_usize,
        m in 2..=3_usize,
        p in 2..=3_usize,
        longer in 0..=3_usize,
        future in 1..=9_usize,
        hard in any::<(bool, bool)>(),
        seed in any::<u64>(),
    ) {
        let system = Lti::random(n, m, p, 0.9, seed);
        let horizons = Horizons::new(n + longer, future);
        let window = horizons.window();
        let samples = 2 * (m + 1) * (window + n);
        let data = common::dataset(vec![common::record(&system, samples, 0.0, seed)]);
        let hankel = HankelMatrix::build(&data, horizons).unwrap();
        let predictor = Predictor::exact(&hankel.require_persistently_exciting(n).unwrap()).unwrap();
        let slack = |hard| if hard { Slack::Hard } else { Slack::Penalty(1e6) };
        let weight = Regularisation::per_column(1e-8);
        let mut outputs =
            OutputPredictor::new(&predictor, weight, slack(hard.0), slack(hard.1)).unwrap();
        let (inputs, measured) = common::record(&system, window, 0.0, seed ^ 0x9e);
        let past = horizons.past;
        let mut predicted = Mat::zeros(future, p);
        outputs
            .predict_into(
                inputs.subrows(0, past),
                measured.subrows(0, past),
                inputs.subrows(past, future),
                None,
                predicted.as_mut(),
            )
            .unwrap();
        let error = common::largest_difference(&predicted, &measured.subrows(past, future).to_owned());
        prop_assert!(error < 1e-6 * measured.norm_max(), "{error:e}");
    }
}
