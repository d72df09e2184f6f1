//! How fast this machine reads and copies memory: no step that reads its matrices once can be
//! faster.

use std::hint::black_box;
use std::time::Instant;

use anyhow::Result;
use faer::Mat;
use faer::linalg::matmul::dot::inner_prod;
use faer::{Col, ColRef, Conj};

use crate::run::Run;

/// Rates for arrays that together have `bytes`.
#[derive(Debug, Clone, Copy)]
pub struct Rate {
    pub bytes: usize,
    /// Inner product: reads all bytes.
    pub read_gb_s: f64,
    /// Copy: reads one half and writes the other.
    pub copy_gb_s: f64,
}

pub fn measure(run: &Run) -> Result<Vec<Rate>> {
    run.stage("memory bandwidth");
    let mut rates = Vec::new();
    for &bytes in run.extent().bandwidth_bytes {
        run.check()?;
        rates.push(rate(bytes));
    }
    Ok(rates)
}

fn rate(bytes: usize) -> Rate {
    let length = bytes / (2 * size_of::<f64>());
    let source: Vec<f64> = (0..length).map(|i| (i % 7) as f64).collect();
    let mut target = vec![1.0; length];
    let repeats = ((64 << 20) / bytes).clamp(3, 2000);
    let best = |work: &mut dyn FnMut()| {
        let mut best = f64::INFINITY;
        for _ in 0..repeats {
            let start = Instant::now();
            work();
            best = best.min(start.elapsed().as_secs_f64());
        }
        bytes as f64 / best / 1e9
    };
    let copy_gb_s = best(&mut || black_box(&mut target).copy_from_slice(black_box(&source)));
    let read_gb_s = best(&mut || {
        let x = ColRef::from_slice(black_box(&source[..]));
        let y = ColRef::from_slice(black_box(&target[..]));
        black_box(inner_prod(x.transpose(), Conj::No, y, Conj::No));
    });
    Rate {
        bytes,
        read_gb_s,
        copy_gb_s,
    }
}

/// The read rate measured for about `bytes`.
pub fn read_rate(rates: &[Rate], bytes: usize) -> Option<f64> {
    let distance = |rate: &Rate| (rate.bytes as f64 / bytes as f64).ln().abs();
    let nearest = rates
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    Some(nearest.read_gb_s)
}

/// The bare product that every condensed step takes at least once: the gain of the unconstrained
/// optimum with what is known, past and references.
pub struct BareProduct {
    matrix: Mat<f64>,
    known: Col<f64>,
    optimum: Col<f64>,
}

impl BareProduct {
    pub fn new(rows: usize, columns: usize) -> Self {
        Self {
            matrix: Mat::from_fn(rows, columns, |i, j| ((i * 31 + j * 17) % 13) as f64 - 6.0),
            known: Col::from_fn(columns, |j| (j % 5) as f64),
            optimum: Col::zeros(rows),
        }
    }

    pub fn columns(&self) -> usize {
        self.matrix.ncols()
    }

    pub fn bytes(&self) -> usize {
        self.matrix.nrows() * self.matrix.ncols() * size_of::<f64>()
    }

    /// Seconds of one product.
    pub fn time(&mut self) -> f64 {
        let start = Instant::now();
        faer::linalg::matmul::matmul(
            self.optimum.as_mut(),
            faer::Accum::Replace,
            black_box(&self.matrix),
            black_box(&self.known),
            1.0,
            faer::Par::Seq,
        );
        black_box(&self.optimum);
        start.elapsed().as_secs_f64()
    }
}
