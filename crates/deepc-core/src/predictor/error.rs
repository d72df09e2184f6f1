//! What can be wrong with a reduction.

use thiserror::Error;

/// Error of the predictor stage.
#[derive(Debug, Error)]
pub enum PredictorError {
    /// The rank asked for does not exist.
    #[error("rank {found} of a {rows}×{columns} matrix does not exist; give 1 to {largest}")]
    Rank {
        /// Rank asked for.
        found: usize,
        /// Rows of H.
        rows: usize,
        /// Columns of H.
        columns: usize,
        /// Largest rank possible.
        largest: usize,
    },
    /// The singular value decomposition did not converge.
    #[error(
        "the singular value decomposition of a {rows}×{columns} matrix did not converge; check its scaling"
    )]
    Decomposition {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
}
