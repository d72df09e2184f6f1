//! What is measured.

use serde::Serialize;

/// Times of a series of steps, in microseconds.
#[derive(Debug, Clone, Default)]
pub struct Times(Vec<f64>);

impl Times {
    pub fn push(&mut self, seconds: f64) {
        self.0.push(seconds * 1e6);
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn total_s(&self) -> f64 {
        self.0.iter().sum::<f64>() * 1e-6
    }

    pub fn summary(&self) -> Summary {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        // The smallest value that `percent` of all do not exceed; of few values, the largest.
        let percentile = |percent: usize| {
            let rank = (sorted.len() * percent).div_ceil(100).max(1);
            sorted.get(rank - 1).copied().unwrap_or(f64::NAN)
        };
        Summary {
            median: percentile(50),
            p99: percentile(99),
            max: percentile(100),
        }
    }
}

/// In microseconds.
#[derive(Debug, Clone, Copy)]
pub struct Summary {
    pub median: f64,
    pub p99: f64,
    pub max: f64,
}

/// One line of `performance.json`.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub problem: String,
    pub formulation: &'static str,
    pub backend: String,
    /// Columns of the data matrix, or of the matrix multiplied.
    pub columns: usize,
    /// Mean over the steps measured.
    pub bounds_active: f64,
    /// From the recording to a solver that is ready, without the excitation report.
    pub setup_ms: f64,
    pub median_us: f64,
    pub p99_us: f64,
    pub max_us: f64,
    /// Largest, relative to the best certified optimum of the full problem; `None` (null) where
    /// that was not solved or the step gave no point.
    pub objective_gap: Option<f64>,
    /// Largest violation of an input bound, in the input's unit; `None` without a point.
    pub bound_violation: Option<f64>,
}

/// How the problem is written down.
pub const FULL: &str = "full";
pub const REDUCED: &str = "rd";
pub const CONDENSED: &str = "condensed";
pub const LMPC: &str = "lmpc, condensed";
pub const PRODUCT: &str = "matrix-vector product";
