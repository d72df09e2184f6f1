//! Why a claim came out as it did: numbers of the runs, and the run that isolates the cause.

use sysid::EffectVerdict;

use super::cases::{Cases, completed};
use crate::report::campaign::Campaign;
use crate::report::data::{Reason, RunLink, Verdict};
use crate::report::measures::median;
use crate::scenario::FLOOR;
use crate::summary::Summary;

const NO_SPEED_EFFECT: &str = "lmpc-1-no-speed-effect";
const LMPC: &str = "lmpc-1";
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
    if cases.controller.starts_with("rd-deepc") && cases.controller.ends_with("-paper") {
        return margin(campaign, cases);
    }
    match id {
        "s1-speed-recovery" => Some(told(
            cases,
            cases.controller,
            format!(
                "The rescue is by steering: the target speed of {} stays within {} km/h of its reference in the median run, so that the weight on it matters little.",
                cases.controller,
                speed_moves(cases)
            ),
        )),
        "s1-cost" => costs(campaign, cases),
        "s2-rd-deepc" => slowing_down(campaign, cases),
        "s3-rd-deepc" => riverbed_record(campaign, cases),
        "table-time" => Some(told(
            cases,
            cases.controller,
            "Both programs hold 600 dense rows. The interior-point solver used for both eliminates the 3001 or 600 columns of g, on which there is only a diagonal weight, first, so that their number counts for less than in the paper's solver. Condensed, g is gone from both before the first step, and there is no difference left to make.".into(),
        )),
        _ => None,
    }
}

fn told(cases: &Cases<'_>, run: &str, text: String) -> Reason {
    Reason {
        text,
        run: Some(RunLink {
            scene: cases.scenario.into(),
            label: run.into(),
        }),
    }
}

/// The paper's settings of RD-DeePC beside the recommended ones.
fn margin(campaign: &Campaign, cases: &Cases<'_>) -> Option<Reason> {
    let recommended = Cases::new(campaign, cases.scenario, RECOMMENDED);
    if recommended.all.is_empty() {
        return None;
    }
    let text = format!(
        "The paper's limit 1 is where the wheels lift and the steering gain vanishes, and so small a weight on g moves the predicted LTR rather than the steering wheel: the largest correction is {} in the median. With a margin and a larger weight ({RECOMMENDED}) it is {}, and {} complete.",
        correction(cases),
        correction(&recommended),
        recommended.count(completed)
    );
    Some(told(cases, RECOMMENDED, text))
}

/// Where the costs come from, in the runs that are completed.
fn costs(campaign: &Campaign, cases: &Cases<'_>) -> Option<Reason> {
    let parts = |cases: &Cases<'_>| {
        let steering = |run: &Summary| Some(run.cost? - run.cost_of_target_speed?);
        Some((
            cases.median_completed(steering)?,
            cases.median_completed(|run| run.cost_of_target_speed)?,
        ))
    };
    let theirs = Cases::new(campaign, cases.scenario, LMPC);
    let ((steering, speed), (their_steering, their_speed)) = (parts(cases)?, parts(&theirs)?);
    let text = format!(
        "With these weights a degree of the steering wheel costs as much as 45 km/h of target speed, so that the cost tells who steers less. Of the completed runs the steering costs {steering:.2e} with {} and {their_steering:.2e} with {LMPC}, the target speed {speed:.2e} and {their_speed:.2e}, in the median.",
        cases.controller
    );
    Some(told(cases, LMPC, text))
}

/// What the lowest target speed alone does.
fn slowing_down(campaign: &Campaign, cases: &Cases<'_>) -> Option<Reason> {
    let floor = Cases::new(campaign, cases.scenario, FLOOR);
    let on_two_wheels = cases.median_completed(|run| Some(run.measures.two_wheel_lift_s))?;
    let ltr = |run: &Summary| Some(run.ltr_abs_max);
    let (ours, floors) = (cases.median_completed(ltr)?, floor.median_completed(ltr)?);
    let text = format!(
        "{} complete, but they drive on two wheels for {on_two_wheels:.1} s, with a largest |LTR| of {ours:.3}, in the median. The driver held at the lowest target speed ({FLOOR}) stays at {floors:.3}. Slowing down would do, but the data do not tell that it helps: the target speed moves by {} km/h in the median.",
        cases.count(completed),
        speed_moves(cases)
    );
    Some(told(cases, FLOOR, text))
}

/// What the record of the riverbed adds.
fn riverbed_record(campaign: &Campaign, cases: &Cases<'_>) -> Option<Reason> {
    let smooth = Cases::new(campaign, cases.scenario, SMOOTH_DATA);
    if smooth.all.is_empty() {
        return None;
    }
    let text = format!(
        "Of the same controller without the riverbed record in its data ({SMOOTH_DATA}) {} complete, with it {}. The ground moves LTR without any input, which the data explain by g and the past window by slack, instead of asking for the steering wheel: the largest correction is {} with the record and {} without it, in the median.",
        smooth.count(completed),
        cases.count(completed),
        correction(cases),
        correction(&smooth)
    );
    Some(told(cases, SMOOTH_DATA, text))
}

/// What the models make of the target speed, and the LMPC without an opinion on it.
fn speed_gain(campaign: &Campaign, cases: &Cases<'_>) -> Option<Reason> {
    let control = Cases::new(campaign, cases.scenario, NO_SPEED_EFFECT);
    if control.all.is_empty() {
        return None;
    }
    // The mirror image is driven with the same model.
    let as_it_is = cases.runs().filter(|run| !run.mirrored);
    let gains: Vec<(f64, EffectVerdict)> = as_it_is.filter_map(gain).collect();
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
            "The recording hardly tells how the target speed acts on LTR: the steady-state gain comes out negative from {negative} of {} recordings, and passes as identified from {known}. With a model of order 4 whose gain is held at zero ({NO_SPEED_EFFECT}, the margin of {LMPC}) {} complete.{on_raw}",
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
