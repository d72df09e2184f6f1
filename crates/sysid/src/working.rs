//! What every estimator works on: records without offsets, all channels of size 1.

use std::ops::RangeInclusive;

use deepc_core::data::Dataset;
use deepc_core::faer::{Mat, MatRef};

use crate::error::SysidError;
use crate::state_space::{Channel, StateSpace, SystemMatrices};

/// A channel whose deviations are below this fraction of its mean is rounding.
const CONSTANT_TOLERANCE: f64 = 1e-12;

/// Scales whose squares, the variances, neither overflow nor vanish.
const SCALES: RangeInclusive<f64> = 1e-150..=1e150;

/// What deviations are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Centre {
    /// The means over all records.
    Means,
    /// Zero.
    Origin,
}

/// The records of a data set as scaled deviations.
#[derive(Debug, Clone)]
pub(crate) struct WorkingData {
    pub sample_time_s: f64,
    /// Inputs, then measured disturbances: M channels.
    pub inputs: Vec<Channel>,
    /// The last so many of `inputs` are measured disturbances.
    pub disturbances: usize,
    pub outputs: Vec<Channel>,
    pub records: Vec<WorkingRecord>,
}

/// One record: deviations from the offsets over the scales.
#[derive(Debug, Clone)]
pub(crate) struct WorkingRecord {
    /// T×M.
    pub inputs: Mat<f64>,
    /// T×p.
    pub outputs: Mat<f64>,
}

impl WorkingRecord {
    pub fn samples(&self) -> usize {
        self.inputs.nrows()
    }
}

impl WorkingData {
    /// Offsets are the means over all records, scales the standard deviations.
    pub fn new(data: &Dataset) -> Result<Self, SysidError> {
        Self::about(data, Centre::Means)
    }

    /// Offsets are those of `centre`, scales the root mean squares of the deviations from them.
    pub fn about(data: &Dataset, centre: Centre) -> Result<Self, SysidError> {
        if data.records().is_empty() {
            return Err(SysidError::TooShort {
                longest: 0,
                past: 1,
                future: 1,
                channels: data.inputs() + data.disturbances() + data.outputs(),
                needed: 2,
                window: 2,
            });
        }
        let mut inputs = Vec::new();
        for (kind, names, series) in [
            (
                "input",
                data.input_names(),
                all(data, deepc_core::data::Record::inputs),
            ),
            (
                "disturbance",
                data.disturbance_names(),
                all(data, deepc_core::data::Record::disturbances),
            ),
        ] {
            for (index, name) in names.iter().enumerate() {
                inputs.push(channel(kind, name, index, &series, centre)?);
            }
        }
        let series = all(data, deepc_core::data::Record::outputs);
        let outputs = data.output_names().iter().enumerate();
        let outputs = outputs.map(|(index, name)| channel("output", name, index, &series, centre));
        let outputs = outputs.collect::<Result<Vec<_>, _>>()?;
        Ok(Self::with_channels(data, inputs, outputs))
    }

    /// With offsets and scales given: those of a model, say.
    pub fn with_channels(data: &Dataset, inputs: Vec<Channel>, outputs: Vec<Channel>) -> Self {
        let m = data.inputs();
        let scaled = |channel: &Channel, value: f64| (value - channel.offset) / channel.scale;
        let records = data.records().iter().map(|record| {
            let (u, d, y) = (record.inputs(), record.disturbances(), record.outputs());
            let input = |k, j: usize| match j.checked_sub(m) {
                None => u[(k, j)],
                Some(j) => d[(k, j)],
            };
            WorkingRecord {
                inputs: Mat::from_fn(record.samples(), inputs.len(), |k, j| {
                    scaled(&inputs[j], input(k, j))
                }),
                outputs: Mat::from_fn(record.samples(), outputs.len(), |k, j| {
                    scaled(&outputs[j], y[(k, j)])
                }),
            }
        });
        Self {
            sample_time_s: data.sample_time_s(),
            records: records.collect(),
            disturbances: data.disturbances(),
            inputs,
            outputs,
        }
    }

    /// Samples of all records together.
    pub fn samples(&self) -> usize {
        self.records.iter().map(WorkingRecord::samples).sum()
    }

    /// Samples of the longest record.
    pub fn longest(&self) -> usize {
        let samples = self.records.iter().map(WorkingRecord::samples);
        samples.max().unwrap_or(0)
    }

    /// The same channels with other records.
    pub fn with_records(&self, records: Vec<WorkingRecord>) -> Self {
        Self {
            records,
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            ..*self
        }
    }

    /// The same records with one more input that is always 1: its D is an offset of the outputs that
    /// the offsets of the channels did not take.
    pub fn with_constant(&self) -> Self {
        let records = self.records.iter().map(|record| {
            let inputs = &record.inputs;
            let m = inputs.ncols();
            let entry = |k, j| if j < m { inputs[(k, j)] } else { 1.0 };
            WorkingRecord {
                inputs: Mat::from_fn(inputs.nrows(), m + 1, entry),
                outputs: record.outputs.clone(),
            }
        });
        let mut data = self.with_records(records.collect());
        data.inputs.push(Channel::new("1"));
        data
    }

