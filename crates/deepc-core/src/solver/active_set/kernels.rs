//! Vector kernels on slices, written so that the compiler vectorises them.

/// Inner product in four interleaved sums.
pub(super) fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (xs, ys) = (x.chunks_exact(4), y.chunks_exact(4));
    let rest: f64 = xs
        .remainder()
        .iter()
        .zip(ys.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in xs.zip(ys) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// `out -= scale·x`.
pub(super) fn subtract(out: &mut [f64], x: &[f64], scale: f64) {
    for (out, x) in out.iter_mut().zip(x) {
        *out -= scale * x;
    }
}

/// `out -= Σ scales[k]·x[k]`: four columns per pass over `out`.
pub(super) fn subtract_four(out: &mut [f64], x: [&[f64]; 4], scales: [f64; 4]) {
    let [a, b, c, d] = x;
    let columns = a.iter().zip(b).zip(c.iter().zip(d));
    for (out, ((a, b), (c, d))) in out.iter_mut().zip(columns) {
        *out -= (scales[0] * a + scales[1] * b) + (scales[2] * c + scales[3] * d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_handle_lengths_that_are_no_multiple_of_four() {
        for n in 0..11 {
            let x: Vec<f64> = (0..n).map(f64::from).collect();
            let expected: f64 = x.iter().map(|x| x * x).sum();
            assert_eq!(dot(&x, &x).to_bits(), expected.to_bits());
            let mut out = x.clone();
            subtract_four(&mut out, [&x; 4], [1.0, 2.0, -1.0, -1.0]);
            assert!(out.iter().zip(&x).all(|(out, _)| *out == 0.0));
            let mut out = x.clone();
            subtract(&mut out, &x, -1.0);
            assert!(out.iter().zip(&x).all(|(out, x)| *out == 2.0 * x));
        }
    }
}
