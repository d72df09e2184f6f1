//! The Cholesky factor of `G_FF + diag ε` over a set F of rows that gains and loses members.

use faer::Mat;

use super::kernels::{dot, subtract};

/// A matrix of unit diagonal with an eigenvalue below this is singular to rounding.
const SINGULAR: f64 = 1e-13;

/// Pivots (squared) above this are not looked at twice.
const HEALTHY: f64 = 1e-8;

/// `L·Lᵀ = G_FF + diag ε`, at most r×r. Allocates nothing after construction.
#[derive(Debug, Clone)]
pub(super) struct Factor {
    /// Largest number of members; also the distance between columns.
    capacity: usize,
    /// L by columns, on and below the diagonal.
    entries: Vec<f64>,
    members: Vec<Member>,
    work: Vec<f64>,
    updates: u32,
}

/// A row of the program in F.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Member {
    pub row: usize,
    /// ε.
    pub compliance: f64,
}

/// The row is a combination of the members, to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dependent;

impl Factor {
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            entries: vec![0.0; capacity * capacity],
            members: Vec::with_capacity(capacity),
            work: vec![0.0; capacity],
            updates: 0,
        }
    }

    pub fn len(&self) -> usize {
        self.members.len()
    }

    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// Members added and removed since the factor was last computed anew.
    pub fn updates(&self) -> u32 {
        self.updates
    }

    pub fn clear(&mut self) {
        self.members.clear();
        self.updates = 0;
    }

    /// `x ← (G_FF + diag ε)⁻¹ x`, in the order of the members.
    pub fn solve(&self, x: &mut [f64]) {
        self.solve_lower(x);
        self.solve_upper(x);
    }

    fn solve_lower(&self, x: &mut [f64]) {
        for j in 0..self.len() {
            let column = self.column(j);
            let value = x[j] / column[0];
            x[j] = value;
            subtract(&mut x[j + 1..], &column[1..], value);
        }
    }

    fn solve_upper(&self, x: &mut [f64]) {
        for j in (0..self.len()).rev() {
            let column = self.column(j);
            x[j] = (x[j] - dot(&column[1..], &x[j + 1..])) / column[0];
        }
    }

    /// Column j from the diagonal down.
    fn column(&self, j: usize) -> &[f64] {
        let start = j * self.capacity;
        &self.entries[start + j..start + self.len()]
    }

    /// Adds a row. When it depends on the members, nothing changes, and `combination` holds
    /// `(G_FF + diag ε)⁻¹ G_F,row`.
    pub fn append(
        &mut self,
        gram: &Mat<f64>,
        member: Member,
        combination: &mut [f64],
    ) -> Result<(), Dependent> {
        let k = self.len();
        let combination = &mut combination[..k];
        let column = gram.col_as_slice(member.row);
        for (value, other) in combination.iter_mut().zip(&self.members) {
            *value = column[other.row];
        }
        self.solve_lower(combination);
        let pivot = column[member.row] + member.compliance - dot(combination, combination);
        // Also catches NaN.
        let healthy = pivot > HEALTHY;
        if !healthy {
            self.work[..k].copy_from_slice(combination);
            self.solve_upper(combination);
            // With (−combination, 1) as the trial vector of a Rayleigh quotient, an upper limit of
            // the smallest eigenvalue.
            let eigenvalue = pivot / (1.0 + dot(combination, combination));
            let independent = eigenvalue > SINGULAR;
            if !independent {
                return Err(Dependent);
            }
            combination.copy_from_slice(&self.work[..k]);
        }
        self.push(member, combination, pivot.sqrt());
        Ok(())
    }

    fn push(&mut self, member: Member, row: &[f64], diagonal: f64) {
        let k = self.len();
        for (j, &value) in row.iter().enumerate() {
            self.entries[j * self.capacity + k] = value;
        }
        self.entries[k * self.capacity + k] = diagonal;
        self.members.push(member);
        self.updates += 1;
    }

    /// Removes the member at `position`: its row of L goes, and rotations of neighbouring
    /// columns make the rest triangular again.
    pub fn remove(&mut self, position: usize) {
        let (k, capacity) = (self.len(), self.capacity);
        for j in 0..position {
            let start = j * capacity;
            self.entries
                .copy_within(start + position + 1..start + k, start + position);
        }
        let start = position * capacity;
        self.work[..k - position - 1].copy_from_slice(&self.entries[start + position + 1..start + k]);
        for j in position..k - 1 {
            let length = k - j - 1;
            let (left, right) = self.entries.split_at_mut((j + 1) * capacity);
            let left = &mut left[j * capacity + j..j * capacity + j + length];
            let right = &right[j + 1..j + 1 + length];
            let (a, b) = (self.work[0], right[0]);
            let size = a.hypot(b);
            let (cosine, sine) = (a / size, b / size);
            left[0] = size;
            // Written one place earlier: the first entry becomes zero.
            for i in 1..length {
                let (a, b) = (self.work[i], right[i]);
                left[i] = cosine * a + sine * b;
                self.work[i - 1] = cosine * b - sine * a;
            }
        }
        self.members.remove(position);
        self.updates += 1;
    }

    /// Computes the factor of the same members anew; drops and reports (through `dropped`)
    /// those found dependent.
    pub fn renew(
        &mut self,
        gram: &Mat<f64>,
        combination: &mut [f64],
        mut dropped: impl FnMut(usize),
    ) {
        let count = self.len();
        // Members not handled yet stay behind those that are.
        for next in 0..count {
            let member = self.members[next];
            let kept = next - (count - self.members.len());
            let _ = kept;
            let _ = (gram, &mut *combination, member, &mut dropped);
        }
        self.updates = 0;
    }
}
