//! What a run comes to: the numbers of `summary.json`, computed from its log alone.

mod course;
mod model;

use serde::{Deserialize, Serialize};
use vehicle_dyn::metrics::{Outcome, RunMeasures, RunSample};

use crate::run_log::{LogRow, SolveStatus};
pub use course::{CourseMeasures, SPEED_RECOVERED_KMH};
pub use model::{EffectSummary, ModelSummary};

/// The summary of one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the controller.
    pub controller: String,
    /// Seed of the recording the controller works from.
    pub seed: u64,
    /// Whether the course was driven as its mirror image.
    #[serde(default)]
    pub mirrored: bool,
    /// Files of the recording, where they were given and not made from the seed.
    pub recording: Option<String>,
    /// Speed at the start and reference afterwards, km/h.
    pub speed_reference_kmh: f64,
    /// Lowest and highest target speed that the controller might command, km/h; absent for the
    /// driver alone.
    #[serde(default)]
    pub target_speed_bounds_kmh: Option<[f64; 2]>,
    /// How the run ended.
    pub outcome: Outcome,
    /// Time at which the outcome was decided, s.
    pub end_time_s: f64,
    /// Largest |LTR|.
    pub ltr_abs_max: f64,
    /// Time spent with |LTR| above the paper's limit of 1, s.
    pub ltr_violation_s: f64,
    /// Lowest speed, km/h.
    pub speed_min_kmh: f64,
    /// Mean speed, km/h.
    pub speed_mean_kmh: f64,
    /// Highest speed, km/h.
    pub speed_max_kmh: f64,
    /// Lowest target speed commanded, km/h.
    pub target_speed_min_kmh: f64,
    /// Highest target speed commanded, km/h.
    pub target_speed_max_kmh: f64,
    /// Largest distance from the centre line, m.
    pub path_deviation_max_m: f64,
    /// Largest change of the driver's steering-wheel angle, deg.
    pub steering_correction_max_deg: f64,
    /// Mean magnitude of that change, deg.
    pub steering_correction_mean_deg: f64,
    /// Stage costs of the inputs summed over the run (paper, Table I; deg² and km²/h²); absent
    /// without weights: the driver alone has none.
    pub cost: Option<f64>,
    /// The part of it that the target speed has; absent as the cost is.
    #[serde(default)]
    pub cost_of_target_speed: Option<f64>,
    /// Control steps taken.
    pub steps: usize,
    /// Steps in which the unconstrained optimum was feasible and no solver ran.
    pub unconstrained_steps: usize,
    /// Steps in which the QP solver ran to an optimum.
    pub solver_steps: usize,
    /// Steps in which the solve failed and the controller fell back.
    pub fallback_steps: usize,
    /// Steps whose measured LTR the sensor lost; 0 for logs without measured values.
    #[serde(default)]
    pub ltr_lost_steps: usize,
    /// Rollover measures of the true motion, in SI units.
    #[serde(default)]
    pub measures: RunMeasures,
    /// In which turn what happened.
    #[serde(default)]
    pub course: CourseMeasures,
    /// Wall-clock time of a step, µs.
    pub step_time_us: StepTime,
    /// The identified model it predicts with, if it does.
    pub model: Option<ModelSummary>,
}

/// Distribution of the wall-clock time of a step, µs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepTime {
    /// Half of the steps are at most this long.
    pub median: f64,
    /// 99 of 100 steps are at most this long.
    pub p99: f64,
    /// The longest step.
    pub max: f64,
}

/// Who ran what: the part of a summary that the log does not hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunIdentity {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the controller.
    pub controller: String,
    /// Seed of the recording.
    pub seed: u64,
    /// Whether the course was driven as its mirror image.
    pub mirrored: bool,
    /// Stations at which each turn of the course begins and ends, m.
    pub turns_m: Vec<[f64; 2]>,
    /// Files of the recording, where they were given and not made from the seed.
    pub recording: Option<String>,
    /// Speed at the start and reference afterwards, km/h.
    pub speed_reference_kmh: f64,
    /// Lowest and highest target speed that the controller might command, km/h, if it commands any.
    pub target_speed_bounds_kmh: Option<[f64; 2]>,
    /// The identified model of the controller, if it has one.
    pub model: Option<ModelSummary>,
}

/// Stage-cost weights on the inputs' distance from their references.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputWeights {
    /// On the steering wheel, 1/deg².
    pub steering_wheel_per_deg2: f64,
    /// On the target speed, 1/(km/h)².
    pub target_speed_per_kmh2: f64,
}

impl InputWeights {
    /// Stage cost `‖u − u_r‖²_R` of one step (Q = 0 in the paper's simulations).
    #[must_use]
    pub fn stage_cost(&self, row: &LogRow) -> f64 {
        let steering = row.steering_wheel_deg - row.steering_wheel_reference_deg;
        self.steering_wheel_per_deg2 * steering * steering + self.cost_of_target_speed(row)
    }

