//! Checks of the recording's records, and whose ground is whose.

use vehicle_dyn::road::Course;

use super::Scenario;
use super::load::{Check, ScenarioError};

/// Whose ground an error is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GroundOf {
    /// Words before the error's own, which begin with the field `ground`; none for the ground of the
    /// scenario itself.
    pub words: String,
    /// The table that `ground` stands in, with a dot; empty for that of the scenario.
    pub table: String,
}

impl GroundOf {
    /// The ground in a table; an empty name is the scenario itself.
    pub(super) fn table(name: &str) -> Self {
        let table = if name.is_empty() {
            String::new()
        } else {
            format!("{name}.")
        };
        Self {
            words: table.clone(),
            table,
        }
    }
}

impl Check<'_> {
    /// Ranges and lengths of every record. That its ground fits its course is checked later.
    pub(super) fn recording(&self, s: &Scenario) -> Result<(), ScenarioError> {
        for (index, record) in s.records().iter().enumerate() {
            let field = |key: &str| format!("{}.{key}", table(index));
            let ranges = [
                ("duration_s", record.duration_s, s.sample_time_s, 3600.0),
                ("target_speed_kmh", record.target_speed_kmh, 10.0, 250.0),
                (
                    "steering_wheel_noise_deg",
                    record.steering_wheel_noise_deg,
                    0.0,
                    90.0,
                ),
                (
                    "target_speed_noise_kmh",
                    record.target_speed_noise_kmh,
                    0.0,
                    50.0,
                ),
            ];
            for (key, value, low, high) in ranges {
                self.within(&field(key), value, low, high)?;
            }
            self.course(
                &field("course"),
                Course::new(record.course),
                record.duration_s,
                record.target_speed_kmh,
            )?;
        }
        Ok(())
    }
}

/// Whose ground each record runs on, for messages: a ground that fits its own course may not fit the
/// course of a record that takes it over.
pub(super) fn ground_of(s: &Scenario, index: usize) -> GroundOf {
    let own = match index.checked_sub(1) {
        None => s.recording.ground.is_some(),
        Some(more) => s.recording.more[more].ground.is_some(),
    };
    let table = table(index);
    if own {
        return GroundOf::table(&table);
    }
    let taken = if s.recording.ground.is_some() {
        "recording."
    } else {
        ""
    };
    let header = if index == 0 {
        "recording"
    } else {
        "recording.more"
    };
    GroundOf {
        words: format!("{table}.course has no [{header}.ground] of its own: {taken}"),
        table: taken.to_owned(),
    }
}

/// Name of the table of a record.
fn table(index: usize) -> String {
    match index.checked_sub(1) {
        None => "recording".to_owned(),
        Some(more) => format!("recording.more[{more}]"),
    }
}
