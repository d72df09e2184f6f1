//! Stage 3: the data matrix the controller predicts with, reduced or not.
//!
//! Every trajectory the controller can predict is H̄ ḡ for some ḡ. Which H̄ that is:
//!
//! | | H̄ | exact? |
//! |---|---|---|
//! | [`Predictor::full`] | H | – |
//! | [`Predictor::compact`] | Rᵀ, with Hᵀ = QR | yes, for every cost that weighs g by its squared 2-norm ‖g‖²: g = Qḡ loses nothing that H sees, and ‖Qḡ‖ = ‖ḡ‖. **Not** for ‖g‖₁. Several times cheaper than the SVD; keeps all rows' worth of columns. |
//! | [`Predictor::streamed`] | Rᵀ, without ever holding H | as `compact`; for long recordings |
//! | [`Predictor::exact`] | H V₁ = W₁Σ₁, the SVD of H to its numerical rank | as `compact`: the least-norm g lies in range(V₁) and ‖V₁ḡ‖ = ‖ḡ‖ (Zhang, Zheng, Shang, Li 2023). Fewer columns where data have little noise. |
//! | [`Predictor::truncated`] | W₁Σ₁ with fewer singular values | no: another problem. Directions the plant can move in are gone, and with heavy slack weights (1e8) the controller then spends its effort on explaining the past with what is left. Look at [`Reduction::channel_energy_lost`] first. |
//!
//! Data that come in while the controller runs: [`OnlineFactor`]. Several operating points:
//! [`ScheduledPredictors`].

mod error;
mod online;
mod recent;
mod reduction;
mod schedule;

use faer::{Mat, MatRef};

pub use error::PredictorError;
pub use online::{Memory, OnlineFactor, OnlineUpdate};
pub use reduction::{Reduction, ReductionMethod};
pub use schedule::{Schedule, ScheduledPredictors};

use crate::data::Dataset;
use crate::hankel::{Blocks, ChannelScales, HankelFactor, PersistentlyExciting, Shape};

/// The data matrix H̄ of a `DeePC` problem, (m + q + p)L×c, rows `col(u_ini, d_ini, y_ini, d, u, y)`,
/// with what was done to get it.
#[derive(Debug, Clone)]
pub struct Predictor {
    plant: PlantData,
    matrix: Mat<f64>,
    reduction: Reduction,
}

/// What is known of the plant beside the matrix.
#[derive(Debug, Clone)]
struct PlantData {
    shape: Shape,
    sample_time_s: f64,
    input_names: Vec<String>,
    disturbance_names: Vec<String>,
    output_names: Vec<String>,
    /// Root mean square of the channel behind every row.
    row_scales: Vec<f64>,
}

impl PlantData {
    fn of(dataset: &Dataset, shape: Shape) -> Self {
        Self {
            shape,
            sample_time_s: dataset.sample_time_s(),
            input_names: dataset.input_names().to_vec(),
            disturbance_names: dataset.disturbance_names().to_vec(),
            output_names: dataset.output_names().to_vec(),
            row_scales: ChannelScales::of(dataset).per_row(shape),
        }
    }

    /// Inputs, disturbances, outputs.
    fn all_names(&self) -> Vec<String> {
        let names = [
            &self.input_names,
            &self.disturbance_names,
            &self.output_names,
        ];
        names.into_iter().flatten().cloned().collect()
    }
}

impl Predictor {
    /// The Hankel matrix as it is.
    #[must_use]
    pub fn full(data: &PersistentlyExciting) -> Self {
        let hankel = data.hankel();
        let reduction = Reduction::none(hankel);
        Self::assemble(data, hankel.stacked().to_owned(), reduction)
    }

    /// Reduced to its numerical rank ([`crate::hankel::RANK_TOLERANCE`], channels scaled first):
    /// same optimum, fewer columns.
    ///
    /// # Errors
    /// The singular value decomposition does not converge.
    pub fn exact(data: &PersistentlyExciting) -> Result<Self, PredictorError> {
        let (matrix, reduction) = reduction::exact(data.hankel())?;
        Ok(Self::assemble(data, matrix, reduction))
    }

    /// Only the `rank` largest singular values of H, in the units of the data. An approximation:
    /// see [`Reduction::energy_lost`].
    ///
    /// # Errors
    /// `rank` is 0 or above the smaller dimension of H, or the decomposition does not converge.
    pub fn truncated(data: &PersistentlyExciting, rank: usize) -> Result<Self, PredictorError> {
        let (matrix, reduction) = reduction::truncated(data.hankel(), rank)?;
        Ok(Self::assemble(data, matrix, reduction))
    }

    /// In an orthonormal basis of the row space of H, by a QR decomposition of Hᵀ: same optimum,
    /// min((m + q + p)L, J) columns, lower triangular. For data with noise, whose rank is full
    /// anyway, at a fraction of the cost of [`Predictor::exact`].
    #[must_use]
    pub fn compact(data: &PersistentlyExciting) -> Self {
        let hankel = data.hankel();
        let qr = hankel.stacked().transpose().qr();
        let r = qr.thin_R();
        let matrix = Mat::from_fn(
            r.ncols(),
            r.nrows(),
            |i, j| if j <= i { r[(j, i)] } else { 0.0 },
        );
        let reduction = Reduction::lossless(
            &PlantData::of(hankel.dataset(), hankel.shape()),
            hankel.columns(),
            matrix.ncols(),
        );
        Self::assemble(data, matrix, reduction)
    }

    /// As [`Predictor::compact`], from a factor that was computed without holding H: for
    /// recordings of any length. [`HankelFactor::report`] says how exact it is.
    #[must_use]
    pub fn streamed(data: &PersistentlyExciting<HankelFactor>) -> Self {
        let factor = data.data();
        let matrix = factor.lower().to_owned();
        let plant = PlantData::of(factor.dataset(), factor.shape());
        Self {
            reduction: Reduction::lossless(&plant, factor.columns(), matrix.ncols()),
            plant,
            matrix,
        }
    }

    fn assemble(data: &PersistentlyExciting, matrix: Mat<f64>, reduction: Reduction) -> Self {
        let hankel = data.hankel();
        Self {
            plant: PlantData::of(hankel.dataset(), hankel.shape()),
            matrix,
            reduction,
        }
    }

    /// Sizes.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.plant.shape
    }

    /// Sample time in seconds.
    #[must_use]
    pub fn sample_time_s(&self) -> f64 {
        self.plant.sample_time_s
    }

    /// Input channel names.
    #[must_use]
    pub fn input_names(&self) -> &[String] {
        &self.plant.input_names
    }

    /// Names of the measured disturbances.
    #[must_use]
    pub fn disturbance_names(&self) -> &[String] {
        &self.plant.disturbance_names
    }

    /// Output channel names.
    #[must_use]
    pub fn output_names(&self) -> &[String] {
        &self.plant.output_names
    }

    /// What was reduced.
    #[must_use]
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// The whole matrix H̄, (m + q + p)L×c.
    #[must_use]
    pub fn stacked(&self) -> MatRef<'_, f64> {
        self.matrix.as_ref()
    }

    /// Its blocks by name, c columns each.
    #[must_use]
    pub fn blocks(&self) -> Blocks<'_> {
        Blocks::of(self.stacked(), self.plant.shape)
    }

    /// Root mean square of the channel behind every row; for decisions that must not depend on
    /// units.
    pub(crate) fn row_scales(&self) -> &[f64] {
        &self.plant.row_scales
    }
}
