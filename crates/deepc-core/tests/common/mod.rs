//! Plants and data the tests share.
#![allow(dead_code)]

use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons, PersistentlyExciting};
use deepc_core::program::{Plan, PredictiveProgram};
use faer::{Col, Mat};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// x(k+1) = A x + B u, y = C x + D u.
#[derive(Debug, Clone)]
pub struct Lti {
    pub a: Mat<f64>,
    pub b: Mat<f64>,
    pub c: Mat<f64>,
    pub d: Mat<f64>,
}

impl Lti {
    /// A random system with the spectral radius of A about `radius`.
    pub fn random(n: usize, m: usize, p: usize, radius: f64, seed: u64) -> Self {
        let mut rng = rng(seed);
        let mut a = gaussian(n, n, &mut rng);
        let eigenvalues = a.eigenvalues().expect("a small matrix has eigenvalues");
        let size = eigenvalues
            .iter()
            .map(|l| l.re.hypot(l.im))
            .fold(0.0, f64::max);
        a *= faer::Scale(radius / size);
        Self {
            a,
            b: gaussian(n, m, &mut rng),
            c: gaussian(p, n, &mut rng),
            d: gaussian(p, m, &mut rng),
        }
    }

    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Response (T×p) to inputs (T×m) from the state `x`, which is left at its end.
    pub fn simulate(&self, x: &mut Col<f64>, inputs: &Mat<f64>) -> Mat<f64> {
        let mut outputs = Mat::zeros(inputs.nrows(), self.c.nrows());
        for k in 0..inputs.nrows() {
            let u = inputs.row(k).transpose().to_owned();
            let y = &self.c * &*x + &self.d * &u;
            for i in 0..y.nrows() {
                outputs[(k, i)] = y[i];
            }
            *x = &self.a * &*x + &self.b * &u;
        }
        outputs
    }
}

pub fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn gaussian(rows: usize, columns: usize, rng: &mut impl Rng) -> Mat<f64> {
    Mat::from_fn(rows, columns, |_, _| rng.sample(StandardNormal))
}

/// White-noise inputs and the response to them, from a random state.
pub fn record(system: &Lti, samples: usize, noise: f64, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let mut rng = rng(seed ^ 0x5eed);
    let inputs = gaussian(samples, system.b.ncols(), &mut rng);
    let mut x = Col::from_fn(system.order(), |_| rng.sample(StandardNormal));
    let mut outputs = system.simulate(&mut x, &inputs);
    outputs += faer::Scale(noise) * gaussian(samples, system.c.nrows(), &mut rng);
    (inputs, outputs)
}

pub fn names(prefix: &str, count: usize) -> Vec<String> {
    (1..=count).map(|i| format!("{prefix}{i}")).collect()
}

pub fn dataset(records: Vec<(Mat<f64>, Mat<f64>)>) -> Dataset {
    let (m, p) = (records[0].0.ncols(), records[0].1.ncols());
    let mut data = Dataset::new(0.1, names("u", m), names("y", p)).unwrap();
    for (inputs, outputs) in records {
        data.push_record(inputs, outputs).unwrap();
    }
    data
}

pub fn exciting(data: &Dataset, past: usize, future: usize, order: usize) -> PersistentlyExciting {
    let hankel = HankelMatrix::build(data, Horizons { past, future }).unwrap();
    hankel.require_persistently_exciting(order).unwrap()
}

pub fn largest_difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (a - b).norm_max()
}

/// A recording of the size of the original study: two inputs, one output, T = 3200. The first
/// input is coloured noise, the second stands at an offset of 100 with a little noise; the
/// output is a damped oscillator's, with a bilinear term that no linear model explains and
/// measurement noise.
pub fn coloured_recording(samples: usize, seed: u64) -> (Mat<f64>, Mat<f64>) {
    let mut rng = rng(seed);
    let mut normal = || -> f64 { rng.sample(StandardNormal) };
    let (mut slow, mut position, mut velocity) = (0.0, 0.0, 0.0);
    let mut inputs = Mat::zeros(samples, 2);
    let mut outputs = Mat::zeros(samples, 1);
    for k in 0..samples {
        slow = 0.98 * slow + 0.2 * normal();
        let (first, second) = (10.0 * slow + normal(), 100.0 + 0.5 * normal());
        inputs[(k, 0)] = first;
        inputs[(k, 1)] = second;
        let push = 0.004 * first * (second / 100.0).powi(2) + 1e-4 * (second - 100.0);
        velocity += 0.1 * (push * 10.0 - 1.0 * position - 0.4 * velocity);
        position += 0.1 * velocity;
        outputs[(k, 0)] = position + 1e-3 * normal();
    }
    (inputs, outputs)
}

/// A plan with its objective.
#[derive(Debug, Clone)]
pub struct Solved {
    plan: Plan,
    pub objective: f64,
}

impl Solved {
    /// The present plan of a program; NaN if it is not usable.
    pub fn of(program: &dyn PredictiveProgram) -> Self {
        Self {
            plan: program.plan().clone(),
            objective: program.objective().unwrap_or(f64::NAN),
        }
    }
}

impl std::ops::Deref for Solved {
    type Target = Plan;

    fn deref(&self) -> &Plan {
        &self.plan
    }
}
