//! The figures of a model, each with a caption that says how to read it.

use anyhow::{Context, Result};
use deepc_core::data::{Dataset, Record};
use faer::{Mat, c64};
use sysid::figures::{
    FrequencyCurve, FrequencyFigure, HorizonFit, OrderCurve, OutputCurve, OutputFigure,
    PoleZeroMap, SingularValues, StepCurve, StepFigure, fit_over_horizon, frequency_response,
    measured_and_computed, order_curve, pole_zero_map, residual_correlations, singular_values,
    step_responses,
};
use sysid::{EffectVerdict, InitialStateFor, OrderTrial, StateSpace};

use super::results::{JudgedOn, Results};
use super::words::percent;

/// Beginnings of the file names of all figures; numbers of channels (from 1) follow.
pub(super) const STEMS: [&str; 8] = [
    MEASURED, HORIZON, RESIDUALS, POLES, FREQUENCY, STEP, VALUES, ORDER,
];
const MEASURED: &str = "measured";
const HORIZON: &str = "horizon";
const RESIDUALS: &str = "residuals";
const POLES: &str = "poles";
const FREQUENCY: &str = "frequency";
const STEP: &str = "step";
const VALUES: &str = "singular-values";
const ORDER: &str = "order";

/// Frequencies of a frequency response.
const FREQUENCIES: usize = 200;
/// Samples of a step response.
const STEP_SAMPLES: (usize, usize) = (20, 2000);
/// Time constants of the slowest pole that it shows.
const TIME_CONSTANTS: f64 = 5.0;

/// Stands behind what must not be trusted.
const NOT_IDENTIFIED: &str = " (not identified)";

/// Under which heading of the page a figure stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Section {
    /// How good the model is.
    Fit,
    /// What it leaves unexplained.
    Residuals,
    /// What it is.
    Model,
    /// Why it is this one.
    Choice,
}

/// A drawn figure.
pub(super) struct Figure {
    pub section: Section,
    /// File name without extension.
    pub file: String,
    pub caption: String,
    pub svg: String,
}

/// Draws everything; `data` made the model, `judge` validated it.
pub(super) fn draw_all(results: &Results, data: &Dataset, judge: &Dataset) -> Result<Vec<Figure>> {
    let mut figures = measured(results, judge)?;
    figures.push(horizon(results)?);
    figures.extend(residuals(results)?);
    figures.extend(frequency(results, data)?);
    figures.push(step(results, data)?);
    figures.push(poles(results)?);
    figures.extend(order(results)?);
    figures.extend(values(results)?);
    Ok(figures)
}

fn longest(data: &Dataset) -> Result<(usize, &Record)> {
    let records = data.records().iter().enumerate();
    let longest = records.max_by_key(|(index, r)| (r.samples(), usize::MAX - index));
    longest.context("the data hold no record")
}

fn measured(results: &Results, judge: &Dataset) -> Result<Vec<Figure>> {
    let model = &results.identification.model;
    let (index, record) = longest(judge)?;
    let (decided, m) = (record.inputs(), record.inputs().ncols());
    let all = m + record.disturbances().ncols();
    let inputs = Mat::from_fn(record.samples(), all, |k, j| {
        let disturbance = j.checked_sub(m);
        disturbance.map_or_else(|| decided[(k, j)], |j| record.disturbances()[(k, j)])
    });
    let state = model.initial_state(
        inputs.as_ref(),
        record.outputs(),
        InitialStateFor::Simulation,
    )?;
    let simulated = model.simulate(&state, inputs.as_ref())?;
    let which = match (judge.records().len(), &results.report.validated_on) {
        (1, JudgedOn::SameRecording) => "the recording the model was made from".to_owned(),
        (1, JudgedOn::Others(_)) => "the recording for validation".to_owned(),
        (count, _) => format!("record {} of {count}, the longest", index + 1),
    };
    let mut figures = Vec::new();
    for (i, output) in results.report.validation.outputs.iter().enumerate() {
        let fit = output.simulation.and_then(|score| score.fit_percent);
        let svg = measured_and_computed(&OutputFigure {
            title: format!("{}: measured and simulated", output.name),
            output: output.name.clone(),
            sample_time_s: model.sample_time_s(),
            measured: record.outputs().col(i).iter().copied().collect(),
            computed: vec![OutputCurve {
                name: format!("simulated, fit {}", percent(fit)),
                values: simulated.col(i).iter().copied().collect(),
            }],
        })?;
        figures.push(Figure {
            section: Section::Fit,
            file: format!("{MEASURED}-{}", i + 1),
            caption: format!(
                "{} in {which}. The simulation sees the inputs only, from an initial state fitted to the \
                 record. An error without pattern is noise; one that follows the output is dynamics or \
                 nonlinearity that the model lacks.",
                output.name
            ),
            svg,
        });
    }
    Ok(figures)
}

