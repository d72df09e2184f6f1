//! g and the slacks of a plan, for study.

use faer::Mat;

use super::common::Common;
use super::plan::Recovered;
use crate::hankel::{Block, Shape, unstack_into};
use crate::linalg;
use crate::predictor::Predictor;

/// Singular values below this fraction of the largest are rounding.
const RANK_TOLERANCE: f64 = 1e-12;

/// Puts g and the slack of every known entry into the shape the user sees.
pub(super) fn recovered(
    common: &Common,
    future: &[f64],
    g: Vec<f64>,
    slack: &[f64],
    regularisation: f64,
) -> Recovered {
    let Shape {
        inputs,
        outputs,
        horizons,
        ..
    } = common.shape;
    let series = |block: Block, channels: usize| {
        let mut series = Mat::zeros(horizons.past, channels);
        unstack_into(&slack[common.shape.rows_of(block)], series.as_mut());
        series
    };
    Recovered {
        parts: common.parts(future, regularisation, slack),
        g,
        input_slack: series(Block::PastInputs, inputs),
        output_slack: series(Block::PastOutputs, outputs),
    }
}

/// The shortest g with H̄ g = `target`; `None` if its decomposition does not converge.
pub(super) fn least_norm(predictor: &Predictor, target: &[f64]) -> Option<Vec<f64>> {
    let h = predictor.stacked();
    let scales = predictor.row_scales();
    let scaled = Mat::from_fn(h.nrows(), h.ncols(), |i, j| h[(i, j)] / scales[i]);
    let right: Vec<_> = target.iter().zip(scales).map(|(v, s)| v / s).collect();
    let svd = scaled.thin_svd().ok()?;
    let sigma = svd.S().column_vector();
    let limit = RANK_TOLERANCE * sigma.iter().copied().fold(0.0, f64::max);
    let mut coordinates = vec![0.0; sigma.nrows()];
    linalg::multiply(&mut coordinates, svd.U().transpose(), &right);
    for (value, &s) in coordinates.iter_mut().zip(sigma.iter()) {
        *value = if s > limit { *value / s } else { 0.0 };
    }
    let mut g = vec![0.0; h.ncols()];
    linalg::multiply(&mut g, svd.V(), &coordinates);
    Some(g)
}
