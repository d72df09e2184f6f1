//! Where the poles are, and how to bring them inside.

use deepc_core::faer::linalg::solvers::{DenseSolveCore, Solve};
use deepc_core::faer::{Mat, MatRef};

use crate::error::SysidError;
use crate::least_squares::thin_svd;

/// A left and a right invariant subspace closer to orthogonal than this do not belong together
/// (repeated poles without as many eigenvectors).
const LEAST_ANGLE: f64 = 1e-6;

/// An imaginary part below this fraction of the modulus is that of a real pole.
const REAL_TOLERANCE: f64 = 1e-12;

/// Largest modulus of the eigenvalues; infinite if they cannot be computed.
pub(crate) fn spectral_radius(a: MatRef<'_, f64>) -> f64 {
    largest_pole(a).map_or(f64::INFINITY, |(re, im)| re.hypot(im))
}

/// Real and imaginary part (not negative) of the eigenvalue of the largest modulus; (0, 0) for a
/// matrix without rows.
fn largest_pole(a: MatRef<'_, f64>) -> Option<(f64, f64)> {
    if !a.is_all_finite() {
        return None;
    }
    let poles = a.eigenvalues().ok()?;
    let largest = poles
        .iter()
        .max_by(|x, y| x.re.hypot(x.im).total_cmp(&y.re.hypot(y.im)));
    Some(largest.map_or((0.0, 0.0), |pole| (pole.re, pole.im.abs())))
}

/// What [`stabilise`] did.
pub(crate) struct Stabilised {
    /// A with all eigenvalues inside the radius, in the basis it had.
    pub a: Mat<f64>,
    /// Spectral radius of the A given.
    pub radius_before: f64,
    /// Whether anything had to be done.
    pub changed: bool,
}

/// Brings eigenvalues outside `radius` (above 0, at most 1) inside: λ becomes 1/conj(λ), or is
/// moved to the radius if that is outside, too. All other eigenvalues stay, and so do the
/// eigenvectors where they are well defined. B, D and the initial states have to be fitted again.
///
/// # Errors
/// A is not finite or its eigenvalues cannot be computed.
pub(crate) fn stabilise(a: MatRef<'_, f64>, radius: f64) -> Result<Stabilised, SysidError> {
    let failed = || SysidError::Numerical {
        what: "the eigenvalues of A",
        why: "an entry is not finite or the iteration did not converge".into(),
    };
    let mut stable = a.to_owned();
    let mut pole = largest_pole(a).ok_or_else(failed)?;
    let radius_before = pole.0.hypot(pole.1);
    if radius_before <= radius {
        return Ok(Stabilised {
            a: stable,
            radius_before,
            changed: false,
        });
    }
    // Every pass moves one pole or pair; rounding can ask for more where poles are repeated.
    for _ in 0..3 * a.nrows() {
        let modulus = pole.0.hypot(pole.1);
        if modulus <= radius {
            break;
        }
        let target = (1.0 / modulus).min(radius * (1.0 - 1e-12));
        stable = with_pole_scaled(stable.as_ref(), pole, target / modulus)?;
        pole = largest_pole(stable.as_ref()).ok_or_else(failed)?;
    }
    let left = pole.0.hypot(pole.1);
    if left > radius {
        stable *= deepc_core::faer::Scale(radius * (1.0 - 1e-12) / left);
    }
    Ok(Stabilised {
        a: stable,
        radius_before,
        changed: true,
    })
}

