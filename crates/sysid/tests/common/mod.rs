//! Models and data that the tests share.
#![allow(dead_code, reason = "not every test uses all of them")]

use deepc_core::data::Dataset;
use deepc_core::faer::{Mat, mat};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use sysid::{Channel, StateSpace, SystemMatrices};

pub fn channel(name: &str, offset: f64, scale: f64) -> Channel {
    Channel {
        name: name.into(),
        offset,
        scale,
    }
}

/// Order 4, two inputs, one measured disturbance, two outputs, with offsets and unequal scales.
pub fn plant() -> StateSpace {
    plant_with(mat![[0.25, 0.02], [-0.1, 0.15], [0.3, -0.05], [0.05, 0.2]])
}

pub fn plant_with(k: Mat<f64>) -> StateSpace {
    let a = mat![
        [0.9, 0.25, 0.0, 0.0],
        [-0.25, 0.9, 0.1, 0.0],
        [0.0, 0.0, 0.7, -0.3],
        [0.0, 0.05, 0.3, 0.6]
    ];
    let b = mat![
        [1.0, 0.2, 0.1],
        [0.0, 0.5, -0.3],
        [0.3, -1.0, 0.2],
        [0.2, 0.1, 0.4]
    ];
    let c = mat![[1.0, 0.0, 0.5, 0.1], [0.0, 0.3, 1.0, -0.4]];
    let d = mat![[0.2, 0.0, 0.0], [0.1, -0.1, 0.3]];
    StateSpace::new(
        0.1,
        vec![channel("valve", 80.0, 2.0), channel("pump", -3.0, 0.5)],
        vec![channel("load", 1.0, 0.7)],
        vec![channel("level", 12.0, 4.0), channel("flow", -200.0, 3.0)],
        SystemMatrices { a, b, c, d, k },
    )
    .unwrap()
    .with_innovation_covariance(mat![[0.04, 0.01], [0.01, 0.09]])
    .unwrap()
}

pub struct Noise(ChaCha8Rng);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    pub fn matrix(&mut self, rows: usize, columns: usize) -> Mat<f64> {
        Mat::from_fn(rows, columns, |_, _| self.normal())
    }
}

/// Inputs T×M about the offsets of the model, each an autoregression of that coefficient.
pub fn inputs(model: &StateSpace, samples: usize, colour: f64, noise: &mut Noise) -> Mat<f64> {
    let channels: Vec<_> = model.inputs().iter().chain(model.disturbances()).collect();
    let mut inputs = Mat::zeros(samples, channels.len());
    for (j, channel) in channels.iter().enumerate() {
        let mut state = 0.0;
        for k in 0..samples {
            state = colour * state + (1.0 - colour * colour).sqrt() * noise.normal();
            inputs[(k, j)] = channel.offset + channel.scale * state;
        }
    }
    inputs
}

/// The equations of the model as they stand in its documentation, one sample at a time, with
/// innovations T×p.
pub fn run(model: &StateSpace, x0: &[f64], inputs: &Mat<f64>, innovations: &Mat<f64>) -> Mat<f64> {
    let m = model.matrices();
    let (n, p) = (model.order(), model.outputs().len());
    let channels: Vec<_> = model.inputs().iter().chain(model.disturbances()).collect();
    let mut x = Mat::from_fn(n, 1, |i, _| x0[i]);
    let mut outputs = Mat::zeros(inputs.nrows(), p);
    for k in 0..inputs.nrows() {
        let u = Mat::from_fn(channels.len(), 1, |j, _| {
            inputs[(k, j)] - channels[j].offset
        });
        let e = Mat::from_fn(p, 1, |i, _| innovations[(k, i)]);
        let y = &m.c * &x + &m.d * &u + &e;
        for (i, output) in model.outputs().iter().enumerate() {
            outputs[(k, i)] = output.offset + y[(i, 0)];
        }
        x = &m.a * &x + &m.b * &u + &m.k * &e;
    }
    outputs
}

/// An empty data set with the channels of the model.
pub fn dataset(model: &StateSpace) -> Dataset {
    let names = |channels: &[Channel]| channels.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
    Dataset::with_disturbances(
        model.sample_time_s(),
        names(model.inputs()),
        names(model.disturbances()),
        names(model.outputs()),
    )
    .unwrap()
}

/// Adds a record of inputs T×M.
pub fn push(data: &mut Dataset, inputs: &Mat<f64>, outputs: Mat<f64>) {
    let m = data.inputs();
    let decided = inputs.get(.., ..m).to_owned();
    let measured = inputs.get(.., m..).to_owned();
    data.push_record_with_disturbances(decided, measured, outputs)
        .unwrap();
}

pub fn largest_difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (a - b).norm_max()
}
