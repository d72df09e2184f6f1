//! What can go wrong between a recording and a model.

use thiserror::Error;

/// Error of identification or of a model.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SysidError {
    /// A matrix of a model has the wrong shape.
    #[error("matrix {matrix} is {rows}×{columns}, expected {expected_rows}×{expected_columns}")]
    MatrixShape {
        /// `A`, `B`, `C`, `D`, `K` or what else it is called.
        matrix: &'static str,
        /// Rows found.
        rows: usize,
        /// Columns found.
        columns: usize,
        /// Rows expected.
        expected_rows: usize,
        /// Columns expected.
        expected_columns: usize,
    },
    /// A matrix of a model holds NaN or infinity.
    #[error("matrix {matrix} has {value} in row {row}, column {column} (from 0)")]
    MatrixNotFinite {
        /// Which.
        matrix: &'static str,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The value.
        value: f64,
    },
    /// A channel's scale or offset, or the sample time, is out of range.
    #[error("{field} of `{channel}` is {found}; {allowed}")]
    Channel {
        /// `scale` or `offset`.
        field: &'static str,
        /// Name of the channel.
        channel: String,
        /// Value found.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The sample time is not above 0.
    #[error("the sample time is {found} s; give a finite value above 0")]
    SampleTime {
        /// In seconds.
        found: f64,
    },
    /// A series given to a model has the wrong number of columns or rows.
    #[error("{series} is {rows}×{columns}, expected {expected}")]
    Series {
        /// Which series.
        series: &'static str,
        /// Rows found.
        rows: usize,
        /// Columns found.
        columns: usize,
        /// Shape expected, in words.
        expected: String,
    },
    /// No record is long enough for the horizons.
    #[error(
        "the longest record has {longest} samples; past horizon {past} and future horizon {future} \
         with {channels} channels need {needed} samples in all, at least {window} of them in one \
         record. Record longer or shorten the horizons"
    )]
    TooShort {
        /// Samples of the longest record.
        longest: usize,
        /// Past horizon.
        past: usize,
        /// Future horizon.
        future: usize,
        /// Inputs and outputs together.
        channels: usize,
        /// Samples needed.
        needed: usize,
        /// Samples of one column.
        window: usize,
    },
    /// A channel never moves.
    #[error(
        "{kind} `{channel}` is constant at {value}, so nothing can be learnt about it; {remedy}"
    )]
    Constant {
        /// `input`, `disturbance` or `output`.
        kind: &'static str,
        /// Name.
        channel: String,
        /// The value it stands at.
        value: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// The inputs do not excite the plant enough.
    #[error(
        "the inputs excite only {rank} of the {needed} directions that a future horizon of {future} \
         needs (smallest relative singular value {smallest:.1e}); shake all inputs independently or \
         shorten the horizon"
    )]
    NotExciting {
        /// Numerical rank found.
        rank: usize,
        /// Rank needed.
        needed: usize,
        /// Future horizon.
        future: usize,
        /// Smallest singular value over the largest.
        smallest: f64,
    },
    /// A model order that the data do not carry.
    #[error("order {order} was asked for; {reason} allows at most {largest}")]
    Order {
        /// Asked for.
        order: usize,
        /// Largest allowed.
        largest: usize,
        /// What limits it.
        reason: String,
    },
    /// The records are too short and too few to hold samples out.
    #[error(
        "the longest of {records} records has {longest} samples; to choose a model, the recording is cut \
         into {folds} parts, which takes {needed} samples in one record or {folds} records. Record longer, \
         or use `subspace_model`"
    )]
    NothingToHoldOut {
        /// Samples of the longest record.
        longest: usize,
        /// Records.
        records: usize,
        /// Parts.
        folds: usize,
        /// Samples of one record that can be cut.
        needed: usize,
    },
    /// The caller ended the work.
    #[error("interrupted after {done} of {total} steps; nothing was changed")]
    Interrupted {
        /// Steps done.
        done: usize,
        /// Steps in all.
        total: usize,
    },
    /// A setting is out of range.
    #[error("setting `{field}` is {found}; {allowed}")]
    Setting {
        /// Name of the field.
        field: &'static str,
        /// Value found.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// A numerical method did not succeed.
    #[error("{what} failed: {why}")]
    Numerical {
        /// What was computed.
        what: &'static str,
        /// What happened.
        why: String,
    },
    /// A model is not stable where it has to be.
    #[error("{what} has spectral radius {radius:.6}, which is not below {limit}; {remedy}")]
    Unstable {
        /// Which matrix.
        what: &'static str,
        /// Its spectral radius.
        radius: f64,
        /// The limit.
        limit: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A channel of a model has no name or that of another.
    #[error("channel name `{channel}` is empty or used twice; give every channel its own")]
    ChannelName {
        /// The name.
        channel: String,
    },
    /// A channel that the model does not have.
    #[error("{kind} {index} does not exist; the model has {count}, counted from 0")]
    NoSuchChannel {
        /// `input` or `output`.
        kind: &'static str,
        /// Asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A frequency outside of what samples show.
    #[error("a frequency is {found_hz} Hz; samples at this rate show 0 to {largest_hz} Hz")]
    Frequency {
        /// In Hz.
        found_hz: f64,
        /// Half the sampling rate, in Hz.
        largest_hz: f64,
    },
    /// A model with a pole at 1 has no steady state.
    #[error(
        "a pole lies {distance:.1e} from 1, so that the outputs run away and there is no \
         steady-state gain; look at the frequency response instead"
    )]
    Integrator {
        /// Distance of the nearest pole to 1.
        distance: f64,
    },
    /// An unstable model predicts too far ahead.
    #[error(
        "over {horizon} steps the predictions of a model with spectral radius {radius:.6} grow by \
         {growth:.1e}, more than the {limit:.0e} that leave half the digits; shorten the horizon to \
         {longest} steps or identify with enforced stability"
    )]
    PredictionGrowth {
        /// Spectral radius of A.
        radius: f64,
        /// N.
        horizon: usize,
        /// The radius to the power of N.
        growth: f64,
        /// Largest growth allowed.
        limit: f64,
        /// Longest horizon allowed.
        longest: usize,
    },
    /// An output disturbance cannot be told from an integrator of the model.
    #[error(
        "the model integrates: its pole {pole:.9} is {distance:.1e} from 1 (limit {limit:.0e}), so \
         that an output disturbance cannot be told from its state; set `offset_handling` to `none`"
    )]
    UndetectableOffset {
        /// Real part of the pole of A that is nearest to 1.
        pole: f64,
        /// Its distance from 1.
        distance: f64,
        /// Smallest distance allowed.
        limit: f64,
    },
    /// A model file cannot be read.
    #[error("the model file cannot be read: {0}")]
    ModelFile(#[from] serde_json::Error),
    /// A model file of another format.
    #[error("the model file has format version {found}; this program reads version {known}")]
    FormatVersion {
        /// Found.
        found: u64,
        /// The one that is read.
        known: u64,
    },
    /// A matrix of a model file whose rows differ in length.
    #[error("row {row} (from 0) of `{matrix}` has {found} value(s), expected {expected}")]
    RaggedMatrix {
        /// Field of the file.
        matrix: &'static str,
        /// Row, from 0.
        row: usize,
        /// Values found.
        found: usize,
        /// Values expected.
        expected: usize,
    },
    /// A model file cannot be opened, written or renamed.
    #[error("cannot {action} `{path}`: {source}")]
    ModelPath {
        /// `read`, `write` or `rename to`.
        action: &'static str,
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// A model and data that do not have the same channels.
    #[error("the model's {kind}s are {model:?}, the data's {data:?}; both must be the same")]
    ChannelsDiffer {
        /// `input`, `disturbance` or `output`.
        kind: &'static str,
        /// Names in the model.
        model: Vec<String>,
        /// Names in the data.
        data: Vec<String>,
    },
    /// A model and data of different sample times.
    #[error("the model's sample time is {model_s} s, the data's {data_s} s; resample the data")]
    SampleTimesDiffer {
        /// Of the model, in seconds.
        model_s: f64,
        /// Of the data, in seconds.
        data_s: f64,
    },
    /// Data too short to validate a model on.
    #[error(
        "the longest record has {longest} samples; {steps} steps and {lags} lags with a model of \
         order {order} need {needed}. Record longer, or ask for fewer steps or lags"
    )]
    TooShortToValidate {
        /// Samples of the longest record.
        longest: usize,
        /// Steps of the horizon.
        steps: usize,
        /// Lags of the correlations.
        lags: usize,
        /// Order of the model.
        order: usize,
        /// Samples needed.
        needed: usize,
    },
    /// Data for a figure that cannot be drawn.
    #[error("figure `{figure}`: {problem}")]
    Figure {
        /// Title.
        figure: String,
        /// What is wrong.
        problem: String,
    },
    /// The quadratic program of the LMPC.
    #[error(transparent)]
    Program(#[from] deepc_core::program::ProgramError),
    /// The controller.
    #[error(transparent)]
    Controller(#[from] deepc_core::controller::ControllerError),
    /// The Hankel stage.
    #[error(transparent)]
    Hankel(#[from] deepc_core::hankel::HankelError),
    /// The data stage.
    #[error(transparent)]
    Data(#[from] deepc_core::data::DataError),
}
