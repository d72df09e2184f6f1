//! What can be wrong with a `DeePC` problem.

use thiserror::Error;

use crate::solver::SolverError;

/// A setting is out of range.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SettingsError {
    /// A list does not have one entry per channel.
    #[error("`{field}` has {found} entries, expected {expected}: give one per channel")]
    Length {
        /// Field.
        field: &'static str,
        /// Channels.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A weight is negative or not finite.
    #[error("`{field}[{index}]` is {found}; give a finite value of at least 0")]
    Weight {
        /// Field.
        field: &'static str,
        /// Channel, from 0.
        index: usize,
        /// Value found.
        found: f64,
    },
    /// A regularisation or slack weight is not a finite number above 0.
    #[error(
        "`{field}` is {found}; give a finite value above 0 (a slack that must vanish is `hard`)"
    )]
    Lambda {
        /// Field.
        field: &'static str,
        /// Value found.
        found: f64,
    },
    /// Bounds are NaN or leave nothing between them.
    #[error("`{field}[{index}]` is {lower} to {upper}; the lower bound must not exceed the upper")]
    Bounds {
        /// Field.
        field: &'static str,
        /// Channel, from 0.
        index: usize,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A soft bound's penalty is out of range.
    #[error(
        "`output_bounds[{index}].softness` has linear {linear} and quadratic {quadratic}; both \
         must be finite and at least 0, and one above 0"
    )]
    Penalty {
        /// Output, from 0.
        index: usize,
        /// ρ.
        linear: f64,
        /// w.
        quadratic: f64,
    },
}

/// Error of the program stage.
#[derive(Debug, Error)]
pub enum ProgramError {
    /// A setting is out of range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// A series does not have the shape the program was built for.
    #[error(
        "{name} is {rows}×{columns}, expected {expected_rows}×{expected_columns} \
         (rows are time, columns channels)"
    )]
    Series {
        /// Which series.
        name: &'static str,
        /// Rows found.
        rows: usize,
        /// Columns found.
        columns: usize,
        /// Rows expected.
        expected_rows: usize,
        /// Columns expected.
        expected_columns: usize,
    },
    /// A factorisation left the range of the numbers.
    #[error(
        "{what} has no finite entry ({row}, {column}); the data or weights span too many orders \
         of magnitude: bring channels and weights to similar sizes"
    )]
    Factorisation {
        /// Which factorisation.
        what: &'static str,
        /// Row of the first bad entry of its triangular factor.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// The past without slack could not be taken apart.
    #[error(
        "the singular value decomposition of the {size} past entries whose slack is hard does not \
         converge (pivots {smallest:e} to {largest:e}); bring the channels to similar sizes, or \
         give both slacks a penalty"
    )]
    PastDecomposition {
        /// Entries of the past whose slack is hard.
        size: usize,
        /// Smallest pivot of their triangular factor.
        smallest: f64,
        /// Its largest.
        largest: f64,
    },
    /// A slack penalty is beyond what double precision can tell from hard slack.
    #[error(
        "slack penalty {lambda:e} is lost in rounding: entry {row} of the past keeps a pivot of \
         {pivot:e} in a column of size {column:e}, and {tolerance:e} of it is needed; lower the \
         penalty, raise `lambda_g`, or make this slack `hard`"
    )]
    SlackLost {
        /// Row of `col(u_ini, y_ini)`, from 0.
        row: usize,
        /// `λ_u` or `λ_y`.
        lambda: f64,
        /// Pivot left to the entry.
        pivot: f64,
        /// Size of its column, of which the pivot must be a fraction.
        column: f64,
        /// That fraction.
        tolerance: f64,
    },
    /// The quadratic program or its solver refused.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
