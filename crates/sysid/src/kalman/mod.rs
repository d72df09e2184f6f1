//! The discrete Riccati equation of the Kalman filter, and an innovation gain that is always
//! stable.

use std::fmt;

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, MatRef, Side};
use serde::{Deserialize, Serialize};

use crate::dense::symmetric_part;
use crate::error::SysidError;
use crate::stability::spectral_radius;

/// Output noise below this variance is rounding, for outputs of size 1. (A file with ten digits
/// has 1e-21.)
const NOISE_FLOOR: f64 = 1e-20;

/// Doubling steps; each squares what is left, so that 60 reach any closed loop that is stable in
/// floating point.
const DOUBLINGS: usize = 60;

/// Largest relative residual of a solution that is used.
const RESIDUAL_LIMIT: f64 = 1e-7;

/// A joint covariance with an eigenvalue below minus this fraction of its largest is indefinite.
const DEFINITE_TOLERANCE: f64 = 1e-12;

/// What regularisation adds to every variance, relative to the mean of its kind.
const REGULARISATION: f64 = 1e-8;

/// Stabilising solution of `P = A P Aᵀ + Q − K (C P Cᵀ + R) Kᵀ`.
#[derive(Debug, Clone)]
pub(crate) struct Riccati {
    /// P, n×n: covariance of the one-step prediction error of the state.
    pub solution: Mat<f64>,
    /// `K = (A P Cᵀ + S)(C P Cᵀ + R)⁻¹`, n×p, of the predictor x(k+1) = A x(k) + K e(k).
    pub gain: Mat<f64>,
    /// `C P Cᵀ + R`, p×p.
    pub innovation: Mat<f64>,
    /// Spectral radius of A − KC.
    pub radius: f64,
}

/// Solves the Riccati equation of the one-step predictor by structure-preserving doubling (Chu,
/// Fan, Lin, Wang 2004) after the cross covariance was eliminated.
///
/// `a` n×n, `c` p×n, `q` n×n, `r` p×p, positive definite, `s` n×p, with `[q s; sᵀ r]` positive
/// semidefinite.
///
/// # Errors
/// [`SysidError::Numerical`]: `r` is singular, there is no stabilising solution, or it is not
/// accurate.
pub(crate) fn riccati(
    a: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    r: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
) -> Result<Riccati, SysidError> {
    let failed = |why: String| SysidError::Numerical {
        what: "the Riccati equation",
        why,
    };
    let n = a.nrows();
    let root = r.llt(Side::Lower).map_err(|_| {
        failed("the covariance of the output noise is not positive definite".into())
    })?;
    // R⁻¹C, R⁻¹Sᵀ; then Ã = A − S R⁻¹ C and Q̃ = Q − S R⁻¹ Sᵀ.
    let (over_c, over_s) = (root.solve(c), root.solve(s.transpose()));
    let mut g = symmetric_part((c.transpose() * &over_c).as_ref());
    let mut h = symmetric_part((q - s * &over_s).as_ref());
    let mut f = (a - s * &over_c).transpose().to_owned();
    let identity = Mat::<f64>::identity(n, n);
    let mut settled = false;
    for _ in 0..DOUBLINGS {
        let lu = (&identity + &g * &h).partial_piv_lu();
        let (forward, spread) = (lu.solve(&f), lu.solve(&g));
        let grown = &f * &spread * f.transpose();
        let step = f.transpose() * &h * &forward;
        f = &f * &forward;
        g = symmetric_part((&g + &grown).as_ref());
        let larger = symmetric_part((&h + &step).as_ref());
        if !(larger.is_all_finite() && f.is_all_finite() && g.is_all_finite()) {
            break;
        }
        settled = step.norm_max() <= 1e-15 * larger.norm_max();
        h = larger;
        if settled {
            break;
        }
    }
    if !settled {
        return Err(failed(format!(
            "doubling did not settle within {DOUBLINGS} steps; the pair may not be stabilisable"
        )));
    }
    let riccati = predictor(a, c, r, s, h)?;
    let residual = residual(a, c, q, r, s, &riccati);
    if !(riccati.radius < 1.0 && residual <= RESIDUAL_LIMIT) {
        return Err(failed(format!(
            "the solution has relative residual {residual:.1e} (limit {RESIDUAL_LIMIT:.0e}) and \
             A − KC spectral radius {:.6}",
            riccati.radius
        )));
    }
    Ok(riccati)
}

/// Gain and innovation covariance for P.
fn predictor(
    a: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    r: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    solution: Mat<f64>,
) -> Result<Riccati, SysidError> {
    let innovation = symmetric_part((c * &solution * c.transpose() + r).as_ref());
    let root = innovation
        .llt(Side::Lower)
        .map_err(|_| SysidError::Numerical {
            what: "the Kalman gain",
            why: "the covariance of the innovation is not positive definite".into(),
        })?;
    let cross = a * &solution * c.transpose() + s;
    let gain = root.solve(cross.transpose()).transpose().to_owned();
    let radius = spectral_radius((a - &gain * c).as_ref());
    Ok(Riccati {
        solution,
        gain,
        innovation,
        radius,
    })
}

/// Of the equation in the form that is positive semidefinite term by term (Joseph), relative to P.
pub(crate) fn residual(
    a: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    r: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
    riccati: &Riccati,
) -> f64 {
    let (p, k) = (&riccati.solution, &riccati.gain);
    let loop_ = a - k * c;
    let cross = k * s.transpose();
    let again =
        &loop_ * p * loop_.transpose() + q - &cross - cross.transpose() + k * r * k.transpose();
    let size = p.norm_max().max(q.norm_max());
    if size == 0.0 {
        return 0.0;
    }
    (again - p).norm_max() / size
}

