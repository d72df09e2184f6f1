//! A predictor that takes in new data while the plant runs.

use faer::Mat;
use serde::{Deserialize, Serialize};

use super::error::PredictorError;
use super::recent::Recent;
use super::reduction::Reduction;
use super::{PlantData, Predictor};
use crate::data::{Dataset, Record};
use crate::hankel::{BlockQr, GRAM_CONDITION_LIMIT, HankelData, PersistentlyExciting, Triangle};

/// Below this α² a downdate would lose six digits of some direction: rebuild instead.
const LEAST_ALPHA_SQUARED: f64 = 1e-6;

/// Rounding in the weakest direction, relative to it, at which a sliding window is rebuilt: what
/// a Gram matrix at its limit would lose.
const DRIFT_LIMIT: f64 = f64::EPSILON * GRAM_CONDITION_LIMIT;

/// What becomes of old data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Memory {
    /// All data count alike for ever.
    Growing,
    /// Every new column multiplies the weight of all columns before it in H Hᵀ by γ. Data that
    /// stop exciting the plant are forgotten into a singular factor: watch
    /// [`OnlineFactor::condition_guess`].
    Forgetting {
        /// γ, above 0 and at most 1; the data then weigh as much as 1/(1 − γ) columns.
        factor: f64,
    },
    /// Only the latest samples count.
    Sliding {
        /// How many.
        samples: usize,
    },
}

/// What a sample did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnlineUpdate {
    /// The present record is not yet as long as a window.
    Waiting {
        /// Samples that are missing.
        missing: usize,
    },
    /// A column joined the data.
    Added,
    /// The sliding window was factored afresh, because rounding had grown or a direction of the
    /// data hung on the column that left.
    Rebuilt,
    /// A value is not finite or a signal has the wrong length. The sample counts as lost: a new
    /// record begins after it.
    Refused,
}

/// The triangular factor R of Hᵀ = QR (see [`Predictor::compact`]), kept up to date sample by
/// sample: a column joins by n = (m + q + p)L Givens rotations and leaves by as many, O(n²)
/// without allocation (Golub, Van Loan, Matrix Computations, 6.5; recursive updates of
/// `DeePC`'s data, there of an SVD: Shi, Lian, Jones 2024, arXiv 2309.13755).
///
/// No column crosses from one record to the next: a record begins with the first sample pushed,
/// and wherever [`OnlineFactor::lose_sample`] says that one is missing.
///
/// A sliding window is rebuilt where rounding could be felt, which costs a QR decomposition of
/// the window. Data (nearly) without noise make every update a rebuild; forget exponentially
/// there.
///
/// ```
/// use deepc_core::data::Dataset;
/// use deepc_core::hankel::{HankelMatrix, Horizons};
/// use deepc_core::predictor::{Memory, OnlineFactor, OnlineUpdate};
///
/// let shake = |k: u32| f64::from(k * k * 7 % 101) / 50.0 - 1.0;
/// let (mut level, mut inputs, mut outputs) = (0.0, Vec::new(), Vec::new());
/// for k in 0..100 {
///     level = 0.9 * level + shake(k);
///     inputs.push(shake(k));
///     outputs.push(level);
/// }
/// let mut data = Dataset::new(0.1, ["valve"], ["level"])?;
/// data.push_rows(&inputs, &outputs)?;
/// let hankel = HankelMatrix::build(&data, Horizons::new(2, 3))?;
/// let exciting = hankel.require_persistently_exciting(1)?;
///
/// let mut online = OnlineFactor::new(&exciting, Memory::Forgetting { factor: 0.99 })?;
/// let mut update = OnlineUpdate::Waiting { missing: 5 };
/// for k in 100..105 {
///     level = 0.8 * level + shake(k); // the plant has changed
///     update = online.push(&[shake(k)], &[], &[level]);
/// }
/// assert_eq!(update, OnlineUpdate::Added); // the first window of the new record
/// let predictor = online.to_predictor();
/// assert_eq!(predictor.reduction().columns_before, 62); // Σγᵏ of 97 columns
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct OnlineFactor {
    plant: PlantData,
    memory: Memory,
    /// Of the rows divided by their scales.
    triangle: Triangle,
    recent: Recent,
    column: Vec<f64>,
    work: Vec<f64>,
    /// Columns, as they weigh.
    columns: f64,
    /// Σ ε/α² over the downdates since the last rebuild.
    drift: f64,
    qr: BlockQr,
    rebuilds: usize,
}

impl OnlineFactor {
    /// Starts from all records of a data set that excites the plant, in their order. The scales
    /// of the channels stay those of this data set. What is pushed later is a new record.
    ///
    /// # Errors
    /// γ is out of range, or the window is too short for as many columns as H has rows.
    pub fn new<D: HankelData>(
        data: &PersistentlyExciting<D>,
        memory: Memory,
    ) -> Result<Self, PredictorError> {
        let (dataset, shape) = (data.data().dataset(), data.data().shape());
        let (n, window) = (shape.rows(), shape.horizons.window());
        let kept = match memory {
            Memory::Growing => window,
            Memory::Forgetting { factor } if factor > 0.0 && factor <= 1.0 => window,
            Memory::Forgetting { factor } => {
                return Err(PredictorError::ForgettingFactor { found: factor });
            }
            // One more: the old column leaves after the new one came.
            Memory::Sliding { samples } if samples >= n + window - 1 => samples + 1,
            Memory::Sliding { samples } => {
                return Err(PredictorError::SlidingWindow {
                    found: samples,
                    needed: n + window - 1,
                });
            }
        };
        let plant = PlantData::of(dataset, shape);
        let mut online = Self {
            triangle: Triangle::new(n),
            recent: Recent::new(&plant, kept),
            plant,
            memory,
            column: vec![0.0; n],
            work: vec![0.0; n],
            columns: 0.0,
            drift: 0.0,
            qr: BlockQr::new(n),
            rebuilds: 0,
        };
        online.start(dataset);
        Ok(online)
    }

