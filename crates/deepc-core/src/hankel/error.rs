//! What can be wrong between a data set and a usable Hankel matrix.

use thiserror::Error;

use super::excitation::ExcitationReport;

/// Error of the Hankel stage.
#[derive(Debug, Error)]
pub enum HankelError {
    /// A horizon is zero.
    #[error("{name} horizon is 0 steps; it must be at least 1")]
    EmptyHorizon {
        /// `past` or `future`.
        name: &'static str,
    },
    /// A query is not a past window of the data set.
    #[error("{name} of the query is {rows}×{columns}, expected {expected_rows}×{expected_columns}")]
    Query {
        /// Which signal.
        name: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// `T_ini`.
        expected_rows: usize,
        /// Channels.
        expected_columns: usize,
    },
    /// A query holds NaN or an infinite value.
    #[error("{name} of the query holds {value} at sample {sample}, channel {channel} (from 0)")]
    QueryNotFinite {
        /// Which signal.
        name: &'static str,
        /// What was found.
        value: f64,
        /// Row.
        sample: usize,
        /// Column.
        channel: usize,
    },
    /// More columns were asked for than there are.
    #[error("{found} columns were asked for; give 1 to {available}")]
    Columns {
        /// Number asked for.
        found: usize,
        /// Columns of the matrix.
        available: usize,
    },
    /// The data set has no record.
    #[error("the data set has no records; push at least one")]
    NoRecords,
    /// A record is too short for one window of L = past + future samples.
    #[error(
        "record {record} has {samples} samples, fewer than one window of past + future = {window}; \
         leave it out, shorten the horizons, or record more (persistent excitation needs at least \
         {needed} samples in one record, and {} more for each order of the plant)", exciting + 1
    )]
    RecordTooShort {
        /// Record number, from 1.
        record: usize,
        /// Its samples.
        samples: usize,
        /// Window length L.
        window: usize,
        /// Inputs and measured disturbances m + q.
        exciting: usize,
        /// (m + q + 1)·L − 1, the bound for a plant of order 0.
        needed: usize,
    },
    /// The singular value decomposition did not converge.
    #[error(
        "the singular values of a {rows}×{columns} Hankel matrix did not converge; check its scaling"
    )]
    Decomposition {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// The samples cannot fill a matrix of input windows.
    #[error("too few samples: {}", .0.shortage())]
    TooFewSamples(Box<ExcitationReport>),
    /// The inputs do not excite the plant enough.
    #[error("the inputs are not persistently exciting: {}", .0.complaint())]
    NotPersistentlyExciting(Box<ExcitationReport>),
}
