//! The loops over samples that identification spends its time in, as wide as the processor at hand has
//! it. The width changes no bit of a result: every sum is added up in the order of a plain loop, and
//! nothing is fused.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use deepc_core::faer::{Mat, MatRef};
use pulp::{Arch, NullaryFnOnce};

use crate::state_space::SystemMatrices;

/// Vectors of up to so many numbers have loops of their own; longer ones go through plain loops.
const WIDEST: usize = 16;

/// Runs a loop as wide as the processor at hand has it. The loop is a type of its own, because a
/// closure that captures by reference is called through a shim that is not inlined.
fn widely<K: NullaryFnOnce>(kernel: K) -> K::Output {
    Arch::new().dispatch(kernel)
}

/// Numbers from one vector of `n` numbers to the next where they are filled up to whole registers.
pub(crate) fn stride(n: usize) -> usize {
    if n <= WIDEST {
        n.next_multiple_of(4)
    } else {
        n
    }
}

/// What a run of [`march`] makes of the measured outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Output {
    /// y − C x − D u, from the left.
    Residual,
    /// y − (C x + D u).
    Difference,
    /// C x + D u; K has no part in it.
    Simulated,
}

/// Runs `x(k+1) = A x + B u + K e` from `initial` over `inputs` (row by row) and replaces the measured
/// `series` (row by row) by e, or by the output. `states` takes x(k), row by row, unless it is empty.
pub(crate) fn march(
    system: &SystemMatrices,
    initial: &[f64],
    inputs: &[f64],
    series: &mut [f64],
    states: &mut [f64],
    output: Output,
) {
    fn wide<const N: usize>(
        system: &SystemMatrices,
        initial: &[f64],
        inputs: &[f64],
        series: &mut [f64],
        states: &mut [f64],
        output: Output,
    ) {
        let sign = if output == Output::Residual {
            -1.0
        } else {
            1.0
        };
        let rows = |matrix: &Mat<f64>| -> Vec<f64> {
            let row = |i| (0..matrix.ncols()).map(move |j| sign * matrix[(i, j)]);
            (0..matrix.nrows()).flat_map(row).collect()
        };
        let mut first = [0.0; N];
        first[..initial.len()].copy_from_slice(initial);
        widely(March::<N> {
            a: lanes(&system.a),
            b: lanes(&system.b),
            k: lanes(&system.k),
            c: rows(&system.c),
            d: rows(&system.d),
            initial: first,
            sizes: (system.order(), system.inputs(), system.outputs()),
            inputs,
            series,
            states,
            output,
        });
    }
    let run = match stride(system.order()) {
        0 | 4 => wide::<4>,
        8 => wide::<8>,
        12 => wide::<12>,
        16 => wide::<16>,
        _ => plain_march,
    };
    run(system, initial, inputs, series, states, output);
}

/// The columns of a matrix, filled up with zeros.
fn lanes<const N: usize>(matrix: &Mat<f64>) -> Vec<[f64; N]> {
    let column = |j| {
        let mut column = [0.0; N];
        column[..matrix.nrows()].copy_from_slice(matrix.col_as_slice(j));
        column
    };
    (0..matrix.ncols()).map(column).collect()
}

struct March<'a, const N: usize> {
    a: Vec<[f64; N]>,
    b: Vec<[f64; N]>,
    k: Vec<[f64; N]>,
    /// Row by row, with the sign that they are added with.
    c: Vec<f64>,
    d: Vec<f64>,
    initial: [f64; N],
    /// n, M, p.
    sizes: (usize, usize, usize),
    inputs: &'a [f64],
    series: &'a mut [f64],
    states: &'a mut [f64],
    output: Output,
}