/// Brings the poles of A − KC outside `radius` inside by another K that explains the innovations'
/// spectrum as well: it is the Kalman gain for the noise that K and the innovation covariance R
/// describe (Anderson and Moore 1979, chapter 9), so that λ becomes 1/conj(λ); or, where that is outside, too, its mirror
/// image in the circle of that radius. Up to rounding the rest of the poles stay. `None` if it
/// cannot be done.
pub(crate) fn reflected_gain(
    a: MatRef<'_, f64>,
    c: MatRef<'_, f64>,
    k: MatRef<'_, f64>,
    covariance: MatRef<'_, f64>,
    radius: f64,
) -> Option<Mat<f64>> {
    let (mut gain, mut covariance) = (k.to_owned(), covariance.to_owned());
    for _ in 0..=2 * a.nrows() {
        let f = a - &gain * c;
        let pole = largest_pole(f.as_ref())?;
        let modulus = pole.0.hypot(pole.1);
        if modulus <= radius {
            return Some(gain);
        }
        let mirror = if modulus * radius >= 1.0 {
            1.0
        } else {
            radius * (1.0 - 1e-9)
        };
        let (v, _) = invariant_subspaces(f.as_ref(), pole).ok()?;
        // On the subspace, with F and C in its coordinates and F over the mirror's radius:
        // P = F (P⁻¹ + CᵀR⁻¹C)⁻¹ Fᵀ, so X = P⁻¹ solves FᵀX F = X + CᵀR⁻¹C, which is linear.
        let t = v.transpose() * &f * &v * deepc_core::faer::Scale(1.0 / mirror);
        let seen = c * &v;
        let weighed = covariance.partial_piv_lu().solve(&seen);
        let inverse = t.partial_piv_lu().inverse();
        let mut term = seen.transpose() * weighed;
        let mut power = inverse;
        term = power.transpose() * term * &power;
        let mut x = term.clone();
        // By doubling: the sum of (F⁻ᵀ)ʲ CᵀR⁻¹C F⁻ʲ from j = 1 on.
        for _ in 0..60 {
            let next = power.transpose() * &x * &power;
            if !next.as_ref().is_all_finite() || next.norm_max() <= 1e-17 * x.norm_max() {
                break;
            }
            x += next;
            power = &power * &power;
        }
        let p = x.partial_piv_lu().inverse();
        let across = &seen * &p;
        let total = &across * seen.transpose() + &covariance;
        let change = total
            .transpose()
            .partial_piv_lu()
            .solve((&v * t * across.transpose()).transpose());
        gain += change.transpose() * deepc_core::faer::Scale(mirror);
        if !gain.as_ref().is_all_finite() {
            return None;
        }
        // That of the innovations of the new predictor.
        covariance = total;
    }
    None
}

/// `A + V (s − 1) T (WᵀV)⁻¹ Wᵀ` with `A V = V T` and W the same for Aᵀ: the pole (or
/// the conjugate pair) is multiplied by s, the rest of the spectrum and its eigenvectors stay.
fn with_pole_scaled(a: MatRef<'_, f64>, pole: (f64, f64), s: f64) -> Result<Mat<f64>, SysidError> {
    let n = a.nrows();
    let (v, mut w) = invariant_subspaces(a, pole)?;
    let smallest = |pairing: &Mat<f64>| {
        let values = pairing.singular_values();
        values.map_or(0.0, |values| values.last().copied().unwrap_or(0.0))
    };
    if w.ncols() != v.ncols() || smallest(&(w.transpose() * &v)) < LEAST_ANGLE {
        // Orthogonal to V instead: the rest of the spectrum stays, its eigenvectors turn.
        w.clone_from(&v);
    }
    let pairing = w.transpose() * &v;
    let t = v.transpose() * a * &v;
    let dual = pairing.partial_piv_lu().solve(w.transpose());
    let change = v * (t * dual);
    Ok(Mat::from_fn(n, n, |i, j| {
        a[(i, j)] + (s - 1.0) * change[(i, j)]
    }))
}

