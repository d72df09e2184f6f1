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
    /// The data set has no record.
    #[error("the data set has no records; push at least one")]
    NoRecords,
    /// A record is too short for one window of L = past + future samples.
    #[error(
        "record {record} has {samples} samples, fewer than one window of past + future = {window}; \
         leave it out, shorten the horizons, or record more (persistent excitation needs at least \
         {needed} samples in one record, and (m + 1) more for each order of the plant)"
    )]
    RecordTooShort {
        /// Record number, from 1.
        record: usize,
        /// Its samples.
        samples: usize,
        /// Window length L.
        window: usize,
        /// (m + 1)·L − 1, the bound for a plant of order 0.
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
    /// The samples cannot fill a Hankel matrix of order L + n.
    #[error(
        "too few samples: {given} in {records} record(s), needed at least {needed} in one record \
         for {inputs} input(s), window {window} and plant order {plant_order} \
         (T ≥ (m+1)(L+n) − 1); record longer or shorten the horizons"
    )]
    TooFewSamples {
        /// Samples given, all records together.
        given: usize,
        /// Records.
        records: usize,
        /// (m + 1)(L + n) − 1.
        needed: usize,
        /// Input channels m.
        inputs: usize,
        /// Window L.
        window: usize,
        /// Order n assumed of the plant.
        plant_order: usize,
    },
    /// The inputs do not excite the plant enough.
    #[error("the inputs are not persistently exciting: {}", .0.complaint())]
    NotPersistentlyExciting(Box<ExcitationReport>),
}
