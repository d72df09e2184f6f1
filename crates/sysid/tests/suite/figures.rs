//! Every figure is a whole SVG that says what it shows; data that cannot be drawn are refused.
//!
//! `FIGURES_DIR=folder cargo test -p sysid --test figures` leaves the figures there to be looked at.

use crate::common;
use common::{Noise, dataset, inputs, plant, plant_with, push, run};
use deepc_core::faer::{Mat, c64};
use sysid::figures::{
    FrequencyCurve, FrequencyFigure, HorizonFit, OrderCurve, OutputCurve, OutputFigure,
    PoleZeroMap, SingularValues, StepCurve, StepFigure, fit_over_horizon, frequency_response,
    measured_and_computed, order_curve, pole_zero_map, residual_correlations, singular_values,
    step_responses,
};
use sysid::{InitialStateFor, StateSpace, SysidError, Validation, ValidationSettings};

fn look(name: &str, svg: &str, texts: &[&str]) {
    if let Ok(folder) = std::env::var("FIGURES_DIR") {
        std::fs::write(
            std::path::Path::new(&folder).join(format!("{name}.svg")),
            svg,
        )
        .unwrap();
    }
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
    for text in texts {
        assert!(svg.contains(text), "`{text}` is not in {name}");
    }
}

fn refused(result: Result<String, SysidError>, parts: &[&str]) {
    let text = result.unwrap_err().to_string();
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in `{text}`");
    }
}

fn models() -> (StateSpace, StateSpace) {
    let k = Mat::from_fn(4, 2, |i, j| {
        [[0.8, 0.1], [-0.3, 0.4], [0.5, 0.3], [0.1, 0.5]][i][j]
    });
    (plant_with(k), plant_with(Mat::zeros(4, 2)))
}

fn validations() -> (Validation, Validation) {
    let (truth, simple) = models();
    let mut noise = Noise::new(11);
    let mut data = dataset(&truth);
    for samples in [600, 400] {
        let u = inputs(&truth, samples, 0.8, &mut noise);
        let y = run(&truth, &[0.0; 4], &u, &noise.matrix(samples, 2));
        push(&mut data, &u, y);
    }
    let settings = ValidationSettings::default();
    let of = |model| Validation::of(model, &data, &settings).unwrap();
    println!("{}", of(&truth));
    (of(&truth), of(&simple))
}

fn horizon_fit(name: &str, validation: &Validation) -> HorizonFit {
    let output = &validation.outputs[0];
    HorizonFit {
        name: name.into(),
        fit_percent: output.prediction.iter().map(|s| s.fit_percent).collect(),
        simulation_percent: output.simulation.and_then(|s| s.fit_percent),
    }
}

#[test]
fn fits_over_the_horizon() {
    let (with_noise_part, without) = validations();
    let mut fits = [
        horizon_fit("with noise part", &with_noise_part),
        horizon_fit("output error <K = 0>", &without),
    ];
    let svg = fit_over_horizon("Prediction of level", &fits).unwrap();
    look(
        "fit_over_horizon",
        &svg,
        &[
            "fit / %",
            "steps ahead",
            "output error &lt;K = 0&gt;",
            "simulation",
        ],
    );
    fits[0].fit_percent[3] = None;
    fits[1].fit_percent[19] = Some(-5000.0);
    fits[1].simulation_percent = None;
    look(
        "fit_useless",
        &fit_over_horizon("Useless far ahead", &fits).unwrap(),
        &["Useless far ahead", "−"],
    );
    fits[0].fit_percent[0] = Some(f64::NAN);
    refused(fit_over_horizon("x", &fits), &["NaN", "`x`"]);
    refused(fit_over_horizon("none", &[]), &["nothing to draw"]);
}

