//! Elimination where the part of g that the known past fixes costs nothing: the squared
//! projection, γ-DDPC, subspace predictive control, and no regularisation at all (module
//! `regularisation` has the table).
//!
//! With the triangular factor of the data, rows ordered z (known), u, y, and S = diag(scales):
//!
//! ```text
//! S⁻¹L₁₁ = V S₁ U₁ᵀ (singular values, to the numerical rank)    S⁻¹(z + σ) = V α    α = S₁U₁ᵀγ₁
//! ```
//!
//! α is free of cost, so it explains the entries of z whose slack is hard exactly and the others
//! as well as their slack weights ask: α = (linear in z) + N R⁻¹ ζ, at the price ‖ζ‖². What of
//! the data does not reach z joins u and y, and a second QR decomposition takes it in. The future
//! is then f = Φz + F ζ + B η with ‖ζ‖² charged and η free.

use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Mat, MatRef, Par};

use super::error::ProgramError;
use super::future_map::FutureMap;
use super::past_factor::SPAN_TOLERANCE;
use super::regularisation::{Regularisation, RegularisedPart};
use crate::linalg;
use crate::predictor::Predictor;

/// Directions of the future below this fraction of the known part's strongest (channels scaled)
/// are rounding, where nothing charges them.
const FREE_TOLERANCE: f64 = 1e-10;

pub(super) struct FreePast {
    pub map: FutureMap,
    /// For recovering g.
    predictor: Predictor,
    /// Scales of the known entries.
    scales: Vec<f64>,
    /// α₀ = `coordinates`·S⁻¹z.
    coordinates: Mat<f64>,
    /// N R⁻¹: what the last charges of ζ do to α.
    spread: Mat<f64>,
    /// V, (known entries)×rank.
    span: Mat<f64>,
    /// √λ·scale of every known entry; 0 where slack is hard.
    slack_roots: Vec<f64>,
    hard: Vec<usize>,
    /// Orthonormal columns that span the scaled hard entries the data reach.
    hard_span: Mat<f64>,
    /// Whether the hard entries may be inconsistent with the data at all.
    may_be_inconsistent: bool,
    scaled: Vec<f64>,
    coordinates_work: Vec<f64>,
}

impl FreePast {
    /// `compliance`: 1/λ of every known entry, 0 where slack is hard.
    pub fn new(
        predictor: &Predictor,
        regularisation: &Regularisation,
        columns: usize,
        compliance: &[f64],
    ) -> Result<Self, ProgramError> {
        let h = predictor.stacked();
        let rows = h.nrows();
        let known = compliance.len();
        let future = rows - known;
        let scales = predictor.row_scales()[..known].to_vec();
        let data = linalg::qr_of_rows(h, &[]);
        let r = data.thin_R();

        let top = Mat::from_fn(known, known, |i, j| {
            if i <= j { r[(i, j)] / scales[j] } else { 0.0 }
        });
        let svd = top.svd().map_err(|_| ProgramError::Decomposition {
            what: "the known part of the data",
            size: known,
        })?;
        let sigma = svd.S().column_vector();
        let strongest = sigma.iter().copied().fold(0.0, f64::max);
        let limit = SPAN_TOLERANCE * strongest;
        let rank = sigma.iter().filter(|&&s| s > limit).count();
        let span = svd.V().subcols(0, rank).to_owned();
        let beside = r.submatrix(0, known, known, future);
        let turned = svd.U().transpose() * beside;
        // Ψ: the future that goes with α.
        let with_alpha = Mat::from_fn(future, rank, |i, j| turned[(j, i)] / sigma[j]);
        let dropped = known - rank;
        let below = Mat::from_fn(dropped + future, future, |i, j| {
            match i.checked_sub(dropped) {
                None => turned[(rank + i, j)],
                Some(i) if i <= j => r[(known + i, known + j)],
                Some(_) => 0.0,
            }
        });
        let lower = linalg::lower_from_upper(below.qr().thin_R());

        let slack_roots: Vec<_> = compliance
            .iter()
            .zip(&scales)
            .map(|(c, scale)| if *c > 0.0 { scale / c.sqrt() } else { 0.0 })
            .collect();
        let explained = Explained::new(span.as_ref(), &slack_roots)?;
        let mut past = &with_alpha * &explained.coordinates;
        for (j, scale) in scales.iter().enumerate() {
            past.col_mut(j).iter_mut().for_each(|value| *value /= scale);
        }
        let inputs = predictor.shape().inputs * predictor.shape().horizons.future;
        let reach = Reach {
            scales: &predictor.row_scales()[known..],
            limit: FREE_TOLERANCE * strongest,
        };
        let (charged, free) = split_future(regularisation, columns, &lower, inputs, &reach)?;
        let mut blocks = vec![charged];
        if explained.spread.ncols() > 0 {
            blocks.push(&with_alpha * &explained.spread);
        }
        let hard = (0..known).filter(|&i| slack_roots[i] == 0.0).collect();
        Ok(Self {
            predictor: predictor.clone(),
            map: FutureMap::new(past, side_by_side(&blocks, future), free),
            coordinates_work: vec![0.0; explained.hard_span.ncols()],
            scaled: vec![0.0; explained.hard_span.nrows()],
            may_be_inconsistent: explained.hard_span.ncols() < explained.hard_span.nrows(),
            hard_span: explained.hard_span,
            coordinates: explained.coordinates,
            spread: explained.spread,
            scales,
            span,
            slack_roots,
            hard,
        })
    }

