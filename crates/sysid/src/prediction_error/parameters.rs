//! The free entries of a model as one vector, and the directions in it that change nothing.

use deepc_core::faer::Mat;

use super::Focus;
use crate::input_fit::InputStructure;
use crate::state_space::SystemMatrices;

/// Directions of the tangent of the equivalent models below this fraction of the largest are zero.
const GAUGE_TOLERANCE: f64 = 1e-10;

/// Which entries are free. Models here have active inputs only.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub n: usize,
    /// Active inputs.
    pub inputs: usize,
    /// So many of them, the first ones, have a free column of B.
    pub dynamic_inputs: usize,
    pub p: usize,
    /// Positions, among the active inputs, of the free columns of D.
    pub feedthrough: Vec<usize>,
    /// A, B, C and D are free.
    pub dynamics: bool,
    /// K is free.
    pub gain: bool,
}

/// An entry of a matrix of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Entry {
    A(usize, usize),
    B(usize, usize),
    C(usize, usize),
    D(usize, usize),
    K(usize, usize),
}

impl Layout {
    pub fn new(n: usize, p: usize, structure: &InputStructure, focus: Focus) -> Self {
        Self {
            n,
            inputs: structure.active().len(),
            dynamic_inputs: structure.dynamic(),
            p,
            feedthrough: structure.feedthrough(),
            dynamics: focus != Focus::Gain,
            gain: focus != Focus::Simulation,
        }
    }

    /// All free entries, in the order of the parameter vector.
    pub fn entries(&self) -> Vec<Entry> {
        let (n, m, p) = (self.n, self.dynamic_inputs, self.p);
        let grid = |rows: usize, columns: usize, of: fn(usize, usize) -> Entry| {
            (0..rows).flat_map(move |i| (0..columns).map(move |j| of(i, j)))
        };
        let mut entries = Vec::new();
        if self.dynamics {
            entries.extend(grid(n, n, Entry::A));
            entries.extend(grid(n, m, Entry::B));
            entries.extend(grid(p, n, Entry::C));
            for l in 0..p {
                entries.extend(self.feedthrough.iter().map(|&j| Entry::D(l, j)));
            }
        }
        if self.gain {
            entries.extend(grid(n, p, Entry::K));
        }
        entries
    }

    /// Signals that drive the sensitivities: states and inputs if A to D are free, innovations if
    /// K is.
    pub fn signals(&self) -> usize {
        let dynamics = if self.dynamics {
            self.n + self.inputs
        } else {
            0
        };
        dynamics + if self.gain { self.p } else { 0 }
    }

    /// An orthonormal basis, in parameters multiplied by `scales`, of the complement of the
    /// directions A S − S A, −S B, C S, −S K in which a change of the state basis moves the
    /// parameters (data-driven local coordinates: McKelvey, Helmersson and Ribarits 2004).
    pub fn complement(&self, model: &SystemMatrices, scales: &[f64]) -> Mat<f64> {
        let (n, count) = (self.n, scales.len());
        if !self.dynamics || n == 0 {
            return Mat::identity(count, count);
        }
        let mut tangent = Mat::<f64>::zeros(count, n * n);
        for (row, entry) in self.entries().into_iter().enumerate() {
            // S has a 1 in row a, column b, which is column a·n + b here.
            let mut add = |a: usize, b: usize, value: f64| {
                tangent[(row, a * n + b)] += scales[row] * value;
            };
            match entry {
                Entry::A(i, j) => {
                    for h in 0..n {
                        add(h, j, model.a[(i, h)]);
                        add(i, h, -model.a[(h, j)]);
                    }
                }
                Entry::B(i, j) => (0..n).for_each(|h| add(i, h, -model.b[(h, j)])),
                Entry::C(i, j) => (0..n).for_each(|h| add(h, j, model.c[(i, h)])),
                Entry::D(..) => {}
                Entry::K(i, j) => (0..n).for_each(|h| add(i, h, -model.k[(h, j)])),
            }
        }
        let qr = tangent.col_piv_qr();
        let r = qr.R();
        let steps = r.nrows().min(r.ncols());
        let first = if steps > 0 { r[(0, 0)].abs() } else { 0.0 };
        let rank = (0..steps)
            .take_while(|&i| r[(i, i)].abs() > GAUGE_TOLERANCE * first)
            .count();
        qr.compute_Q().subcols(rank, count - rank).to_owned()
    }

    /// `model + change`, where `change` is a vector of all free entries.
    pub fn moved(&self, model: &SystemMatrices, change: &[f64]) -> SystemMatrices {
        let mut moved = model.clone();
        for (entry, change) in self.entries().into_iter().zip(change) {
            match entry {
                Entry::A(i, j) => moved.a[(i, j)] += change,
                Entry::B(i, j) => moved.b[(i, j)] += change,
                Entry::C(i, j) => moved.c[(i, j)] += change,
                Entry::D(i, j) => moved.d[(i, j)] += change,
                Entry::K(i, j) => moved.k[(i, j)] += change,
            }
        }
        moved
    }
}
