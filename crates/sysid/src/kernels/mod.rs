//! The loops over samples that identification spends its time in, as wide as the processor at hand has
//! it. The width changes no bit of a result: every sum is added up in the order of a plain loop, and
//! nothing is fused.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

mod free;
mod householder;

use deepc_core::faer::Mat;
use pulp::{Arch, NullaryFnOnce};

pub(crate) use free::{add_free, free_rows};
pub(crate) use householder::Block;

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
