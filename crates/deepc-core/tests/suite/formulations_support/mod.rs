//! Plants, moments, solvers and independent solutions that the tests of formulations share.
#![allow(dead_code)]

mod polished;

use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, MeasuredDisturbances, Moment, OutputBounds,
    PredictiveProgram, ProgramOptions, Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, QpMatrix, QpProblem, QpSolver, QpVectors, SolveBudget,
};
use faer::{Col, Mat, MatRef};
use polished::Polished;

use crate::common::{self, Lti, Solved};

/// Smallest distance that counts as another plan.
pub const ANOTHER_PLAN: f64 = 1e-4;

/// A slow solver that is right to the last digits.
pub fn accurate(problem: &QpProblem) -> Box<dyn QpSolver> {
    Box::new(Polished::new(problem))
}

/// The solver of the control loop.
pub fn fast(problem: &QpProblem) -> Box<dyn QpSolver> {
    Box::new(ActiveSet::new(problem, ActiveSetSettings { tolerance: 1e-10 }).unwrap())
}

#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub order: usize,
    pub inputs: usize,
    pub disturbances: usize,
    pub outputs: usize,
    pub past: usize,
    pub future: usize,
}

impl Sizes {
    pub const SMALL: Self = Self {
        order: 3,
        inputs: 2,
        disturbances: 0,
        outputs: 2,
        past: 3,
        future: 5,
    };

    pub fn with_disturbances(self, disturbances: usize) -> Self {
        Self {
            disturbances,
            ..self
        }
    }

    pub fn known(&self) -> usize {
        let channels = self.inputs + self.disturbances + self.outputs;
        channels * self.past + self.disturbances * self.future
    }

    pub fn future_rows(&self) -> usize {
        (self.inputs + self.outputs) * self.future
    }

    /// Channel of an entry of f = col(u, y): an input or else an output.
    fn channel(&self, i: usize) -> Result<usize, usize> {
        match i.checked_sub(self.inputs * self.future) {
            None => Ok(i % self.inputs),
            Some(i) => Err(i % self.outputs),
        }
    }
}

/// A plant and data from it. The last inputs of the plant are disturbances.
pub struct Study {
    pub sizes: Sizes,
    pub system: Lti,
    pub predictor: Predictor,
    /// Of every output.
    pub noise: Vec<f64>,
}

impl Study {
    pub fn new(sizes: Sizes, noise: f64, records: &[usize], seed: u64) -> Self {
        Self::scaled(sizes, noise, records, seed, &[])
    }

    /// With every channel multiplied by its scale (inputs, disturbances, outputs; empty: all 1).
    pub fn scaled(sizes: Sizes, noise: f64, records: &[usize], seed: u64, scales: &[f64]) -> Self {
        Self::build(sizes, &vec![noise; sizes.outputs], records, seed, scales)
    }

    /// With noise of its own on every output.
    pub fn build(
        sizes: Sizes,
        noise: &[f64],
        records: &[usize],
        seed: u64,
        scales: &[f64],
    ) -> Self {
        let Sizes {
            inputs: m,
            disturbances: q,
            outputs: p,
            ..
        } = sizes;
        let system = Lti::random(sizes.order, m + q, p, 0.8, seed);
        let names = common::names;
        let mut data =
            Dataset::with_disturbances(0.1, names("u", m), names("d", q), names("y", p)).unwrap();
        for (i, &samples) in records.iter().enumerate() {
            let seed = 10 * seed + i as u64;
            let (mut signals, clean) = common::record(&system, samples, 0.0, seed);
            let (_, noisy) = common::record(&system, samples, 1.0, seed);
            let mut outputs = Mat::from_fn(samples, p, |k, i| {
                clean[(k, i)] + noise[i] * (noisy[(k, i)] - clean[(k, i)])
            });
            scale_columns(&mut signals, scales);
            scale_columns(&mut outputs, scales.get(m + q..).unwrap_or(&[]));
            data.push_record_with_disturbances(
                signals.subcols(0, m).to_owned(),
                signals.subcols(m, q).to_owned(),
                outputs,
            )
            .unwrap();
        }
        let hankel = HankelMatrix::build(&data, Horizons::new(sizes.past, sizes.future)).unwrap();
        Self {
            sizes,
            system,
            predictor: Predictor::full(&hankel.assume_persistently_exciting()),
            noise: noise.to_vec(),
        }
    }

