//! What set-up computes once: the program seen from its rows.

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, Par, Side};

use super::super::error::SolverError;
use super::super::problem::{QpMatrix, QpProblem};
use super::bounds::Price;
use crate::columns::Columns;
use crate::linalg;

/// With P = `LLᵀ`, V = L⁻¹Aᵀ and rows scaled to the length 1 of their column of V.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Constant {
    root: Root,
    /// V, n×r.
    reduced: Mat<f64>,
    /// V once more, as slices.
    pub reduced_columns: Columns,
    /// P⁻¹Aᵀ = L⁻ᵀV, n×r: how a unit of every multiplier moves x.
    moves: Columns,
    /// G = `VᵀV`, r×r.
    pub gram: Columns,
    /// What every row was divided by, and its reciprocal.
    pub scales: Vec<f64>,
    pub reciprocals: Vec<f64>,
    pub prices: Vec<Price>,
}

/// L of P = `LLᵀ`.
#[derive(Debug, Clone)]
enum Root {
    /// P is diagonal: its diagonal, n values, and their roots.
    Diagonal {
        curvature: Vec<f64>,
        roots: Vec<f64>,
    },
    /// n×n.
    Lower(Mat<f64>),
}

impl Constant {
    pub fn new(problem: &QpProblem) -> Result<Self, SolverError> {
        let root = Root::of(problem.hessian())?;
        let mut reduced = problem.rows().to_dense().transpose().to_owned();
        root.solve(&mut reduced);
        let r = problem.row_count();
        let mut scales = vec![1.0; r];
        for (j, scale) in scales.iter_mut().enumerate() {
            let length = reduced.col(j).norm_l2();
            // A row of zeros cannot move and keeps its scale.
            if length > f64::MIN_POSITIVE.sqrt() {
                *scale = length;
                let column = reduced.col_mut(j);
                column.iter_mut().for_each(|value| *value /= length);
            }
        }
        let gram = reduced.transpose() * &reduced;
        let mut moves = reduced.clone();
        root.solve_transposed(&mut moves);
        let prices = problem.soft().iter().zip(&scales);
        Ok(Self {
            root,
            reduced_columns: Columns::from_matrix(reduced.as_ref()),
            reduced,
            moves: Columns::from_matrix(moves.as_ref()),
            gram: Columns::from_matrix(gram.as_ref()),
            reciprocals: scales.iter().map(|scale| 1.0 / scale).collect(),
            prices: prices
                .map(|(&soft, &scale)| Price::scaled(soft, scale))
                .collect(),
            scales,
        })
    }

    /// Pⱼⱼ if P is diagonal.
    pub fn diagonal(&self) -> Option<&[f64]> {
        match &self.root {
            Root::Diagonal { curvature, .. } => Some(curvature),
            Root::Lower(_) => None,
        }
    }

    /// The unconstrained optimum x = −P⁻¹q and the values c of the scaled rows there.
    pub fn unconstrained(&self, linear: &[f64], x: &mut [f64], rows: &mut [f64]) {
        // With w = −L⁻¹q: c = Vᵀw and x = L⁻ᵀw.
        match &self.root {
            Root::Diagonal { roots, .. } => {
                for ((x, q), root) in x.iter_mut().zip(linear).zip(roots) {
                    *x = -q / root;
                }
                linalg::multiply(rows, self.reduced.transpose(), x);
                for (x, root) in x.iter_mut().zip(roots) {
                    *x /= root;
                }
            }
            Root::Lower(lower) => {
                for (x, q) in x.iter_mut().zip(linear) {
                    *x = -q;
                }
                linalg::solve_lower(lower.as_ref(), x);
                linalg::multiply(rows, self.reduced.transpose(), x);
                linalg::solve_upper(lower.transpose(), x);
            }
        }
    }

    /// x from the unconstrained optimum by the multipliers (row, μ) that are not zero.
    pub fn move_by(&self, x: &mut [f64], multipliers: &[(usize, f64)]) {
        self.moves.subtract(x, multipliers);
    }
}

impl Root {
    fn of(hessian: &QpMatrix) -> Result<Self, SolverError> {
        let n = hessian.ncols();
        let entries = hessian.triplets();
        if entries.iter().all(|&(i, j, _)| i == j) {
            let mut curvature = vec![0.0; n];
            for (i, _, value) in entries {
                curvature[i] += value;
            }
            if let Some(pivot) = curvature.iter().position(|value| *value <= 0.0) {
                return Err(SolverError::NotPositiveDefinite { pivot });
            }
            let roots = curvature.iter().map(|value| value.sqrt()).collect();
            return Ok(Self::Diagonal { curvature, roots });
        }
        let factor = hessian.to_dense().llt(Side::Lower).map_err(|error| {
            let faer::linalg::solvers::LltError::NonPositivePivot { index } = error;
            SolverError::NotPositiveDefinite { pivot: index }
        })?;
        Ok(Self::Lower(factor.L().to_owned()))
    }

    /// M ← L⁻¹M.
    fn solve(&self, matrix: &mut Mat<f64>) {
        match self {
            Self::Diagonal { roots, .. } => divide_rows(matrix, roots),
            Self::Lower(lower) => {
                solve_lower_triangular_in_place(lower.as_ref(), matrix.as_mut(), Par::Seq);
            }
        }
    }

    /// M ← L⁻ᵀM.
    fn solve_transposed(&self, matrix: &mut Mat<f64>) {
        match self {
            Self::Diagonal { roots, .. } => divide_rows(matrix, roots),
            Self::Lower(lower) => {
                solve_upper_triangular_in_place(lower.transpose(), matrix.as_mut(), Par::Seq);
            }
        }
    }
}

fn divide_rows(matrix: &mut Mat<f64>, divisors: &[f64]) {
    for column in matrix.col_iter_mut() {
        for (value, divisor) in column.iter_mut().zip(divisors) {
            *value /= divisor;
        }
    }
}