impl<const N: usize> NullaryFnOnce for March<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (n, m, p) = self.sizes;
        let mut x = self.initial;
        for (k, series) in self.series.chunks_exact_mut(p).enumerate() {
            let u = &self.inputs[k * m..(k + 1) * m];
            if !self.states.is_empty() {
                self.states[k * n..(k + 1) * n].copy_from_slice(&x[..n]);
            }
            for (l, value) in series.iter_mut().enumerate() {
                let mut sum = if self.output == Output::Residual {
                    *value
                } else {
                    0.0
                };
                for (c, x) in self.c[l * n..(l + 1) * n].iter().zip(&x) {
                    sum += c * x;
                }
                for (d, u) in self.d[l * m..(l + 1) * m].iter().zip(u) {
                    sum += d * u;
                }
                *value = if self.output == Output::Difference {
                    *value - sum
                } else {
                    sum
                };
            }
            let mut next = [0.0; N];
            for (column, &x) in self.a.iter().zip(&x) {
                add(&mut next, column, x);
            }
            for (column, &u) in self.b.iter().zip(u) {
                add(&mut next, column, u);
            }
            if self.output != Output::Simulated {
                for (column, &e) in self.k.iter().zip(&*series) {
                    add(&mut next, column, e);
                }
            }
            x = next;
        }
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut [f64; N], column: &[f64; N], factor: f64) {
    for i in 0..N {
        sum[i] += column[i] * factor;
    }
}

fn plain_march(
    system: &SystemMatrices,
    initial: &[f64],
    inputs: &[f64],
    series: &mut [f64],
    states: &mut [f64],
    output: Output,
) {
    let (n, m, p) = (system.order(), system.inputs(), system.outputs());
    let sign = if output == Output::Residual {
        -1.0
    } else {
        1.0
    };
    let (mut x, mut next) = (initial.to_vec(), vec![0.0; n]);
    for (k, series) in series.chunks_exact_mut(p).enumerate() {
        let u = &inputs[k * m..(k + 1) * m];
        if !states.is_empty() {
            states[k * n..(k + 1) * n].copy_from_slice(&x);
        }
        for (l, value) in series.iter_mut().enumerate() {
            let mut sum = if output == Output::Residual {
                *value
            } else {
                0.0
            };
            for (j, x) in x.iter().enumerate() {
                sum += sign * system.c[(l, j)] * x;
            }
            for (j, u) in u.iter().enumerate() {
                sum += sign * system.d[(l, j)] * u;
            }
            *value = if output == Output::Difference {
                *value - sum
            } else {
                sum
            };
        }
        next.fill(0.0);
        add_product(&mut next, &system.a, &x);
        add_product(&mut next, &system.b, u);
        if output != Output::Simulated {
            add_product(&mut next, &system.k, series);
        }
        std::mem::swap(&mut x, &mut next);
    }
}

/// `y += factor·x`.
pub(crate) fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// `y += M x`, column by column.
pub(crate) fn add_product(y: &mut [f64], m: &Mat<f64>, x: &[f64]) {
    for (j, &x) in x.iter().enumerate() {
        add_scaled(y, x, m.col_as_slice(j));
    }
}

/// `next_i = c_i s + Σ_h F_hi state_h` for vectors of `lanes` numbers (a multiple of 4): s `values`,
/// `state` and `next` vector by vector, F (`f`) row by row.
pub(crate) fn filter(
    f: &[f64],
    c: &[f64],
    values: &[f64],
    state: &[f64],
    next: &mut [f64],
    lanes: usize,
) {
    fn wide<const Q: usize>(f: &[f64], c: &[f64], values: &[f64], state: &[f64], next: &mut [f64]) {
        let mut padded = [0.0; Q];
        padded.copy_from_slice(&values[..Q]);
        widely(Filter::<Q> {
            f,
            c,
            values: padded,
            state: state.as_chunks().0,
            next: next.as_chunks_mut().0,
        });
    }
    match lanes {
        4 => wide::<4>(f, c, values, state, next),
        8 => wide::<8>(f, c, values, state, next),
        12 => wide::<12>(f, c, values, state, next),
        16 => wide::<16>(f, c, values, state, next),
        _ => {
            let n = c.len();
            for (i, next) in next.chunks_exact_mut(lanes).enumerate() {
                for (next, value) in next.iter_mut().zip(values) {
                    *next = c[i] * value;
                }
                for (h, state) in state.chunks_exact(lanes).enumerate() {
                    add_scaled(next, f[h * n + i], state);
                }
            }
        }
    }
}

