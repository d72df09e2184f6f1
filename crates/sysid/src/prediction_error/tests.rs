use deepc_core::faer::{Mat, MatRef, mat};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::jacobian::Rows;
use super::*;
use crate::state_space::Channel;
use crate::working::WorkingRecord;

pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // Twelve uniform numbers: close enough to normal, and the same on every machine.
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

/// m = 2, p = 2, n = 3.
pub(crate) fn plant() -> SystemMatrices {
    SystemMatrices {
        a: mat![[0.8, 0.3, 0.0], [-0.3, 0.8, 0.1], [0.0, 0.0, 0.6]],
        b: mat![[1.0, 0.2], [0.0, 0.7], [0.5, -0.4]],
        c: mat![[1.0, 0.0, 0.5], [0.2, 1.0, -0.6]],
        d: mat![[0.3, 0.0], [-0.2, 0.0]],
        k: mat![[0.3, 0.1], [-0.1, 0.4], [0.2, 0.0]],
    }
}

/// Records of the innovation form with innovations of this size and slowly varying inputs.
pub(crate) fn records(
    model: &SystemMatrices,
    lengths: &[usize],
    noise: f64,
    seed: u64,
) -> WorkingData {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (n, m, p) = (model.order(), model.inputs(), model.outputs());
    let records = lengths.iter().map(|&samples| {
        let mut x = Mat::from_fn(n, 1, |_, _| normal(&mut rng));
        let mut inputs = Mat::zeros(samples, m);
        let mut outputs = Mat::zeros(samples, p);
        let mut u = Mat::zeros(m, 1);
        for k in 0..samples {
            let e = Mat::from_fn(p, 1, |_, _| noise * normal(&mut rng));
            u = Mat::from_fn(m, 1, |j, _| 0.6 * u[(j, 0)] + 0.8 * normal(&mut rng));
            let y = &model.c * &x + &model.d * &u + &e;
            x = &model.a * &x + &model.b * &u + &model.k * &e;
            (0..m).for_each(|j| inputs[(k, j)] = u[(j, 0)]);
            (0..p).for_each(|l| outputs[(k, l)] = y[(l, 0)]);
        }
        WorkingRecord { inputs, outputs }
    });
    WorkingData {
        sample_time_s: 1.0,
        records: records.collect(),
        disturbances: 0,
        inputs: (0..m).map(|j| Channel::new(format!("u{j}"))).collect(),
        outputs: (0..p).map(|l| Channel::new(format!("y{l}"))).collect(),
    }
}

pub(crate) fn structure(feedthrough: &[bool]) -> InputStructure {
    InputStructure {
        dynamics: vec![true; feedthrough.len()],
        feedthrough: feedthrough.to_vec(),
    }
}

fn perturbed(model: &SystemMatrices, size: f64, seed: u64) -> SystemMatrices {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut moved = |m: &Mat<f64>| {
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| {
            m[(i, j)] + size * normal(&mut rng)
        })
    };
    SystemMatrices {
        a: moved(&model.a),
        b: moved(&model.b),
        c: moved(&model.c),
        d: moved(&model.d),
        k: moved(&model.k),
    }
}

/// D and C Aᵏ B, C Aᵏ K for k below `count`, which no change of basis moves.
pub(crate) fn markov(model: &SystemMatrices, count: usize) -> Vec<Mat<f64>> {
    let mut parameters = vec![model.d.clone()];
    let mut power = model.c.clone();
    for _ in 0..count {
        parameters.push(&power * &model.b);
        parameters.push(&power * &model.k);
        power = power * &model.a;
    }
    parameters
}

fn difference(x: &SystemMatrices, y: &SystemMatrices) -> f64 {
    let pairs = markov(x, 20).into_iter().zip(markov(y, 20));
    pairs.map(|(x, y)| (x - y).norm_max()).fold(0.0, f64::max)
}

