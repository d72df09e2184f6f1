//! Elimination of g and the slacks.
//!
//! Weigh g and the slacks to one vector `ζ = (√λ_g·g, −√λ_u·σ_u, −√λ_y·σ_y)`. Then
//! `w = col(u_ini, y_ini, u, y) = Mᵀζ` with `M = [H̄ᵀ/√λ_g; diag(1/√λ_u, 1/√λ_y), 0]`, and the cost
//! of g and σ is ‖ζ‖². With the QR decomposition M = Θ [R11 R12; 0 R22] the cheapest ζ for a
//! given w is Θ(a, z) where
//!
//! ```text
//! R11ᵀ a = w_ini        f0 = R12ᵀ a        f = f0 + F z, F = R22ᵀ        cost ‖a‖² + ‖z‖²
//! ```
//!
//! so that z, (m+p)N numbers, is all that is left to choose. `MᵀM` is never formed: its condition
//! number is the square of M's and reaches 1e24 for data without noise. F may be singular.
//!
//! If slack is hard and the data do not span every past (data without noise, more past samples
//! than the plant's lag needs), R11 is singular. Its singular value decomposition then splits
//! the past into the part that determines a and the part that must vanish.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::householder::{
    apply_block_householder_sequence_on_the_left_in_place_scratch as apply_scratch,
    apply_block_householder_sequence_on_the_left_in_place_with_conj as apply_householder,
};
use faer::linalg::solvers::Qr;
use faer::{Conj, Mat, MatRef, Par};

use super::error::ProgramError;
use crate::linalg;
use crate::predictor::Predictor;

/// Pasts that the data reach with less than this fraction of their strongest direction count as
/// not spanned (channels scaled). Rounding leaves about 1e-14.
const SPAN_TOLERANCE: f64 = 1e-12;

pub(super) struct PastFactor {
    decomposition: Qr<f64>,
    data_columns: usize,
    /// √(1/λ) of every entry of `w_ini` that has slack, by its position.
    slack_rows: Vec<(usize, f64)>,
    past: PastMap,
    /// f0 = l21·a; (m+p)N×(length of a).
    l21: Mat<f64>,
    /// F, (m+p)N×(m+p)N.
    pub future: Mat<f64>,
}

/// From `w_ini` to a.
enum PastMap {
    /// R11ᵀ; a solves R11ᵀ a = `w_ini`.
    Full(Mat<f64>),
    Deficient(Box<Deficient>),
}

/// A singular R11 taken apart.
struct Split {
    past: Deficient,
    l21: Mat<f64>,
    future: Mat<f64>,
}

struct Deficient {
    /// a = `map·w_ini`; rank×(length of `w_ini`).
    map: Mat<f64>,
    /// Scaled pasts that the data span: `rank` orthonormal columns.
    span: Mat<f64>,
    scales: Vec<f64>,
    /// Left singular vectors of R11, square; the first `rank` belong to a.
    left: Mat<f64>,
    /// Orthonormal columns that turn z into the rest of ζ, one column per entry of z.
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
        let slack_rows: Vec<_> = compliance
            .iter()
            .enumerate()
            .filter(|&(_, &c)| c > 0.0)
            .map(|(position, c)| (position, c.sqrt()))
            .collect();
        // Rows of zeros change nothing and make the triangular factor square.
        let height = (data_columns + slack_rows.len()).max(rows);
        let mut m = Mat::zeros(height, rows);
        let weight = 1.0 / lambda_g.sqrt();
        for j in 0..rows {
            for (entry, &value) in m.col_mut(j).iter_mut().zip(h.row(j).iter()) {
                *entry = weight * value;
            }
        }
        for (k, &(position, root)) in slack_rows.iter().enumerate() {
            m[(data_columns + k, position)] = root;
        }
        let decomposition = m.qr();
        let r = decomposition.thin_R();
        if !r.is_all_finite() {
            return Err(ProgramError::Factorisation {
                what: "the QR decomposition of the data matrix",
            });
        }
        let r11 = r.submatrix(0, 0, past, past);
        let r12 = r.submatrix(0, past, past, rows - past);
        let r22 = r.submatrix(past, past, rows - past, rows - past);

