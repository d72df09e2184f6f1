//! A fourth-order system with two inputs, and noisy recordings of it from a seed: the study that
//! identification is judged on.
//!
//! The system is that of the reference sets `syn4_*`: modes at 0.9 and 1.9 Hz sampled at 100 Hz, the second
//! input at an offset of 80 and without feedthrough.

use deepc_core::data::{DataError, Dataset};
use faer::{Mat, mat};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Sample time in seconds.
pub const SAMPLE_TIME_S: f64 = 0.01;

/// Order of the system.
pub const ORDER: usize = 4;

/// A recording with the output before noise.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Inputs and the noisy output.
    pub data: Dataset,
    /// The output without noise, T×1.
    pub noise_free: Mat<f64>,
}

/// A, B, C, D.
#[must_use]
pub fn matrices() -> [Mat<f64>; 4] {
    let a = mat![
        [0.998_422_432_969_425_2, 0.009_799_441_010_656_967, 0.0, 0.0],
        [-0.313_361_803_851_465_67, 0.959_632_259_590_083_6, 0.0, 0.0],
        [0.0, 0.0, 0.993_005_575_392_104_4, 0.009_718_779_402_480_072],
        [0.0, 0.0, -1.385_092_134_999_206_2, 0.941_955_325_725_764_8],
    ];
    let b = mat![
        [2.713_349_609_479_231_4e-5, 9.866_725_852_651_749e-7],
        [0.005_389_692_555_861_333, 0.000_195_988_820_213_139_37],
        [0.002_103_285_642_092_943, -1.472_333_892_318_012_6e-6],
        [0.019_982_429_763_877_06, -0.000_291_563_382_074_402_2],
    ];
    [a, b, mat![[2.0, 0.05, 0.9, 0.03]], mat![[0.004, 0.0]]]
}

/// A recording of `samples` samples with white noise on the output, `snr_db` below it.
///
/// # Errors
/// `samples` is 0.
pub fn record(seed: u64, samples: usize, snr_db: f64) -> Result<Recording, DataError> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let first = levels(&mut random, samples, 25, 6.0, 0.925);
    let second = levels(&mut random, samples, 100, 14.0, 0.984);
    let inputs = Mat::from_fn(
        samples,
        2,
        |k, j| if j == 0 { first[k] } else { second[k] + 80.0 },
    );
    let [a, b, c, d] = matrices();
    let mut x = Mat::zeros(ORDER, 1);
    let mut noise_free = Mat::zeros(samples, 1);
    for k in 0..samples {
        let u = mat![[inputs[(k, 0)]], [inputs[(k, 1)] - 80.0]];
        noise_free[(k, 0)] = (&c * &x + &d * &u)[(0, 0)];
        x = &a * &x + &b * &u;
    }
    let mean = noise_free.col(0).sum() / samples as f64;
    let squares = noise_free.col(0).iter().map(|y| (y - mean).powi(2));
    let deviation = (squares.sum::<f64>() / samples as f64).sqrt();
    let size = deviation * 10.0_f64.powf(-snr_db / 20.0);
    let outputs = Mat::from_fn(samples, 1, |k, _| {
        let noise: f64 = StandardNormal.sample(&mut random);
        noise_free[(k, 0)] + size * noise
    });
    let mut data = Dataset::new(SAMPLE_TIME_S, ["u1", "u2"], ["y1"])?;
    data.push_record(inputs, outputs)?;
    Ok(Recording { data, noise_free })
}

/// Random levels up to ±`size`, each held for half to twice `hold` samples, through two equal
/// first-order lags with the given pole.
fn levels(random: &mut ChaCha8Rng, samples: usize, hold: usize, size: f64, pole: f64) -> Vec<f64> {
    let (mut fast, mut slow) = (0.0, 0.0);
    let (mut left, mut level) = (0, 0.0);
    (0..samples)
        .map(|_| {
            if left == 0 {
                left = random.random_range(hold / 2..hold * 2);
                level = random.random_range(-size..size);
            }
            left -= 1;
            fast += (1.0 - pole) * (level - fast);
            slow += (1.0 - pole) * (fast - slow);
            slow
        })
        .collect()
}
