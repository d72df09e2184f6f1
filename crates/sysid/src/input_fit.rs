//! B, D and the initial states by least squares on the simulated output, for A and C given.

use deepc_core::faer::{Mat, MatRef};

use crate::error::SysidError;
use crate::kernels::{Output, march};
use crate::least_squares::{StreamedQr, solve, thin_svd};
use crate::regressors::{BLOCK, FilterBank, FreeResponse, Packed, PackedRecord, add_product};
use crate::state_space::SystemMatrices;
use crate::working::WorkingData;

/// Combinations of parameters whose effect is below this fraction of the largest (each parameter
/// scaled to an effect of size 1) are rounding: they stay at zero.
const RANK_TOLERANCE: f64 = 1e-13;

/// States less observable than this fraction of the best are scaled as if they had it.
const CONDITION: f64 = 1e-8;

/// Which inputs act, and how.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct InputStructure {
    /// Per input M: its column of B is free; otherwise zero.
    pub dynamics: Vec<bool>,
    /// Per input M: its column of D is free; otherwise zero.
    pub feedthrough: Vec<bool>,
}

impl InputStructure {
    /// Indices of the inputs that act: first those with a free column of B, then those with one of D
    /// only.
    pub fn active(&self) -> Vec<usize> {
        let inputs = || 0..self.dynamics.len();
        let direct = inputs().filter(|&j| self.feedthrough[j] && !self.dynamics[j]);
        inputs()
            .filter(|&j| self.dynamics[j])
            .chain(direct)
            .collect()
    }

    /// How many of them have a free column of B.
    pub fn dynamic(&self) -> usize {
        self.dynamics.iter().filter(|&&free| free).count()
    }

    /// Positions among the active inputs of those with a free column of D.
    pub fn feedthrough(&self) -> Vec<usize> {
        let active = self.active().into_iter().enumerate();
        let free = active.filter(|&(_, j)| self.feedthrough[j]);
        free.map(|(position, _)| position).collect()
    }
}

/// What [`fit_inputs`] found.
pub(crate) struct InputFit {
    /// n×M.
    pub b: Mat<f64>,
    /// p×M.
    pub d: Mat<f64>,
    /// x(0) of every record.
    pub initial_states: Vec<Vec<f64>>,
    /// Mean squared simulation error over all samples and (scaled) outputs.
    pub loss: f64,
}

/// Fits B, D and x(0) of every record to `y(k) = C Aᵏ x(0) + Σ C Aᵏ⁻¹⁻ⁱ B u(i) + D u(k)`, which is
/// linear in them (Verhaegen and Varga 1994). Parameters that the data do not determine are of minimum norm.
///
/// # Errors
/// A is so unstable that its response overflows within a record, or a decomposition fails.
pub(crate) fn fit_inputs(
    data: &WorkingData,
    a: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    structure: &InputStructure,
) -> Result<InputFit, SysidError> {
    let (active, free) = (structure.active(), structure.feedthrough());
    let packed = Packed::new(data, &active);
    let (n, p) = (a.nrows(), c.nrows());
    let (to_old, to_new) = observable_basis(a, c, packed.longest())?;
    let (a, c) = (&to_new * a * &to_old, c * &to_old);
    let equal = Mat::identity(p, p);
    let response = FreeResponse::new(a.as_ref(), c.as_ref(), packed.longest())?;
    let fitted = fit_packed(
        &packed,
        &a,
        &c,
        structure.dynamic(),
        &free,
        &equal,
        &response,
    )?;
    let mut fit = InputFit {
        b: Mat::zeros(n, structure.dynamics.len()),
        d: Mat::zeros(p, structure.dynamics.len()),
        initial_states: Vec::with_capacity(packed.records.len()),
        loss: fitted.squares / (packed.samples() * p).max(1) as f64,
    };
    let b = &to_old * &fitted.b;
    for (position, &j) in active.iter().enumerate() {
        fit.b.col_mut(j).copy_from(b.col(position));
        fit.d.col_mut(j).copy_from(fitted.d.col(position));
    }
    for (basis, rows) in fitted.eliminated {
        let (states, parameters) = (rows.nrows(), &fitted.parameters);
        let right = rows.subcols(rows.ncols() - 1, 1)
            - rows.subcols(states, parameters.nrows()) * parameters;
        let stack = Mat::from_fn(states, states + 1, |i, j| {
            if j < states {
                rows[(i, j)]
            } else {
                right[(i, 0)]
            }
        });
        let coordinates = solve(stack.as_ref(), states, RANK_TOLERANCE)?.x;
        let state = &to_old * (basis * coordinates);
        fit.initial_states.push(if n > 0 {
            state.col_as_slice(0).to_vec()
        } else {
            Vec::new()
        });
    }
    Ok(fit)
}

