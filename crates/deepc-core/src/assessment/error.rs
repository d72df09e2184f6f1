//! What can be wrong with an assessment.

use thiserror::Error;

use crate::data::DataError;
use crate::hankel::HankelError;
use crate::predictor::PredictorError;
use crate::program::ProgramError;

/// Error of the assessment stage.
#[derive(Debug, Error)]
pub enum AssessmentError {
    /// A list to try is empty.
    #[error("`{field}` is empty; give at least 1 value")]
    EmptyGrid {
        /// Field.
        field: &'static str,
    },
    /// A value to try is out of range.
    #[error("`{field}[{index}]` is {found}; give finite values above 0")]
    GridValue {
        /// Field.
        field: &'static str,
        /// Position, from 0.
        index: usize,
        /// Value found.
        found: f64,
    },
    /// A count is too small.
    #[error("`{field}` is {found}; give at least {least}")]
    Count {
        /// Field.
        field: &'static str,
        /// Value found.
        found: usize,
        /// Smallest allowed.
        least: usize,
    },
    /// A confidence level is not a probability.
    #[error("level is {found}; give a value above 0 and below 1")]
    Level {
        /// Value found.
        found: f64,
    },
    /// A level is out of reach of the windows there are.
    #[error(
        "level {level} needs at least {needed} hold-out windows, there are {windows}; hold out \
         more, raise `windows`, or lower the level"
    )]
    TooFewWindows {
        /// Level asked for.
        level: f64,
        /// Windows.
        windows: usize,
        /// Windows needed.
        needed: f64,
    },
    /// A record to hold out does not exist or is named twice.
    #[error("`hold_out` names record {found}; name each of 1 to {available} at most once")]
    HoldOutRecord {
        /// Number found.
        found: usize,
        /// Number of records.
        available: usize,
    },
    /// No held part is as long as a window.
    #[error(
        "the hold-out is too short: its longest part has {samples} samples, one window of \
         past + future needs {needed}; record longer, shorten the horizons, or hold out a record"
    )]
    HoldOutTooShort {
        /// Samples of the longest part.
        samples: usize,
        /// Window L.
        needed: usize,
    },
    /// Nothing is left to predict with.
    #[error(
        "too little is left to predict with: without the hold-out the longest record has \
         {samples} samples, one window of past + future needs {needed}; hold out less or record more"
    )]
    TrainingTooShort {
        /// Samples of the longest record left.
        samples: usize,
        /// Window L.
        needed: usize,
    },
    /// No output changes, so that no error can be measured against its deviation.
    #[error("no output changes over the recording; there is nothing to predict")]
    ConstantOutputs,
    /// Every pair of weights was refused.
    #[error("none of the {tried} pairs of weights gives a predictor; the first says: {reason}")]
    NothingWorks {
        /// Pairs tried.
        tried: usize,
        /// Message of the first.
        reason: String,
    },
    /// The caller asked to stop.
    #[error("interrupted after {done} of {total} pairs of weights")]
    Interrupted {
        /// Pairs done.
        done: usize,
        /// Pairs asked for.
        total: usize,
    },
    /// A raw series does not have one column per name.
    #[error("{names} names for {columns} columns (rows are time); give one name per column")]
    Names {
        /// Names given.
        names: usize,
        /// Columns of the series.
        columns: usize,
    },
    /// A decomposition did not converge.
    #[error("the singular values of a {rows}×{columns} matrix of {what} did not converge")]
    Decomposition {
        /// What the matrix is for.
        what: &'static str,
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// The curve could not be written.
    #[error("cannot write the tuning curve")]
    Write(#[from] csv::Error),
    /// From the data stage.
    #[error(transparent)]
    Data(#[from] DataError),
    /// From the Hankel stage.
    #[error(transparent)]
    Hankel(#[from] HankelError),
    /// From the predictor stage.
    #[error(transparent)]
    Predictor(#[from] PredictorError),
    /// From the program stage.
    #[error(transparent)]
    Program(#[from] ProgramError),
}
