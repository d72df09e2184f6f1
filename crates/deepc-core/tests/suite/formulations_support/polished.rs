//! An interior-point solution taken to the last digits.
//!
//! An interior-point method says which rows are active, and leaves 1e-8 or so of every number.
//! With the active rows known the optimum solves a linear system, dense here: slow, and as
//! accurate as the numbers allow. The certificate says whether the guess was right.

use deepc_core::solver::{
    ClarabelSettings, ClarabelSolver, CscMatrix, QpMatrix, QpProblem, QpSolution, QpSolver,
    QpStatus, QpVectors, SoftPenalty, SolveBudget, SolverError, certify,
};
use faer::{Col, Mat};

const ROUNDS: usize = 4;

const POLISHES: usize = 20;

pub struct Polished {
    inner: [ClarabelSolver; 3],
    problem: QpProblem,
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    solution: QpSolution,
}

/// How a row stands at the optimum.
#[derive(Clone, Copy)]
enum Row {
    Apart,
    /// At this bound.
    At(f64),
    /// Beyond this bound at a price, below or above by the sign.
    Beyond(f64, SoftPenalty, f64),
}

impl Polished {
    pub fn new(problem: &QpProblem) -> Self {
        // Clarabel breaks down where variables have no curvature (g without ‖g‖²). It only has to
        // say which rows are active.
        let n = problem.variable_count();
        let guess = |curvature: f64| {
            let mut hessian = problem.hessian().triplets();
            hessian.extend((0..n).map(|i| (i, i, curvature)));
            let guessed = QpProblem::new(
                QpMatrix::Sparse(CscMatrix::from_triplets(n, n, hessian).unwrap()),
                problem.rows().clone(),
                problem.soft().to_vec(),
            );
            ClarabelSolver::new(&guessed.unwrap(), ClarabelSettings::default()).unwrap()
        };
        Self {
            inner: [1e-6, 1e-4, 1e-2].map(guess),
            problem: problem.clone(),
            linear: vec![],
            lower: vec![],
            upper: vec![],
            solution: QpSolution::empty(problem.variable_count(), problem.row_count()),
        }
    }

