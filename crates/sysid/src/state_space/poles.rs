//! Poles: where they are, what they mean in time, and whether the model is stable.

use std::f64::consts::TAU;
use std::fmt;

use deepc_core::faer::{MatRef, c64};
use serde::Serialize;

use super::StateSpace;
use crate::error::SysidError;

/// What one pole z means in time, through s = ln(z)/Ts. A pole at 0 has an infinite frequency and
/// a time constant of 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mode {
    /// Real part of z.
    pub real: f64,
    /// Imaginary part of z.
    pub imaginary: f64,
    /// |z|.
    pub magnitude: f64,
    /// |s| / 2π in Hz.
    pub natural_frequency_hz: f64,
    /// −Re s / |s|: 1 does not oscillate, below 0 grows. 1 for an integrator (s = 0).
    pub damping: f64,
    /// −1 / Re s in seconds: infinite on the unit circle, negative outside of it.
    pub time_constant_s: f64,
}

impl Mode {
    /// Of the pole z at a sample time in seconds.
    #[must_use]
    pub fn new(pole: c64, sample_time_s: f64) -> Self {
        let magnitude = pole.norm();
        // ln_1p keeps the digits of poles near 1.
        let rate = if magnitude > 0.5 && magnitude < 2.0 {
            let excess = (pole.re - 1.0) * (pole.re + 1.0) + pole.im * pole.im;
            0.5 * excess.ln_1p() / sample_time_s
        } else {
            magnitude.ln() / sample_time_s
        };
        let turn = pole.im.atan2(pole.re) / sample_time_s;
        let size = rate.hypot(turn);
        Self {
            real: pole.re,
            imaginary: pole.im,
            magnitude,
            natural_frequency_hz: size / TAU,
            damping: if size == 0.0 || size.is_infinite() {
                1.0
            } else {
                -rate / size
            },
            time_constant_s: if rate == 0.0 {
                f64::INFINITY
            } else {
                -1.0 / rate
            },
        }
    }
}

impl fmt::Display for Mode {
    /// A row of a table: pole, frequency, damping, time constant.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sign = if self.imaginary < 0.0 { '-' } else { '+' };
        write!(
            f,
            "{:>9.6} {sign} {:.6}i   |z| {:.6}   {:.4} Hz   damping {:>7.4}   time constant {:.4} s",
            self.real,
            self.imaginary.abs(),
            self.magnitude,
            self.natural_frequency_hz,
            self.damping,
            self.time_constant_s
        )
    }
}

impl StateSpace {
    /// The n eigenvalues of A, largest magnitude first; of a pair the one above the real axis first.
    ///
    /// # Errors
    /// The eigenvalue iteration does not converge.
    pub fn poles(&self) -> Result<Vec<c64>, SysidError> {
        eigenvalues(self.matrices.a.as_ref())
    }

    /// Frequency, damping and time constant of every pole, in the order of [`poles`](Self::poles).
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn modes(&self) -> Result<Vec<Mode>, SysidError> {
        let poles = self.poles()?.into_iter();
        Ok(poles.map(|z| Mode::new(z, self.sample_time_s)).collect())
    }

    /// Largest magnitude of an eigenvalue of A; 0 for order 0.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn spectral_radius(&self) -> Result<f64, SysidError> {
        spectral_radius(self.matrices.a.as_ref())
    }

    /// Whether all poles lie within the unit circle.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn is_stable(&self) -> Result<bool, SysidError> {
        Ok(self.spectral_radius()? < 1.0)
    }

    /// Largest magnitude of an eigenvalue of A − K C: how fast the one-step predictor forgets its
    /// initial state.
    ///
    /// # Errors
    /// As [`poles`](Self::poles).
    pub fn predictor_radius(&self) -> Result<f64, SysidError> {
        spectral_radius(self.matrices.predictor().as_ref())
    }
}

/// Sorted eigenvalues of a real square matrix.
pub(crate) fn eigenvalues(matrix: MatRef<'_, f64>) -> Result<Vec<c64>, SysidError> {
    if matrix.nrows() == 0 {
        return Ok(Vec::new());
    }
    let mut values = matrix
        .eigenvalues()
        .map_err(|error| SysidError::Numerical {
            what: "the eigenvalue iteration",
            why: format!("{error:?} on a {0}×{0} matrix", matrix.nrows()),
        })?;
    sort(&mut values);
    Ok(values)
}

fn sort(values: &mut [c64]) {
    // Members of a pair differ by rounding only, so that they are told apart by their sign.
    let key = |z: &c64| (z.re.hypot(z.im.abs()), z.re, z.im);
    values.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        let by_size = b.0.total_cmp(&a.0);
        by_size.then(b.1.total_cmp(&a.1)).then(b.2.total_cmp(&a.2))
    });
}

/// Largest magnitude of an eigenvalue.
pub(crate) fn spectral_radius(matrix: MatRef<'_, f64>) -> Result<f64, SysidError> {
    let poles = eigenvalues(matrix)?;
    Ok(poles.iter().map(|z| z.norm()).fold(0.0, f64::max))
}
