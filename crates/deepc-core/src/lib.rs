//! Data-EnablEd Predictive Control (`DeePC`): recorded data in, decisions out.
//!
//! There is no model to identify. A recording of the plant's inputs and outputs is arranged in a
//! Hankel matrix, whose columns are pieces of trajectory; by Willems' fundamental lemma their
//! combinations are all trajectories of a linear plant. Every sample, the controller looks for
//! the combination that continues the recent past best.
//!
//! # The problem
//! m inputs, p outputs, sample time Ts. A window has L = `T_ini` + N samples: `T_ini` of the past
//! (so many that they fix the plant's state) and N of the future. T recorded samples give
//! J = T − L + 1 columns. Series are T×channels matrices (rows are time); inside, they are
//! stacked time-major, w = col(w(0), w(1), …), by one function
//! ([`hankel::stacked_position`]).
//!
//! **One sample is the pair (u(k), y(k)): u(k) is held over `[t_k, t_k + Ts)` and y(k) is measured
//! at the end of that interval.** Most logs write u and y of the same instant in one row; read
//! them with [`data::OutputTiming::StartOfInterval`].
//!
//! ```text
//!     min   ‖u − u_r‖²_R + ‖y − y_r‖²_Q + λ_g‖g‖² + λ_u‖σ_u‖² + λ_y‖σ_y‖² + Σ (ρs + ½ws²)
//!   g,u,y,σ
//!     s.t.  ⎡U_p⎤     ⎡u_ini + σ_u⎤     U_p  m·T_ini×J     u_ini, σ_u   m·T_ini
//!           ⎢Y_p⎥ g = ⎢y_ini + σ_y⎥     Y_p  p·T_ini×J     y_ini, σ_y   p·T_ini
//!           ⎢U_f⎥     ⎢u          ⎥     U_f  m·N×J         u, u_r       m·N      R  diagonal
//!           ⎣Y_f⎦     ⎣y          ⎦     Y_f  p·N×J         y, y_r       p·N      Q  diagonal
//!           u within hard bounds, y within hard or soft bounds (exceeded by s ≥ 0)
//! ```
//!
//! That is the paper's problem. Beside it: other regularisers ([`program::Regularisation`]: projection,
//! γ-DDPC, SPC, 1-norm), weights per step, costs and bounds of input changes, affine and terminal
//! constraints ([`program::ProgramOptions`]), and q measured disturbances d with preview
//! ([`data::Dataset::with_disturbances`]).
//!
//! # The flow
//! One module per stage, one type per stage; the next stage takes only it.
//!
//! | stage | takes | gives |
//! |---|---|---|
//! | [`data`] | recordings in memory or CSV | [`data::Dataset`]: finite, one clock |
//! | [`hankel`] | a data set, horizons | [`hankel::HankelMatrix`], [`hankel::ExcitationReport`], [`hankel::PersistentlyExciting`] |
//! | [`predictor`] | exciting data | [`predictor::Predictor`]: whole, reduced, from a long recording, kept up to date |
//! | [`program`] | a predictor, weights and bounds | [`program::CondensedProgram`], [`program::SparseProgram`] |
//! | [`solver`] | the program's quadratic program | a [`solver::QpSolver`] |
//! | [`assessment`] | a data set, before control | [`assessment::DataReport`], [`assessment::TuningCurve`] |
//! | [`controller`] | program and solver | [`controller::DeepcController`] |
//!
//! Everything up to the solver's set-up happens once, may fail and says why. A control step
//! ([`controller::Controller::decide`]) cannot fail: it says where its input came from instead.
//!
//! # Quick start
//! A plant with two inputs and two outputs, known only by a recording:
//!
//! ```
//! use deepc_core::controller::{
//!     DeepcController, Plant, PlantError, RecedingHorizonSettings, run_closed_loop,
//! };
//! use deepc_core::data::Dataset;
//! use deepc_core::hankel::{HankelMatrix, Horizons};
//! use deepc_core::predictor::Predictor;
//! use deepc_core::program::{Bounds, DeepcSettings, OutputBounds, Regularisation, Slack};
//! use deepc_core::solver::SolveBudget;
//!
//! struct Tanks([f64; 2]);
//!
//! impl Plant for Tanks {
//!     fn inputs(&self) -> usize { 2 }
//!     fn outputs(&self) -> usize { 2 }
//!     fn sample_time_s(&self) -> f64 { 1.0 }
//!     fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
//!         self.check_lengths(input, output)?;
//!         let [a, b] = self.0;
//!         self.0 = [0.9 * a + 0.08 * b + 0.1 * input[0], 0.05 * a + 0.85 * b + 0.2 * input[1]];
//!         output.copy_from_slice(&self.0);
//!         Ok(())
//!     }
//! }
//!
//! // Record: shake both inputs, independently of each other.
//! let (mut plant, mut inputs, mut outputs) = (Tanks([0.0; 2]), Vec::new(), Vec::new());
//! for k in 0..200_u32 {
//!     let shake = |prime: u32| f64::from(k * k * prime % 101) / 50.0 - 1.0;
//!     let (input, mut output) = ([shake(7), shake(13)], [0.0; 2]);
//!     plant.step(&input, &mut output)?;
//!     inputs.extend(input);
//!     outputs.extend(output);
//! }
//! let mut data = Dataset::new(1.0, ["pump_1", "pump_2"], ["level_1", "level_2"])?;
//! data.push_rows(&inputs, &outputs)?;
//!
//! // Set up.
//! let hankel = HankelMatrix::build(&data, Horizons::new(4, 20))?;
//! let exciting = hankel.require_persistently_exciting(4)?; // the plant's order is at most 4
//! let predictor = Predictor::exact(&exciting)?;
//! let (regularisation, slack) = (Regularisation::per_column(1e-6), Slack::Penalty(1e6));
//! let settings = DeepcSettings {
//!     input_bounds: vec![Bounds::between(-0.5, 0.5); 2],
//!     output_bounds: vec![OutputBounds::soft(-0.1, 1.0, 100.0, 10.0); 2],
//!     ..DeepcSettings::new(&[0.01; 2], &[1.0; 2], regularisation, slack)
//! };
//! let budget = SolveBudget { max_iterations: 500, max_time_s: 0.1 };
//! let horizon = RecedingHorizonSettings::every_sample(budget);
//! let mut controller = DeepcController::condensed(&predictor, &settings, horizon)?;
//!
//! // Control: raise the levels to 0.9 and 0.6.
//! let run = run_closed_loop(&mut Tanks([0.0; 2]), &mut controller, 60, |_, reference| {
//!     reference.hold(&[0.4, 0.2], &[0.9, 0.6])
//! })?;
//! assert!((run.outputs[(59, 0)] - 0.9).abs() < 0.01);
//! assert!((run.outputs[(59, 1)] - 0.6).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Real time
//! At the paper's size (600×3001) a step takes tens of microseconds. It allocates nothing, its
//! budget bounds iterations and time, every answer carries a certificate, and what happens without
//! one is a policy ([`controller::FallbackPolicy`]) that the step reports. `docs/performance.md` in the
//! repository has the measurements.
//!
//! # Features
//! - `osqp` (off by default): the back end `solver::OsqpSolver`. Needs cmake and a C compiler to
//!   build; with cmake 4, also `CMAKE_POLICY_VERSION_MINIMUM=3.5` in the environment.
//!
//! # When not to use it
//! Data that never visit the operating point, or inputs that were not shaken: measure with
//! [`hankel::HankelMatrix::excitation`] first. A plant whose gain changes sign or strongly with
//! its state: one linear predictor cannot hold both. A good model at hand: predictive control
//! with that model is cheaper to set up and easier to reason about.

/// The linear algebra crate whose matrices this one takes and gives.
pub use faer;

pub mod assessment;
mod columns;
pub mod controller;
pub mod data;
pub mod hankel;
mod linalg;
pub mod predictor;
pub mod program;
pub mod solver;

/// The code of the guide to a new plant, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/adding-a-plant.md")]
struct AddingAPlant;
