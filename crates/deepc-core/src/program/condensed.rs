//! The condensed form: g and the slacks eliminated at set-up.

use faer::Mat;

use super::common::{Common, Ending};
use super::error::ProgramError;
use super::future_map::Elimination;
use super::gain::Gain;
use super::model::PredictionModel;
use super::plan::{MeasuredDisturbances, Moment, Plan, Recovered};
use super::recover::{least_norm, recovered};
use super::settings::DeepcSettings;
use super::stage_settings::StageSettings;
use super::{CONSISTENCY_TOLERANCE, PredictiveProgram};
use crate::hankel::Shape;
use crate::linalg;
use crate::predictor::Predictor;
use crate::solver::{CscMatrix, QpMatrix, QpProblem, QpSolution, QpStatus, QpVectors};

/// An unconstrained optimum counts as meeting a constraint that it misses by no more than this
/// fraction of the constraint's size. Inputs are clipped to their bounds in any case.
const BOUND_TOLERANCE: f64 = 1e-9;

/// A row that moves less than this fraction of the most movable one (both in sizes of their
/// channels) does not move.
const ROW_TOLERANCE: f64 = 1e-13;

/// The `DeePC` problem in at most (m+p)N variables, whatever the length of the recording, and
/// whitened: with f = Φz + F ζ + B η (module `future_map`), x = (ζ, η), M = [F B] and
///
/// ```text
/// RᵀR = blkdiag(I, 0) + MᵀWM      V = R⁻ᵀMᵀ      G = VᵀV
/// f* = (I − GW)Φz + GW r          the optimum without constraints: one constant matrix
/// min ‖s‖²                        s.t. constraints on f = f* + Vᵀs, soft ones at their price
/// ```
///
/// so that s = 0 is the unconstrained optimum, the Hessian is 2I, and only the bounds move from
/// step to step. W holds R, Q and the weights of input changes.
///
/// Exact: the optimum is that of [`super::SparseProgram`] for any data, also without noise. It
/// needs squared norms; ‖g‖₁ is refused.
///
/// Set-up costs one QR decomposition of the data, about 0.1 s for 600×3001. A step costs one
/// product with an (m+p)N×(known + references) matrix, and what the solver does.
pub struct CondensedProgram {
    common: Common,
    elimination: Elimination,
    qp: QpProblem,
    gain: Gain,
    /// Entries of f that no row of the program gives by itself, and their rows of Vᵀ.
    others: Vec<usize>,
    other_rows: Mat<f64>,
    other_values: Vec<f64>,
    /// Row of the program that gives an entry of f: (entry, row).
    givers: Vec<(usize, usize)>,
    /// f*.
    optimum: Vec<f64>,
    /// f of the present plan.
    future: Vec<f64>,
    /// s of the present plan.
    s: Vec<f64>,
    zeros: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl CondensedProgram {
    /// Set-up.
    ///
    /// # Errors
    /// A setting is out of range, the data and weights span too many orders of magnitude, the
    /// cost does not determine the plan, or the regularisation is the 1-norm.
    pub fn new(predictor: &Predictor, settings: &DeepcSettings) -> Result<Self, ProgramError> {
        let common = Common::new(predictor, settings)?;
        let elimination = Elimination::new(
            predictor,
            &settings.regularisation,
            common.columns,
            &common.compliance,
        )?;
        let gain = Gain::new(&common, &elimination, Some(predictor))?;
        Self::assemble(common, elimination, gain)
    }

    /// Set-up from a linear model in place of data: the same costs, constraints and code, with η = the
    /// free part of [`PredictionModel`] to choose and its estimator in place of the past window. Steps
    /// of a running loop are passed on with [`PredictiveProgram::observe`]; a program that never gets
    /// any starts the estimator from the window of every moment.
    ///
    /// # Errors
    /// A setting is out of range, a shape or size of the model does not fit, or the cost does not
    /// determine the plan.
    pub fn from_model(model: PredictionModel, stage: &StageSettings) -> Result<Self, ProgramError> {
        model.check()?;
        let shape = model.shape;
        stage.check(shape.inputs, shape.outputs, shape.horizons.future)?;
        let (sample_time_s, scales) = (model.sample_time_s, model.future_scales());
        let common = Common::without_data(shape, sample_time_s, &scales, stage.clone());
        let elimination = Elimination::of_model(model);
        let gain = Gain::new(&common, &elimination, None)?;
        Self::assemble(common, elimination, gain)
    }

    fn assemble(
        common: Common,
        elimination: Elimination,
        gain: Gain,
    ) -> Result<Self, ProgramError> {
        let spread = &gain.spread;
        let (n, k) = spread.shape();

        let rows = &common.rows;
        let mut matrix = Mat::zeros(rows.len(), k);
        for i in 0..rows.len() {
            for (position, coefficient) in rows.terms(i) {
                let factor = coefficient / rows.scales[i];
                for j in 0..k {
                    matrix[(i, j)] += factor * spread[(position, j)];
                }
            }
        }
        clear_rounding(&mut matrix);
        let diagonal = (0..k).map(|i| (i, i, 2.0)).collect();
        let qp = QpProblem::new(
            QpMatrix::Sparse(CscMatrix::from_triplets(k, k, diagonal)?),
            QpMatrix::Dense(matrix),
            rows.row_penalties().collect(),
        )?;
        let mut giver = vec![None; n];
        for row in 0..rows.len() {
            if let Some(position) = rows.single(row) {
                giver[position].get_or_insert(row);
            }
        }
        let others: Vec<_> = (0..n).filter(|&i| giver[i].is_none()).collect();
        let givers = giver.into_iter().enumerate();
        Ok(Self {
            givers: givers.filter_map(|(i, row)| Some((i, row?))).collect(),
            other_rows: Mat::from_fn(others.len(), k, |i, j| spread[(others[i], j)]),
            other_values: vec![0.0; others.len()],
            others,
            optimum: vec![0.0; n],
            future: vec![0.0; n],
            s: vec![0.0; k],
            zeros: vec![0.0; k],
            lower: vec![0.0; rows.len()],
            upper: vec![0.0; rows.len()],
            common,
            elimination,
            qp,
            gain,
        })
    }

    /// f = f* + Vᵀs, where the solver has not computed it as the value of a row.
    fn predict_future(&mut self, values: &[f64]) {
        self.future.copy_from_slice(&self.optimum);
        for &(position, row) in &self.givers {
            self.future[position] += self.common.rows.scales[row] * values[row];
        }
        if !self.others.is_empty() {
            linalg::multiply(&mut self.other_values, self.other_rows.as_ref(), &self.s);
            for (&position, value) in self.others.iter().zip(&self.other_values) {
                self.future[position] += value;
            }
        }
    }

    /// Why there is no plan whatever a solver says, if there is none.
    fn refusal(&self) -> Option<QpStatus> {
        let finite = self.optimum.iter().all(|value| value.is_finite());
        let consistent = self.common.plan.past_inconsistency <= CONSISTENCY_TOLERANCE;
        match (finite, consistent) {
            // Without a constraint no solver would notice.
            (false, _) => Some(QpStatus::InvalidData),
            (true, false) => Some(QpStatus::Infeasible),
            (true, true) => None,
        }
    }

    /// G of the unconstrained optimum f* = (I − GW)Φz + GW r, (m+p)N×(m+p)N, rows and columns
    /// col(u, y). For study: it shows how far a reference of one channel and step is followed by
    /// every other.
    #[must_use]
    pub fn reference_gain(&self) -> Mat<f64> {
        &self.gain.spread * self.gain.spread.transpose()
    }

    /// The constant matrix K of the unconstrained optimum f* = K θ. θ is the known part
    /// `z = col(u_ini, d_ini, y_ini, d)` and the entries of the reference r that have a weight; where
    /// the data span z so badly that digits would be lost, z is replaced by its coordinates.
    #[must_use]
    pub fn optimum_gain(&self) -> faer::MatRef<'_, f64> {
        self.gain.matrix.as_matrix()
    }

