//! The page about a model, in one file that needs no network.

use anyhow::{Context, Result};
use askama::Template;
use sysid::{EffectVerdict, InputEffect, Mode, OrderTrial, OutputValidation};

use super::figures::{Figure, Section, held_out_error_percent};
use super::results::{JudgedOn, Results};
use super::words::{self, Tone, percent};

#[derive(Template)]
#[template(path = "identify.html")]
struct Identify<'a> {
    tone: &'static str,
    headline: String,
    remedy: Option<(String, Option<String>)>,
    origin: String,
    judged_on: String,
    honest: bool,
    steps_ahead: usize,
    last_step: usize,
    fits: Vec<FitRow>,
    effects: Vec<EffectRow>,
    verdicts: Vec<(&'a str, Vec<Vec<Piece>>)>,
    warnings: Vec<Vec<Piece>>,
    poles: Vec<[String; 4]>,
    trials: Vec<TrialRow>,
    sections: Vec<(&'static str, &'static str, Vec<&'a Figure>)>,
}

/// A piece of a sentence: name of a channel or a setting, or plain text.
struct Piece {
    text: String,
    is_name: bool,
}

/// Text between backticks is a name.
fn pieces(sentence: &str) -> Vec<Piece> {
    let parts = sentence.split('`').enumerate();
    let pieces = parts.map(|(index, text)| Piece {
        text: unbroken(text),
        is_name: index % 2 == 1,
    });
    pieces.collect()
}

/// With no line break between a number and its per cent sign.
fn unbroken(text: &str) -> String {
    text.replace(" %", "\u{a0}%")
}

struct FitRow {
    output: String,
    cells: Vec<String>,
}

struct EffectRow {
    names: [String; 2],
    cells: Vec<String>,
    class: &'static str,
    verdict: &'static str,
}

struct TrialRow {
    cells: Vec<String>,
    chosen: bool,
}

/// The page as HTML.
///
/// # Errors
/// When the template cannot be filled in.
pub(super) fn render(results: &Results, figures: &[Figure]) -> Result<String> {
    let report = &results.identification.report;
    let validation = &results.report.validation;
    let (tone, headline) = words::headline(results);
    let section = |section| figures.iter().filter(|f| f.section == section).collect();
    let held_out = report
        .held_out_fit
        .iter()
        .zip(&report.held_out_prediction_fit);
    let fits = validation.outputs.iter().zip(held_out);
    let page = Identify {
        tone: match tone {
            Tone::Good => "good",
            Tone::Caution => "caution",
            Tone::Bad => "bad",
        },
        headline: unbroken(&headline),
        remedy: words::remedy(results),
        origin: origin(results),
        judged_on: words::judged_on(results),
        honest: results.report.validated_on != JudgedOn::SameRecording,
        steps_ahead: report.steps_ahead,
        last_step: validation.settings.steps,
        fits: fits
            .map(|(output, held_out)| fit_row(output, held_out))
            .collect(),
        effects: report.effects.iter().map(effect_row).collect(),
        verdicts: (validation.outputs.iter())
            .map(|o| {
                (
                    o.name.as_str(),
                    o.verdict.iter().map(|s| pieces(s)).collect(),
                )
            })
            .collect(),
        warnings: report.warnings.iter().map(|s| pieces(s)).collect(),
        poles: results.report.poles.iter().map(pole_row).collect(),
        trials: report
            .trials
            .iter()
            .map(|t| trial_row(t, report.order))
            .collect(),
        sections: vec![
            ("How well it fits", "", section(Section::Fit)),
            (
                "What it leaves unexplained",
                "If the model is right, its prediction errors look like noise and have nothing to do with \
                 the inputs.",
                section(Section::Residuals),
            ),
            ("What the model says", "", section(Section::Model)),
            ("Why this order", "", section(Section::Choice)),
        ],
    };
    page.render().context("cannot fill in the page")
}

fn origin(results: &Results) -> String {
    let report = &results.identification.report;
    format!(
        "Made from {} samples in {} of {}, {} s apart. Subspace estimate {} with horizon {}{}{}.",
        report.samples,
        match report.records {
            1 => "one record".to_owned(),
            count => format!("{count} records"),
        },
        results.report.recordings.join(", "),
        results.report.validation.sample_time_s,
        report.weighting,
        report.horizon,
        match (report.refined, report.focus) {
            (false, _) => ", not refined",
            (true, sysid::FocusChoice::Prediction) =>
                ", refined by prediction error one step ahead",
            (true, _) => ", refined on the simulated output",
        },
        match report.offsets {
            sysid::OffsetChoice::Found => "",
            sysid::OffsetChoice::Means => ", of data without their means",
            sysid::OffsetChoice::None => ", of raw data: the model goes through the origin",
        }
    )
}

fn fit_row(output: &OutputValidation, held_out: (&f64, &f64)) -> FitRow {
    let ahead = |score: Option<&sysid::Score>| percent(score.and_then(|s| s.fit_percent));
    FitRow {
        output: output.name.clone(),
        cells: vec![
            percent(Some(*held_out.0)),
            percent(Some(*held_out.1)),
            ahead(output.simulation.as_ref()),
            ahead(output.prediction.first()),
            ahead(output.prediction.last()),
        ],
    }
}

fn effect_row(effect: &InputEffect) -> EffectRow {
    let held = effect.verdict == EffectVerdict::HeldAtZero;
    let known = |text: String| if held { "–".to_owned() } else { text };
    EffectRow {
        names: [effect.input.clone(), effect.output.clone()],
        cells: vec![
            known(number(effect.gain)),
            known(format!("± {}", number(effect.standard_error))),
            known(relative_error(effect)),
            known(format!("{:.1} %", 100.0 * effect.share)),
            if effect.feedthrough {
                format!("t = {}", t_value(effect.feedthrough_t))
            } else {
                "–".to_owned()
            },
        ],
        class: match effect.verdict {
            EffectVerdict::Identified => "good",
            EffectVerdict::NotIdentified | EffectVerdict::SteadyStateNotIdentified => "bad",
            EffectVerdict::HeldAtZero => "soft",
        },
        verdict: words::verdict(effect),
    }
}

fn t_value(t: f64) -> String {
    if t.abs() < 1000.0 {
        // + 0 makes 0 of −0.
        format!("{:.1}", (10.0 * t).round() / 10.0 + 0.0)
    } else {
        number(t)
    }
}

fn relative_error(effect: &InputEffect) -> String {
    let percent = 100.0 * effect.relative_error();
    if percent < 0.1 {
        "< 0.1 %".to_owned()
    } else if percent < 10.0 {
        format!("{percent:.1} %")
    } else if percent < 1000.0 {
        format!("{percent:.0} %")
    } else {
        "> 1000 %".to_owned()
    }
}

fn trial_row(trial: &OrderTrial, chosen: usize) -> TrialRow {
    TrialRow {
        cells: vec![
            trial.order.to_string(),
            percent(Some(trial.held_out_fit)),
            format!("{} %", number(held_out_error_percent(trial))),
            format!("{:.3}", trial.information_criterion()),
            format!("{}, {}", trial.weighting, trial.horizon),
        ],
        chosen: trial.order == chosen,
    }
}

fn pole_row(pole: &Mode) -> [String; 4] {
    let place = if pole.imaginary == 0.0 {
        format!("{:.5}", pole.real)
    } else {
        let sign = if pole.imaginary < 0.0 { '−' } else { '+' };
        format!("{:.5} {sign} {:.5}i", pole.real, pole.imaginary.abs())
    };
    [
        place,
        number(pole.natural_frequency_hz),
        format!("{:.3}", pole.damping),
        number(pole.time_constant_s),
    ]
}

/// Four digits, with a power of ten where the decimals would not show them.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e4).contains(&size) {
        let before = size.log10().floor();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 to 7 digits"
        )]
        let digits = (3.0 - before).max(0.0) as usize;
        format!("{value:.digits$}")
    } else if value.is_finite() {
        format!("{value:.3e}")
    } else {
        "unbounded".to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::{number, pieces};

    #[test]
    fn names_in_sentences_are_set_apart() {
        let pieces = pieces("the effect of `pump` is 5 % of it");
        let texts = pieces.iter().map(|p| (p.text.as_str(), p.is_name));
        assert_eq!(
            texts.collect::<Vec<_>>(),
            [
                ("the effect of ", false),
                ("pump", true),
                (" is 5\u{a0}% of it", false)
            ]
        );
    }

    #[test]
    fn numbers_keep_their_digits() {
        let texts = [
            0.0,
            -0.0123,
            3.7182,
            1234.56,
            0.000_396_9,
            1.5e-7,
            f64::INFINITY,
        ]
        .map(number);
        assert_eq!(
            texts,
            [
                "0",
                "-0.01230",
                "3.718",
                "1235",
                "0.0003969",
                "1.500e-7",
                "unbounded"
            ]
        );
    }
}
