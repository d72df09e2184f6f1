//! Reading logs of any origin: what can be read is kept, the rest is named.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::{Error as ValueError, StrDeserializer};

use super::data::{Columns, Problem};
use crate::run_log::SolveStatus;

/// The column without which a log has no time axis.
pub const TIME: &str = "time_s";
/// The one column that holds words; it is kept as the number of the word in [`STATUS_NAMES`].
pub const STATUS: &str = "solve_status";
/// Columns that a log may have, in the order in which this program writes them. All but [`TIME`]
/// may be missing.
pub const COLUMN_NAMES: [&str; 28] = [
    TIME,
    "steering_wheel_deg",
    "target_speed_kmh",
    "steering_wheel_reference_deg",
    "target_speed_reference_kmh",
    "ltr",
    "ltr_measured",
    "load_transfer_index",
    "lateral_acceleration_m_s2",
    "yaw_rate_deg_s",
    "roll_rate_deg_s",
    "two_wheel_clearance_m",
    "load_front_left_n",
    "load_front_right_n",
    "load_rear_left_n",
    "load_rear_right_n",
    "roll_deg",
    "speed_kmh",
    "path_deviation_m",
    "station_m",
    "x_m",
    "y_m",
    "yaw_deg",
    "sideslip_deg",
    STATUS,
    "predicted_violation",
    "iterations",
    "step_time_us",
];

/// The words of [`STATUS`], numbered from 0.
pub const STATUS_NAMES: [(&str, SolveStatus); 8] = [
    ("passthrough", SolveStatus::Passthrough),
    ("unconstrained", SolveStatus::Unconstrained),
    ("solved", SolveStatus::Solved),
    ("solved_by_second", SolveStatus::SolvedBySecond),
    ("plan", SolveStatus::Plan),
    ("fallback_plan", SolveStatus::FallbackPlan),
    ("fallback_hold", SolveStatus::FallbackHold),
    ("fallback_user", SolveStatus::FallbackUser),
];

/// Names of columns in the reader's files, by ours.
pub type Renamed = BTreeMap<String, String>;

/// What was read of a log.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Its columns; empty if nothing could be read.
    pub columns: Columns,
    /// What is wrong with it.
    pub problems: Vec<Problem>,
}

impl Table {
    /// Rows read.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.get(TIME).map_or(0, Vec::len)
    }
}

/// Reads what can be read of a log. A column that `renamed` maps is looked for under the reader's
/// name; columns that are not in [`COLUMN_NAMES`] are passed over.
#[must_use]
pub fn read(path: &Path, renamed: &Renamed) -> Table {
    let file = path.display().to_string();
    match std::fs::read(path) {
        Ok(bytes) => parse(&file, &bytes, renamed),
        Err(error) => Table {
            problems: vec![Problem {
                file,
                line: None,
                reason: format!("cannot be read ({error}); left out"),
            }],
            ..Table::default()
        },
    }
}

/// [`read`] on the contents of a file.
#[must_use]
pub fn parse(file: &str, bytes: &[u8], renamed: &Renamed) -> Table {
    let mut found = Reading::new(file);
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if bytes.trim_ascii().is_empty() {
        found.note(None, "is empty; left out");
    } else if bytes[..bytes.len().min(4096)].contains(&0) {
        found.note(None, "is not text but binary; left out");
    } else {
        found.rows(bytes, renamed);
    }
    found.finish()
}

struct Reading<'a> {
    file: &'a str,
    columns: Columns,
    /// Problems by kind, with the line of the first and how many there are.
    problems: Vec<(Option<u64>, String, usize)>,
}

impl<'a> Reading<'a> {
    fn new(file: &'a str) -> Self {
        Self {
            file,
            columns: Columns::new(),
            problems: Vec::new(),
        }
    }

    fn note(&mut self, line: Option<u64>, reason: impl Into<String>) {
        let reason = reason.into();
        match self.problems.iter_mut().find(|(_, r, _)| *r == reason) {
            Some((_, _, count)) => *count += 1,
            None => self.problems.push((line, reason, 1)),
        }
    }

    fn finish(mut self) -> Table {
        if self.columns.get(TIME).is_some_and(Vec::is_empty) {
            self.columns.clear();
            if self.problems.is_empty() {
                self.note(None, "holds a header and no rows; left out");
            }
        }
        let problem = |(line, reason, count): (Option<u64>, String, usize)| Problem {
            file: self.file.to_owned(),
            line,
            reason: match count {
                1 => reason,
                _ => format!("{reason} (the first of {count} such lines)"),
            },
        };
        Table {
            problems: self.problems.into_iter().map(problem).collect(),
            columns: self.columns,
        }
    }

