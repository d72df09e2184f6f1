//! Peaks and times of a run, gathered tick by tick.

use serde::{Deserialize, Serialize};

use super::{TimeToLift, two_wheel_clearance_m, two_wheels_unloaded};
use crate::simulation::Observation;

/// Time constant of the rate behind the time to lift-off, s.
const RATE_FILTER_S: f64 = 0.05;

/// What [`RunMeasures`] takes of an instant; a log has the same numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSample {
    /// Time since the start, s.
    pub time_s: f64,
    /// The paper's load transfer ratio (no unit).
    pub ltr: f64,
    /// [`super::LoadTransferIndex`], where it is known (no unit).
    pub load_transfer_index: Option<f64>,
    /// Wheel loads front left, front right, rear left, rear right, N.
    pub wheel_loads_n: [f64; 4],
    /// [`two_wheel_clearance_m`], where it is known, m.
    pub two_wheel_clearance_m: Option<f64>,
    /// Roll angle, rad.
    pub roll_rad: f64,
    /// Sideslip angle, rad.
    pub sideslip_rad: f64,
    /// Distance from the course's centre line, m.
    pub path_deviation_m: f64,
}

impl RunSample {
    /// The sample of an observation, with the path deviation (m) and the load-transfer index at
    /// that instant.
    #[must_use]
    pub fn new(
        observation: &Observation,
        path_deviation_m: f64,
        load_transfer_index: Option<f64>,
    ) -> Self {
        Self {
            time_s: observation.time_s,
            ltr: observation.ltr,
            load_transfer_index,
            wheel_loads_n: observation.wheel_loads_n,
            two_wheel_clearance_m: Some(two_wheel_clearance_m(&observation.wheel_clearance_m)),
            roll_rad: observation.roll_rad,
            sideslip_rad: observation.sideslip_rad,
            path_deviation_m,
        }
    }
}

/// Peaks of a run and when they came. Numbers that are not finite count for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunMeasures {
    /// Largest |load transfer ratio| (no unit).
    pub ltr_abs_max: f64,
    /// When it came, s; `None` for a run without a load transfer.
    pub ltr_abs_max_time_s: Option<f64>,
    /// Largest |load-transfer index| of roll angle and rate (no unit); `None` where it is not known.
    pub load_transfer_index_abs_max: Option<f64>,
    /// When both wheels of one side first carried nothing, s.
    pub two_wheel_lift_first_s: Option<f64>,
    /// Time with both wheels of one side carrying nothing, s.
    pub two_wheel_lift_s: f64,
    /// Largest height of both wheels of one side, m; `None` where it is not known.
    pub two_wheel_clearance_max_m: Option<f64>,
    /// Largest |roll angle|, rad.
    pub roll_abs_max_rad: f64,
    /// When it came, s; `None` for a run without roll.
    pub roll_abs_max_time_s: Option<f64>,
    /// Shortest time to lift-off, from the load-transfer index and its rate, s; 0 once it exceeded
    /// 1, `None` where it never rose or is not known. On rough ground a short one
    /// alone says little.
    pub time_to_lift_min_s: Option<f64>,
    /// Largest |sideslip angle|, rad.
    pub sideslip_abs_max_rad: f64,
    /// Largest |distance from the centre line|, m.
    pub path_deviation_abs_max_m: f64,
}

/// Gathers [`RunMeasures`] tick by tick, without allocating.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunRecorder {
    sample_time_s: f64,
    lifted_samples: u32,
    to_lift: TimeToLift,
    measures: RunMeasures,
}

impl RunRecorder {
    /// For samples `sample_time_s` apart.
    #[must_use]
    pub fn new(sample_time_s: f64) -> Self {
        Self {
            sample_time_s,
            lifted_samples: 0,
            to_lift: TimeToLift::new(sample_time_s, RATE_FILTER_S),
            measures: RunMeasures::default(),
        }
    }

    /// Takes note of an instant.
    pub fn observe(&mut self, sample: &RunSample) {
        let found = &mut self.measures;
        let time = sample.time_s;
        if rises(&mut found.ltr_abs_max, sample.ltr) {
            found.ltr_abs_max_time_s = Some(time);
        }
        if rises(&mut found.roll_abs_max_rad, sample.roll_rad) {
            found.roll_abs_max_time_s = Some(time);
        }
        rises(&mut found.sideslip_abs_max_rad, sample.sideslip_rad);
        rises(&mut found.path_deviation_abs_max_m, sample.path_deviation_m);
        if let Some(index) = sample.load_transfer_index {
            rises(found.load_transfer_index_abs_max.get_or_insert(0.0), index);
            if let Some(time_s) = self.to_lift.update(index) {
                let shortest = found.time_to_lift_min_s.get_or_insert(time_s);
                *shortest = shortest.min(time_s);
            }
        }
        if let Some(clearance_m) = sample.two_wheel_clearance_m {
            rises(
                found.two_wheel_clearance_max_m.get_or_insert(0.0),
                clearance_m,
            );
        }
        if two_wheels_unloaded(&sample.wheel_loads_n) {
            self.lifted_samples += 1;
            found.two_wheel_lift_first_s.get_or_insert(time);
            found.two_wheel_lift_s = f64::from(self.lifted_samples) * self.sample_time_s;
        }
    }

    /// What was found so far.
    #[must_use]
    pub fn measures(&self) -> RunMeasures {
        self.measures
    }
}

impl RunMeasures {
    /// The measures of a whole run of samples `sample_time_s` apart.
    #[must_use]
    pub fn of(sample_time_s: f64, samples: impl IntoIterator<Item = RunSample>) -> Self {
        let mut recorder = RunRecorder::new(sample_time_s);
        for sample in samples {
            recorder.observe(&sample);
        }
        recorder.measures()
    }
}

/// Raises `largest` to `|value|` if that is above it, and says whether it was.
fn rises(largest: &mut f64, value: f64) -> bool {
    // False for NaN.
    let above = value.abs() > *largest && value.is_finite();
    if above {
        *largest = value.abs();
    }
    above
}
