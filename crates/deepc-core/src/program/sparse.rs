//! The sparse form: the problem as the papers write it.

use super::DeepcProgram;
use super::common::{Common, Ending};
use super::condensed::recovered;
use super::error::ProgramError;
use super::plan::{Moment, Plan, Recovered};
use super::settings::DeepcSettings;
use crate::hankel::Shape;
use crate::predictor::Predictor;
use crate::solver::{CscMatrix, QpMatrix, QpProblem, QpSolution, QpVectors};

/// The `DeePC` problem with all its variables x = (g, u, y, σ), σ only where slack is allowed:
///
/// ```text
/// [H̄_p  0  −I] x = w_ini      [H̄_f  −I  0] x = 0      bounds on u, y
/// ```
///
/// The reference for the condensed form and for what the papers measured. A step costs what the
/// length of the recording makes it cost; use [`super::CondensedProgram`] to control.
pub struct SparseProgram {
    common: Common,
    qp: QpProblem,
    layout: Layout,
    /// Divisor of every equality row.
    equality_scales: Vec<f64>,
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    x: Vec<f64>,
}

/// Where the variables stand in x.
#[derive(Debug, Clone)]
struct Layout {
    /// Entries of g.
    columns: usize,
    /// Entries of f.
    future: usize,
    /// Position in `w_ini` of every slack variable.
    slack_positions: Vec<usize>,
}

impl Layout {
    fn first_slack(&self) -> usize {
        self.columns + self.future
    }

    fn variables(&self) -> usize {
        self.first_slack() + self.slack_positions.len()
    }
}

impl SparseProgram {
    /// Set-up.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn new(predictor: &Predictor, settings: &DeepcSettings) -> Result<Self, ProgramError> {
        let common = Common::new(predictor, settings)?;
        let layout = Layout {
            columns: predictor.stacked().ncols(),
            future: common.shape.future_rows(),
            slack_positions: (0..common.compliance.len())
                .filter(|&i| common.compliance[i] > 0.0)
                .collect(),
        };
        let n = layout.variables();
        let past = common.shape.past_rows();
        let mut hessian = Vec::with_capacity(n);
        hessian.extend((0..layout.columns).map(|j| (j, j, 2.0 * common.lambda_g)));
        for (i, weight) in common.weights.iter().enumerate() {
            let j = layout.columns + i;
            hessian.push((j, j, 2.0 * weight));
        }
        for (k, &position) in layout.slack_positions.iter().enumerate() {
            let j = layout.first_slack() + k;
            hessian.push((j, j, 2.0 / common.compliance[position]));
        }

        let h = predictor.stacked();
        let scales = predictor.row_scales().to_vec();
        let mut rows = Vec::with_capacity(h.nrows() * (h.ncols() + 2));
        for j in 0..h.ncols() {
            for (i, &value) in h.col(j).iter().enumerate() {
                if value != 0.0 {
                    rows.push((i, j, value / scales[i]));
                }
            }
        }
        for i in 0..layout.future {
            rows.push((past + i, layout.columns + i, -1.0 / scales[past + i]));
        }
        for (k, &position) in layout.slack_positions.iter().enumerate() {
            rows.push((position, layout.first_slack() + k, -1.0 / scales[position]));
        }
        let bounds = &common.bounds;
        for (k, &position) in bounds.positions.iter().enumerate() {
            rows.push((
                h.nrows() + k,
                layout.columns + position,
                1.0 / bounds.scales[k],
            ));
        }
        let row_count = h.nrows() + bounds.len();
        let mut soft = vec![None; h.nrows()];
        soft.extend(bounds.row_penalties());
        let qp = QpProblem::new(
            QpMatrix::Sparse(CscMatrix::from_triplets(n, n, hessian)?),
            QpMatrix::Sparse(CscMatrix::from_triplets(row_count, n, rows)?),
            soft,
        )?;
        let mut lower = vec![0.0; row_count];
        let mut upper = vec![0.0; row_count];
        for k in 0..bounds.len() {
            lower[h.nrows() + k] = bounds.lower[k] / bounds.scales[k];
            upper[h.nrows() + k] = bounds.upper[k] / bounds.scales[k];
        }
        Ok(Self {
            common,
            qp,
            layout,
            equality_scales: scales,
            linear: vec![0.0; n],
            lower,
            upper,
            x: vec![0.0; n],
        })
    }

    fn future(&self) -> &[f64] {
        &self.x[self.layout.columns..self.layout.first_slack()]
    }
}

impl DeepcProgram for SparseProgram {
    fn shape(&self) -> Shape {
        self.common.shape
    }

    fn settings(&self) -> &DeepcSettings {
        &self.common.settings
    }

    fn sample_time_s(&self) -> f64 {
        self.common.sample_time_s
    }

    fn qp(&self) -> &QpProblem {
        &self.qp
    }

    fn set_moment(&mut self, moment: &Moment<'_>) -> Result<(), ProgramError> {
        self.common.stack(moment)?;
        let common = &self.common;
        for (i, value) in common.past.iter().enumerate() {
            self.lower[i] = value / self.equality_scales[i];
            self.upper[i] = self.lower[i];
        }
        let first = self.layout.columns;
        for (i, (weight, reference)) in common.weights.iter().zip(&common.reference).enumerate() {
            self.linear[first + i] = -2.0 * weight * reference;
        }
        Ok(())
    }

    fn vectors(&self) -> QpVectors<'_> {
        QpVectors {
            linear: &self.linear,
            lower: &self.lower,
            upper: &self.upper,
        }
    }

    fn plan_unconstrained(&mut self) -> bool {
        false
    }

    fn accept(&mut self, solution: &QpSolution) {
        let ending = Ending::of(solution);
        if !ending.status.is_usable() || solution.primal.len() != self.x.len() {
            self.common.reject(ending);
            return;
        }
        self.x.copy_from_slice(&solution.primal);
        let g = &self.x[..self.layout.columns];
        let mut model_cost = self.common.lambda_g * crate::linalg::dot(g, g);
        let slack = &self.x[self.layout.first_slack()..];
        for (&position, value) in self.layout.slack_positions.iter().zip(slack) {
            model_cost += value * value / self.common.compliance[position];
        }
        let future = &self.x[self.layout.columns..self.layout.first_slack()];
        self.common.write_plan(future, model_cost, ending);
    }

    fn plan(&self) -> &Plan {
        &self.common.plan
    }

    fn recover(&self) -> Option<Recovered> {
        if !self.common.plan.is_usable() {
            return None;
        }
        let mut slack = vec![0.0; self.common.past.len()];
        let values = &self.x[self.layout.first_slack()..];
        for (&position, &value) in self.layout.slack_positions.iter().zip(values) {
            slack[position] = value;
        }
        let g = self.x[..self.layout.columns].to_vec();
        Some(recovered(&self.common, self.future(), g, &slack))
    }
}
