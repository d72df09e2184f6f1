//! The problems: sizes, weights, bounds and references.

use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelFactor, HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, DeepcSettings, OutputBounds, ProgramOptions, Regularisation, Slack,
};

use faer::Mat;
use sysid::lmpc::LmpcSettings;
use sysid::{Channel, StateSpace, SystemMatrices};

use crate::plant::Plant;

/// Sample time of every recording here, in seconds.
const SAMPLE_TIME_S: f64 = 0.01;

/// The limit of every output, soft.
const OUTPUT_LIMIT: f64 = 1.0;

/// How many bounds are active at the optimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activity {
    /// None: the limits are far away.
    None,
    /// About 25 in most steps: the outputs would exceed their limits.
    Some,
    /// Nearly all inputs stand at a bound.
    NearlyAll,
}

/// One problem on the [`Plant`].
#[derive(Debug, Clone)]
pub struct Case {
    /// Name in tables.
    pub name: String,
    /// m.
    pub inputs: usize,
    /// p.
    pub outputs: usize,
    /// `T_ini` and N.
    pub horizons: Horizons,
    /// T.
    pub samples: usize,
    /// Q; R is 1 for every input but the second, which has 5e-4.
    pub output_weight: f64,
    /// Active bounds.
    pub activity: Activity,
}

impl Case {
    /// The size of the original study: m = 2, p = 1, `T_ini` = N = 100, T = 3200, a Hankel matrix
    /// of 600×3001.
    #[must_use]
    pub fn paper(activity: Activity, output_weight: f64) -> Self {
        let active = match activity {
            Activity::None => "no bound active",
            Activity::Some => "some bounds active",
            Activity::NearlyAll => "nearly all inputs at bounds",
        };
        Self {
            name: format!("600×3001, Q = {output_weight}, {active}"),
            inputs: 2,
            outputs: 1,
            horizons: Horizons::new(100, 100),
            samples: 3200,
            output_weight,
            activity,
        }
    }

    /// J.
    #[must_use]
    pub fn columns(&self) -> usize {
        (self.samples + 1).saturating_sub(self.horizons.window())
    }

    /// (m + p)N, the entries of the future.
    #[must_use]
    pub fn future_rows(&self) -> usize {
        (self.inputs + self.outputs) * self.horizons.future
    }

    /// Entries of what is known at a moment and decides the optimum: the past and the references
    /// that have a weight.
    #[must_use]
    pub fn known_rows(&self) -> usize {
        let tracked = if self.output_weight > 0.0 {
            self.outputs
        } else {
            0
        };
        let past = (self.inputs + self.outputs) * self.horizons.past;
        past + (self.inputs + tracked) * self.horizons.future
    }

    /// The recording.
    ///
    /// # Panics
    /// Never: names differ and the plant's values are finite.
    #[must_use]
    pub fn data(&self) -> Dataset {
        let (inputs, outputs) = Plant::new(self.inputs, self.outputs, 1).record(self.samples);
        let names = |prefix: &str, count| (1..=count).map(|i| format!("{prefix}{i}")).collect();
        let (inputs_named, outputs_named): (Vec<_>, Vec<_>) =
            (names("u", self.inputs), names("y", self.outputs));
        let mut data =
            Dataset::new(SAMPLE_TIME_S, inputs_named, outputs_named).expect("the names differ");
        data.push_record(inputs, outputs)
            .expect("the record is finite");
        data
    }

    /// Weights and bounds: `λ_g` = 100 for 3001 columns, `λ_u` = `λ_y` = 1e8.
    #[must_use]
    pub fn settings(&self) -> DeepcSettings {
        let (spans, limit) = match self.activity {
            Activity::None => ([1e4, 1e4], 1e3),
            Activity::Some => ([200.0, 20.0], OUTPUT_LIMIT),
            Activity::NearlyAll => ([20.0, 1.0], 1e3),
        };
        let second = |j: usize| usize::from(j == 1);
        let input_bounds = (0..self.inputs).map(|j| {
            let (rest, span) = (Plant::rest(j), spans[second(j)]);
            Bounds::between(rest - span, rest + span)
        });
        DeepcSettings {
            input_weights: (0..self.inputs).map(|j| [1.0, 5e-4][second(j)]).collect(),
            output_weights: vec![self.output_weight; self.outputs],
            // 100 at the 3001 columns of the original study, and the same problem at any other length.
            regularisation: Regularisation::per_column(100.0 / 3001.0),
            input_slack: Slack::Penalty(1e8),
            output_slack: Slack::Penalty(1e8),
            input_bounds: input_bounds.collect(),
            output_bounds: vec![OutputBounds::soft(-limit, limit, 1e5, 1e6); self.outputs],
            options: ProgramOptions::default(),
        }
    }

