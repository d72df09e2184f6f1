//! What can be wrong with recorded data.

use std::fmt;

use thiserror::Error;

/// Where a sample stands. Records count from 1 (as people count files), samples from 0 (as
/// the signals u(0), u(1), …), lines from 1 (as editors do; line 1 is the header).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SamplePlace {
    /// Record number, from 1.
    pub record: usize,
    /// Sample number within the record, from 0.
    pub sample: usize,
    /// Line of the file the record came from, if it came from one.
    pub line: Option<u64>,
    /// Name of the file the record came from, if it came from one.
    pub file: Option<String>,
}

impl fmt::Display for SamplePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "sample {}", self.sample)?;
        if let Some(line) = self.line {
            write!(f, " (line {line})")?;
        }
        write!(f, " of record {}", self.record)?;
        if let Some(file) = &self.file {
            write!(f, " (`{file}`)")?;
        }
        Ok(())
    }
}

/// Error of the data stage.
#[derive(Debug, Error)]
pub enum DataError {
    /// The sample time is zero, negative or not finite.
    #[error("sample time is {found} s; give a finite value above 0")]
    SampleTime {
        /// The value given, in seconds.
        found: f64,
    },
    /// No input or no output channel was named.
    #[error("no {kind} channel is named; name at least one")]
    NoChannels {
        /// `input` or `output`.
        kind: &'static str,
    },
    /// A channel has an empty name.
    #[error("{kind} channel {index} (from 0) has an empty name; give every channel a name")]
    UnnamedChannel {
        /// `input`, `disturbance` or `output`.
        kind: &'static str,
        /// Position in the list of names, from 0.
        index: usize,
    },
    /// Two channels share a name.
    #[error("channel name `{name}` is used twice; every channel needs its own name")]
    DuplicateChannel {
        /// The repeated name.
        name: String,
    },
    /// A value is NaN or infinite.
    #[error("channel `{channel}` is {value} at {place}; repair or cut the record")]
    NotFinite {
        /// Channel (or time column) name.
        channel: String,
        /// What was found: `NaN`, `inf` or `-inf`.
        value: f64,
        /// Where.
        place: SamplePlace,
    },
    /// A record has no sample.
    #[error("record {record}{file} has no samples; leave it out", file = of_file(file.as_deref()))]
    EmptyRecord {
        /// Record number, from 1.
        record: usize,
        /// Name of the file, if the record came from one.
        file: Option<String>,
    },
    /// A record's matrix does not have one column per channel.
    #[error(
        "record {record} has {found} {kind} columns, expected {expected} \
         (rows are time, columns channels); give one column per channel"
    )]
    ChannelCount {
        /// Record number, from 1.
        record: usize,
        /// `input`, `disturbance` or `output`.
        kind: &'static str,
        /// Channels of the data set.
        expected: usize,
        /// Columns found.
        found: usize,
    },
    /// Flat rows do not divide into whole samples.
    #[error(
        "record {record} has {values} {kind} values, not a multiple of {channels} channels; \
         give whole samples, one after the other"
    )]
    RaggedRows {
        /// Record number, from 1.
        record: usize,
        /// `input`, `disturbance` or `output`.
        kind: &'static str,
        /// Channels of the data set.
        channels: usize,
        /// Values given.
        values: usize,
    },
    /// The signals of a record differ in length.
    #[error(
        "record {record} has {inputs} input samples and {found} {kind} samples; \
         both must cover the same sample instants"
    )]
    LengthMismatch {
        /// Record number, from 1.
        record: usize,
        /// Rows of the input matrix.
        inputs: usize,
        /// `disturbance` or `output`.
        kind: &'static str,
        /// Rows of that matrix.
        found: usize,
    },
    /// Two data sets do not share one clock.
    #[error("sample times differ: expected {expected} s, found {found} s; resample one of them")]
    SampleTimesDiffer {
        /// Sample time of the data set appended to, in seconds.
        expected: f64,
        /// Sample time of the data set appended, in seconds.
        found: f64,
    },
    /// Two data sets do not share their channels.
    #[error(
        "{kind} channels differ: expected {expected:?}, found {found:?}; \
         records of one data set have the same channels in the same order"
    )]
    ChannelsDiffer {
        /// `input`, `disturbance` or `output`.
        kind: &'static str,
        /// Channels of the data set appended to.
        expected: Vec<String>,
        /// Channels of the data set appended.
        found: Vec<String>,
    },
    /// A record number is out of range.
    #[error("record {record} does not exist; the data set has {available} (counted from 1)")]
    NoSuchRecord {
        /// The number asked for, from 1.
        record: usize,
        /// Number of records.
        available: usize,
    },
    /// A file could not be opened, read or written.
    #[error("cannot {action} `{file}`")]
    Io {
        /// `open`, `read` or `write`.
        action: &'static str,
        /// File name.
        file: String,
        /// Cause.
        source: std::io::Error,
    },
    /// The CSV reader gave up (ragged rows, invalid UTF-8, …).
    #[error("`{file}` is not a readable comma-separated file")]
    Csv {
        /// File name.
        file: String,
        /// Cause, with its line.
        source: csv::Error,
    },
    /// The file has no header line.
    #[error("`{file}` is empty; expected a header line with the column names")]
    EmptyFile {
        /// File name.
        file: String,
    },
    /// The file has a header line and nothing else.
    #[error("`{file}` has a header line but no samples; record some, or leave the file out")]
    HeaderOnly {
        /// File name.
        file: String,
    },
    /// A named column is not in the file.
    #[error(
        "`{file}` has no column `{column}`; its columns are {found:?} \
         (columns are separated by commas)"
    )]
    MissingColumn {
        /// File name.
        file: String,
        /// The column asked for.
        column: String,
        /// The columns in the header.
        found: Vec<String>,
    },
    /// A named column occurs twice in the header.
    #[error("`{file}` has the column `{column}` more than once; rename or remove one")]
    DuplicateColumn {
        /// File name.
        file: String,
        /// The repeated column.
        column: String,
    },
    /// A field is not a number.
    #[error("`{file}`, line {line}, column `{column}`: `{text}` is not a number; repair the field")]
    NotANumber {
        /// File name.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Column name.
        column: String,
        /// The text found.
        text: String,
    },
    /// A time stamp is off the uniform grid.
    #[error(
        "`{file}`, line {line}: time is {found} s, expected {expected} s for a sample time of \
         {sample_time_s} s; check the sample time, \
         sort and resample the recording, or split it into records at the gap"
    )]
    NonUniformTime {
        /// File name.
        file: String,
        /// Line, from 1.
        line: u64,
        /// The time stamp expected, in seconds.
        expected: f64,
        /// The time stamp found, in seconds.
        found: f64,
        /// Sample time, in seconds.
        sample_time_s: f64,
    },
}

fn of_file(file: Option<&str>) -> String {
    file.map(|name| format!(" (`{name}`)")).unwrap_or_default()
}
