//! What the model does to its inputs: over frequency, at rest, after an impulse.

use std::f64::consts::TAU;

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, c64};

use super::StateSpace;
use crate::error::SysidError;

/// A pole this near to 1 is an integrator: no recording is long enough to tell them apart.
const INTEGRATOR_DISTANCE: f64 = 1e-10;

impl StateSpace {
    /// G(z) = D + C (zI − A)⁻¹ B at z = exp(j 2π f Ts), p×M for every frequency f in Hz, in units
    /// of the outputs per unit of the inputs. Phases refer to the samples' numbers: y(k) is
    /// measured Ts after u(k) began to act.
    ///
    /// # Errors
    /// A frequency is not within 0 to 1/(2 Ts), or the model has a pole on the unit circle just
    /// there.
    pub fn frequency_response(&self, frequencies_hz: &[f64]) -> Result<Vec<Mat<c64>>, SysidError> {
        let limit = 0.5 / self.sample_time_s;
        let at = |&frequency: &f64| {
            // Rounding may put the last point of a grid just above the limit.
            if !(frequency >= 0.0 && frequency <= limit * (1.0 + 1e-12)) {
                return Err(SysidError::Frequency {
                    found_hz: frequency,
                    largest_hz: limit,
                });
            }
            let angle = TAU * frequency * self.sample_time_s;
            self.transfer(c64::new(angle.cos(), angle.sin()))
                .ok_or_else(|| SysidError::Numerical {
                    what: "the frequency response",
                    why: format!("a pole lies on the unit circle at {frequency} Hz"),
                })
        };
        frequencies_hz.iter().map(at).collect()
    }

    /// D + C (zI − A)⁻¹ B; none at a pole.
    fn transfer(&self, z: c64) -> Option<Mat<c64>> {
        let (system, n) = (&self.matrices, self.order());
        let complex = |value: f64| c64::new(value, 0.0);
        let shifted = Mat::from_fn(n, n, |i, j| {
            let diagonal = if i == j { z } else { complex(0.0) };
            diagonal - complex(system.a[(i, j)])
        });
        let driven = Mat::from_fn(n, system.inputs(), |i, j| complex(system.b[(i, j)]));
        let states = if n == 0 {
            driven
        } else {
            shifted.partial_piv_lu().solve(&driven)
        };
        let response = Mat::from_fn(system.outputs(), system.inputs(), |i, j| {
            let through = (0..n).map(|s| states[(s, j)] * system.c[(i, s)]);
            through.fold(complex(system.d[(i, j)]), |sum, term| sum + term)
        });
        let finite = (0..response.ncols()).all(|j| response.col(j).iter().all(|v| v.is_finite()));
        finite.then_some(response)
    }

    /// Steady-state gain D + C (I − A)⁻¹ B, p×M: what each output settles at per unit of each
    /// input. For a stable model.
    ///
    /// # Errors
    /// A pole at 1: the output runs away and there is no such gain.
    pub fn steady_state_gain(&self) -> Result<Mat<f64>, SysidError> {
        let (system, n) = (&self.matrices, self.order());
        if n == 0 {
            return Ok(system.d.clone());
        }
        let near_one = |z: &c64| (z - c64::new(1.0, 0.0)).norm();
        let distance = self.poles()?.iter().map(near_one).fold(1.0, f64::min);
        let shifted = Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - system.a[(i, j)]);
        let gain = &system.d + &system.c * shifted.full_piv_lu().solve(&system.b);
        let finite = (0..gain.ncols()).all(|j| gain.col(j).iter().all(|v| v.is_finite()));
        if distance <= INTEGRATOR_DISTANCE || !finite {
            return Err(SysidError::Integrator { distance });
        }
        Ok(gain)
    }

    /// Markov parameters h(0) = D, h(k) = C A^(k−1) B for k = 0..=`last`, each p×M.
    #[must_use]
    pub fn markov_parameters(&self, last: usize) -> Vec<Mat<f64>> {
        let mut parameters = vec![self.matrices.d.clone()];
        let mut driven = self.matrices.b.clone();
        for _ in 0..last {
            parameters.push(&self.matrices.c * &driven);
            driven = &self.matrices.a * &driven;
        }
        parameters
    }

    /// Step responses s(k) = h(0) + … + h(k) for k = 0..=`last`, each p×M: the outputs' deviations
    /// after each input alone has gone up by 1 at k = 0.
    #[must_use]
    pub fn step_response(&self, last: usize) -> Vec<Mat<f64>> {
        let mut sum = Mat::zeros(self.outputs.len(), self.matrices.inputs());
        let impulses = self.markov_parameters(last).into_iter();
        let sums = impulses.map(|impulse| {
            sum += &impulse;
            sum.clone()
        });
        sums.collect()
    }
}