    pub fn columns(&self) -> usize {
        self.predictor.stacked().ncols()
    }

    /// Known rows Z, then `U_f`, then `Y_f`.
    pub fn blocks(&self) -> [MatRef<'_, f64>; 3] {
        let (h, known) = (self.predictor.stacked(), self.sizes.known());
        let inputs = self.sizes.inputs * self.sizes.future;
        let outputs = self.sizes.outputs * self.sizes.future;
        [
            h.subrows(0, known),
            h.subrows(known, inputs),
            h.subrows(known + inputs, outputs),
        ]
    }

    pub fn situation(&self, seed: u64) -> Situation {
        let Sizes {
            inputs: m,
            disturbances: q,
            outputs: p,
            past,
            future,
            order,
        } = self.sizes;
        let mut rng = common::rng(seed ^ 0xfeed);
        let small = |rows, rng: &mut _| {
            let wild = common::gaussian(rows, m, rng);
            Mat::from_fn(rows, m, |k, i| (0.3 * wild[(k, i)]).clamp(-0.25, 0.25))
        };
        let past_inputs = small(past, &mut rng);
        let disturbances = common::gaussian(past + future, q, &mut rng);
        let mut state = Col::from_fn(order, |i| 0.4 * (1.3 * seed as f64 + i as f64).sin());
        let signals = Mat::from_fn(past, m + q, |k, i| match i.checked_sub(m) {
            None => past_inputs[(k, i)],
            Some(i) => disturbances[(k, i)],
        });
        let mut past_outputs = self.system.simulate(&mut state, &signals);
        let mut noise = common::gaussian(past, p, &mut rng);
        scale_columns(&mut noise, &self.noise);
        past_outputs += noise;
        Situation {
            past_inputs,
            past_disturbances: disturbances.subrows(0, past).to_owned(),
            past_outputs,
            preview: disturbances.subrows(past, future).to_owned(),
            input_reference: small(future, &mut rng),
            output_reference: common::gaussian(future, p, &mut rng),
            state,
        }
    }

    pub fn condensed(
        &self,
        settings: &DeepcSettings,
        situation: &Situation,
        solver: fn(&QpProblem) -> Box<dyn QpSolver>,
    ) -> Solved {
        let mut program = CondensedProgram::new(&self.predictor, settings).unwrap();
        solve(&mut program, situation, solver)
    }

    pub fn sparse(&self, settings: &DeepcSettings, situation: &Situation) -> Solved {
        let mut program = SparseProgram::new(&self.predictor, settings).unwrap();
        solve(&mut program, situation, accurate)
    }
}

fn scale_columns(series: &mut Mat<f64>, scales: &[f64]) {
    for (i, scale) in scales.iter().enumerate().take(series.ncols()) {
        series.col_mut(i).iter_mut().for_each(|v| *v *= scale);
    }
}

pub fn solve(
    program: &mut dyn PredictiveProgram,
    situation: &Situation,
    solver: fn(&QpProblem) -> Box<dyn QpSolver>,
) -> Solved {
    let mut solver = solver(program.qp());
    let budget = SolveBudget::generous();
    program
        .solve(&situation.moment(), solver.as_mut(), &budget)
        .unwrap();
    Solved::of(program)
}

/// What is known and wanted at one instant.
pub struct Situation {
    pub past_inputs: Mat<f64>,
    pub past_disturbances: Mat<f64>,
    pub past_outputs: Mat<f64>,
    pub preview: Mat<f64>,
    pub input_reference: Mat<f64>,
    pub output_reference: Mat<f64>,
    /// State of the plant when the horizon begins.
    pub state: Col<f64>,
}