#[test]
fn measured_and_simulated() {
    let (truth, simple) = models();
    let mut noise = Noise::new(12);
    let u = inputs(&truth, 500, 0.8, &mut noise);
    let y = run(&truth, &[0.0; 4], &u, &noise.matrix(500, 2));
    let x0 = simple
        .initial_state(u.as_ref(), y.as_ref(), InitialStateFor::Simulation)
        .unwrap();
    let simulated = simple.simulate(&x0, u.as_ref()).unwrap();
    let ahead = truth.predict(5, &x0, u.as_ref(), y.as_ref()).unwrap();
    let curve = |name: &str, values: &Mat<f64>| OutputCurve {
        name: name.into(),
        values: values.col_as_slice(0).to_vec(),
    };
    let mut figure = OutputFigure {
        title: "Level, record 1".into(),
        output: "level / cm".into(),
        sample_time_s: 0.1,
        measured: y.col_as_slice(0).to_vec(),
        computed: vec![
            curve("simulated, fit 71 %", &simulated),
            curve("5 steps ahead, fit 80 %", &ahead),
        ],
    };
    let texts = [
        "time / s",
        "level / cm",
        "measured",
        "5 steps ahead",
        "measured − computed",
    ];
    look(
        "measured_and_computed",
        &measured_and_computed(&figure).unwrap(),
        &texts,
    );
    figure.computed[1].values.pop();
    refused(
        measured_and_computed(&figure),
        &["499", "500", "5 steps ahead"],
    );
    // A day at 10 Hz is drawn with a bounded number of points.
    let long = OutputFigure {
        measured: (0..864_000).map(|k| (f64::from(k) * 1e-4).sin()).collect(),
        computed: vec![],
        ..figure
    };
    let svg = measured_and_computed(&long).unwrap();
    assert!(svg.len() < 200_000, "{}", svg.len());
    look("long_record", &svg, &["80000"]);
}

#[test]
fn correlations_of_residuals() {
    let (good, poor) = validations();
    for (name, validation) in [("residual_white", &good), ("residual_coloured", &poor)] {
        let output = &validation.outputs[1];
        let svg = residual_correlations(&output.name, &output.residual, 0.99).unwrap();
        let texts = [
            "Residual of flow",
            "99 % band",
            "residual with valve",
            "lag / samples",
        ];
        look(name, &svg, &texts);
    }
    let mut nothing = good.outputs[0].residual.clone();
    nothing.whiteness = None;
    nothing.inputs.clear();
    refused(
        residual_correlations("y", &nothing, 0.99),
        &["nothing to draw"],
    );
}

