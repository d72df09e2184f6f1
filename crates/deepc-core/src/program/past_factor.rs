//! Elimination of g and the slacks.
//!
//! Weigh g and the slacks to one vector `ζ = (√λ_g·g, −√λ_u·σ_u, −√λ_y·σ_y)`. Then
//! `w = col(u_ini, y_ini, u, y) = Mᵀζ` with `M = [H̄ᵀ/√λ_g; diag(1/√λ_u, 1/√λ_y), 0]`, and the cost
//! of g and σ is ‖ζ‖². Order the past into the entries whose slack is hard (h) and those that
//! have slack (s). With the QR decomposition
//!
//! ```text
//!        h    s    f                 R11 = [R_hh R_hs; 0 R_ss]
//! M = Θ [R_hh R_hs R_hf]             R11ᵀ a = w_ini      f0 = R12ᵀ a
//!       [     R_ss R_sf]             f = f0 + F z        F = R22ᵀ
//!       [          R_ff]             cost ‖a‖² + ‖z‖²
//! ```
//!
//! the cheapest ζ for a given w is Θ(a, z), so that z, (m+p)N numbers, is all that is left to
//! choose. `MᵀM` is never formed: its condition number is the square of M's and reaches 1e24 for
//! data without noise. F may be singular.
//!
//! Θ is found in steps so that what counts as spanned is decided on the data alone, whatever the
//! weights: first `H̄ᵀ = Θ_d R_d`, then the slack rows join (module `damping`). `R_hh` holds data
//! and nothing else. If the data do not span every past of the hard entries (data without noise,
//! more past samples than the plant's lag needs) it is singular. Then
//! `R_hh = [U₁ U₂] diag(S, 0) [V₁ V₂]ᵀ`: the past must have `V₂ᵀw_h = 0` and determines
//! α = `S⁻¹V₁ᵀw_h`, which takes the place of `a_h`; the rows `U₂ᵀ[R_hs R_hf]` are left for the slack
//! and the future, and a second QR decomposition takes them in.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::householder::{
    apply_block_householder_sequence_on_the_left_in_place_scratch as apply_scratch,
    apply_block_householder_sequence_on_the_left_in_place_with_conj as apply_householder,
};
use faer::linalg::solvers::Qr;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Conj, Mat, MatRef, Par};

use super::damping::Damping;
use super::error::ProgramError;
use crate::linalg;
use crate::predictor::Predictor;

/// Pasts that the data reach with less than this fraction of their strongest direction (channels
/// scaled), or of the entry itself, count as not spanned. Rounding leaves about 1e-14.
pub(super) const SPAN_TOLERANCE: f64 = 1e-12;

/// A pivot of an entry with slack below this fraction of its column is rounding: 1/√λ is lost in
/// the data.
const PIVOT_TOLERANCE: f64 = 1e-13;

pub(super) struct PastFactor {
    /// Of H̄ᵀ, with the past in `order`.
    data: Qr<f64>,
    data_columns: usize,
    lambda_g_root: f64,
    /// Positions in `w_ini`: the entries whose slack is hard, then those that have slack.
    order: Vec<usize>,
    /// √(1/λ) of the entries that have slack, in that order.
    slack_roots: Vec<f64>,
    damping: Damping,
    /// If the data do not span every past of the hard entries.
    deficient: Option<Box<Deficient>>,
    /// `l11·a` is the ordered `w_ini`, or, for a deficient past, `(α, w_s)`. Lower triangular.
    l11: Mat<f64>,
    /// f0 = l21·a; (m+p)N×(length of a).
    l21: Mat<f64>,
    /// F, (m+p)N×(m+p)N.
    pub future: Mat<f64>,
}

/// What the hard entries leave.
struct Split {
    deficient: Option<Box<Deficient>>,
    /// `R_hhᵀ`, or the identity for α.
    corner: Mat<f64>,
    /// `[R_hs R_hf]`, or `U₁ᵀ` times it.
    above: Mat<f64>,
    /// The triangular factor of all that is below, columns s and f.
    below: Mat<f64>,
}

