//! What can be wrong around the control loop.

use thiserror::Error;

/// A plant cannot go on.
#[derive(Debug, Error)]
pub enum PlantError {
    /// A slice has the wrong length.
    #[error("the plant's {name} has {found} entries, expected {expected}: give one per channel")]
    Length {
        /// `input` or `output`.
        name: &'static str,
        /// Entries expected.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// The plant's own reason.
    #[error(transparent)]
    Failed(Box<dyn std::error::Error + Send + Sync>),
}

impl PlantError {
    /// Wraps the plant's own reason: an error or a message.
    pub fn new(reason: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        Self::Failed(reason.into())
    }
}

/// A controller or reference cannot be built.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ControllerError {
    /// The moves applied from one plan.
    #[error("`moves_per_solve` is {found}; give 1 to the horizon of {horizon} steps")]
    MovesPerSolve {
        /// Value found.
        found: usize,
        /// Horizon N.
        horizon: usize,
    },
    /// The budget of a solve.
    #[error("`budget` is {iterations} iterations and {time_s} s; give at least 1 and more than 0")]
    Budget {
        /// Iterations.
        iterations: u32,
        /// Seconds.
        time_s: f64,
    },
    /// The solver was set up for another program.
    #[error(
        "the solver was set up for {solver_variables} variables and {solver_rows} rows, the \
         program has {variables} and {rows}; set it up with this program's `qp()`"
    )]
    SolverMismatch {
        /// Variables of the solver's problem.
        solver_variables: usize,
        /// Rows of the solver's problem.
        solver_rows: usize,
        /// Variables of the program.
        variables: usize,
        /// Rows of the program.
        rows: usize,
    },
    /// The solver was set up for a program of the same size with other matrices.
    #[error(
        "the solver was set up for another program of {variables} variables and {rows} rows: its \
         weights or data differ; set it up with this program's `qp()`"
    )]
    SolverOfOtherProgram {
        /// Variables of both.
        variables: usize,
        /// Rows of both.
        rows: usize,
    },
    /// A reference does not fit.
    #[error(
        "the {name} reference is {rows}×{columns}, expected at least 1 row and {expected} columns \
         (rows are time, columns channels)"
    )]
    Reference {
        /// `input` or `output`.
        name: &'static str,
        /// Rows found.
        rows: usize,
        /// Columns found.
        columns: usize,
        /// Channels.
        expected: usize,
    },
    /// The plant and the controller do not belong together.
    #[error(
        "the plant has {plant_inputs} inputs, {plant_outputs} outputs and a sample time of \
         {plant_s} s; the controller {inputs}, {outputs} and {controller_s} s"
    )]
    PlantMismatch {
        /// The plant's inputs.
        plant_inputs: usize,
        /// The plant's outputs.
        plant_outputs: usize,
        /// The plant's sample time, in seconds.
        plant_s: f64,
        /// The controller's inputs.
        inputs: usize,
        /// The controller's outputs.
        outputs: usize,
        /// The controller's sample time, in seconds.
        controller_s: f64,
    },
}
