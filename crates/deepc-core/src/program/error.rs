//! What can be wrong with a predictive control problem.

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
        "`{field}[{index}]` has linear {linear} and quadratic {quadratic}; both must be finite and \
         at least 0, and one above 0"
    )]
    Penalty {
        /// Field.
        field: &'static str,
        /// Channel or constraint, from 0.
        index: usize,
        /// ρ.
        linear: f64,
        /// w.
        quadratic: f64,
    },
    /// `λ_g` is given where nothing is charged.
    #[error("`regularisation.lambda_g` is {found}, but this kind charges nothing; give 0")]
    UnusedLambda {
        /// Value found.
        found: f64,
    },
    /// A table does not have one row per step of the horizon.
    #[error("`{field}` has {found} rows, expected {expected}: give one per step, or none")]
    Rows {
        /// Field.
        field: &'static str,
        /// N.
        expected: usize,
        /// Rows found.
        found: usize,
    },
    /// A row of a table does not have one entry per channel.
    #[error("`{field}[{step}]` has {found} entries, expected {expected}: give one per channel")]
    RowLength {
        /// Field.
        field: &'static str,
        /// Step, from 0.
        step: usize,
        /// Channels.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A factor of a table is negative or not finite.
    #[error("`{field}[{step}][{index}]` is {found}; give a finite value of at least 0")]
    Factor {
        /// Field.
        field: &'static str,
        /// Step, from 0.
        step: usize,
        /// Channel, from 0.
        index: usize,
        /// Value found.
        found: f64,
    },
    /// A coefficient list of an affine constraint does not have one entry per channel.
    #[error(
        "`affine[{index}].{field}` has {found} entries, expected {expected}: give one per channel"
    )]
    AffineLength {
        /// `inputs` or `outputs`.
        field: &'static str,
        /// Constraint, from 0.
        index: usize,
        /// Channels.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A constraint speaks of steps that the horizon does not have.
    #[error(
        "`{field}[{index}]` speaks of {found}, but the horizon has {horizon} steps: give `at` 0 to \
         {horizon} − 1, or `last` 1 to {horizon}"
    )]
    Steps {
        /// Field.
        field: &'static str,
        /// Constraint, from 0.
        index: usize,
        /// Steps found.
        found: usize,
        /// N.
        horizon: usize,
    },
    /// A coefficient of an affine constraint is not finite.
    #[error("`affine[{index}]` has the coefficient {found}; give finite ones")]
    Coefficient {
        /// Constraint, from 0.
        index: usize,
        /// Value found.
        found: f64,
    },
    /// An affine constraint constrains nothing.
    #[error("`affine[{index}]` has no coefficient other than 0; leave it out")]
    NoCoefficient {
        /// Constraint, from 0.
        index: usize,
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
    /// A size of a prediction model is 0.
    #[error("`{field}` of the prediction model is 0; give at least 1")]
    ModelSize {
        /// Field of [`Shape`](crate::hankel::Shape).
        field: &'static str,
    },
    /// The sizes of a prediction model's channels are not usable.
    #[error(
        "`{field}` of the prediction model is {found:?}; give {expected} finite values above 0"
    )]
    ModelScales {
        /// `input_scales` or `output_scales`.
        field: &'static str,
        /// Values found.
        found: Vec<f64>,
        /// How many are expected.
        expected: usize,
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
        /// Entry of the known part `col(u_ini, d_ini, y_ini, d)`, from 0.
        row: usize,
        /// `λ_u` or `λ_y`, or that of the disturbances.
        lambda: f64,
        /// Pivot left to the entry.
        pivot: f64,
        /// Size of its column, of which the pivot must be a fraction.
        column: f64,
        /// That fraction.
        tolerance: f64,
    },
    /// Some directions of the future cost nothing, so that the optimum is not determined.
    #[error(
        "the cost does not determine the plan: direction {direction} of {directions} has a \
         curvature of {curvature:e} beside {largest:e}; give every input a weight, or regularise g"
    )]
    Undetermined {
        /// First direction without a cost, from 0.
        direction: usize,
        /// All directions.
        directions: usize,
        /// Its pivot.
        curvature: f64,
        /// The largest pivot.
        largest: f64,
    },
    /// A singular value decomposition did not converge.
    #[error(
        "the singular value decomposition of {what} ({size}×{size}) does not converge; bring the \
         channels to similar sizes"
    )]
    Decomposition {
        /// Of what.
        what: &'static str,
        /// Its size.
        size: usize,
    },
    /// This form of the program cannot have this regularisation.
    #[error("{form} cannot have the regularisation {part}; {remedy}")]
    Form {
        /// Which form.
        form: &'static str,
        /// Which part of g.
        part: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// The data cannot make every input sequence of the horizon.
    #[error(
        "input `{channel}` cannot be chosen freely at step {step} of the horizon: the data leave \
         {pivot:e} of it, {needed:e} is needed; the inputs do not excite the plant, or there are \
         too few columns: shake every input independently, record longer, or shorten the horizons"
    )]
    InputsNotExciting {
        /// Input channel.
        channel: String,
        /// Step of the horizon, from 0.
        step: usize,
        /// Part of the input that what comes before does not determine, relative to it.
        pivot: f64,
        /// Smallest that counts.
        needed: f64,
    },
    /// The quadratic program or its solver refused.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
