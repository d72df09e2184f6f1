//! Tails of the χ² and of the normal distribution.

/// P(χ² > `value`) with `degrees` degrees of freedom: the regularised upper incomplete gamma
/// function Q(degrees/2, value/2).
pub(super) fn chi_square_tail(value: f64, degrees: usize) -> f64 {
    if value.is_nan() || value <= 0.0 || degrees == 0 {
        return 1.0;
    }
    if value.is_infinite() {
        return 0.0;
    }
    let (a, x) = (degrees as f64 / 2.0, value / 2.0);
    let front = (a * x.ln() - x - ln_gamma_of_half(degrees)).exp();
    let tail = if x < a + 1.0 {
        1.0 - front * lower_series(a, x)
    } else {
        front * upper_fraction(a, x)
    };
    tail.clamp(0.0, 1.0)
}

/// z with P(|Z| ≤ z) = `confidence` for a standard normal Z, `confidence` within (0, 1).
pub(super) fn normal_band(confidence: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    // Bisection to the last digit; the tail falls with z.
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if 1.0 - chi_square_tail(middle * middle, 1) < confidence {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// ln Γ(degrees/2): a product of every second number.
fn ln_gamma_of_half(degrees: usize) -> f64 {
    let start = if degrees.is_multiple_of(2) {
        0.0
    } else {
        0.5 * std::f64::consts::PI.ln()
    };
    let factors = (1..degrees).filter(|k| k % 2 == degrees % 2);
    let factors = factors.map(|k| (k as f64 / 2.0).ln());
    start + factors.sum::<f64>()
}

/// Σ xᵏ / (a (a+1) … (a+k)), DLMF 8.7.1.
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    let mut k = a;
    while term > sum * 1e-17 {
        k += 1.0;
        term *= x / k;
        sum += term;
    }
    sum
}

/// The continued fraction DLMF 8.9.2 by Lentz's method.
fn upper_fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for step in 1..10_000 {
        let k = f64::from(step);
        let numerator = -k * (k - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Critical values from published tables.
    #[test]
    fn tails_agree_with_tables() {
        for (value, degrees, tail) in [
            (3.8415, 1, 0.05),
            (6.6349, 1, 0.01),
            (18.3070, 10, 0.05),
            (44.3141, 25, 0.01),
            (29.7067, 50, 0.99),
            (124.3421, 100, 0.05),
        ] {
            let found = chi_square_tail(value, degrees);
            assert!(
                (found - tail).abs() < 2e-4 * tail.max(0.1),
                "{degrees}: {found}"
            );
        }
        for (confidence, band) in [(0.95, 1.959_964), (0.99, 2.575_829), (0.5, 0.674_490)] {
            assert!((normal_band(confidence) - band).abs() < 1e-6);
        }
    }

    #[test]
    fn two_degrees_of_freedom_have_a_closed_form() {
        for value in [1e-6_f64, 0.1, 2.0, 30.0, 900.0] {
            let exact = (-value / 2.0).exp();
            let found = chi_square_tail(value, 2);
            assert!(
                (found - exact).abs() < 1e-12 * exact.max(1e-12),
                "{value}: {found:e}"
            );
        }
        assert!(chi_square_tail(1e6, 300) < 1e-300 && chi_square_tail(5000.0, 5000) > 0.4);
    }
}
