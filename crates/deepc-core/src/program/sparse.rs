//! The sparse form: the problem as the papers write it.

use faer::Mat;

use super::PredictiveProgram;
use super::common::{Common, Ending};
use super::error::ProgramError;
use super::plan::{Moment, Plan, Recovered};
use super::recover::recovered;
use super::regularisation::{Regularisation, RegularisedPart};
use super::settings::DeepcSettings;
use super::stage_settings::StageSettings;
use crate::hankel::{RANK_TOLERANCE, Shape};
use crate::linalg;
use crate::predictor::{Predictor, ReductionMethod};
use crate::solver::{CscMatrix, QpMatrix, QpProblem, QpSolution, QpStatus, QpVectors, SoftPenalty};

/// The `DeePC` problem with all its variables x = (g, u, y, σ), σ only where slack is allowed:
///
/// ```text
/// [H̄_known  0  −I] x = z      [H̄_f  −I  0] x = 0      constraints on u, y
/// ```
///
/// The reference for the condensed form and for what the papers measured, and the only form for
/// ‖g‖₁ (rows g = 0 that are soft at the price `λ_g`). The squared projection makes its Hessian dense
/// in g: nine million entries for 3001 columns. A step costs what the length of the
/// recording makes it cost; use [`super::CondensedProgram`] to control.
pub struct SparseProgram {
    common: Common,
    qp: QpProblem,
    layout: Layout,
    /// What g costs.
    charge: Charge,
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
    /// Position in z of every slack variable.
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

/// What g costs.
enum Charge {
    Nothing,
    SquaredNorm(f64),
    OneNorm(f64),
    /// λ‖(I − Π)g‖² with the matrix I − Π.
    Projection(f64, Mat<f64>),
}

impl Charge {
    fn new(
        common: &Common,
        predictor: &Predictor,
        regularisation: &Regularisation,
    ) -> Result<Self, ProgramError> {
        let lambda = regularisation.raw_lambda_g(common.columns);
        let refused = |part| ProgramError::Form {
            form: "the sparse form",
            part,
            remedy: "use `CondensedProgram`",
        };
        match regularisation.part {
            RegularisedPart::SquaredNorm => Ok(Self::SquaredNorm(lambda)),
            // ‖g‖₁ is not that of the reduced ḡ.
            RegularisedPart::OneNorm if predictor.reduction().method != ReductionMethod::None => {
                Err(ProgramError::Form {
                    form: "a reduced data matrix",
                    part: "one_norm",
                    remedy: "use `Predictor::full`: a reduction keeps squared norms only",
                })
            }
            RegularisedPart::OneNorm => Ok(Self::OneNorm(lambda)),
            RegularisedPart::None => Ok(Self::Nothing),
            RegularisedPart::SquaredProjection => {
                Ok(Self::Projection(lambda, residual_projector(predictor)?))
            }
            RegularisedPart::Gamma { .. } => Err(refused("gamma")),
            RegularisedPart::Spc => Err(refused("spc")),
        }
    }

    /// Entries of 2·(curvature) over g.
    fn hessian(&self, columns: usize) -> Vec<(usize, usize, f64)> {
        match self {
            Self::Nothing | Self::OneNorm(_) => Vec::new(),
            Self::SquaredNorm(lambda) => (0..columns).map(|j| (j, j, 2.0 * lambda)).collect(),
            Self::Projection(lambda, residual) => (0..columns)
                .flat_map(|j| (0..columns).map(move |i| (i, j, 2.0 * lambda * residual[(i, j)])))
                .collect(),
        }
    }

