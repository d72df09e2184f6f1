//! A Cholesky factor that rows join and leave.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use pulp::NullaryFnOnce;

use crate::columns::{add_scaled, dot, widely};

/// L of a growing and shrinking matrix M = `LLᵀ`, k×k, with room for a capacity fixed at set-up.
///
/// Columns are packed one behind the other, each with room for all rows that may join, so that
/// substitutions and the rotations after a leave run along slices: k² operations each, in vector
/// code.
#[derive(Debug, Clone)]
pub(super) struct PackedCholesky {
    /// Column j from its diagonal down.
    entries: Vec<f64>,
    capacity: usize,
    size: usize,
    /// 1/Lᵢᵢ.
    reciprocals: Vec<f64>,
    /// The row laid out by [`Self::prepare`]; of a leaving column, what the rows below keep.
    next: Vec<f64>,
}

impl PackedCholesky {
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            entries: vec![0.0; capacity * (capacity + 1) / 2],
            capacity,
            size: 0,
            reciprocals: vec![0.0; capacity],
            next: vec![0.0; capacity],
        }
    }

    pub fn clear(&mut self) {
        self.size = 0;
    }

    /// Where column j begins.
    #[inline(always)]
    fn start(&self, j: usize) -> usize {
        j * (2 * self.capacity + 1 - j) / 2
    }

    /// Column j from its diagonal down.
    #[inline(always)]
    fn column(&self, j: usize) -> &[f64] {
        let start = self.start(j);
        &self.entries[start..start + self.size - j]
    }

    /// Lays out the next row: `couplings` are its k entries of M beside the diagonal. Returns
    /// their share in the diagonal, ‖L⁻¹·couplings‖². The row counts only after
    /// [`Self::append`].
    pub fn prepare(&mut self, couplings: impl Iterator<Item = f64>) -> f64 {
        let mut next = std::mem::take(&mut self.next);
        let row = &mut next[..self.size];
        for (entry, coupling) in row.iter_mut().zip(couplings) {
            *entry = coupling;
        }
        let share = widely(Forward { factor: self, row });
        self.next = next;
        share
    }

    /// The couplings of the prepared row expressed by the present rows: x = M⁻¹·couplings.
    pub fn combination(&self, x: &mut [f64]) {
        x.copy_from_slice(&self.next[..self.size]);
        self.backward(x);
    }

    /// Lets the prepared row join with what its couplings left of its diagonal, a `pivot` > 0.
    pub fn append(&mut self, pivot: f64) {
        for j in 0..self.size {
            let end = self.start(j) + self.size - j;
            self.entries[end] = self.next[j];
        }
        let diagonal = pivot.sqrt();
        let start = self.start(self.size);
        self.entries[start] = diagonal;
        self.reciprocals[self.size] = 1.0 / diagonal;
        self.size += 1;
    }

    /// x ← M⁻¹x.
    pub fn solve(&self, x: &mut [f64]) {
        widely(Solve { factor: self, x });
    }

    /// Removes row and column `position`: the rows below lose a column d, and with it d·dᵀ,
    /// which is rotated back into them, one column after the other.
    pub fn remove(&mut self, position: usize) {
        for j in 0..position {
            let start = self.start(j);
            let behind = start + position + 1 - j..start + self.size - j;
            self.entries.copy_within(behind, start + position - j);
        }
        let count = self.size - position - 1;
        let leaving = self.start(position) + 1;
        self.next[..count].copy_from_slice(&self.entries[leaving..leaving + count]);
        self.size -= 1;
        widely(RotateIn {
            factor: self,
            position,
        });
    }

    /// Moves the columns behind `position` forward by one and rotates d, which is in `next`, into
    /// them.
    #[inline(always)]
    fn rotate_in(&mut self, position: usize) {
        let mut left = self.next[0];
        for j in position..self.size {
            let (to, from) = (self.start(j), self.start(j + 1));
            let length = self.size - j;
            let leaving = &mut self.next[j - position..self.size - position];
            let (before, behind) = self.entries.split_at_mut(from);
            let (target, source) = (&mut before[to..to + length], &behind[..length]);
            let diagonal = source[0];
            let reciprocal = 1.0 / (diagonal * diagonal + left * left).sqrt();
            let (cosine, sine) = (diagonal * reciprocal, left * reciprocal);
            // Ahead of the loop, so that the next rotation need not wait for it.
            if length > 1 {
                left = cosine * leaving[1] - sine * source[1];
            }
            for ((target, source), left) in target.iter_mut().zip(source).zip(leaving) {
                let old = *left;
                *target = cosine * source + sine * old;
                *left = cosine * old - sine * source;
            }
            self.reciprocals[j] = reciprocal;
        }
    }

    /// x ← L⁻¹x, four columns per pass over what is below them.
    #[inline(always)]
    fn forward(&self, x: &mut [f64]) {
        let fours = x.len() - x.len() % 4;
        for j in (0..fours).step_by(4) {
            let Some((head, tail)) = x[j..].split_first_chunk_mut::<4>() else {
                return;
            };
            let block = Block::of(self, j);
            let [a, b, c, d] = head;
            let [p, q, r, s] = block.columns;
            let [u, v, w, z] = block.reciprocals;
            *a *= u;
            *b = (*b - p[1] * *a) * v;
            *c = (*c - (p[2] * *a + q[1] * *b)) * w;
            *d = (*d - ((p[3] * *a + q[2] * *b) + r[1] * *c)) * z;
            let below = p[4..].iter().zip(&q[3..]).zip(&r[2..]).zip(&s[1..]);
            for (x, (((p, q), r), s)) in tail.iter_mut().zip(below) {
                *x -= (p * *a + q * *b) + (r * *c + s * *d);
            }
        }
        for j in fours..x.len() {
            x[j] *= self.reciprocals[j];
            let (above, below) = x.split_at_mut(j + 1);
            add_scaled(below, &self.column(j)[1..], -above[j]);
        }
    }

    /// x ← L⁻ᵀx.
    #[inline(always)]
    fn backward(&self, x: &mut [f64]) {
        let fours = x.len() - x.len() % 4;
        for j in (fours..x.len()).rev() {
            let below = dot(&self.column(j)[1..], &x[j + 1..]);
            x[j] = (x[j] - below) * self.reciprocals[j];
        }
        for j in (0..fours).step_by(4).rev() {
            let block = Block::of(self, j);
            let Some((head, tail)) = x[j..].split_first_chunk_mut::<4>() else {
                return;
            };
            let [p, q, r, s] = block.columns;
            let [u, v, w, z] = block.reciprocals;
            let [a, b, c, d] = head;
            let below = four_dots([&p[4..], &q[3..], &r[2..], &s[1..]], tail);
            *d = (*d - below[3]) * z;
            *c = (*c - below[2] - r[1] * *d) * w;
            *b = (*b - below[1] - (q[1] * *c + q[2] * *d)) * v;
            *a = (*a - below[0] - (p[1] * *b + (p[2] * *c + p[3] * *d))) * u;
        }
    }
}

