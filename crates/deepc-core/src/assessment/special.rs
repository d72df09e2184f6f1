//! The tail of the F distribution.

/// P(F > `value`) for F with `d1` and `d2` degrees of freedom: the regularised incomplete beta
/// function `I_x(d2/2, d1/2)` at x = d2/(d2 + d1·value).
pub(super) fn f_tail(value: f64, d1: f64, d2: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 1.0;
    }
    if value.is_infinite() {
        return 0.0;
    }
    let denominator = d2 + d1 * value;
    let (x, y) = (d2 / denominator, d1 * value / denominator);
    let (a, b) = (d2 / 2.0, d1 / 2.0);
    let log_front = ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * y.ln();
    let front = log_front.exp();
    // The continued fraction converges fast on the near side of the mean.
    let tail = if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, y) / b
    };
    tail.clamp(0.0, 1.0)
}

/// The continued fraction of the incomplete beta function (DLMF 8.17.22) by Lentz's method.
fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let away_from_zero = |v: f64| if v.abs() < TINY { TINY } else { v };
    let (mut c, mut d) = (1.0, 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for step in 1..10_000 {
        let k = f64::from(step);
        let even = k * (b - k) * x / ((a + 2.0 * k - 1.0) * (a + 2.0 * k));
        let odd = -(a + k) * (a + b + k) * x / ((a + 2.0 * k) * (a + 2.0 * k + 1.0));
        let mut change = 1.0;
        for coefficient in [even, odd] {
            d = 1.0 / away_from_zero(1.0 + coefficient * d);
            c = away_from_zero(1.0 + coefficient / c);
            change = c * d;
            fraction *= change;
        }
        if (change - 1.0).abs() < 1e-14 {
            break;
        }
    }
    fraction
}

/// ln Γ(x) for x > 0: Stirling's series (DLMF 5.11.1) after a shift to x ≥ 10, good to 1e-14.
fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let inverse = 1.0 / (x * x);
    let series = (1.0 / 12.0
        - inverse
            * (1.0 / 360.0
                - inverse * (1.0 / 1260.0 - inverse * (1.0 / 1680.0 - inverse / 1188.0))))
        / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Critical values from published tables of the F distribution.
    #[test]
    fn the_tail_agrees_with_tables() {
        for (value, d1, d2, tail) in [
            (161.4476, 1.0, 1.0, 0.05),
            (3.4928, 2.0, 20.0, 0.05),
            (2.7109, 5.0, 20.0, 0.05),
            (4.1028, 2.0, 10.0, 0.05),
            (5.6363, 5.0, 10.0, 0.01),
            (1.4290, 60.0, 120.0, 0.05),
        ] {
            let found = f_tail(value, d1, d2);
            assert!(
                (found - tail).abs() < 0.02 * tail,
                "F({d1}, {d2}) > {value}: {found}"
            );
        }
    }

    #[test]
    fn two_degrees_of_freedom_have_a_closed_form() {
        for (value, d2) in [(0.1_f64, 4.0_f64), (1.0, 30.0), (9.0, 1e5), (40.0, 7.0)] {
            let exact = (1.0 + 2.0 * value / d2).powf(-d2 / 2.0);
            let found = f_tail(value, 2.0, d2);
            assert!((found - exact).abs() < 1e-9 * exact, "{found:e} {exact:e}");
        }
    }

    #[test]
    fn ln_gamma_is_that_of_factorials() {
        assert!((ln_gamma(1.0)).abs() < 1e-13);
        assert!((ln_gamma(5.0) - 24.0_f64.ln()).abs() < 1e-13);
        assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-13);
    }
}