    /// x = (ζ, η) of the present plan.
    fn coordinates(&self) -> Vec<f64> {
        let map = self.elimination.map();
        let n = self.optimum.len();
        let mut c = vec![0.0; map.known.ncols()];
        self.elimination
            .write_coordinates(&self.common.known, &mut c);
        let mut start = vec![0.0; n];
        linalg::multiply(&mut start, map.known.as_ref(), &c);
        let mut pull = vec![0.0; n];
        self.common
            .cost
            .pull(&self.common.known, &self.common.reference, &mut pull);
        for (i, j, weight) in self.common.cost.curvature() {
            pull[i] -= weight * start[j];
        }
        let mut x = self.s.clone();
        linalg::multiply_add(&mut x, self.gain.spread.transpose(), &pull, 1.0);
        linalg::solve_upper(self.gain.root.as_ref(), &mut x);
        x
    }

    /// What g and the slacks of the present plan cost, from its coordinates x.
    fn model_cost(&self, x: &[f64]) -> f64 {
        let charged = self.elimination.map().charged.ncols();
        let zeta = &x[..charged];
        self.elimination.known_cost(&self.common) + linalg::dot(zeta, zeta)
    }
}

/// Rows that nothing decided can move are zero but for rounding, and a solver would move them all
/// the same, at a senseless price.
fn clear_rounding(rows: &mut Mat<f64>) {
    let lengths: Vec<_> = rows.row_iter().map(|row| row.norm_l2()).collect();
    let limit = ROW_TOLERANCE * linalg::max_abs(&lengths);
    for (i, &length) in lengths.iter().enumerate() {
        if length <= limit {
            rows.row_mut(i).fill(0.0);
        }
    }
}

