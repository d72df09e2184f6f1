//! Order and lag of the plant, from noisy data.
//!
//! For data without noise the stacked Hankel matrix of depth ℓ has rank mℓ + n(ℓ), where n(ℓ)
//! is the rank of the first ℓ blocks of the observability matrix: it grows to the order n, which it
//! reaches at the lag (Willems et al. 2005; Markovsky, Dörfler 2023). Noise makes that matrix
//! full. What survives is that the past tells n(ℓ) directions of the next ℓ outputs, and no more,
//! once the inputs are taken into account. With windows of f past and f future samples and the QR
//! decomposition of `[1 U_f U_p Y_p Y_f]ᵀ`,
//!
//! ```text
//! Y_f = … + L₃₂ Q₂ + L₃₃ Q₃        s = singular values of L₃₃⁻¹ L₃₂  (first ℓ blocks of rows)
//! ```
//!
//! sᵢ² is signal to noise of direction i; s²/(1 + s²) is a squared partial canonical correlation
//! between past and future (canonical variate analysis; Larimore 1990). n(ℓ) minimises the
//! description length of a reduced-rank regression of J windows (Rissanen 1978; as an order
//! criterion Bauer 2001),
//!
//! ```text
//! J Σ_{i>n} ln(1 + sᵢ²) + n((m + p)f + pℓ − n) ln J
//! ```
//!
//! Measured disturbances count as inputs.
//!
//! The row of ones takes constant offsets of the recording away: they are no order of the plant.
//! Outputs get a floor of noise of [`NOISE_FLOOR`] of their deviation, which makes the same
//! computation decide the numerical rank of data without noise.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::channel::{ChannelStatistics, Role, Stretches};
use super::error::AssessmentError;
use crate::data::Dataset;
use crate::hankel::{RANK_TOLERANCE, stacked_position};
use crate::linalg;

/// Noise that every output is taken to have at least, as a fraction of its standard deviation.
pub const NOISE_FLOOR: f64 = 1e-7;

/// A decomposition takes no more windows than this; of a longer recording every so-manieth.
pub(super) const MOST_WINDOWS: usize = 20_000;

/// Deepest window tried: past this the estimate costs more than it tells.
const MOST_DEPTH: usize = 40;

/// Windows for each row of the decomposition, at least.
const WINDOWS_PER_ROW: usize = 3;

/// How clearly the order stands out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Certainty {
    /// The weakest direction that counts is less than 3 times the strongest that does not, or the
    /// order is at the limit of what was looked for.
    Unsure,
    /// 3 to 10 times.
    Likely,
    /// 10 times and more.
    Sure,
}

/// Rank found at one depth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepthRank {
    /// Depth ℓ, samples.
    pub depth: usize,
    /// n(ℓ): rank of the stacked Hankel matrix of that depth, noise taken off, minus mℓ.
    pub order: usize,
}

/// Order and lag of the plant as the data show them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderEstimate {
    /// Order n.
    pub order: usize,
    /// Lag: samples of the past that fix the state; `T_ini` must not be less.
    pub lag: usize,
    /// How clearly the order stands out.
    pub certainty: Certainty,
    /// s of the weakest direction that counts; `None` if none does.
    pub last_counted: Option<f64>,
    /// s of the strongest direction that does not; `None` if all count.
    pub first_dropped: Option<f64>,
    /// Largest order that could have been seen.
    pub largest_visible: usize,
    /// Windows used.
    pub windows: usize,
    /// n(ℓ) for growing depth.
    pub ranks: Vec<DepthRank>,
    /// All s in falling order, at the greatest depth.
    pub signal_to_noise: Vec<f64>,
}

impl OrderEstimate {
    /// `None` if there are too few samples to tell.
    pub(super) fn measure(
        dataset: &Dataset,
        channels: &[(String, Role, Stretches<'_>)],
        statistics: &[ChannelStatistics],
        largest_order: usize,
    ) -> Result<Option<Self>, AssessmentError> {
        let (m, p) = (exciting(dataset), dataset.outputs());
        let rows = |depth: usize| 1 + 2 * (m + p) * depth;
        let windows = |depth: usize| -> usize {
            let records = dataset.records().iter();
            records
                .map(|r| (r.samples() + 1).saturating_sub(2 * depth))
                .sum()
        };
        let deepest = largest_order.saturating_add(1).clamp(2, MOST_DEPTH);
        let enough = |depth: &usize| windows(*depth) >= WINDOWS_PER_ROW * rows(*depth);
        let Some(depth) = (2..=deepest).rev().find(enough) else {
            return Ok(None);
        };
        let stack = Stack {
            dataset,
            channels,
            statistics,
            depth,
        };
        let matrix = stack.matrix(windows(depth).div_ceil(MOST_WINDOWS));
        let used = matrix.nrows();
        let r = matrix.qr().thin_R().to_owned();
        let (explained, noise) = stack.future_outputs(r.as_ref(), used);

        let mut ranks = Vec::with_capacity(depth);
        let mut signal_to_noise = Vec::new();
        for steps in 1..=depth {
            signal_to_noise = ratios(explained.as_ref(), noise.as_ref(), p * steps)?;
            let regressors = (m + p) * depth;
            ranks.push(DepthRank {
                depth: steps,
                order: shortest_description(&signal_to_noise, regressors + p * steps, used),
            });
        }
        let order = ranks.last().map_or(0, |rank| rank.order);
        let lag = ranks.iter().find(|rank| rank.order >= order);
        let last_counted = order.checked_sub(1).map(|i| signal_to_noise[i]);
        let first_dropped = signal_to_noise.get(order).copied();
        let largest_visible = p * depth;
        let gap = match (last_counted, first_dropped) {
            (Some(counted), Some(dropped)) => counted / dropped.max(f64::MIN_POSITIVE),
            // No dynamics: how far the strongest direction is below what would count.
            (None, Some(dropped)) => (1.0 / dropped.max(f64::MIN_POSITIVE)).min(10.0),
            (_, None) => 0.0,
        };
        let certainty = if order > largest_order || gap < 3.0 {
            Certainty::Unsure
        } else if gap < 10.0 {
            Certainty::Likely
        } else {
            Certainty::Sure
        };
        Ok(Some(Self {
            order,
            lag: if order == 0 {
                0
            } else {
                lag.map_or(depth, |rank| rank.depth)
            },
            certainty,
            last_counted,
            first_dropped,
            largest_visible,
            windows: used,
            ranks,
            signal_to_noise,
        }))
    }
}

struct Stack<'a> {
    dataset: &'a Dataset,
    channels: &'a [(String, Role, Stretches<'a>)],
    statistics: &'a [ChannelStatistics],
    depth: usize,
}

