//! The log of one run of a manoeuvre.

use std::path::Path;

use anyhow::Result;
use serde::{Deserialize, Serialize};
use vehicle_dyn::manoeuvre::{Trace, TraceRow};
use vehicle_dyn::units::DEGREE;

use super::files::{LOG, RUNS};
use crate::output::{create_folder, write_whole};

/// One row of `log.csv`: what was measured at `time_s`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManoeuvreLogRow {
    /// Time since the start of the run, s.
    pub time_s: f64,
    /// Handwheel angle that the manoeuvre asks for, deg, left positive.
    pub handwheel_command_deg: f64,
    /// Handwheel angle behind the steering actuator, deg.
    pub handwheel_deg: f64,
    /// Forward speed, km/h.
    pub speed_kmh: f64,
    /// Lateral acceleration, m/s².
    pub lateral_acceleration_m_s2: f64,
    /// Longitudinal acceleration, m/s².
    pub longitudinal_acceleration_m_s2: f64,
    /// Yaw rate, deg/s.
    pub yaw_rate_deg_per_s: f64,
    /// Sideslip angle at the centre of gravity, deg.
    pub sideslip_deg: f64,
    /// Roll angle of the body, deg, right side down positive.
    pub roll_deg: f64,
    /// Roll rate of the body, deg/s.
    pub roll_rate_deg_per_s: f64,
    /// Load transfer ratio (paper eq. 2), dimensionless, positive in a left turn.
    pub ltr: f64,
    /// Vertical tyre load, front left, N.
    pub load_front_left_n: f64,
    /// Vertical tyre load, front right, N.
    pub load_front_right_n: f64,
    /// Vertical tyre load, rear left, N.
    pub load_rear_left_n: f64,
    /// Vertical tyre load, rear right, N.
    pub load_rear_right_n: f64,
    /// Gap under the tyre, front left, m.
    pub clearance_front_left_m: f64,
    /// Gap under the tyre, front right, m.
    pub clearance_front_right_m: f64,
    /// Gap under the tyre, rear left, m.
    pub clearance_rear_left_m: f64,
    /// Gap under the tyre, rear right, m.
    pub clearance_rear_right_m: f64,
    /// Position along the first heading, m.
    pub x_m: f64,
    /// Position to the left of it, m.
    pub y_m: f64,
    /// Heading, deg, counter-clockwise positive.
    pub yaw_deg: f64,
}

impl From<&TraceRow> for ManoeuvreLogRow {
    fn from(row: &TraceRow) -> Self {
        let seen = &row.seen;
        let [load_fl, load_fr, load_rl, load_rr] = seen.wheel_loads_n;
        let [gap_fl, gap_fr, gap_rl, gap_rr] = seen.wheel_clearance_m;
        Self {
            time_s: seen.time_s,
            handwheel_command_deg: row.handwheel_command_rad / DEGREE,
            handwheel_deg: seen.handwheel_actual_deg(),
            speed_kmh: seen.speed_kmh(),
            lateral_acceleration_m_s2: seen.lateral_acceleration_m_s2,
            longitudinal_acceleration_m_s2: seen.longitudinal_acceleration_m_s2,
            yaw_rate_deg_per_s: seen.yaw_rate_rad_s / DEGREE,
            sideslip_deg: seen.sideslip_rad / DEGREE,
            roll_deg: seen.roll_rad / DEGREE,
            roll_rate_deg_per_s: seen.roll_rate_rad_s / DEGREE,
            ltr: seen.ltr,
            load_front_left_n: load_fl,
            load_front_right_n: load_fr,
            load_rear_left_n: load_rl,
            load_rear_right_n: load_rr,
            clearance_front_left_m: gap_fl,
            clearance_front_right_m: gap_fr,
            clearance_rear_left_m: gap_rl,
            clearance_rear_right_m: gap_rr,
            x_m: seen.x_m,
            y_m: seen.y_m,
            yaw_deg: seen.yaw_rad / DEGREE,
        }
    }
}

/// Writes the log of a run.
pub(super) fn write(out: &Path, trace: &Trace) -> Result<()> {
    let folder = out.join(RUNS).join(&trace.name);
    create_folder(&folder)?;
    let mut csv = csv::Writer::from_writer(Vec::new());
    for row in &trace.rows {
        csv.serialize(ManoeuvreLogRow::from(row))?;
    }
    let bytes = csv.into_inner().map_err(csv::IntoInnerError::into_error)?;
    write_whole(&folder.join(LOG), &String::from_utf8(bytes)?)
}
