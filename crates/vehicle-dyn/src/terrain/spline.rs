//! Uniform bicubic B-splines: heights, gradients and curvatures are continuous, which keeps the
//! integrator's order, and the weights are positive, so that friction never overshoots.

/// Weights of four neighbouring coefficients at `t` of a cell, in [0, 1], and their derivatives.
#[inline]
fn weights(t: f64) -> ([f64; 4], [f64; 4]) {
    let u = 1.0 - t;
    let (t2, u2) = (t * t, u * u);
    (
        [
            u2 * u * (1.0 / 6.0),
            (0.5 * t - 1.0) * t2 + 2.0 / 3.0,
            (0.5 * u - 1.0) * u2 + 2.0 / 3.0,
            t2 * t * (1.0 / 6.0),
        ],
        [
            -0.5 * u2,
            (1.5 * t - 2.0) * t,
            (2.0 - 1.5 * u) * u,
            0.5 * t2,
        ],
    )
}

/// Value and derivatives by `t` (along a row) and `u` (across rows) of the spline whose 4 × 4
/// coefficients begin at `coefficients`, rows `stride` apart.
#[inline]
pub(super) fn evaluate<T: Copy + Into<f64>>(
    coefficients: &[T],
    stride: usize,
    t: f64,
    u: f64,
) -> [f64; 3] {
    let (along, along_rate) = weights(t);
    let (across, across_rate) = weights(u);
    let (mut value, mut by_t, mut by_u) = (0.0, 0.0, 0.0);
    for row in 0..4 {
        let [c0, c1, c2, c3]: [f64; 4] = match coefficients[row * stride..][..4] {
            [c0, c1, c2, c3] => [c0.into(), c1.into(), c2.into(), c3.into()],
            _ => [0.0; 4],
        };
        let sum = (along[0] * c0 + along[1] * c1) + (along[2] * c2 + along[3] * c3);
        let rate =
            (along_rate[0] * c0 + along_rate[1] * c1) + (along_rate[2] * c2 + along_rate[3] * c3);
        value += across[row] * sum;
        by_t += across[row] * rate;
        by_u += across_rate[row] * sum;
    }
    [value, by_t, by_u]
}

/// Value at a node of a wave that advances by `angle` rad from node to node, when its amplitude as
/// spline coefficients is 1: dividing by it makes the spline pass through the wave's nodes exactly.
pub(super) fn gain_of_wave(angle: f64) -> f64 {
    (2.0 + angle.cos()) * (1.0 / 3.0)
}

/// Turns values at nodes into the coefficients of the spline through them, in place, without
/// curvature at the ends. `work` is as long as the values; both hold at least two.
pub(super) fn coefficients_through(values: &mut [f64], work: &mut [f64]) {
    // (c[i-1] + 4 c[i] + c[i+1])/6 = f[i], with c[0] = f[0] and c[n-1] = f[n-1].
    let last = values.len() - 1;
    work[0] = 0.0;
    for i in 1..last {
        let scale = 1.0 / (4.0 - work[i - 1]);
        work[i] = scale;
        values[i] = (6.0 * values[i] - values[i - 1]) * scale;
    }
    for i in (1..last).rev() {
        values[i] -= work[i] * values[i + 1];
    }
}

/// A step from 0 to 1 over [0, 1] whose first and second derivatives vanish at both ends.
#[inline]
pub(super) fn smooth_step(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (u * (6.0 * u - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_add_up_to_one_and_their_derivatives_are_right() {
        for step in 0..=10 {
            let t = f64::from(step) * 0.1;
            let (value, rate) = weights(t);
            assert!((value.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!(rate.iter().sum::<f64>().abs() < 1e-15);
            assert!(value.iter().all(|w| *w >= 0.0));
            let (before, after) = (weights(t - 1e-6).0, weights(t + 1e-6).0);
            for k in 0..4 {
                assert!(((after[k] - before[k]) / 2e-6 - rate[k]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_spline_passes_through_its_values() {
        let wanted = [1.0, -2.0, 0.5, 4.0, 3.0, -1.0, 0.25];
        let mut c = wanted.to_vec();
        coefficients_through(&mut c, &mut [0.0; 7]);
        for i in 1..6 {
            let value = (c[i - 1] + 4.0 * c[i] + c[i + 1]) / 6.0;
            assert!((value - wanted[i]).abs() < 1e-14, "{value} at {i}");
        }
        assert!((c[0] - wanted[0]).abs() < 1e-15 && (c[6] - wanted[6]).abs() < 1e-15);
    }
}