/// Why an innovation gain is not the one of the estimated covariances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GainFallback {
    /// The outputs are explained to rounding: K = 0.
    NoNoise,
    /// The covariances were made definite by adding 1e-8 of their mean variances.
    Regularised,
    /// The covariance between state and output noise was dropped as well.
    WithoutCrossCovariance,
    /// No Riccati equation was solvable, and A is stable: K = 0.
    Zero,
    /// A is not stable: K is that of white unit noise on all states and outputs.
    UnitNoise,
}

impl fmt::Display for GainFallback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoNoise => "no noise to filter, the gain is zero",
            Self::Regularised => "gain of slightly enlarged noise covariances",
            Self::WithoutCrossCovariance => "gain without correlation of state and output noise",
            Self::Zero => "no Riccati equation was solvable, the gain is zero",
            Self::UnitNoise => "the plant is not stable, gain for unit noise everywhere",
        })
    }
}

/// K of the innovation form.
#[derive(Debug, Clone)]
pub(crate) struct InnovationGain {
    /// K, n×p.
    pub k: Mat<f64>,
    /// Covariance of the innovation, p×p.
    pub covariance: Mat<f64>,
    /// Spectral radius of A − KC, below 1.
    pub radius: f64,
    /// Set if it is not the gain of the covariances given.
    pub fallback: Option<GainFallback>,
}

/// Innovation gain with a stable A − KC from estimated noise covariances, in units in which the
/// outputs have size 1. Shapes as for [`riccati`].
///
/// # Errors
/// [`SysidError::Unstable`]: A is not stable and an unstable mode is not seen by C.
pub(crate) fn innovation_gain(
    a: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    r: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
) -> Result<InnovationGain, SysidError> {
    let (n, p) = (a.nrows(), c.nrows());
    let found = |riccati: Riccati, fallback| InnovationGain {
        k: riccati.gain,
        covariance: riccati.innovation,
        radius: riccati.radius,
        fallback,
    };
    let open = spectral_radius(a);
    let zero = |fallback| InnovationGain {
        k: Mat::zeros(n, p),
        covariance: symmetric_part(r),
        radius: open,
        fallback: Some(fallback),
    };
    let usable = q.is_all_finite() && r.is_all_finite() && s.is_all_finite();
    if usable && trace(r) > NOISE_FLOOR * p as f64 {
        let (smallest, largest) = joint_eigenvalues(q, r, s)?;
        if smallest >= -DEFINITE_TOLERANCE * largest
            && let Ok(riccati) = riccati(a, c, q, r, s)
        {
            return Ok(found(riccati, None));
        }
        // Enough to lift the smallest eigenvalue above 0.
        let lift = (-2.0 * smallest).max(0.0);
        let add = |matrix: MatRef<'_, f64>| {
            let size = matrix.nrows();
            let more = REGULARISATION * trace(matrix).max(0.0) / size.max(1) as f64 + lift;
            matrix + Mat::<f64>::identity(size, size) * deepc_core::faer::Scale(more)
        };
        let (more_q, more_r) = (add(q), add(r));
        let none = Mat::zeros(n, p);
        for (cross, fallback) in [
            (s, GainFallback::Regularised),
            (none.as_ref(), GainFallback::WithoutCrossCovariance),
        ] {
            if let Ok(riccati) = riccati(a, c, more_q.as_ref(), more_r.as_ref(), cross) {
                return Ok(found(riccati, Some(fallback)));
            }
        }
        if open < 1.0 {
            return Ok(zero(GainFallback::Zero));
        }
    } else if open < 1.0 {
        return Ok(zero(if usable {
            GainFallback::NoNoise
        } else {
            GainFallback::Zero
        }));
    }
    let (unit_q, unit_r) = (Mat::identity(n, n), Mat::identity(p, p));
    let none = Mat::zeros(n, p);
    match riccati(a, c, unit_q.as_ref(), unit_r.as_ref(), none.as_ref()) {
        Ok(riccati) => Ok(InnovationGain {
            covariance: symmetric_part(r),
            ..found(riccati, Some(GainFallback::UnitNoise))
        }),
        Err(_) => Err(SysidError::Unstable {
            what: "the state matrix A, which no innovation gain stabilises,",
            radius: open,
            limit: 1.0,
            remedy: "lower the order or enforce stability",
        }),
    }
}

fn trace(matrix: MatRef<'_, f64>) -> f64 {
    (0..matrix.nrows()).map(|i| matrix[(i, i)]).sum()
}

/// Smallest and largest eigenvalue of `[q s; sᵀ r]`.
fn joint_eigenvalues(
    q: MatRef<'_, f64>,
    r: MatRef<'_, f64>,
    s: MatRef<'_, f64>,
) -> Result<(f64, f64), SysidError> {
    let n = q.nrows();
    let size = n + r.nrows();
    let joint = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
        (true, true) => f64::midpoint(q[(i, j)], q[(j, i)]),
        (false, false) => f64::midpoint(r[(i - n, j - n)], r[(j - n, i - n)]),
        (true, false) => s[(i, j - n)],
        (false, true) => s[(j, i - n)],
    });
    let eigenvalues =
        joint
            .self_adjoint_eigenvalues(Side::Lower)
            .map_err(|_| SysidError::Numerical {
                what: "the eigenvalues of the noise covariances",
                why: format!("no convergence for a {size}×{size} matrix"),
            })?;
    // In rising order.
    Ok((eigenvalues[0], eigenvalues[size - 1]))
}

#[cfg(test)]
mod tests;
