//! What the tests say, in words.

use std::fmt::Write as _;

use super::ValidationSettings;
use super::residual::{InputTest, ResidualTests, Whiteness};
use crate::state_space::StateSpace;

/// Sentences about the residual of output `i`.
pub(super) fn sentences(
    model: &StateSpace,
    i: usize,
    residual: &ResidualTests,
    settings: &ValidationSettings,
) -> Vec<String> {
    let Some(whiteness) = &residual.whiteness else {
        return vec!["the residuals are rounding: there is nothing left to explain".to_owned()];
    };
    let mut sentences = vec![about_whiteness(model, whiteness, settings)];
    let before = sentences.len();
    for test in &residual.inputs {
        if !test.effect.passes(settings.confidence) {
            sentences.push(about_effect(model, i, test));
        }
        if !test.feedback.passes(settings.confidence) {
            sentences.push(about_feedback(test));
        }
    }
    if sentences.len() == before && !residual.inputs.is_empty() {
        let smallest = residual.inputs.iter().map(|test| test.effect.p_value);
        let smallest = smallest.fold(1.0, f64::min);
        sentences.push(format!(
            "no input explains the residuals (smallest p = {})",
            probability(smallest)
        ));
    }
    let errors = residual.mean.abs() / residual.mean_standard_error;
    if errors > 4.0 {
        sentences.push(format!(
            "the residuals have the mean {:.3e}, {errors:.0} standard errors from 0: the offsets of \
             the model are not those of these data",
            residual.mean
        ));
    }
    sentences
}

fn about_whiteness(
    model: &StateSpace,
    whiteness: &Whiteness,
    settings: &ValidationSettings,
) -> String {
    let test = &whiteness.portmanteau;
    let white = test.passes(settings.confidence);
    let mut text = format!(
        "the residuals are {}white: {} of {} lags outside the {} % band ({:.2} expected), p = {}",
        if white { "" } else { "not " },
        whiteness.outside,
        settings.lags,
        percent(settings.confidence),
        whiteness.expected_outside,
        probability(test.p_value)
    );
    if !white {
        // An output error model makes no promise about the colour of its residuals.
        let k = &model.matrices().k;
        let meaning = if k.norm_max() == 0.0 {
            "; the model has no noise part (K = 0), so that predictions can be improved by one"
        } else {
            ": the noise part does not fit"
        };
        text.push_str(meaning);
    }
    text
}

fn about_effect(model: &StateSpace, i: usize, test: &InputTest) -> String {
    let lags = test.correlation.outside(|lag| lag >= 0);
    let name = &test.input;
    let mut text = format!("input `{name}` still explains the residuals");
    let channels = model.inputs().iter().chain(model.disturbances());
    let column = channels.map(|c| &c.name).position(|other| other == name);
    let direct = column.is_some_and(|j| model.matrices().d[(i, j)] != 0.0);
    place(&mut text, &lags);
    let p = probability(test.effect.p_value);
    let meaning = if lags == [0] && !direct {
        "its direct feedthrough is missing"
    } else {
        "dynamics are missing"
    };
    let _ = write!(text, " (p = {p}): {meaning}");
    text
}

fn about_feedback(test: &InputTest) -> String {
    let lags = test.correlation.outside(|lag| lag < 0);
    let mut text = format!(
        "the residuals move with later values of input `{}`",
        test.input
    );
    place(&mut text, &lags);
    let p = probability(test.feedback.p_value);
    let _ = write!(
        text,
        " (p = {p}): there was feedback while recording, or both follow something unmeasured"
    );
    text
}

fn place(text: &mut String, lags: &[i64]) {
    let place = match lags {
        [] => ", though no single lag stands out".to_owned(),
        [one] => format!(" at lag {one}"),
        _ => format!(" at lags {}", runs(lags)),
    };
    text.push_str(&place);
}

/// Ascending lags as runs: `0, 3 to 9`.
fn runs(lags: &[i64]) -> String {
    let mut parts: Vec<(i64, i64)> = Vec::new();
    for &lag in lags {
        match parts.last_mut() {
            Some((_, end)) if *end + 1 == lag => *end = lag,
            _ => parts.push((lag, lag)),
        }
    }
    let text = parts.iter().map(|(start, end)| match end - start {
        0 => start.to_string(),
        _ => format!("{start} to {end}"),
    });
    text.collect::<Vec<_>>().join(", ")
}

fn percent(confidence: f64) -> String {
    let value = (confidence * 1e8).round() / 1e6;
    value.to_string()
}

pub(super) fn probability(p: f64) -> String {
    if p >= 0.001 {
        format!("{p:.3}")
    } else if p < 1e-99 {
        "0".to_owned()
    } else {
        format!("{p:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lags_are_told_in_runs() {
        assert_eq!(runs(&[-2, 0, 1, 3, 4, 5, 9]), "-2, 0 to 1, 3 to 5, 9");
        assert_eq!(percent(0.99), "99");
        assert_eq!(percent(0.999), "99.9");
        assert_eq!(probability(3.2e-7), "3e-7");
    }
}