    fn rows(&mut self, bytes: &[u8], renamed: &Renamed) {
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .trim(csv::Trim::All)
            .delimiter(delimiter(bytes))
            .from_reader(bytes);
        let header: Vec<String> = match reader.byte_headers() {
            Ok(names) => names
                .iter()
                .map(|name| String::from_utf8_lossy(name).into_owned())
                .collect(),
            Err(error) => return self.note(Some(1), format!("has no header ({error}); left out")),
        };
        let Some(places) = self.places(&header, renamed) else {
            return;
        };
        // Our own files end every row with a line break, so that half a last number shows.
        let whole = bytes.ends_with(b"\n") || header.last().is_none_or(|n| n != "step_time_us");
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); places.len()];
        let mut record = csv::ByteRecord::new();
        loop {
            match reader.read_byte_record(&mut record) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    self.note(
                        Some(reader.position().line()),
                        format!("{error}; this line is left out"),
                    );
                    continue;
                }
            }
            let line = record.position().map_or(0, csv::Position::line);
            if record.len() < header.len() {
                let reason = format!(
                    "has {} of {} fields; this line is left out, the others are shown",
                    record.len(),
                    header.len()
                );
                self.note(Some(line), reason);
                continue;
            }
            if !whole && reader.position().byte() >= bytes.len() as u64 {
                self.note(
                    Some(line),
                    "does not end; this line is left out, the others are shown",
                );
                continue;
            }
            self.row(&record, line, &places, &mut values);
        }
        for ((name, _), column) in places.iter().zip(values) {
            // A column without a single number says nothing.
            if *name == TIME || column.iter().any(|v| v.is_finite()) {
                self.columns.insert((*name).to_owned(), column);
            }
        }
    }

    /// Where our columns are, time first.
    fn places(
        &mut self,
        header: &[String],
        renamed: &Renamed,
    ) -> Option<Vec<(&'static str, usize)>> {
        let place = |name: &&'static str| {
            let theirs = renamed.get(*name).map_or(*name, String::as_str);
            Some((*name, header.iter().position(|h| h == theirs)?))
        };
        let places: Vec<_> = COLUMN_NAMES.iter().filter_map(place).collect();
        if places.first().is_some_and(|(name, _)| *name == TIME) && places.len() > 1 {
            return Some(places);
        }
        let names = header
            .iter()
            .take(12)
            .cloned()
            .collect::<Vec<_>>()
            .join(", ");
        let reason = if places.iter().any(|(name, _)| *name == TIME) {
            format!(
                "has no column of a log beside `{TIME}` but {names}; name them with --column OURS=THEIRS; left out"
            )
        } else {
            let theirs = renamed.get(TIME).map_or(TIME, String::as_str);
            format!(
                "has no column `{theirs}` but {names}; name it with --column {TIME}=THEIRS; left out"
            )
        };
        self.note(Some(1), reason);
        None
    }

    fn row(
        &mut self,
        record: &csv::ByteRecord,
        line: u64,
        places: &[(&'static str, usize)],
        values: &mut [Vec<f64>],
    ) {
        let cell = |place: usize| std::str::from_utf8(&record[place]).unwrap_or("\u{fffd}");
        let time = number(cell(places[0].1)).unwrap_or(f64::NAN);
        let last = values[0].last().copied();
        if !time.is_finite() {
            return self.note(Some(line), "has no time; this line is left out");
        }
        if last.is_some_and(|last| time <= last) {
            return self.note(
                Some(line),
                "is not later than the line before it; this line is left out",
            );
        }
        for (&(name, place), column) in places.iter().zip(values) {
            let text = cell(place);
            let value = if name == STATUS {
                status_code(text)
            } else {
                number(text)
            };
            if value.is_none() {
                self.note(
                    Some(line),
                    format!("the column `{name}` holds no number; a gap stands for it"),
                );
            }
            column.push(value.filter(|v| v.is_finite()).unwrap_or(f64::NAN));
        }
    }
}

/// Comma, unless the header has more semicolons or tabs.
fn delimiter(bytes: &[u8]) -> u8 {
    let header = bytes.split(|b| *b == b'\n').next().unwrap_or(bytes);
    let count = |byte: u8| header.split(|b| *b == byte).count();
    [b',', b';', b'\t']
        .into_iter()
        .rev()
        .max_by_key(|byte| count(*byte))
        .unwrap_or(b',')
}

/// A number, not a number where nothing is written, or `None` for anything else.
fn number(text: &str) -> Option<f64> {
    if text.is_empty() {
        return Some(f64::NAN);
    }
    text.parse().ok()
}

fn status_code(text: &str) -> Option<f64> {
    if text.is_empty() {
        return Some(f64::NAN);
    }
    let name: StrDeserializer<'_, ValueError> = text.into_deserializer();
    let status = SolveStatus::deserialize(name).ok()?;
    let code = STATUS_NAMES.iter().position(|(_, s)| *s == status)?;
    Some(code as f64)
}
