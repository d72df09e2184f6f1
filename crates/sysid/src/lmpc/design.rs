//! Gains of the observer: of the recursion and of its start.

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, MatRef, Scale, Side};

use super::settings::OffsetHandling;
use crate::dense::symmetric_part;
use crate::error::SysidError;
use crate::kalman::innovation_gain;
use crate::stability::spectral_radius;
use crate::state_space::{StateSpace, SystemMatrices};

/// Innovation variances below this, for outputs of size 1, are those of a model whose noise is not
/// known.
const KNOWN_VARIANCE: f64 = 1e-20;

/// Standard deviation of the innovation below which a window is taken as exact, for outputs of
/// size 1.
const EXACT: f64 = 1e-8;

/// What makes a covariance definite, relative to its mean variance.
const DEFINITE: f64 = 1e-8;

/// A pole of A as close to 1 as this makes an output disturbance undetectable.
const INTEGRATOR: f64 = 1e-6;

/// Squarings of a stable matrix; 60 exhaust any that is stable in floating point.
const DOUBLINGS: usize = 60;

/// z = (x, d) of the augmented model, or x alone, in a model's own units:
/// z(k+1) = A z + B u + L e with e = y − C z − D u.
pub(super) struct Design {
    /// A, B, C, D and L in place of K.
    pub matrices: SystemMatrices,
    /// N with z = z′ + Σ Nᵢ eᵢ at the end of a window of T samples, where z′ and eᵢ are
    /// those of the recursion from z = 0: `n_z`×pT, the blocks of a sample side by side.
    pub start_gain: Mat<f64>,
}

impl Design {
    pub fn new(
        model: &StateSpace,
        handling: OffsetHandling,
        window: usize,
    ) -> Result<Self, SysidError> {
        let input_scales = model.inputs().iter().chain(model.disturbances());
        let input_scales: Vec<_> = input_scales.map(|channel| channel.scale).collect();
        let output_scales: Vec<_> = model
            .outputs()
            .iter()
            .map(|channel| channel.scale)
            .collect();
        let scaled = rescaled(model.matrices(), &input_scales, &output_scales);
        let closed = scaled.predictor();
        let radius = spectral_radius(closed.as_ref());
        if radius.is_nan() || radius >= 1.0 {
            return Err(SysidError::Unstable {
                what: "A − KC of the observer",
                radius,
                limit: 1.0,
                remedy: "identify the model with its innovation gain, or give a stabilising K",
            });
        }
        let p = output_scales.len();
        let covariance = Mat::from_fn(p, p, |i, j| {
            model.innovation_covariance()[(i, j)] / (output_scales[i] * output_scales[j])
        });
        let (augmented, innovation) = match handling {
            OffsetHandling::None => (scaled.clone(), covariance.clone()),
            OffsetHandling::OutputDisturbance { drift } => {
                check_detectable(&scaled)?;
                let root = prior_root(&scaled, closed.as_ref(), scaled.order())?;
                with_output_disturbance(&scaled, root.as_ref(), covariance.as_ref(), drift)?
            }
        };
        let prior = prior_root(&scaled, closed.as_ref(), augmented.order())?;
        let start = start_gain(&augmented, innovation.as_ref(), prior.as_ref(), window)?;
        let inverse = |scales: &[f64]| scales.iter().map(|s| 1.0 / s).collect::<Vec<_>>();
        let mut matrices = rescaled(
            &augmented,
            &inverse(&input_scales),
            &inverse(&output_scales),
        );
        let mut gain = start;
        for j in 0..gain.ncols() {
            let scale = output_scales[j % p];
            gain.col_mut(j).iter_mut().for_each(|value| *value /= scale);
        }
        // d stands in the units of the outputs.
        let n = scaled.order();
        for i in n..augmented.order() {
            let scale = output_scales[i - n];
            for j in 0..gain.ncols() {
                gain[(i, j)] *= scale;
            }
            for j in 0..p {
                matrices.k[(i, j)] *= scale;
                matrices.c[(j, i)] /= scale;
            }
        }
        Ok(Self {
            matrices,
            start_gain: gain,
        })
    }
}