struct Deficient {
    /// α = `map·w_h`; rank×(hard entries).
    map: Mat<f64>,
    /// Scaled hard pasts that the data span: `rank` orthonormal columns.
    span: Mat<f64>,
    scales: Vec<f64>,
    /// `[U₁ U₂]`, square.
    left: Mat<f64>,
    /// Orthonormal columns of the second QR decomposition.
    rest: Mat<f64>,
    scaled_past: Vec<f64>,
    coordinates: Vec<f64>,
}

impl PastFactor {
    /// `compliance`: `1/λ_u` or `1/λ_y` of every entry of `w_ini`, 0 where slack is hard.
    pub fn new(
        predictor: &Predictor,
        lambda_g: f64,
        compliance: &[f64],
    ) -> Result<Self, ProgramError> {
        let h = predictor.stacked();
        let (rows, data_columns) = h.shape();
        let past = compliance.len();
        let (mut order, soft): (Vec<_>, Vec<_>) =
            (0..past).partition(|&position| compliance[position] <= 0.0);
        let hard = order.len();
        order.extend_from_slice(&soft);
        let slack_roots: Vec<_> = soft.iter().map(|&i| compliance[i].sqrt()).collect();
        let data = linalg::qr_of_rows(h, &order);
        let lambda_g_root = lambda_g.sqrt();
        let r = Mat::from_fn(rows, rows, |i, j| {
            if i <= j {
                data.thin_R()[(i, j)] / lambda_g_root
            } else {
                0.0
            }
        });
        check_finite(r.as_ref())?;

        let scales: Vec<_> = order[..hard]
            .iter()
            .map(|&position| predictor.row_scales()[position])
            .collect();
        let mut split = Split::find(r.as_ref(), &scales)?;
        split.clear_rounding(soft.len());
        let damping = Damping::new(split.below.as_ref(), &slack_roots);
        let (rank, soft) = (split.corner.nrows(), soft.len());
        let damped = &damping.lower;
        let l11 = Mat::from_fn(rank + soft, rank + soft, |i, j| {
            match (i.checked_sub(rank), j.checked_sub(rank)) {
                (None, None) => split.corner[(i, j)],
                (None, Some(_)) => 0.0,
                (Some(i), None) => split.above[(j, i)],
                (Some(i), Some(j)) => damped[(i, j)],
            }
        });
        let future = rows - past;
        let l21 = Mat::from_fn(future, rank + soft, |i, j| match j.checked_sub(rank) {
            None => split.above[(j, soft + i)],
            Some(j) => damped[(soft + i, j)],
        });
        let factor = Self {
            future: damped.submatrix(soft, soft, future, future).to_owned(),
            data,
            data_columns,
            lambda_g_root,
            order,
            slack_roots,
            damping,
            deficient: split.deficient,
            l11,
            l21,
        };
        factor.check_slack_pivots(compliance)?;
        Ok(factor)
    }

    /// A slack so expensive that 1/√λ is rounding beside the data would amplify that rounding.
    fn check_slack_pivots(&self, compliance: &[f64]) -> Result<(), ProgramError> {
        let rank = self.l11.nrows() - self.slack_roots.len();
        for i in rank..self.l11.nrows() {
            let (pivot, column) = (self.l11[(i, i)].abs(), self.l11.row(i).norm_l2());
            if pivot <= PIVOT_TOLERANCE * column {
                let row = self.order[self.order.len() - self.l11.nrows() + i];
                return Err(ProgramError::SlackLost {
                    row,
                    lambda: 1.0 / compliance[row],
                    pivot,
                    column,
                    tolerance: PIVOT_TOLERANCE,
                });
            }
        }
        Ok(())
    }

    /// Relative part of the hard entries of the past that the data cannot explain.
    pub fn inconsistency(&mut self, past: &[f64]) -> f64 {
        let Some(deficient) = &mut self.deficient else {
            return 0.0;
        };
        deficient.inconsistency(self.order.iter().map(|&position| past[position]))
    }

    /// Length of a.
    pub fn rank(&self) -> usize {
        self.l11.nrows()
    }

