//! How well recorded inputs excite the plant: a report, and the proof type that needs it.

use std::fmt;

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::HankelMatrix;
use super::error::HankelError;
use super::rank::{RANK_TOLERANCE, Rank, channel_scales, scaled};
use super::stacking::block_hankel;
use crate::data::Record;

/// Singular values around the place where the rank is decided. All are those of the matrix
/// whose channels were scaled to unit root mean square.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SingularValueGap {
    /// The largest.
    pub largest: f64,
    /// The smallest that counts towards the rank.
    pub last_counted: f64,
    /// The largest that does not; `None` if all count.
    pub first_dropped: Option<f64>,
    /// The limit between them: [`RANK_TOLERANCE`] times the largest.
    pub limit: f64,
}

/// One input channel by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelExcitation {
    /// Channel name.
    pub name: String,
    /// Rank of the Hankel matrix of this channel alone, of order L + n; L + n when it excites.
    pub rank: usize,
    /// The value, if the channel never changes.
    pub constant: Option<f64>,
}

/// Persistent excitation of order L + n, measured (Willems, Rapisarda, Markovsky, De Moor 2005).
///
/// The inputs are persistently exciting of order L + n if their block Hankel matrix of that
/// order has full row rank m(L + n). Then, for a controllable plant of order n and data without
/// noise, the stacked input/output Hankel matrix of order L has rank mL + n and its columns span
/// every trajectory of length L.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExcitationReport {
    /// Window L = past + future, samples.
    pub window: usize,
    /// Order n assumed of the plant.
    pub plant_order: usize,
    /// Samples given, all records together.
    pub samples: usize,
    /// Samples needed if they stand in one record: (m + 1)(L + n) − 1.
    pub samples_needed: usize,
    /// Number of records.
    pub records: usize,
    /// Columns of the input Hankel matrix of order L + n.
    pub columns: usize,
    /// Columns needed: m(L + n).
    pub columns_needed: usize,
    /// Rank of the input Hankel matrix of order L + n.
    pub input_rank: usize,
    /// Rank needed: m(L + n).
    pub input_rank_needed: usize,
    /// Where that rank was decided; `None` if the matrix has no column.
    pub input_gap: Option<SingularValueGap>,
    /// Rank of the stacked input/output Hankel matrix of order L.
    pub stacked_rank: usize,
    /// What that rank is for data without noise from a controllable plant of order n: mL + n.
    /// Noise raises it, up to (m + p)L.
    pub stacked_rank_without_noise: usize,
    /// Where that rank was decided.
    pub stacked_gap: Option<SingularValueGap>,
    /// Every input channel by itself.
    pub input_channels: Vec<ChannelExcitation>,
    /// Names and values of the output channels that never change.
    pub constant_outputs: Vec<(String, f64)>,
}

impl ExcitationReport {
    pub(super) fn measure(hankel: &HankelMatrix, plant_order: usize) -> Result<Self, HankelError> {
        let data = hankel.dataset();
        let window = hankel.horizons().window();
        // No record holds a window longer than all samples, so a longer order changes no rank.
        let order = window.saturating_add(plant_order);
        let depth = order.min(data.samples() + 1);
        let m = data.inputs();
        let inputs: Vec<_> = data.records().iter().map(Record::inputs).collect();
        let outputs: Vec<_> = data.records().iter().map(Record::outputs).collect();
        let input_scales = channel_scales(&inputs);
        let output_scales = channel_scales(&outputs);
        let scaled_inputs: Vec<_> = inputs.iter().map(|s| scaled(*s, &input_scales)).collect();
        let views: Vec<_> = scaled_inputs.iter().map(Mat::as_ref).collect();
        let input_hankel = block_hankel(&views, depth);
        let input_rank = Rank::measure(input_hankel.as_ref())?;
        let stacked = hankel.scaled_rows(&input_scales, &output_scales);
        let stacked_rank = Rank::measure(stacked.as_ref())?;

        let mut input_channels = Vec::with_capacity(m);
        for (channel, name) in data.input_names().iter().enumerate() {
            // Full joint rank implies full rank of every channel.
            let rank = if input_rank.rank == m.saturating_mul(order) {
                order
            } else {
                let alone: Vec<_> = views.iter().map(|s| s.subcols(channel, 1)).collect();
                Rank::measure(block_hankel(&alone, depth).as_ref())?.rank
            };
            input_channels.push(ChannelExcitation {
                name: name.clone(),
                rank,
                constant: constant_value(&inputs, channel, input_scales[channel]),
            });
        }
        let constant_outputs = data.output_names().iter().enumerate();
        let constant_outputs = constant_outputs
            .filter_map(|(channel, name)| {
                let value = constant_value(&outputs, channel, output_scales[channel])?;
                Some((name.clone(), value))
            })
            .collect();
        Ok(Self {
            window,
            plant_order,
            samples: data.samples(),
            samples_needed: (m + 1).saturating_mul(order) - 1,
            records: data.records().len(),
            columns: input_hankel.ncols(),
            columns_needed: m.saturating_mul(order),
            input_rank: input_rank.rank,
            input_rank_needed: m.saturating_mul(order),
            input_gap: gap(&input_rank),
            stacked_rank: stacked_rank.rank,
            stacked_rank_without_noise: (m * window).saturating_add(plant_order),
            stacked_gap: gap(&stacked_rank),
            input_channels,
            constant_outputs,
        })
    }