    fn start(&mut self, dataset: &Dataset) {
        let window = self.plant.shape.horizons.window();
        let lengths = dataset.records().iter().map(Record::samples);
        let mut later: usize = lengths
            .map(|samples| (samples + 1).saturating_sub(window))
            .sum();
        for record in dataset.records() {
            self.lose_sample();
            let channels = record.channels();
            for k in 0..record.samples() {
                self.recent.push(channels.iter().map(|series| series[k]));
                let Some(start) = self.recent.newest_column() else {
                    continue;
                };
                later = later.saturating_sub(1);
                let weight = match self.memory {
                    Memory::Growing => 1.0,
                    Memory::Forgetting { factor } => factor.powf(later as f64),
                    Memory::Sliding { .. } => continue,
                };
                let (recent, root) = (&self.recent, weight.sqrt());
                self.qr.push(&mut self.triangle, |column| {
                    recent.write_column(start, column);
                    for value in column {
                        *value *= root;
                    }
                });
                self.columns += weight;
            }
        }
        self.lose_sample();
        self.qr.finish(&mut self.triangle);
        if matches!(self.memory, Memory::Sliding { .. }) {
            self.rebuild();
            self.rebuilds = 0;
        }
    }

    /// The next sample begins a new record: call it where a sample was lost.
    pub fn lose_sample(&mut self) {
        self.recent.begin_record();
    }

    /// Takes one sample: u(k), d(k) and the y(k) measured at the end of that interval, in the
    /// units of the data.
    pub fn push(&mut self, inputs: &[f64], disturbances: &[f64], outputs: &[f64]) -> OnlineUpdate {
        let shape = self.plant.shape;
        let lengths = (inputs.len(), disturbances.len(), outputs.len());
        let values = inputs.iter().chain(disturbances).chain(outputs).copied();
        if lengths != (shape.inputs, shape.disturbances, shape.outputs)
            || values.clone().any(|value| !value.is_finite())
        {
            self.lose_sample();
            return OnlineUpdate::Refused;
        }
        self.recent.push(values);
        let mut update = OnlineUpdate::Waiting {
            missing: self.recent.missing(),
        };
        if let Some(start) = self.recent.newest_column() {
            if let Memory::Forgetting { factor } = self.memory {
                self.triangle.scale(factor.sqrt());
                self.columns *= factor;
            }
            self.recent.write_column(start, &mut self.column);
            self.triangle.update(&mut self.column);
            self.columns += 1.0;
            update = OnlineUpdate::Added;
        }
        if let Memory::Sliding { samples } = self.memory
            && let Some(oldest) = self.recent.samples().checked_sub(samples + 1)
            && self.recent.is_column(oldest)
            && !self.remove(oldest)
        {
            self.rebuild();
            update = OnlineUpdate::Rebuilt;
        }
        update
    }

    /// Removes a column; `false` if the factor must be rebuilt.
    fn remove(&mut self, start: usize) -> bool {
        self.recent.write_column(start, &mut self.column);
        let alpha_squared =
            self.triangle
                .downdate(&mut self.column, &mut self.work, LEAST_ALPHA_SQUARED);
        let Some(alpha_squared) = alpha_squared else {
            return false;
        };
        self.columns -= 1.0;
        self.drift += f64::EPSILON / alpha_squared;
        self.drift * self.condition_guess().powi(2) <= DRIFT_LIMIT
    }

    /// Factors the sliding window from its samples.
    fn rebuild(&mut self) {
        let Memory::Sliding { samples } = self.memory else {
            return;
        };
        self.qr.restart(&mut self.triangle);
        self.columns = 0.0;
        let end = self.recent.samples();
        let window = self.plant.shape.horizons.window();
        for start in end.saturating_sub(samples)..(end + 1).saturating_sub(window) {
            if self.recent.is_column(start) {
                let recent = &self.recent;
                self.qr.push(&mut self.triangle, |column| {
                    recent.write_column(start, column);
                });
                self.columns += 1.0;
            }
        }
        self.qr.finish(&mut self.triangle);
        self.drift = 0.0;
        self.rebuilds += 1;
    }

    /// The predictor of the data as they are now. Allocates.
    #[must_use]
    pub fn to_predictor(&self) -> Predictor {
        let (lower, scales) = (self.triangle.lower(), &self.plant.row_scales);
        let matrix = Mat::from_fn(lower.nrows(), lower.ncols(), |i, j| {
            lower[(i, j)] * scales[i]
        });
        // Not negative, and far below 2⁵².
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let columns = self.columns.round().max(1.0) as usize;
        Predictor {
            reduction: Reduction::lossless(&self.plant, columns, matrix.ncols()),
            plant: self.plant.clone(),
            matrix,
        }
    }

    /// Columns of the data, as they weigh: their number, or Σγᵏ.
    #[must_use]
    pub fn columns(&self) -> f64 {
        self.columns
    }

    /// Ratio of the largest to the smallest pivot of R, channels scaled: a lower bound on the
    /// condition number of H, and a good guess. It rises when the data stop exciting the plant,
    /// and is infinite if they do not span all rows.
    #[must_use]
    pub fn condition_guess(&self) -> f64 {
        let (smallest, largest) = self.triangle.pivots();
        if smallest == 0.0 {
            f64::INFINITY
        } else {
            largest / smallest
        }
    }

    /// How often the sliding window was rebuilt.
    #[must_use]
    pub fn rebuilds(&self) -> usize {
        self.rebuilds
    }
}
