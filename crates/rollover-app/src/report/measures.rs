//! The numbers of a run, from whatever columns its log has.

use std::f64::consts::PI;

use vehicle_dyn::metrics::{Outcome, OutcomeRules};

use super::data::{Columns, RunFigures, Scene, SeedRow};
use super::log::{STATUS, STATUS_NAMES, TIME};
use crate::summary::{InputWeights, LTR_LIFT_OFF};

/// Columns computed from others.
pub(super) const CORRECTION: &str = "steering_correction_deg";
const STEERING: &str = "steering_wheel_deg";
const STEERING_REFERENCE: &str = "steering_wheel_reference_deg";
const SPEED: &str = "speed_kmh";

/// Adds what follows from the columns of a log.
pub(super) fn add_derived(columns: &mut Columns) {
    if let (Some(applied), Some(wanted)) = (columns.get(STEERING), columns.get(STEERING_REFERENCE))
    {
        let correction = applied.iter().zip(wanted).map(|(a, w)| a - w).collect();
        columns.insert(CORRECTION.into(), correction);
    }
}

/// The numbers of a log.
#[must_use]
pub fn run_figures(columns: &Columns, weights: Option<&InputWeights>) -> RunFigures {
    let known = |name: &str| {
        let column = columns.get(name)?;
        Some(column.iter().copied().filter(|v| v.is_finite()))
    };
    let abs_max = |name: &str| known(name)?.map(f64::abs).reduce(f64::max);
    let time = columns.get(TIME).map_or(&[][..], Vec::as_slice);
    let fallback = |code: f64| {
        let status = STATUS_NAMES.iter().enumerate();
        let mut status = status.filter(|(index, _)| *index as f64 >= code);
        status
            .next()
            .is_some_and(|(_, (_, status))| status.is_fallback())
    };
    let speed = |name: &str| {
        let values: Vec<f64> = known(name)?.collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    // A controller that takes no time is none.
    let timed = known("step_time_us").is_some_and(|mut times| times.any(|t| t > 0.0));
    let times = || known("step_time_us").filter(|_| timed);
    RunFigures {
        steps: time.len(),
        end_time_s: time.last().copied(),
        ltr_abs_max: abs_max("ltr"),
        ltr_violation_s: columns.get("ltr").map(|ltr| violation_s(time, ltr)),
        roll_abs_max_deg: abs_max("roll_deg"),
        speed_min_kmh: known(SPEED).and_then(|v| v.reduce(f64::min)),
        speed_mean_kmh: speed(SPEED),
        path_deviation_max_m: abs_max("path_deviation_m"),
        steering_correction_max_deg: abs_max(CORRECTION),
        cost: weights.and_then(|weights| cost(columns, weights)),
        fallback_steps: known(STATUS).map(|codes| codes.filter(|c| fallback(*c)).count()),
        step_time_median_us: times().and_then(|times| median(&times.collect::<Vec<_>>())),
        step_time_max_us: times().and_then(|times| times.reduce(f64::max)),
    }
}

/// Time with |LTR| above its limit: each row stands for the time since the one before.
fn violation_s(time: &[f64], ltr: &[f64]) -> f64 {
    let interval = |k: usize| match k {
        0 => time.get(1).map_or(0.0, |next| next - time[0]),
        _ => time[k] - time[k - 1],
    };
    let beyond = (0..time.len()).filter(|&k| ltr[k].abs() > LTR_LIFT_OFF);
    beyond.map(interval).sum()
}

fn cost(columns: &Columns, weights: &InputWeights) -> Option<f64> {
    let correction = columns.get(CORRECTION)?;
    let speed = columns.get("target_speed_kmh")?;
    let reference = columns.get("target_speed_reference_kmh")?;
    let steps = correction.iter().zip(speed.iter().zip(reference));
    let stage = |(c, (s, r)): (&f64, (&f64, &f64))| {
        weights.steering_wheel_per_deg2 * c * c + weights.target_speed_per_kmh2 * (s - r) * (s - r)
    };
    let total: f64 = steps.map(stage).sum();
    total.is_finite().then_some(total)
}

/// The outcome by the standard rules (decision 4), or `None` where the log holds nothing to judge.
/// A sideslip says little without the speed, and leaving the road nothing without its width.
#[must_use]
pub fn outcome(columns: &Columns, road_width_m: Option<f64>) -> Option<Outcome> {
    let rules = OutcomeRules::STANDARD;
    let any = |name: &str, beyond: &dyn Fn(usize, f64) -> bool| {
        let column = columns.get(name)?;
        Some(column.iter().enumerate().any(|(k, v)| beyond(k, *v)))
    };
    let radians = PI / 180.0;
    let rolled = any("roll_deg", &|_, roll| {
        roll.abs() * radians > rules.rollover_roll_rad
    })?;
    let spun = columns.get(SPEED).and_then(|speed| {
        any("sideslip_deg", &|k, sideslip| {
            // The log has the forward speed; the horizontal one is that over cos β.
            let angle = sideslip * radians;
            let speed_m_s = (speed[k] / 3.6).abs() / angle.cos().abs().max(1e-3);
            angle.abs() > rules.spin_sideslip_rad && speed_m_s > rules.spin_least_speed_m_s
        })
    });
    let left = road_width_m.and_then(|width| {
        any("path_deviation_m", &|_, deviation| {
            deviation.abs() > 0.5 * width
        })
    });
    Some(if rolled {
        Outcome::RolledOver
    } else if spun == Some(true) {
        Outcome::SpunOut
    } else if left == Some(true) {
        Outcome::LeftRoad
    } else {
        Outcome::Completed
    })
}

/// The middle value, or the lower of the two in the middle: always a value that occurred.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied()
}

