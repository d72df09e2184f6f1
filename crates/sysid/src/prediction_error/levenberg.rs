//! The descent.

use deepc_core::faer::{Mat, MatRef};

use super::balance::Basis;
use super::jacobian::{Linearised, linearise};
use super::limits::Limits;
use super::parameters::Layout;
use super::predictor::{Evaluation, ROUNDING, free_response};
use super::{Ending, OutputWeights, RefineSettings};
use crate::error::SysidError;
use crate::input_fit::fit_packed;
use crate::least_squares::thin_svd;
use crate::regressors::Packed;
use crate::state_space::SystemMatrices;

/// Damping of the first step, relative to the largest squared singular value.
const FIRST_DAMPING: f64 = 1e-4;

/// Damping below this is none: only directions at rounding level would feel it.
const LEAST_DAMPING: f64 = 1e-15;

/// A true promise divides the damping by this.
const LEAST_FACTOR: f64 = 0.2;

/// A step that gains nothing multiplies it by this, the next by twice that.
const FIRST_GROWTH: f64 = 2.0;

/// A promise is true if this fraction of it was kept.
const TRUE: f64 = 0.75;

/// Weight of what is held, over the Jacobian.
const HOLD: f64 = 1e6;

/// Damping above which a step is too short to matter.
const MOST_DAMPING: f64 = 1e8;

/// Steps in a row that gain less than the tolerance before the descent ends.
const FLAT_STEPS: usize = 3;

/// Where the descent ended.
pub(super) struct Found {
    pub model: SystemMatrices,
    pub initial_states: Vec<Vec<f64>>,
    pub covariance: Mat<f64>,
    pub loss: f64,
    pub loss_before: f64,
    pub iterations: usize,
    pub ending: Ending,
}

/// Levenberg-Marquardt from a stable model with active inputs only.
pub(super) fn descend(
    packed: &Packed,
    start: &SystemMatrices,
    layout: &Layout,
    settings: &RefineSettings,
) -> Result<Found, SysidError> {
    let evaluate = |model: &SystemMatrices, whitening: &Mat<f64>| {
        Evaluation::new(packed, model, whitening, settings.weighting)
    };
    let first = evaluate(start, &Mat::identity(layout.p, layout.p))?;
    let basis = Basis::balanced(start, &first)?;
    let mut model = basis.apply(start);
    let mut run = evaluate(&model, &first.whitening)?;
    let loss_before = run.criterion;
    let descent = Descent {
        packed,
        layout,
        limits: Limits::new(&model, settings.radius),
        weighting: settings.weighting,
        total: (packed.samples() * layout.p).max(1) as f64,
    };
    let negligible = settings.tolerance * descent.total;
    let (mut damping, mut iterations, mut flat) = (FIRST_DAMPING, 0, 0);
    let ending = loop {
        let variance = (0..layout.p).map(|i| run.covariance[(i, i)]);
        if variance.fold(0.0, f64::max) <= 10.0 * ROUNDING {
            break Ending::Exact;
        }
        let linear = linearise(packed, &model, &run, layout, None)?;
        let steps = Steps::new(&linear)?;
        if steps.promised(0.0) <= negligible {
            break Ending::Optimal;
        }
        if iterations == settings.iterations {
            break Ending::Iterations;
        }
        let Some(better) = descent.step(&model, &run, &linear, &steps, &mut damping)? else {
            break Ending::Stuck;
        };
        (model, run) = (better.model, better.run);
        iterations += 1;
        flat = if better.gained <= negligible {
            flat + 1
        } else {
            0
        };
        if flat == FLAT_STEPS {
            break Ending::Flat;
        }
    };
    let initial_states = run.initial.iter().map(|x| basis.undo_state(x)).collect();
    Ok(Found {
        model: basis.undo(&model),
        initial_states,
        covariance: run.covariance,
        loss: run.criterion,
        loss_before,
        iterations,
        ending,
    })
}

/// What stays the same over all steps.
struct Descent<'a> {
    packed: &'a Packed,
    layout: &'a Layout,
    limits: Limits,
    weighting: OutputWeights,
    /// What the weighted squares add up to, whatever the model.
    total: f64,
}

/// A model better than the last.
struct Better {
    model: SystemMatrices,
    run: Evaluation,
    /// Weighted squares gained, and those the linearisation promised.
    gained: f64,
    promised: f64,
}

