//! The data set: one clock, named channels, finite records.

use std::collections::HashSet;

use faer::{Mat, MatRef};

use super::error::{DataError, SamplePlace};

/// One uninterrupted recording: (u(k), d(k), y(k)) per row, where u(k) and the measured disturbance
/// d(k) act over `[t_k, t_k + Ts)` and y(k) is measured at the end of that interval.
#[derive(Debug, Clone)]
pub struct Record {
    pub(super) inputs: Mat<f64>,
    pub(super) disturbances: Mat<f64>,
    pub(super) outputs: Mat<f64>,
}

impl Record {
    /// Inputs, T×m: rows are time, columns channels.
    #[must_use]
    pub fn inputs(&self) -> MatRef<'_, f64> {
        self.inputs.as_ref()
    }

    /// Measured disturbances, T×q: rows are time, columns channels. q may be 0.
    #[must_use]
    pub fn disturbances(&self) -> MatRef<'_, f64> {
        self.disturbances.as_ref()
    }

    /// Outputs, T×p: rows are time, columns channels.
    #[must_use]
    pub fn outputs(&self) -> MatRef<'_, f64> {
        self.outputs.as_ref()
    }

    /// Number of samples T.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.inputs.nrows()
    }

    /// All channels one after the other: inputs, disturbances, outputs.
    pub(crate) fn channels(&self) -> Vec<&[f64]> {
        let signals = [&self.inputs, &self.disturbances, &self.outputs];
        let columns = signals.into_iter().flat_map(|series| {
            let columns = 0..series.ncols();
            columns.map(|channel| series.col_as_slice(channel))
        });
        columns.collect()
    }
}

/// Where the samples of a record came from, for error messages.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct Origin<'a> {
    pub file: Option<&'a str>,
    /// Line of each row of the file.
    pub lines: Option<&'a [u64]>,
    /// Rows between the inputs of a sample and its outputs.
    pub outputs_later: usize,
}

/// Recorded inputs and outputs of one plant: a sample time, m named input channels, q ≥ 0 named
/// channels of measured disturbances, p named output channels and any number of [`Record`]s. All
/// values are finite.
///
/// A measured disturbance is exogenous: it acts on the plant as an input does, but nobody decides
/// it. The controller is told its past, and its future or a forecast of it.
///
/// ```
/// use deepc_core::data::Dataset;
/// use faer::mat;
///
/// let mut data = Dataset::new(0.1, ["valve"], ["level", "flow"])?;
/// data.push_record(mat![[0.0], [1.0]], mat![[0.2, 0.0], [0.3, 0.1]])?;
/// assert_eq!((data.inputs(), data.outputs(), data.samples()), (1, 2, 2));
/// # Ok::<(), deepc_core::data::DataError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Dataset {
    sample_time_s: f64,
    input_names: Vec<String>,
    disturbance_names: Vec<String>,
    output_names: Vec<String>,
    records: Vec<Record>,
}

impl Dataset {
    /// An empty data set without measured disturbances (q = 0).
    ///
    /// # Errors
    /// The sample time is not a finite value above 0, a list of names is empty, or a name is
    /// empty or used twice (inputs and outputs together).
    pub fn new(
        sample_time_s: f64,
        input_names: impl IntoIterator<Item = impl AsRef<str>>,
        output_names: impl IntoIterator<Item = impl AsRef<str>>,
    ) -> Result<Self, DataError> {
        let no_names: [&str; 0] = [];
        Self::with_disturbances(sample_time_s, input_names, no_names, output_names)
    }