    /// The linear part of the plant, as an identification that errs nowhere would give it: order 2p.
    ///
    /// # Panics
    /// Never: the matrices fit.
    #[must_use]
    pub fn model(&self) -> StateSpace {
        let (m, p) = (self.inputs, self.outputs);
        let gains = Mat::from_fn(p, m, Plant::gain);
        let [recent, before] = Plant::MEMORY;
        let matrices = SystemMatrices {
            a: Mat::from_fn(2 * p, 2 * p, |i, j| {
                match (i % 2, j.checked_sub(i - i % 2)) {
                    (0, Some(0)) => recent,
                    (0, Some(1)) => before,
                    (1, Some(0)) => 1.0,
                    _ => 0.0,
                }
            }),
            b: Mat::from_fn(
                2 * p,
                m,
                |i, j| if i % 2 == 0 { gains[(i / 2, j)] } else { 0.0 },
            ),
            c: Mat::from_fn(p, 2 * p, |i, j| match j.checked_sub(2 * i) {
                Some(0) => recent,
                Some(1) => before,
                _ => 0.0,
            }),
            d: gains,
            k: Mat::from_fn(2 * p, p, |i, j| if i / 2 == j { 0.2 } else { 0.0 }),
        };
        let channel = |name: String, offset, scale| Channel {
            name,
            offset,
            scale,
        };
        let inputs = (0..m).map(|j| {
            let scale = if j == 1 { 1.0 } else { 35.0 };
            channel(format!("u{}", j + 1), Plant::rest(j), scale)
        });
        let outputs = (0..p).map(|i| channel(format!("y{}", i + 1), 0.0, 1.0));
        StateSpace::new(
            SAMPLE_TIME_S,
            inputs.collect(),
            Vec::new(),
            outputs.collect(),
            matrices,
        )
        .expect("the matrices fit")
    }

    /// The costs and bounds of [`settings`](Self::settings) for a linear MPC that starts from the
    /// same window.
    #[must_use]
    pub fn lmpc_settings(&self) -> LmpcSettings {
        LmpcSettings {
            past_steps: Some(self.horizons.past),
            ..LmpcSettings::from(&self.settings())
        }
    }

    /// What input `j` should be at sample `k`: a slow swing that would drive the first output
    /// beyond its limit, or far beyond the input's own bounds.
    #[must_use]
    pub fn input_reference(&self, k: isize, j: usize) -> f64 {
        let phase = k as f64 * (std::f64::consts::TAU / 300.0) + j as f64;
        let swing = match self.activity {
            Activity::None | Activity::Some if j == 1 => 5.0,
            Activity::None | Activity::Some => 30.0,
            Activity::NearlyAll => 4000.0,
        };
        Plant::rest(j) + swing * phase.sin()
    }

    /// What output `i` should be at sample `k`; it counts only with a weight.
    #[must_use]
    pub fn output_reference(&self, k: isize, i: usize) -> f64 {
        0.8 * (k as f64 * (std::f64::consts::TAU / 400.0) + i as f64).sin()
    }

    /// Hankel matrix to predictor, the whole data matrix. The excitation report is left out: it
    /// is a check before control and no part of a set-up that is repeated.
    ///
    /// # Panics
    /// If the recording is too short for the horizons.
    #[must_use]
    pub fn full_predictor(&self, data: &Dataset) -> Predictor {
        let hankel =
            HankelMatrix::build(data, self.horizons).expect("the recording is long enough");
        Predictor::full(&hankel.assume_persistently_exciting())
    }

    /// As [`full_predictor`](Self::full_predictor), reduced to the numerical rank by the SVD
    /// (the original study's RD-DeePC).
    ///
    /// # Panics
    /// If the recording is too short for the horizons, or the SVD does not converge.
    #[must_use]
    pub fn reduced_predictor(&self, data: &Dataset) -> Predictor {
        let hankel =
            HankelMatrix::build(data, self.horizons).expect("the recording is long enough");
        Predictor::exact(&hankel.assume_persistently_exciting()).expect("the SVD converges")
    }

    /// The predictor of a recording of any length, without its Hankel matrix.
    ///
    /// # Panics
    /// If the recording is too short for the horizons.
    #[must_use]
    pub fn streamed_predictor(&self, data: &Dataset) -> Predictor {
        let factor =
            HankelFactor::stream(data, self.horizons).expect("the recording is long enough");
        Predictor::streamed(&factor.assume_persistently_exciting())
    }
}
