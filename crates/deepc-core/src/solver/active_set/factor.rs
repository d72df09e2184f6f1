//! A Cholesky factor that rows join and leave.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use pulp::Arch;

use super::columns::{add_scaled, dot};

/// L of a growing and shrinking matrix M = `LLᵀ`, k×k, with room for a capacity fixed at set-up.
///
/// Rows are packed one behind the other, so that joining, forward and back substitution run
/// along slices and cost k² operations each. The diagonal holds 1/Lᵢᵢ.
#[derive(Debug, Clone)]
pub(super) struct PackedCholesky {
    entries: Vec<f64>,
    size: usize,
    /// Of a leaving column, what the rows below keep.
    leaving: Vec<f64>,
    /// Cosine and sine of the rotations that take it up.
    rotations: Vec<(f64, f64)>,
}

/// Where row i begins.
fn start(i: usize) -> usize {
    i * (i + 1) / 2
}

impl PackedCholesky {
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            entries: vec![0.0; start(capacity)],
            size: 0,
            leaving: vec![0.0; capacity],
            rotations: vec![(1.0, 0.0); capacity],
        }
    }

    pub fn clear(&mut self) {
        self.size = 0;
    }

    /// Lays out the next row: `couplings` are its k entries of M beside the diagonal. Returns
    /// their share in the diagonal, ‖L⁻¹·couplings‖². The row counts only after
    /// [`Self::append`].
    pub fn prepare(&mut self, couplings: impl Iterator<Item = f64>) -> f64 {
        let (rows, next) = self.entries.split_at_mut(start(self.size));
        let next = &mut next[..self.size];
        for (entry, coupling) in next.iter_mut().zip(couplings) {
            *entry = coupling;
        }
        Arch::new().dispatch(
            #[inline(always)]
            || {
                forward(rows, next);
                dot(next, next)
            },
        )
    }

    /// The couplings of the prepared row expressed by the present rows: x = M⁻¹·couplings.
    pub fn combination(&self, x: &mut [f64]) {
        let (rows, next) = self.entries.split_at(start(self.size));
        x.copy_from_slice(&next[..self.size]);
        backward(rows, x);
    }

    /// Lets the prepared row join with what its couplings left of its diagonal, a `pivot` > 0.
    pub fn append(&mut self, pivot: f64) {
        self.entries[start(self.size) + self.size] = 1.0 / pivot.sqrt();
        self.size += 1;
    }

    /// x ← M⁻¹x.
    pub fn solve(&self, x: &mut [f64]) {
        let rows = &self.entries[..start(self.size)];
        Arch::new().dispatch(
            #[inline(always)]
            || {
                forward(rows, x);
                backward(rows, x);
            },
        );
    }

    /// Removes row and column `position`: the rows below lose a column d, and with it d·dᵀ,
    /// which is rotated back into them.
    pub fn remove(&mut self, position: usize) {
        for i in position + 1..self.size {
            let (from, to) = (start(i), start(i - 1));
            self.leaving[i - 1 - position] = self.entries[from + position];
            self.entries.copy_within(from..from + position, to);
            let behind = from + position + 1..=from + i;
            self.entries.copy_within(behind, to + position);
        }
        self.size -= 1;
        for i in 0..self.size - position {
            let mut left = self.leaving[i];
            let begin = start(position + i) + position;
            let (diagonal, row) = self.entries[begin..=begin + i]
                .split_last_mut()
                .expect("a row holds its diagonal");
            for (entry, &(cosine, sine)) in row.iter_mut().zip(&self.rotations) {
                let old = *entry;
                *entry = cosine * old + sine * left;
                left = cosine * left - sine * old;
            }
            let old = 1.0 / *diagonal;
            let length = (old * old + left * left).sqrt();
            self.rotations[i] = (old / length, left / length);
            *diagonal = 1.0 / length;
        }
    }
}

/// x ← L⁻¹x.
#[inline(always)]
fn forward(rows: &[f64], x: &mut [f64]) {
    let mut rest = rows;
    for i in 0..x.len() {
        let (row, below) = rest.split_at(i + 1);
        let (before, at) = x.split_at_mut(i);
        at[0] = (at[0] - dot(&row[..i], before)) * row[i];
        rest = below;
    }
}

/// x ← L⁻ᵀx.
#[inline(always)]
fn backward(rows: &[f64], x: &mut [f64]) {
    let mut rest = rows;
    for i in (0..x.len()).rev() {
        let (above, row) = rest.split_at(start(i));
        let (before, at) = x.split_at_mut(i);
        at[0] *= row[i];
        add_scaled(before, &row[..i], -at[0]);
        rest = above;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix with entries of its own.
    fn entry(i: usize, j: usize) -> f64 {
        let (a, b) = (i.min(j) as f64, i.max(j) as f64);
        1.0 / (1.0 + b - a) + if i == j { 0.5 + 0.1 * a } else { 0.0 }
    }

    fn join(factor: &mut PackedCholesky, members: &mut Vec<usize>, new: usize) {
        let share = factor.prepare(members.iter().map(|&m| entry(m, new)));
        factor.append(entry(new, new) - share);
        members.push(new);
    }

    fn check(factor: &PackedCholesky, members: &[usize]) {
        let x: Vec<f64> = (0..members.len()).map(|i| i as f64 - 1.5).collect();
        let mut solution: Vec<f64> = members
            .iter()
            .map(|&i| members.iter().zip(&x).map(|(&j, x)| entry(i, j) * x).sum())
            .collect();
        factor.solve(&mut solution);
        for (found, expected) in solution.iter().zip(&x) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn rows_join_and_leave_anywhere() {
        let mut factor = PackedCholesky::with_capacity(12);
        let mut members = Vec::new();
        for new in 0..12 {
            join(&mut factor, &mut members, new);
            check(&factor, &members);
        }
        for position in [0, 10, 4, 4, 7, 0, 2] {
            factor.remove(position);
            members.remove(position);
            assert_eq!(factor.size, members.len());
            check(&factor, &members);
        }
        join(&mut factor, &mut members, 0);
        check(&factor, &members);
        while !members.is_empty() {
            factor.remove(members.len() - 1);
            members.pop();
            check(&factor, &members);
        }
    }

    #[test]
    fn a_prepared_row_tells_how_the_others_make_it_up() {
        let mut factor = PackedCholesky::with_capacity(3);
        let mut members = Vec::new();
        join(&mut factor, &mut members, 0);
        join(&mut factor, &mut members, 1);
        let share = factor.prepare([2.0 * entry(0, 0), 2.0 * entry(0, 1)].into_iter());
        assert!((share - 4.0 * entry(0, 0)).abs() < 1e-12);
        let mut x = [0.0; 2];
        factor.combination(&mut x);
        assert!((x[0] - 2.0).abs() < 1e-12 && x[1].abs() < 1e-12, "{x:?}");
    }
}