    /// Whether the inputs are persistently exciting of order L + n.
    #[must_use]
    pub fn is_persistently_exciting(&self) -> bool {
        self.input_rank == self.input_rank_needed
    }

    /// What is missing and what to record; for a report of inputs that do not excite.
    pub(super) fn complaint(&self) -> String {
        let order = self.window.saturating_add(self.plant_order);
        let mut parts = vec![format!(
            "their Hankel matrix of order L + n = {} + {} has rank {}, needed {}",
            self.window, self.plant_order, self.input_rank, self.input_rank_needed
        )];
        let poor: Vec<_> = self
            .input_channels
            .iter()
            .filter(|c| c.rank < order)
            .collect();
        parts.extend(poor.iter().map(|channel| match channel.constant {
            Some(value) => format!("channel `{}` is constant at {value}", channel.name),
            None => format!(
                "channel `{}` alone has rank {} of {order}",
                channel.name, channel.rank
            ),
        }));
        let remedy = if poor.is_empty() {
            let all = names(self.input_channels.iter().map(|c| &c.name));
            format!(
                "every channel excites by itself, but they move together: add noise that is \
                 independent for each of {all}"
            )
        } else {
            let poor = names(poor.iter().map(|c| &c.name));
            format!("add white noise or a PRBS to {poor}")
        };
        parts.push(format!(
            "{remedy} and record at least {} samples",
            self.samples_needed
        ));
        parts.join("; ")
    }
}

fn names<'a>(names: impl Iterator<Item = &'a String>) -> String {
    names
        .map(|name| format!("`{name}`"))
        .collect::<Vec<_>>()
        .join(", ")
}

fn gap(rank: &Rank) -> Option<SingularValueGap> {
    let largest = *rank.singular_values.first()?;
    Some(SingularValueGap {
        largest,
        last_counted: *rank.singular_values.get(rank.rank.saturating_sub(1))?,
        first_dropped: rank.singular_values.get(rank.rank).copied(),
        limit: RANK_TOLERANCE * largest,
    })
}

fn constant_value(series: &[MatRef<'_, f64>], channel: usize, scale: f64) -> Option<f64> {
    let first = series.first()?[(0, channel)];
    let mut values = series.iter().flat_map(|s| s.col(channel).iter());
    let constant = values.all(|value| (value - first).abs() <= RANK_TOLERANCE * scale);
    constant.then_some(first)
}

impl fmt::Display for ExcitationReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.is_persistently_exciting() {
            "persistently exciting"
        } else {
            "NOT persistently exciting"
        };
        writeln!(
            f,
            "inputs {verdict} of order L + n = {} + {}: rank {} of {}",
            self.window, self.plant_order, self.input_rank, self.input_rank_needed
        )?;
        write_gap(f, self.input_gap.as_ref())?;
        writeln!(
            f,
            "samples {} in {} record(s), needed {} in one; columns {}, needed {}",
            self.samples, self.records, self.samples_needed, self.columns, self.columns_needed
        )?;
        writeln!(
            f,
            "stacked input/output Hankel matrix: rank {}, {} for data without noise",
            self.stacked_rank, self.stacked_rank_without_noise
        )?;
        write_gap(f, self.stacked_gap.as_ref())?;
        for channel in &self.input_channels {
            if let Some(value) = channel.constant {
                writeln!(f, "input `{}` is constant at {value}", channel.name)?;
            }
        }
        for (name, value) in &self.constant_outputs {
            writeln!(f, "output `{name}` is constant at {value}")?;
        }
        Ok(())
    }
}

fn write_gap(f: &mut fmt::Formatter<'_>, gap: Option<&SingularValueGap>) -> fmt::Result {
    let Some(gap) = gap else { return Ok(()) };
    let dropped = gap
        .first_dropped
        .map_or("none".into(), |s| format!("{s:.3e}"));
    writeln!(
        f,
        "  singular values (channels scaled): largest {:.3e}, last counted {:.3e}, \
         first dropped {dropped}, limit {:.1e}",
        gap.largest, gap.last_counted, gap.limit
    )
}

/// A Hankel matrix whose inputs were shown, or are declared, to be persistently exciting.
#[derive(Debug, Clone)]
pub struct PersistentlyExciting {
    hankel: HankelMatrix,
    report: Option<ExcitationReport>,
}

impl PersistentlyExciting {
    pub(super) fn require(hankel: HankelMatrix, plant_order: usize) -> Result<Self, HankelError> {
        let report = hankel.excitation(plant_order)?;
        if report.columns < report.columns_needed {
            return Err(HankelError::TooFewSamples {
                given: report.samples,
                records: report.records,
                needed: report.samples_needed,
                inputs: hankel.dataset().inputs(),
                window: report.window,
                plant_order,
            });
        }
        if !report.is_persistently_exciting() {
            return Err(HankelError::NotPersistentlyExciting(Box::new(report)));
        }
        Ok(Self {
            hankel,
            report: Some(report),
        })
    }

    pub(super) fn assume(hankel: HankelMatrix) -> Self {
        Self {
            hankel,
            report: None,
        }
    }

    /// The Hankel matrix.
    #[must_use]
    pub fn hankel(&self) -> &HankelMatrix {
        &self.hankel
    }

    /// The measurement behind this proof; `None` if it was assumed.
    #[must_use]
    pub fn report(&self) -> Option<&ExcitationReport> {
        self.report.as_ref()
    }
}