fn horizon(results: &Results) -> Result<Figure> {
    let validation = &results.report.validation;
    let fits = validation.outputs.iter().map(|output| HorizonFit {
        name: output.name.clone(),
        fit_percent: output.prediction.iter().map(|s| s.fit_percent).collect(),
        simulation_percent: output.simulation.and_then(|s| s.fit_percent),
    });
    Ok(Figure {
        section: Section::Fit,
        file: HORIZON.to_owned(),
        caption: format!(
            "Fit of the prediction so many samples of {} s ahead. It starts high, because the last \
             measured output is known, and falls to the fit of the simulation (dashed), which knows no \
             output. A controller lives between the two: read it at the controller's horizon.",
            validation.sample_time_s
        ),
        svg: fit_over_horizon("Fit over the horizon", &fits.collect::<Vec<_>>())?,
    })
}

fn residuals(results: &Results) -> Result<Vec<Figure>> {
    let validation = &results.report.validation;
    let confidence = validation.settings.confidence;
    let mut figures = Vec::new();
    for (i, output) in validation.outputs.iter().enumerate() {
        // What is left is rounding.
        if output.residual.whiteness.is_none() {
            continue;
        }
        figures.push(Figure {
            section: Section::Residuals,
            file: format!("{RESIDUALS}-{}", i + 1),
            caption: format!(
                "Correlations of the one-step prediction error of {}. Of the true model, {} of the lags \
                 stay within the grey band; those outside are coloured. With itself: the noise model misses \
                 something. With an input at lags from 0: its dynamics are incomplete. At lags below 0: \
                 there was feedback while recording.",
                output.name,
                short_percent(confidence)
            ),
            svg: residual_correlations(&output.name, &output.residual, confidence)?,
        });
    }
    Ok(figures)
}

/// 0.99 as `99 %`.
fn short_percent(fraction: f64) -> String {
    format!("{} %", (fraction * 1e6).round() / 1e4)
}

fn poles(results: &Results) -> Result<Figure> {
    let model = &results.identification.model;
    let points = |values: Vec<c64>| values.into_iter().map(|z| (z.re, z.im)).collect();
    let map = PoleZeroMap {
        name: format!("order {}", model.order()),
        poles: points(model.poles()?),
        zeros: points(model.zeros()?),
    };
    Ok(Figure {
        section: Section::Model,
        file: POLES.to_owned(),
        caption: "Poles (crosses) and zeros from all inputs to all outputs (rings) in the z plane. Poles \
                  within the circle are stable; the nearer to it, the longer they ring, and the nearer to 1, \
                  the slower they are. A zero on a pole says that the order may be one too high."
            .to_owned(),
        svg: pole_zero_map("Poles and zeros", &[map])?,
    })
}

fn frequency(results: &Results, data: &Dataset) -> Result<Vec<Figure>> {
    let identification = &results.identification;
    let sample_time_s = identification.model.sample_time_s();
    let lowest = 1.0 / (longest(data)?.1.samples() as f64 * sample_time_s);
    let frequencies_hz = logarithmic_grid(lowest, 0.5 / sample_time_s);
    let responses = identification.frequency_response(&frequencies_hz)?;
    let (m, p) = channels(&identification.model);
    let mut figures = Vec::new();
    for effect in &identification.report.effects {
        let place = |names: &[String], name| names.iter().position(|n| n == name);
        let (Some(i), Some(j)) = (place(&p, &effect.output), place(&m, &effect.input)) else {
            continue;
        };
        // A logarithm of 0 shows nothing.
        if effect.verdict == EffectVerdict::HeldAtZero {
            continue;
        }
        let values: Vec<c64> = responses.iter().map(|r| r.response[(i, j)]).collect();
        let errors: Vec<f64> = responses.iter().map(|r| r.standard_error[(i, j)]).collect();
        let known = errors.iter().all(|error| error.is_finite());
        let svg = frequency_response(&FrequencyFigure {
            title: format!(
                "{} → {}{}",
                effect.input,
                effect.output,
                match effect.verdict {
                    EffectVerdict::NotIdentified => NOT_IDENTIFIED,
                    _ => "",
                }
            ),
            magnitude_label: format!("|{}| / |{}|", effect.output, effect.input),
            frequencies_hz: frequencies_hz.clone(),
            curves: vec![FrequencyCurve::new(
                "model",
                &values,
                if known { &errors } else { &[] },
            )],
        })?;
        let meaning = match effect.verdict {
            EffectVerdict::NotIdentified => {
                "The band is wide at every frequency: even the sign of the effect may be chance."
            }
            EffectVerdict::SteadyStateNotIdentified => {
                "The band is wide at low frequencies: the steady-state gain may have either sign."
            }
            _ => "Where the band is wide, the recording says little: shake the input there.",
        };
        figures.push(Figure {
            section: Section::Model,
            file: format!("{FREQUENCY}-{}-{}", i + 1, j + 1),
            caption: format!(
                "Frequency response from {} to {}, from one period per record to half the sampling rate. \
                 The band is ± 2 standard errors. {meaning}",
                effect.input, effect.output
            ),
            svg,
        });
    }
    Ok(figures)
}

