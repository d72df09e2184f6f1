//! The results in words, for a terminal and for `report.txt`.

use std::fmt::Write as _;

use sysid::{EffectVerdict, InputEffect};

use super::results::{JudgedOn, Results};

/// Held-out fits from which on a model explains its outputs well, or partly.
const GOOD_PERCENT: f64 = 80.0;
const FAIR_PERCENT: f64 = 50.0;

/// A fit from here on is perfect but for rounding.
const PERFECT_PERCENT: f64 = 99.999_999;

/// Share of the outputs' variance below which an input can be left out.
const IDLE_SHARE: f64 = 0.02;

/// How good news is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Good,
    Caution,
    Bad,
}

/// The verdict in a sentence or two.
pub(super) fn headline(results: &Results) -> (Tone, String) {
    let report = &results.identification.report;
    let names = results.report.validation.outputs.iter().map(|o| &o.name);
    let fits: Vec<_> = names
        .zip(&report.held_out_fit)
        .map(|(name, fit)| format!("{name} {}", percent(Some(*fit))))
        .collect();
    let worst = report.held_out_fit.iter().copied();
    let worst = worst.fold(f64::INFINITY, f64::min);
    let (mut tone, how) = if worst >= GOOD_PERCENT {
        (Tone::Good, "explains held-out samples well")
    } else if worst >= FAIR_PERCENT {
        (Tone::Caution, "explains held-out samples in part")
    } else {
        (Tone::Bad, "explains held-out samples badly")
    };
    let mut text = format!(
        "A stable model of order {} {how}: simulated fit {}.",
        report.order,
        fits.join(", ")
    );
    let unidentified = report.unidentified_inputs();
    if !unidentified.is_empty() {
        if tone == Tone::Good {
            tone = Tone::Caution;
        }
        let _ = write!(
            text,
            " The recording does not identify the steady-state effect of {}: no controller should rely \
             on it.",
            unidentified.join(" and ")
        );
    }
    (tone, text)
}

/// Inputs that the model can do without: their effect is not identified, and the outputs hardly have any
/// of it.
pub(super) fn idle_inputs(results: &Results) -> Vec<&str> {
    let report = &results.identification.report;
    let mut names = report.unidentified_inputs();
    names.retain(|name| {
        let mut effects = report.effects.iter().filter(|e| e.input == *name);
        effects.all(|e| e.share < IDLE_SHARE)
    });
    names
}

/// What to do about inputs that the data do not identify, and the option that helps, if one does.
pub(super) fn remedy(results: &Results) -> Option<(String, Option<String>)> {
    let unidentified = results.identification.report.unidentified_inputs();
    if unidentified.is_empty() {
        return None;
    }
    let idle = idle_inputs(results);
    let again = format!(
        "Record again with larger and longer changes in {}",
        unidentified.join(" and ")
    );
    Some(if idle.is_empty() {
        (format!("{again}."), None)
    } else {
        (
            format!("{again}, or hold at zero what hardly shows in the outputs:"),
            Some(format!("--without-effect {}", idle.join(","))),
        )
    })
}

/// What the validation used, as a sentence.
pub(super) fn judged_on(results: &Results) -> String {
    match &results.report.validated_on {
        JudgedOn::SameRecording => {
            "Validated on the recording the model was made from, which flatters it: the held-out fits are \
             the honest ones. Give other recordings with --validate."
                .to_owned()
        }
        JudgedOn::Others(files) => format!(
            "Validated on {}, which the model has not seen.",
            files.join(", ")
        ),
    }
}

/// A verdict in a word or two.
pub(super) fn verdict(effect: &InputEffect) -> &'static str {
    match effect.verdict {
        EffectVerdict::Identified => "identified",
        EffectVerdict::SteadyStateNotIdentified => "steady state not identified",
        EffectVerdict::NotIdentified => "NOT identified",
        EffectVerdict::HeldAtZero => "held at zero",
    }
}

/// A fit.
pub(super) fn percent(value: Option<f64>) -> String {
    match value {
        None => "undefined".to_owned(),
        // Rounding must not make a perfect fit of one that is not.
        Some(value) if value > 99.9 && value < PERFECT_PERCENT => {
            format!("{:.4} %", value.min(99.9999))
        }
        Some(value) => format!("{value:.1} %"),
    }
}

/// A few lines for a terminal.
pub(super) fn summary(results: &Results) -> String {
    let mut text = headline(results).1;
    for effect in &results.identification.report.effects {
        let _ = write!(text, "\n  {effect}");
    }
    for output in &results.report.validation.outputs {
        let last = output.prediction.last().and_then(|s| s.fit_percent);
        let _ = write!(
            text,
            "\n  {} on {}: simulated {}, {} steps ahead {}",
            output.name,
            results.report.validated_on.words(),
            percent(output.simulation.and_then(|s| s.fit_percent)),
            output.prediction.len(),
            percent(last)
        );
    }
    for warning in &results.identification.report.warnings {
        let _ = write!(text, "\nwarning: {warning}");
    }
    if let Some((what, option)) = remedy(results) {
        let _ = write!(text, "\n{what} {}", option.unwrap_or_default());
    }
    text.trim_end().to_owned()
}

/// The file `report.txt`.
pub(super) fn report(results: &Results) -> String {
    let Results {
        identification,
        report,
    } = results;
    let mut text = format!(
        "{}\n\n{}\n{}\n{}\n\nPoles\n",
        headline(results).1,
        identification.report,
        judged_on(results),
        report.validation
    );
    for pole in &report.poles {
        let _ = writeln!(text, "  {pole}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::percent;

    #[test]
    fn only_a_perfect_fit_is_a_hundred_percent() {
        let texts = [-12.34, 98.76, 99.97, 99.999_99, 99.999_999_99].map(|v| percent(Some(v)));
        assert_eq!(
            texts,
            ["-12.3 %", "98.8 %", "99.9700 %", "99.9999 %", "100.0 %"]
        );
        assert_eq!(percent(None), "undefined");
    }
}
