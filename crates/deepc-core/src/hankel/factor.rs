//! The triangular factor of a Hankel matrix that is never held: for long recordings.

use std::fmt;

use faer::{Mat, MatRef, Side};
use serde::{Deserialize, Serialize};

use super::error::HankelError;
use super::gram::{Channels, gram, spreads};
use super::proof::{HankelData, PersistentlyExciting};
use super::rank::ChannelScales;
use super::shape::{Horizons, Shape};
use super::stacking::{stacked_position, windows};
use super::triangle::{BlockQr, Triangle};
use super::{Arrangement, ExcitationReport, check};
use crate::data::{Dataset, Record};
use crate::linalg;

/// A Gram matrix whose condition number is above this is not used.
///
/// The Cholesky factor reproduces H Hᵀ to rounding of its largest entries, so that the weakest
/// direction of the data is known to about ε·κ of itself: at 1e10 (a direction with 1e-5 of the
/// strongest one's size) to 2e-6 of itself, which is 2e-11 of the signal, far below any sensor. A
/// QR decomposition of H itself knows it to ε·√κ.
pub const GRAM_CONDITION_LIMIT: f64 = 1e10;

/// How a factor was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FactorMethod {
    /// Cholesky decomposition of H Hᵀ, summed by its displacement structure: O(T·L·c²) for c
    /// channels.
    Gram,
    /// QR decompositions of blocks of columns, each with the factor so far: O(T·(cL)²), and as
    /// exact as that of the whole. A million samples with 600 rows take half a minute, not a
    /// second.
    BlockQr,
}

/// How the factor of a long recording came about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FactorReport {
    /// The method that gave the factor.
    pub method: FactorMethod,
    /// Rows of H.
    pub rows: usize,
    /// Columns J of H.
    pub columns: usize,
    /// Estimated 2-norm condition number of the Gram matrix, of centred channels with unit
    /// standard deviation. `None` if it was not tried, or is not positive definite in floating point (data
    /// without noise, fewer columns than rows).
    pub gram_condition: Option<f64>,
    /// The Gram matrix was tried and found too badly conditioned ([`GRAM_CONDITION_LIMIT`]).
    pub fell_back: bool,
}

impl fmt::Display for FactorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let method = match self.method {
            FactorMethod::Gram => "Cholesky decomposition of the Gram matrix",
            FactorMethod::BlockQr => "QR decomposition by blocks of columns",
        };
        write!(f, "{}×{} Hankel matrix: {method}", self.rows, self.columns)?;
        match self.gram_condition {
            Some(condition) => write!(f, ", condition of the Gram matrix {condition:.1e}")?,
            None if self.fell_back => write!(f, ", the Gram matrix is not positive definite")?,
            None => {}
        }
        if self.fell_back {
            write!(f, " (limit {GRAM_CONDITION_LIMIT:.0e}; fell back)")?;
        }
        Ok(())
    }
}

/// Rᵀ of the stacked block Hankel matrix, Hᵀ = QR, computed from the recording in bounded memory:
/// (m + q + p)L×min((m + q + p)L, J), lower triangular, rows as those of [`super::HankelMatrix`].
///
/// For recordings so long that H does not fit: memory does not grow with T. A million samples with
/// 600 rows take about a second and, beside the recording, 40 MB.
///
/// ```
/// use deepc_core::data::Dataset;
/// use deepc_core::hankel::{HankelFactor, Horizons};
/// use deepc_core::predictor::Predictor;
///
/// // A first-order plant, shaken by a pseudo-random input, measured with an error.
/// let (mut state, mut noise, mut inputs, mut outputs) = (0.0, 0.3, Vec::new(), Vec::new());
/// for _ in 0..20_000 {
///     noise = (noise * 997.0_f64).fract(); // 0 to 1
///     let input = (noise * 89.0).fract() - 0.5;
///     state = 0.9 * state + input;
///     inputs.push(input);
///     outputs.push(state + 0.02 * (noise * 71.0).fract());
/// }
/// let mut data = Dataset::new(0.1, ["valve"], ["level"])?;
/// data.push_rows(&inputs, &outputs)?;
///
/// let factor = HankelFactor::stream(&data, Horizons::new(4, 10))?;
/// println!("{}", factor.report()); // how, and how well conditioned
/// let exciting = factor.require_persistently_exciting(2)?;
/// let predictor = Predictor::streamed(&exciting);
/// assert_eq!(predictor.stacked().shape(), (28, 28));
/// assert_eq!(predictor.reduction().columns_before, 20_000 - 13);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct HankelFactor {
    dataset: Dataset,
    shape: Shape,
    lower: Mat<f64>,
    report: FactorReport,
}

impl HankelFactor {
    /// By the Gram matrix where that is exact enough, else by blocks of columns.
    ///
    /// # Errors
    /// As [`super::HankelMatrix::build`].
    pub fn stream(dataset: &Dataset, horizons: Horizons) -> Result<Self, HankelError> {
        Self::stream_by(dataset, horizons, FactorMethod::Gram)
    }