    /// Writes a for a past.
    pub fn write_coordinates(&self, past: &[f64], a: &mut [f64]) {
        let soft = self.slack_roots.len();
        let (hard_order, soft_order) = self.order.split_at(self.order.len() - soft);
        let (from_hard, from_soft) = a.split_at_mut(self.l11.nrows() - soft);
        match &self.deficient {
            None => gather(past, hard_order, from_hard),
            Some(deficient) => {
                // α = map·w_h, column by column: w_h is scattered in the past.
                from_hard.fill(0.0);
                for (k, &position) in hard_order.iter().enumerate() {
                    let column = deficient.map.col_as_slice(k);
                    for (alpha, entry) in from_hard.iter_mut().zip(column) {
                        *alpha += entry * past[position];
                    }
                }
            }
        }
        gather(past, soft_order, from_soft);
        linalg::solve_lower(self.l11.as_ref(), a);
    }

    /// a, from a past.
    pub fn coordinates(&self, past: &[f64]) -> Vec<f64> {
        let mut a = vec![0.0; self.rank()];
        self.write_coordinates(past, &mut a);
        a
    }

    /// f0 = `coordinate_map`·a, (m+p)N×(length of a).
    pub fn coordinate_map(&self) -> &Mat<f64> {
        &self.l21
    }

    /// X with X w = `gain`·a for every past w.
    pub fn on_past(&self, gain: MatRef<'_, f64>) -> Mat<f64> {
        // X L₁₁ = gain, as L₁₁ᵀXᵀ = gainᵀ.
        let mut solved = gain.transpose().to_owned();
        solve_upper_triangular_in_place(self.l11.transpose(), solved.as_mut(), Par::Seq);
        let soft = self.slack_roots.len();
        let rank = solved.nrows() - soft;
        let from_hard = match &self.deficient {
            None => solved.subrows(0, rank).transpose().to_owned(),
            Some(deficient) => solved.subrows(0, rank).transpose() * &deficient.map,
        };
        let hard = from_hard.ncols();
        let mut x = Mat::zeros(gain.nrows(), self.order.len());
        for (k, &position) in self.order.iter().enumerate() {
            let target = x.col_mut(position);
            match k.checked_sub(hard) {
                None => target
                    .iter_mut()
                    .zip(from_hard.col(k).iter())
                    .for_each(|(t, &v)| *t = v),
                Some(k) => target
                    .iter_mut()
                    .zip(solved.row(rank + k).iter())
                    .for_each(|(t, &v)| *t = v),
            }
        }
        x
    }

    /// Raw `λ_g`.
    pub fn lambda_g(&self) -> f64 {
        self.lambda_g_root * self.lambda_g_root
    }

