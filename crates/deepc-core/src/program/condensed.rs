//! The condensed form: g and the slacks eliminated at set-up.

use faer::Mat;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;

use super::common::{Common, Ending};
use super::error::ProgramError;
use super::past_factor::PastFactor;
use super::plan::{Moment, Plan, Recovered};
use super::settings::DeepcSettings;
use super::{CONSISTENCY_TOLERANCE, DeepcProgram};
use crate::hankel::{Shape, unstack_into};
use crate::linalg;
use crate::predictor::Predictor;
use crate::solver::{QpMatrix, QpProblem, QpSolution, QpStatus, QpVectors};

/// An unconstrained optimum counts as meeting a bound that it misses by no more than this
/// fraction of the channel's size. Inputs are clipped to their bounds in any case.
const BOUND_TOLERANCE: f64 = 1e-9;

/// The `DeePC` problem in the variables z of f = f0 + F z (with f = col(u, y)), (m+p)N of them,
/// whatever the length of the recording:
///
/// ```text
/// min ‖z‖² + ‖f − r‖²_W + soft bounds      s.t. bounds on f,      W = blkdiag(R, Q)
/// P = 2(I + FᵀWF)    q = 2FᵀW(f0 − r)    rows: those of F whose signal is bounded
/// ```
///
/// plus the constant ‖a‖² (module `past_factor`). Exact: the optimum is that of
/// [`super::SparseProgram`] for any data, also without noise, where F is singular. It needs the
/// squared 2-norm of g and of the slacks.
///
/// Set-up costs one QR decomposition of (J + (m+p)·`T_ini`)×(m+p)L, about 0.1 s for 600×3001
/// data. A step costs a few products with (m+p)N×(m+p)N matrices.
pub struct CondensedProgram {
    common: Common,
    factor: PastFactor,
    qp: QpProblem,
    /// Lower Cholesky factor of I + `FᵀWF`.
    hessian_factor: Mat<f64>,
    a: Vec<f64>,
    f0: Vec<f64>,
    /// f of the present plan.
    future: Vec<f64>,
    /// z of the present plan.
    z: Vec<f64>,
    weighted: Vec<f64>,
    linear: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl CondensedProgram {
    /// Set-up.
    ///
    /// # Errors
    /// A setting is out of range, or the data and weights span too many orders of magnitude.
    pub fn new(predictor: &Predictor, settings: &DeepcSettings) -> Result<Self, ProgramError> {
        let common = Common::new(predictor, settings)?;
        let factor = PastFactor::new(predictor, common.lambda_g, &common.compliance)?;
        let f = &factor.future;
        let n = f.ncols();
        // Cholesky factor of I + FᵀWF from the QR decomposition of [I; W^½F].
        let stacked = Mat::from_fn(2 * n, n, |i, j| match i.checked_sub(n) {
            Some(i) => common.weights[i].sqrt() * f[(i, j)],
            None => f64::from(u8::from(i == j)),
        });
        let hessian_factor = linalg::lower_from_upper(stacked.qr().thin_R());
        let product = &hessian_factor * hessian_factor.transpose();
        // The product of a matrix and its transpose is symmetric only up to rounding.
        let hessian = Mat::from_fn(n, n, |i, j| product[(i, j)] + product[(j, i)]);
        let bounds = &common.bounds;
        let rows = Mat::from_fn(bounds.len(), n, |i, j| {
            f[(bounds.positions[i], j)] / bounds.scales[i]
        });
        let qp = QpProblem::new(
            QpMatrix::Dense(hessian),
            QpMatrix::Dense(rows),
            bounds.row_penalties().collect(),
        )?;
        let bound_count = bounds.len();
        Ok(Self {
            a: vec![0.0; factor.rank()],
            f0: vec![0.0; n],
            future: vec![0.0; n],
            z: vec![0.0; n],
            weighted: vec![0.0; n],
            linear: vec![0.0; n],
            lower: vec![0.0; bound_count],
            upper: vec![0.0; bound_count],
            common,
            factor,
            qp,
            hessian_factor,
        })
    }

    /// f = f0 + F z.
    fn predict_future(&mut self) {
        self.future.copy_from_slice(&self.f0);
        linalg::multiply_add(&mut self.future, self.factor.future.as_ref(), &self.z, 1.0);
    }

    fn model_cost(&self) -> f64 {
        linalg::dot(&self.a, &self.a) + linalg::dot(&self.z, &self.z)
    }

    fn past_is_consistent(&self) -> bool {
        self.common.plan.past_inconsistency <= CONSISTENCY_TOLERANCE
    }

    /// The gain of the unconstrained optimum: f* = f0 + G W (r − f0) with the returned
    /// G = F(I + FᵀWF)⁻¹Fᵀ, (m+p)N×(m+p)N, rows and columns col(u, y). For study: it shows how
    /// far a reference of one channel and step is followed by every other.
    #[must_use]
    pub fn gain(&self) -> Mat<f64> {
        let mut v = self.factor.future.transpose().to_owned();
        let lower = self.hessian_factor.as_ref();
        solve_lower_triangular_in_place(lower, v.as_mut(), faer::Par::Seq);
        v.transpose() * &v
    }
}

impl DeepcProgram for CondensedProgram {
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
        let common = &mut self.common;
        common.plan.past_inconsistency =
            self.factor.predict(&common.past, &mut self.a, &mut self.f0);
        for (i, weighted) in self.weighted.iter_mut().enumerate() {
            *weighted = 2.0 * common.weights[i] * (self.f0[i] - common.reference[i]);
        }
        let f = self.factor.future.as_ref();
        linalg::multiply(&mut self.linear, f.transpose(), &self.weighted);
        let bounds = &common.bounds;
        for (row, &position) in bounds.positions.iter().enumerate() {
            let (start, scale) = (self.f0[position], bounds.scales[row]);
            self.lower[row] = (bounds.lower[row] - start) / scale;
            self.upper[row] = (bounds.upper[row] - start) / scale;
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
        if !self.past_is_consistent() {
            return false;
        }
        // z = −P⁻¹q with P = 2 L Lᵀ.
        for (z, linear) in self.z.iter_mut().zip(&self.linear) {
            *z = -0.5 * linear;
        }
        linalg::solve_lower(self.hessian_factor.as_ref(), &mut self.z);
        linalg::solve_upper(self.hessian_factor.transpose(), &mut self.z);
        self.predict_future();
        let finite = self.future.iter().all(|value| value.is_finite());
        if !finite || !self.common.bounds.are_met(&self.future, BOUND_TOLERANCE) {
            return false;
        }
        let model_cost = self.model_cost();
        self.common
            .write_plan(&self.future, model_cost, Ending::unconstrained());
        true
    }

