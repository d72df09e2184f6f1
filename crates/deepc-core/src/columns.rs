//! Dense columns and the few loops a step consists of, in a form that compiles to vector code, as
//! wide as the processor at hand has it. The width changes no bit of a result: every sum has one
//! order.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use faer::MatRef;
use pulp::{Arch, NullaryFnOnce};

/// Runs a loop as wide as the processor at hand has it. The loop is a type of its own, because a
/// closure that captures by reference is called through a shim that is not inlined: it would be
/// compiled for the oldest processor.
pub(crate) fn widely<K: NullaryFnOnce>(kernel: K) -> K::Output {
    Arch::new().dispatch(kernel)
}

/// Bytes of the widest registers, and of the lines of a cache.
const LINE: usize = 64;

/// Numbers of one line.
const PER_LINE: usize = LINE / size_of::<f64>();

/// A dense matrix whose columns are slices. Each begins with a line of the cache: loads that
/// straddle two take twice the time.
#[derive(Debug)]
pub(crate) struct Columns {
    entries: Vec<f64>,
    /// Entries before the first line.
    offset: usize,
    /// Entries from one column to the next.
    stride: usize,
    rows: usize,
    count: usize,
}

impl Clone for Columns {
    fn clone(&self) -> Self {
        // Elsewhere in memory, lines begin elsewhere.
        Self::from_matrix(self.as_matrix())
    }
}

impl Columns {
    pub fn from_matrix(matrix: MatRef<'_, f64>) -> Self {
        let (rows, columns) = matrix.shape();
        let stride = rows.next_multiple_of(PER_LINE);
        let mut entries = vec![0.0; stride * columns + PER_LINE];
        // Only speed depends on it, should the address not be known.
        let offset = entries.as_ptr().align_offset(LINE).min(PER_LINE);
        for (j, column) in matrix.col_iter().enumerate() {
            let target = entries[offset + j * stride..].iter_mut();
            target.zip(column.iter()).for_each(|(to, &from)| *to = from);
        }
        Self {
            entries,
            offset,
            stride,
            rows,
            count: columns,
        }
    }

    /// The same, for faer.
    pub fn as_matrix(&self) -> MatRef<'_, f64> {
        let entries = &self.entries[self.offset..self.offset + self.stride * self.count];
        MatRef::from_column_major_slice(entries, self.stride, self.count).subrows(0, self.rows)
    }

    #[inline(always)]
    pub fn column(&self, j: usize) -> &[f64] {
        let start = self.offset + j * self.stride;
        &self.entries[start..start + self.rows]
    }

    /// `out = M·x` with the columns from `first` on, as many as x has entries, and their last rows,
    /// as many as `out` has.
    pub fn multiply(&self, out: &mut [f64], first: usize, x: &[f64]) {
        widely(Multiply {
            columns: self,
            out,
            first,
            x,
        });
    }

    /// `out_k = column(picked_k)ᵀ vector`.
    pub fn products(&self, out: &mut [f64], picked: &[usize], vector: &[f64]) {
        widely(Products {
            columns: self,
            out,
            picked,
            vector,
        });
    }

    /// `out −= Σ factor · column` over the pairs (column, factor).
    pub fn subtract(&self, out: &mut [f64], terms: &[(usize, f64)]) {
        widely(Subtract {
            columns: self,
            out,
            terms,
        });
    }
}

struct Products<'a> {
    columns: &'a Columns,
    out: &'a mut [f64],
    picked: &'a [usize],
    vector: &'a [f64],
}

impl NullaryFnOnce for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (out, &j) in self.out.iter_mut().zip(self.picked) {
            *out = dot(self.columns.column(j), self.vector);
        }
    }
}

struct Multiply<'a> {
    columns: &'a Columns,
    out: &'a mut [f64],
    first: usize,
    x: &'a [f64],
}