impl PredictiveProgram for CondensedProgram {
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

    fn observe(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        if let Some(tracking) = self.elimination.tracking() {
            tracking.observe(input, disturbance, output);
        }
    }

    fn forget(&mut self) {
        if let Some(tracking) = self.elimination.tracking() {
            tracking.forget();
        }
    }

    fn set_moment(&mut self, moment: &Moment<'_>) -> Result<(), ProgramError> {
        self.common.stack(moment)?;
        if let Some(tracking) = self.elimination.tracking() {
            let disturbances = MeasuredDisturbances::or_none(moment.disturbances).past;
            tracking.prepare(moment.past_inputs, disturbances, moment.past_outputs);
        }
        let common = &mut self.common;
        common.plan.past_inconsistency = self.elimination.inconsistency(&common.known);
        self.gain
            .write_optimum(common, &self.elimination, &mut self.optimum);
        if let Some(tracking) = self.elimination.tracking() {
            tracking.keep_if_finite(&self.optimum);
        }
        common
            .rows
            .bounds_from(&self.optimum, &mut self.lower, &mut self.upper);
        Ok(())
    }

    fn vectors(&self) -> QpVectors<'_> {
        QpVectors {
            linear: &self.zeros,
            lower: &self.lower,
            upper: &self.upper,
        }
    }

    fn plan_unconstrained(&mut self) -> bool {
        if self.refusal().is_some() || !self.common.rows.are_met(&self.optimum, BOUND_TOLERANCE) {
            return false;
        }
        self.s.fill(0.0);
        self.future.copy_from_slice(&self.optimum);
        self.common
            .write_plan(&self.future, Ending::unconstrained());
        true
    }

    fn refuse_past(&mut self) -> bool {
        let refusal = self.refusal();
        if let Some(status) = refusal {
            self.common.reject(Ending::refused(status));
        }
        refusal.is_some()
    }

    fn accept(&mut self, solution: &QpSolution) {
        let mut ending = Ending::of(solution);
        if let Some(status) = self.refusal() {
            ending.status = status;
        }
        let fits = solution.primal.len() == self.s.len() && solution.rows.len() == self.lower.len();
        if ending.status.is_usable() && !fits {
            ending.status = QpStatus::NumericalError;
        }
        if !ending.status.is_usable() {
            self.common.reject(ending);
            return;
        }
        self.s.copy_from_slice(&solution.primal);
        self.predict_future(&solution.rows);
        self.common.write_plan(&self.future, ending);
    }

    fn plan(&self) -> &Plan {
        &self.common.plan
    }

    fn objective(&self) -> Option<f64> {
        let plan = &self.common.plan;
        plan.is_usable()
            .then(|| plan.tracking + plan.soft_penalty + self.model_cost(&self.coordinates()))
    }

    fn recover(&self) -> Option<Recovered> {
        if !self.common.plan.is_usable() {
            return None;
        }
        let (known, x) = (&self.common.known, self.coordinates());
        let (g, slack, regularisation) = match &self.elimination {
            Elimination::Charged(charged) => {
                let factor = &charged.0;
                let (g, slack) = factor.recover(&factor.coordinates(known), &x);
                let regularisation = factor.lambda_g() * linalg::dot(&g, &g);
                (g, slack, regularisation)
            }
            Elimination::Free(free) => {
                let zeta = &x[..free.map.charged.ncols()];
                let slack = free.slack(known, zeta);
                let past = known.iter().zip(&slack).map(|(z, slack)| z + slack);
                let target: Vec<_> = past.chain(self.future.iter().copied()).collect();
                let (inputs, outputs) = self.common.slack_costs(&slack);
                let rest = (self.model_cost(&x) - inputs - outputs).max(0.0);
                (least_norm(free.predictor(), &target)?, slack, rest)
            }
            Elimination::Model(_) => (Vec::new(), vec![0.0; known.len()], 0.0),
        };
        let common = &self.common;
        Some(recovered(common, &self.future, g, &slack, regularisation))
    }
}