/// Innovations for initial states given, computed in the plainest way.
fn innovations(packed: &Packed, model: &SystemMatrices, initial: &[Vec<f64>]) -> Vec<f64> {
    let mut all = Vec::new();
    for (record, x0) in packed.records.iter().zip(initial) {
        let mut x = Mat::from_fn(model.order(), 1, |i, _| x0[i]);
        for k in 0..record.samples {
            let u = Mat::from_fn(packed.inputs, 1, |j, _| {
                record.inputs[k * packed.inputs + j]
            });
            let y = Mat::from_fn(packed.outputs, 1, |l, _| {
                record.outputs[k * packed.outputs + l]
            });
            let e = y - &model.c * &x - &model.d * &u;
            x = &model.a * &x + &model.b * &u + &model.k * &e;
            all.extend((0..packed.outputs).map(|l| e[(l, 0)]));
        }
    }
    all
}

#[test]
fn jacobian_is_that_of_finite_differences() {
    let truth = plant();
    let data = records(&truth, &[400, 270], 0.3, 1);
    let start = perturbed(&truth, 0.01, 2);
    for focus in [Focus::Simulation, Focus::Prediction, Focus::Gain] {
        let free = structure(&[true, false]);
        let (packed, model, layout) = prepared(&data, &start, &free, focus).unwrap();
        let identity = Mat::identity(2, 2);
        let run = Evaluation::new(&packed, &model, &identity, OutputWeights::Covariance).unwrap();
        let full = Rows::new(&packed, &model, &run, &layout).full();
        let count = layout.entries().len();
        assert_eq!(full.shape(), (670 * 2, count));
        let whiten = |e: Vec<f64>| -> Vec<f64> {
            e.chunks_exact(2)
                .flat_map(|e| {
                    let w = run.whitening.clone();
                    (0..2).map(move |l| w[(l, 0)] * e[0] + w[(l, 1)] * e[1])
                })
                .collect()
        };
        let h = 1e-6;
        for column in 0..count {
            let moved = |h: f64| {
                let mut change = vec![0.0; count];
                change[column] = h;
                whiten(innovations(
                    &packed,
                    &layout.moved(&model, &change),
                    &run.initial,
                ))
            };
            let (up, down) = (moved(h), moved(-h));
            let size = full.col(column).norm_max();
            for (row, (up, down)) in up.iter().zip(&down).enumerate() {
                let error = full[(row, column)] - (up - down) / (2.0 * h);
                assert!(
                    error.abs() < 1e-7 * size,
                    "{focus:?} {:?} row {row}: {error:e}",
                    layout.entries()[column]
                );
            }
        }
    }
}

#[test]
fn basis_changes_are_orthogonal_to_every_step_and_change_nothing() {
    let data = records(&plant(), &[300], 0.3, 3);
    let free = structure(&[true, false]);
    let (packed, model, layout) = prepared(&data, &plant(), &free, Focus::Prediction).unwrap();
    let identity = Mat::identity(2, 2);
    let run = Evaluation::new(&packed, &model, &identity, OutputWeights::Covariance).unwrap();
    let linear = linearise(&packed, &model, &run, &layout, None).unwrap();
    // 9 + 6 + 6 + 2 + 6 entries, 9 directions of the basis.
    assert_eq!(linear.to_full.shape(), (29, 20));
    let svd = linear.triangle.singular_values().unwrap();
    assert!(svd[19] > 1e-4 * svd[0], "{svd:?}");
}

#[test]
fn exact_data_give_the_plant_back() {
    let mut truth = plant();
    truth.k.fill(0.0);
    let data = records(&truth, &[300, 200], 0.0, 4);
    for seed in 0..5 {
        let mut start = perturbed(&truth, 0.03, seed + 10);
        start.k.fill(0.0);
        let free = structure(&[true, false]);
        let refined = refine(
            &data,
            &start,
            &free,
            Focus::Simulation,
            &RefineSettings::default(),
        )
        .unwrap();
        assert!(refined.converged(), "{:?}", refined.ending);
        let error = difference(&refined.matrices, &truth);
        assert!(error < 1e-10, "seed {seed}: {error:e}");
        for (record, initial) in data.records.iter().zip(&refined.initial_states) {
            let simulated = refined.matrices.simulate(initial, record.inputs.as_ref());
            assert!((simulated - &record.outputs).norm_max() < 1e-10);
        }
    }
}