    /// Relative part of the hard known entries that the data cannot explain.
    pub fn inconsistency(&mut self, known: &[f64]) -> f64 {
        if !self.may_be_inconsistent {
            return 0.0;
        }
        for (scaled, &i) in self.scaled.iter_mut().zip(&self.hard) {
            *scaled = known[i] / self.scales[i];
        }
        linalg::part_outside(
            self.hard_span.as_ref(),
            &mut self.scaled,
            &mut self.coordinates_work,
        )
    }

    /// The data matrix it was built from.
    pub fn predictor(&self) -> &Predictor {
        &self.predictor
    }

    /// Slack of every known entry, for ζ.
    pub fn slack(&self, known: &[f64], zeta: &[f64]) -> Vec<f64> {
        let scaled: Vec<_> = known.iter().zip(&self.scales).map(|(z, s)| z / s).collect();
        let mut alpha = vec![0.0; self.span.ncols()];
        linalg::multiply(&mut alpha, self.coordinates.as_ref(), &scaled);
        let charges = self.map.unpacked(zeta);
        let slack_charges = &charges[charges.len() - self.spread.ncols()..];
        linalg::multiply_add(&mut alpha, self.spread.as_ref(), slack_charges, 1.0);
        let mut explained = vec![0.0; scaled.len()];
        linalg::multiply(&mut explained, self.span.as_ref(), &alpha);
        let entries = explained.iter().zip(&scaled).zip(&self.scales);
        let slack = entries.zip(&self.slack_roots);
        slack
            .map(|(((e, z), scale), &root)| if root > 0.0 { (e - z) * scale } else { 0.0 })
            .collect()
    }
}

/// How α explains the known entries.
struct Explained {
    /// α₀ from the scaled known entries; rank×known.
    coordinates: Mat<f64>,
    /// N R⁻¹: what ζ of length 1 does to α.
    spread: Mat<f64>,
    hard_span: Mat<f64>,
}