/// What [`fit_packed`] found.
pub(crate) struct PackedFit {
    /// n×(active inputs).
    pub b: Mat<f64>,
    /// p×(active inputs).
    pub d: Mat<f64>,
    /// Sum of the weighted squares that are left.
    squares: f64,
    /// B row by row, then the free columns of D.
    parameters: Mat<f64>,
    /// Per record: the basis of its initial state and the rows that give it once the rest is known.
    eliminated: Vec<(Mat<f64>, Mat<f64>)>,
}

/// [`fit_inputs`] in the basis of `a`, over active inputs, the first `dynamic` of which have a free column
/// of B, with errors e weighed by ‖W e‖². `response` is that of A and W C.
pub(crate) fn fit_packed(
    packed: &Packed,
    a: &Mat<f64>,
    c: &Mat<f64>,
    dynamic: usize,
    free: &[usize],
    weights: &Mat<f64>,
    response: &FreeResponse,
) -> Result<PackedFit, SysidError> {
    let (n, p, inputs) = (a.nrows(), c.nrows(), packed.inputs);
    let c = weights * c;
    let unknowns = n * dynamic + p * free.len();
    let mut bank = FilterBank::new(a.as_ref(), c.as_ref(), dynamic);
    let mut all = StreamedQr::new(unknowns + 1, BLOCK);
    let mut eliminated = Vec::with_capacity(packed.records.len());
    for record in &packed.records {
        let basis = response.basis(record.samples)?;
        let columns = Columns {
            response,
            basis: &basis,
            free,
            inputs,
            dynamic,
            weights,
        };
        let mut qr = StreamedQr::new(basis.ncols() + unknowns + 1, BLOCK);
        bank.reset();
        columns.push(&mut qr, &mut bank, record, p);
        let r = qr.triangle();
        let states = basis.ncols().min(r.nrows());
        eliminated.push((basis, r.subrows(0, states).to_owned()));
        for first in (states..r.nrows()).step_by(BLOCK) {
            let count = BLOCK.min(r.nrows() - first);
            let rest = r.submatrix(first, states, count, unknowns + 1);
            all.rows(count).copy_from(rest);
        }
    }
    let r = all.triangle();
    let parameters = solve(r, unknowns, RANK_TOLERANCE)?.x;
    let residual = r.subcols(0, unknowns) * &parameters - r.subcols(unknowns, 1);
    let mut d = Mat::zeros(p, inputs);
    for l in 0..p {
        for (position, &j) in free.iter().enumerate() {
            d[(l, j)] = parameters[(n * dynamic + l * free.len() + position, 0)];
        }
    }
    Ok(PackedFit {
        b: Mat::from_fn(n, inputs, |i, j| {
            if j < dynamic {
                parameters[(i * dynamic + j, 0)]
            } else {
                0.0
            }
        }),
        d,
        squares: residual.squared_norm_l2(),
        parameters,
        eliminated,
    })
}

/// The columns of one record: initial state, B, D, output.
struct Columns<'a> {
    response: &'a FreeResponse,
    basis: &'a Mat<f64>,
    free: &'a [usize],
    /// Active ones.
    inputs: usize,
    /// Those of them that drive the state, the first ones.
    dynamic: usize,
    weights: &'a Mat<f64>,
}

