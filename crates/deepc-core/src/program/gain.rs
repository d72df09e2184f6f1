//! The optimum without constraints, as one constant matrix.

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, MatRef, Par};

use super::common::Common;
use super::error::ProgramError;
use super::future_map::Elimination;
use super::stage_cost::StageCost;
use crate::columns::{Columns, add_scaled};
use crate::linalg;
use crate::predictor::Predictor;

/// A direction of the plan with less than this fraction of the largest pivot is not determined.
const PIVOT_TOLERANCE: f64 = 1e-12;

/// The gain on the known part itself may differ from the one on its coordinates by this fraction
/// of a channel's size.
const PROBE_TOLERANCE: f64 = 1e-10;

/// Pasts on which the two are compared.
const PROBES: usize = 16;

/// f* = K (c or z, weighted references, u(−1)).
pub(super) struct Gain {
    /// K, n×(...).
    pub matrix: Columns,
    /// Entries of r with a weight.
    weighted: Vec<usize>,
    /// Positions in z of the entries of u(−1) that the cost of changes pulls to.
    newest: Vec<usize>,
    /// Length of c if K acts on c; `None` if it acts on z, which saves a triangular solve.
    coordinates: Option<usize>,
    /// R with `RᵀR` = blkdiag(I, 0) + `MᵀWM`, k×k, upper triangular.
    pub root: Mat<f64>,
    /// Vᵀ = M R⁻¹, n×k.
    pub spread: Mat<f64>,
    parameters: Vec<f64>,
    /// The first rows of K that look at one reference only: its number among those with a weight, and
    /// the entry. Inputs without constraints are their own references where nothing else is weighed.
    single: Vec<(usize, f64)>,
    /// K's part of the references last seen.
    reference_part: Vec<f64>,
    reference_part_is_known: bool,
}

impl Gain {
    pub fn new(
        common: &Common,
        elimination: &Elimination,
        predictor: Option<&Predictor>,
    ) -> Result<Self, ProgramError> {
        let (map, cost) = (elimination.map(), &common.cost);
        let directions = map.directions();
        let n = directions.nrows();
        let least_squares = LeastSquares::new(cost, map.charged.ncols(), &directions)?;
        let mut on_coordinates =
            &directions * least_squares.start_response(cost, map.known.as_ref());
        on_coordinates += &map.known;
        let weighted = cost.weighted();
        let pulls = &directions * least_squares.pull_response(cost, &weighted);
        let newest: Vec<_> = cost.newest_inputs().map(|(_, source, _)| source).collect();

        let mut known = elimination.on_known(on_coordinates.as_ref());
        let direct = elimination.is_direct()
            || predictor
                .is_some_and(|predictor| agree(&known, &on_coordinates, elimination, predictor));
        let coordinates = (!direct).then(|| on_coordinates.ncols());
        let (first, newest) = if direct {
            for (k, &source) in newest.iter().enumerate() {
                let pull = pulls.col(weighted.len() + k);
                let entries = known.col_mut(source).iter_mut().zip(pull.iter());
                entries.for_each(|(entry, value)| *entry += value);
            }
            (known, Vec::new())
        } else {
            (on_coordinates, newest)
        };
        let others = weighted.len() + newest.len();
        let mut matrix = Mat::zeros(n, first.ncols() + others);
        matrix
            .as_mut()
            .subcols_mut(0, first.ncols())
            .copy_from(&first);
        matrix
            .as_mut()
            .subcols_mut(first.ncols(), others)
            .copy_from(pulls.subcols(0, others));
        check_finite(&matrix)?;
        let mut v = directions.transpose().to_owned();
        solve_lower_triangular_in_place(least_squares.root.transpose(), v.as_mut(), Par::Seq);
        let references = matrix.subcols(first.ncols(), weighted.len());
        Ok(Self {
            single: leading_single_rows(references),
            parameters: vec![0.0; matrix.ncols()],
            reference_part: vec![0.0; n],
            reference_part_is_known: false,
            matrix: Columns::from_matrix(matrix.as_ref()),
            weighted,
            newest,
            coordinates,
            root: least_squares.root,
            spread: v.transpose().to_owned(),
        })
    }

    /// Writes f*.
    ///
    /// References seldom move, and their part of K is as large as the rest: its product is kept and
    /// taken anew only when an entry differs in any bit. The sum has one order either way, so that
    /// what was kept changes no bit of f*.
    pub fn write_optimum(&mut self, common: &Common, elimination: &Elimination, out: &mut [f64]) {
        let known = common.known.as_slice();
        let first = self.coordinates.unwrap_or(known.len());
        let (start, rest) = self.parameters.split_at_mut(first);
        match self.coordinates {
            None => start.copy_from_slice(known),
            Some(_) => elimination.write_coordinates(known, start),
        }
        let (references, newest) = rest.split_at_mut(self.weighted.len());
        let mut differ = !self.reference_part_is_known;
        for (value, &position) in references.iter_mut().zip(&self.weighted) {
            let now = common.reference[position];
            differ |= value.to_bits() != now.to_bits();
            *value = now;
        }
        for (value, &position) in newest.iter_mut().zip(&self.newest) {
            *value = known[position];
        }
        let matrix = &self.matrix;
        let last = first + references.len();
        if differ {
            let (single, rest) = self.reference_part.split_at_mut(self.single.len());
            for (part, &(column, factor)) in single.iter_mut().zip(&self.single) {
                *part = factor * references[column];
            }
            matrix.multiply(rest, first, references);
            self.reference_part_is_known = true;
        }
        matrix.multiply(out, 0, start);
        for (j, &value) in newest.iter().enumerate() {
            add_scaled(out, matrix.column(last + j), value);
        }
        for (out, part) in out.iter_mut().zip(&self.reference_part) {
            *out += part;
        }
    }
}