/// Ascending from about `lowest` to exactly `highest`.
fn logarithmic_grid(lowest: f64, highest: f64) -> Vec<f64> {
    let last = FREQUENCIES - 1;
    let place = |k: usize| (k as f64 / last as f64 - 1.0) * (highest / lowest).ln();
    (0..=last).map(|k| highest * place(k).exp()).collect()
}

/// Names of the inputs with the measured disturbances, and of the outputs.
pub(super) fn channels(model: &StateSpace) -> (Vec<String>, Vec<String>) {
    let inputs = model.inputs().iter().chain(model.disturbances());
    (
        inputs.map(|channel| channel.name.clone()).collect(),
        model.outputs().iter().map(|c| c.name.clone()).collect(),
    )
}

fn step(results: &Results, data: &Dataset) -> Result<Figure> {
    let model = &results.identification.model;
    let (mut inputs, outputs) = channels(model);
    let unidentified = results.identification.report.unidentified_inputs();
    for input in &mut inputs {
        if unidentified.contains(&input.as_str()) {
            input.push_str(NOT_IDENTIFIED);
        }
    }
    let constants = results.report.poles.iter().map(|pole| pole.time_constant_s);
    let slowest_s = constants.fold(0.0, f64::max);
    let (fewest, most) = STEP_SAMPLES;
    let most = most.min(longest(data)?.1.samples()).max(fewest);
    let settling = TIME_CONSTANTS * slowest_s / model.sample_time_s();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to sizes of a figure"
    )]
    let last = settling.clamp(fewest as f64, most as f64) as usize;
    let svg = step_responses(&StepFigure {
        title: "Step responses".to_owned(),
        sample_time_s: model.sample_time_s(),
        inputs,
        outputs,
        models: vec![StepCurve {
            name: "model".to_owned(),
            responses: model.step_response(last),
            standard_deviations: Vec::new(),
        }],
    })?;
    Ok(Figure {
        section: Section::Model,
        file: STEP.to_owned(),
        caption:
            "What each output does when one input rises by one unit and stays. A curve that has \
                  settled is at the steady-state gain of the table above, and as uncertain."
                .to_owned(),
        svg,
    })
}

/// Nothing to draw where the order was given.
fn order(results: &Results) -> Result<Option<Figure>> {
    let report = &results.identification.report;
    // An order whose model ran away has no error to draw.
    let trials = || {
        let trials = report.trials.iter();
        trials.filter(|trial| trial.held_out_score.is_finite())
    };
    if trials().count() < 2 {
        return Ok(None);
    }
    Ok(Some(Figure {
        section: Section::Choice,
        file: ORDER.to_owned(),
        caption: "Error on held-out parts of the recording for models of every order made from the other \
                  parts: 100 % is as bad as the mean. The chosen order is one that held-out samples cannot \
                  tell from the best; among those the information criterion decides, so that a higher \
                  order does not learn the noise."
            .to_owned(),
        svg: order_curve(&OrderCurve {
            title: "Held-out error over the order".to_owned(),
            error_label: "held-out error / % of the spread".to_owned(),
            orders: trials().map(|t| t.order).collect(),
            errors: trials().map(held_out_error_percent).collect(),
            standard_errors: Vec::new(),
            chosen: report.order,
        })?,
    }))
}

/// Root mean square error over the output's spread, geometric mean over the outputs, in %.
pub(super) fn held_out_error_percent(trial: &OrderTrial) -> f64 {
    100.0 * (0.5 * trial.held_out_score).exp()
}

fn values(results: &Results) -> Result<Option<Figure>> {
    let report = &results.identification.report;
    if report.singular_values.is_empty() {
        return Ok(None);
    }
    Ok(Some(Figure {
        section: Section::Choice,
        file: VALUES.to_owned(),
        caption: format!(
            "Singular values of the subspace estimate ({}, horizon {}) that the model started from. Those \
             of the model stand apart from those of the noise if the noise is small; a gap elsewhere is \
             a hint, the held-out error decides.",
            report.weighting, report.horizon
        ),
        svg: singular_values(&SingularValues {
            title: "Singular values".to_owned(),
            values: report.singular_values.clone(),
            chosen: report.order,
        })?,
    }))
}

#[cfg(test)]
mod tests {
    use super::{FREQUENCIES, logarithmic_grid};

    #[test]
    fn the_grid_ends_exactly_at_half_the_sampling_rate() {
        for sample_time_s in [0.01, 0.08, 1.0 / 3.0, 3600.0] {
            let highest = 0.5 / sample_time_s;
            let grid = logarithmic_grid(highest / 500.0, highest);
            assert_eq!(grid.len(), FREQUENCIES);
            assert!(grid.is_sorted() && grid.iter().all(|f| *f <= highest));
            assert!((grid[0] * 500.0 / highest - 1.0).abs() < 1e-12);
            assert!((grid[FREQUENCIES - 1] - highest).abs() <= 0.0);
        }
    }
}