    /// The target speed's part of it.
    #[must_use]
    pub fn cost_of_target_speed(&self, row: &LogRow) -> f64 {
        let speed = row.target_speed_kmh - row.target_speed_reference_kmh;
        self.target_speed_per_kmh2 * speed * speed
    }
}

/// The paper's limit on |LTR|, at which the inner wheels lift off.
pub const LTR_LIFT_OFF: f64 = 1.0;

impl Summary {
    /// Computes the summary of a log; without `weights` it has no cost.
    #[must_use]
    pub fn of_log(
        identity: RunIdentity,
        outcome: Outcome,
        rows: &[LogRow],
        weights: Option<&InputWeights>,
        sample_time_s: f64,
    ) -> Self {
        let max_of = |f: fn(&LogRow) -> f64| rows.iter().map(f).fold(0.0, f64::max);
        let min_of = |f: fn(&LogRow) -> f64| rows.iter().map(f).fold(f64::INFINITY, f64::min);
        let mean_of = |f: fn(&LogRow) -> f64| rows.iter().map(f).sum::<f64>() / rows.len() as f64;
        let correction = |r: &LogRow| (r.steering_wheel_deg - r.steering_wheel_reference_deg).abs();
        let count = |f: fn(SolveStatus) -> bool| rows.iter().filter(|r| f(r.solve_status)).count();
        let violating = rows.iter().filter(|r| r.ltr.abs() > LTR_LIFT_OFF).count();
        Self {
            scenario: identity.scenario,
            vehicle: identity.vehicle,
            controller: identity.controller,
            seed: identity.seed,
            mirrored: identity.mirrored,
            recording: identity.recording,
            speed_reference_kmh: identity.speed_reference_kmh,
            target_speed_bounds_kmh: identity.target_speed_bounds_kmh,
            outcome,
            end_time_s: rows.last().map_or(0.0, |r| r.time_s),
            ltr_abs_max: max_of(|r| r.ltr.abs()),
            ltr_violation_s: violating as f64 * sample_time_s,
            speed_min_kmh: min_of(|r| r.speed_kmh),
            speed_mean_kmh: mean_of(|r| r.speed_kmh),
            speed_max_kmh: max_of(|r| r.speed_kmh),
            target_speed_min_kmh: min_of(|r| r.target_speed_kmh),
            target_speed_max_kmh: max_of(|r| r.target_speed_kmh),
            path_deviation_max_m: max_of(|r| r.path_deviation_m.abs()),
            steering_correction_max_deg: max_of(correction),
            steering_correction_mean_deg: mean_of(correction),
            cost: weights.map(|w| rows.iter().map(|r| w.stage_cost(r)).sum()),
            cost_of_target_speed: weights
                .map(|w| rows.iter().map(|r| w.cost_of_target_speed(r)).sum()),
            steps: rows.len(),
            unconstrained_steps: count(|s| s == SolveStatus::Unconstrained),
            solver_steps: count(|s| matches!(s, SolveStatus::Solved | SolveStatus::SolvedBySecond)),
            fallback_steps: count(SolveStatus::is_fallback),
            ltr_lost_steps: lost_steps(rows),
            measures: RunMeasures::of(sample_time_s, rows.iter().map(sample)),
            course: CourseMeasures::of(rows, &identity.turns_m, weights),
            step_time_us: StepTime::of(rows.iter().map(|r| r.step_time_us)),
            model: identity.model,
        }
    }
}

fn lost_steps(rows: &[LogRow]) -> usize {
    let lost = rows.iter().filter(|r| r.ltr_measured.is_none()).count();
    if lost == rows.len() && rows.iter().all(|r| r.load_transfer_index.is_none()) {
        // An old log has no column of measured values.
        return 0;
    }
    lost
}

fn sample(row: &LogRow) -> RunSample {
    RunSample {
        time_s: row.time_s,
        ltr: row.ltr,
        load_transfer_index: row.load_transfer_index,
        wheel_loads_n: [
            row.load_front_left_n,
            row.load_front_right_n,
            row.load_rear_left_n,
            row.load_rear_right_n,
        ],
        two_wheel_clearance_m: row.two_wheel_clearance_m,
        roll_rad: row.roll_deg.to_radians(),
        sideslip_rad: row.sideslip_deg.to_radians(),
        path_deviation_m: row.path_deviation_m,
    }
}

impl StepTime {
    fn of(times: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = times.collect();
        sorted.sort_by(f64::total_cmp);
        // Nearest-rank quantile: always a time that was measured.
        let quantile = |numerator: usize| {
            let rank = (sorted.len() * numerator).div_ceil(100).max(1);
            sorted.get(rank - 1).copied().unwrap_or(0.0)
        };
        Self {
            median: quantile(50),
            p99: quantile(99),
            max: quantile(100),
        }
    }
}
