//! Fits and whiteness of models that other tools identified, as another program computed them.

use crate::common;
use common::channel;
use deepc_core::data::Dataset;
use deepc_core::faer::Mat;
use serde_json::Value;
use sysid::{Channel, StateSpace, SystemMatrices, Validation, ValidationSettings};

const ROWS: &str = include_str!("../reference/validation/cd_player_arm_second_half.csv");
const RESULTS: &str = include_str!("../reference/validation/cd_player_arm.json");

fn matrix(value: &Value) -> Mat<f64> {
    let rows = value.as_array().unwrap();
    let columns = rows[0].as_array().unwrap().len();
    Mat::from_fn(rows.len(), columns, |i, j| value[i][j].as_f64().unwrap())
}

fn channels(kind: &str, means: &Value) -> Vec<Channel> {
    let means = means.as_array().unwrap().iter().enumerate();
    let channels =
        means.map(|(i, mean)| channel(&format!("{kind}{i}"), mean.as_f64().unwrap(), 1.0));
    channels.collect()
}

fn data() -> Dataset {
    let mut reader = csv::Reader::from_reader(ROWS.as_bytes());
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        row.iter()
            .map(|value| value.parse::<f64>().unwrap())
            .collect::<Vec<_>>()
    });
    let rows: Vec<_> = rows.collect();
    let mut data = Dataset::new(1.0, ["u0", "u1"], ["y0", "y1"]).unwrap();
    let part = |first: usize| Mat::from_fn(rows.len(), 2, |k, i| rows[k][first + i]);
    data.push_record(part(0), part(2)).unwrap();
    data
}

#[test]
fn scores_agree_with_another_program_to_rounding() {
    let (results, data): (Value, _) = (serde_json::from_str(RESULTS).unwrap(), data());
    for (name, theirs) in results["models"].as_object().unwrap() {
        let system = SystemMatrices {
            a: matrix(&theirs["A"]),
            b: matrix(&theirs["B"]),
            c: matrix(&theirs["C"]),
            d: matrix(&theirs["D"]),
            k: matrix(&theirs["K"]),
        };
        let (inputs, outputs) = (
            channels("u", &results["u_mean"]),
            channels("y", &results["y_mean"]),
        );
        let model = StateSpace::new(1.0, inputs, vec![], outputs, system).unwrap();
        let validation = Validation::of(&model, &data, &ValidationSettings::default()).unwrap();
        for (i, output) in validation.outputs.iter().enumerate() {
            let close = |what: &str, ours: Option<f64>, theirs: &Value| {
                let difference = (ours.unwrap() - theirs.as_f64().unwrap()).abs();
                assert!(difference < 1e-10, "{name} {what} of y{i}: {difference:e}");
            };
            let simulation = output.simulation.unwrap();
            if name == "nfoursid" {
                // Their initial state of this unstable model explains nothing.
                assert!(validation.spectral_radius > 1.0);
                let fit = simulation.fit_percent.unwrap();
                assert!(fit > 40.0 && theirs["fit_sim_val"][i].as_f64().unwrap() < -1e6);
            } else {
                close("fit", simulation.fit_percent, &theirs["fit_sim_val"][i]);
                close("VAF", simulation.vaf_percent, &theirs["vaf_sim_val"][i]);
                let whiteness = output.residual.whiteness.as_ref().unwrap();
                let share = whiteness.outside as f64 / 25.0;
                close(
                    "outside",
                    Some(share),
                    &theirs["whiteness_frac_lags_outside_99pct"][i],
                );
            }
            for step in [1, 5, 10, 20] {
                let ours = output.prediction[step - 1].fit_percent;
                let theirs = &theirs["fit_kstep_val"][step.to_string()][i];
                close(&format!("{step} steps"), ours, theirs);
            }
        }
    }
}