impl Columns<'_> {
    fn push(&self, qr: &mut StreamedQr, bank: &mut FilterBank, record: &PackedRecord, p: usize) {
        let (states, n) = (self.basis.ncols(), self.basis.nrows());
        let (dynamic, direct) = (n * self.dynamic, p * self.free.len());
        let per_block = (BLOCK / p).max(1);
        let mut k = 0;
        while k < record.samples {
            let count = per_block.min(record.samples - k);
            let mut block = qr.rows(count * p);
            block.fill(0.0);
            for row in 0..count * p {
                let (sample, l) = (k + row / p, row % p);
                let inputs = &record.inputs[sample * self.inputs..(sample + 1) * self.inputs];
                if sample < self.response.kept() {
                    let free = self.response.at(sample, l);
                    for j in 0..states {
                        let basis = self.basis.col_as_slice(j).iter();
                        block[(row, j)] = basis.zip(free).map(|(b, r)| b * r).sum();
                    }
                }
                for (j, value) in bank.responses(l).flatten().enumerate() {
                    block[(row, states + j)] = *value;
                }
                let mut output = 0.0;
                for h in 0..p {
                    let weight = self.weights[(l, h)];
                    output += weight * record.outputs[sample * p + h];
                    for (j, &input) in self.free.iter().enumerate() {
                        let column = states + dynamic + h * self.free.len() + j;
                        block[(row, column)] = weight * inputs[input];
                    }
                }
                block[(row, states + dynamic + direct)] = output;
                if l + 1 == p {
                    bank.step(&inputs[..self.dynamic]);
                }
            }
            k += count;
        }
    }
}

/// Initial states of all records by least squares on the output of the predictor
/// `x(k+1) = A x + B u + K (y − C x − D u)`, which is the simulation when K is zero.
///
/// # Errors
/// A − KC is so unstable that its response overflows within a record.
pub(crate) fn fit_initial_states(
    data: &WorkingData,
    matrices: &SystemMatrices,
) -> Result<Vec<Vec<f64>>, SysidError> {
    let inputs: Vec<usize> = (0..matrices.inputs()).collect();
    let packed = Packed::new(data, &inputs);
    let predictor = matrices.predictor();
    let longest = packed.longest();
    let (to_old, to_new) = observable_basis(predictor.as_ref(), matrices.c.as_ref(), longest)?;
    let (f, c) = (&to_new * predictor * &to_old, &matrices.c * &to_old);
    let response = FreeResponse::new(f.as_ref(), c.as_ref(), longest)?;
    let records = packed.records.iter().map(|record| {
        let mut errors = errors_from_rest(record, matrices);
        let state = response.take_off(&mut errors, &response.basis(record.samples)?);
        let mut old = vec![0.0; state.len()];
        add_product(&mut old, &to_old, &state);
        Ok(old)
    });
    records.collect()
}

/// One-step prediction errors, row by row, from x(0) = 0.
fn errors_from_rest(record: &PackedRecord, matrices: &SystemMatrices) -> Vec<f64> {
    let mut errors = record.outputs.clone();
    let initial = vec![0.0; matrices.order()];
    march(
        matrices,
        &initial,
        &record.inputs,
        &mut errors,
        &mut [],
        Output::Residual,
    );
    errors
}

/// (T, T⁻¹) with x = T z: the states z respond about equally and orthogonally at the outputs, so
/// that the regressors are as well conditioned as the inputs allow, whatever basis A came in.
fn observable_basis(
    f: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    samples: usize,
) -> Result<(Mat<f64>, Mat<f64>), SysidError> {
    let n = f.nrows();
    let response = FreeResponse::new(f, c, samples)?;
    let mut qr = StreamedQr::new(n, BLOCK);
    let p = c.nrows();
    for k in 0..response.kept() {
        let mut rows = qr.rows(p);
        for l in 0..p {
            for j in 0..n {
                rows[(l, j)] = response.at(k, l)[j];
            }
        }
    }
    let r = qr.triangle();
    let largest = (0..n).map(|j| r.col(j).norm_l2()).fold(0.0, f64::max);
    if largest == 0.0 {
        return Ok((Mat::identity(n, n), Mat::identity(n, n)));
    }
    let scales: Vec<f64> = (0..n)
        .map(|j| match r.col(j).norm_l2() {
            0.0 => largest,
            length => length,
        })
        .collect();
    let scaled = Mat::from_fn(n, n, |i, j| {
        if i < r.nrows() {
            r[(i, j)] / scales[j]
        } else {
            0.0
        }
    });
    let svd = thin_svd(scaled.as_ref(), "the observability of a model")?;
    let sizes: Vec<f64> = svd
        .values
        .iter()
        .map(|value| value.max(CONDITION * svd.values[0]))
        .collect();
    let to_old = Mat::from_fn(n, n, |i, j| svd.v[(i, j)] / sizes[j] / scales[i]);
    let to_new = Mat::from_fn(n, n, |i, j| sizes[i] * svd.v[(j, i)] * scales[j]);
    Ok((to_old, to_new))
}

#[cfg(test)]
mod tests;
