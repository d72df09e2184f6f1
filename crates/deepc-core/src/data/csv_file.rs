//! Records from and to comma-separated files.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

use faer::Mat;
use serde::{Deserialize, Serialize};

use super::dataset::{Dataset, Origin, Record};
use super::error::{DataError, SamplePlace};

/// How far a time stamp may stand from the uniform grid `t_0` + k·Ts, as a fraction of Ts.
/// Room for stamps rounded when printed; a lost or repeated sample is 100 times as far.
const TIME_TOLERANCE: f64 = 0.01;

/// When the outputs of a row were measured, relative to the inputs of the same row.
///
/// `DeePC` pairs u(k), held over `[t_k, t_k + Ts)`, with what is measured at the **end** of that
/// interval. A recording that pairs it with what was measured at the start teaches the controller
/// that its inputs act a sample later than they do, and it overreacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputTiming {
    /// At the end of the interval over which the row's inputs were applied.
    EndOfInterval,
    /// When the row's inputs began to be applied, as in most logs that write all they know at one
    /// instant. The inputs and disturbances of a row are then paired with the outputs of the next
    /// one; the first outputs and the last inputs and disturbances are dropped.
    StartOfInterval,
}

/// Which columns of a comma-separated file are the time, the inputs, the measured disturbances and
/// the outputs.
///
/// The file has one header line; it may have further columns, and its columns may stand in
/// any order. Time stamps, if there are any, are in seconds and must lie on `t_0` +
/// k·Ts to within 1 % of Ts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CsvLayout {
    /// Name of the time column (seconds). `None` (left out of a file): there is none, and the rows are
    /// Ts apart because you say so.
    #[serde(default)]
    pub time: Option<String>,
    /// Names of the input columns; they become the input channels, in this order.
    pub inputs: Vec<String>,
    /// Names of the columns of measured disturbances, in this order; none if left out.
    #[serde(default)]
    pub disturbances: Vec<String>,
    /// Names of the output columns; they become the output channels, in this order.
    pub outputs: Vec<String>,
    /// When the outputs of a row were measured.
    pub outputs_measured: OutputTiming,
    /// Sample time Ts in seconds.
    pub sample_time_s: f64,
}

impl Dataset {
    /// Reads one record per file.
    ///
    /// # Errors
    /// A file cannot be read, lacks a named column, names one twice, holds something that is
    /// not a finite number in one, has no samples, or its time stamps are not uniform.
    pub fn read_csv<P: AsRef<Path>>(layout: &CsvLayout, files: &[P]) -> Result<Self, DataError> {
        let mut data = Self::with_disturbances(
            layout.sample_time_s,
            &layout.inputs,
            &layout.disturbances,
            &layout.outputs,
        )?;
        for path in files {
            let name = path.as_ref().display().to_string();
            let file = File::open(path).map_err(|source| DataError::Io {
                action: "open",
                file: name.clone(),
                source,
            })?;
            data.push_csv(
                BufReader::new(file),
                &name,
                layout.time.as_deref(),
                layout.outputs_measured,
            )?;
        }
        Ok(data)
    }

    /// Reads one record from `reader`; `name` stands for it in messages. The columns are found
    /// by this data set's channel names. Without a `time_column` the rows are taken to be Ts apart.
    ///
    /// # Errors
    /// As [`Dataset::read_csv`].
    pub fn push_csv<R: Read>(
        &mut self,
        reader: R,
        name: &str,
        time_column: Option<&str>,
        outputs_measured: OutputTiming,
    ) -> Result<(), DataError> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(reader);
        let broken = |source| DataError::Csv {
            file: name.into(),
            source,
        };
        let header = reader.headers().map_err(broken)?.clone();
        if header.iter().all(str::is_empty) {
            return Err(DataError::EmptyFile { file: name.into() });
        }
        let column = |wanted: &str| find_column(&header, wanted, name);
        let time = match time_column {
            Some(name) => Some((name, column(name)?)),
            None => None,
        };
        let columns = |names: &[String]| -> Result<Vec<_>, _> {
            names.iter().map(|name| column(name)).collect()
        };
        let mut inputs = Signals::of(columns(self.input_names())?);
        let mut disturbances = Signals::of(columns(self.disturbance_names())?);
        let mut outputs = Signals::of(columns(self.output_names())?);

