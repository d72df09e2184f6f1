//! A plant with any number of inputs and outputs: well-damped oscillators with a little that no
//! linear model explains.

use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Where the second input stands: a speed beside an angle, say.
pub const OFFSET: f64 = 100.0;

/// Standard deviation of the measurement noise.
const NOISE: f64 = 1e-3;

/// One oscillator per output, driven by all inputs. The static gain from the first input to the
/// first output is 0.04, the natural period about 64 samples.
#[derive(Debug, Clone)]
pub struct Plant {
    inputs: usize,
    /// Present and previous value of every output.
    states: Vec<[f64; 2]>,
    rng: ChaCha8Rng,
}

impl Plant {
    /// y(k) = 1.93 y(k−1) − 0.94 y(k−2) + what the inputs drive.
    pub const MEMORY: [f64; 2] = [1.93, -0.94];

    /// What a unit of input `j` drives in output `i` within a sample, at rest.
    #[must_use]
    pub fn gain(i: usize, j: usize) -> f64 {
        if j == 1 {
            1e-5
        } else {
            4e-4 * ((i + j) as f64).cos()
        }
    }

    /// At rest.
    #[must_use]
    pub fn new(inputs: usize, outputs: usize, seed: u64) -> Self {
        Self {
            inputs,
            states: vec![[0.0; 2]; outputs],
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    /// Where an input stands when nothing is asked of it.
    #[must_use]
    pub fn rest(input: usize) -> f64 {
        if input == 1 { OFFSET } else { 0.0 }
    }

    /// One sample: takes an input (m), writes the measured output (p).
    pub fn step(&mut self, input: &[f64], output: &mut [f64]) {
        // The second input changes what the others do, as a speed does.
        let factor = input.get(1).map_or(1.0, |speed| speed / OFFSET);
        for (i, measured) in output.iter_mut().enumerate() {
            let mut drive = 0.0;
            for (j, value) in input.iter().enumerate() {
                drive += Self::gain(i, j) * factor * (value - Self::rest(j));
            }
            let noise = NOISE * self.normal();
            let [present, previous] = self.states[i];
            let [recent, before] = Self::MEMORY;
            let next = recent * present + before * previous + drive;
            self.states[i] = [next, present];
            *measured = next + noise;
        }
    }

    /// Shakes all inputs for `samples` samples: slow noise plus white noise. Returns inputs
    /// (T×m) and outputs (T×p).
    pub fn record(&mut self, samples: usize) -> (Mat<f64>, Mat<f64>) {
        let outputs = self.states.len();
        let mut slow = vec![0.0; self.inputs];
        let (mut input, mut output) = (vec![0.0; self.inputs], vec![0.0; outputs]);
        let mut recorded = (
            Mat::zeros(samples, self.inputs),
            Mat::zeros(samples, outputs),
        );
        for k in 0..samples {
            for j in 0..self.inputs {
                slow[j] = 0.99 * slow[j] + 5.0 * self.normal();
                let white = self.normal();
                input[j] = if j == 1 {
                    OFFSET + white
                } else {
                    slow[j] + 5.0 * white
                };
                recorded.0[(k, j)] = input[j];
            }
            self.step(&input, &mut output);
            for (i, value) in output.iter().enumerate() {
                recorded.1[(k, i)] = *value;
            }
        }
        recorded
    }
}