#[test]
fn poles_and_zeros() {
    let model = plant();
    let pairs = |values: Vec<c64>| values.iter().map(|z| (z.re, z.im)).collect::<Vec<_>>();
    let mut maps = vec![PoleZeroMap {
        name: "valve → level".into(),
        poles: pairs(model.poles().unwrap()),
        zeros: pairs(model.channel_zeros(0, 0).unwrap()),
    }];
    maps[0].zeros.push((-40.0, 0.0));
    let svg = pole_zero_map("Poles and zeros", &maps).unwrap();
    look(
        "pole_zero_map",
        &svg,
        &["real part", "imaginary part", "poles", " beyond 3)"],
    );
    // The longest line is the circle: as wide as it is high.
    let lines = svg
        .split("points=\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next());
    let circle = lines.max_by_key(|points| points.len()).unwrap();
    let places = circle
        .split_whitespace()
        .map(|place| place.split_once(',').unwrap());
    let (mut x, mut y): (Vec<i32>, Vec<i32>) = places
        .map(|(x, y)| (x.parse::<i32>().unwrap(), y.parse::<i32>().unwrap()))
        .unzip();
    x.sort_unstable();
    y.sort_unstable();
    let (wide, high) = (x[x.len() - 1] - x[0], y[y.len() - 1] - y[0]);
    assert!(wide > 2000 && (wide - high).abs() <= 4, "{wide} {high}");
    maps[0].zeros.clear();
    maps[0].poles = vec![
        (0.998, 0.012),
        (0.998, -0.012),
        (0.985, 0.05),
        (0.985, -0.05),
    ];
    maps.push(PoleZeroMap {
        name: "balanced".into(),
        poles: vec![(0.997, 0.013), (0.997, -0.013)],
        zeros: vec![],
    });
    look(
        "pole_zero_crowded",
        &pole_zero_map("Fast sampling", &maps).unwrap(),
        &["enlarged"],
    );
    maps[1].poles.push((f64::INFINITY, 0.0));
    refused(pole_zero_map("x", &maps), &["infinite"]);
}

#[test]
fn frequency_responses() {
    let model = plant();
    let frequencies_hz: Vec<f64> = (0..200)
        .map(|k| 0.01 * 500.0_f64.powf(f64::from(k) / 199.0))
        .collect();
    let all = model.frequency_response(&frequencies_hz).unwrap();
    let channel = |i: usize, j: usize| all.iter().map(|g| g[(i, j)]).collect::<Vec<c64>>();
    let deviations: Vec<f64> = frequencies_hz
        .iter()
        .map(|f| 0.02 + 0.1 * f / 5.0)
        .collect();
    let mut figure = FrequencyFigure {
        title: "valve → level".into(),
        magnitude_label: "magnitude / cm per V".into(),
        frequencies_hz,
        curves: vec![
            FrequencyCurve::new("identified", &channel(0, 0), &deviations),
            FrequencyCurve::new("another", &channel(0, 1), &[]),
        ],
    };
    let texts = [
        "frequency / Hz",
        "phase / °",
        "± 2 standard deviations",
        "per V",
    ];
    look(
        "frequency_response",
        &frequency_response(&figure).unwrap(),
        &texts,
    );
    let phase = &figure.curves[0].phase_deg;
    assert!(
        phase
            .windows(2)
            .all(|pair| (pair[1] - pair[0]).abs() < 180.0)
    );
    figure.curves[1].phase_deg.pop();
    refused(frequency_response(&figure), &["199", "200", "another"]);
    figure.curves.pop();
    figure.frequencies_hz[0] = 0.0;
    refused(frequency_response(&figure), &["0 Hz"]);
}

#[test]
fn how_the_order_was_chosen() {
    let mut values = SingularValues {
        title: "Singular values of the weighted projection".into(),
        values: (0..30)
            .map(|k| {
                if k < 4 {
                    0.9 - 0.2 * f64::from(k)
                } else {
                    0.05 * 0.97_f64.powi(k)
                }
            })
            .collect(),
        chosen: 4,
    };
    let texts = [
        "of the model (order 4)",
        "left out",
        "singular value",
        "number",
    ];
    look(
        "singular_values",
        &singular_values(&values).unwrap(),
        &texts,
    );
    for (k, value) in values.values.iter_mut().enumerate().skip(4) {
        *value = if k < 20 { 1e-15 } else { 0.0 };
    }
    look(
        "singular_values_exact",
        &singular_values(&values).unwrap(),
        &["1e−15"],
    );
    let mut curve = OrderCurve {
        title: "Order by validated prediction error".into(),
        error_label: "rms error / cm".into(),
        orders: (1..=10).collect(),
        errors: vec![0.9, 0.52, 0.4, 0.21, 0.211, 0.209, 0.215, 0.22, 0.224, 0.23],
        standard_errors: vec![0.02; 10],
        chosen: 4,
    };
    look(
        "order_curve",
        &order_curve(&curve).unwrap(),
        &["chosen: order 4", "± 1 standard error", "rms error / cm"],
    );
    curve.errors.pop();
    refused(order_curve(&curve), &["10 orders", "9 errors"]);
}

#[test]
fn responses_to_steps() {
    let (model, other) = models();
    let responses = model.step_response(80);
    let deviation =
        |k: usize| Mat::from_fn(2, 3, |_, j| 0.02 * (1.0 + k as f64).ln() * (j + 1) as f64);
    let mut figure = StepFigure {
        title: "Step responses".into(),
        sample_time_s: model.sample_time_s(),
        inputs: ["valve", "pump", "load"].map(Into::into).to_vec(),
        outputs: ["level", "flow"].map(Into::into).to_vec(),
        models: vec![
            StepCurve {
                name: "subspace".into(),
                standard_deviations: (0..responses.len()).map(deviation).collect(),
                responses,
            },
            StepCurve {
                name: "refined".into(),
                responses: other
                    .step_response(80)
                    .into_iter()
                    .map(|r| r * 1.1)
                    .collect(),
                standard_deviations: vec![],
            },
        ],
    };
    let texts = ["pump → flow", "load → level", "time / s", "refined"];
    look("step_responses", &step_responses(&figure).unwrap(), &texts);
    figure.models[1].responses[3] = Mat::zeros(2, 2);
    refused(step_responses(&figure), &["2×2", "2×3", "refined"]);
}

#[test]
fn awkward_names_and_ranges_are_drawn() {
    let long = "a name that goes on and on & on <for> longer than any legend has room for, surely";
    let fits: Vec<HorizonFit> = (0..9)
        .map(|index| HorizonFit {
            name: format!(
                "model {index} {}",
                if index == 4 { long } else { "of nine" }
            ),
            fit_percent: vec![Some(50.0 + f64::from(index)); 5],
            simulation_percent: None,
        })
        .collect();
    look(
        "many_models",
        &fit_over_horizon(long, &fits).unwrap(),
        &["&lt;for&gt;", "…"],
    );
    let figure = OutputFigure {
        title: "Tiny deviations about a large offset".into(),
        output: "pressure / Pa".into(),
        sample_time_s: 1e-6,
        measured: (0..50)
            .map(|k| 101_325.0 + 1e-3 * f64::from(k % 7))
            .collect(),
        computed: vec![OutputCurve {
            name: "constant".into(),
            values: vec![101_325.0; 50],
        }],
    };
    look(
        "large_offset",
        &measured_and_computed(&figure).unwrap(),
        &["pressure / Pa"],
    );
}