    /// By the method given; [`FactorMethod::Gram`] still falls back.
    ///
    /// # Errors
    /// As [`super::HankelMatrix::build`].
    pub fn stream_by(
        dataset: &Dataset,
        horizons: Horizons,
        method: FactorMethod,
    ) -> Result<Self, HankelError> {
        let shape = check(dataset, horizons)?;
        let records: Vec<_> = dataset.records().iter().map(Record::channels).collect();
        let positions = shape.positions();
        let (lower, report) = factor(
            &records,
            horizons.window(),
            &positions,
            OnesRow::Without,
            method,
        );
        Ok(Self {
            dataset: dataset.clone(),
            shape,
            lower,
            report,
        })
    }

    /// Measures persistent excitation of order L + `plant_order`, in bounded memory: all ranks
    /// are those of triangular factors.
    ///
    /// # Errors
    /// Only if a singular value decomposition does not converge.
    pub fn excitation(&self, plant_order: usize) -> Result<ExcitationReport, HankelError> {
        ExcitationReport::measure(self, plant_order)
    }

    /// Proves persistent excitation of order L + `plant_order`, where `plant_order` is an upper
    /// bound on the order n of the plant.
    ///
    /// # Errors
    /// Too few samples, or inputs that do not excite: the message says what to record.
    pub fn require_persistently_exciting(
        self,
        plant_order: usize,
    ) -> Result<PersistentlyExciting<Self>, HankelError> {
        PersistentlyExciting::require(self, plant_order)
    }

    /// Declares the inputs persistently exciting without looking.
    #[must_use]
    pub fn assume_persistently_exciting(self) -> PersistentlyExciting<Self> {
        PersistentlyExciting::assume(self)
    }

    /// The data set it was built from.
    #[must_use]
    pub fn dataset(&self) -> &Dataset {
        &self.dataset
    }

    /// Sizes.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Number of columns J that H would have.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.report.columns
    }

    /// Rᵀ.
    #[must_use]
    pub fn lower(&self) -> MatRef<'_, f64> {
        self.lower.as_ref()
    }

    /// How it was computed.
    #[must_use]
    pub fn report(&self) -> &FactorReport {
        &self.report
    }
}

impl HankelData for HankelFactor {
    fn dataset(&self) -> &Dataset {
        &self.dataset
    }

    fn shape(&self) -> Shape {
        self.shape
    }

    fn arrangement(&self) -> Arrangement {
        Arrangement::Hankel
    }

    fn scaled_stacked(&self, scales: &ChannelScales) -> Mat<f64> {
        let scales = scales.per_row(self.shape);
        Mat::from_fn(self.lower.nrows(), self.lower.ncols(), |i, j| {
            self.lower[(i, j)] / scales[i]
        })
    }

    fn scaled_inputs(&self, channels: &[usize], depth: usize, scales: &[f64]) -> (Mat<f64>, usize) {
        let records = self.dataset.records().iter();
        let long = records.filter(|record| windows(record.samples(), depth) > 0);
        let records: Vec<Channels<'_>> = long
            .map(|record| {
                let all = record.channels();
                channels.iter().map(|&channel| all[channel]).collect()
            })
            .collect();
        let rows = channels.len().saturating_mul(depth);
        if records.is_empty() {
            return (Mat::zeros(rows, 0), 0);
        }
        let positions: Vec<_> = (0..rows).collect();
        let (mut lower, report) = factor(
            &records,
            depth,
            &positions,
            OnesRow::Without,
            FactorMethod::Gram,
        );
        for j in 0..lower.ncols() {
            for (i, value) in lower.col_as_slice_mut(j).iter_mut().enumerate() {
                *value /= scales[i % channels.len()];
            }
        }
        (lower, report.columns)
    }
}

/// Whether a row of ones stands on top of a Hankel matrix.
///
/// Behind it, the triangle is that of H with the mean of every row taken out: constants of any
/// size in the channels change nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnesRow {
    /// H as it is.
    Without,
    /// `col(1, H)`, one row more.
    OnTop,
}

