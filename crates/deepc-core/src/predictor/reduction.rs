//! Reduction of the Hankel matrix by its singular value decomposition.

use std::fmt;

use faer::linalg::solvers::Svd;
use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::PlantData;
use super::error::PredictorError;
use crate::hankel::{HankelMatrix, RANK_TOLERANCE};

/// How a data matrix was reduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReductionMethod {
    /// Not at all.
    None,
    /// Written in an orthonormal basis of the row space, by a QR decomposition: nothing is gone.
    Compact,
    /// To the numerical rank.
    Exact,
    /// Below the numerical rank (or to a rank the user chose).
    Truncated,
}

/// What a reduction did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reduction {
    /// Method.
    pub method: ReductionMethod,
    /// Rows (m + q + p)L.
    pub rows: usize,
    /// Columns J of the Hankel matrix. If the past is forgotten exponentially, by the factor γ
    /// from one column to the next, the number of columns that weigh as much, Σγᵏ, rounded.
    pub columns_before: usize,
    /// Columns c of the reduced matrix.
    pub columns_after: usize,
    /// Share of the squared Frobenius norm of H (in the units of the data) that is gone, 0 to 1.
    pub energy_lost: f64,
    /// The same for every channel by itself, by name. A channel that is small in its units can
    /// be lost altogether while the total looks harmless.
    pub channel_energy_lost: Vec<(String, f64)>,
}

impl Reduction {
    pub(super) fn none(hankel: &HankelMatrix) -> Self {
        let columns = hankel.columns();
        Self::report(ReductionMethod::None, hankel, hankel.stacked(), columns)
    }

    /// For a matrix with the same H Hᵀ.
    pub(super) fn lossless(plant: &PlantData, before: usize, after: usize) -> Self {
        Self {
            method: ReductionMethod::Compact,
            rows: plant.shape.rows(),
            columns_before: before,
            columns_after: after,
            energy_lost: 0.0,
            channel_energy_lost: plant.all_names().into_iter().map(|n| (n, 0.0)).collect(),
        }
    }

    fn report(
        method: ReductionMethod,
        hankel: &HankelMatrix,
        reduced: MatRef<'_, f64>,
        columns_after: usize,
    ) -> Self {
        let data = hankel.dataset();
        let names = data.input_names().iter().chain(data.disturbance_names());
        let names: Vec<_> = names.chain(data.output_names()).collect();
        let channels: Vec<usize> = (0..names.len()).collect();
        let (inputs, others) = channels.split_at(data.inputs());
        let (disturbances, outputs) = others.split_at(data.disturbances());
        let owner = hankel.shape().per_row(inputs, disturbances, outputs);
        let mut before = vec![0.0; names.len()];
        let mut after = vec![0.0; names.len()];
        for (row, &channel) in owner.iter().enumerate() {
            before[channel] += hankel.stacked().row(row).squared_norm_l2();
            after[channel] += reduced.row(row).squared_norm_l2();
        }
        // The reduction is an orthogonal projection: what is lost is what is missing.
        let lost = |before: f64, after: f64| {
            if before > 0.0 {
                (1.0 - after / before).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        let channel = |i: usize| (names[i].clone(), lost(before[i], after[i]));
        Self {
            method,
            rows: hankel.shape().rows(),
            columns_before: hankel.columns(),
            columns_after,
            energy_lost: lost(before.iter().sum(), after.iter().sum()),
            channel_energy_lost: (0..names.len()).map(channel).collect(),
        }
    }
}

impl fmt::Display for Reduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let method = match self.method {
            ReductionMethod::None => "not reduced",
            ReductionMethod::Compact => "in an orthonormal basis of its rows",
            ReductionMethod::Exact => "reduced to its numerical rank",
            ReductionMethod::Truncated => "truncated",
        };
        write!(
            f,
            "{}×{} data matrix {method}: {}×{}, energy lost {:.2e}",
            self.rows, self.columns_before, self.rows, self.columns_after, self.energy_lost
        )?;
        for (name, lost) in &self.channel_energy_lost {
            write!(f, ", `{name}` {lost:.2e}")?;
        }
        Ok(())
    }
}

/// H̄ = H V₁ with V₁ from the SVD of H with its channels scaled: row scaling leaves the row
/// space, and with it range(V₁), unchanged, so the rank decision does not depend on units.
pub(super) fn exact(hankel: &HankelMatrix) -> Result<(Mat<f64>, Reduction), PredictorError> {
    let channels = hankel.channel_scales();
    let scales = channels.per_row(hankel.shape());
    let scaled = hankel.scaled_rows(&channels);
    let svd = left_svd(scaled.as_ref())?;
    let sigma = svd.S().column_vector();
    let limit = RANK_TOLERANCE * sigma.iter().copied().fold(0.0, f64::max);
    let rank = sigma.iter().filter(|&&s| s > limit).count().max(1);
    let matrix = Mat::from_fn(scaled.nrows(), rank, |i, j| {
        scales[i] * svd.U()[(i, j)] * sigma[j]
    });
    let reduction = Reduction::report(ReductionMethod::Exact, hankel, matrix.as_ref(), rank);
    Ok((matrix, reduction))
}

/// H̄ = W₁Σ₁ with the `rank` largest singular values of H in the units of the data.
pub(super) fn truncated(
    hankel: &HankelMatrix,
    rank: usize,
) -> Result<(Mat<f64>, Reduction), PredictorError> {
    let (rows, columns) = hankel.stacked().shape();
    let largest = rows.min(columns);
    if rank == 0 || rank > largest {
        return Err(PredictorError::Rank {
            found: rank,
            rows,
            columns,
            largest,
        });
    }
    let svd = left_svd(hankel.stacked())?;
    let sigma = svd.S().column_vector();
    let matrix = Mat::from_fn(rows, rank, |i, j| svd.U()[(i, j)] * sigma[j]);
    let reduction = Reduction::report(ReductionMethod::Truncated, hankel, matrix.as_ref(), rank);
    Ok((matrix, reduction))
}

/// An SVD with the U and Σ of a wide matrix. The QR factor of its transpose has the same U and
/// Σ and is square, which makes the decomposition of 600×3001 matrices cheap.
fn left_svd(matrix: MatRef<'_, f64>) -> Result<Svd<f64>, PredictorError> {
    let (rows, columns) = matrix.shape();
    let svd = if columns > rows {
        let r = matrix.transpose().qr().thin_R().to_owned();
        r.transpose().thin_svd()
    } else {
        matrix.thin_svd()
    };
    svd.map_err(|_| PredictorError::Decomposition { rows, columns })
}
