//! Tests of the one-step residual: is it white, and does an input still explain it?

use deepc_core::faer::{Mat, Side};
use serde::{Deserialize, Serialize};

use super::ValidationSettings;
use super::correlation::{Centred, Correlation, covariance};
use super::special::{chi_square_tail, normal_band};
use crate::error::SysidError;

/// A residual below this fraction of the output's standard deviation is rounding.
const ROUNDING: f64 = 1e-10;

/// Directions of a set of lagged inputs whose variance is below this fraction of the strongest
/// one's are not tested: a smooth input has no say in them.
const RANK_TOLERANCE: f64 = 1e-8;

/// A sum of squared correlations as a test: large when they are not all zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Portmanteau {
    /// The statistic, χ² distributed if all true correlations are zero.
    pub statistic: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least as large if they are.
    pub p_value: f64,
}

impl Portmanteau {
    fn new(statistic: f64, degrees_of_freedom: usize) -> Self {
        Self {
            statistic,
            degrees_of_freedom,
            p_value: chi_square_tail(statistic, degrees_of_freedom),
        }
    }

    /// Whether the correlations may all be zero at this confidence.
    #[must_use]
    pub fn passes(&self, confidence: f64) -> bool {
        self.p_value >= 1.0 - confidence
    }
}

/// Autocorrelation of the residual e over lags 1..=L.
///
/// Band: ±z √(pairs at the lag)/N for white e. Portmanteau of Ljung and Box 1978,
/// N (N+2) Σ ρ²(τ) / (pairs at τ), with L degrees of freedom: on data that the model was not
/// identified from no parameter takes any away.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Whiteness {
    /// Correlation coefficients at lags 1..=L.
    pub correlation: Correlation,
    /// Lags outside the band.
    pub outside: usize,
    /// How many are to be expected outside if e is white.
    pub expected_outside: f64,
    /// All lags at once.
    pub portmanteau: Portmanteau,
}

/// Cross-correlation of the residual e with one input u. τ ≥ 0 is the effect of the input on the
/// residual, τ < 0 that of the residual on a later input.
///
/// ```text
/// r(τ) = Σ e(t) u(t−τ) / N        ρ(τ) = r(τ) / √(r_e(0) r_u(0))
/// P(τ) = Σₖ r_e(k) r_u(k+τ)       band: ±z √(P(0) · pairs at τ) / N
/// ```
///
/// If e and u are independent, √N r(τ) is asymptotically normal with the variance P(0) (Ljung 1999,
/// section 16.6): a slow input widens the band where e is coloured. √N r(τ) and √N r(σ) have the
/// covariance P(τ−σ), with which the portmanteau weighs all lags. The covariances of e enter P
/// through a Parzen window over twice the largest lag, which keeps P positive. Where an input is slow,
/// neighbouring lags leave the band together: their number says less than the portmanteau does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputTest {
    /// Name of the input or measured disturbance.
    pub input: String,
    /// Correlation coefficients at lags −L..=L.
    pub correlation: Correlation,
    /// Lags outside the band.
    pub outside: usize,
    /// How many are to be expected outside if e and u are independent.
    pub expected_outside: f64,
    /// Lags 0..=L at once: dynamics that the model does not have.
    pub effect: Portmanteau,
    /// Lags −L..=−1 at once: feedback while recording.
    pub feedback: Portmanteau,
}

/// All tests of the residual of one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResidualTests {
    /// Mean of the residual, in the unit of the output.
    pub mean: f64,
    /// Standard error of the mean from the residual's covariances.
    pub mean_standard_error: f64,
    /// Standard deviation of the residual, in the unit of the output.
    pub standard_deviation: f64,
    /// Whether e is white; none if the residual is nothing but rounding.
    pub whiteness: Option<Whiteness>,
    /// One test per input or measured disturbance that moves in the data.
    pub inputs: Vec<InputTest>,
}

impl ResidualTests {
    /// Of the residuals of every record, with inputs as (name, records); `spread` is the standard
    /// deviation of the measured output.
    pub(super) fn of(
        residuals: &[Vec<f64>],
        spread: f64,
        inputs: &[(&str, Vec<&[f64]>)],
        settings: &ValidationSettings,
    ) -> Result<Self, SysidError> {
        let e = Centred::new(residuals);
        let reach = 2 * settings.lags;
        let covariances = e.autocovariances(reach);
        let windowed = parzen(&covariances);
        let deviation = covariances[0].sqrt();
        let long_run = windowed[0] + 2.0 * windowed[1..].iter().sum::<f64>();
        let mut tests = Self {
            mean: e.mean,
            mean_standard_error: (long_run.max(0.0) / e.samples.max(1) as f64).sqrt(),
            standard_deviation: deviation,
            whiteness: None,
            inputs: Vec::new(),
        };
        if deviation <= ROUNDING * spread || deviation == 0.0 {
            return Ok(tests);
        }
        let band = normal_band(settings.confidence);
        tests.whiteness = Some(whiteness(&e, &covariances, band, settings));
        for (name, records) in inputs {
            let u = Centred::new(records);
            let moves = covariance(&u, &u, 0);
            if moves > (1e-12 * u.mean).powi(2) {
                tests
                    .inputs
                    .push(input_test(name, &e, &u, &windowed, band, settings)?);
            }
        }
        Ok(tests)
    }
}