    /// An empty data set of a plant with measured disturbances. `disturbance_names` may be empty.
    ///
    /// ```
    /// use deepc_core::data::Dataset;
    /// use faer::mat;
    ///
    /// let mut data = Dataset::with_disturbances(60.0, ["heating"], ["outside"], ["room"])?;
    /// let (heating, outside, room) = (mat![[0.0], [1.0]], mat![[5.0], [4.5]], mat![[19.0], [19.2]]);
    /// data.push_record_with_disturbances(heating, outside, room)?;
    /// assert_eq!((data.inputs(), data.disturbances(), data.outputs()), (1, 1, 1));
    /// # Ok::<(), deepc_core::data::DataError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Dataset::new`]; names must differ among all channels together.
    pub fn with_disturbances(
        sample_time_s: f64,
        input_names: impl IntoIterator<Item = impl AsRef<str>>,
        disturbance_names: impl IntoIterator<Item = impl AsRef<str>>,
        output_names: impl IntoIterator<Item = impl AsRef<str>>,
    ) -> Result<Self, DataError> {
        if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
            return Err(DataError::SampleTime {
                found: sample_time_s,
            });
        }
        let input_names = owned(input_names);
        let disturbance_names = owned(disturbance_names);
        let output_names = owned(output_names);
        let groups = [
            ("input", &input_names),
            ("disturbance", &disturbance_names),
            ("output", &output_names),
        ];
        let mut seen = HashSet::new();
        for (kind, names) in groups {
            if names.is_empty() && kind != "disturbance" {
                return Err(DataError::NoChannels { kind });
            }
            for (index, name) in names.iter().enumerate() {
                if name.trim().is_empty() {
                    return Err(DataError::UnnamedChannel { kind, index });
                }
                if !seen.insert(name.as_str()) {
                    return Err(DataError::DuplicateChannel { name: name.clone() });
                }
            }
        }
        Ok(Self {
            sample_time_s,
            input_names,
            disturbance_names,
            output_names,
            records: Vec::new(),
        })
    }

    /// Adds a record: `inputs` T×m, `outputs` T×p, rows are time. Row k of the outputs was measured
    /// at the **end** of the interval over which row k of the inputs was applied.
    ///
    /// # Errors
    /// Wrong number of columns, different numbers of rows, no rows, a value that is NaN or
    /// infinite, or the data set has measured disturbances. The data set is unchanged then.
    pub fn push_record(&mut self, inputs: Mat<f64>, outputs: Mat<f64>) -> Result<(), DataError> {
        let disturbances = Mat::zeros(inputs.nrows(), 0);
        self.push_record_with_disturbances(inputs, disturbances, outputs)
    }

    /// Adds a record: `inputs` T×m, `disturbances` T×q, `outputs` T×p, rows are time. Row k of the
    /// disturbances acted over the same interval as row k of the inputs; row k of the outputs was
    /// measured at its **end**.
    ///
    /// # Errors
    /// Wrong number of columns, different numbers of rows, no rows, or a value that is NaN or
    /// infinite. The data set is unchanged then.
    pub fn push_record_with_disturbances(
        &mut self,
        inputs: Mat<f64>,
        disturbances: Mat<f64>,
        outputs: Mat<f64>,
    ) -> Result<(), DataError> {
        let record = Record {
            inputs,
            disturbances,
            outputs,
        };
        self.push_from(record, Origin::default())
    }

    /// Adds a record from flat rows, time-major: `inputs` holds u(0), u(1), … one after the
    /// other (T·m values), `outputs` y(0), y(1), … (T·p values).
    ///
    /// # Errors
    /// As [`Dataset::push_record`], and if a length is not a multiple of the channel count.
    pub fn push_rows(&mut self, inputs: &[f64], outputs: &[f64]) -> Result<(), DataError> {
        let record = self.records.len() + 1;
        for (kind, channels, values) in [
            ("input", self.inputs(), inputs.len()),
            ("output", self.outputs(), outputs.len()),
        ] {
            if values % channels != 0 {
                return Err(DataError::RaggedRows {
                    record,
                    kind,
                    channels,
                    values,
                });
            }
        }
        let series = |values: &[f64], channels: usize| {
            MatRef::from_row_major_slice(values, values.len() / channels, channels).to_owned()
        };
        self.push_record(
            series(inputs, self.inputs()),
            series(outputs, self.outputs()),
        )
    }

    pub(super) fn push_from(
        &mut self,
        samples: Record,
        origin: Origin<'_>,
    ) -> Result<(), DataError> {
        let record = self.records.len() + 1;
        let length = samples.samples();
        for (kind, expected, series) in [
            ("input", self.inputs(), samples.inputs()),
            ("disturbance", self.disturbances(), samples.disturbances()),
            ("output", self.outputs(), samples.outputs()),
        ] {
            if expected != series.ncols() {
                return Err(DataError::ChannelCount {
                    record,
                    kind,
                    expected,
                    found: series.ncols(),
                });
            }
            if length != series.nrows() {
                return Err(DataError::LengthMismatch {
                    record,
                    inputs: length,
                    kind,
                    found: series.nrows(),
                });
            }
        }
        if length == 0 {
            return Err(DataError::EmptyRecord {
                record,
                file: origin.file.map(Into::into),
            });
        }
        self.check_finite(&samples, origin)?;
        self.records.push(samples);
        Ok(())
    }

    fn check_finite(&self, samples: &Record, origin: Origin<'_>) -> Result<(), DataError> {
        // Row by row, so that the first bad sample in time is the one reported.
        for sample in 0..samples.samples() {
            let groups = [
                (samples.inputs(), &self.input_names, 0),
                (samples.disturbances(), &self.disturbance_names, 0),
                (samples.outputs(), &self.output_names, origin.outputs_later),
            ];
            for (series, names, later) in groups {
                for (channel, &value) in names.iter().zip(series.row(sample).iter()) {
                    if value.is_finite() {
                        continue;
                    }
                    let line = |lines: &[u64]| lines.get(sample + later).copied();
                    return Err(DataError::NotFinite {
                        channel: channel.clone(),
                        value,
                        place: SamplePlace {
                            record: self.records.len() + 1,
                            sample,
                            line: origin.lines.and_then(line),
                            file: origin.file.map(Into::into),
                        },
                    });
                }
            }
        }
        Ok(())
    }

    /// Adds the records of another data set of the same plant.
    ///
    /// # Errors
    /// Sample times or channel names (in order) differ.
    pub fn append(&mut self, other: Self) -> Result<(), DataError> {
        if !super::same_sample_time(self.sample_time_s, other.sample_time_s) {
            return Err(DataError::SampleTimesDiffer {
                expected: self.sample_time_s,
                found: other.sample_time_s,
            });
        }
        for (kind, expected, found) in [
            ("input", &self.input_names, &other.input_names),
            (
                "disturbance",
                &self.disturbance_names,
                &other.disturbance_names,
            ),
            ("output", &self.output_names, &other.output_names),
        ] {
            if expected != found {
                return Err(DataError::ChannelsDiffer {
                    kind,
                    expected: expected.clone(),
                    found: found.clone(),
                });
            }
        }
        self.records.extend(other.records);
        Ok(())
    }

    /// Sample time Ts in seconds.
    #[must_use]
    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Number of input channels m.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.input_names.len()
    }

    /// Number of measured disturbances q.
    #[must_use]
    pub fn disturbances(&self) -> usize {
        self.disturbance_names.len()
    }

    /// Number of output channels p.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.output_names.len()
    }

    /// Input channel names, in column order.
    #[must_use]
    pub fn input_names(&self) -> &[String] {
        &self.input_names
    }

    /// Names of the measured disturbances, in column order.
    #[must_use]
    pub fn disturbance_names(&self) -> &[String] {
        &self.disturbance_names
    }

    /// Output channel names, in column order.
    #[must_use]
    pub fn output_names(&self) -> &[String] {
        &self.output_names
    }

    /// The records.
    #[must_use]
    pub fn records(&self) -> &[Record] {
        &self.records
    }

    /// Samples of all records together.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.records.iter().map(Record::samples).sum()
    }
}

fn owned(names: impl IntoIterator<Item = impl AsRef<str>>) -> Vec<String> {
    let names = names.into_iter();
    names.map(|name| name.as_ref().to_owned()).collect()
}
