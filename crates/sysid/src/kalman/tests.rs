//! Against the equation, a slow second implementation, and everything that can be wrong.

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, Scale, mat};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::*;

struct Problem {
    a: Mat<f64>,
    c: Mat<f64>,
    q: Mat<f64>,
    r: Mat<f64>,
    s: Mat<f64>,
}

impl Problem {
    /// Joint covariance F Fᵀ with `rank` columns; A with the spectral radius given.
    fn random(seed: u64, n: usize, p: usize, rank: usize, radius: f64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |rows, columns| -> Mat<f64> {
            Mat::from_fn(rows, columns, |_, _| rng.sample(StandardNormal))
        };
        let raw = draw(n, n);
        let a = &raw * Scale(radius / spectral_radius(raw.as_ref()));
        let c = draw(p, n);
        let root = draw(n + p, rank);
        let joint = &root * root.transpose();
        Self {
            a,
            c,
            q: joint.submatrix(0, 0, n, n).to_owned(),
            r: joint.submatrix(n, n, p, p).to_owned(),
            s: joint.submatrix(0, n, n, p).to_owned(),
        }
    }

    fn riccati(&self) -> Result<Riccati, SysidError> {
        let Self { a, c, q, r, s } = self;
        riccati(a.as_ref(), c.as_ref(), q.as_ref(), r.as_ref(), s.as_ref())
    }

    fn gain(&self) -> Result<InnovationGain, SysidError> {
        let Self { a, c, q, r, s } = self;
        innovation_gain(a.as_ref(), c.as_ref(), q.as_ref(), r.as_ref(), s.as_ref())
    }

    fn residual(&self, found: &Riccati) -> f64 {
        let Self { a, c, q, r, s } = self;
        residual(
            a.as_ref(),
            c.as_ref(),
            q.as_ref(),
            r.as_ref(),
            s.as_ref(),
            found,
        )
    }

    /// The filter's covariance recursion from a large start until it stands still.
    fn iterate(&self) -> Mat<f64> {
        let Self { a, c, q, r, s } = self;
        let mut p = Mat::<f64>::identity(a.nrows(), a.nrows()) * Scale(1e3);
        for _ in 0..100_000 {
            let innovation = c * &p * c.transpose() + r;
            let cross = a * &p * c.transpose() + s;
            let k = innovation.partial_piv_lu().solve(cross.transpose());
            let k = k.transpose();
            let f = a - k * c;
            let ks = k * s.transpose();
            let next = &f * &p * f.transpose() + q - &ks - ks.transpose() + k * r * k.transpose();
            let change = (&next - &p).norm_max();
            p = symmetric_part(next.as_ref());
            if change < 1e-15 * p.norm_max() {
                break;
            }
        }
        p
    }
}

#[test]
fn doubling_solves_the_equation_as_the_recursion_does() {
    for (seed, n, p, radius) in [
        (1, 1, 1, 0.5),
        (2, 4, 1, 0.95),
        (3, 4, 2, 0.99),
        (4, 6, 3, 1.2),
        (5, 9, 2, 1.5),
        (6, 12, 4, 0.9),
    ] {
        let problem = Problem::random(seed, n, p, n + p + 2, radius);
        let found = problem.riccati().unwrap();
        assert!(problem.residual(&found) < 1e-11, "{seed}");
        assert!(found.radius < 1.0, "{seed}");
        let expected = problem.iterate();
        let apart = (&found.solution - &expected).norm_max() / expected.norm_max();
        assert!(apart < 1e-9, "{seed}: {apart:e}");
    }
}

/// a² p r/(p + r) + q = p for one state without cross covariance.
#[test]
fn a_scalar_equation_has_the_known_root() {
    let (a, q, r) = (0.9_f64, 0.3, 2.0);
    let problem = Problem {
        a: mat![[a]],
        c: mat![[1.0]],
        q: mat![[q]],
        r: mat![[r]],
        s: mat![[0.0]],
    };
    let half = f64::midpoint(q, r * (a * a - 1.0));
    let p = half + (half * half + q * r).sqrt();
    let found = problem.riccati().unwrap();
    assert!((found.solution[(0, 0)] - p).abs() < 1e-14);
    assert!((found.gain[(0, 0)] - a * p / (p + r)).abs() < 1e-14);
    assert!((found.radius - a * r / (p + r)).abs() < 1e-14);
}

