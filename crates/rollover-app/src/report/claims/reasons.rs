//! Why a claim came out as it did: numbers of the runs, and the run that isolates the cause.

use sysid::EffectVerdict;

use super::cases::{Cases, completed, median};
use crate::report::campaign::Campaign;
use crate::report::data::{Reason, RunLink, Verdict};
use crate::summary::Summary;

const NO_SPEED_EFFECT: &str = "lmpc-1-no-speed-effect";
const RECOMMENDED: &str = "rd-deepc-1";
const RAW: &str = "lmpc-1-paper-raw";
const SMOOTH_DATA: &str = "rd-deepc-1-smooth-data";

/// The reason for a verdict, where the campaign has a run that isolates it.
pub(super) fn reason(
    campaign: &Campaign,
    id: &str,
    cases: &Cases<'_>,
    verdict: Verdict,
) -> Option<Reason> {
    if id.contains("lmpc") {
        return speed_gain(campaign, cases);
    }
    if verdict == Verdict::Reproduced {
        return None;
    }
    let of = |controller| Cases::new(campaign, cases.scenario, controller);
    let link = |controller: &str| {
        Some(RunLink {
            scene: cases.scenario.into(),
            label: controller.into(),
        })
    };
    if cases.controller.ends_with("-paper") && id.contains("rd-deepc") {
        let recommended = of(RECOMMENDED);
        (!recommended.all.is_empty()).then(|| Reason {
            text: format!(
                "The paper's limit 1 is where the wheels lift and the steering gain vanishes, and so small a weight on g moves the predicted LTR rather than the steering wheel: the largest correction is {} in the median. With a margin and a larger weight ({RECOMMENDED}) it is {}, and {} complete.",
                correction(cases),
                correction(&recommended),
                recommended.count(completed)
            ),
            run: link(RECOMMENDED),
        })
    } else if id.starts_with("s1-speed-recovery") {
        Some(Reason {
            text: format!(
                "The rescue is by steering: the target speed of {} stays within {} km/h of its reference in the median run, so that the weight on it matters little.",
                cases.controller,
                speed_moves(cases)
            ),
            run: link(cases.controller),
        })
    } else if id.starts_with("s3-rd-deepc") {
        let smooth = of(SMOOTH_DATA);
        (!smooth.all.is_empty()).then(|| Reason {
            text: format!(
                "Of the same controller without the riverbed record in its data ({SMOOTH_DATA}) {} complete, with it {}. The ground moves LTR without any input, which the data explain by g and the past window by slack, instead of asking for the steering wheel.",
                smooth.count(completed),
                cases.count(completed)
            ),
            run: link(SMOOTH_DATA),
        })
    } else {
        None
    }
}

/// What the models make of the target speed, and the LMPC without an opinion on it.
fn speed_gain(campaign: &Campaign, cases: &Cases<'_>) -> Option<Reason> {
    let control = Cases::new(campaign, cases.scenario, NO_SPEED_EFFECT);
    if control.all.is_empty() {
        return None;
    }
    let gains: Vec<(f64, EffectVerdict)> = cases.runs().filter_map(gain).collect();
    let known = gains
        .iter()
        .filter(|(_, verdict)| *verdict == EffectVerdict::Identified)
        .count();
    let negative = gains.iter().filter(|(gain, _)| *gain < 0.0).count();
    let raw = Cases::new(campaign, cases.scenario, RAW);
    let on_raw = if raw.all.is_empty() || !cases.controller.ends_with("-paper") {
        String::new()
    } else {
        format!(
            " On a model of the raw data ({RAW}) {} complete.",
            raw.count(completed)
        )
    };
    Some(Reason {
        text: format!(
            "The recording does not tell how the target speed acts on LTR: the steady-state gain comes out negative in {negative} of {} runs, and passes as identified in {known}. With that gain held at zero ({NO_SPEED_EFFECT}, our margin) {} complete.{on_raw}",
            gains.len(),
            control.count(completed)
        ),
        run: Some(RunLink {
            scene: cases.scenario.into(),
            label: NO_SPEED_EFFECT.into(),
        }),
    })
}

fn gain(run: &Summary) -> Option<(f64, EffectVerdict)> {
    let effects = &run.model.as_ref()?.effects;
    let speed = effects.iter().find(|e| e.input == "target_speed_kmh")?;
    Some((speed.gain, speed.verdict))
}

fn correction(cases: &Cases<'_>) -> String {
    let corrections: Vec<f64> = cases
        .runs()
        .map(|run| run.steering_correction_max_deg)
        .collect();
    median(&corrections).map_or_else(|| "unknown".into(), |deg| format!("{deg:.1}°"))
}

fn speed_moves(cases: &Cases<'_>) -> String {
    let moves: Vec<f64> = cases
        .runs()
        .map(|run| {
            let away = |speed: f64| (speed - run.speed_reference_kmh).abs();
            away(run.target_speed_min_kmh).max(away(run.target_speed_max_kmh))
        })
        .collect();
    median(&moves).map_or_else(|| "unknown".into(), |kmh| format!("{kmh:.1}"))
}
