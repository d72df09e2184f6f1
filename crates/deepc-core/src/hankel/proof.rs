//! The proof type that a predictor needs: data whose inputs excite.

use faer::Mat;

use super::error::HankelError;
use super::rank::ChannelScales;
use super::{Arrangement, ExcitationReport, HankelMatrix, Shape};
use crate::data::Dataset;

/// What persistent excitation is measured on: [`HankelMatrix`] or
/// [`HankelFactor`](super::HankelFactor). Nobody else implements it.
pub trait HankelData: sealed::Sealed {
    /// The data set it was built from.
    fn dataset(&self) -> &Dataset;

    /// Sizes.
    fn shape(&self) -> Shape;

    /// How its columns were taken from the records.
    fn arrangement(&self) -> Arrangement;

    /// H, or a matrix with the same singular values, channels divided by their scales.
    #[doc(hidden)]
    fn scaled_stacked(&self, scales: &ChannelScales) -> Mat<f64>;

    /// The matrix of input windows of `depth` samples of these channels (of the inputs and
    /// disturbances together), or one with the same singular values, channels divided by their
    /// scales; and the number of windows.
    #[doc(hidden)]
    fn scaled_inputs(&self, channels: &[usize], depth: usize, scales: &[f64]) -> (Mat<f64>, usize);
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::super::HankelMatrix {}
    impl Sealed for super::super::HankelFactor {}
}

/// A Hankel matrix, or the factor of one, whose inputs were shown, or are declared, to be
/// persistently exciting.
#[derive(Debug, Clone)]
pub struct PersistentlyExciting<D = HankelMatrix> {
    data: D,
    report: Option<ExcitationReport>,
}

impl<D: HankelData> PersistentlyExciting<D> {
    pub(super) fn require(data: D, plant_order: usize) -> Result<Self, HankelError> {
        let report = ExcitationReport::measure(&data, plant_order)?;
        if report.columns < report.columns_needed {
            return Err(HankelError::TooFewSamples(Box::new(report)));
        }
        if !report.is_persistently_exciting() {
            return Err(HankelError::NotPersistentlyExciting(Box::new(report)));
        }
        Ok(Self {
            data,
            report: Some(report),
        })
    }

    pub(super) fn assume(data: D) -> Self {
        Self { data, report: None }
    }

    /// The data.
    #[must_use]
    pub fn data(&self) -> &D {
        &self.data
    }

    /// The measurement behind this proof; `None` if it was assumed.
    #[must_use]
    pub fn report(&self) -> Option<&ExcitationReport> {
        self.report.as_ref()
    }
}

impl PersistentlyExciting {
    /// The Hankel matrix.
    #[must_use]
    pub fn hankel(&self) -> &HankelMatrix {
        &self.data
    }
}