fn whiteness(
    e: &Centred,
    covariances: &[f64],
    band: f64,
    settings: &ValidationSettings,
) -> Whiteness {
    let samples = e.samples as f64;
    let mut correlation = empty();
    let mut statistic = 0.0;
    for (lag, covariance) in (0..).zip(covariances).skip(1).take(settings.lags) {
        let value = covariance / covariances[0];
        let pairs = e.pairs(correlation.lags.len() + 1) as f64;
        push(&mut correlation, lag, value, band * pairs.sqrt() / samples);
        if pairs > 0.0 {
            statistic += samples * (samples + 2.0) * value * value / pairs;
        }
    }
    Whiteness {
        outside: correlation.outside(|_| true).len(),
        expected_outside: (1.0 - settings.confidence) * settings.lags as f64,
        portmanteau: Portmanteau::new(statistic, settings.lags),
        correlation,
    }
}

fn input_test(
    name: &str,
    e: &Centred,
    u: &Centred,
    windowed: &[f64],
    band: f64,
    settings: &ValidationSettings,
) -> Result<InputTest, SysidError> {
    let lags = settings.lags;
    let samples = e.samples as f64;
    let reach = windowed.len() - 1;
    let of_input = u.autocovariances(lags + reach);
    // N times the covariance of r(τ) and r(σ), by their distance.
    let at = |lag: usize| {
        let sum =
            (1..=reach).map(|k| windowed[k] * (of_input[lag + k] + of_input[lag.abs_diff(k)]));
        windowed[0] * of_input[lag] + sum.sum::<f64>()
    };
    let variances: Vec<f64> = (0..=lags).map(at).collect();
    let size = (covariance(e, e, 0) * of_input[0]).sqrt();
    let past: Vec<f64> = (0..=lags).map(|lag| covariance(e, u, lag)).collect();
    let later: Vec<f64> = (1..=lags).map(|lag| covariance(u, e, lag)).collect();
    let mut correlation = empty();
    let signed = later.iter().rev().chain(&past);
    for (lag, value) in (0..).zip(signed) {
        let lag: i64 = lag - i64::try_from(lags).unwrap_or(i64::MAX);
        let pairs = e.pairs(usize::try_from(lag.unsigned_abs()).unwrap_or(usize::MAX)) as f64;
        let half = band * (variances[0].max(0.0) * pairs).sqrt() / (samples * size);
        push(&mut correlation, lag, value / size, half);
    }
    let pairs = |lag: usize| e.pairs(lag) as f64 / samples;
    let weighed = |values: &[f64], first: usize| {
        let values: Vec<f64> = values
            .iter()
            .enumerate()
            // As if all lags had N pairs.
            .map(|(index, value)| value / pairs(index + first).max(f64::MIN_POSITIVE).sqrt())
            .collect();
        quadratic(&values, &variances, samples)
    };
    Ok(InputTest {
        input: name.to_owned(),
        outside: correlation.outside(|_| true).len(),
        expected_outside: (1.0 - settings.confidence) * (2 * lags + 1) as f64,
        effect: weighed(&past, 0)?,
        feedback: weighed(&later, 1)?,
        correlation,
    })
}

/// N rᵀ V⁺ r with the Toeplitz matrix V of `variances`, as a test with the rank of V.
fn quadratic(values: &[f64], variances: &[f64], samples: f64) -> Result<Portmanteau, SysidError> {
    let size = values.len();
    let toeplitz = Mat::from_fn(size, size, |i, j| variances[i.abs_diff(j)]);
    let eigen =
        toeplitz
            .self_adjoint_eigen(Side::Lower)
            .map_err(|error| SysidError::Numerical {
                what: "the covariance of a cross-correlation",
                why: format!("{error:?}"),
            })?;
    let variances = eigen.S().column_vector();
    let largest = variances.iter().copied().fold(0.0, f64::max);
    let (mut statistic, mut rank) = (0.0, 0);
    for (k, &variance) in variances.iter().enumerate() {
        if variance > RANK_TOLERANCE * largest {
            let along = eigen.U().col(k).iter().zip(values);
            let along: f64 = along.map(|(u, value)| u * value).sum();
            statistic += samples * along * along / variance;
            rank += 1;
        }
    }
    Ok(Portmanteau::new(statistic, rank))
}

/// Covariances at lags 0, 1, … under a Parzen window that ends after the last.
fn parzen(covariances: &[f64]) -> Vec<f64> {
    let width = covariances.len() as f64;
    let window = |lag: usize| {
        let x = lag as f64 / width;
        if x <= 0.5 {
            1.0 - 6.0 * x * x * (1.0 - x)
        } else {
            2.0 * (1.0 - x).powi(3)
        }
    };
    let all = covariances.iter().enumerate();
    all.map(|(lag, covariance)| window(lag) * covariance)
        .collect()
}

fn empty() -> Correlation {
    Correlation {
        lags: Vec::new(),
        values: Vec::new(),
        bands: Vec::new(),
    }
}

fn push(correlation: &mut Correlation, lag: i64, value: f64, band: f64) {
    correlation.lags.push(lag);
    correlation.values.push(value);
    correlation.bands.push(band);
}
