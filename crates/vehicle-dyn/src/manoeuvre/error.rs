//! What can be wrong with a manoeuvre or its run.

use crate::driver::DriverError;
use crate::road::RoadError;
use crate::simulation::SimulationError;

/// A manoeuvre that cannot be used or run; the message says where and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ManoeuvreError {
    /// Neither a file nor an embedded name.
    #[error(
        "there is no manoeuvre `{name}`{suggestion}; give the path of a manoeuvre file or one of: {known}"
    )]
    Unknown {
        /// What was asked for.
        name: String,
        /// Empty, or ``" (did you mean `…`?)"``.
        suggestion: String,
        /// Names of the embedded manoeuvres.
        known: String,
    },
    /// The file cannot be read.
    #[error(
        "cannot read manoeuvre file {origin}: {reason}. Give a readable file or one of: {known}"
    )]
    Unreadable {
        /// Path as given.
        origin: String,
        /// Operating system's reason.
        reason: String,
        /// Names of the embedded manoeuvres.
        known: String,
    },
    /// Not TOML, an unknown or missing key, or a value of the wrong type.
    #[error("{origin} is not a manoeuvre: {message}")]
    Malformed {
        /// Name of the file.
        origin: String,
        /// What the TOML reader says, with line and column.
        message: String,
    },
    /// A value outside its allowed range.
    #[error("{field} = {value}: must be {allowed}")]
    OutOfRange {
        /// Key, such as `manoeuvre.speed_kmh`.
        field: String,
        /// Value found.
        value: String,
        /// What is allowed, with the unit.
        allowed: String,
    },
    /// The driver of a lane change is not usable.
    #[error("the driver that follows from the manoeuvre and this vehicle is not usable: {0}")]
    Driver(#[from] DriverError),
    /// The path through the lanes cannot be built.
    #[error("the path through the lanes cannot be built: {0}")]
    Path(#[from] RoadError),
    /// The simulation cannot begin or go on.
    #[error("run {run}: {source}")]
    Simulation {
        /// Name of the run.
        run: String,
        /// Why.
        source: SimulationError,
    },
    /// A sub-test gave no result that the manoeuvre could be built on.
    #[error("{test} gave no result for this vehicle: {reason}")]
    SubTest {
        /// Which sub-test.
        test: &'static str,
        /// What was found and what to do.
        reason: String,
    },
    /// The caller asked to stop.
    #[error("interrupted after {runs_done} runs")]
    Interrupted {
        /// Runs that were finished.
        runs_done: usize,
    },
}