/// The same system for inputs divided by `inputs` and outputs divided by `outputs`.
fn rescaled(matrices: &SystemMatrices, inputs: &[f64], outputs: &[f64]) -> SystemMatrices {
    let SystemMatrices { a, b, c, d, k } = matrices;
    SystemMatrices {
        a: a.clone(),
        b: Mat::from_fn(b.nrows(), b.ncols(), |i, j| b[(i, j)] * inputs[j]),
        c: Mat::from_fn(c.nrows(), c.ncols(), |i, j| c[(i, j)] / outputs[i]),
        d: Mat::from_fn(d.nrows(), d.ncols(), |i, j| {
            d[(i, j)] * inputs[j] / outputs[i]
        }),
        k: Mat::from_fn(k.nrows(), k.ncols(), |i, j| k[(i, j)] * outputs[j]),
    }
}

/// (x, d) is detectable if and only if (x alone is and) A has no pole at 1: the rank condition of
/// Pannocchia and Rawlings 2003 with a disturbance on the outputs alone.
fn check_detectable(matrices: &SystemMatrices) -> Result<(), SysidError> {
    let poles = matrices.a.eigenvalues();
    let poles = poles.map_err(|_| SysidError::Numerical {
        what: "the poles of the model",
        why: "the eigenvalues of A do not converge".into(),
    })?;
    let distance = |pole: &deepc_core::faer::c64| (pole.re - 1.0).hypot(pole.im);
    match poles
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    {
        Some(pole) if distance(pole) < INTEGRATOR => Err(SysidError::UndetectableOffset {
            pole: pole.re,
            distance: distance(pole),
            limit: INTEGRATOR,
        }),
        _ => Ok(()),
    }
}

/// The model with d(k+1) = d(k) + w(k) on its outputs, its gain from the Riccati equation of the
/// predictor, and the covariance of its innovation. Outputs of size 1. `root`: of the covariance of
/// the state, n×n. The equation is solved in its coordinates: those of a model with a pole near 1 may
/// be of very different sizes, which costs more digits than there are.
fn with_output_disturbance(
    matrices: &SystemMatrices,
    root: MatRef<'_, f64>,
    covariance: MatRef<'_, f64>,
    drift: f64,
) -> Result<(SystemMatrices, Mat<f64>), SysidError> {
    let (n, p) = (matrices.order(), matrices.outputs());
    let mean = (0..p).map(|i| covariance[(i, i)]).sum::<f64>() / p as f64;
    let known = mean > KNOWN_VARIANCE;
    // Only its shape matters for the gain.
    let shape = Mat::from_fn(p, p, |i, j| {
        let unit = f64::from(u8::from(i == j));
        if known {
            covariance[(i, j)] / mean + DEFINITE * unit
        } else {
            unit
        }
    });
    let shape = symmetric_part(shape.as_ref());
    let size = n + p;
    let a = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
        (true, true) => matrices.a[(i, j)],
        _ => f64::from(u8::from(i == j)),
    });
    let b = Mat::from_fn(size, matrices.inputs(), |i, j| {
        if i < n { matrices.b[(i, j)] } else { 0.0 }
    });
    let c = Mat::from_fn(p, size, |i, j| match j.checked_sub(n) {
        None => matrices.c[(i, j)],
        Some(j) => f64::from(u8::from(i == j)),
    });
    let cross = &matrices.k * &shape;
    let state_noise = symmetric_part((&cross * matrices.k.transpose()).as_ref());
    let q = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
        (true, true) => state_noise[(i, j)],
        (false, false) if i == j => drift * drift * shape[(i - n, i - n)],
        _ => 0.0,
    });
    let s = Mat::from_fn(size, p, |i, j| if i < n { cross[(i, j)] } else { 0.0 });
    let basis = Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
        (true, true) => root[(i, j)],
        (false, false) => f64::from(u8::from(i == j)),
        _ => 0.0,
    });
    let inverse = basis.partial_piv_lu();
    let turned = |matrix: &Mat<f64>| inverse.solve(matrix);
    let q = symmetric_part(turned(&turned(&q).transpose().to_owned()).as_ref());
    // Guarded: where a pole of A is almost 1, x and d are all but one and the same.
    let solution = innovation_gain(
        turned(&(&a * &basis)).as_ref(),
        (&c * &basis).as_ref(),
        q.as_ref(),
        shape.as_ref(),
        turned(&s).as_ref(),
    )?;
    let augmented = SystemMatrices {
        a,
        b,
        c,
        d: matrices.d.clone(),
        k: &basis * solution.k,
    };
    let variance = if known { mean } else { 0.0 };
    Ok((augmented, solution.covariance * Scale(variance)))
}

