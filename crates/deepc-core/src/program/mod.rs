//! Stage 4: the `DeePC` problem, with its constant matrices built once.
//!
//! With the data matrix H̄ (c columns) and the stacked `w = col(u_ini, d_ini, y_ini, d, u, y)`, every
//! step solves (Coulson, Lygeros, Dörfler 2019; the regularised form of Elokda et al. 2021)
//!
//! ```text
//! min  ‖u − u_r‖²_R + ‖y − y_r‖²_Q + λ_g‖g‖² + λ_u‖σ_u‖² + λ_y‖σ_y‖² + Σ (ρs + ½ws²)
//! s.t. U_p g = u_ini + σ_u      Y_p g = y_ini + σ_y      U_f g = u      Y_f g = y
//!      D_p g = d_ini             D_f g = d               (measured disturbances, if there are any)
//!      u within its bounds,  y within its bounds (hard, or exceeded by s ≥ 0 at the price above)
//! ```
//!
//! and what [`ProgramOptions`] adds, with another charge on g if [`Regularisation`] says so, in one of
//! two forms with the same optimum:
//!
//! | | variables | rows | cost of a step depends on |
//! |---|---|---|---|
//! | [`SparseProgram`] | g, u, y, σ: c + (m+p)N + (m+q+p)`T_ini` + qN | (m+q+p)L + constraints | the data length |
//! | [`CondensedProgram`] | at most (m+p)N | constraints | the horizons only |
//!
//! Both are [`PredictiveProgram`]s, so a controller does not know which one it has. A third one has no
//! data: [`CondensedProgram::from_model`] takes the future from a linear model and a
//! [`StateEstimator`] instead, with the same costs, constraints, solvers and code.

mod common;
mod condensed;
mod damping;
mod error;
mod free_past;
mod future_map;
mod gain;
mod model;
mod options;
mod output_predictor;
mod past_factor;
mod plan;
mod recover;
mod regularisation;
mod rows;
mod settings;
mod sparse;
mod stage_cost;
mod stage_settings;

pub use condensed::CondensedProgram;
pub use error::{ProgramError, SettingsError};
pub use model::{PredictionModel, StateEstimator};
pub use options::{AffineConstraint, DisturbanceSlack, ProgramOptions, Steps, Terminal};
pub use output_predictor::OutputPredictor;
pub use plan::{MeasuredDisturbances, Moment, ObjectiveParts, Plan, PlanOrigin, Recovered};
pub use regularisation::{Normalisation, Regularisation, RegularisedPart};
pub use settings::{Bounds, DeepcSettings, OutputBounds, Slack, Softness};
pub use sparse::SparseProgram;
pub use stage_settings::StageSettings;

use crate::hankel::Shape;
use crate::solver::{QpProblem, QpSolution, QpSolver, QpVectors, SolveBudget};

/// A past that hard slack cannot explain is called inconsistent above this relative residual.
pub const CONSISTENCY_TOLERANCE: f64 = 1e-6;

/// A predictive control problem, `DeePC` or on a model, whose matrices are fixed and whose vectors are rewritten every step.
///
/// # Contract
/// 1. [`qp`](Self::qp) never changes; a solver is set up with it once.
/// 2. [`set_moment`](Self::set_moment) rewrites the vectors; it fails, and leaves them as they
///    were, only if a shape does not fit.
/// 3. [`plan_unconstrained`](Self::plan_unconstrained) writes the optimum without bounds to the
///    plan if that optimum is known and meets every bound, and says so.
/// 4. [`accept`](Self::accept) writes a solver's answer to the plan; only a usable status makes
///    a usable plan.
/// 5. All forms of one problem have the same optimum, for a past that is consistent with hard
///    slack: the condensed form projects one that is off by up to [`CONSISTENCY_TOLERANCE`] and
///    refuses others, the sparse form leaves the contradiction to the solver.
/// 6. A program that was never told a sample with [`observe`](Self::observe) plans from the moment
///    alone. One that is told must be told every sample between two moments, or to
///    [`forget`](Self::forget).
pub trait PredictiveProgram: Send {
    /// Sizes m, p, `T_ini`, N.
    fn shape(&self) -> Shape;

    /// Its weights, bounds and options.
    fn stage(&self) -> &StageSettings;

    /// Sample time of the data, in seconds.
    fn sample_time_s(&self) -> f64;

    /// The constant part of the quadratic program.
    fn qp(&self) -> &QpProblem;

    /// Takes a sample (u(k), d(k), y(k)) of the running loop, m, q and p finite values (repaired
    /// where the measurement was missing). Only for a program that remembers more than the past
    /// window of the next moment; the others ignore it. Allocates nothing.
    fn observe(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        let _ = (input, disturbance, output);
    }

    /// Forgets what was observed: the next moment's past window is all that is known.
    fn forget(&mut self) {}

    /// Rewrites the vectors for one moment.
    ///
    /// # Errors
    /// A shape does not fit.
    fn set_moment(&mut self, moment: &Moment<'_>) -> Result<(), ProgramError>;

    /// The moving part of the quadratic program.
    fn vectors(&self) -> QpVectors<'_>;

    /// Takes the unconstrained optimum as the plan if it is known and meets every bound.
    fn plan_unconstrained(&mut self) -> bool;

    /// Ends the step if it is known, before any solver is asked, that there is no plan: hard slack
    /// cannot explain the past (`Infeasible`), or the moment holds NaN (`InvalidData`); whether it
    /// did.
    fn refuse_past(&mut self) -> bool {
        false
    }

    /// Takes a solver's answer as the plan.
    fn accept(&mut self, solution: &QpSolution);

    /// The present plan.
    fn plan(&self) -> &Plan;

    /// The objective of the present plan: tracking, what g and the slacks cost, and the price of
    /// soft constraints; `None` if the plan is not usable. Takes several products: for study, not
    /// for the control loop.
    fn objective(&self) -> Option<f64>;

    /// g, the slacks and the parts of the objective of the present plan; `None` if the plan is
    /// not usable. Allocates and takes a product with the data matrix: for study, not for the
    /// control loop.
    fn recover(&self) -> Option<Recovered>;

    /// One step: the unconstrained optimum if it will do, else the solver's.
    ///
    /// # Errors
    /// A shape does not fit the program, or the solver was set up for another one.
    fn solve(
        &mut self,
        moment: &Moment<'_>,
        solver: &mut dyn QpSolver,
        budget: &SolveBudget,
    ) -> Result<&Plan, ProgramError> {
        self.set_moment(moment)?;
        if !self.refuse_past() && !self.plan_unconstrained() {
            solver.update(self.vectors())?;
            self.accept(solver.solve(budget));
        }
        Ok(self.plan())
    }
}
