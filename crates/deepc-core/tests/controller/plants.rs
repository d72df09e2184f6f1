//! The plant, the controller and the faulty solver the tests share.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use deepc_core::controller::{
    ControllerError, DeepcController, Plant, PlantError, RecedingHorizonSettings, Reference,
};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, OutputBounds, PredictiveProgram, ProgramOptions,
    Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, ClarabelSettings, ClarabelSolver, QpProblem, QpSolution,
    QpSolver, QpStatus, QpVectors, SolveBudget, SolverError,
};
use faer::{Col, Mat};

use crate::common::{self, Lti};

/// Two coupled, slightly oscillating modes; two inputs, two outputs.
fn system() -> Lti {
    Lti {
        a: faer::mat![[0.9, 0.2, 0.0], [-0.15, 0.85, 0.1], [0.0, 0.0, 0.7]],
        b: faer::mat![[0.1, 0.0], [0.0, 0.2], [0.3, 0.1]],
        c: faer::mat![[1.0, 0.0, 0.2], [0.0, 1.0, 0.0]],
        d: Mat::zeros(2, 2),
    }
}

/// How two disturbances enter the state.
fn entry() -> Mat<f64> {
    faer::mat![[0.05, 0.1], [0.1, -0.05], [0.1, 0.0]]
}

type Signal = Box<dyn Fn(usize) -> [f64; 2]>;

/// The system above, at rest at first, with `gain` on its inputs and perhaps two disturbances.
pub struct LtiPlant {
    system: Lti,
    x: Col<f64>,
    samples: usize,
    disturbance: Option<Signal>,
    /// Whether it says what disturbed it.
    measures: bool,
    measured: [f64; 2],
    pub gain: f64,
}

impl LtiPlant {
    pub fn at_rest() -> Self {
        let system = system();
        Self {
            x: Col::zeros(system.order()),
            system,
            samples: 0,
            disturbance: None,
            measures: false,
            measured: [0.0; 2],
            gain: 1.0,
        }
    }

    pub fn disturbed(measures: bool, signal: impl Fn(usize) -> [f64; 2] + 'static) -> Self {
        Self {
            disturbance: Some(Box::new(signal)),
            measures,
            ..Self::at_rest()
        }
    }
}

impl Plant for LtiPlant {
    fn inputs(&self) -> usize {
        2
    }

    fn outputs(&self) -> usize {
        2
    }

    fn disturbances(&self) -> usize {
        if self.measures { 2 } else { 0 }
    }

    fn sample_time_s(&self) -> f64 {
        0.1
    }

    fn measured_disturbances(&self) -> &[f64] {
        &self.measured[..self.disturbances()]
    }

    fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
        self.check_lengths(input, output)?;
        // y(k) is measured at the end of the interval of u(k) and d(k).
        let u = Col::from_fn(2, |i| self.gain * input[i]);
        self.x = &self.system.a * &self.x + &self.system.b * u;
        if let Some(signal) = &self.disturbance {
            self.measured = signal(self.samples);
            let d = Col::from_fn(2, |i| self.measured[i]);
            self.x += entry() * d;
        }
        self.samples += 1;
        let y = &self.system.c * &self.x;
        output.copy_from_slice(&[y[0], y[1]]);
        Ok(())
    }
}

/// What a recording of 200 (or, with disturbances, 300) samples of white noise teaches.
pub fn learn(mut plant: LtiPlant) -> Predictor {
    let q = plant.disturbances();
    let samples = 200 + 50 * q;
    let inputs = common::gaussian(samples, 2, &mut common::rng(1));
    let mut outputs = Mat::zeros(samples, 2);
    let mut disturbances = Mat::zeros(samples, q);
    for k in 0..samples {
        let mut y = [0.0; 2];
        plant
            .step(&[inputs[(k, 0)], inputs[(k, 1)]], &mut y)
            .unwrap();
        (outputs[(k, 0)], outputs[(k, 1)]) = (y[0], y[1]);
        for (channel, &d) in plant.measured_disturbances().iter().enumerate() {
            disturbances[(k, channel)] = d;
        }
    }
    let names = common::names;
    let mut data =
        Dataset::with_disturbances(0.1, names("u", 2), names("d", q), names("y", 2)).unwrap();
    data.push_record_with_disturbances(inputs, disturbances, outputs)
        .unwrap();
    let hankel = HankelMatrix::build(&data, Horizons::new(4, 12)).unwrap();
    Predictor::exact(&hankel.require_persistently_exciting(3).unwrap()).unwrap()
}

pub fn predictor() -> Predictor {
    learn(LtiPlant::at_rest())
}

