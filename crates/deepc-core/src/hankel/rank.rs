//! Numerical rank of wide matrices.

use faer::MatRef;

use super::error::HankelError;
use super::shape::Shape;
use crate::data::{Dataset, Record};

/// A singular value counts towards the rank if it is above this fraction of the largest one
/// (after every channel was scaled to unit root mean square). Rounding leaves about 1e-14;
/// an excitation weaker than 1e-10 of the signal is of no use.
pub const RANK_TOLERANCE: f64 = 1e-10;

/// Singular values in falling order, and how many count.
#[derive(Debug, Clone)]
pub(crate) struct Rank {
    pub singular_values: Vec<f64>,
    pub rank: usize,
}

impl Rank {
    /// Rank of a rows×columns matrix. The rows are expected to be scaled already.
    pub fn measure(matrix: MatRef<'_, f64>) -> Result<Self, HankelError> {
        let (rows, columns) = matrix.shape();
        // A Hankel matrix has far more columns than rows: its triangular factor has the same
        // singular values and the SVD then works on a rows×rows matrix.
        let singular_values = if columns > 2 * rows {
            matrix.transpose().qr().thin_R().singular_values()
        } else {
            matrix.singular_values()
        };
        let singular_values =
            singular_values.map_err(|_| HankelError::Decomposition { rows, columns })?;
        let limit = RANK_TOLERANCE * singular_values.first().copied().unwrap_or(0.0);
        let rank = singular_values.iter().filter(|&&s| s > limit).count();
        Ok(Self {
            singular_values,
            rank,
        })
    }
}

/// Root mean square of every channel over all records; 1 for a channel that is zero throughout.
#[derive(Debug, Clone)]
pub struct ChannelScales {
    pub inputs: Vec<f64>,
    pub disturbances: Vec<f64>,
    pub outputs: Vec<f64>,
}

impl ChannelScales {
    pub fn of(data: &Dataset) -> Self {
        let series = |of: fn(&Record) -> MatRef<'_, f64>| -> Vec<f64> {
            let all: Vec<_> = data.records().iter().map(of).collect();
            root_mean_squares(&all)
        };
        Self {
            inputs: series(Record::inputs),
            disturbances: series(Record::disturbances),
            outputs: series(Record::outputs),
        }
    }

    /// One per row of the stacked Hankel matrix.
    pub fn per_row(&self, shape: Shape) -> Vec<f64> {
        shape.per_row(&self.inputs, &self.disturbances, &self.outputs)
    }
}

fn root_mean_squares(series: &[MatRef<'_, f64>]) -> Vec<f64> {
    let channels = series.first().map_or(0, |s| s.shape().1);
    let samples: usize = series.iter().map(|s| s.shape().0).sum();
    let scale = |channel: usize| {
        let energies = series.iter().map(|s| s.col(channel).squared_norm_l2());
        let rms = (energies.sum::<f64>() / samples as f64).sqrt();
        if rms > 0.0 && rms.is_finite() {
            rms
        } else {
            1.0
        }
    };
    (0..channels).map(scale).collect()
}