/// A run that counts in a row over the seeds.
pub(super) struct SeedRun {
    /// [`Scene::title`].
    pub(super) scene: String,
    pub(super) controller: String,
    pub(super) mirrored: bool,
    /// Whether it was completed, where that is known.
    pub(super) completed: Option<bool>,
    pub(super) figures: RunFigures,
}

/// Outcomes over the seeds of every scene in which a controller ran more than once.
#[must_use]
pub fn seed_rows(scenes: &[Scene]) -> Vec<SeedRow> {
    let runs = scenes.iter().flat_map(|scene| {
        scene.runs.iter().map(|run| SeedRun {
            scene: scene.title.clone(),
            controller: run.controller.clone(),
            mirrored: run.mirrored,
            completed: run.outcome.map(|outcome| outcome == Outcome::Completed),
            figures: run.figures.clone(),
        })
    });
    rows_of(&runs.collect::<Vec<_>>())
}

/// A row for every scene, controller and course, in the order of the runs; none for scenes in which
/// everything ran once.
pub(super) fn rows_of(runs: &[SeedRun]) -> Vec<SeedRow> {
    let mut groups: Vec<(&str, &str, bool)> = Vec::new();
    for run in runs {
        let group = (run.scene.as_str(), run.controller.as_str(), run.mirrored);
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    let rows = groups.into_iter().map(|group| seed_row(runs, group));
    let rows: Vec<SeedRow> = rows.collect();
    let several = |scene: &str| rows.iter().any(|r| r.scene == scene && r.runs > 1);
    rows.iter().filter(|r| several(&r.scene)).cloned().collect()
}

fn seed_row(runs: &[SeedRun], (scene, controller, mirrored): (&str, &str, bool)) -> SeedRow {
    let of_group = |run: &&SeedRun| {
        run.scene == scene && run.controller == controller && run.mirrored == mirrored
    };
    let runs: Vec<_> = runs.iter().filter(of_group).collect();
    let values = |f: fn(&RunFigures) -> Option<f64>| -> Vec<f64> {
        runs.iter().filter_map(|run| f(&run.figures)).collect()
    };
    let judged = runs.iter().filter(|run| run.completed.is_some()).count();
    let fraction = |holds: &dyn Fn(&SeedRun) -> bool| {
        let number = runs.iter().filter(|run| holds(run)).count();
        (judged > 0).then(|| number as f64 / judged as f64)
    };
    let completed = |run: &SeedRun| run.completed == Some(true);
    let below = |run: &SeedRun| run.figures.ltr_abs_max.is_some_and(|l| l <= LTR_LIFT_OFF);
    SeedRow {
        scene: scene.to_owned(),
        controller: controller.to_owned(),
        course: if mirrored { "mirrored" } else { "as it is" }.into(),
        runs: runs.len(),
        completed_fraction: fraction(&completed),
        safe_fraction: fraction(&|run| completed(run) && below(run)),
        ltr_abs_median: median(&values(|f| f.ltr_abs_max)),
        ltr_abs_worst: values(|f| f.ltr_abs_max).into_iter().reduce(f64::max),
        speed_mean_median_kmh: median(&values(|f| f.speed_mean_kmh)),
        speed_min_worst_kmh: values(|f| f.speed_min_kmh).into_iter().reduce(f64::min),
        path_deviation_worst_m: values(|f| f.path_deviation_max_m)
            .into_iter()
            .reduce(f64::max),
        cost_median: median(&values(|f| f.cost)),
    }
}
