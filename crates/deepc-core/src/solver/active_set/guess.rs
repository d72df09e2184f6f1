//! Multipliers that come from elsewhere.

use super::bounds::RowState;
use super::dual::{Dual, Insertion};

impl Dual {
    /// Starts from the rows that push according to `multipliers`.
    pub fn guess(&mut self, multipliers: &[f64]) {
        self.clear();
        for (i, &multiplier) in multipliers.iter().enumerate() {
            if multiplier == 0.0 {
                continue;
            }
            self.multipliers[i] = multiplier;
            self.states[i] = self.rows[i].state_of(multiplier);
            if matches!(self.states[i], RowState::Capped(_)) {
                self.capped.push(i);
            } else if self.insert(i) == Insertion::Dependent {
                self.drop_row(i);
            }
        }
        self.start();
    }

    /// Takes `multipliers` as they are, for a verdict on them.
    pub fn take(&mut self, multipliers: &[f64]) {
        self.clear();
        self.pushing.clear();
        let pushing = multipliers.iter().copied().enumerate();
        self.pushing
            .extend(pushing.filter(|(_, multiplier)| *multiplier != 0.0));
        self.values.copy_from_slice(&self.unconstrained);
        self.constant.gram.subtract(&mut self.values, &self.pushing);
    }

    /// Hands out the multipliers and values found.
    pub fn give(&self, multipliers: &mut [f64], values: &mut [f64]) {
        multipliers.fill(0.0);
        for &(i, multiplier) in &self.pushing {
            multipliers[i] = multiplier;
        }
        values.copy_from_slice(&self.values);
    }

    /// `out = −Gδ`.
    pub fn gram_product(&mut self, out: &mut [f64], change: &[f64]) {
        self.pushing.clear();
        let terms = change.iter().copied().enumerate();
        self.pushing
            .extend(terms.filter(|(_, value)| *value != 0.0));
        out.fill(0.0);
        self.constant.gram.subtract(out, &self.pushing);
    }
}