/// row ← L⁻¹·row; its squared length.
struct Forward<'a> {
    factor: &'a PackedCholesky,
    row: &'a mut [f64],
}

impl NullaryFnOnce for Forward<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        self.factor.forward(self.row);
        dot(self.row, self.row)
    }
}

/// x ← M⁻¹x.
struct Solve<'a> {
    factor: &'a PackedCholesky,
    x: &'a mut [f64],
}

impl NullaryFnOnce for Solve<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.forward(self.x);
        self.factor.backward(self.x);
    }
}

struct RotateIn<'a> {
    factor: &'a mut PackedCholesky,
    position: usize,
}

impl NullaryFnOnce for RotateIn<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.rotate_in(self.position);
    }
}

/// Four neighbouring columns.
struct Block<'a> {
    columns: [&'a [f64]; 4],
    reciprocals: [f64; 4],
}

impl<'a> Block<'a> {
    #[inline(always)]
    fn of(factor: &'a PackedCholesky, j: usize) -> Self {
        let number = [j, j + 1, j + 2, j + 3];
        Self {
            columns: number.map(|j| factor.column(j)),
            reciprocals: number.map(|j| factor.reciprocals[j]),
        }
    }
}

/// Inner products of four vectors with x, each as [`dot`] sums it.
#[inline(always)]
fn four_dots(vectors: [&[f64]; 4], x: &[f64]) -> [f64; 4] {
    let (chunks, rest) = x.as_chunks::<8>();
    let [a, b, c, d] = vectors.map(|vector| vector.as_chunks::<8>());
    let mut sums = [[0.0; 8]; 4];
    let whole = a.0.iter().zip(b.0).zip(c.0).zip(d.0);
    for (x, (((a, b), c), d)) in chunks.iter().zip(whole) {
        for lane in 0..8 {
            sums[0][lane] += a[lane] * x[lane];
            sums[1][lane] += b[lane] * x[lane];
            sums[2][lane] += c[lane] * x[lane];
            sums[3][lane] += d[lane] * x[lane];
        }
    }
    let mut totals = sums.map(|[a, b, c, d, e, f, g, h]| ((a + e) + (b + f)) + ((c + g) + (d + h)));
    for (total, vector) in totals.iter_mut().zip([a.1, b.1, c.1, d.1]) {
        let rest: f64 = vector.iter().zip(rest).map(|(v, x)| v * x).sum();
        *total += rest;
    }
    totals
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
