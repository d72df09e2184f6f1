//! Stage 6: what recorded data are worth, before they control anything.
//!
//! | | answers |
//! |---|---|
//! | [`screen`] | where a raw series is NaN, constant, saturated, quantised or spiky |
//! | [`DataReport`] | do the inputs excite, which order and lag does the plant have, was there feedback, how well do the data predict what they have not seen; with [`Finding`]s that say what to do |
//! | [`tune`] | which `λ_g` and `λ_y` predict best |
//! | [`HoldOutErrors::margin`] | how far a prediction may be off, to tighten bounds by |
//!
//! Measuring does not fail on poor data, it reports them. Reports are plain data: text by
//! `Display`, JSON by `serde`.

mod channel;
mod display;
mod error;
mod feedback;
mod finding;
mod hold_out;
mod order;
mod prediction;
mod report;
mod screening;
mod special;
mod tuning;

pub use channel::{
    ChannelReport, ChannelStatistics, Extreme, REPEATED_CORRELATION, RepeatedPair, Repetition,
    Role, SATURATION_RUN,
};
pub use error::AssessmentError;
pub use feedback::{FALSE_ALARM_LEVEL, FEEDBACK_R_SQUARED, FeedbackTest};
pub use finding::{
    Finding, FindingKind, OFFSET_RATIO, POOR_PREDICTION, QUANTISATION_STEPS, SATURATED_SHARE,
    SCALE_RATIO, SWITCH_VALUES, Severity, USELESS_PREDICTION, WEAK_EXCITATION,
};
pub use hold_out::HoldOut;
pub use order::{Certainty, DepthRank, NOISE_FLOOR, OrderEstimate};
pub use prediction::{
    HoldOutErrors, HoldOutMargin, HoldOutPrediction, OutputError, OutputMargin, PredictionMethod,
    PredictionSettings, hold_out_margin,
};
pub use report::{DataReport, ReportOptions};
pub use screening::{ChannelScreening, SampleRange, Screening, screen};
pub use tuning::{
    RefusedPoint, TuningCurve, TuningPoint, TuningProgress, TuningSettings, logarithmic_grid, tune,
    tune_with,
};
