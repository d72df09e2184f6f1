//! How well recorded inputs excite the plant: a report.

use std::fmt;

use faer::MatRef;
use serde::{Deserialize, Serialize};

use super::Arrangement;
use super::error::HankelError;
use super::proof::HankelData;
use super::rank::{ChannelScales, RANK_TOLERANCE, Rank};
use crate::data::{Dataset, Record};

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

/// Who moves a channel that excites the plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExcitingRole {
    /// An input: whoever records can shake it.
    Input,
    /// A measured disturbance: it moves or it does not.
    Disturbance,
}

/// One input or measured disturbance by itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelExcitation {
    /// Channel name.
    pub name: String,
    /// Who moves it.
    pub role: ExcitingRole,
    /// Rank of the matrix of this channel's windows alone; their length when it excites.
    pub rank: usize,
    /// The value, if the channel never changes.
    pub constant: Option<f64>,
}

/// Persistent excitation, measured.
///
/// The inputs are persistently exciting of order L + n if their block Hankel matrix of that
/// order has full row rank m(L + n). Then, for a controllable plant of order n and data without
/// noise, the stacked input/output Hankel matrix of order L has rank mL + n and its columns span
/// every trajectory of length L (Willems, Rapisarda, Markovsky, De Moor 2005; several records: van
/// Waarde, De Persis, Camlibel, Tesi 2020).
///
/// Measured disturbances act as inputs do, so they count as inputs here: with q of them, read
/// m + q for m.
///
/// For other arrangements of columns ([`Arrangement`]) the input windows have another length
/// ([`ExcitationReport::order`]):
///
/// | columns | windows of | proves |
/// |---|---|---|
/// | Hankel | L + n | the lemma above |
/// | Page | L(n + 1), starting at multiples of L | the same for Page matrices: "L-Page exciting of order n + 1" (Coulson, Lygeros, Dörfler 2022) |
/// | selected | L | nothing: full rank mL of the selected inputs and mL + n columns are necessary, not sufficient. Without noise, `stacked_rank` = mL + n is both (Markovsky, Dörfler 2023) |
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExcitationReport {
    /// Window L = past + future, samples.
    pub window: usize,
    /// Order n assumed of the plant.
    pub plant_order: usize,
    /// How the columns were taken from the records.
    pub arrangement: Arrangement,
    /// Length of the input windows whose rank was measured, samples: L + n, L(n + 1) or L.
    pub order: usize,
    /// Samples given, all records together.
    pub samples: usize,
    /// Samples needed if they stand in one record: (m + q + 1)(L + n) − 1,
    /// or L(((m + q)L + 1)(n + 1) − 1) for a Page matrix.
    pub samples_needed: usize,
    /// Number of records.
    pub records: usize,
    /// Columns of the matrix of input windows.
    pub columns: usize,
    /// Columns needed: (m + q)·`order`; (m + q)L + n for selected columns.
    pub columns_needed: usize,
    /// Rank of the matrix of input windows.
    pub input_rank: usize,
    /// Rank needed: (m + q)·`order`.
    pub input_rank_needed: usize,
    /// Where that rank was decided; `None` if the matrix has no column.
    pub input_gap: Option<SingularValueGap>,
    /// Rank of the stacked input/output Hankel matrix of order L.
    pub stacked_rank: usize,
    /// What that rank is for data without noise from a controllable plant of order n:
    /// (m + q)L + n. Noise raises it, up to (m + q + p)L.
    pub stacked_rank_without_noise: usize,
    /// Where that rank was decided.
    pub stacked_gap: Option<SingularValueGap>,
    /// Every input, then every measured disturbance, by itself.
    pub input_channels: Vec<ChannelExcitation>,
    /// Names and values of the output channels that never change.
    pub constant_outputs: Vec<(String, f64)>,
}

