//! What can be wrong around the control loop.

use thiserror::Error;

use crate::hankel::Shape;
use crate::predictor::PredictorError;
use crate::program::ProgramError;

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
#[derive(Debug, Error)]
pub enum ControllerError {
    /// The program or its solver cannot be set up.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// The moves applied from one plan.
    #[error("`moves_per_solve` is {found}; give 1 to the horizon of {horizon} steps")]
    MovesPerSolve {
        /// Value found.
        found: usize,
        /// Horizon N.
        horizon: usize,
    },
    /// The budget of a solve.
    #[error("`{field}` is {iterations} iterations and {time_s} s; give at least 1 and more than 0")]
    Budget {
        /// `budget` or that of the second solver.
        field: &'static str,
        /// Iterations.
        iterations: u32,
        /// Seconds.
        time_s: f64,
    },
    /// The deadline.
    #[error("`deadline_s` is {found} s; give a finite time above 0, or none")]
    Deadline {
        /// Seconds found.
        found: f64,
    },
    /// Late plans shall be discarded, but nothing is ever late.
    #[error("`discard_late` is set without `deadline_s`: give the time after which a plan is late")]
    NoDeadline,
    /// The watch for frozen sensors.
    #[error("`frozen_after` is 0 samples; give at least 1, or none to watch for nothing")]
    FrozenAfter,
    /// A program cannot take over from another in a running controller.
    #[error(
        "the new program has {} inputs, {} measured disturbances, {} outputs and horizons of {} \
         and {} samples, the running one {}, {}, {}, {} and {}: only programs of one shape can \
         take over from each other",
        found.inputs, found.disturbances, found.outputs,
        found.horizons.past, found.horizons.future,
        shape.inputs, shape.disturbances, shape.outputs,
        shape.horizons.past, shape.horizons.future,
    )]
    OtherShape {
        /// Sizes of the running program.
        shape: Shape,
        /// Sizes of the new one.
        found: Shape,
    },
    /// A program for another clock.
    #[error(
        "the new program's data have a sample time of {found_s} s, the running one's {expected_s} s"
    )]
    OtherSampleTime {
        /// Of the running program, in seconds.
        expected_s: f64,
        /// Of the new one, in seconds.
        found_s: f64,
    },
    /// The ranges of a schedule are not in order.
    #[error(transparent)]
    Schedule(PredictorError),
    /// A schedule has another number of ranges than there are data sets.
    #[error("the schedule has {ranges} ranges for {data_sets} data sets: give one per range")]
    Ranges {
        /// Data sets.
        data_sets: usize,
        /// Ranges of the schedule.
        ranges: usize,
    },
    /// The data set a schedule starts with.
    #[error("`start` is data set {found}; there are {data_sets}, counted from 0")]
    Start {
        /// Index found.
        found: usize,
        /// Data sets.
        data_sets: usize,
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
        /// `input`, `output` or `disturbance`.
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
        "the plant has {plant_inputs} inputs, {plant_disturbances} measured disturbances, \
         {plant_outputs} outputs and a sample time of {plant_s} s; the controller {inputs}, \
         {disturbances}, {outputs} and {controller_s} s"
    )]
    PlantMismatch {
        /// The disturbances the plant measures.
        plant_disturbances: usize,
        /// The disturbances the controller takes.
        disturbances: usize,
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