struct Filter<'a, const Q: usize> {
    f: &'a [f64],
    c: &'a [f64],
    values: [f64; Q],
    state: &'a [[f64; Q]],
    next: &'a mut [[f64; Q]],
}

impl<const Q: usize> NullaryFnOnce for Filter<'_, Q> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let n = self.c.len();
        for (i, (next, &c)) in self.next.iter_mut().zip(self.c).enumerate() {
            let mut sum = [0.0; Q];
            for (sum, value) in sum.iter_mut().zip(&self.values) {
                *sum = c * value;
            }
            for (state, f) in self.state.iter().zip(self.f[i..].iter().step_by(n)) {
                add(&mut sum, state, *f);
            }
            *next = sum;
        }
    }
}

/// Adds the free motion `x(k+1) = F x(k)` from `start` to the first `samples` of `states` and `C x(k)` to those of
/// `series`, all row by row.
pub(crate) fn add_free(
    f: &Mat<f64>,
    c: &Mat<f64>,
    start: &[f64],
    samples: usize,
    states: &mut [f64],
    series: &mut [f64],
) {
    fn wide<const N: usize>(
        f: &Mat<f64>,
        c: &Mat<f64>,
        start: &[f64],
        samples: usize,
        states: &mut [f64],
        series: &mut [f64],
    ) {
        let mut first = [0.0; N];
        first[..start.len()].copy_from_slice(start);
        widely(AddFree::<N> {
            f: lanes(f),
            c: (0..c.nrows())
                .flat_map(|l| (0..c.ncols()).map(move |j| c[(l, j)]))
                .collect(),
            start: first,
            sizes: (f.nrows(), c.nrows()),
            samples,
            states,
            series,
        });
    }
    let add = match stride(f.nrows()) {
        0 => return,
        4 => wide::<4>,
        8 => wide::<8>,
        12 => wide::<12>,
        16 => wide::<16>,
        _ => plain_add_free,
    };
    add(f, c, start, samples, states, series);
}

struct AddFree<'a, const N: usize> {
    f: Vec<[f64; N]>,
    /// Row by row.
    c: Vec<f64>,
    start: [f64; N],
    /// n, p.
    sizes: (usize, usize),
    samples: usize,
    states: &'a mut [f64],
    series: &'a mut [f64],
}

impl<const N: usize> NullaryFnOnce for AddFree<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (n, p) = self.sizes;
        let mut free = self.start;
        let series = self.series.chunks_exact_mut(p);
        let samples = self.states.chunks_exact_mut(n).zip(series);
        for (states, series) in samples.take(self.samples) {
            for (state, free) in states.iter_mut().zip(&free) {
                *state += free;
            }
            for (value, c) in series.iter_mut().zip(self.c.chunks_exact(n)) {
                for (c, free) in c.iter().zip(&free) {
                    *value += c * free;
                }
            }
            let mut next = [0.0; N];
            for (column, &free) in self.f.iter().zip(&free) {
                add(&mut next, column, free);
            }
            free = next;
        }
    }
}

fn plain_add_free(
    f: &Mat<f64>,
    c: &Mat<f64>,
    start: &[f64],
    samples: usize,
    states: &mut [f64],
    series: &mut [f64],
) {
    let (n, p) = (f.nrows(), c.nrows());
    let (mut free, mut next) = (start.to_vec(), vec![0.0; n]);
    let samples = (states.chunks_exact_mut(n))
        .zip(series.chunks_exact_mut(p))
        .take(samples);
    for (states, series) in samples {
        add_scaled(states, 1.0, &free);
        add_product(series, c, &free);
        next.fill(0.0);
        add_product(&mut next, f, &free);
        std::mem::swap(&mut free, &mut next);
    }
}