impl Stack<'_> {
    /// First column of each of `U_f`, `U_p`, `Y_p`, `Y_f`; column 0 is ones.
    fn firsts(&self) -> [usize; 4] {
        let (m, p) = (exciting(self.dataset), self.dataset.outputs());
        let depth = self.depth;
        [1, 1 + m * depth, 1 + 2 * m * depth, 1 + (2 * m + p) * depth]
    }

    /// One row per window, every `stride`-th: `[1 U_f U_p Y_p Y_f]ᵀ`, channels centred and scaled.
    fn matrix(&self, stride: usize) -> Mat<f64> {
        let (m, p) = (exciting(self.dataset), self.dataset.outputs());
        let records = self.dataset.records().iter().enumerate();
        let windows: Vec<_> = records
            .flat_map(|(index, record)| {
                let count = (record.samples() + 1).saturating_sub(2 * self.depth);
                (0..count).map(move |start| (index, start))
            })
            .step_by(stride)
            .collect();
        let [u_future, u_past, y_past, y_future] = self.firsts();
        let mut matrix = Mat::zeros(windows.len(), y_future + p * self.depth);
        matrix.col_mut(0).fill(1.0);
        for (index, (_, role, stretches)) in self.channels.iter().enumerate() {
            let (channel, count, past, future) = match role {
                Role::Input | Role::Disturbance => (index, m, u_past, u_future),
                Role::Output => (index - m, p, y_past, y_future),
            };
            let statistics = &self.statistics[index];
            let scale = scale(statistics);
            for time in 0..2 * self.depth {
                let column = match time.checked_sub(self.depth) {
                    None => past + stacked_position(time, channel, count),
                    Some(time) => future + stacked_position(time, channel, count),
                };
                let target = matrix.col_as_slice_mut(column);
                for (value, &(record, start)) in target.iter_mut().zip(&windows) {
                    *value = (stretches[record][start + time] - statistics.mean) / scale;
                }
            }
        }
        matrix
    }

    /// L₃₂ and a triangular factor of the noise, from the triangular factor of the stack.
    fn future_outputs(&self, r: MatRef<'_, f64>, windows: usize) -> (Mat<f64>, Mat<f64>) {
        let [_, past, _, future] = self.firsts();
        let size = r.ncols() - future;
        let explained = r
            .submatrix(past, future, future - past, size)
            .transpose()
            .to_owned();
        let floor = NOISE_FLOOR * (windows as f64).sqrt();
        let with_floor = Mat::from_fn(2 * size, size, |i, j| match i.checked_sub(size) {
            None => r[(future + i, future + j)],
            Some(i) => {
                if i == j {
                    floor
                } else {
                    0.0
                }
            }
        });
        (
            explained,
            linalg::lower_from_upper(with_floor.qr().thin_R()),
        )
    }
}

/// Channels that drive the plant: inputs and measured disturbances, which stand first.
fn exciting(dataset: &Dataset) -> usize {
    dataset.inputs() + dataset.disturbances()
}

/// Standard deviation; 1 for a constant channel, whose rounding must not be blown up.
fn scale(statistics: &ChannelStatistics) -> f64 {
    if statistics.deviation > RANK_TOLERANCE * statistics.rms {
        statistics.deviation
    } else {
        statistics.rms.max(1.0)
    }
}

/// Singular values of noise⁻¹·explained over the first `rows` rows.
fn ratios(
    explained: MatRef<'_, f64>,
    noise: MatRef<'_, f64>,
    rows: usize,
) -> Result<Vec<f64>, AssessmentError> {
    let mut whitened = explained.subrows(0, rows).to_owned();
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(
        noise.submatrix(0, 0, rows, rows),
        whitened.as_mut(),
        faer::Par::Seq,
    );
    whitened
        .singular_values()
        .map_err(|_| AssessmentError::Decomposition {
            what: "the order estimate",
            rows: whitened.nrows(),
            columns: whitened.ncols(),
        })
}

/// `freedom`: (m + p)f + pℓ.
fn shortest_description(ratios: &[f64], freedom: usize, windows: usize) -> usize {
    let count = windows as f64;
    let fits: Vec<f64> = ratios.iter().map(|s| count * (s * s).ln_1p()).collect();
    let length = |order: usize| {
        let left: f64 = fits[order..].iter().sum();
        left + (order * (freedom - order)) as f64 * count.ln()
    };
    (0..=ratios.len())
        .min_by(|&a, &b| length(a).total_cmp(&length(b)))
        .unwrap_or(0)
}
