//! What was seen during a run.

use serde::Serialize;

use crate::metrics::{Outcome, ROLLOVER_ROLL_RAD, SPIN_LEAST_SPEED_M_S, SPIN_SIDESLIP_RAD};
use crate::simulation::Observation;

/// One stored instant of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TraceRow {
    /// Handwheel angle that the manoeuvre asks for, before the vehicle's limits, positive to the
    /// left, rad.
    pub handwheel_command_rad: f64,
    /// What was measured.
    pub seen: Observation,
}

/// Largest values of a run, over every tick rather than over the stored rows.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Extremes {
    /// Largest |LTR| (no unit).
    pub ltr: f64,
    /// Largest |roll angle|, rad.
    pub roll_rad: f64,
    /// Largest |lateral acceleration|, m/s².
    pub lateral_acceleration_m_s2: f64,
    /// Largest |sideslip angle|, rad.
    pub sideslip_rad: f64,
    /// Largest height that both wheels of one side had at once, m.
    pub pair_clearance_m: f64,
    /// When both wheels of a side were first without load, s.
    pub unloaded_side_s: Option<f64>,
    /// When both wheels of a side first had the height that counts as two-wheel lift, s.
    pub two_wheel_lift_s: Option<f64>,
    /// When the vehicle first counted as spun out, s.
    pub spun_out_s: Option<f64>,
}

/// One run of a manoeuvre: rows at equal times, and the largest values in between.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trace {
    /// Name, unique within the manoeuvre, usable as a folder's name.
    pub name: String,
    /// Rows, the first at the start.
    pub rows: Vec<TraceRow>,
    /// Largest values.
    pub extremes: Extremes,
    /// How the run ended. A run that spins goes on; one that rolls over ends.
    pub ended: Outcome,
}

impl Trace {
    /// An empty trace.
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            rows: Vec::new(),
            extremes: Extremes::default(),
            ended: Outcome::Completed,
        }
    }

    /// Takes note of an instant for extremes and ending; does not store a row. Returns whether the run
    /// goes on.
    pub fn note(&mut self, seen: &Observation, two_wheel_lift_m: f64) -> bool {
        let worst = &mut self.extremes;
        let time = seen.time_s;
        worst.ltr = worst.ltr.max(seen.ltr.abs());
        worst.roll_rad = worst.roll_rad.max(seen.roll_rad.abs());
        worst.lateral_acceleration_m_s2 = worst
            .lateral_acceleration_m_s2
            .max(seen.lateral_acceleration_m_s2.abs());
        worst.sideslip_rad = worst.sideslip_rad.max(seen.sideslip_rad.abs());
        let clearance = seen.pair_clearance_m();
        worst.pair_clearance_m = worst.pair_clearance_m.max(clearance);
        if clearance >= two_wheel_lift_m {
            worst.two_wheel_lift_s.get_or_insert(time);
        }
        if seen.two_wheel_lift() {
            worst.unloaded_side_s.get_or_insert(time);
        }
        let speed = seen.speed_m_s.hypot(seen.lateral_speed_m_s);
        if seen.sideslip_rad.abs() > SPIN_SIDESLIP_RAD && speed > SPIN_LEAST_SPEED_M_S {
            worst.spun_out_s.get_or_insert(time);
            self.ended = self.ended.max(Outcome::SpunOut);
        }
        if seen.roll_rad.abs() > ROLLOVER_ROLL_RAD {
            self.ended = Outcome::RolledOver;
        }
        self.ended != Outcome::RolledOver
    }

    /// `value` of each row over time: pairs of time (s) and value.
    #[must_use]
    pub fn signal(&self, value: impl Fn(&TraceRow) -> f64) -> Vec<(f64, f64)> {
        self.rows
            .iter()
            .map(|row| (row.seen.time_s, value(row)))
            .collect()
    }

    /// Time of the last row, s; zero without rows.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.seen.time_s)
    }
}
