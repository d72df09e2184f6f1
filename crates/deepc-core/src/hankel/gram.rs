//! The Gram matrix H Hᵀ of a block Hankel matrix from its displacement structure.
//!
//! With w(k) the channels of sample k and J columns, the block (i, j) of G = H Hᵀ is
//! `Σ_s w(s+i) w(s+j)ᵀ`, s = 0 … J−1, so that the next block on the same diagonal differs by two
//! rank-one terms (Kailath, Kung, Morf 1979):
//!
//! ```text
//! G[i+1, j+1] = G[i, j] − w(i) w(j)ᵀ + w(J+i) w(J+j)ᵀ
//! ```
//!
//! Only the first row of blocks is a sum over the recording: O(T·L·c²) work for c channels, and
//! memory for G alone. Several records add up.
//!
//! A Gram matrix squares the condition number, and a channel that stands at 100 ± 0.3 would lose
//! the fifth power of ten of its digits to its offset. The channels are therefore centred and
//! divided by their standard deviations, w = μ + σw̃, and the row of ones is carried along:
//! `Hᵀ = [1 H̃ᵀ] [μᵀ; diag(σ)]` gives the factor of H from that of `[1; H̃]` without another
//! subtraction (in [`super::factor`]).

use faer::Mat;

use super::stacking::{stacked_position, windows};

/// Samples per block of the correlation sums; it and its shifts stay in the first-level cache.
const BLOCK: usize = 1024;

/// Channels of one record, all T samples long.
pub(super) type Channels<'a> = Vec<&'a [f64]>;

/// Mean and standard deviation of a channel (1 if it is constant).
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    pub mean: f64,
    pub deviation: f64,
}

/// Of every channel, over all records.
pub(super) fn spreads(records: &[Channels<'_>]) -> Vec<Spread> {
    let channels = records.first().map_or(0, Vec::len);
    let spread = |channel: usize| {
        let series = || records.iter().map(|record| record[channel]);
        let samples = series().map(<[f64]>::len).sum::<usize>() as f64;
        let total = |of: &dyn Fn(f64) -> f64| -> f64 {
            let blocks = series().flat_map(|values| values.chunks(BLOCK));
            let mut sum = Compensated::default();
            for block in blocks {
                sum.add(block.iter().map(|&value| of(value)).sum());
            }
            sum.value()
        };
        let mean = total(&|value| value) / samples;
        let deviation = (total(&|value| (value - mean).powi(2)) / samples).sqrt();
        // What is left of a constant channel is rounding of its mean.
        let moves = deviation.is_finite() && deviation > 1e-12 * mean.abs();
        Spread {
            mean,
            deviation: if moves { deviation } else { 1.0 },
        }
    };
    (0..channels).map(spread).collect()
}

/// Neumaier's compensated sum.
#[derive(Debug, Default, Clone, Copy)]
struct Compensated {
    sum: f64,
    lost: f64,
}

impl Compensated {
    fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        self.lost += if self.sum.abs() >= value.abs() {
            (self.sum - sum) + value
        } else {
            (value - sum) + self.sum
        };
        self.sum = sum;
    }

    fn value(self) -> f64 {
        self.sum + self.lost
    }
}

