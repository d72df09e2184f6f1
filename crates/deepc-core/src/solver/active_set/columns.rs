//! Dense columns and the few loops a step consists of, in a form that compiles to vector code, as
//! wide as the processor at hand has it. The width changes no bit of a result: every sum has one
//! order.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use faer::MatRef;
use pulp::Arch;

/// A dense matrix whose columns are slices.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Columns {
    entries: Vec<f64>,
    rows: usize,
}

impl Columns {
    pub fn from_matrix(matrix: MatRef<'_, f64>) -> Self {
        let columns = matrix.col_iter();
        Self {
            entries: columns.flat_map(|c| c.iter().copied()).collect(),
            rows: matrix.nrows(),
        }
    }

    #[inline(always)]
    pub fn column(&self, j: usize) -> &[f64] {
        &self.entries[j * self.rows..(j + 1) * self.rows]
    }

    /// `out −= Σ factor · column` over the pairs (column, factor).
    pub fn subtract(&self, out: &mut [f64], terms: &[(usize, f64)]) {
        Arch::new().dispatch(
            #[inline(always)]
            || self.subtract_here(out, terms),
        );
    }

    #[inline(always)]
    fn subtract_here(&self, out: &mut [f64], terms: &[(usize, f64)]) {
        // Four columns per pass over `out`: a quarter of its loads and stores.
        let (fours, rest) = terms.as_chunks::<4>();
        for &[(i, a), (j, b), (k, c), (l, d)] in fours {
            let columns = self.column(i).iter().zip(self.column(j));
            let columns = columns.zip(self.column(k)).zip(self.column(l));
            for (out, (((x, y), z), w)) in out.iter_mut().zip(columns) {
                *out -= (a * x + b * y) + (c * z + d * w);
            }
        }
        for &(j, factor) in rest {
            add_scaled(out, self.column(j), -factor);
        }
    }
}

/// `out += factor · x`.
#[inline(always)]
pub(in crate::solver) fn add_scaled(out: &mut [f64], x: &[f64], factor: f64) {
    for (out, x) in out.iter_mut().zip(x) {
        *out += factor * x;
    }
}

/// Inner product in eight partial sums: a plain sum has one order and cannot be vectorised.
#[inline(always)]
pub(in crate::solver) fn dot(x: &[f64], y: &[f64]) -> f64 {
    let (x_chunks, x_rest) = x.as_chunks::<8>();
    let (y_chunks, y_rest) = y.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (x, y) in x_chunks.iter().zip(y_chunks) {
        for ((sum, x), y) in sums.iter_mut().zip(x).zip(y) {
            *sum += x * y;
        }
    }
    let rest: f64 = x_rest.iter().zip(y_rest).map(|(x, y)| x * y).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (b + f)) + ((c + g) + (d + h)) + rest
}

/// Lanes of the searches below: as many as the widest registers hold, twice.
const LANES: usize = 16;

/// Position of the first of the largest entries, if it is above 0. No entry may be NaN.
pub(in crate::solver) fn position_of_largest(x: &[f64]) -> Option<usize> {
    let largest = Arch::new().dispatch(
        #[inline(always)]
        || {
            let (chunks, rest) = x.as_chunks::<LANES>();
            let mut lanes = [0.0; LANES];
            for chunk in chunks {
                for (lane, &value) in lanes.iter_mut().zip(chunk) {
                    *lane = larger(*lane, value);
                }
            }
            let lanes = lanes.iter().chain(rest);
            lanes.fold(0.0, |largest, &value| larger(largest, value))
        },
    );
    if largest > 0.0 {
        x.iter().position(|&value| value >= largest)
    } else {
        None
    }
}

/// Σ pᵢxᵢ² and the largest |pᵢxᵢ|, for p ≥ 0.
pub(in crate::solver) fn weighted_square(x: &[f64], p: &[f64]) -> (f64, f64) {
    Arch::new().dispatch(
        #[inline(always)]
        || {
            let (x_chunks, x_rest) = x.as_chunks::<LANES>();
            let (p_chunks, p_rest) = p.as_chunks::<LANES>();
            let (mut sums, mut lanes) = ([0.0; LANES], [0.0; LANES]);
            for (x, p) in x_chunks.iter().zip(p_chunks) {
                for lane in 0..LANES {
                    let product = p[lane] * x[lane];
                    sums[lane] += product * x[lane];
                    lanes[lane] = larger(lanes[lane], product.abs());
                }
            }
            let (mut sum, mut largest) = (0.0, 0.0);
            for (&one, &lane) in sums.iter().zip(&lanes) {
                sum += one;
                largest = larger(largest, lane);
            }
            for (x, p) in x_rest.iter().zip(p_rest) {
                sum += p * x * x;
                largest = larger(largest, (p * x).abs());
            }
            (sum, largest)
        },
    )
}

/// Unlike `f64::max` a single instruction, because it does not look for NaN.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::Mat;

    #[test]
    fn the_first_of_the_largest_entries_is_found_at_every_length() {
        for length in 0..40 {
            let mut x = vec![0.0; length];
            assert_eq!(position_of_largest(&x), None);
            for position in (0..length).rev() {
                x[position] = 2.0;
                assert_eq!(position_of_largest(&x), Some(position));
            }
        }
    }

    #[test]
    fn the_loops_agree_with_plain_sums_at_every_length() {
        for rows in 0..20 {
            let matrix = Mat::from_fn(rows, 7, |i, j| (3 * i + 5 * j) as f64 % 11.0 - 4.0);
            let columns = Columns::from_matrix(matrix.as_ref());
            for count in 0..7 {
                let terms: Vec<_> = (0..count).map(|j| (j, j as f64 - 2.5)).collect();
                let mut out = vec![1.0; rows];
                columns.subtract(&mut out, &terms);
                for (i, out) in out.iter().enumerate() {
                    let sum: f64 = terms.iter().map(|&(j, f)| f * matrix[(i, j)]).sum();
                    assert!((out - (1.0 - sum)).abs() < 1e-12);
                }
            }
            let (x, y) = (columns.column(1), columns.column(2));
            let plain: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
            assert!((dot(x, y) - plain).abs() < 1e-12);
        }
    }
}