/// Factor of the block Hankel matrix of the channels; time-major row r of it stands at
/// `positions[r]`, below the ones. Every record has at least `depth` samples.
pub(super) fn factor(
    records: &[Channels<'_>],
    depth: usize,
    positions: &[usize],
    ones: OnesRow,
    method: FactorMethod,
) -> (Mat<f64>, FactorReport) {
    let rows = positions.len() + usize::from(ones == OnesRow::OnTop);
    let columns = records.iter().map(|r| starts(r, depth)).sum();
    let mut report = FactorReport {
        method,
        rows,
        columns,
        gram_condition: None,
        fell_back: false,
    };
    if method == FactorMethod::Gram {
        if columns > rows {
            let (condition, lower) = by_gram(records, depth, positions, ones);
            report.gram_condition = condition;
            if let Some(lower) = lower {
                return (lower, report);
            }
            report.fell_back = true;
        }
        report.method = FactorMethod::BlockQr;
    }
    let lower = by_blocks(records, depth, positions, ones);
    (lower.subcols(0, rows.min(columns)).to_owned(), report)
}

pub(super) fn starts(record: &Channels<'_>, depth: usize) -> usize {
    windows(record.first().map_or(0, |series| series.len()), depth)
}

/// The condition number, if the Gram matrix is positive definite; the factor, if it is good
/// enough.
fn by_gram(
    records: &[Channels<'_>],
    depth: usize,
    positions: &[usize],
    ones: OnesRow,
) -> (Option<f64>, Option<Mat<f64>>) {
    let spreads = spreads(records);
    let mut row_spreads = vec![spreads[0]; positions.len()];
    for time in 0..depth {
        for (channel, &spread) in spreads.iter().enumerate() {
            row_spreads[positions[stacked_position(time, channel, spreads.len())]] = spread;
        }
    }
    let gram = gram(records, &spreads, depth, positions);
    let Ok(cholesky) = gram.llt(Side::Lower) else {
        return (None, None);
    };
    // Columns: the row of ones, then H̃.
    let augmented = cholesky.L();
    let condition = gram_condition(augmented);
    if condition.is_nan() || condition > GRAM_CONDITION_LIMIT {
        return (Some(condition), None);
    }
    // R̃·[μᵀ; diag(σ)] is a triangle below one full row: the triangle, updated by that row.
    let n = positions.len();
    let first = (row_spreads.iter().enumerate()).map(|(i, spread)| {
        spread.mean * augmented[(0, 0)] + spread.deviation * augmented[(1 + i, 0)]
    });
    if ones == OnesRow::OnTop {
        let mut lower = Mat::zeros(1 + n, 1 + n);
        lower[(0, 0)] = augmented[(0, 0)];
        for (i, first) in first.enumerate() {
            lower[(1 + i, 0)] = first;
            for j in 0..=i {
                lower[(1 + i, 1 + j)] = row_spreads[i].deviation * augmented[(1 + i, 1 + j)];
            }
        }
        return (Some(condition), Some(lower));
    }
    let mut triangle = Triangle::of(Mat::from_fn(n, n, |i, j| {
        if i < j {
            0.0
        } else {
            row_spreads[i].deviation * augmented[(1 + i, 1 + j)]
        }
    }));
    triangle.update(&mut first.collect::<Vec<_>>());
    (Some(condition), Some(triangle.into_lower()))
}

/// Estimates the condition number of L·Lᵀ by power iterations on it and its inverse: from below,
/// and seldom by more than a tenth.
pub(super) fn gram_condition(lower: MatRef<'_, f64>) -> f64 {
    const ITERATIONS: usize = 15;
    let n = lower.nrows();
    let growth = |apply: &dyn Fn(&mut Vec<f64>)| -> f64 {
        // Any vector that is unlikely to be orthogonal to the one sought: fractions of k·φ.
        let mut x: Vec<_> = (0..n)
            .map(|k| 0.5 + (k as f64 * 0.618_034).fract())
            .collect();
        let mut size = 0.0;
        for _ in 0..ITERATIONS {
            apply(&mut x);
            size = linalg::dot(&x, &x).sqrt();
            for value in &mut x {
                *value /= size;
            }
        }
        size
    };
    let largest = growth(&|x| {
        let mut product = vec![0.0; n];
        linalg::multiply(&mut product, lower.transpose(), x);
        linalg::multiply(x, lower, &product);
    });
    let inverse = growth(&|x| {
        linalg::solve_lower(lower, x);
        linalg::solve_upper(lower.transpose(), x);
    });
    largest * inverse
}

fn by_blocks(
    records: &[Channels<'_>],
    depth: usize,
    positions: &[usize],
    ones: OnesRow,
) -> Mat<f64> {
    let offset = usize::from(ones == OnesRow::OnTop);
    let mut triangle = Triangle::new(offset + positions.len());
    let mut qr = BlockQr::new(offset + positions.len());
    for record in records {
        for start in 0..starts(record, depth) {
            qr.push(&mut triangle, |column| {
                column[..offset].fill(1.0);
                let column = &mut column[offset..];
                for (channel, series) in record.iter().enumerate() {
                    for (time, &value) in series[start..start + depth].iter().enumerate() {
                        column[positions[stacked_position(time, channel, record.len())]] = value;
                    }
                }
            });
        }
    }
    qr.finish(&mut triangle);
    triangle.into_lower()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_condition_is_that_of_the_singular_values() {
        let lower = Mat::from_fn(60, 60, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => 10.0_f64.powf(-(i as f64) / 20.0),
            std::cmp::Ordering::Greater => 0.01 * ((3 * i + j * j) as f64).sin(),
        });
        let sigma = lower.singular_values().unwrap();
        let exact = (sigma[0] / sigma[59]).powi(2);
        let found = gram_condition(lower.as_ref());
        assert!(
            found > 0.8 * exact && found < exact * (1.0 + 1e-6),
            "{found:e} for {exact:e}"
        );
    }
}
