//! A block of rows taken into a triangle by Householder reflections.

use deepc_core::faer::MatMut;
use pulp::NullaryFnOnce;

use super::widely;

/// Numbers that are added up side by side, whatever the processor has.
const LANES: usize = 8;

/// Columns that one pass over a reflection vector serves.
const TOGETHER: usize = 4;

/// Sums of squares within these limits have lost nothing to overflow or underflow.
const SAFE: std::ops::RangeInclusive<f64> = 1e-280..=1e280;

/// Rows that wait to be taken into a triangle, column by column.
pub(crate) struct Block {
    columns: usize,
    /// Numbers from one column to the next.
    stride: usize,
    /// Rows that wait.
    rows: usize,
    values: Vec<f64>,
}

impl Block {
    /// With room for `capacity` rows of `columns` numbers.
    pub fn new(columns: usize, capacity: usize) -> Self {
        let stride = capacity.max(1).next_multiple_of(LANES);
        Self {
            columns,
            stride,
            rows: 0,
            values: vec![0.0; columns * stride],
        }
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn has_room(&self, count: usize) -> bool {
        self.rows + count <= self.stride
    }

    /// The next `count` rows, to be overwritten whole. There must be room for them.
    pub fn append(&mut self, count: usize) -> MatMut<'_, f64> {
        let (first, columns) = (self.rows, self.columns);
        self.rows += count;
        let all = MatMut::from_column_major_slice_mut(&mut self.values, self.stride, columns);
        all.subrows_mut(first, count)
    }

    /// Takes all rows into the `triangle` (row by row, as many rows as columns, zero below the
    /// diagonal): its `RᵀR` grows by that of the rows, with the accuracy of a QR decomposition of
    /// everything at once. The triangle on top has only one row in every reflection.
    pub fn fold_into(&mut self, triangle: &mut [f64]) {
        widely(Fold {
            triangle,
            columns: self.columns,
            stride: self.stride,
            rows: self.rows,
            block: &mut self.values,
        });
        self.rows = 0;
    }
}

struct Fold<'a> {
    triangle: &'a mut [f64],
    columns: usize,
    stride: usize,
    rows: usize,
    block: &'a mut [f64],
}

impl NullaryFnOnce for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (n, stride, rows) = (self.columns, self.stride, self.rows);
        for j in 0..n {
            let (done, later) = self.block.split_at_mut((j + 1) * stride);
            let vector = &mut done[j * stride..j * stride + rows];
            let row = &mut self.triangle[j * n + j..(j + 1) * n];
            let Some(factor) = reflection(vector, &mut row[0]) else {
                continue;
            };
            let groups = later.chunks_mut(TOGETHER * stride);
            for (heads, group) in row[1..].chunks_mut(TOGETHER).zip(groups) {
                if heads.len() == TOGETHER {
                    let (a, rest) = group.split_at_mut(stride);
                    let (b, rest) = rest.split_at_mut(stride);
                    let (c, d) = rest.split_at_mut(stride);
                    let group = [a, b, c, d].map(|column| &mut column[..rows]);
                    reflect(vector, group, heads, factor);
                } else {
                    for (head, column) in heads.chunks_mut(1).zip(group.chunks_mut(stride)) {
                        reflect(vector, [&mut column[..rows]], head, factor);
                    }
                }
            }
        }
    }
}

/// Turns (head, x) into (±norm, 0): x becomes v with the reflection `1 − factor·(1, v)(1, v)ᵀ`.
/// `None` if there is nothing to do.
#[inline(always)]
fn reflection(x: &mut [f64], head: &mut f64) -> Option<f64> {
    let (mut unit, mut below) = (1.0, squares(x));
    if !SAFE.contains(&below) {
        unit = x.iter().fold(0.0, |most, value| value.abs().max(most));
        if unit == 0.0 && !below.is_nan() {
            return None;
        }
        below = x.iter().map(|value| (value / unit) * (value / unit)).sum();
    }
    let scaled = *head / unit;
    let norm = unit * (scaled * scaled + below).sqrt();
    let pivot = *head + norm.copysign(*head);
    for value in x.iter_mut() {
        *value /= pivot;
    }
    *head = -norm.copysign(*head);
    Some(pivot / -*head)
}

#[inline(always)]
fn squares(x: &[f64]) -> f64 {
    let (chunks, rest) = x.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += value * value;
        }
    }
    let rest = rest.iter().map(|value| value * value);
    sums.iter().copied().chain(rest).sum()
}

/// Applies a reflection to K columns and their K heads.
#[inline(always)]
fn reflect<const K: usize>(
    vector: &[f64],
    columns: [&mut [f64]; K],
    heads: &mut [f64],
    factor: f64,
) {
    let (v, v_rest) = vector.as_chunks::<LANES>();
    let mut parts = columns.map(|column| column.as_chunks_mut::<LANES>());
    let mut sums = [[0.0; LANES]; K];
    for (i, v) in v.iter().enumerate() {
        for (sum, (column, _)) in sums.iter_mut().zip(&parts) {
            let column = &column[i];
            for l in 0..LANES {
                sum[l] += v[l] * column[l];
            }
        }
    }
    let mut along = [0.0; K];
    let of_column = along.iter_mut().zip(heads).zip(sums.iter().zip(&parts));
    for ((along, head), (sum, (_, rest))) in of_column {
        let rest = v_rest.iter().zip(&**rest).map(|(v, x)| v * x);
        let product: f64 = sum.iter().copied().chain(rest).sum();
        *along = factor * (*head + product);
        *head -= *along;
    }
    for (i, v) in v.iter().enumerate() {
        for ((column, _), along) in parts.iter_mut().zip(&along) {
            let column = &mut column[i];
            for l in 0..LANES {
                column[l] -= along * v[l];
            }
        }
    }
    for ((_, rest), along) in parts.iter_mut().zip(&along) {
        for (x, v) in rest.iter_mut().zip(v_rest) {
            *x -= along * v;
        }
    }
}
