//! The constant part of a quadratic program, checked once.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::error::SolverError;
use super::sparse_matrix::CscMatrix;
use crate::linalg;

/// Price of violating a soft row by s ≥ 0: `linear`·s + ½·`quadratic`·s² (note the ½).
///
/// With `linear` above the multiplier the hard row would have, the violation is exactly zero
/// whenever it can be (an exact penalty); with `quadratic` alone it is small but never zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SoftPenalty {
    /// ρ ≥ 0, cost per unit of violation.
    pub linear: f64,
    /// w ≥ 0, cost per unit of violation squared, halved.
    pub quadratic: f64,
}

impl SoftPenalty {
    /// Whether both are finite and at least 0, and one is above 0.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let proper = |value: f64| value.is_finite() && value >= 0.0;
        proper(self.linear) && proper(self.quadratic) && self.linear + self.quadratic > 0.0
    }

    /// ρs + ½ws².
    #[must_use]
    pub fn cost(&self, violation: f64) -> f64 {
        self.linear * violation + 0.5 * self.quadratic * violation * violation
    }
}

/// A constant matrix, dense or sparse.
#[derive(Debug, Clone, PartialEq)]
pub enum QpMatrix {
    /// Dense.
    Dense(Mat<f64>),
    /// Compressed columns.
    Sparse(CscMatrix),
}

impl QpMatrix {
    /// Rows.
    #[must_use]
    pub fn nrows(&self) -> usize {
        match self {
            Self::Dense(matrix) => matrix.nrows(),
            Self::Sparse(matrix) => matrix.nrows(),
        }
    }

    /// Columns.
    #[must_use]
    pub fn ncols(&self) -> usize {
        match self {
            Self::Dense(matrix) => matrix.ncols(),
            Self::Sparse(matrix) => matrix.ncols(),
        }
    }

    /// A dense copy.
    #[must_use]
    pub fn to_dense(&self) -> Mat<f64> {
        match self {
            Self::Dense(matrix) => matrix.clone(),
            Self::Sparse(matrix) => {
                let mut dense = Mat::zeros(matrix.nrows(), matrix.ncols());
                for (i, j, value) in matrix.triplets() {
                    dense[(i, j)] = value;
                }
                dense
            }
        }
    }

    /// All entries that are not zero, by column and rising row.
    #[must_use]
    pub fn triplets(&self) -> Vec<(usize, usize, f64)> {
        match self {
            Self::Dense(matrix) => nonzeros(matrix.as_ref()),
            Self::Sparse(matrix) => matrix.triplets().collect(),
        }
    }

    /// `out = M·x`.
    pub(crate) fn multiply(&self, out: &mut [f64], x: &[f64]) {
        match self {
            Self::Dense(matrix) => linalg::multiply(out, matrix.as_ref(), x),
            Self::Sparse(matrix) => {
                out.fill(0.0);
                for (i, j, value) in matrix.triplets() {
                    out[i] += value * x[j];
                }
            }
        }
    }

    /// `out += Mᵀ·y`.
    pub(crate) fn multiply_transposed_add(&self, out: &mut [f64], y: &[f64]) {
        match self {
            Self::Dense(matrix) => linalg::multiply_add(out, matrix.transpose(), y, 1.0),
            Self::Sparse(matrix) => {
                for (i, j, value) in matrix.triplets() {
                    out[j] += value * y[i];
                }
            }
        }
    }

    fn is_finite(&self) -> bool {
        match self {
            Self::Dense(matrix) => matrix.is_all_finite(),
            Self::Sparse(matrix) => matrix.values().iter().all(|value| value.is_finite()),
        }
    }
}

fn nonzeros(matrix: MatRef<'_, f64>) -> Vec<(usize, usize, f64)> {
    let mut entries = Vec::new();
    for j in 0..matrix.ncols() {
        for (i, &value) in matrix.col(j).iter().enumerate() {
            if value != 0.0 {
                entries.push((i, j, value));
            }
        }
    }
    entries
}

/// The vectors of a quadratic program that change every step.
#[derive(Debug, Clone, Copy)]
pub struct QpVectors<'a> {
    /// q, n values.
    pub linear: &'a [f64],
    /// l, r values; −∞ for no bound.
    pub lower: &'a [f64],
    /// u, r values; +∞ for no bound.
    pub upper: &'a [f64],
}

/// The constant part of a quadratic program: P (n×n), A (r×n) and the soft rows.
#[derive(Debug, Clone, PartialEq)]
pub struct QpProblem {
    hessian: QpMatrix,
    rows: QpMatrix,
    soft: Vec<Option<SoftPenalty>>,
}

