//! What can be wrong with a predictor.

use thiserror::Error;

use crate::data::DataError;

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
    /// A forgetting factor is out of range.
    #[error(
        "the forgetting factor is {found}; give a value above 0 and at most 1 (0.99 to 0.9999)"
    )]
    ForgettingFactor {
        /// The value given.
        found: f64,
    },
    /// A sliding window does not hold enough columns.
    #[error(
        "a window of {found} samples holds too few columns; give at least {needed}, better several \
         times as many"
    )]
    SlidingWindow {
        /// Samples given.
        found: usize,
        /// Samples for as many columns as H has rows.
        needed: usize,
    },
    /// Edges of a schedule do not rise.
    #[error(
        "edge {index} (from 0) is {found}, the one before {before}; give finite edges that rise"
    )]
    Edge {
        /// Position, from 0.
        index: usize,
        /// The edge.
        found: f64,
        /// The edge before.
        before: f64,
    },
    /// The hysteresis of a schedule does not fit.
    #[error(
        "the hysteresis is {found}; give a finite value from 0 to below half the narrowest range, \
         which is {narrowest} wide"
    )]
    Hysteresis {
        /// The value given.
        found: f64,
        /// Width of the narrowest range.
        narrowest: f64,
    },
    /// The number of predictors is not that of ranges.
    #[error("{found} predictor(s) for {expected} range(s); give one per range")]
    RangeCount {
        /// Predictors given.
        found: usize,
        /// Ranges of the schedule.
        expected: usize,
    },
    /// Predictors of one schedule do not fit together.
    #[error("the predictor of range {range} (from 0) differs from that of range 0 in its {what}")]
    RangesDiffer {
        /// Range, from 0.
        range: usize,
        /// What differs.
        what: &'static str,
    },
    /// A schedule names a channel that the data set lacks.
    #[error("no channel is named `{name}`; the channels are {found:?}")]
    NoSuchChannel {
        /// The name asked for.
        name: String,
        /// The names there are.
        found: Vec<String>,
    },
    /// A part of a data set could not be made.
    #[error(transparent)]
    Data(DataError),
}
