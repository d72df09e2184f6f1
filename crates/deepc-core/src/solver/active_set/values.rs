//! The values of all rows at the present multipliers, and which rows they contradict.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use pulp::NullaryFnOnce;

use super::bounds::RowState;
use super::dual::Dual;
use crate::columns::{position_of_largest, widely};

/// Rounding a value may have, relative to the numbers it is made of.
const ROUNDING: f64 = 1e-12;

/// Residual, relative to the multipliers, above which a solution of the factored system is
/// refined.
const REFINE: f64 = 1e-14;

/// Residual after refinement above which the factor is computed afresh.
const STALE: f64 = 1e-11;

/// A violation in a row's own units that need not be corrected, relative to max(1, its value).
const NEGLIGIBLE: f64 = 1e-10;

impl Dual {
    /// v at the present multipliers, which solve the factored system: they are refined if the
    /// values show that they could solve it better.
    pub fn evaluate(&mut self) {
        self.compute_values();
        self.refine();
    }

    /// The same where the values have been computed.
    pub fn refine(&mut self) {
        if self.residual_of_factored() <= REFINE * self.size() {
            return;
        }
        self.correct();
        if self.residual_of_factored() > STALE * self.size() {
            std::mem::swap(&mut self.factored, &mut self.order);
            self.refactor();
            self.residual_of_factored();
            self.correct();
        }
    }

    pub fn compute_values(&mut self) {
        self.pushing.clear();
        for &i in self
            .factored
            .iter()
            .chain(&self.capped)
            .chain(&self.pending)
        {
            self.pushing.push((i, self.multipliers[i]));
        }
        if self.origin {
            self.values.fill(0.0);
        } else {
            self.values.copy_from_slice(&self.unconstrained);
        }
        self.constant.gram.subtract(&mut self.values, &self.pushing);
    }

    /// The residual of the factored system into `correction`; its largest entry.
    fn residual_of_factored(&mut self) -> f64 {
        let mut largest: f64 = 0.0;
        for (residual, &i) in self.correction.iter_mut().zip(&self.factored) {
            let (row, state) = (&self.rows[i], self.states[i]);
            let demanded = row.target(state) + row.price.diagonal(state) * self.multipliers[i];
            *residual = self.values[i] - demanded;
            largest = largest.max(residual.abs());
        }
        largest
    }

    /// What the factored multipliers lack for their rows to meet their demands at the present
    /// values, into `terms`.
    pub fn solve_for_correction(&mut self) {
        self.residual_of_factored();
        let correction = &mut self.correction[..self.factored.len()];
        self.factor.solve(correction);
        self.terms.clear();
        let correction = correction.iter().copied();
        self.terms
            .extend(self.factored.iter().copied().zip(correction));
    }

    fn correct(&mut self) {
        let correction = &mut self.correction[..self.factored.len()];
        self.factor.solve(correction);
        for (correction, &i) in correction.iter().zip(&self.factored) {
            let (low, high) = self.rows[i].interval(self.states[i]);
            self.multipliers[i] = (self.multipliers[i] + correction).max(low).min(high);
        }
        self.compute_values();
    }

    /// The largest number the values are made of.
    pub fn size(&self) -> f64 {
        let multipliers = self.pushing.iter().map(|&(_, multiplier)| multiplier);
        let largest = multipliers.fold(0.0, |max: f64, value| max.max(value.abs()));
        if self.origin {
            return largest;
        }
        self.unconstrained
            .iter()
            .fold(largest, |max, c| max.max(c.abs()))
    }

    /// D(μ) at the present multipliers and values.
    pub fn objective(&self) -> f64 {
        let terms = self.pushing.iter().map(|&(i, multiplier)| {
            self.rows[i].dual_cost(multiplier)
                - 0.5 * multiplier * (self.unconstrained[i] + self.values[i])
        });
        terms.sum()
    }

    /// Fills `excess`: by how much the values contradict the states.
    pub fn measure_excess(&mut self) {
        let size = self.size();
        widely(Excess {
            out: &mut self.excess,
            values: &self.values,
            lowers: &self.lowers,
            uppers: &self.uppers,
            units: &self.constant.reciprocals,
            size,
        });
        for &i in &self.factored {
            self.excess[i] = 0.0;
        }
        for &i in &self.capped {
            let RowState::Capped(side) = self.states[i] else {
                continue;
            };
            let value = self.values[i];
            let room = side.sign() * (self.rows[i].bound(side) - value);
            let allowed = tolerance(size, value, self.constant.reciprocals[i]);
            self.excess[i] = if room > allowed { room } else { 0.0 };
        }
    }

    /// The row of the largest excess, if any has one.
    pub fn worst(&self) -> Option<usize> {
        position_of_largest(&self.excess)
    }
}

/// How far every value is beyond its bounds, if that is more than rounding.
struct Excess<'a> {
    out: &'a mut [f64],
    values: &'a [f64],
    lowers: &'a [f64],
    uppers: &'a [f64],
    units: &'a [f64],
    size: f64,
}

impl NullaryFnOnce for Excess<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let bounds = self.lowers.iter().zip(self.uppers);
        let rows = self.values.iter().zip(bounds).zip(self.units);
        for (excess, ((&value, (&lower, &upper)), &unit)) in self.out.iter_mut().zip(rows) {
            let (above, below) = (value - upper, lower - value);
            let violation = if above > below { above } else { below };
            let allowed = tolerance(self.size, value, unit);
            *excess = if violation > allowed { violation } else { 0.0 };
        }
    }
}

/// What an excess may be rounding or negligible. `size` is that of the numbers the value is made
/// of, `unit` is 1 in the row's own units.
#[inline(always)]
fn tolerance(size: f64, value: f64, unit: f64) -> f64 {
    let size = size + value.abs();
    let (most, least) = (ROUNDING * size, 0.01 * ROUNDING * size);
    let negligible = NEGLIGIBLE * (unit + value.abs());
    // Clamped without a look for NaN, which has no excess anyway.
    if negligible < least {
        least
    } else if negligible > most {
        most
    } else {
        negligible
    }
}