    fn vectors(&self) -> QpVectors<'_> {
        QpVectors {
            linear: &self.linear,
            lower: &self.lower,
            upper: &self.upper,
        }
    }

    fn classify(&self, i: usize, value: f64, multiplier: f64) -> Row {
        let (lower, upper) = (self.lower[i], self.upper[i]);
        let penalty = self.problem.soft()[i];
        let equality = upper <= lower;
        let above = if equality {
            multiplier > 0.0 || (multiplier == 0.0 && value > upper)
        } else {
            value - upper > lower - value
        };
        let (sign, bound) = if above { (1.0, upper) } else { (-1.0, lower) };
        let (push, distance) = (sign * multiplier, sign * (value - bound));
        match penalty {
            None if equality => Row::At(bound),
            _ if !equality && -distance > push => Row::Apart,
            Some(penalty) if distance > penalty.linear - push => Row::Beyond(bound, penalty, sign),
            _ => Row::At(bound),
        }
    }

    fn polish(&mut self) {
        let (p, a) = (
            self.problem.hessian().to_dense(),
            self.problem.rows().to_dense(),
        );
        let (n, r) = (p.nrows(), a.nrows());
        let mut x = Col::from_fn(n, |i| self.solution.primal[i]);
        let values = &a * &x;
        let rows: Vec<Row> = (0..r)
            .map(|i| self.classify(i, values[i], self.solution.dual[i]))
            .collect();
        let active: Vec<usize> = (0..r).filter(|&i| matches!(rows[i], Row::At(_))).collect();
        let mut dual = Col::from_fn(r, |i| match rows[i] {
            Row::At(_) => self.solution.dual[i],
            _ => 0.0,
        });
        let mut curved = p.clone();
        for (i, row) in rows.iter().enumerate() {
            if let Row::Beyond(_, penalty, _) = row {
                let scaled = faer::Scale(penalty.quadratic) * a.row(i).transpose();
                curved += &scaled * a.row(i);
            }
        }
        let system = Mat::from_fn(n + active.len(), n + active.len(), |i, j| {
            match (i.checked_sub(n), j.checked_sub(n)) {
                (None, None) => curved[(i, j)],
                (None, Some(k)) => a[(active[k], i)],
                (Some(k), None) => a[(active[k], j)],
                (Some(_), Some(_)) => 0.0,
            }
        });
        let inverse = Svd::new(&system);
        for _ in 0..ROUNDS {
            let values = &a * &x;
            for (i, row) in rows.iter().enumerate() {
                if let Row::Beyond(bound, penalty, sign) = *row {
                    dual[i] = sign * penalty.linear + penalty.quadratic * (values[i] - bound);
                }
            }
            let gradient = &p * &x + a.transpose() * &dual;
            let residual = Col::from_fn(n + active.len(), |i| match i.checked_sub(n) {
                None => -gradient[i] - self.linear[i],
                Some(k) => match rows[active[k]] {
                    Row::At(bound) => bound - values[active[k]],
                    _ => 0.0,
                },
            });
            let step = inverse.solve(&residual);
            for i in 0..n {
                x[i] += step[i];
            }
            for (k, &row) in active.iter().enumerate() {
                dual[row] += step[n + k];
            }
        }
        let values = &a * &x;
        for (i, row) in rows.iter().enumerate() {
            if let Row::Beyond(bound, penalty, sign) = *row {
                dual[i] = sign * penalty.linear + penalty.quadratic * (values[i] - bound);
            }
        }
        let (x, dual): (Vec<_>, Vec<_>) =
            (x.iter().copied().collect(), dual.iter().copied().collect());
        let certificate = certify(&self.problem, &self.vectors(), &x, &dual);
        self.solution.rows = values.iter().copied().collect();
        self.solution.primal = x;
        self.solution.dual = dual;
        self.solution.certificate = certificate;
    }
}

struct Svd(faer::linalg::solvers::Svd<f64>, f64);

impl Svd {
    fn new(matrix: &Mat<f64>) -> Self {
        let svd = matrix.svd().unwrap();
        let largest = svd.S().column_vector().iter().copied().fold(0.0, f64::max);
        Self(svd, 1e-13 * largest)
    }

    fn solve(&self, right: &Col<f64>) -> Col<f64> {
        let mut c = self.0.U().transpose() * right;
        for (value, &s) in c.iter_mut().zip(self.0.S().column_vector().iter()) {
            *value = if s > self.1 { *value / s } else { 0.0 };
        }
        self.0.V() * c
    }
}

impl QpSolver for Polished {
    fn name(&self) -> &'static str {
        "polished"
    }

    fn problem(&self) -> &QpProblem {
        &self.problem
    }

    fn update(&mut self, vectors: QpVectors<'_>) -> Result<(), SolverError> {
        self.linear = vectors.linear.to_vec();
        self.lower = vectors.lower.to_vec();
        self.upper = vectors.upper.to_vec();
        let mut solvers = self.inner.iter_mut();
        solvers.try_for_each(|solver| solver.update(vectors))
    }

    fn solve(&mut self, budget: &SolveBudget) -> &QpSolution {
        for guess in 0..self.inner.len() {
            self.solution = self.inner[guess].solve(budget).clone();
            if !self.solution.status.is_usable() {
                if self.solution.status == QpStatus::Infeasible {
                    break;
                }
                continue;
            }
            // Rows that the guess got wrong show by their signs.
            for _ in 0..POLISHES {
                self.polish();
                if self.solution.certificate.relative < 1e-12 {
                    break;
                }
            }
            if self.solution.certificate.relative < 1e-9 {
                break;
            }
            // What could not be certified must not count as the reference.
            self.solution.status = QpStatus::NumericalError;
        }
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.inner.iter_mut().for_each(QpSolver::forget);
    }
}
