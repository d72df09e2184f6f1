//! What a run comes to along its course: in which turn what happened.

use serde::{Deserialize, Serialize};

use super::{InputWeights, LTR_LIFT_OFF};
use crate::run_log::LogRow;

/// A speed no farther than this from its reference has recovered, km/h.
pub const SPEED_RECOVERED_KMH: f64 = 1.0;

/// Where on the course a run did what. Turns count from 1; a turn lasts until the next one begins,
/// because the vehicle still rolls when the road is straight again.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct CourseMeasures {
    /// Turns of the course.
    pub turns: usize,
    /// Turn at the end of the run; 0 before the first.
    pub end_turn: usize,
    /// Time at which |LTR| first exceeded 1, s.
    pub violation_first_s: Option<f64>,
    /// Turn in which it did; 0 before the first.
    pub violation_first_turn: Option<usize>,
    /// Part of the cost that arose before the last turn; absent as the cost is.
    pub cost_before_last_turn: Option<f64>,
    /// Mean speed from the beginning of each turn to its end, all turns together, km/h; absent if none
    /// was reached.
    #[serde(default)]
    pub speed_in_turns_mean_kmh: Option<f64>,
    /// Time from the end of the last turn until the speed stays within [`SPEED_RECOVERED_KMH`] of its
    /// reference, s; absent if it does not, or if the last turn was not passed.
    pub speed_recovery_s: Option<f64>,
}

impl CourseMeasures {
    /// Of a log, with the stations at which each turn begins and ends, m. Rows without a station (a
    /// log from elsewhere) belong to no turn.
    #[must_use]
    pub fn of(rows: &[LogRow], turns_m: &[[f64; 2]], weights: Option<&InputWeights>) -> Self {
        let turn = |row: &LogRow| {
            let station = row.station_m.unwrap_or(0.0);
            turns_m
                .iter()
                .filter(|[begin, _]| station >= *begin)
                .count()
        };
        let violation = rows.iter().find(|row| row.ltr.abs() > LTR_LIFT_OFF);
        let before_last = |row: &&LogRow| turn(row) < turns_m.len();
        let passed = turns_m.last().and_then(|[_, end]| {
            rows.iter()
                .position(|row| row.station_m.is_some_and(|station| station > *end))
        });
        let in_turns: Vec<f64> = rows
            .iter()
            .filter(|row| {
                let within = |station| turns_m.iter().any(|[a, b]| (*a..=*b).contains(&station));
                row.station_m.is_some_and(within)
            })
            .map(|row| row.speed_kmh)
            .collect();
        Self {
            turns: turns_m.len(),
            end_turn: rows.last().map_or(0, turn),
            violation_first_s: violation.map(|row| row.time_s),
            violation_first_turn: violation.map(turn),
            cost_before_last_turn: weights.map(|weights| {
                let rows = rows.iter().filter(before_last);
                rows.map(|row| weights.stage_cost(row)).sum()
            }),
            speed_in_turns_mean_kmh: (!in_turns.is_empty())
                .then(|| in_turns.iter().sum::<f64>() / in_turns.len() as f64),
            speed_recovery_s: passed.and_then(|first| recovery_s(&rows[first..])),
        }
    }
}

/// Time from the first row until the speed stays near its reference.
fn recovery_s(rows: &[LogRow]) -> Option<f64> {
    let away =
        |row: &LogRow| (row.speed_kmh - row.target_speed_reference_kmh).abs() > SPEED_RECOVERED_KMH;
    let stays = rows.iter().rposition(away).map_or(0, |last| last + 1);
    Some(rows.get(stays)?.time_s - rows.first()?.time_s)
}
