//! Subspace identification, from the recording to the model, when one size of the problem changes:
//! samples N, horizon s (past and future), order n; and `identify` as a whole. Two inputs, one output, one
//! thread.

use std::hint::black_box;
use std::ops::ControlFlow;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use deepc_core::data::Dataset;
use deepc_core::hankel::FactorMethod;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sysid::{
    IdentificationSettings, Progress, SubspaceSettings, Weighting, identify_with, subspace_model,
};

const METHODS: [(&str, FactorMethod); 2] =
    [("QR", FactorMethod::BlockQr), ("Gram", FactorMethod::Gram)];

/// Two lightly damped modes at 100 Hz, shaken by filtered noise, measured with 20 dB.
fn recording(samples: usize) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut normal = move || -> f64 { rng.sample(StandardNormal) };
    let (mut u, mut modes) = ([0.0; 2], [[0.0; 2]; 2]);
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for _ in 0..samples {
        for u in &mut u {
            *u = 0.8 * *u + 0.6 * normal();
        }
        inputs.extend(u);
        outputs.push(modes[0][0] + 0.7 * modes[1][0] + 0.03 * normal());
        for (mode, (frequency_hz, damping)) in modes.iter_mut().zip([(0.9, 0.3), (1.9, 0.2)]) {
            let w = std::f64::consts::TAU * frequency_hz;
            let [position, speed] = *mode;
            let force = w * w * (u[0] + 0.3 * u[1] - position) - 2.0 * damping * w * speed;
            mode[1] = speed + 0.01 * force;
            mode[0] = position + 0.01 * mode[1];
        }
    }
    let mut data = Dataset::new(0.01, ["first", "second"], ["output"]).expect("names differ");
    data.push_rows(&inputs, &outputs).expect("rows fit");
    data
}

fn settings(horizon: usize, order: usize, factor: FactorMethod) -> SubspaceSettings {
    SubspaceSettings {
        factor,
        ..SubspaceSettings::slicot(horizon, order)
    }
}

fn sweep(criterion: &mut Criterion, name: &str, cases: &[(usize, usize, usize)]) {
    let mut group = criterion.benchmark_group(format!("identification: {name}"));
    group.sample_size(10);
    for &(samples, horizon, order) in cases {
        let data = recording(samples);
        for (method, factor) in METHODS {
            let settings = settings(horizon, order, factor);
            let size = format!("N={samples} s={horizon} n={order}");
            group.bench_function(BenchmarkId::new(method, size), |b| {
                b.iter(|| subspace_model(black_box(&data), &settings).expect("a model"));
            });
        }
    }
    group.finish();
}

fn samples(criterion: &mut Criterion) {
    let cases = [1000, 3000, 10_000, 100_000].map(|samples| (samples, 30, 4));
    sweep(criterion, "samples", &cases);
}

fn horizons(criterion: &mut Criterion) {
    let cases = [15, 30, 60, 90].map(|horizon| (3000, horizon, 4));
    sweep(criterion, "horizon", &cases);
}

fn orders(criterion: &mut Criterion) {
    let cases = [2, 4, 8, 16].map(|order| (3000, 30, order));
    sweep(criterion, "order", &cases);
}

fn weightings(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("identification: weighting");
    group.sample_size(10);
    let data = recording(3000);
    for (name, weighting) in [
        ("CVA", Weighting::Cva),
        ("MOESP", Weighting::Moesp),
        ("N4SID", Weighting::N4sid),
    ] {
        let settings = SubspaceSettings {
            weighting,
            ..settings(60, 4, FactorMethod::Gram)
        };
        group.bench_function(name, |b| {
            b.iter(|| subspace_model(black_box(&data), &settings).expect("a model"));
        });
    }
    group.finish();
}

/// Everything found from the data, as a recording of the paper's length has it: the order given, and found.
fn automatic(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("identification: identify");
    group.sample_size(10);
    let data = recording(3200);
    for (name, order) in [("order given", Some(4)), ("automatic", None)] {
        let settings = IdentificationSettings {
            order,
            ..IdentificationSettings::default()
        };
        group.bench_function(name, |b| {
            b.iter(|| {
                let go_on = &mut |_: &Progress| ControlFlow::Continue(());
                identify_with(black_box(&data), &settings, go_on).expect("a model")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, samples, horizons, orders, weightings, automatic);
criterion_main!(benches);