/// A predictor that knows the disturbances.
pub fn disturbed_predictor() -> Predictor {
    let noise = common::gaussian(300, 2, &mut common::rng(7));
    learn(LtiPlant::disturbed(true, move |k| {
        [noise[(k, 0)], noise[(k, 1)]]
    }))
}

/// Condensed, from any predictor of this plant.
pub fn controller_from(predictor: &Predictor) -> DeepcController {
    let program = CondensedProgram::new(predictor, &settings()).unwrap();
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    DeepcController::new(Box::new(program), Box::new(solver), horizon(1)).unwrap()
}

pub fn settings() -> DeepcSettings {
    DeepcSettings {
        input_weights: vec![0.01, 0.01],
        output_weights: vec![1.0, 1.0],
        regularisation: Regularisation::per_column(1e-6),
        input_slack: Slack::Penalty(1e6),
        output_slack: Slack::Penalty(1e6),
        input_bounds: vec![Bounds::between(-0.4, 0.8), Bounds::between(-0.5, 0.5)],
        output_bounds: vec![
            OutputBounds::soft(-1.0, 1.05, 100.0, 10.0),
            OutputBounds::none(),
        ],
        options: ProgramOptions::default(),
    }
}

/// Moves per solve, anything else as in the simplest case.
pub fn horizon(moves_per_solve: usize) -> RecedingHorizonSettings {
    RecedingHorizonSettings {
        moves_per_solve,
        ..RecedingHorizonSettings::every_sample(SolveBudget::generous())
    }
}

/// Condensed, with the solver for few active bounds.
pub fn controller(moves_per_solve: usize) -> DeepcController {
    let program = CondensedProgram::new(&predictor(), &settings()).unwrap();
    let solver = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
    DeepcController::new(
        Box::new(program),
        Box::new(solver),
        horizon(moves_per_solve),
    )
    .unwrap()
}

/// Outputs to (1, 0.2), after 40 samples back to 0.
pub fn to_the_target(k: usize, reference: &mut Reference) -> Result<(), ControllerError> {
    reference.hold(&[0.0, 0.0], if k < 40 { &[1.0, 0.2] } else { &[0.0, 0.0] })
}

/// What a faulty solver does instead of solving.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mischief {
    /// Nothing: it solves.
    None,
    /// Ends with this status and no point.
    Ends(QpStatus),
    /// Calls NaN a solution.
    Nan,
    /// Solves, but late.
    Sleeps(Duration),
}

/// The switch of a [`FaultySolver`].
pub type Switch = Arc<Mutex<Mischief>>;

/// A solver that fails on demand.
pub struct FaultySolver {
    inner: ClarabelSolver,
    solution: QpSolution,
    switch: Switch,
}

impl FaultySolver {
    pub fn new(problem: &QpProblem) -> (Self, Switch) {
        let switch = Arc::new(Mutex::new(Mischief::None));
        let inner = ClarabelSolver::new(problem, ClarabelSettings::default()).unwrap();
        let faulty = Self {
            solution: inner.solution().clone(),
            inner,
            switch: Arc::clone(&switch),
        };
        (faulty, switch)
    }
}

impl QpSolver for FaultySolver {
    fn name(&self) -> &'static str {
        "faulty"
    }

    fn problem(&self) -> &QpProblem {
        self.inner.problem()
    }

    fn update(&mut self, vectors: QpVectors<'_>) -> Result<(), SolverError> {
        self.inner.update(vectors)
    }

    fn solve(&mut self, budget: &SolveBudget) -> &QpSolution {
        let mischief = *self.switch.lock().unwrap();
        self.solution.clone_from(self.inner.solve(budget));
        match mischief {
            Mischief::None => {}
            Mischief::Sleeps(time) => std::thread::sleep(time),
            Mischief::Nan => self.solution.primal.fill(f64::NAN),
            Mischief::Ends(status) => {
                self.solution.status = status;
                self.solution.primal.fill(f64::NAN);
            }
        }
        &self.solution
    }

    fn solution(&self) -> &QpSolution {
        &self.solution
    }

    fn forget(&mut self) {
        self.inner.forget();
    }
}

/// In the sparse form, which asks its solver in every step.
pub fn faulty_controller(settings_of: RecedingHorizonSettings) -> (DeepcController, Switch) {
    let program = SparseProgram::new(&predictor(), &settings()).unwrap();
    let (solver, switch) = FaultySolver::new(program.qp());
    let controller = DeepcController::new(Box::new(program), Box::new(solver), settings_of);
    (controller.unwrap(), switch)
}

/// Whether an input is within the hard bounds.
pub fn is_allowed(input: &[f64]) -> bool {
    let settings = settings();
    let mut pairs = input.iter().zip(&settings.input_bounds);
    pairs.all(|(u, bounds)| u.is_finite() && bounds.violation(*u) == 0.0)
}
