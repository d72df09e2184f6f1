//! The future that a model predicts, as matrices.

use deepc_core::faer::Mat;
use deepc_core::hankel::{Horizons, Shape, stacked_position};

use crate::error::SysidError;
use crate::stability::spectral_radius;
use crate::state_space::StateSpace;

/// Predictions may grow by this factor over the horizon: half the digits are left then.
const GROWTH_LIMIT: f64 = 1e8;

/// f = col(u, y) = Φ c + B η for c = (x, d, 1, deviations of the previewed disturbances) and η the
/// deviations of u, over N steps.
pub(super) struct PredictionMatrices {
    /// Φ, (m+p)N×(n + p·(d is there) + 1 + qN).
    pub known: Mat<f64>,
    /// B = [I; Γ], (m+p)N×mN.
    pub free: Mat<f64>,
}

impl PredictionMatrices {
    /// `with_disturbance`: c has an output disturbance d.
    pub fn new(
        model: &StateSpace,
        horizons: Horizons,
        with_disturbance: bool,
    ) -> Result<Self, SysidError> {
        let steps = horizons.future;
        check_growth(model, steps)?;
        let (m, q, p, n) = sizes(model);
        let matrices = model.matrices();
        let constant = n + if with_disturbance { p } else { 0 };
        let first_output = m * steps;
        let mut known = Mat::zeros((m + p) * steps, constant + 1 + q * steps);
        let mut free = Mat::zeros((m + p) * steps, m * steps);
        for time in 0..steps {
            for (j, channel) in model.inputs().iter().enumerate() {
                let position = stacked_position(time, j, m);
                known[(position, constant)] = channel.offset;
                free[(position, position)] = 1.0;
            }
        }
        // C Aᵏ, row by row, is stable: no inverse and no power of A alone.
        let mut observed = matrices.c.clone();
        let mut markov = matrices.d.clone();
        for lag in 0..steps {
            for i in 0..p {
                let row = first_output + stacked_position(lag, i, p);
                for j in 0..n {
                    known[(row, j)] = observed[(i, j)];
                }
                if with_disturbance {
                    known[(row, n + i)] = 1.0;
                }
                known[(row, constant)] = model.outputs()[i].offset;
            }
            for time in lag..steps {
                for i in 0..p {
                    let row = first_output + stacked_position(time, i, p);
                    for j in 0..m {
                        free[(row, stacked_position(time - lag, j, m))] = markov[(i, j)];
                    }
                    for j in 0..q {
                        let column = constant + 1 + stacked_position(time - lag, j, q);
                        known[(row, column)] = markov[(i, m + j)];
                    }
                }
            }
            markov = &observed * &matrices.b;
            observed = &observed * &matrices.a;
        }
        Ok(Self { known, free })
    }
}

/// m, q, p and n.
pub(super) fn sizes(model: &StateSpace) -> (usize, usize, usize, usize) {
    (
        model.inputs().len(),
        model.disturbances().len(),
        model.outputs().len(),
        model.order(),
    )
}

/// Shape of the program.
pub(super) fn shape(model: &StateSpace, horizons: Horizons) -> Shape {
    let (inputs, disturbances, outputs, _) = sizes(model);
    Shape {
        inputs,
        disturbances,
        outputs,
        horizons,
    }
}

fn check_growth(model: &StateSpace, horizon: usize) -> Result<(), SysidError> {
    let radius = spectral_radius(model.matrices().a.as_ref());
    let growth = radius.powf(horizon as f64);
    if radius <= 1.0 || growth <= GROWTH_LIMIT {
        return Ok(());
    }
    // At least 1 and far below 2^52.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "in range"
    )]
    let longest = (GROWTH_LIMIT.ln() / radius.ln()).floor() as usize;
    Err(SysidError::PredictionGrowth {
        radius,
        horizon,
        growth,
        limit: GROWTH_LIMIT,
        longest,
    })
}