#[test]
fn prediction_errors_approach_those_of_the_truth() {
    let truth = plant();
    let data = records(&truth, &[2000, 1500], 0.4, 5);
    let start = perturbed(&truth, 0.02, 6);
    let free = structure(&[true, false]);
    let settings = RefineSettings::default();
    let refined = refine(&data, &start, &free, Focus::Prediction, &settings).unwrap();
    assert!(refined.converged());
    let of = |model: &SystemMatrices| {
        let none = RefineSettings {
            iterations: 0,
            ..RefineSettings::default()
        };
        refine(&data, model, &free, Focus::Prediction, &none)
            .unwrap()
            .loss
    };
    let (at_truth, found) = (of(&truth), refined.loss);
    // 20 parameters over 7000 numbers: the gain over the truth is about 20 / 7000.
    assert!(
        found < at_truth && found > at_truth - 3.0 * 20.0 / 7000.0,
        "{found} {at_truth}"
    );
    let error = difference(&refined.matrices, &truth);
    assert!(error < 0.1, "{error}");
    // K alone cannot do better, and from elsewhere finds the same.
    let mut gain_start = refined.matrices.clone();
    gain_start.k.fill(0.0);
    let gain = refine(&data, &gain_start, &free, Focus::Gain, &settings).unwrap();
    assert!((gain.loss - found).abs() < 1e-5, "{} {found}", gain.loss);
    assert!(gain.matrices.a == refined.matrices.a);
}

#[test]
fn neither_state_basis_nor_inactive_inputs_matter() {
    let truth = plant();
    let data = records(&truth, &[800], 0.3, 7);
    let start = perturbed(&truth, 0.02, 8);
    let scale = [1e5, 1.0, 1e-4];
    let skewed = SystemMatrices {
        a: Mat::from_fn(3, 3, |i, j| start.a[(i, j)] * scale[i] / scale[j]),
        b: Mat::from_fn(3, 2, |i, j| start.b[(i, j)] * scale[i]),
        c: Mat::from_fn(2, 3, |i, j| start.c[(i, j)] / scale[j]),
        d: start.d.clone(),
        k: Mat::from_fn(3, 2, |i, j| start.k[(i, j)] * scale[i]),
    };
    let settings = RefineSettings {
        tolerance: 1e-10,
        ..RefineSettings::default()
    };
    let inactive = InputStructure {
        dynamics: vec![true, false],
        feedthrough: vec![true, false],
    };
    for structure in [structure(&[true, false]), inactive] {
        let run = |start| refine(&data, start, &structure, Focus::Prediction, &settings).unwrap();
        let (plain, other) = (run(&start), run(&skewed));
        assert!((plain.loss - other.loss).abs() < 1e-8);
        assert!(difference(&plain.matrices, &other.matrices) < 1e-3);
        if !structure.dynamics[1] {
            assert!(plain.matrices.b.col(1).norm_max() == 0.0);
            assert!(plain.matrices.d.col(1).norm_max() == 0.0);
        }
    }
}

#[test]
fn an_order_too_high_ends_stable_and_no_worse() {
    let truth = plant();
    let data = records(&truth, &[600], 0.2, 9);
    let mut start = SystemMatrices {
        a: Mat::zeros(5, 5),
        b: Mat::zeros(5, 2),
        c: Mat::zeros(2, 5),
        d: truth.d.clone(),
        k: Mat::zeros(5, 2),
    };
    start.a.submatrix_mut(0, 0, 3, 3).copy_from(&truth.a);
    start.b.subrows_mut(0, 3).copy_from(&truth.b);
    start.c.subcols_mut(0, 3).copy_from(&truth.c);
    start.a[(3, 3)] = 0.5;
    start.a[(4, 4)] = 0.97;
    // State 3 is driven but not seen, state 4 is seen but not driven.
    start.b[(3, 0)] = 1.0;
    start.c[(0, 4)] = 1.0;
    for focus in [Focus::Simulation, Focus::Prediction] {
        let settings = RefineSettings::default();
        let refined = refine(&data, &start, &structure(&[true, false]), focus, &settings).unwrap();
        assert!(refined.loss <= refined.loss_before);
        assert!(spectral_radius(refined.matrices.a.as_ref()) < 1.0);
        assert!(refined.matrices.a.as_ref().is_all_finite());
    }
}

