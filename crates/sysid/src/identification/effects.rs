//! What the data say of every input's effect.

use deepc_core::faer::Mat;

use super::candidate::Search;
use super::offsets::variances;
use super::report::{
    EffectVerdict, IdentificationReport, InputEffect, UNIDENTIFIED_RATIO,
    UNIDENTIFIED_RESPONSE_RATIO,
};
use super::settings::{IdentificationSettings, OffsetChoice};
use crate::state_space::{StateSpace, SystemMatrices};
use crate::uncertainty::Uncertainty;
use crate::working::{WorkingData, WorkingRecord};

/// Frequencies at which a response is judged.
const FREQUENCIES: usize = 40;

/// Gains with their standard errors, shares of the outputs, and verdicts.
pub(super) fn effects(
    scaled: &WorkingData,
    model: &StateSpace,
    matrices: &SystemMatrices,
    uncertainty: &Uncertainty,
    search: &Search<'_>,
) -> Vec<InputEffect> {
    let estimate = uncertainty.steady_state_gain();
    let t_values = uncertainty.feedthrough_t();
    let direct = uncertainty.free_feedthrough();
    let shares = shares(scaled, matrices, search.settings.offsets);
    let longest = scaled.records.iter().map(WorkingRecord::samples).max();
    let grid = frequencies(longest.unwrap_or(2));
    let responses = uncertainty.frequency_response_error(&grid);
    let hz = 0.5 / (std::f64::consts::PI * scaled.sample_time_s);
    let channels = model.inputs().iter().chain(model.disturbances());
    let mut effects = Vec::new();
    for (j, input) in channels.enumerate() {
        for (i, output) in model.outputs().iter().enumerate() {
            let unit = output.scale / input.scale;
            let gain = estimate.value[(i, j)] * unit;
            let error = estimate.standard_error[(i, j)] * unit;
            let known_to = responses.iter().map(|response| {
                let value = response.response[(i, j)];
                let relative = response.complex[(i, j)] / value.re.hypot(value.im);
                (response.frequency * hz, relative)
            });
            let best = known_to.filter(|(_, relative)| relative.is_finite());
            let best = best.min_by(|a, b| a.1.total_cmp(&b.1));
            let (best_frequency_hz, best_relative_error) = best.unwrap_or((0.0, f64::INFINITY));
            let verdict = if !search.structure.dynamics[j] {
                EffectVerdict::HeldAtZero
            } else if error <= UNIDENTIFIED_RATIO * gain.abs() {
                EffectVerdict::Identified
            } else if best_relative_error <= UNIDENTIFIED_RESPONSE_RATIO {
                EffectVerdict::SteadyStateNotIdentified
            } else {
                EffectVerdict::NotIdentified
            };
            effects.push(InputEffect {
                input: input.name.clone(),
                output: output.name.clone(),
                gain,
                standard_error: error,
                best_frequency_hz,
                best_relative_error,
                share: shares[(i, j)],
                feedthrough: search.structure.feedthrough[j],
                feedthrough_value: direct[(i, j)] * unit,
                feedthrough_t: t_values[(i, j)],
                verdict,
            });
        }
    }
    effects
}

/// Frequencies at which the responses are judged, in radians per sample: from one period per record to
/// half the sampling rate.
fn frequencies(samples: usize) -> Vec<f64> {
    let (least, most) = (
        2.0 * std::f64::consts::PI / samples as f64,
        std::f64::consts::PI,
    );
    let ratio = most / least;
    let at = |k: usize| least * ratio.powf(k as f64 / (FREQUENCIES - 1) as f64);
    (0..FREQUENCIES).map(at).collect()
}

/// Variance of every input's simulated effect over that of the output, p×M. They add up to 1 only if
/// the inputs are uncorrelated and there is no noise.
fn shares(scaled: &WorkingData, matrices: &SystemMatrices, offsets: OffsetChoice) -> Mat<f64> {
    let (m, p) = (scaled.inputs.len(), scaled.outputs.len());
    let initial = vec![0.0; matrices.order()];
    let mut shares = Mat::zeros(p, m);
    let of_outputs = variances(scaled, offsets);
    let samples = scaled.samples() as f64;
    for j in 0..m {
        let mut sums = vec![[0.0; 2]; p];
        for record in &scaled.records {
            let mut alone = Mat::zeros(record.samples(), m + 1);
            alone.col_mut(j).copy_from(record.inputs.col(j));
            let response = matrices.simulate(&initial, alone.as_ref());
            for (i, sums) in sums.iter_mut().enumerate() {
                for &value in response.col(i).iter() {
                    sums[0] += value;
                    sums[1] += value * value;
                }
            }
        }
        for (i, [sum, squares]) in sums.into_iter().enumerate() {
            let mean = sum / samples;
            shares[(i, j)] = (squares / samples - mean * mean).max(0.0) / of_outputs[i];
        }
    }
    shares
}

/// What a user of the model has to know.
pub(super) fn warnings(
    report: &IdentificationReport,
    settings: &IdentificationSettings,
    radius: f64,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for name in report.unidentified_inputs() {
        let effects = report.effects.iter().filter(|e| e.input == name);
        let worst: Vec<_> = effects
            .map(|e| {
                format!(
                    "{} (gain {:.2e}, standard error {:.2e})",
                    e.output, e.gain, e.standard_error
                )
            })
            .collect();
        warnings.push(format!(
            "the data do not identify the effect of `{name}` on {}: even its sign may be chance. Shake \
             `{name}` more, or hold its effect at zero (`without_effect`) or its input at its reference \
             by a high weight before a controller trusts it",
            worst.join(", ")
        ));
    }
    let unidentified = report.unidentified_inputs();
    for effect in &report.effects {
        let known = match effect.verdict {
            EffectVerdict::Identified | EffectVerdict::HeldAtZero => continue,
            EffectVerdict::NotIdentified if unidentified.contains(&effect.input.as_str()) => {
                continue;
            }
            EffectVerdict::NotIdentified => "not at any frequency".to_owned(),
            EffectVerdict::SteadyStateNotIdentified => format!(
                "but known to {:.0} % at {:.3} Hz",
                100.0 * effect.best_relative_error,
                effect.best_frequency_hz
            ),
        };
        warnings.push(format!(
            "the steady-state gain from `{}` to {} may have either sign ({:.2e}, standard error {:.2e}; {known}): \
             a controller with a long horizon trusts it",
            effect.input, effect.output, effect.gain, effect.standard_error
        ));
    }
    if let Some(radius) = report.unstable_radius {
        warnings.push(format!(
            "the subspace estimate had spectral radius {radius:.5}; its poles were moved inside {}",
            settings.stability_radius
        ));
    }
    if radius > 1.0 - 1e-4 {
        warnings.push(format!(
            "the slowest pole has radius {radius:.6}: the recording shows an integration or a drift, and \
             steady-state gains mean little"
        ));
    }
    if settings.order.is_none() && report.order == settings.max_order {
        warnings.push(format!(
            "the best order is the largest one tried, {}; raise `max_order` to see whether more is better",
            settings.max_order
        ));
    }
    let worst = report
        .held_out_fit
        .iter()
        .copied()
        .fold(f64::INFINITY, f64::min);
    if worst < 50.0 {
        warnings.push(format!(
            "held-out samples are explained badly (fit {worst:.1} %): strong noise, a nonlinear plant, or \
             inputs that were not recorded"
        ));
    }
    warnings
}