/// A root of the covariance of z before anything is measured: x as the observer's when inputs and
/// outputs are white and of their usual sizes, d of the size of the outputs.
fn prior_root(
    scaled: &SystemMatrices,
    closed: MatRef<'_, f64>,
    size: usize,
) -> Result<Mat<f64>, SysidError> {
    let n = scaled.order();
    let driven = &scaled.b - &scaled.k * &scaled.d;
    let mut covariance = &driven * driven.transpose() + &scaled.k * scaled.k.transpose();
    let mut power = closed.to_owned();
    for _ in 0..DOUBLINGS {
        let more = &power * &covariance * power.transpose();
        let settled = more.norm_max() <= f64::EPSILON * covariance.norm_max();
        covariance = symmetric_part((&covariance + &more).as_ref());
        if settled {
            break;
        }
        power = &power * &power;
    }
    let mean = (0..n).map(|i| covariance[(i, i)]).sum::<f64>() / n.max(1) as f64;
    // The coordinates of a model may be of very different sizes, and each needs all its digits.
    let mut deviations = Vec::with_capacity(n);
    for i in 0..n {
        let driven = covariance[(i, i)] > f64::EPSILON * mean;
        if !driven {
            // A mode that nothing drives may still be there at the start.
            covariance[(i, i)] = if mean > 0.0 { DEFINITE * mean } else { 1.0 };
        }
        deviations.push(covariance[(i, i)].sqrt());
    }
    let correlation = Mat::from_fn(n, n, |i, j| {
        let more = if i == j { DEFINITE } else { 0.0 };
        covariance[(i, j)] / (deviations[i] * deviations[j]) + more
    });
    if deviations.iter().any(|deviation| !deviation.is_finite()) {
        return Err(SysidError::Numerical {
            what: "the spread of the model's state",
            why: format!("its {n}×{n} covariance is not finite"),
        });
    }
    // Where coordinates are the same to rounding, their sizes alone are a prior as good as any.
    let root = match correlation.llt(Side::Lower) {
        Ok(root) => root.L().to_owned(),
        Err(_) => Mat::identity(n, n),
    };
    let root = Mat::from_fn(n, n, |i, j| deviations[i] * root[(i, j)]);
    Ok(Mat::from_fn(size, size, |i, j| match (i < n, j < n) {
        (true, true) => root[(i, j)],
        (false, false) => f64::from(u8::from(i == j)),
        _ => 0.0,
    }))
}

/// The blocks Nᵢ of [`Design::start_gain`]. z at the start of the window minimises
/// Σ eᵢᵀΣ⁻¹eᵢ + zᵀΠ⁻¹z: the most probable one, whether the window fixes it or not.
fn start_gain(
    augmented: &SystemMatrices,
    innovation: MatRef<'_, f64>,
    prior: MatRef<'_, f64>,
    window: usize,
) -> Result<Mat<f64>, SysidError> {
    let (size, p) = (augmented.order(), augmented.outputs());
    let covariance = Mat::from_fn(p, p, |i, j| {
        let floor = EXACT * EXACT + DEFINITE * innovation[(i, i)];
        innovation[(i, j)] + if i == j { floor } else { 0.0 }
    });
    let noise = covariance.llt(Side::Lower);
    let noise = noise.map_err(|_| SysidError::Numerical {
        what: "the innovation covariance of the model",
        why: "it is not positive definite".into(),
    })?;
    let whitening = noise.L().partial_piv_lu().solve(Mat::<f64>::identity(p, p));
    let closed = &augmented.a - &augmented.k * &augmented.c;
    let mut rows = Mat::zeros(window * p + size, size);
    let mut power = Mat::<f64>::identity(size, size);
    for time in 0..window {
        let block = &whitening * &augmented.c * &power * prior;
        rows.as_mut().subrows_mut(time * p, p).copy_from(&block);
        power = &closed * &power;
    }
    for i in 0..size {
        rows[(window * p + i, i)] = 1.0;
    }
    let qr = rows.qr();
    let q = qr.compute_thin_Q();
    let mut onto = q.subrows(0, window * p).transpose().to_owned();
    deepc_core::faer::linalg::triangular_solve::solve_upper_triangular_in_place(
        qr.thin_R(),
        onto.as_mut(),
        deepc_core::faer::Par::Seq,
    );
    let spread = &power * prior * onto;
    let mut gain = Mat::zeros(size, window * p);
    for time in 0..window {
        let block = spread.subcols(time * p, p) * &whitening;
        gain.as_mut().subcols_mut(time * p, p).copy_from(&block);
    }
    Ok(gain)
}
