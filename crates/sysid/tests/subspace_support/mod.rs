//! Reference recordings and small systems for the tests of subspace identification.

#![allow(dead_code)] // Each test target uses its own part.

use std::path::Path;

use deepc_core::data::{Dataset, Record};
use deepc_core::faer::linalg::solvers::SolveLstsq;
use deepc_core::faer::{Mat, MatRef};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::Value;
use sysid::{StateSpace, SystemMatrices};

pub const SETS: [&str; 9] = [
    "hairdryer",
    "cd_player_arm",
    "robot_arm",
    "thermal_wall",
    "exchanger",
    "syn4_clean",
    "syn4_clean_x0",
    "syn4_white20",
    "syn_vodm4",
];

pub fn reference() -> Value {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/reference.json");
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

/// Rows of a file of the reference data.
pub fn rows(name: &str) -> Vec<Vec<f64>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference/data")
        .join(format!("{name}.csv"));
    let mut reader = csv::Reader::from_path(file).unwrap();
    let rows = reader.records().map(|record| {
        let record = record.unwrap();
        record.iter().map(|field| field.parse().unwrap()).collect()
    });
    rows.collect()
}

/// A data set of one record from rows of inputs, then outputs.
pub fn dataset(sample_time_s: f64, inputs: usize, records: &[&[Vec<f64>]]) -> Dataset {
    let outputs = records[0][0].len() - inputs;
    let names = |letter: &str, count: usize| (0..count).map(|i| format!("{letter}{i}")).collect();
    let (u, y): (Vec<String>, Vec<String>) = (names("u", inputs), names("y", outputs));
    let mut data = Dataset::new(sample_time_s, u, y).unwrap();
    for rows in records {
        let part =
            |from: usize, count: usize| Mat::from_fn(rows.len(), count, |i, j| rows[i][from + j]);
        data.push_record(part(0, inputs), part(inputs, outputs))
            .unwrap();
    }
    data
}