        // With slack on every entry R11 is nonsingular by construction.
        let deficient = if slack_rows.len() < past {
            let scales = &predictor.row_scales()[..past];
            Split::find(r11, r12, r22, scales)?
        } else {
            None
        };
        let (past_map, l21, future) = match deficient {
            Some(Split { past, l21, future }) => (PastMap::Deficient(Box::new(past)), l21, future),
            None => (
                PastMap::Full(linalg::lower_from_upper(r11)),
                r12.transpose().to_owned(),
                linalg::lower_from_upper(r22),
            ),
        };
        Ok(Self {
            data_columns,
            slack_rows,
            past: past_map,
            l21,
            future,
            decomposition,
        })
    }

    /// Length of a.
    pub fn rank(&self) -> usize {
        self.l21.ncols()
    }

    /// Writes a and f0 for a past; returns the relative part of it that the data cannot explain.
    pub fn predict(&mut self, past: &[f64], a: &mut [f64], f0: &mut [f64]) -> f64 {
        let inconsistency = match &mut self.past {
            PastMap::Full(l11) => {
                a.copy_from_slice(past);
                linalg::solve_lower(l11.as_ref(), a);
                0.0
            }
            PastMap::Deficient(deficient) => deficient.predict(past, a),
        };
        linalg::multiply(f0, self.l21.as_ref(), a);
        inconsistency
    }

    /// g (one entry per data column) and `col(σ_u, σ_y)` from (a, z): ζ = Θ(a, z).
    pub fn recover(&self, a: &[f64], z: &[f64], lambda_g: f64) -> (Vec<f64>, Vec<f64>) {
        let basis = self.decomposition.Q_basis();
        let coefficients = self.decomposition.Q_coeff();
        let mut zeta = Mat::zeros(basis.nrows(), 1);
        let top = match &self.past {
            PastMap::Full(_) => [a, z].concat(),
            PastMap::Deficient(deficient) => deficient.coordinates_of(a, z),
        };
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
        let zeta = zeta.col_as_slice(0);
        let g = zeta[..self.data_columns]
            .iter()
            .map(|value| value / lambda_g.sqrt())
            .collect();
        let past = self.decomposition.thin_R().ncols() - self.future.nrows();
        let mut slack = vec![0.0; past];
        for (k, &(position, root)) in self.slack_rows.iter().enumerate() {
            slack[position] = -root * zeta[self.data_columns + k];
        }
        (g, slack)
    }
}

impl Split {
    /// `None` if R11 is nonsingular.
    fn find(
        r11: MatRef<'_, f64>,
        r12: MatRef<'_, f64>,
        r22: MatRef<'_, f64>,
        scales: &[f64],
    ) -> Result<Option<Self>, ProgramError> {
        let past = r11.ncols();
        let scaled = Mat::from_fn(past, past, |i, j| {
            if i <= j { r11[(i, j)] / scales[j] } else { 0.0 }
        });
        let svd = scaled.svd().map_err(|_| ProgramError::Factorisation {
            what: "the singular value decomposition of the past",
        })?;
        let sigma = svd.S().column_vector();
        let limit = SPAN_TOLERANCE * sigma.iter().copied().fold(0.0, f64::max);
        let rank = sigma.iter().filter(|&&s| s > limit).count();
        if rank == past {
            return Ok(None);
        }
        let left = svd.U().to_owned();
        let span = svd.V().subcols(0, rank).to_owned();
        let map = Mat::from_fn(rank, past, |i, j| span[(j, i)] / (sigma[i] * scales[j]));
        let kept = left.subcols(0, rank);
        let l21 = r12.transpose() * kept;
        let dropped = left.subcols(rank, past - rank).transpose() * r12;
        let future = r22.ncols();
        let height = past - rank + future;
        let stacked = Mat::from_fn(height, future, |i, j| {
            if i < past - rank {
                dropped[(i, j)]
            } else if i - (past - rank) <= j {
                r22[(i - (past - rank), j)]
            } else {
                0.0
            }
        });
        let decomposition = stacked.qr();
        let split = Deficient {
            map,
            span,
            scales: scales.to_vec(),
            left,
            rest: decomposition.compute_thin_Q(),
            scaled_past: vec![0.0; past],
            coordinates: vec![0.0; rank],
        };
        let f = linalg::lower_from_upper(decomposition.thin_R());
        Ok(Some(Self {
            past: split,
            l21,
            future: f,
        }))
    }
}

impl Deficient {
    fn predict(&mut self, past: &[f64], a: &mut [f64]) -> f64 {
        linalg::multiply(a, self.map.as_ref(), past);
        for (scaled, (value, scale)) in self
            .scaled_past
            .iter_mut()
            .zip(past.iter().zip(&self.scales))
        {
            *scaled = value / scale;
        }
        let size = linalg::dot(&self.scaled_past, &self.scaled_past).sqrt();
        linalg::multiply(
            &mut self.coordinates,
            self.span.transpose(),
            &self.scaled_past,
        );
        linalg::multiply_add(
            &mut self.scaled_past,
            self.span.as_ref(),
            &self.coordinates,
            -1.0,
        );
        let rest = linalg::dot(&self.scaled_past, &self.scaled_past).sqrt();
        if size > 0.0 { rest / size } else { 0.0 }
    }

    /// Coordinates of ζ with respect to Θ.
    fn coordinates_of(&self, a: &[f64], z: &[f64]) -> Vec<f64> {
        let (past, rank) = (self.left.nrows(), a.len());
        let mut rest = vec![0.0; self.rest.nrows()];
        linalg::multiply(&mut rest, self.rest.as_ref(), z);
        let (dropped, bottom) = rest.split_at(past - rank);
        let mut top = vec![0.0; past];
        linalg::multiply(&mut top, self.left.as_ref(), &[a, dropped].concat());
        top.extend_from_slice(bottom);
        top
    }
}