/// The rows `c Fᵏ`, each filled up to [`stride`], for k = 0, 1, … until they are at most `decayed` times the
/// largest, or `samples` times. `None` if they overflow.
pub(crate) fn free_rows(
    f: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    samples: usize,
    decayed: f64,
) -> Option<Vec<f64>> {
    let lanes = stride(f.nrows());
    let padded = |matrix: MatRef<'_, f64>| -> Vec<f64> {
        let at = |i, j| {
            if j < matrix.ncols() {
                matrix[(i, j)]
            } else {
                0.0
            }
        };
        let row = |i| (0..lanes).map(move |j| at(i, j));
        (0..matrix.nrows()).flat_map(row).collect()
    };
    let (f, rows) = (padded(f), padded(c));
    match lanes {
        0 => Some(Vec::new()),
        4 => widely(FreeRows::<4>::new(&f, &rows, samples, decayed)),
        8 => widely(FreeRows::<8>::new(&f, &rows, samples, decayed)),
        12 => widely(FreeRows::<12>::new(&f, &rows, samples, decayed)),
        16 => widely(FreeRows::<16>::new(&f, &rows, samples, decayed)),
        _ => plain_free_rows(&f, rows, lanes, samples, decayed),
    }
}

struct FreeRows<'a, const N: usize> {
    /// Row by row.
    f: &'a [[f64; N]],
    current: Vec<[f64; N]>,
    samples: usize,
    decayed: f64,
}

impl<'a, const N: usize> FreeRows<'a, N> {
    fn new(f: &'a [f64], rows: &[f64], samples: usize, decayed: f64) -> Self {
        Self {
            f: f.as_chunks().0,
            current: rows.as_chunks().0.to_vec(),
            samples,
            decayed,
        }
    }
}

impl<const N: usize> NullaryFnOnce for FreeRows<'_, N> {
    type Output = Option<Vec<f64>>;

    #[inline(always)]
    fn call(mut self) -> Self::Output {
        let mut rows = Vec::new();
        let mut largest = 0.0_f64;
        for _ in 0..self.samples {
            let (mut sizes, mut finite) = ([0.0; N], true);
            for row in &self.current {
                for (size, value) in sizes.iter_mut().zip(row) {
                    let value = value.abs();
                    *size = if value > *size { value } else { *size };
                    finite &= value.is_finite();
                }
            }
            let size = sizes.into_iter().fold(0.0, f64::max);
            if size <= self.decayed * largest {
                break;
            }
            if !(finite && size < f64::MAX.sqrt()) {
                return None;
            }
            largest = largest.max(size);
            rows.extend_from_slice(self.current.as_flattened());
            for row in &mut self.current {
                let mut next = [0.0; N];
                for (f, &value) in self.f.iter().zip(&*row) {
                    add(&mut next, f, value);
                }
                *row = next;
            }
        }
        Some(rows)
    }
}

fn plain_free_rows(
    f: &[f64],
    mut current: Vec<f64>,
    n: usize,
    samples: usize,
    decayed: f64,
) -> Option<Vec<f64>> {
    let (mut rows, mut largest) = (Vec::new(), 0.0_f64);
    let mut next = vec![0.0; current.len()];
    for _ in 0..samples {
        let sizes = current.iter().map(|value| value.abs());
        let size = sizes.fold(0.0, f64::max);
        if size <= decayed * largest {
            break;
        }
        if !(size < f64::MAX.sqrt() && current.iter().all(|value| value.is_finite())) {
            return None;
        }
        largest = largest.max(size);
        rows.extend_from_slice(&current);
        next.fill(0.0);
        for (next, row) in next.chunks_exact_mut(n).zip(current.chunks_exact(n)) {
            for (&value, f) in row.iter().zip(f.chunks_exact(n)) {
                add_scaled(next, value, f);
            }
        }
        std::mem::swap(&mut current, &mut next);
    }
    Some(rows)
}