    fn cost(&self, g: &[f64]) -> f64 {
        match self {
            Self::Nothing => 0.0,
            Self::SquaredNorm(lambda) => lambda * linalg::dot(g, g),
            Self::OneNorm(lambda) => lambda * g.iter().map(|value| value.abs()).sum::<f64>(),
            Self::Projection(lambda, residual) => {
                let mut outside = vec![0.0; g.len()];
                linalg::multiply(&mut outside, residual.as_ref(), g);
                lambda * linalg::dot(&outside, &outside)
            }
        }
    }
}

/// I − Π, symmetric, with Π the projection onto the rows of z and u.
fn residual_projector(predictor: &Predictor) -> Result<Mat<f64>, ProgramError> {
    let shape = predictor.shape();
    let explaining = shape.known_rows() + shape.inputs * shape.horizons.future;
    let (h, scales) = (predictor.stacked(), predictor.row_scales());
    let scaled = Mat::from_fn(explaining, h.ncols(), |i, j| h[(i, j)] / scales[i]);
    let svd = scaled.thin_svd().map_err(|_| ProgramError::Decomposition {
        what: "the explaining rows of the data",
        size: explaining,
    })?;
    let sigma = svd.S().column_vector();
    let limit = RANK_TOLERANCE * sigma.iter().copied().fold(0.0, f64::max);
    let rank = sigma.iter().filter(|&&s| s > limit).count();
    let rows = svd.V().subcols(0, rank);
    let product = rows * rows.transpose();
    Ok(Mat::from_fn(h.ncols(), h.ncols(), |i, j| {
        f64::from(u8::from(i == j)) - 0.5 * (product[(i, j)] + product[(j, i)])
    }))
}

impl SparseProgram {
    /// Set-up.
    ///
    /// # Errors
    /// A setting is out of range, or the regularisation is one that only the condensed form has.
    pub fn new(predictor: &Predictor, settings: &DeepcSettings) -> Result<Self, ProgramError> {
        let common = Common::new(predictor, settings)?;
        let charge = Charge::new(&common, predictor, &settings.regularisation)?;
        let layout = Layout {
            columns: predictor.stacked().ncols(),
            future: common.shape.future_rows(),
            slack_positions: (0..common.compliance.len())
                .filter(|&i| common.compliance[i] > 0.0)
                .collect(),
        };
        let n = layout.variables();
        let mut hessian = charge.hessian(layout.columns);
        for (i, j, value) in common.cost.curvature() {
            hessian.push((layout.columns + i, layout.columns + j, 2.0 * value));
        }
        for (k, &position) in layout.slack_positions.iter().enumerate() {
            let j = layout.first_slack() + k;
            hessian.push((j, j, 2.0 / common.compliance[position]));
        }

        let h = predictor.stacked();
        let scales = predictor.row_scales().to_vec();
        let known = common.shape.known_rows();
        let mut rows = Vec::with_capacity(h.nrows() * (h.ncols() + 2));
        for j in 0..h.ncols() {
            for (i, &value) in h.col(j).iter().enumerate() {
                if value != 0.0 {
                    rows.push((i, j, value / scales[i]));
                }
            }
        }
        for i in 0..layout.future {
            rows.push((known + i, layout.columns + i, -1.0 / scales[known + i]));
        }
        for (k, &position) in layout.slack_positions.iter().enumerate() {
            rows.push((position, layout.first_slack() + k, -1.0 / scales[position]));
        }
        let constraints = &common.rows;
        let mut soft = vec![None; h.nrows()];
        for row in 0..constraints.len() {
            for (position, coefficient) in constraints.terms(row) {
                let value = coefficient / constraints.scales[row];
                rows.push((soft.len() + row, layout.columns + position, value));
            }
        }
        soft.extend(constraints.row_penalties());
        if let Charge::OneNorm(linear) = charge {
            for j in 0..layout.columns {
                rows.push((soft.len(), j, 1.0));
                soft.push(Some(SoftPenalty {
                    linear,
                    quadratic: 0.0,
                }));
            }
        }
        let row_count = soft.len();
        let qp = QpProblem::new(
            QpMatrix::Sparse(CscMatrix::from_triplets(n, n, hessian)?),
            QpMatrix::Sparse(CscMatrix::from_triplets(row_count, n, rows)?),
            soft,
        )?;
        Ok(Self {
            common,
            qp,
            layout,
            charge,
            equality_scales: scales,
            linear: vec![0.0; n],
            lower: vec![0.0; row_count],
            upper: vec![0.0; row_count],
            x: vec![0.0; n],
        })
    }

    fn slack(&self) -> Vec<f64> {
        let mut slack = vec![0.0; self.common.known.len()];
        let values = &self.x[self.layout.first_slack()..];
        for (&position, &value) in self.layout.slack_positions.iter().zip(values) {
            slack[position] = value;
        }
        slack
    }

    fn future(&self) -> &[f64] {
        &self.x[self.layout.columns..self.layout.first_slack()]
    }
}

impl PredictiveProgram for SparseProgram {
    fn shape(&self) -> Shape {
        self.common.shape
    }

    fn stage(&self) -> &StageSettings {
        &self.common.stage
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
        for (i, value) in common.known.iter().enumerate() {
            self.lower[i] = value / self.equality_scales[i];
            self.upper[i] = self.lower[i];
        }
        let first = self.equality_scales.len();
        let range = first..first + common.rows.len();
        common
            .rows
            .bounds(&mut self.lower[range.clone()], &mut self.upper[range]);
        let future = &mut self.linear[self.layout.columns..self.layout.first_slack()];
        common.cost.pull(&common.known, &common.reference, future);
        for value in future {
            *value *= -2.0;
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
        let mut ending = Ending::of(solution);
        if ending.status.is_usable() && solution.primal.len() != self.x.len() {
            ending.status = QpStatus::NumericalError;
        }
        if !ending.status.is_usable() {
            self.common.reject(ending);
            return;
        }
        self.x.copy_from_slice(&solution.primal);
        let future = &self.x[self.layout.columns..self.layout.first_slack()];
        self.common.write_plan(future, ending);
    }

    fn plan(&self) -> &Plan {
        &self.common.plan
    }

    fn objective(&self) -> Option<f64> {
        let plan = &self.common.plan;
        let (inputs, outputs) = self.common.slack_costs(&self.slack());
        let charge = self.charge.cost(&self.x[..self.layout.columns]);
        plan.is_usable()
            .then_some(plan.tracking + plan.soft_penalty + charge + inputs + outputs)
    }

    fn recover(&self) -> Option<Recovered> {
        if !self.common.plan.is_usable() {
            return None;
        }
        let g = self.x[..self.layout.columns].to_vec();
        let charge = self.charge.cost(&g);
        let slack = self.slack();
        Some(recovered(&self.common, self.future(), g, &slack, charge))
    }
}
