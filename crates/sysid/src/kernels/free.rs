//! Motions without inputs.

#![allow(
    clippy::inline_always,
    reason = "a loop is compiled for the processor at hand only where it is inlined into `dispatch`"
)]

use deepc_core::faer::{Mat, MatRef};
use pulp::NullaryFnOnce;

use super::{add, add_product, add_scaled, lanes, stride, widely};

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
