//! The automatic model on the reference sets, against SLICOT's. `docs/identification.md` has all
//! numbers, also of sets where a threshold would say little.

mod subspace_support;

use deepc_core::data::Dataset;
use subspace_support::{SETS, dataset, number, numbers, reference, rows};
use sysid::{StateSpace, Validation, ValidationSettings, identify};

/// Points of fit that the automatic model may stay below the better of SLICOT's two.
const ALLOWANCE: f64 = 0.5;

/// Sets on which it stays below, and by how much at most. On `exchanger` (nonlinear, and its second half
/// runs elsewhere than the first) held-out parts of the first half prefer order 2 to SLICOT's 3, and the
/// innovation form to the simulation, clearly; on the second half that costs 1.6 points.
const SHORT_OF_IT: [(&str, f64); 1] = [("exchanger", 1.8)];

/// Fits of the simulated outputs, from the initial state that suits best.
fn fits(model: &StateSpace, data: &Dataset) -> Vec<f64> {
    let settings = ValidationSettings::for_horizon(10);
    let validation = Validation::of(model, data, &settings).unwrap();
    let outputs = validation.outputs.iter();
    let fits = outputs.map(|output| output.simulation.unwrap().fit_percent.unwrap());
    fits.collect()
}

#[test]
fn the_automatic_model_is_at_least_as_good_as_slicots() {
    let reference = reference();
    for name in SETS {
        let set = &reference["datasets"][name];
        let rows = rows(name);
        let (first, rest) = rows.split_at(number(&set["n_id"]));
        let sample_time_s = set["Ts"].as_f64().unwrap();
        let of = |rows| dataset(sample_time_s, number(&set["m"]), &[rows]);
        let found = identify(&of(first)).unwrap();
        assert!(found.model.is_stable().unwrap(), "{name}");
        let ours = fits(&found.model, &of(&rest[..number(&set["n_val"])]));
        let theirs = ["slicot_n4sid_Q", "slicot_n4sid+simBD_Q"]
            .map(|tool| numbers(&reference["results"][name][tool]["fit_sim_val"]));
        let exception = SHORT_OF_IT.iter().find(|(set, _)| *set == name);
        let allowance = exception.map_or(ALLOWANCE, |(_, points)| *points);
        for (output, fit) in ours.iter().enumerate() {
            let best = theirs[0][output].max(theirs[1][output]);
            assert!(
                *fit >= best - allowance,
                "{name}, output {output}: {fit:.2} against {best:.2}\n{}",
                found.report
            );
        }
    }
}

#[test]
fn records_are_not_joined() {
    let rows = rows("syn4_multirecord");
    let of_record = |number: f64| -> Vec<Vec<f64>> {
        let rows = rows.iter().filter(|row| (row[0] - number).abs() < 0.5);
        rows.map(|row| row[1..].to_vec()).collect()
    };
    let records: Vec<_> = (1..=5).map(|number| of_record(f64::from(number))).collect();
    let (last, training) = records.split_last().unwrap();
    let training: Vec<&[Vec<f64>]> = training.iter().map(Vec::as_slice).collect();
    let found = identify(&dataset(0.01, 2, &training)).unwrap();
    let fit = fits(&found.model, &dataset(0.01, 2, &[last]))[0];
    assert!(fit >= 89.5, "{fit:.2}\n{}", found.report);
}