impl QpProblem {
    /// Checks and takes the constant parts. `hessian` is the full symmetric matrix; `soft` has
    /// one entry per row of `rows`, `None` for a hard row.
    ///
    /// # Errors
    /// Sizes do not fit, an entry is not finite, the Hessian is not symmetric, or a penalty is
    /// out of range. Whether the Hessian is positive semidefinite is left to the solvers.
    pub fn new(
        hessian: QpMatrix,
        rows: QpMatrix,
        soft: Vec<Option<SoftPenalty>>,
    ) -> Result<Self, SolverError> {
        let n = hessian.ncols();
        for (name, matrix, expected_rows) in [
            ("the Hessian", &hessian, n),
            ("the row matrix", &rows, rows.nrows()),
        ] {
            if matrix.nrows() != expected_rows || matrix.ncols() != n {
                return Err(SolverError::MatrixSize {
                    name,
                    rows: matrix.nrows(),
                    columns: matrix.ncols(),
                    expected_rows,
                    expected_columns: n,
                });
            }
            if !matrix.is_finite() {
                return Err(SolverError::NotFinite { name });
            }
        }
        if soft.len() != rows.nrows() {
            return Err(SolverError::VectorLength {
                name: "soft",
                expected: rows.nrows(),
                found: soft.len(),
            });
        }
        for (row, penalty) in soft.iter().enumerate() {
            if let Some(penalty) = penalty.filter(|penalty| !penalty.is_valid()) {
                return Err(SolverError::Penalty {
                    row,
                    linear: penalty.linear,
                    quadratic: penalty.quadratic,
                });
            }
        }
        check_symmetric(&hessian)?;
        Ok(Self {
            hessian,
            rows,
            soft,
        })
    }

    /// P, n×n.
    #[must_use]
    pub fn hessian(&self) -> &QpMatrix {
        &self.hessian
    }

    /// A, r×n.
    #[must_use]
    pub fn rows(&self) -> &QpMatrix {
        &self.rows
    }

    /// The penalty of every row; `None` for a hard row.
    #[must_use]
    pub fn soft(&self) -> &[Option<SoftPenalty>] {
        &self.soft
    }

    /// Number of variables n.
    #[must_use]
    pub fn variable_count(&self) -> usize {
        self.hessian.ncols()
    }

    /// Number of rows r.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.rows.nrows()
    }

    /// Checks the lengths of the moving vectors.
    ///
    /// # Errors
    /// A length does not fit.
    pub fn check_lengths(&self, vectors: &QpVectors<'_>) -> Result<(), SolverError> {
        for (name, found, expected) in [
            ("q", vectors.linear.len(), self.variable_count()),
            ("l", vectors.lower.len(), self.row_count()),
            ("u", vectors.upper.len(), self.row_count()),
        ] {
            if found != expected {
                return Err(SolverError::VectorLength {
                    name,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }
}

fn check_symmetric(hessian: &QpMatrix) -> Result<(), SolverError> {
    let dense;
    let matrix = match hessian {
        QpMatrix::Dense(matrix) => matrix.as_ref(),
        // The Hessians of this crate's sparse programs are diagonal; looking for the mirror of
        // every entry needs no dense copy.
        QpMatrix::Sparse(sparse) if sparse.triplets().all(|(i, j, _)| i == j) => return Ok(()),
        QpMatrix::Sparse(_) => {
            dense = hessian.to_dense();
            dense.as_ref()
        }
    };
    for j in 0..matrix.ncols() {
        for i in 0..j {
            let (value, mirror) = (matrix[(i, j)], matrix[(j, i)]);
            let difference = (value - mirror).abs();
            // Rounding of a product like FᵀWF is relative to the diagonal entries it meets.
            let size = (matrix[(i, i)] * matrix[(j, j)])
                .abs()
                .sqrt()
                .max(value.abs());
            if difference > 1e-9 * size {
                return Err(SolverError::NotSymmetric {
                    row: i,
                    column: j,
                    difference,
                });
            }
        }
    }
    Ok(())
}

/// The moving vectors, owned by a solver.
#[derive(Debug, Clone)]
pub(super) struct OwnedVectors {
    pub linear: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
}

/// What the vectors allow before anything is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Screening {
    Proceed,
    Invalid,
    Infeasible,
}

impl OwnedVectors {
    pub fn new(problem: &QpProblem) -> Self {
        let rows = problem.row_count();
        Self {
            linear: vec![0.0; problem.variable_count()],
            lower: vec![f64::NEG_INFINITY; rows],
            upper: vec![f64::INFINITY; rows],
        }
    }

    pub fn copy_from(
        &mut self,
        problem: &QpProblem,
        vectors: &QpVectors<'_>,
    ) -> Result<(), SolverError> {
        problem.check_lengths(vectors)?;
        self.linear.copy_from_slice(vectors.linear);
        self.lower.copy_from_slice(vectors.lower);
        self.upper.copy_from_slice(vectors.upper);
        Ok(())
    }

    pub fn as_ref(&self) -> QpVectors<'_> {
        QpVectors {
            linear: &self.linear,
            lower: &self.lower,
            upper: &self.upper,
        }
    }

    /// Clause 4 of the contract.
    pub fn screen(&self) -> Screening {
        let bad_lower = |l: &f64| l.is_nan() || *l == f64::INFINITY;
        let bad_upper = |u: &f64| u.is_nan() || *u == f64::NEG_INFINITY;
        // Looking at all of them without leaving early is faster: it compiles to vector code.
        let mut bad = self
            .linear
            .iter()
            .fold(false, |bad, q| bad | !q.is_finite());
        let mut contradict = false;
        for (l, u) in self.lower.iter().zip(&self.upper) {
            bad |= bad_lower(l) | bad_upper(u);
            contradict |= l > u;
        }
        if bad {
            Screening::Invalid
        } else if contradict {
            Screening::Infeasible
        } else {
            Screening::Proceed
        }
    }
}