impl Descent<'_> {
    /// The first step that gains anything, with ever more damping; `None` if there is none.
    fn step(
        &self,
        model: &SystemMatrices,
        run: &Evaluation,
        linear: &Linearised,
        steps: &Steps<'_>,
        damping: &mut f64,
    ) -> Result<Option<Better>, SysidError> {
        // Poles at the limit that want to go on are held there, so that the rest can move.
        let mut held: Option<Option<Steps<'_>>> = None;
        let (mut growth, mut refit) = (FIRST_GROWTH, !self.layout.gain);
        while *damping <= MOST_DAMPING {
            let mut better = self.attempt(model, run, steps, *damping, refit);
            if better.is_none() {
                if held.is_none() {
                    let limits = &self.limits;
                    let gradients =
                        limits.gradients_at_the_limit(self.layout, model, &linear.to_full);
                    held = Some(if gradients.is_empty() {
                        None
                    } else {
                        Some(Steps::holding(linear, &gradients)?)
                    });
                }
                if let Some(Some(steps)) = &held {
                    better = self.attempt(model, run, steps, *damping, refit);
                }
            }
            if let Some(better) = better {
                // By how true the promise was (Nielsen 1999).
                let truth = 2.0 * (better.gained / better.promised).min(1.0) - 1.0;
                *damping *= (1.0 - truth.powi(3)).max(LEAST_FACTOR);
                *damping = damping.max(LEAST_DAMPING);
                return Ok(Some(better));
            }
            *damping *= growth;
            growth *= 2.0;
            refit = false;
        }
        Ok(None)
    }

    /// The model a step away if it is better. With `refit` and unless the linearisation held, also
    /// the one with the best B and D for its A and C, which are linear: worth its time in a valley
    /// that bends.
    fn attempt(
        &self,
        model: &SystemMatrices,
        run: &Evaluation,
        steps: &Steps<'_>,
        damping: f64,
        refit: bool,
    ) -> Option<Better> {
        let promised = steps.promised(damping);
        let moved = self.layout.moved(model, &steps.at(damping));
        let candidate = self.limits.kept(self.layout, &moved, &run.covariance)?;
        // B and D have no part in it: both models share it.
        let response = free_response(self.packed, &candidate, &run.whitening).ok()?;
        let tried = |model: SystemMatrices| {
            let (weights, weighting) = (&run.whitening, self.weighting);
            let tried =
                Evaluation::with_response(self.packed, &model, &response, weights, weighting)
                    .ok()?;
            let gained = self.total * (run.criterion - tried.criterion);
            Some(Better {
                model,
                run: tried,
                gained,
                promised,
            })
        };
        let refitted = |model: &SystemMatrices| {
            let Layout {
                dynamic_inputs,
                feedthrough,
                ..
            } = self.layout;
            let (a, c, weights) = (&model.a, &model.c, &run.whitening);
            // Without a gain, that of the predictor is that of A.
            let fitted = fit_packed(
                self.packed,
                a,
                c,
                *dynamic_inputs,
                feedthrough,
                weights,
                &response,
            )
            .ok()?;
            tried(SystemMatrices {
                b: fitted.b,
                d: fitted.d,
                ..model.clone()
            })
        };
        let plain = tried(candidate.clone());
        let held_true = |better: &Better| better.gained > TRUE * promised;
        let other = if refit && !plain.as_ref().is_some_and(held_true) {
            refitted(&candidate)
        } else {
            None
        };
        let best = [plain, other].into_iter().flatten();
        best.max_by(|x, y| x.gained.total_cmp(&y.gained))
            .filter(|better| better.gained > 0.0)
    }
}

/// Steps for any damping from one singular value decomposition.
struct Steps<'a> {
    to_full: &'a Mat<f64>,
    v: Mat<f64>,
    values: Vec<f64>,
    /// Uᵀ r.
    right: Vec<f64>,
    /// What the damping is relative to: the largest squared singular value of the Jacobian.
    unit: f64,
}

impl<'a> Steps<'a> {
    fn new(linear: &'a Linearised) -> Result<Self, SysidError> {
        Self::of(linear, linear.triangle.as_ref())
    }

    /// Along which the functions with these gradients by local coordinates stay.
    fn holding(linear: &'a Linearised, gradients: &[Vec<f64>]) -> Result<Self, SysidError> {
        let (rows, columns) = linear.triangle.shape();
        let weight = HOLD * linear.triangle.norm_l2();
        let stack = Mat::from_fn(rows + gradients.len(), columns, |i, j| {
            if i < rows {
                return linear.triangle[(i, j)];
            }
            let gradient = &gradients[i - rows];
            let length = gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
            weight * gradient[j] / length.max(f64::MIN_POSITIVE)
        });
        Self::of(linear, stack.as_ref())
    }

    fn of(linear: &'a Linearised, triangle: MatRef<'_, f64>) -> Result<Self, SysidError> {
        let svd = thin_svd(triangle, "the Jacobian of the innovations")?;
        let right = (0..svd.values.len())
            .map(|j| {
                let u = svd.u.col_as_slice(j).iter();
                u.zip(&linear.right).map(|(u, r)| u * r).sum()
            })
            .collect();
        let unit = linear.triangle.as_ref().singular_values();
        let unit = unit.map_or(0.0, |values| {
            values.first().map_or(0.0, |first| first * first)
        });
        Ok(Self {
            to_full: &linear.to_full,
            v: svd.v,
            values: svd.values,
            right,
            unit,
        })
    }

    fn absolute(&self, damping: f64) -> f64 {
        damping * self.unit
    }

    /// `−(RᵀR + λ)⁻¹ Rᵀ r` as a change of all parameters.
    fn at(&self, damping: f64) -> Vec<f64> {
        let lambda = self.absolute(damping).max(f64::MIN_POSITIVE);
        let mut local = vec![0.0; self.v.nrows()];
        for (j, (&s, &r)) in self.values.iter().zip(&self.right).enumerate() {
            let along = -s * r / (s * s + lambda);
            crate::regressors::add_scaled(&mut local, along, self.v.col_as_slice(j));
        }
        let mut full = vec![0.0; self.to_full.nrows()];
        crate::regressors::add_product(&mut full, self.to_full, &local);
        full
    }

    /// By how much the squares would fall if the innovations were linear.
    fn promised(&self, damping: f64) -> f64 {
        let lambda = self.absolute(damping).max(f64::MIN_POSITIVE);
        let terms = self.values.iter().zip(&self.right).map(|(&s, &r)| {
            let left = lambda / (s * s + lambda);
            r * r * (1.0 - left * left)
        });
        terms.sum()
    }
}