impl Explained {
    fn new(span: MatRef<'_, f64>, slack_roots: &[f64]) -> Result<Self, ProgramError> {
        let (known, rank) = span.shape();
        let (hard, soft): (Vec<usize>, Vec<usize>) =
            (0..known).partition(|&i| slack_roots[i] == 0.0);
        // α = P z_hard + N β.
        let (particular, null, hard_span) = if hard.is_empty() {
            (
                Mat::zeros(rank, 0),
                Mat::identity(rank, rank),
                Mat::zeros(0, 0),
            )
        } else {
            let rows = Mat::from_fn(hard.len(), rank, |i, j| span[(hard[i], j)]);
            let svd = rows.svd().map_err(|_| ProgramError::Decomposition {
                what: "the known entries whose slack is hard",
                size: hard.len(),
            })?;
            let sigma = svd.S().column_vector();
            // Parts of an orthonormal basis: 1 is fully in the hard entries, 0 not at all.
            let reached = sigma.iter().filter(|&&s| s > SPAN_TOLERANCE).count();
            let inverse = Mat::from_fn(rank, reached, |i, j| svd.V()[(i, j)] / sigma[j]);
            (
                inverse * svd.U().subcols(0, reached).transpose(),
                svd.V().subcols(reached, rank - reached).to_owned(),
                svd.U().subcols(0, reached).to_owned(),
            )
        };
        let mut coordinates = Mat::zeros(rank, known);
        for (k, &i) in hard.iter().enumerate() {
            coordinates.col_mut(i).copy_from(particular.col(k));
        }
        let mut spread = Mat::zeros(rank, null.ncols());
        if null.ncols() > 0 {
            // β minimises ‖C(V_s(P z_h + N β) − z_s)‖ with C = diag(slack_roots).
            let weighted = Mat::from_fn(soft.len(), rank, |i, j| {
                slack_roots[soft[i]] * span[(soft[i], j)]
            });
            let qr = (&weighted * &null).qr();
            let (q, upper) = (qr.compute_thin_Q(), qr.thin_R().to_owned());
            let mut inverse = Mat::identity(null.ncols(), null.ncols());
            solve_upper_triangular_in_place(upper.as_ref(), inverse.as_mut(), Par::Seq);
            spread = &null * &inverse;
            let pull = &spread * q.transpose();
            for (k, &i) in soft.iter().enumerate() {
                for row in 0..rank {
                    coordinates[(row, i)] += pull[(row, k)] * slack_roots[i];
                }
            }
            let correction = &pull * &(&weighted * &particular);
            for (k, &i) in hard.iter().enumerate() {
                for row in 0..rank {
                    coordinates[(row, i)] -= correction[(row, k)];
                }
            }
        }
        Ok(Self {
            coordinates,
            spread,
            hard_span,
        })
    }
}

/// The charged and the free directions of γ₂ and γ₃, from L = [L₂₂ 0; L₃₂ L₃₃].
fn split_future(
    regularisation: &Regularisation,
    columns: usize,
    lower: &Mat<f64>,
    inputs: usize,
    reach: &Reach<'_>,
) -> Result<(Mat<f64>, Mat<f64>), ProgramError> {
    let n = lower.nrows();
    let block = |first: usize, count: usize, lambda: f64| {
        let size = 1.0 / lambda.sqrt();
        Mat::from_fn(n, count, |i, j| size * lower[(i, first + j)])
    };
    let outputs = n - inputs;
    let lambda_g = regularisation.raw_lambda_g(columns);
    let nothing = || Mat::zeros(n, 0);
    Ok(match regularisation.part {
        RegularisedPart::Gamma { lambda_3 } => {
            let mut blocks = vec![block(0, inputs, lambda_g)];
            if let Some(lambda) = lambda_3 {
                let lambda = regularisation.raw_value(lambda, columns);
                blocks.push(block(inputs, outputs, lambda));
            }
            (side_by_side(&blocks, n), nothing())
        }
        RegularisedPart::SquaredProjection => {
            let free = reach.of(&block(0, inputs, 1.0))?;
            (block(inputs, outputs, lambda_g), free)
        }
        RegularisedPart::Spc => (nothing(), reach.of(&block(0, inputs, 1.0))?),
        _ => (nothing(), reach.of(lower)?),
    })
}

/// Which directions of the future the data reach.
struct Reach<'a> {
    /// Scales of the future entries.
    scales: &'a [f64],
    /// Singular values up to this are rounding. Measured on the known part: if that determines
    /// the future (data too scarce to move every input), all that is left here is rounding.
    limit: f64,
}

impl Reach<'_> {
    /// Orthonormal (in scaled entries) directions that `columns` span.
    fn of(&self, columns: &Mat<f64>) -> Result<Mat<f64>, ProgramError> {
        let (n, count) = columns.shape();
        let scaled = Mat::from_fn(n, count, |i, j| columns[(i, j)] / self.scales[i]);
        let svd = scaled.thin_svd().map_err(|_| ProgramError::Decomposition {
            what: "the future part of the data",
            size: n,
        })?;
        let sigma = svd.S().column_vector();
        let rank = sigma.iter().filter(|&&s| s > self.limit).count();
        let scale = |i: usize| self.scales[i];
        Ok(Mat::from_fn(n, rank, |i, j| scale(i) * svd.U()[(i, j)]))
    }
}

fn side_by_side(blocks: &[Mat<f64>], rows: usize) -> Mat<f64> {
    let columns = blocks.iter().map(Mat::ncols).sum();
    let mut joined = Mat::zeros(rows, columns);
    let mut first = 0;
    for block in blocks {
        joined
            .as_mut()
            .subcols_mut(first, block.ncols())
            .copy_from(block);
        first += block.ncols();
    }
    joined
}
