//! Parity with SLICOT on recordings, and exactness where the truth is known.

use crate::subspace_support;
use deepc_core::faer::Mat;
use deepc_core::faer::linalg::solvers::Solve;
use serde_json::Value;
use subspace_support::{
    SETS, dataset, difference, distance, innovation_markov, markov, matrix, number, numbers, poles,
    reference, rows, system,
};
use sysid::{GainFallback, Offsets, SubspaceModel, SubspaceSettings, subspace_model};

/// The reference results of `slicot_n4sid_Q` were computed from the identification half.
fn parity(reference: &Value, name: &str) -> SubspaceModel {
    let set = &reference["datasets"][name];
    let rows = rows(name);
    let half = &rows[..number(&set["n_id"])];
    let data = dataset(set["Ts"].as_f64().unwrap(), number(&set["m"]), &[half]);
    let mut settings = SubspaceSettings::slicot(number(&set["s"]), number(&set["n"]));
    settings.offsets = Offsets::Given {
        inputs: numbers(&set["u_mean"]),
        outputs: numbers(&set["y_mean"]),
    };
    subspace_model(&data, &settings).unwrap()
}

#[test]
fn markov_parameters_and_poles_are_those_of_slicot() {
    let reference = reference();
    for name in SETS {
        let theirs = &reference["results"][name]["slicot_n4sid_Q"];
        let ours = parity(&reference, name);
        let model = ours.model.matrices();
        let expected: Vec<_> = (theirs["markov_0_20"].as_array().unwrap().iter())
            .map(matrix)
            .collect();
        let apart = difference(&markov(model, 21), &expected);
        assert!(
            apart < 1e-10,
            "{name}: Markov parameters differ by {apart:e}"
        );
        let expected: Vec<_> = (theirs["poles"].as_array().unwrap().iter())
            .map(|z| (z[0].as_f64().unwrap(), z[1].as_f64().unwrap()))
            .collect();
        let apart = distance(&poles(model.a.as_ref()), &expected);
        assert!(apart < 1e-10, "{name}: poles differ by {apart:e}");
    }
}

#[test]
fn noise_covariances_and_gain_are_those_of_slicot() {
    let reference = reference();
    for name in SETS {
        let theirs = &reference["results"][name]["slicot_n4sid_Q"];
        let ours = parity(&reference, name);
        if name.starts_with("syn4_clean") {
            assert_eq!(ours.gain_fallback, Some(GainFallback::NoNoise), "{name}");
            assert!(ours.model.matrices().k.norm_max() < f64::MIN_POSITIVE);
            continue;
        }
        assert_eq!(ours.gain_fallback, None, "{name}");
        let expected = innovation_markov(&system(theirs), 21);
        let apart = difference(&innovation_markov(ours.model.matrices(), 21), &expected);
        assert!(apart < 1e-8, "{name}: gain differs by {apart:e}");
        let radius = theirs["rho_AKC"].as_f64().unwrap();
        assert!((ours.predictor_radius - radius).abs() < 1e-8, "{name}");
    }
}

#[test]
fn without_noise_the_truth_comes_back() {
    let reference = reference();
    for name in ["syn4_clean", "syn4_clean_x0"] {
        let truth = system(&reference["truth"][name]);
        let ours = parity(&reference, name);
        let model = ours.model.matrices();
        let apart = distance(&poles(model.a.as_ref()), &poles(truth.a.as_ref()));
        assert!(apart < 1e-12, "{name}: poles differ by {apart:e}");
        let apart = difference(&markov(model, 21), &markov(&truth, 21));
        assert!(
            apart < 1e-10,
            "{name}: Markov parameters differ by {apart:e}"
        );
        let gap = ours.singular_values[4] / ours.singular_values[3];
        assert!(gap < 1e-6, "{name}: gap after the fourth {gap:e}");
    }
}

/// Means of a record with a transient are not its operating point; a row of ones is exact.
#[test]
fn offsets_that_are_not_known_cost_no_exactness() {
    let reference = reference();
    for name in ["syn4_clean", "syn4_clean_x0"] {
        let truth = system(&reference["truth"][name]);
        let rows = rows(name);
        let data = dataset(0.01, 2, &[&rows[..3000]]);
        let mut settings = SubspaceSettings::slicot(20, 4);
        settings.offsets = Offsets::Free;
        let ours = subspace_model(&data, &settings).unwrap();
        let model = ours.model.matrices();
        let apart = distance(&poles(model.a.as_ref()), &poles(truth.a.as_ref()));
        assert!(apart < 1e-11, "{name}: poles differ by {apart:e}");
        let apart = difference(&markov(model, 21), &markov(&truth, 21));
        assert!(
            apart < 1e-10,
            "{name}: Markov parameters differ by {apart:e}"
        );
        // y₀ = G(1)(u₀ − (0, 80)): the offsets lie on the steady-state line of the truth.
        let unit = Mat::<f64>::identity(4, 4);
        let gain = &truth.c * (unit - &truth.a).partial_piv_lu().solve(&truth.b) + &truth.d;
        let u: Vec<_> = ours.model.inputs().iter().map(|c| c.offset).collect();
        let expected = gain[(0, 0)] * u[0] + gain[(0, 1)] * (u[1] - 80.0);
        let found = ours.model.outputs()[0].offset;
        assert!(
            (found - expected).abs() < 1e-9,
            "{name}: {found} for {expected}"
        );
    }
}