#[test]
fn an_unstable_start_is_refused_with_its_radius() {
    let mut start = plant();
    let data = records(&start, &[100], 0.1, 10);
    start.a[(2, 2)] = 1.25;
    let free = structure(&[true, false]);
    let settings = RefineSettings::default();
    let error = refine(&data, &start, &free, Focus::Simulation, &settings).unwrap_err();
    assert!(error.to_string().contains("1.250000"), "{error}");
    let wrong = RefineSettings {
        radius: 1.5,
        ..settings
    };
    let error = refine(&data, &plant(), &free, Focus::Simulation, &wrong).unwrap_err();
    assert!(error.to_string().contains("radius"), "{error}");
}

/// 1 − ‖y − ŷ‖ / ‖y − mean‖, in percent, over all outputs.
pub(crate) fn fit(measured: MatRef<'_, f64>, simulated: MatRef<'_, f64>) -> f64 {
    let mean: Vec<f64> = (0..measured.ncols())
        .map(|j| measured.col(j).iter().sum::<f64>() / measured.nrows() as f64)
        .collect();
    let spread = Mat::from_fn(measured.nrows(), measured.ncols(), |i, j| {
        measured[(i, j)] - mean[j]
    });
    100.0 * (1.0 - (measured - simulated).norm_l2() / spread.norm_l2())
}

/// The fourth-order system of the project's synthetic recordings (100 Hz, modes near 0.9 and
/// 1.9 Hz), its inputs and outputs scaled to about size 1.
fn synthetic() -> SystemMatrices {
    let b = mat![
        [2.713_349_609_479_231_4e-5, 9.866_725_852_651_749e-7],
        [0.005_389_692_555_861_333, 0.000_195_988_820_212_139_37],
        [0.002_103_285_642_092_943, -1.472_333_892_318_012_6e-6],
        [0.019_982_429_763_877_06, -0.000_291_562_382_074_402_2]
    ];
    SystemMatrices {
        a: mat![
            [0.998_422_432_969_425_2, 0.009_799_441_010_656_967, 0.0, 0.0],
            [-0.313_361_803_851_465_67, 0.959_632_259_590_083_6, 0.0, 0.0],
            [0.0, 0.0, 0.993_005_575_392_104_4, 0.009_718_779_402_480_072],
            [0.0, 0.0, -1.385_092_134_999_206_2, 0.941_955_325_725_764_8]
        ],
        b: Mat::from_fn(4, 2, |i, j| b[(i, j)] * [2.7, 7.1][j] / 0.128),
        c: mat![[2.0, 0.05, 0.9, 0.03]],
        d: mat![[0.004 * 2.7 / 0.128, 0.0]],
        k: Mat::zeros(4, 1),
    }
}

#[test]
fn twenty_decibels_of_noise_leave_99_percent() {
    let truth = synthetic();
    let mut fits = Vec::new();
    for seed in 0..5 {
        let clean = records(&truth, &[3000], 0.0, 20 + seed);
        let mut noisy = clean.clone();
        let mut rng = ChaCha8Rng::seed_from_u64(40 + seed);
        let size = clean.records[0].outputs.norm_l2() / 3000_f64.sqrt() / 10.0;
        for k in 0..3000 {
            noisy.records[0].outputs[(k, 0)] += size * normal(&mut rng);
        }
        // Poles that are 15 % too fast and too well damped, B and D to match.
        let mut start = truth.clone();
        start.a = Mat::from_fn(4, 4, |i, j| {
            let unit = f64::from(u8::from(i == j));
            unit + 1.15 * (truth.a[(i, j)] - unit) - 0.01 * unit
        });
        let free = structure(&[true, true]);
        let fitted =
            crate::input_fit::fit_inputs(&noisy, start.a.as_ref(), start.c.as_ref(), &free);
        let fitted = fitted.unwrap();
        (start.b, start.d) = (fitted.b, fitted.d);
        for focus in [Focus::Simulation, Focus::Prediction] {
            let settings = RefineSettings::default();
            let refined = refine(&noisy, &start, &free, focus, &settings).unwrap();
            assert!(
                refined.converged(),
                "{focus:?} {seed}: {:?}",
                refined.ending
            );
            let (record, states) = (&clean.records[0], &refined.initial_states[0]);
            let simulated = refined.matrices.simulate(states, record.inputs.as_ref());
            fits.push(fit(record.outputs.as_ref(), simulated.as_ref()));
        }
    }
    assert!(fits.iter().all(|&fit| fit > 98.5), "{fits:?}");
    assert!(
        fits.iter().sum::<f64>() / fits.len() as f64 > 99.0,
        "{fits:?}"
    );
}

