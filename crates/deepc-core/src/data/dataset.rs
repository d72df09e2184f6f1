//! The data set: one clock, named channels, finite records.

use std::collections::HashSet;

use faer::{Mat, MatRef};

use super::error::{DataError, SamplePlace};

/// One uninterrupted recording: the pair (u(k), y(k)) per row, where u(k) is applied over
/// `[t_k, t_k + Ts)` and y(k) is measured at the end of that interval.
#[derive(Debug, Clone)]
pub struct Record {
    inputs: Mat<f64>,
    outputs: Mat<f64>,
}

impl Record {
    /// Inputs, T×m: rows are time, columns channels.
    #[must_use]
    pub fn inputs(&self) -> MatRef<'_, f64> {
        self.inputs.as_ref()
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

/// Recorded inputs and outputs of one plant: a sample time, m named input channels, p named
/// output channels and any number of [`Record`]s. All values are finite.
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
    output_names: Vec<String>,
    records: Vec<Record>,
}

impl Dataset {
    /// An empty data set.
    ///
    /// # Errors
    /// The sample time is not a finite value above 0, a list of names is empty, or a name is
    /// empty or used twice (inputs and outputs together).
    pub fn new(
        sample_time_s: f64,
        input_names: impl IntoIterator<Item = impl AsRef<str>>,
        output_names: impl IntoIterator<Item = impl AsRef<str>>,
    ) -> Result<Self, DataError> {
        if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
            return Err(DataError::SampleTime {
                found: sample_time_s,
            });
        }
        let owned = |name: &str| name.to_owned();
        let input_names: Vec<String> = input_names.into_iter().map(|n| owned(n.as_ref())).collect();
        let output_names: Vec<String> = output_names
            .into_iter()
            .map(|n| owned(n.as_ref()))
            .collect();
        check_names("input", &input_names)?;
        check_names("output", &output_names)?;
        let mut seen = HashSet::new();
        for name in input_names.iter().chain(&output_names) {
            if !seen.insert(name.as_str()) {
                return Err(DataError::DuplicateChannel { name: name.clone() });
            }
        }
        Ok(Self {
            sample_time_s,
            input_names,
            output_names,
            records: Vec::new(),
        })
    }

    /// Adds a record: `inputs` T×m, `outputs` T×p, rows are time. Row k of the outputs was measured
    /// at the **end** of the interval over which row k of the inputs was applied.
    ///
    /// # Errors
    /// Wrong number of columns, different numbers of rows, no rows, or a value that is NaN or
    /// infinite. The data set is unchanged then.
    pub fn push_record(&mut self, inputs: Mat<f64>, outputs: Mat<f64>) -> Result<(), DataError> {
        self.push_from(inputs, outputs, Origin::default())
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
        inputs: Mat<f64>,
        outputs: Mat<f64>,
        origin: Origin<'_>,
    ) -> Result<(), DataError> {
        let record = self.records.len() + 1;
        for (kind, expected, found) in [
            ("input", self.inputs(), inputs.ncols()),
            ("output", self.outputs(), outputs.ncols()),
        ] {
            if expected != found {
                return Err(DataError::ChannelCount {
                    record,
                    kind,
                    expected,
                    found,
                });
            }
        }
        if inputs.nrows() != outputs.nrows() {
            return Err(DataError::LengthMismatch {
                record,
                inputs: inputs.nrows(),
                outputs: outputs.nrows(),
            });
        }
        if inputs.nrows() == 0 {
            return Err(DataError::EmptyRecord {
                record,
                file: origin.file.map(Into::into),
            });
        }
        self.check_finite(&inputs, &outputs, record, origin)?;
        self.records.push(Record { inputs, outputs });
        Ok(())
    }

    fn check_finite(
        &self,
        inputs: &Mat<f64>,
        outputs: &Mat<f64>,
        record: usize,
        origin: Origin<'_>,
    ) -> Result<(), DataError> {
        // Row by row, so that the first bad sample in time is the one reported.
        for sample in 0..inputs.nrows() {
            let input = inputs.row(sample).iter().zip(&self.input_names);
            let output = outputs.row(sample).iter().zip(&self.output_names);
            let values = (input.map(|pair| (pair, sample)))
                .chain(output.map(|pair| (pair, sample + origin.outputs_later)));
            for ((&value, channel), row) in values {
                if !value.is_finite() {
                    return Err(DataError::NotFinite {
                        channel: channel.clone(),
                        value,
                        place: SamplePlace {
                            record,
                            sample,
                            line: origin.lines.and_then(|lines| lines.get(row).copied()),
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
        // Sample times are typed in, not measured: only rounding may separate equal ones.
        let same = (self.sample_time_s - other.sample_time_s).abs() <= 1e-9 * self.sample_time_s;
        if !same {
            return Err(DataError::SampleTimesDiffer {
                expected: self.sample_time_s,
                found: other.sample_time_s,
            });
        }
        for (kind, expected, found) in [
            ("input", &self.input_names, &other.input_names),
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

fn check_names(kind: &'static str, names: &[String]) -> Result<(), DataError> {
    if names.is_empty() {
        return Err(DataError::NoChannels { kind });
    }
    match names.iter().position(|name| name.trim().is_empty()) {
        Some(index) => Err(DataError::UnnamedChannel { kind, index }),
        None => Ok(()),
    }
}