/// Orthonormal bases (V, W) of a right and a left invariant subspace of a real pole (one column) or
/// a conjugate pair (two).
fn invariant_subspaces(
    a: MatRef<'_, f64>,
    (re, im): (f64, f64),
) -> Result<(Mat<f64>, Mat<f64>), SysidError> {
    let n = a.nrows();
    let modulus = re.hypot(im);
    let real = im <= REAL_TOLERANCE * modulus;
    // v spans the null space of A − λ, or of (A − λ)(A − conj λ) together with A v.
    let shifted = if real {
        Mat::from_fn(n, n, |i, j| a[(i, j)] - if i == j { re } else { 0.0 })
    } else {
        let mut square = a * a;
        for j in 0..n {
            for i in 0..n {
                square[(i, j)] -= 2.0 * re * a[(i, j)];
            }
            square[(j, j)] += modulus * modulus;
        }
        square
    };
    let svd = thin_svd(shifted.as_ref(), "the eigenvectors of an unstable pole")?;
    let span = |start: MatRef<'_, f64>, a: MatRef<'_, f64>| -> Mat<f64> {
        if real {
            return start.to_owned();
        }
        let image = a * start;
        let along = (start.transpose() * &image)[(0, 0)];
        let mut second = Mat::from_fn(n, 1, |i, _| image[(i, 0)] - along * start[(i, 0)]);
        let length = second.norm_l2();
        if length <= REAL_TOLERANCE * modulus {
            return start.to_owned();
        }
        second *= deepc_core::faer::Scale(1.0 / length);
        Mat::from_fn(n, 2, |i, j| {
            if j == 0 {
                start[(i, 0)]
            } else {
                second[(i, 0)]
            }
        })
    };
    let v = span(svd.v.subcols(n - 1, 1), a);
    let w = span(svd.u.subcols(n - 1, 1), a.transpose());
    Ok((v, w))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moduli(a: MatRef<'_, f64>) -> Vec<f64> {
        let mut moduli: Vec<f64> = a
            .eigenvalues()
            .unwrap()
            .iter()
            .map(|pole| pole.re.hypot(pole.im))
            .collect();
        moduli.sort_by(f64::total_cmp);
        moduli
    }

    fn basis(n: usize) -> (Mat<f64>, Mat<f64>) {
        let t = Mat::from_fn(n, n, |i, j| {
            ((3 * i + 5 * j + i * j) as f64).cos() + if i == j { 2.0 } else { 0.0 }
        });
        let inverse = t.partial_piv_lu().inverse();
        (t, inverse)
    }

    fn block_diagonal(blocks: &[&[&[f64]]]) -> Mat<f64> {
        let n = blocks.iter().map(|block| block.len()).sum();
        let mut a = Mat::zeros(n, n);
        let mut first = 0;
        for block in blocks {
            for (i, row) in block.iter().enumerate() {
                for (j, &value) in row.iter().enumerate() {
                    a[(first + i, first + j)] = value;
                }
            }
            first += block.len();
        }
        a
    }

    fn stabilised(blocks: &[&[&[f64]]], radius: f64) -> Vec<f64> {
        let a = block_diagonal(blocks);
        let (t, inverse) = basis(a.nrows());
        let result = stabilise((&t * a * inverse).as_ref(), radius).unwrap();
        assert!(result.changed);
        moduli(result.a.as_ref())
    }

    fn close(found: &[f64], expected: &[f64], tolerance: f64) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < tolerance, "{found} {expected}");
        }
    }

    #[test]
    fn poles_outside_are_reflected_and_the_rest_stays() {
        // 1.25 → 0.8; 1.2 ± 0.5i has modulus 1.3 → 1/1.3; −1.0001 is clamped.
        let found = stabilised(
            &[
                &[&[1.25]],
                &[&[1.2, 0.5], &[-0.5, 1.2]],
                &[&[-1.0001]],
                &[&[0.3, 0.4], &[-0.4, 0.3]],
                &[&[0.9]],
            ],
            0.99,
        );
        let pair = 1.0 / 1.3;
        close(&found, &[0.5, 0.5, pair, pair, 0.8, 0.9, 0.99], 1e-11);
    }

    #[test]
    fn eigenvectors_of_the_rest_stay() {
        let a = block_diagonal(&[&[&[1.25]], &[&[0.5]], &[&[-0.7]]]);
        let (t, inverse) = basis(3);
        let stable = stabilise((&t * a * &inverse).as_ref(), 0.999).unwrap();
        let back = &inverse * stable.a * &t;
        let expected = block_diagonal(&[&[&[0.8]], &[&[0.5]], &[&[-0.7]]]);
        assert!((back - expected).norm_max() < 1e-12);
    }

    #[test]
    fn repeated_poles_come_inside() {
        let r = 0.999;
        // Two equal pairs, with and without a chain; a triple real pole with a chain.
        let pair: &[&[f64]] = &[&[0.9, 0.8], &[-0.8, 0.9]];
        for found in [
            stabilised(&[pair, pair, &[&[0.2]]], r),
            stabilised(
                &[
                    &[
                        &[0.9, 0.8, 1.0, 0.0],
                        &[-0.8, 0.9, 0.0, 1.0],
                        &[0.0, 0.0, 0.9, 0.8],
                        &[0.0, 0.0, -0.8, 0.9],
                    ],
                    &[&[0.2]],
                ],
                r,
            ),
            stabilised(
                &[
                    &[&[1.1, 1.0, 0.0], &[0.0, 1.1, 1.0], &[0.0, 0.0, 1.1]],
                    &[&[0.2]],
                ],
                r,
            ),
            stabilised(&[&[&[1.3]], &[&[1.3]], &[&[0.2]]], r),
        ] {
            assert!((found[0] - 0.2).abs() < 1e-6, "{found:?}");
            assert!(*found.last().unwrap() <= r, "{found:?}");
            assert!(found[1] > 0.5, "{found:?}");
        }
    }

    #[test]
    fn a_stable_matrix_is_untouched_to_the_bit() {
        let a = block_diagonal(&[&[&[0.3, 0.4], &[-0.4, 0.3]], &[&[0.9]]]);
        let result = stabilise(a.as_ref(), 0.95).unwrap();
        assert!(!result.changed && result.a == a);
        assert!((result.radius_before - 0.9).abs() < 1e-12);
    }

    #[test]
    fn not_finite_is_an_error() {
        let a = deepc_core::faer::mat![[f64::NAN, 0.0], [0.0, 0.5]];
        assert!(stabilise(a.as_ref(), 0.95).is_err());
        assert!(spectral_radius(a.as_ref()).is_infinite());
    }

    #[test]
    fn a_reflected_gain_describes_the_same_noise() {
        // A − KC with one real pole and a pair outside.
        let a = block_diagonal(&[&[&[0.9, 0.2], &[-0.2, 0.9]], &[&[0.5]], &[&[-0.3]]]);
        let c = deepc_core::faer::mat![[1.0, 0.3, 0.0, 0.4], [0.2, -0.5, 1.0, 0.3]];
        let r = deepc_core::faer::mat![[2.0, 0.5], [0.5, 1.0]];
        let k = deepc_core::faer::mat![[2.9, -0.8], [0.9, 1.9], [0.3, 2.2], [0.2, 0.4]];
        let before = moduli((&a - &k * &c).as_ref());
        assert!(
            before.iter().filter(|&&m| m > 1.0).count() >= 1,
            "{before:?}"
        );
        let gain = reflected_gain(a.as_ref(), c.as_ref(), k.as_ref(), r.as_ref(), 0.99).unwrap();
        let mut expected: Vec<f64> = before.iter().map(|m| m.min(1.0 / m)).collect();
        expected.sort_by(f64::total_cmp);
        close(&moduli((&a - &gain * &c).as_ref()), &expected, 1e-9);
        // The same spectrum H R Hᴴ with another R: at 12 frequencies R' = H'⁻¹ H R Hᴴ H'⁻ᴴ.
        let mut found: Vec<Mat<f64>> = Vec::new();
        for step in 1..13 {
            use deepc_core::faer::c64;
            let angle = 0.25 * f64::from(step);
            let z = c64::new(angle.cos(), angle.sin());
            let h = |k: &Mat<f64>| {
                let complex = |m: &Mat<f64>| {
                    Mat::<c64>::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0))
                };
                let resolvent = Mat::<c64>::from_fn(4, 4, |i, j| {
                    (if i == j { z } else { c64::new(0.0, 0.0) }) - c64::new(a[(i, j)], 0.0)
                });
                let x = resolvent.partial_piv_lu().solve(complex(k));
                complex(&c) * x + Mat::<c64>::identity(2, 2)
            };
            let ratio = h(&gain).partial_piv_lu().solve(h(&k));
            let complex = Mat::<c64>::from_fn(2, 2, |i, j| c64::new(r[(i, j)], 0.0));
            let spectrum = &ratio * complex * ratio.adjoint();
            found.push(Mat::from_fn(2, 2, |i, j| spectrum[(i, j)].re));
            assert!((0..4).all(|i| spectrum[(i / 2, i % 2)].im.abs() < 1e-9));
        }
        for other in &found[1..] {
            assert!((other - &found[0]).norm_max() < 1e-9 * found[0].norm_max());
        }
    }

    #[test]
    fn a_gain_whose_mirror_image_is_too_far_out_is_clamped() {
        let a = block_diagonal(&[&[&[0.5]], &[&[0.2]]]);
        let c = deepc_core::faer::mat![[1.0, 1.0]];
        let r = deepc_core::faer::mat![[1.0]];
        let k = deepc_core::faer::mat![[-0.495], [0.0]];
        assert!(spectral_radius((&a - &k * &c).as_ref()) > 0.99);
        let gain = reflected_gain(a.as_ref(), c.as_ref(), k.as_ref(), r.as_ref(), 0.99).unwrap();
        assert!(spectral_radius((&a - &gain * &c).as_ref()) <= 0.99);
    }
}