#[test]
fn gradients_of_poles_at_the_limit_are_those_of_finite_differences() {
    let truth = plant();
    let layout = Layout::new(3, 2, &structure(&[true, false]), Focus::Prediction);
    let count = layout.entries().len();
    let largest = |model: &SystemMatrices| {
        let f = &model.a - &model.k * &model.c;
        (
            spectral_radius(model.a.as_ref()),
            spectral_radius(f.as_ref()),
        )
    };
    let (a, f) = largest(&truth);
    let limits = limits::Limits::at(a, f);
    let found = limits.gradients_at_the_limit(&layout, &truth, &Mat::identity(count, count));
    assert_eq!(found.len(), 2);
    let h = 1e-6;
    for entry in 0..count {
        let mut change = vec![0.0; count];
        change[entry] = h;
        let up = largest(&layout.moved(&truth, &change));
        change[entry] = -h;
        let down = largest(&layout.moved(&truth, &change));
        for (found, (up, down)) in found.iter().zip([(up.0, down.0), (up.1, down.1)]) {
            let error = found[entry] - (up - down) / (2.0 * h);
            assert!(
                error.abs() < 1e-8,
                "{:?}: {error:e}",
                layout.entries()[entry]
            );
        }
    }
}

#[test]
fn a_predictor_that_must_end_at_the_limit_gets_there() {
    // Output noise that was differenced has a zero on the unit circle, which A − KC cannot reach.
    let truth = SystemMatrices {
        k: Mat::zeros(3, 2),
        ..plant()
    };
    let mut data = records(&truth, &[1500], 0.0, 30);
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let noise = Mat::from_fn(1501, 2, |_, _| 0.3 * normal(&mut rng));
    for k in 0..1500 {
        for l in 0..2 {
            data.records[0].outputs[(k, l)] += noise[(k + 1, l)] - noise[(k, l)];
        }
    }
    let mut start = SystemMatrices {
        a: Mat::zeros(5, 5),
        b: Mat::zeros(5, 2),
        c: Mat::zeros(2, 5),
        d: truth.d.clone(),
        k: Mat::zeros(5, 2),
    };
    start.a.submatrix_mut(0, 0, 3, 3).copy_from(&truth.a);
    start.b.subrows_mut(0, 3).copy_from(&truth.b);
    start.c.subcols_mut(0, 3).copy_from(&truth.c);
    for l in 0..2 {
        start.a[(3 + l, 3 + l)] = 0.01;
        start.c[(l, 3 + l)] = 1.0;
        start.k[(3 + l, l)] = -0.3;
    }
    let settings = RefineSettings {
        radius: 0.999,
        ..RefineSettings::default()
    };
    let free = structure(&[true, false]);
    let refined = refine(&data, &start, &free, Focus::Prediction, &settings).unwrap();
    let predictor = predictor_radius(&refined.matrices);
    assert!(
        predictor > 0.98 && predictor <= 0.999 * (1.0 + 1e-9),
        "{predictor}"
    );
    // Variance 2·0.09 in the output, 0.09 in the innovations.
    for l in 0..2 {
        let variance = refined.covariance[(l, l)];
        assert!(variance < 0.105, "{variance}");
    }
}