    fn refuse_past(&mut self) -> bool {
        let refused = !self.past_is_consistent();
        if refused {
            self.common.reject(Ending::refused());
        }
        refused
    }

    fn accept(&mut self, solution: &QpSolution) {
        let mut ending = Ending::of(solution);
        if !self.past_is_consistent() {
            ending.status = QpStatus::Infeasible;
        }
        if !ending.status.is_usable() || solution.primal.len() != self.z.len() {
            self.common.reject(ending);
            return;
        }
        self.z.copy_from_slice(&solution.primal);
        self.predict_future();
        let model_cost = self.model_cost();
        self.common.write_plan(&self.future, model_cost, ending);
    }

    fn plan(&self) -> &Plan {
        &self.common.plan
    }

    fn recover(&self) -> Option<Recovered> {
        if !self.common.plan.is_usable() {
            return None;
        }
        let (g, slack) = self.factor.recover(&self.a, &self.z);
        Some(recovered(&self.common, &self.future, g, &slack))
    }
}

/// Puts g and `col(σ_u, σ_y)` into the shape the user sees.
pub(super) fn recovered(common: &Common, future: &[f64], g: Vec<f64>, slack: &[f64]) -> Recovered {
    let Shape {
        inputs,
        outputs,
        horizons,
    } = common.shape;
    let (slack_u, slack_y) = slack.split_at(inputs * horizons.past);
    let mut input_slack = Mat::zeros(horizons.past, inputs);
    let mut output_slack = Mat::zeros(horizons.past, outputs);
    unstack_into(slack_u, input_slack.as_mut());
    unstack_into(slack_y, output_slack.as_mut());
    Recovered {
        parts: common.parts(future, &g, slack),
        g,
        input_slack,
        output_slack,
    }
}