    /// A model of the scaled deviations in the units of the recording; `covariance` is that of the
    /// scaled innovation, p×p.
    pub fn to_state_space(
        &self,
        scaled: &SystemMatrices,
        covariance: MatRef<'_, f64>,
    ) -> Result<StateSpace, SysidError> {
        let (u, y) = (&self.inputs, &self.outputs);
        let n = scaled.order();
        let matrices = SystemMatrices {
            a: scaled.a.clone(),
            b: Mat::from_fn(n, u.len(), |i, j| scaled.b[(i, j)] / u[j].scale),
            c: Mat::from_fn(y.len(), n, |i, j| scaled.c[(i, j)] * y[i].scale),
            d: Mat::from_fn(y.len(), u.len(), |i, j| {
                scaled.d[(i, j)] * y[i].scale / u[j].scale
            }),
            k: Mat::from_fn(n, y.len(), |i, j| scaled.k[(i, j)] / y[j].scale),
        };
        let (inputs, disturbances) = u.split_at(u.len() - self.disturbances);
        let model = StateSpace::new(
            self.sample_time_s,
            inputs.to_vec(),
            disturbances.to_vec(),
            y.clone(),
            matrices,
        )?;
        model.with_innovation_covariance(Mat::from_fn(y.len(), y.len(), |i, j| {
            covariance[(i, j)] * y[i].scale * y[j].scale
        }))
    }

    /// The inverse of [`to_state_space`](Self::to_state_space).
    pub fn to_scaled(&self, model: &StateSpace) -> SystemMatrices {
        let (u, y, from) = (&self.inputs, &self.outputs, model.matrices());
        let n = from.order();
        SystemMatrices {
            a: from.a.clone(),
            b: Mat::from_fn(n, u.len(), |i, j| from.b[(i, j)] * u[j].scale),
            c: Mat::from_fn(y.len(), n, |i, j| from.c[(i, j)] / y[i].scale),
            d: Mat::from_fn(y.len(), u.len(), |i, j| {
                from.d[(i, j)] * u[j].scale / y[i].scale
            }),
            k: Mat::from_fn(n, y.len(), |i, j| from.k[(i, j)] * y[j].scale),
        }
    }
}

fn all<'a>(
    data: &'a Dataset,
    of: impl Fn(&'a deepc_core::data::Record) -> MatRef<'a, f64>,
) -> Vec<MatRef<'a, f64>> {
    data.records().iter().map(of).collect()
}

fn channel(
    kind: &'static str,
    name: &str,
    index: usize,
    series: &[MatRef<'_, f64>],
    centre: Centre,
) -> Result<Channel, SysidError> {
    let values = || series.iter().flat_map(|s| s.col(index).iter().copied());
    let samples = series.iter().map(MatRef::nrows).sum::<usize>() as f64;
    let mean = values().sum::<f64>() / samples;
    // The mean of the deviations corrects the rounding of the first mean.
    let mean = mean + values().map(|value| value - mean).sum::<f64>() / samples;
    let out_of_range = |found| SysidError::Channel {
        field: "the size",
        channel: name.to_owned(),
        found,
        allowed: "its variance must be in the range of numbers: choose a unit in which it is between \
                  1e-150 and 1e150",
    };
    if !mean.is_finite() {
        return Err(out_of_range(mean));
    }
    let largest_about = |centre: f64| {
        let sizes = values().map(|value| (value - centre).abs());
        sizes.fold(0.0, f64::max)
    };
    let largest = largest_about(mean);
    if largest <= CONSTANT_TOLERANCE * mean.abs() || largest == 0.0 {
        return Err(SysidError::Constant {
            kind,
            channel: name.to_owned(),
            value: mean,
            remedy: match kind {
                "output" => "check its sensor and record again",
                _ => "shake it while recording, or leave it out",
            },
        });
    }
    let (offset, largest) = match centre {
        Centre::Means => (mean, largest),
        Centre::Origin => (0.0, largest_about(0.0)),
    };
    // Over the largest first, so that squares of tiny or huge deviations stay in range.
    let squares = values().map(|value| ((value - offset) / largest).powi(2));
    let scale = largest * (squares.sum::<f64>() / samples).sqrt();
    if !SCALES.contains(&scale) {
        return Err(out_of_range(scale));
    }
    Ok(Channel {
        name: name.to_owned(),
        offset,
        scale,
    })
}

/// That a recording has a model's channels, in order, and its sample time.
pub(crate) fn check_channels(model: &StateSpace, data: &Dataset) -> Result<(), SysidError> {
    for (kind, channels, names) in [
        ("input", model.inputs(), data.input_names()),
        (
            "disturbance",
            model.disturbances(),
            data.disturbance_names(),
        ),
        ("output", model.outputs(), data.output_names()),
    ] {
        let names_of = |c: &Channel| c.name.clone();
        let known: Vec<String> = channels.iter().map(names_of).collect();
        if known != names {
            return Err(SysidError::ChannelsDiffer {
                kind,
                model: known,
                data: names.to_vec(),
            });
        }
    }
    let (model_s, data_s) = (model.sample_time_s(), data.sample_time_s());
    // Sample times are typed in: only rounding may separate equal ones.
    if (model_s - data_s).abs() > 1e-9 * model_s {
        return Err(SysidError::SampleTimesDiffer { model_s, data_s });
    }
    Ok(())
}