/// The first rows with at most one entry: its column and the entry.
fn leading_single_rows(matrix: MatRef<'_, f64>) -> Vec<(usize, f64)> {
    let rows = matrix.row_iter().map_while(|row| {
        let mut entries = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
        match (entries.next(), entries.next()) {
            (entry, None) => Some(entry.map_or((0, 0.0), |(column, &value)| (column, value))),
            _ => None,
        }
    });
    if matrix.ncols() == 0 {
        return Vec::new();
    }
    rows.collect()
}

/// Whether the gain on z predicts what the gain on c predicts. Where the known part is spanned
/// badly, forming the former loses digits that a triangular solve per step keeps.
fn agree(
    on_known: &Mat<f64>,
    on_coordinates: &Mat<f64>,
    elimination: &Elimination,
    predictor: &Predictor,
) -> bool {
    let (h, scales) = (predictor.stacked(), predictor.row_scales());
    let (known, n) = (on_known.ncols(), on_known.nrows());
    let mut c = vec![0.0; on_coordinates.ncols()];
    let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
    (0..PROBES).all(|probe| {
        let column = probe * (h.ncols() - 1) / (PROBES - 1);
        let z: Vec<_> = (0..known).map(|i| h[(i, column)]).collect();
        let size = z.iter().zip(scales).map(|(z, s)| z.abs() / s);
        let size = size.fold(0.0, f64::max);
        linalg::multiply(&mut a, on_known.as_ref(), &z);
        elimination.write_coordinates(&z, &mut c);
        linalg::multiply(&mut b, on_coordinates.as_ref(), &c);
        let mut entries = a.iter().zip(&b).zip(&scales[known..]);
        entries.all(|((a, b), scale)| (a - b).abs() <= PROBE_TOLERANCE * size * scale)
    })
}

/// x that minimises ‖blkdiag(I, 0)x‖² + ‖√W(Φc + Mx − r)‖², for any c and r. By QR and not by the
/// Hessian `RᵀR`, whose condition is the square of R's.
struct LeastSquares {
    root: Mat<f64>,
    /// Rows of the orthonormal factor that belong to √W.
    costs: Mat<f64>,
}

impl LeastSquares {
    fn new(cost: &StageCost, charged: usize, directions: &Mat<f64>) -> Result<Self, ProgramError> {
        let k = directions.ncols();
        let costs = cost.root_times(directions.as_ref());
        let height = (charged + costs.nrows()).max(k);
        let stacked = Mat::from_fn(height, k, |i, j| match i.checked_sub(charged) {
            None => f64::from(u8::from(i == j)),
            Some(i) if i < costs.nrows() => costs[(i, j)],
            Some(_) => 0.0,
        });
        let qr = stacked.qr();
        let root = linalg::lower_from_upper(qr.thin_R()).transpose().to_owned();
        let pivots: Vec<_> = (0..k).map(|i| root[(i, i)].abs()).collect();
        let largest = linalg::max_abs(&pivots);
        // What is charged has a pivot of at least 1, whatever the others are.
        let least = (PIVOT_TOLERANCE * largest).min(0.5);
        let undetermined = |pivot: &f64| pivot.is_nan() || *pivot <= least;
        if let Some(direction) = pivots.iter().position(undetermined) {
            return Err(ProgramError::Undetermined {
                direction,
                directions: k,
                curvature: pivots[direction],
                largest,
            });
        }
        let q = qr.compute_thin_Q();
        Ok(Self {
            root,
            costs: q.subrows(charged, costs.nrows()).to_owned(),
        })
    }

    /// x from c.
    fn start_response(&self, cost: &StageCost, start: MatRef<'_, f64>) -> Mat<f64> {
        let mut x = self.costs.transpose() * cost.root_times(start);
        x *= faer::Scale(-1.0);
        solve_upper_triangular_in_place(self.root.as_ref(), x.as_mut(), Par::Seq);
        x
    }

    /// x from the weighted references and u(−1).
    fn pull_response(&self, cost: &StageCost, weighted: &[usize]) -> Mat<f64> {
        let references = weighted.iter().enumerate();
        let references = references.map(|(row, &i)| (row, cost.weights[i].sqrt()));
        let newest = cost.newest_inputs();
        let newest = newest.map(|(row, _, weight)| (weighted.len() + row, weight.sqrt()));
        let pulls: Vec<_> = references.chain(newest).collect();
        let mut x = Mat::from_fn(self.root.nrows(), pulls.len(), |i, j| {
            let (row, root) = pulls[j];
            root * self.costs[(row, i)]
        });
        solve_upper_triangular_in_place(self.root.as_ref(), x.as_mut(), Par::Seq);
        x
    }
}

fn check_finite(gain: &Mat<f64>) -> Result<(), ProgramError> {
    for column in 0..gain.ncols() {
        if let Some(row) = gain.col(column).iter().position(|v| !v.is_finite()) {
            return Err(ProgramError::Factorisation {
                what: "the gain of the unconstrained optimum",
                row,
                column,
            });
        }
    }
    Ok(())
}