/// Gram matrix of `[1; H̃]`, (1 + c·depth)², of the centred and scaled channels; H̃ is stacked
/// time-major and its row r stands at 1 + `position[r]`. Every record has at least `depth`
/// samples.
pub(super) fn gram(
    records: &[Channels<'_>],
    spreads: &[Spread],
    depth: usize,
    position: &[usize],
) -> Mat<f64> {
    let channels = spreads.len();
    let row = |time, channel| 1 + position[stacked_position(time, channel, channels)];
    let mut gram = Mat::zeros(1 + channels * depth, 1 + channels * depth);
    let columns: usize = records
        .iter()
        .map(|r| windows(r.first().map_or(0, |c| c.len()), depth))
        .sum();
    gram[(0, 0)] = columns as f64;
    let first = Correlations::sum(records, spreads, depth);
    for a in 0..channels {
        let total = first.totals[a].value();
        put(&mut gram, 0, row(0, a), total);
        for b in 0..channels {
            for lag in 0..depth {
                let value = first.of(a, b, lag).value();
                put(&mut gram, row(0, a), row(lag, b), value);
            }
        }
    }
    let edges: Vec<_> = records
        .iter()
        .map(|r| Edges::of(r, spreads, depth))
        .collect();
    for i in 0..depth - 1 {
        for a in 0..channels {
            let change = |leave: &dyn Fn(&Edges) -> f64| -> f64 { edges.iter().map(leave).sum() };
            let total = change(&|e| e.after(i, a) - e.before(i, a));
            let value = gram[(0, row(i, a))] + total;
            put(&mut gram, 0, row(i + 1, a), value);
            for j in i..depth - 1 {
                for b in 0..channels {
                    let terms = edges
                        .iter()
                        .map(|e| e.after(i, a) * e.after(j, b) - e.before(i, a) * e.before(j, b));
                    let value = gram[(row(i, a), row(j, b))] + terms.sum::<f64>();
                    put(&mut gram, row(i + 1, a), row(j + 1, b), value);
                }
            }
        }
    }
    gram
}

fn put(gram: &mut Mat<f64>, i: usize, j: usize, value: f64) {
    gram[(i, j)] = value;
    gram[(j, i)] = value;
}

/// The first row of blocks and the row of ones: `Σ_s w̃_a(s) w̃_b(s + lag)` and `Σ_s w̃_a(s)`.
struct Correlations {
    depth: usize,
    channels: usize,
    products: Vec<Compensated>,
    totals: Vec<Compensated>,
}

impl Correlations {
    fn sum(records: &[Channels<'_>], spreads: &[Spread], depth: usize) -> Self {
        let channels = spreads.len();
        let mut all = Self {
            depth,
            channels,
            products: vec![Compensated::default(); channels * channels * depth],
            totals: vec![Compensated::default(); channels],
        };
        let mut scaled = vec![Vec::with_capacity(BLOCK + depth); channels];
        for record in records {
            let samples = record.first().map_or(0, |c| c.len());
            let columns = windows(samples, depth);
            for start in (0..columns).step_by(BLOCK) {
                let size = BLOCK.min(columns - start);
                for ((scaled, series), spread) in scaled.iter_mut().zip(record).zip(spreads) {
                    scaled.clear();
                    let values = &series[start..start + size + depth - 1];
                    scaled.extend(values.iter().map(|v| (v - spread.mean) / spread.deviation));
                }
                all.add_block(&scaled, size);
            }
        }
        all
    }

    fn add_block(&mut self, scaled: &[Vec<f64>], size: usize) {
        for (a, first) in scaled.iter().enumerate() {
            let first = &first[..size];
            self.totals[a].add(first.iter().sum());
            for (b, second) in scaled.iter().enumerate() {
                let base = (a * self.channels + b) * self.depth;
                let sums = &mut self.products[base..base + self.depth];
                for (lag, sum) in sums.iter_mut().enumerate() {
                    sum.add(inner_product(first, &second[lag..lag + size]));
                }
            }
        }
    }

    fn of(&self, a: usize, b: usize, lag: usize) -> Compensated {
        self.products[(a * self.channels + b) * self.depth + lag]
    }
}

/// Eight partial sums, so that the compiler may use vector registers; it also halves the
/// rounding.
fn inner_product(x: &[f64], y: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (x, x_rest) = x.as_chunks::<LANES>();
    let (y, y_rest) = y.as_chunks::<LANES>();
    for (x, y) in x.iter().zip(y) {
        for lane in 0..LANES {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest: f64 = x_rest.iter().zip(y_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Samples at both ends of a record: the first depth − 1, which leave the sums on the way down a
/// diagonal, and those from J on, which enter.
struct Edges {
    channels: usize,
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Edges {
    fn of(record: &Channels<'_>, spreads: &[Spread], depth: usize) -> Self {
        let channels = spreads.len();
        let samples = record.first().map_or(0, |c| c.len());
        let columns = windows(samples, depth);
        let stacked = |first: usize| {
            let mut out = vec![0.0; (depth - 1) * channels];
            for (channel, (series, spread)) in record.iter().zip(spreads).enumerate() {
                for time in 0..depth - 1 {
                    out[stacked_position(time, channel, channels)] =
                        (series[first + time] - spread.mean) / spread.deviation;
                }
            }
            out
        };
        Self {
            channels,
            before: stacked(0),
            after: stacked(columns),
        }
    }

    fn before(&self, time: usize, channel: usize) -> f64 {
        self.before[stacked_position(time, channel, self.channels)]
    }

    fn after(&self, time: usize, channel: usize) -> f64 {
        self.after[stacked_position(time, channel, self.channels)]
    }
}
