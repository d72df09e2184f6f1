//! Stage 3: the data matrix the controller predicts with, reduced or not.
//!
//! Every trajectory the controller can predict is H̄ ḡ for some ḡ. Which H̄ that is:
//!
//! | | H̄ | exact? |
//! |---|---|---|
//! | [`Predictor::full`] | H | – |
//! | [`Predictor::exact`] | H V₁ = W₁Σ₁, the SVD of H to its numerical rank | yes, for every cost that weighs g by its squared 2-norm ‖g‖²: the least-norm g lies in range(V₁) and ‖V₁ḡ‖ = ‖ḡ‖ (Zhang, Zheng, Shang, Li 2023). **Not** for ‖g‖₁. |
//! | [`Predictor::truncated`] | W₁Σ₁ with fewer singular values | no: another problem. Directions the plant can move in are gone, and with heavy slack weights (1e8) the controller then spends its effort on explaining the past with what is left. Look at [`Reduction::channel_energy_lost`] first. |

mod error;
mod reduction;

use faer::{Mat, MatRef};

pub use error::PredictorError;
pub use reduction::{Reduction, ReductionMethod};

use crate::hankel::{PersistentlyExciting, Shape};

/// The data matrix H̄ of a `DeePC` problem, (m + p)L×q, rows `col(u_ini, y_ini, u, y)`, with
/// what was done to get it.
#[derive(Debug, Clone)]
pub struct Predictor {
    shape: Shape,
    sample_time_s: f64,
    input_names: Vec<String>,
    output_names: Vec<String>,
    matrix: Mat<f64>,
    row_scales: Vec<f64>,
    reduction: Reduction,
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

    fn assemble(data: &PersistentlyExciting, matrix: Mat<f64>, reduction: Reduction) -> Self {
        let hankel = data.hankel();
        let dataset = hankel.dataset();
        let (input_scales, output_scales) = hankel.channel_scales();
        Self {
            shape: hankel.shape(),
            sample_time_s: dataset.sample_time_s(),
            input_names: dataset.input_names().to_vec(),
            output_names: dataset.output_names().to_vec(),
            matrix,
            row_scales: hankel.shape().per_row(&input_scales, &output_scales),
            reduction,
        }
    }

    /// Sizes.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Sample time in seconds.
    #[must_use]
    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Input channel names.
    #[must_use]
    pub fn input_names(&self) -> &[String] {
        &self.input_names
    }

    /// Output channel names.
    #[must_use]
    pub fn output_names(&self) -> &[String] {
        &self.output_names
    }

    /// What was reduced.
    #[must_use]
    pub fn reduction(&self) -> &Reduction {
        &self.reduction
    }

    /// The whole matrix H̄, (m + p)L×q.
    #[must_use]
    pub fn stacked(&self) -> MatRef<'_, f64> {
        self.matrix.as_ref()
    }

    /// `U_p`, m·`T_ini`×q.
    #[must_use]
    pub fn past_inputs(&self) -> MatRef<'_, f64> {
        self.block(0)
    }

    /// `Y_p`, p·`T_ini`×q.
    #[must_use]
    pub fn past_outputs(&self) -> MatRef<'_, f64> {
        self.block(1)
    }

    /// `U_f`, m·N×q.
    #[must_use]
    pub fn future_inputs(&self) -> MatRef<'_, f64> {
        self.block(2)
    }

    /// `Y_f`, p·N×q.
    #[must_use]
    pub fn future_outputs(&self) -> MatRef<'_, f64> {
        self.block(3)
    }

    /// Root mean square of the channel behind every row; for decisions that must not depend on
    /// units.
    pub(crate) fn row_scales(&self) -> &[f64] {
        &self.row_scales
    }

    fn block(&self, index: usize) -> MatRef<'_, f64> {
        let (first, rows) = self.shape.blocks()[index];
        self.matrix.subrows(first, rows)
    }
}