        let mut lines = Vec::new();
        let mut clock = Clock::new(self.sample_time_s(), self.records().len() + 1);
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row).map_err(broken)? {
            let line = row.position().map_or(0, csv::Position::line);
            let number = |index: usize| {
                let text = row.get(index).unwrap_or_default();
                text.parse::<f64>().map_err(|_| DataError::NotANumber {
                    file: name.into(),
                    line,
                    column: header.get(index).unwrap_or_default().into(),
                    text: text.into(),
                })
            };
            if let Some((column, index)) = time {
                clock.check(number(index)?, line, name, column)?;
            }
            for signals in [&mut inputs, &mut disturbances, &mut outputs] {
                for &index in &signals.columns {
                    signals.values.push(number(index)?);
                }
            }
            lines.push(line);
        }
        if lines.is_empty() {
            return Err(DataError::HeaderOnly { file: name.into() });
        }
        let outputs_later = match outputs_measured {
            OutputTiming::EndOfInterval => 0,
            OutputTiming::StartOfInterval => 1,
        };
        let samples = lines.len() - outputs_later;
        self.push_from(
            Record {
                inputs: inputs.series(0, samples),
                disturbances: disturbances.series(0, samples),
                outputs: outputs.series(outputs_later, samples),
            },
            Origin {
                file: Some(name),
                lines: Some(&lines),
                outputs_later,
            },
        )
    }

    /// Writes record number `record` (from 1) with time stamps k·Ts. Numbers are printed so
    /// that reading them gives the same bits.
    ///
    /// # Errors
    /// There is no such record, or the file cannot be written.
    pub fn write_csv(
        &self,
        record: usize,
        path: impl AsRef<Path>,
        time_column: &str,
    ) -> Result<(), DataError> {
        let name = path.as_ref().display().to_string();
        let file = File::create(path).map_err(|source| DataError::Io {
            action: "write",
            file: name.clone(),
            source,
        })?;
        self.write_csv_to(record, BufWriter::new(file), &name, time_column)
    }

    /// Writes record number `record` (from 1) to `writer`; `name` stands for it in messages.
    ///
    /// # Errors
    /// As [`Dataset::write_csv`].
    pub fn write_csv_to<W: Write>(
        &self,
        record: usize,
        writer: W,
        name: &str,
        time_column: &str,
    ) -> Result<(), DataError> {
        let missing = || DataError::NoSuchRecord {
            record,
            available: self.records().len(),
        };
        let index = record.checked_sub(1).ok_or_else(missing)?;
        let samples = self.records().get(index).ok_or_else(missing)?;
        let broken = |source| DataError::Csv {
            file: name.into(),
            source,
        };
        let mut writer = csv::Writer::from_writer(writer);
        let names = self.input_names().iter();
        let names = names.chain(self.disturbance_names());
        let names = names.chain(self.output_names()).map(String::as_str);
        let header = std::iter::once(time_column).chain(names);
        writer.write_record(header).map_err(broken)?;
        for k in 0..samples.samples() {
            let time = k as f64 * self.sample_time_s();
            let values = samples.inputs().row(k).iter();
            let values = values.chain(samples.disturbances().row(k).iter());
            let values = values.chain(samples.outputs().row(k).iter());
            let fields = std::iter::once(time).chain(values.copied());
            let fields = fields.map(|value| value.to_string());
            writer.write_record(fields).map_err(broken)?;
        }
        writer.flush().map_err(|source| DataError::Io {
            action: "write",
            file: name.into(),
            source,
        })
    }
}

/// Columns of a file that make one series.
struct Signals {
    /// Where they stand in the file.
    columns: Vec<usize>,
    /// Row after row.
    values: Vec<f64>,
}

impl Signals {
    fn of(columns: Vec<usize>) -> Self {
        Self {
            columns,
            values: Vec::new(),
        }
    }

    /// `samples` rows from row `first` on, one column per channel.
    fn series(&self, first: usize, samples: usize) -> Mat<f64> {
        let channels = self.columns.len();
        Mat::from_fn(samples, channels, |k, i| {
            self.values[(first + k) * channels + i]
        })
    }
}

fn find_column(header: &csv::StringRecord, wanted: &str, file: &str) -> Result<usize, DataError> {
    let mut places = header
        .iter()
        .enumerate()
        .filter(|(_, name)| *name == wanted);
    let Some((index, _)) = places.next() else {
        return Err(DataError::MissingColumn {
            file: file.into(),
            column: wanted.into(),
            found: header.iter().map(Into::into).collect(),
        });
    };
    if places.next().is_some() {
        return Err(DataError::DuplicateColumn {
            file: file.into(),
            column: wanted.into(),
        });
    }
    Ok(index)
}

/// Holds time stamps to the grid that the first one starts.
struct Clock {
    sample_time_s: f64,
    record: usize,
    start_s: Option<f64>,
    sample: usize,
}

impl Clock {
    fn new(sample_time_s: f64, record: usize) -> Self {
        Self {
            sample_time_s,
            record,
            start_s: None,
            sample: 0,
        }
    }

    fn check(&mut self, found: f64, line: u64, file: &str, column: &str) -> Result<(), DataError> {
        if !found.is_finite() {
            return Err(DataError::NotFinite {
                channel: column.into(),
                value: found,
                place: SamplePlace {
                    record: self.record,
                    sample: self.sample,
                    line: Some(line),
                    file: Some(file.into()),
                },
            });
        }
        let start_s = *self.start_s.get_or_insert(found);
        let expected = start_s + self.sample as f64 * self.sample_time_s;
        // The second term is the resolution of a stamp as large as this one.
        let tolerance = TIME_TOLERANCE * self.sample_time_s + 4.0 * f64::EPSILON * found.abs();
        if (found - expected).abs() > tolerance {
            return Err(DataError::NonUniformTime {
                file: file.into(),
                line,
                expected,
                found,
                sample_time_s: self.sample_time_s,
            });
        }
        self.sample += 1;
        Ok(())
    }
}