impl NullaryFnOnce for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            columns,
            out,
            first,
            x,
        } = self;
        let skipped = columns.rows - out.len();
        let column = |j: usize| &columns.column(first + j)[skipped..];
        out.fill(0.0);
        let (fours, rest) = x.as_chunks::<4>();
        for (number, &[a, b, c, d]) in fours.iter().enumerate() {
            let j = 4 * number;
            let four = column(j).iter().zip(column(j + 1));
            let four = four.zip(column(j + 2)).zip(column(j + 3));
            for (out, (((x, y), z), w)) in out.iter_mut().zip(four) {
                *out += (a * x + b * y) + (c * z + d * w);
            }
        }
        for (j, &factor) in rest.iter().enumerate() {
            add_scaled(out, column(4 * fours.len() + j), factor);
        }
    }
}

struct Subtract<'a> {
    columns: &'a Columns,
    out: &'a mut [f64],
    terms: &'a [(usize, f64)],
}

impl NullaryFnOnce for Subtract<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self {
            columns,
            out,
            terms,
        } = self;
        // Eight columns per pass over `out`: an eighth of its loads and stores.
        let (eights, rest) = terms.as_chunks::<8>();
        for eight in eights {
            let factors = eight.map(|(_, factor)| factor);
            // Cut to one length, so that no entry needs a look at its bounds.
            let of = eight.map(|(j, _)| &columns.column(j)[..out.len()]);
            for (i, out) in out.iter_mut().enumerate() {
                let product = |k: usize| factors[k] * of[k][i];
                *out -= ((product(0) + product(1)) + (product(2) + product(3)))
                    + ((product(4) + product(5)) + (product(6) + product(7)));
            }
        }
        let (fours, rest) = rest.as_chunks::<4>();
        for &[(i, a), (j, b), (k, c), (l, d)] in fours {
            let four = columns.column(i).iter().zip(columns.column(j));
            let four = four.zip(columns.column(k)).zip(columns.column(l));
            for (out, (((x, y), z), w)) in out.iter_mut().zip(four) {
                *out -= (a * x + b * y) + (c * z + d * w);
            }
        }
        for &(j, factor) in rest {
            add_scaled(out, columns.column(j), -factor);
        }
    }
}

/// `out += factor · x`.
#[inline(always)]
pub(crate) fn add_scaled(out: &mut [f64], x: &[f64], factor: f64) {
    for (out, x) in out.iter_mut().zip(x) {
        *out += factor * x;
    }
}

/// Inner product in eight partial sums: a plain sum has one order and cannot be vectorised.
#[inline(always)]
pub(crate) fn dot(x: &[f64], y: &[f64]) -> f64 {
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
pub(crate) fn position_of_largest(x: &[f64]) -> Option<usize> {
    let largest = widely(Largest(x));
    if largest > 0.0 {
        x.iter().position(|&value| value >= largest)
    } else {
        None
    }
}

/// The largest entry, or 0.
struct Largest<'a>(&'a [f64]);

impl NullaryFnOnce for Largest<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let (chunks, rest) = self.0.as_chunks::<LANES>();
        let mut lanes = [0.0; LANES];
        for chunk in chunks {
            for (lane, &value) in lanes.iter_mut().zip(chunk) {
                *lane = larger(*lane, value);
            }
        }
        let lanes = lanes.iter().chain(rest);
        lanes.fold(0.0, |largest, &value| larger(largest, value))
    }
}

/// Σ pᵢxᵢ² and the largest |pᵢxᵢ|, for p ≥ 0.
pub(crate) fn weighted_square(x: &[f64], p: &[f64]) -> (f64, f64) {
    widely(WeightedSquare { x, p })
}

struct WeightedSquare<'a> {
    x: &'a [f64],
    p: &'a [f64],
}

impl NullaryFnOnce for WeightedSquare<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn call(self) -> (f64, f64) {
        let (x_chunks, x_rest) = self.x.as_chunks::<LANES>();
        let (p_chunks, p_rest) = self.p.as_chunks::<LANES>();
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
    }
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
            let mut out = [0.0; 2];
            columns.products(&mut out, &[4, 2], columns.column(1));
            for (out, j) in out.iter().zip([4, 2]) {
                assert_eq!(
                    out.to_bits(),
                    dot(columns.column(j), columns.column(1)).to_bits()
                );
            }
            let (x, y) = (columns.column(1), columns.column(2));
            let plain: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
            assert!((dot(x, y) - plain).abs() < 1e-12);
        }
    }
}