    /// g (one entry per data column) and `col(σ_u, σ_y)` from (a, z): ζ = Θ(a, z).
    pub fn recover(&self, a: &[f64], z: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (from_hard, from_soft) = a.split_at(a.len() - self.slack_roots.len());
        let (below, slack_part) = self.damping.undo(&[from_soft, z].concat());
        let top = match &self.deficient {
            None => [from_hard, &below].concat(),
            Some(deficient) => deficient.coordinates_of(from_hard, &below),
        };
        let basis = self.data.Q_basis();
        let coefficients = self.data.Q_coeff();
        let mut zeta = Mat::zeros(basis.nrows(), 1);
        zeta.col_as_slice_mut(0)[..top.len()].copy_from_slice(&top);
        let scratch = apply_scratch::<f64>(basis.nrows(), coefficients.nrows(), 1);
        apply_householder(
            basis,
            coefficients,
            Conj::No,
            zeta.as_mut(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
        let g = zeta.col_as_slice(0)[..self.data_columns]
            .iter()
            .map(|value| value / self.lambda_g_root)
            .collect();
        let mut slack = vec![0.0; self.order.len()];
        let soft = &self.order[self.order.len() - self.slack_roots.len()..];
        for ((&position, root), value) in soft.iter().zip(&self.slack_roots).zip(slack_part) {
            slack[position] = -root * value;
        }
        (g, slack)
    }
}

fn gather(source: &[f64], positions: &[usize], target: &mut [f64]) {
    for (value, &position) in target.iter_mut().zip(positions) {
        *value = source[position];
    }
}

fn check_finite(r: MatRef<'_, f64>) -> Result<(), ProgramError> {
    for column in 0..r.ncols() {
        let bad = r.col(column).iter().position(|value| !value.is_finite());
        if let Some(row) = bad {
            return Err(ProgramError::Factorisation {
                what: "the QR decomposition of the data matrix",
                row,
                column,
            });
        }
    }
    Ok(())
}

impl Split {
    /// `scales`: size of every hard entry; they are the first columns of `r`.
    fn find(r: MatRef<'_, f64>, scales: &[f64]) -> Result<Self, ProgramError> {
        let hard = scales.len();
        let others = r.ncols() - hard;
        let nonsingular = || Self {
            deficient: None,
            corner: linalg::lower_from_upper(r.submatrix(0, 0, hard, hard)),
            above: r.submatrix(0, hard, hard, others).to_owned(),
            below: r.submatrix(hard, hard, others, others).to_owned(),
        };
        if hard == 0 {
            return Ok(nonsingular());
        }
        let scaled = Mat::from_fn(hard, hard, |i, j| r[(i, j)] / scales[j]);
        let svd = scaled.svd().map_err(|_| ProgramError::PastDecomposition {
            size: hard,
            smallest: diagonal_size(r, hard).fold(f64::INFINITY, f64::min),
            largest: diagonal_size(r, hard).fold(0.0, f64::max),
        })?;
        let sigma = svd.S().column_vector();
        let limit = SPAN_TOLERANCE * sigma.iter().copied().fold(0.0, f64::max);
        let rank = sigma.iter().filter(|&&s| s > limit).count();
        if rank == hard {
            return Ok(nonsingular());
        }
        let left = svd.U().to_owned();
        let span = svd.V().subcols(0, rank).to_owned();
        let map = Mat::from_fn(rank, hard, |i, j| span[(j, i)] / (sigma[i] * scales[j]));

        let turned = left.transpose() * r.submatrix(0, hard, hard, others);
        let dropped = hard - rank;
        let stacked = Mat::from_fn(dropped + others, others, |i, j| {
            match i.checked_sub(dropped) {
                None => turned[(rank + i, j)],
                Some(i) => r[(hard + i, hard + j)],
            }
        });
        let decomposition = stacked.qr();
        Ok(Self {
            corner: Mat::identity(rank, rank),
            above: turned.subrows(0, rank).to_owned(),
            below: linalg::lower_from_upper(decomposition.thin_R())
                .transpose()
                .to_owned(),
            deficient: Some(Box::new(Deficient {
                map,
                span,
                scales: scales.to_vec(),
                left,
                rest: decomposition.compute_thin_Q(),
                scaled_past: vec![0.0; hard],
                coordinates: vec![0.0; rank],
            })),
        })
    }

    /// Sets what rounding left of directions that are not spanned to zero, in the `soft` columns:
    /// a small enough 1/√λ would take it for data.
    fn clear_rounding(&mut self, soft: usize) {
        for k in 0..soft {
            let kept = self.below.col(k).norm_l2();
            let limit = SPAN_TOLERANCE * kept.hypot(self.above.col(k).norm_l2());
            for value in self.below.col_as_slice_mut(k) {
                if value.abs() <= limit {
                    *value = 0.0;
                }
            }
        }
    }
}

fn diagonal_size(r: MatRef<'_, f64>, size: usize) -> impl Iterator<Item = f64> + '_ {
    (0..size).map(move |i| r[(i, i)].abs())
}

impl Deficient {
    /// Relative part of the hard entries that the data cannot explain.
    fn inconsistency(&mut self, past: impl Iterator<Item = f64>) -> f64 {
        let scaled = self.scaled_past.iter_mut().zip(past.zip(&self.scales));
        scaled.for_each(|(scaled, (value, scale))| *scaled = value / scale);
        linalg::part_outside(
            self.span.as_ref(),
            &mut self.scaled_past,
            &mut self.coordinates,
        )
    }

    /// Coordinates with respect to `Θ_d` from α and those of the second QR decomposition.
    fn coordinates_of(&self, alpha: &[f64], below: &[f64]) -> Vec<f64> {
        let (hard, rank) = (self.left.nrows(), alpha.len());
        let mut rest = vec![0.0; self.rest.nrows()];
        linalg::multiply(&mut rest, self.rest.as_ref(), below);
        let (dropped, bottom) = rest.split_at(hard - rank);
        let mut top = vec![0.0; hard];
        linalg::multiply(&mut top, self.left.as_ref(), &[alpha, dropped].concat());
        top.extend_from_slice(bottom);
        top
    }
}