/// Noise that is already an innovation: P = 0 and the gain comes back.
#[test]
fn the_gain_of_an_innovation_form_comes_back() {
    let mut problem = Problem::random(7, 4, 2, 6, 0.9);
    let k = Mat::from_fn(4, 2, |i, j| 0.1 * ((i + 3 * j) as f64).cos());
    let r = mat![[2.0, 0.3], [0.3, 1.0]];
    problem.q = &k * &r * k.transpose();
    problem.s = &k * &r;
    problem.r = r.clone();
    assert!(spectral_radius((&problem.a - &k * &problem.c).as_ref()) < 1.0);
    let found = problem.gain().unwrap();
    assert_eq!(found.fallback, None);
    assert!((found.k - k).norm_max() < 1e-10);
    assert!((found.covariance - r).norm_max() < 1e-10);
}

/// An augmented plant: an integrator that is not driven by the rest, as an observer of constant
/// disturbances has it.
#[test]
fn an_integrating_disturbance_is_observed() {
    let problem = Problem {
        a: mat![[0.9, 0.1, 0.0], [0.0, 0.8, 1.0], [0.0, 0.0, 1.0]],
        c: mat![[1.0, 0.0, 0.0]],
        q: mat![[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e-4]],
        r: mat![[1.0]],
        s: Mat::zeros(3, 1),
    };
    let found = problem.riccati().unwrap();
    assert!(found.radius < 1.0 && problem.residual(&found) < 1e-10);
}

#[test]
fn a_gain_is_stable_whatever_the_covariances_are() {
    for seed in 0..60 {
        let (n, p) = (1 + (seed % 7) as usize, 1 + (seed % 3) as usize);
        let radius = 0.5 + 0.02 * seed as f64;
        // Full rank, of innovation rank, and too little of it.
        for rank in [n + p, p, 1] {
            let mut problem = Problem::random(seed, n, p, rank, radius);
            let found = problem.gain().unwrap();
            assert!(found.radius < 1.0, "{seed} {rank}: {}", found.radius);
            // An indefinite joint covariance: twice the correlation.
            problem.s *= Scale(2.0);
            let found = problem.gain().unwrap();
            assert!(found.radius < 1.0, "{seed} {rank}: {}", found.radius);
            let closed = spectral_radius((&problem.a - &found.k * &problem.c).as_ref());
            assert!(closed < 1.0, "{seed} {rank}: {closed}");
        }
    }
}

#[test]
fn the_fallback_says_what_was_done() {
    let mut problem = Problem::random(8, 3, 2, 7, 0.9);
    assert_eq!(problem.gain().unwrap().fallback, None);
    // The second output repeats the first: R is singular.
    let r = problem.r[(0, 0)];
    problem.r = mat![[r, r], [r, r]];
    for i in 0..3 {
        problem.s[(i, 1)] = problem.s[(i, 0)];
    }
    let found = problem.gain().unwrap();
    assert_eq!(found.fallback, Some(GainFallback::Regularised));
    let [q, r, s] = [(3, 3), (2, 2), (3, 2)].map(|(rows, columns)| Mat::zeros(rows, columns));
    let silent = Problem {
        q,
        r,
        s,
        a: problem.a.clone(),
        c: problem.c.clone(),
    };
    let found = silent.gain().unwrap();
    assert_eq!(found.fallback, Some(GainFallback::NoNoise));
    assert!(found.k.norm_max() == 0.0 && found.radius < 0.901);
    let unstable = Problem {
        a: &silent.a * Scale(1.3),
        ..silent
    };
    let found = unstable.gain().unwrap();
    assert_eq!(found.fallback, Some(GainFallback::UnitNoise));
    assert!(found.radius < 1.0);
    let unseen = Problem {
        c: Mat::zeros(2, 3),
        ..unstable
    };
    let error = unseen.gain().unwrap_err();
    assert!(matches!(error, SysidError::Unstable { .. }), "{error}");
}

#[test]
fn what_is_not_finite_is_no_covariance() {
    let mut problem = Problem::random(9, 3, 2, 7, 0.9);
    problem.q[(1, 1)] = f64::NAN;
    let found = problem.gain().unwrap();
    assert_eq!(found.fallback, Some(GainFallback::Zero));
    assert!(problem.riccati().is_err());
}
