//! What can be wrong with a quadratic program before it is solved.

use thiserror::Error;

/// Error of the solver stage.
#[derive(Debug, Error)]
pub enum SolverError {
    /// A matrix has the wrong size.
    #[error("{name} is {rows}×{columns}, expected {expected_rows}×{expected_columns}")]
    MatrixSize {
        /// Which matrix.
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
    /// A vector has the wrong length.
    #[error("{name} has {found} entries, expected {expected}")]
    VectorLength {
        /// Which vector.
        name: &'static str,
        /// Entries expected.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A matrix holds NaN or an infinity.
    #[error("{name} holds NaN or an infinity; check the data and the weights it was built from")]
    NotFinite {
        /// Which matrix.
        name: &'static str,
    },
    /// The Hessian is not symmetric.
    #[error(
        "the Hessian is not symmetric: entries ({row}, {column}) and its mirror differ by \
         {difference:e}; give the full symmetric matrix"
    )]
    NotSymmetric {
        /// Row of the worst entry.
        row: usize,
        /// Its column.
        column: usize,
        /// Difference between the two.
        difference: f64,
    },
    /// The Hessian must be positive definite for this solver.
    #[error(
        "the Hessian is not positive definite (pivot {pivot}); use `ClarabelSolver`, which allows semidefinite ones"
    )]
    NotPositiveDefinite {
        /// Row at which its Cholesky factorisation broke down.
        pivot: usize,
    },
    /// A soft penalty is out of range.
    #[error(
        "soft row {row} has linear {linear} and quadratic {quadratic} penalty; both must be \
         finite, at least 0, and not both 0"
    )]
    Penalty {
        /// Row.
        row: usize,
        /// ρ.
        linear: f64,
        /// w.
        quadratic: f64,
    },
    /// A sparse matrix is not in proper compressed-column form.
    #[error("sparse matrix: {problem}")]
    SparseStructure {
        /// What is wrong.
        problem: &'static str,
    },
    /// A solver setting is out of range.
    #[error("solver setting `{field}` is {found}; give {range}")]
    Setting {
        /// Field name.
        field: &'static str,
        /// Value found.
        found: f64,
        /// What is allowed.
        range: &'static str,
    },
}

/// The range of every back end's `tolerance`.
pub(super) fn check_tolerance(found: f64) -> Result<(), SolverError> {
    if (1e-12..=1e-3).contains(&found) {
        return Ok(());
    }
    Err(SolverError::Setting {
        field: "tolerance",
        found,
        range: "a value from 1e-12 to 1e-3",
    })
}