pub fn number(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

pub fn numbers(value: &Value) -> Vec<f64> {
    let values = value.as_array().unwrap().iter();
    values.map(|v| v.as_f64().unwrap()).collect()
}

pub fn matrix(value: &Value) -> Mat<f64> {
    let rows: Vec<_> = value.as_array().unwrap().iter().map(numbers).collect();
    Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

pub fn system(value: &Value) -> SystemMatrices {
    SystemMatrices {
        a: matrix(&value["A"]),
        b: matrix(&value["B"]),
        c: matrix(&value["C"]),
        d: matrix(&value["D"]),
        k: matrix(&value["K"]),
    }
}

/// D, CB, CAB, …
pub fn markov(model: &SystemMatrices, count: usize) -> Vec<Mat<f64>> {
    impulse(model, &model.b, &model.d, count)
}

/// I, CK, CAK, …: what does not depend on the coordinates of the state.
pub fn innovation_markov(model: &SystemMatrices, count: usize) -> Vec<Mat<f64>> {
    let unit = Mat::identity(model.outputs(), model.outputs());
    impulse(model, &model.k, &unit, count)
}

fn impulse(model: &SystemMatrices, b: &Mat<f64>, d: &Mat<f64>, count: usize) -> Vec<Mat<f64>> {
    let mut all = vec![d.clone()];
    let mut x = b.clone();
    while all.len() < count {
        all.push(&model.c * &x);
        x = &model.a * &x;
    }
    all
}

/// Largest difference, relative to the largest entry of `b`.
pub fn difference(a: &[Mat<f64>], b: &[Mat<f64>]) -> f64 {
    let size = b.iter().map(Mat::norm_max).fold(0.0, f64::max);
    let most = a.iter().zip(b).map(|(a, b)| (a - b).norm_max());
    most.fold(0.0, f64::max) / size
}

/// Poles in the order of real part, then imaginary part.
pub fn poles(a: MatRef<'_, f64>) -> Vec<(f64, f64)> {
    let eigenvalues = a.eigenvalues().unwrap();
    eigenvalues.iter().map(|z| (z.re, z.im)).collect()
}

/// Distance of two sets of poles: each to the nearest one of the other set.
pub fn distance(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let one_way = |a: &[(f64, f64)], b: &[(f64, f64)]| {
        let nearest = |x: &(f64, f64)| {
            let all = b.iter().map(|y| (x.0 - y.0).hypot(x.1 - y.1));
            all.fold(f64::INFINITY, f64::min)
        };
        a.iter().map(nearest).fold(0.0, f64::max)
    };
    assert_eq!(a.len(), b.len());
    one_way(a, b).max(one_way(b, a))
}

pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample(StandardNormal)
}

pub fn generator(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A stable system in innovation form with a stable predictor, entries from the generator.
pub fn random_system(rng: &mut ChaCha8Rng, n: usize, m: usize, p: usize) -> SystemMatrices {
    let mut draw = |rows, columns| Mat::from_fn(rows, columns, |_, _| normal(rng));
    let raw = draw(n, n);
    let radius = |a: &Mat<f64>| {
        let all = poles(a.as_ref());
        all.iter().map(|z| z.0.hypot(z.1)).fold(0.0, f64::max)
    };
    let a = &raw * deepc_core::faer::Scale(0.9 / radius(&raw));
    let (b, c, d) = (draw(n, m), draw(p, n), draw(p, m));
    // A − KC with small K stays near A.
    let mut k = draw(n, p);
    while radius(&(&a - &k * &c)) > 0.95 {
        k *= deepc_core::faer::Scale(0.7);
    }
    SystemMatrices { a, b, c, d, k }
}

/// Rows of a record: white inputs, the innovation of standard deviation `noise`.
pub fn record(
    rng: &mut ChaCha8Rng,
    system: &SystemMatrices,
    samples: usize,
    noise: f64,
) -> Vec<Vec<f64>> {
    let (n, m, p) = (system.order(), system.inputs(), system.outputs());
    let mut x = Mat::from_fn(n, 1, |_, _| normal(rng));
    let mut rows = Vec::new();
    for _ in 0..samples {
        let u = Mat::from_fn(m, 1, |_, _| normal(rng));
        let e = Mat::from_fn(p, 1, |_, _| noise * normal(rng));
        let y = &system.c * &x + &system.d * &u + &e;
        x = &system.a * &x + &system.b * &u + &system.k * &e;
        let row = u.col_as_slice(0).iter().chain(y.col_as_slice(0));
        rows.push(row.copied().collect());
    }
    rows
}

/// Fit of the simulated outputs in percent, each from the initial state that fits best: the
/// protocol of the reference results.
pub fn simulation_fit(model: &StateSpace, record: &Record) -> Vec<f64> {
    let matrices = model.matrices();
    let (n, p, samples) = (model.order(), model.outputs().len(), record.samples());
    let channels = model.inputs().iter().chain(model.disturbances());
    let offsets: Vec<_> = channels.map(|channel| channel.offset).collect();
    let mut table = Mat::zeros(samples * p, n);
    let mut rest = Mat::zeros(samples * p, 1);
    let (mut x, mut free) = (Mat::<f64>::zeros(n, 1), matrices.c.clone());
    for k in 0..samples {
        let u = Mat::from_fn(offsets.len(), 1, |j, _| {
            record.inputs()[(k, j)] - offsets[j]
        });
        let y = &matrices.c * &x + &matrices.d * &u;
        for i in 0..p {
            rest[(k * p + i, 0)] = record.outputs()[(k, i)] - model.outputs()[i].offset - y[(i, 0)];
            for j in 0..n {
                table[(k * p + i, j)] = free[(i, j)];
            }
        }
        x = &matrices.a * &x + &matrices.b * &u;
        free = &free * &matrices.a;
    }
    let initial = table.qr().solve_lstsq(&rest);
    rest -= &table * &initial;
    let fit = |i: usize| {
        let series = record.outputs().col(i);
        let mean = series.iter().sum::<f64>() / samples as f64;
        let spread = series.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
        let missed = (0..samples)
            .map(|k| rest[(k * p + i, 0)].powi(2))
            .sum::<f64>();
        100.0 * (1.0 - (missed / spread).sqrt())
    };
    (0..p).map(fit).collect()
}
