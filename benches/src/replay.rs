//! Consecutive moments of a closed loop, recorded once and replayed to every back end.

use deepc_core::program::{Moment, PlanOrigin, PredictiveProgram};
use deepc_core::solver::{QpSolver, SolveBudget};
use faer::Mat;

use crate::case::Case;
use crate::plant::Plant;

/// The moments of a closed loop, so that every back end is asked the same questions, and a warm
/// start is worth what it is in control.
#[derive(Debug, Clone)]
pub struct Replay {
    past: usize,
    future: usize,
    /// (`T_ini` + steps)×m.
    inputs: Mat<f64>,
    /// (`T_ini` + steps)×p.
    outputs: Mat<f64>,
    /// (steps + N)×m.
    input_reference: Mat<f64>,
    /// (steps + N)×p.
    output_reference: Mat<f64>,
    /// Bounds active at every moment.
    active: Vec<usize>,
}

impl Replay {
    /// Lets the condensed `program` and `solver` control the plant for `steps` samples.
    ///
    /// # Panics
    /// If a step cannot be solved: the problems are made to have solutions.
    pub fn record(
        case: &Case,
        program: &mut dyn PredictiveProgram,
        solver: &mut dyn QpSolver,
        steps: usize,
    ) -> Self {
        let (past, future) = (case.horizons.past, case.horizons.future);
        let (m, p) = (case.inputs, case.outputs);
        let mut replay = Self {
            past,
            future,
            inputs: Mat::zeros(past + steps, m),
            outputs: Mat::zeros(past + steps, p),
            input_reference: Mat::from_fn(steps + future, m, |k, j| {
                case.input_reference(k.cast_signed(), j)
            }),
            output_reference: Mat::from_fn(steps + future, p, |k, i| {
                case.output_reference(k.cast_signed(), i)
            }),
            active: Vec::with_capacity(steps),
        };
        let bounds = case.settings().input_bounds;
        let mut plant = Plant::new(m, p, 2);
        let (mut input, mut output) = (vec![0.0; m], vec![0.0; p]);
        let budget = SolveBudget::generous();
        for k in 0..past + steps {
            if let Some(now) = k.checked_sub(past) {
                let plan = program
                    .solve(&replay.moment(now), solver, &budget)
                    .expect("the shapes fit");
                assert!(
                    plan.is_usable(),
                    "{}, step {now}: {:?}",
                    case.name,
                    plan.status
                );
                for (j, value) in input.iter_mut().enumerate() {
                    *value = plan.inputs[(0, j)];
                }
                let solved = plan.origin == PlanOrigin::Solver;
                let active = if solved { active_bounds(solver, 0) } else { 0 };
                replay.active.push(active);
            } else {
                let before = k.cast_signed() - past.cast_signed();
                for (j, value) in input.iter_mut().enumerate() {
                    *value = bounds[j].clip(case.input_reference(before, j));
                }
            }
            plant.step(&input, &mut output);
            program.observe(&input, &[], &output);
            for (j, value) in input.iter().enumerate() {
                replay.inputs[(k, j)] = *value;
            }
            for (i, value) in output.iter().enumerate() {
                replay.outputs[(k, i)] = *value;
            }
        }
        replay
    }

    /// Number of moments.
    #[must_use]
    pub fn len(&self) -> usize {
        self.inputs.nrows() - self.past
    }

    /// Whether there is no moment.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of bounds active at every moment.
    #[must_use]
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// Moment `k`.
    ///
    /// # Panics
    /// If there is no such moment.
    #[must_use]
    pub fn moment(&self, k: usize) -> Moment<'_> {
        Moment {
            past_inputs: self.inputs.subrows(k, self.past),
            past_outputs: self.outputs.subrows(k, self.past),
            input_reference: self.input_reference.subrows(k, self.future),
            output_reference: self.output_reference.subrows(k, self.future),
            disturbances: None,
        }
    }
}

impl Replay {
    /// Tells a program the newest sample of moment `k`, as a controller does before it decides.
    ///
    /// # Panics
    /// If there is no such moment.
    pub fn tell(&self, k: usize, program: &mut dyn PredictiveProgram, sample: &mut Sample) {
        let row = k + self.past - 1;
        for (entry, value) in sample.input.iter_mut().zip(self.inputs.row(row).iter()) {
            *entry = *value;
        }
        for (entry, value) in sample.output.iter_mut().zip(self.outputs.row(row).iter()) {
            *entry = *value;
        }
        program.observe(&sample.input, &[], &sample.output);
    }

    /// Room for a sample.
    #[must_use]
    pub fn room(&self) -> Sample {
        Sample {
            input: vec![0.0; self.inputs.ncols()],
            output: vec![0.0; self.outputs.ncols()],
        }
    }
}

/// Room for one sample, so that telling it allocates nothing.
#[derive(Debug, Clone)]
pub struct Sample {
    input: Vec<f64>,
    output: Vec<f64>,
}

/// Bounds that push in the last solution; `equalities` rows come before those of the bounds.
#[must_use]
pub fn active_bounds(solver: &dyn QpSolver, equalities: usize) -> usize {
    let dual = solver.solution().dual.get(equalities..).unwrap_or_default();
    let largest = dual.iter().fold(0.0_f64, |max, mu| max.max(mu.abs()));
    dual.iter().filter(|mu| mu.abs() > 1e-6 * largest).count()
}