impl Situation {
    pub fn moment(&self) -> Moment<'_> {
        Moment {
            past_inputs: self.past_inputs.as_ref(),
            past_outputs: self.past_outputs.as_ref(),
            input_reference: self.input_reference.as_ref(),
            output_reference: self.output_reference.as_ref(),
            disturbances: Some(MeasuredDisturbances {
                past: self.past_disturbances.as_ref(),
                preview: self.preview.as_ref(),
            }),
        }
    }

    /// Multiplies every channel by its scale: inputs, disturbances, outputs.
    pub fn scale(&mut self, scales: &[f64]) {
        let (m, q) = (self.past_inputs.ncols(), self.preview.ncols());
        scale_columns(&mut self.past_inputs, scales);
        scale_columns(&mut self.input_reference, scales);
        scale_columns(&mut self.past_disturbances, &scales[m..]);
        scale_columns(&mut self.preview, &scales[m..]);
        scale_columns(&mut self.past_outputs, &scales[m + q..]);
        scale_columns(&mut self.output_reference, &scales[m + q..]);
    }

    /// z = `col(u_ini, d_ini, y_ini, d)`.
    pub fn known(&self) -> Vec<f64> {
        let series = [
            &self.past_inputs,
            &self.past_disturbances,
            &self.past_outputs,
            &self.preview,
        ];
        series.into_iter().flat_map(time_major).collect()
    }

    /// r = `col(u_r, y_r)`.
    pub fn reference(&self) -> Vec<f64> {
        let series = [&self.input_reference, &self.output_reference];
        series.into_iter().flat_map(time_major).collect()
    }
}

pub fn time_major(series: &Mat<f64>) -> Vec<f64> {
    let (rows, columns) = series.shape();
    let pairs = (0..rows).flat_map(|k| (0..columns).map(move |i| (k, i)));
    pairs.map(|(k, i)| series[(k, i)]).collect()
}

/// f = col(u, y) of a plan.
pub fn future(plan: &Solved) -> Vec<f64> {
    [time_major(&plan.inputs), time_major(&plan.outputs)].concat()
}

/// Bounds that are active in most situations, prices of every kind.
pub fn settings(sizes: Sizes) -> DeepcSettings {
    let inputs = [
        Bounds::between(-0.3, 0.4),
        Bounds {
            lower: Some(-0.35),
            upper: None,
        },
    ];
    let outputs = [
        OutputBounds::soft(-0.8, 0.7, 3.0, 2.0),
        OutputBounds::soft(-1.0, 0.5, 0.0, 5.0),
        OutputBounds::none(),
    ];
    DeepcSettings {
        input_weights: [0.1, 0.3].into_iter().cycle().take(sizes.inputs).collect(),
        output_weights: [2.0, 0.5, 1.0][..sizes.outputs].to_vec(),
        regularisation: Regularisation::raw(0.5),
        input_slack: Slack::Penalty(1e3),
        output_slack: Slack::Penalty(1e4),
        input_bounds: inputs[..sizes.inputs].to_vec(),
        output_bounds: outputs[..sizes.outputs].to_vec(),
        options: ProgramOptions::default(),
    }
}

/// No bounds at all.
pub fn unbounded(mut settings: DeepcSettings) -> DeepcSettings {
    settings.input_bounds.fill(Bounds::none());
    settings.output_bounds.fill(OutputBounds::none());
    settings
}

pub const SLACKS: [(Slack, Slack); 4] = [
    (Slack::Penalty(1e3), Slack::Penalty(1e4)),
    (Slack::Hard, Slack::Penalty(1e4)),
    (Slack::Penalty(1e2), Slack::Hard),
    (Slack::Hard, Slack::Hard),
];

/// The optimum of a problem written by hand.
pub struct Independent {
    /// f = col(u, y).
    pub future: Vec<f64>,
    pub objective: f64,
}

