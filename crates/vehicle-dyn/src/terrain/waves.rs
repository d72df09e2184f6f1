//! Random surfaces as sums of plane cosine waves with random directions and phases.
//!
//! Waves in all directions make the surface isotropic, so that the tracks under the left and the right
//! wheels are coherent for long waves and independent for short ones, as on real roads (Kamash and Robson
//! 1978).

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::description::{Roughness, Undulation};

/// Spatial frequency of the reference level of ISO 8608, cycles/m.
const REFERENCE_PER_M: f64 = 0.1;
/// Lowest and highest spatial frequency of the roughness, cycles/m.
const BAND_PER_M: (f64, f64) = (0.02, 1.0);
/// Spatial frequency above which waves are spread evenly in variance, cycles/m.
const UPPER_OCTAVE_PER_M: f64 = 0.5;
/// Roughness waves below and above it.
const LOWER_WAVES: usize = 640;
const UPPER_WAVES: usize = 128;
/// Undulation waves.
const LONG_WAVES: usize = 48;
/// Streams of one seed, so that equal seeds of roughness and undulation share nothing.
const ROUGHNESS_STREAM: u64 = 1;
const UNDULATION_STREAM: u64 = 2;

/// A wave `amplitude cos(kx x + ky y + phase)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wave {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Angular wave numbers along x and y, rad/m.
    pub rad_per_m: [f64; 2],
    /// Phase at the origin, rad.
    pub phase_rad: f64,
}

impl Wave {
    fn random(random: &mut ChaCha8Rng, frequency_per_m: f64, amplitude_m: f64) -> Self {
        let (sin, cos) = (TAU * random.random::<f64>()).sin_cos();
        let rad_per_m = TAU * frequency_per_m;
        Self {
            amplitude_m,
            rad_per_m: [rad_per_m * cos, rad_per_m * sin],
            phase_rad: TAU * random.random::<f64>(),
        }
    }

    /// Height, and its derivatives by x and y.
    #[cfg(test)]
    pub fn height(&self, x: f64, y: f64) -> [f64; 3] {
        let [kx, ky] = self.rad_per_m;
        let (sin, cos) = (kx * x + ky * y + self.phase_rad).sin_cos();
        let a = self.amplitude_m;
        [a * cos, -a * kx * sin, -a * ky * sin]
    }
}

/// The waves of a roughness.
///
/// Along a line, a wave of frequency `ν` that meets it at an angle `θ` shows as `n = ν |cos θ|`. For
/// `Gd(n) ∝ n^-2` up to the end `ν1` of the band exactly, Abel's transform asks for the variance
/// `Gd(n0) n0² (Φ(a) − Φ(b))` of all waves with `a < ν < b`, where `Φ(ν) = arccos(ν/ν1)/ν`.
pub(super) fn roughness(description: &Roughness) -> Vec<Wave> {
    let mut random = stream(description.seed, ROUGHNESS_STREAM);
    let (lowest, highest) = BAND_PER_M;
    let level = description.level_m3() * REFERENCE_PER_M * REFERENCE_PER_M;
    let above = |frequency: f64| (frequency / highest).min(1.0).acos() / frequency;
    // Equal steps of the logarithm, then of the arc cosine, where the variance density is singular.
    let lower = |u: f64| lowest * (UPPER_OCTAVE_PER_M / lowest).powf(u);
    let upper_angle = (UPPER_OCTAVE_PER_M / highest).acos();
    let upper = |u: f64| highest * (upper_angle * (1.0 - u)).cos();
    let mut waves = Vec::with_capacity(LOWER_WAVES + UPPER_WAVES);
    let mut fill = |count: usize, frequency: &dyn Fn(f64) -> f64| {
        for index in 0..count {
            let at = |fraction: f64| frequency((index as f64 + fraction) / count as f64);
            let variance = level * (above(at(0.0)) - above(at(1.0)));
            let nu = at(random.random::<f64>());
            let contact = average_of_wave(nu * description.contact_length_m);
            let amplitude = (2.0 * variance).sqrt() * contact;
            waves.push(Wave::random(&mut random, nu, amplitude));
        }
    };
    fill(LOWER_WAVES, &lower);
    fill(UPPER_WAVES, &upper);
    waves
}

/// The waves of an undulation: equal heights, wavelengths spread evenly on a logarithmic scale.
pub(super) fn undulation(description: &Undulation) -> Vec<Wave> {
    let mut random = stream(description.seed, UNDULATION_STREAM);
    let amplitude = description.height_rms_m * (2.0 / LONG_WAVES as f64).sqrt();
    let ratio = description.longest_m / description.shortest_m;
    (0..LONG_WAVES)
        .map(|index| {
            let u = (index as f64 + random.random::<f64>()) / LONG_WAVES as f64;
            let length = description.shortest_m * ratio.powf(u);
            Wave::random(&mut random, 1.0 / length, amplitude)
        })
        .collect()
}

fn stream(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(stream);
    random
}

/// What is left of a wave averaged over `cycles` of it.
fn average_of_wave(cycles: f64) -> f64 {
    let angle = PI * cycles;
    if angle == 0.0 {
        1.0
    } else {
        angle.sin() / angle
    }
}