impl ExcitationReport {
    pub(super) fn measure(
        hankel: &impl HankelData,
        plant_order: usize,
    ) -> Result<Self, HankelError> {
        let data = hankel.dataset();
        let window = hankel.shape().horizons.window();
        let m = data.inputs() + data.disturbances();
        let need = Need::of(hankel.arrangement(), m, window, plant_order);
        // No record holds a window longer than all samples, so a longer order changes no rank.
        let depth = need.order.min(data.samples() + 1);
        let scales = ChannelScales::of(data);
        let exciting = [scales.inputs.clone(), scales.disturbances.clone()].concat();
        let all: Vec<_> = (0..m).collect();
        let (inputs, columns) = hankel.scaled_inputs(&all, depth, &exciting);
        let input_rank = Rank::measure(inputs.as_ref())?;
        let stacked_rank = Rank::measure(hankel.scaled_stacked(&scales).as_ref())?;

        let mut input_channels = Vec::with_capacity(m);
        let names = data.input_names().iter().chain(data.disturbance_names());
        for (channel, name) in names.enumerate() {
            // Full joint rank implies full rank of every channel.
            let rank = if input_rank.rank == need.rank {
                need.order
            } else {
                let scale = &exciting[channel..=channel];
                let (alone, _) = hankel.scaled_inputs(&[channel], depth, scale);
                Rank::measure(alone.as_ref())?.rank
            };
            let (role, constant) = match channel.checked_sub(data.inputs()) {
                None => (
                    ExcitingRole::Input,
                    constant_value(data, Record::inputs, channel, exciting[channel]),
                ),
                Some(i) => (
                    ExcitingRole::Disturbance,
                    constant_value(data, Record::disturbances, i, exciting[channel]),
                ),
            };
            input_channels.push(ChannelExcitation {
                name: name.clone(),
                role,
                rank,
                constant,
            });
        }
        let constant_outputs = data.output_names().iter().enumerate();
        let constant_outputs = constant_outputs
            .filter_map(|(i, name)| {
                let value = constant_value(data, Record::outputs, i, scales.outputs[i])?;
                Some((name.clone(), value))
            })
            .collect();
        Ok(Self {
            window,
            plant_order,
            arrangement: hankel.arrangement(),
            order: need.order,
            samples: data.samples(),
            samples_needed: need.samples,
            records: data.records().len(),
            columns,
            columns_needed: need.columns,
            input_rank: input_rank.rank,
            input_rank_needed: need.rank,
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
        self.input_rank == self.input_rank_needed && self.columns >= self.columns_needed
    }

    /// The length of the input windows, as a formula and in numbers.
    fn order_in_words(&self) -> String {
        let (window, n) = (self.window, self.plant_order);
        match self.arrangement {
            Arrangement::Hankel => format!("order L + n = {window} + {n}"),
            Arrangement::Page => format!("order L(n + 1) = {window}({n} + 1)"),
            Arrangement::Selection => format!("order L = {window}"),
        }
    }

    /// How many samples are missing; for a report of too few columns.
    pub(super) fn shortage(&self) -> String {
        let is_disturbance = |c: &&ChannelExcitation| c.role == ExcitingRole::Disturbance;
        let disturbances = self.input_channels.iter().filter(is_disturbance).count();
        let inputs = self.input_channels.len() - disturbances;
        let (measured, m) = match disturbances {
            0 => (String::new(), "m"),
            q => (format!(", {q} measured disturbance(s)"), "(m+q)"),
        };
        let bound = match self.arrangement {
            Arrangement::Page => format!("L(({m}L+1)(n+1) − 1)"),
            _ => format!("({}+1)(L+n) − 1", m.trim_matches(['(', ')'])),
        };
        format!(
            "{} in {} record(s), needed at least {} in one record for {inputs} input(s){measured}, \
             window {} and plant order {} (T ≥ {bound}); record longer or shorten the horizons",
            self.samples, self.records, self.samples_needed, self.window, self.plant_order
        )
    }

    /// What is missing and what to record; for a report of inputs that do not excite.
    pub(super) fn complaint(&self) -> String {
        let order = self.order;
        let mut parts = vec![format!(
            "their {} matrix of {} has rank {}, needed {}",
            self.arrangement.name(),
            self.order_in_words(),
            self.input_rank,
            self.input_rank_needed
        )];
        let poor = self.input_channels.iter().filter(|c| c.rank < order);
        let poor: Vec<_> = poor.collect();
        let together = poor.is_empty();
        parts.extend(poor.iter().map(|channel| match channel.constant {
            Some(value) => format!("channel `{}` is constant at {value}", channel.name),
            None => format!(
                "channel `{}` alone has rank {} of {order}",
                channel.name, channel.rank
            ),
        }));
        let (shaken, measured): (Vec<_>, Vec<_>) = if poor.is_empty() {
            self.input_channels.iter().collect()
        } else {
            poor
        }
        .into_iter()
        .partition(|channel| channel.role == ExcitingRole::Input);
        let mut remedies = Vec::new();
        if together {
            parts.push("every channel excites by itself, but they move together".into());
        }
        if !shaken.is_empty() {
            let noise = if together {
                "noise that is independent for each of"
            } else {
                "white noise or a PRBS to"
            };
            remedies.push(format!("add {noise} {}", names(&shaken)));
        }
        if !measured.is_empty() {
            remedies.push(format!(
                "record while {} varies by itself",
                names(&measured)
            ));
        }
        let remedy = remedies.join(", ");
        parts.push(format!(
            "{remedy} and record at least {} samples",
            self.samples_needed
        ));
        parts.join("; ")
    }
}

fn names(channels: &[&ChannelExcitation]) -> String {
    let quoted: Vec<_> = channels.iter().map(|c| format!("`{}`", c.name)).collect();
    quoted.join(", ")
}

/// What full excitation takes.
struct Need {
    order: usize,
    rank: usize,
    columns: usize,
    samples: usize,
}

impl Need {
    /// For m inputs (and measured disturbances), window L and plant order n.
    fn of(arrangement: Arrangement, m: usize, window: usize, n: usize) -> Self {
        let hankel_order = window.saturating_add(n);
        let hankel_samples = (m + 1).saturating_mul(hankel_order) - 1;
        match arrangement {
            Arrangement::Hankel => Self {
                order: hankel_order,
                rank: m.saturating_mul(hankel_order),
                columns: m.saturating_mul(hankel_order),
                samples: hankel_samples,
            },
            Arrangement::Page => {
                let blocks = n.saturating_add(1);
                let order = window.saturating_mul(blocks);
                let columns = m.saturating_mul(order);
                Self {
                    order,
                    rank: columns,
                    columns,
                    samples: window.saturating_mul((columns - 1).saturating_add(blocks)),
                }
            }
            Arrangement::Selection => Self {
                order: window,
                rank: m * window,
                columns: (m * window).saturating_add(n),
                samples: hankel_samples,
            },
        }
    }
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

fn constant_value(
    data: &Dataset,
    signals: fn(&Record) -> MatRef<'_, f64>,
    channel: usize,
    scale: f64,
) -> Option<f64> {
    let first = signals(data.records().first()?)[(0, channel)];
    let series = data.records().iter().map(signals);
    let mut values = series.flat_map(|s| s.col(channel).iter());
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
            "inputs {verdict} of {}: rank {} of {}",
            self.order_in_words(),
            self.input_rank,
            self.input_rank_needed
        )?;
        write_gap(f, self.input_gap.as_ref())?;
        writeln!(
            f,
            "samples {} in {} record(s), needed {} in one; columns {}, needed {}",
            self.samples, self.records, self.samples_needed, self.columns, self.columns_needed
        )?;
        writeln!(
            f,
            "stacked input/output {} matrix: rank {}, {} for data without noise",
            self.arrangement.name(),
            self.stacked_rank,
            self.stacked_rank_without_noise
        )?;
        write_gap(f, self.stacked_gap.as_ref())?;
        for channel in &self.input_channels {
            if let Some(value) = channel.constant {
                let role = match channel.role {
                    ExcitingRole::Input => "input",
                    ExcitingRole::Disturbance => "disturbance",
                };
                writeln!(f, "{role} `{}` is constant at {value}", channel.name)?;
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