/// min (f − r)ᵀW(f − r) + (prices of soft output bounds) + xᵀ diag(`charge`) x over x, with
/// f = `start` + `directions`·x within the bounds: the paper's settings without options.
pub fn independent(
    sizes: Sizes,
    settings: &DeepcSettings,
    reference: &[f64],
    start: &[f64],
    directions: &Mat<f64>,
    charge: &[f64],
) -> Independent {
    assert_eq!(settings.options, ProgramOptions::default());
    let (n, k) = directions.shape();
    let weight = |i: usize| match sizes.channel(i) {
        Ok(input) => settings.input_weights[input],
        Err(output) => settings.output_weights[output],
    };
    let half = Mat::from_fn(k, k, |a, b| {
        let cost: f64 = (0..n)
            .map(|i| weight(i) * (directions[(i, a)] * directions[(i, b)]))
            .sum();
        cost + if a == b { charge[a] } else { 0.0 }
    });
    let linear: Vec<f64> = (0..k)
        .map(|a| {
            let pull = |i: usize| 2.0 * weight(i) * directions[(i, a)] * (start[i] - reference[i]);
            (0..n).map(pull).sum()
        })
        .collect();
    let (mut lower, mut upper, mut soft) = (vec![], vec![], vec![]);
    for (i, start) in start.iter().enumerate() {
        let (bounds, penalty) = match sizes.channel(i) {
            Ok(input) => (settings.input_bounds[input], None),
            Err(output) => {
                let output = settings.output_bounds[output];
                (output.bounds, output.softness.penalty())
            }
        };
        lower.push(bounds.lower_value() - start);
        upper.push(bounds.upper_value() - start);
        soft.push(penalty);
    }
    let problem = QpProblem::new(
        QpMatrix::Dense(faer::Scale(2.0) * half),
        QpMatrix::Dense(directions.clone()),
        soft.clone(),
    )
    .unwrap();
    let mut solver = accurate(&problem);
    let vectors = QpVectors {
        linear: &linear,
        lower: &lower,
        upper: &upper,
    };
    solver.update(vectors).unwrap();
    let solution = solver.solve(&SolveBudget::generous());
    assert!(solution.status.is_usable(), "{:?}", solution.status);
    let x = &solution.primal;
    let step: Vec<f64> = (0..n)
        .map(|i| (0..k).map(|a| directions[(i, a)] * x[a]).sum())
        .collect();
    let mut objective: f64 = x.iter().zip(charge).map(|(x, c)| c * x * x).sum();
    for i in 0..n {
        objective += weight(i) * (start[i] + step[i] - reference[i]).powi(2);
        let violation = (lower[i] - step[i]).max(step[i] - upper[i]).max(0.0);
        objective += soft[i].map_or(0.0, |penalty| penalty.cost(violation));
    }
    Independent {
        future: start.iter().zip(step).map(|(s, d)| s + d).collect(),
        objective,
    }
}

/// a·x.
pub fn product(a: MatRef<'_, f64>, x: &[f64]) -> Vec<f64> {
    (a * Col::from_fn(x.len(), |i| x[i]))
        .iter()
        .copied()
        .collect()
}

/// `top` over `bottom`.
pub fn above(top: MatRef<'_, f64>, bottom: MatRef<'_, f64>) -> Mat<f64> {
    let first = top.nrows();
    Mat::from_fn(first + bottom.nrows(), top.ncols(), |i, j| {
        match i.checked_sub(first) {
            None => top[(i, j)],
            Some(i) => bottom[(i, j)],
        }
    })
}

/// `left` beside `right`.
pub fn beside(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Mat<f64> {
    above(left.transpose(), right.transpose())
        .transpose()
        .to_owned()
}

pub fn largest_gap(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let gaps = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    // A NaN is a gap.
    gaps.fold(0.0, |max, gap| if gap <= max { max } else { gap })
}

/// Objectives within `objective` relative, signals within `signals`.
pub fn check_same(what: &str, a: &Solved, b: &Solved, objective: f64, signals: f64) {
    assert!(
        a.is_usable() && b.is_usable(),
        "{what}: {:?} {:.1e}, {:?} {:.1e}",
        a.status,
        a.residual,
        b.status,
        b.residual
    );
    let other = Independent {
        future: future(b),
        objective: b.objective,
    };
    check_optimum(what, a, &other, objective, signals);
}

pub fn check_optimum(what: &str, plan: &Solved, other: &Independent, objective: f64, signals: f64) {
    assert!(plan.is_usable(), "{what}: {:?}", plan.status);
    // An optimum may be 0.
    let gap = (plan.objective - other.objective).abs() / other.objective.abs().max(1e-6);
    assert!(
        gap <= objective,
        "{what}: objectives {:.12e} and {:.12e}, {gap:.1e} apart",
        plan.objective,
        other.objective
    );
    let distance = largest_gap(&future(plan), &other.future);
    assert!(distance <= signals, "{what}: signals {distance:.1e} apart");
}
