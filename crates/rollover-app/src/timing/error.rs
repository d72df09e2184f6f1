//! What can be wrong with a table of times.

use thiserror::Error;

/// Times cannot be measured; the message says what to give instead.
#[derive(Debug, Error)]
pub enum TimingError {
    /// Too few moments at which bounds are active.
    #[error(
        "the run of {controller} has {found} steps with active bounds and a complete past, and {needed} \
         are to be timed: time a run on a course that needs its controller, or ask for fewer"
    )]
    TooFewMoments {
        /// The controller of the run.
        controller: String,
        /// Steps found.
        found: usize,
        /// Steps asked for.
        needed: usize,
    },
    /// A controller that predicts in another way than its row says.
    #[error(
        "{controller} cannot be timed as {wanted}: choose a controller with method = \"{method}\""
    )]
    Method {
        /// The controller.
        controller: String,
        /// The row.
        wanted: &'static str,
        /// The `method` in the scenario file.
        method: &'static str,
    },
    /// Two controllers that should differ in their data matrix alone.
    #[error(
        "{deepc} and {rd_deepc} differ in `{field}`, so that they need not decide alike: give them the \
         same settings (`like`)"
    )]
    Unlike {
        /// `DeePC`.
        deepc: String,
        /// RD-DeePC.
        rd_deepc: String,
        /// The setting.
        field: &'static str,
    },
    /// A run that is missing.
    #[error("{controller} has no run to compare: drive it first")]
    NoRun {
        /// The controller.
        controller: String,
    },
    /// A solver gave up on a program.
    #[error(
        "the program of {controller} ({form}) was not solved at {time_s:.2} s: {status}; its relative \
         residual is {residual:.1e}"
    )]
    Unsolved {
        /// The controller.
        controller: String,
        /// The form of its program.
        form: String,
        /// The moment within the run, s.
        time_s: f64,
        /// How the solve ended.
        status: String,
        /// How far its point is from an optimum.
        residual: f64,
    },
}
