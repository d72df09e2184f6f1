//! Models of one order: subspace estimates, and the refinement of the best of them.

use deepc_core::faer::Mat;
use deepc_core::hankel::{FactorMethod, OnesRow};

use super::evaluate::{mean_log, simulation_errors};
use super::settings::{IdentificationSettings, OffsetChoice};
use crate::error::SysidError;
use crate::input_fit::{InputStructure, fit_inputs};
use crate::prediction_error::{Focus, OutputWeights, RefineSettings, refine, refine_gain};
use crate::stability::{reflected_gain, spectral_radius, stabilise};
use crate::state_space::SystemMatrices;
use crate::subspace::{Factor, Projection, Weighting};
use crate::working::WorkingData;

/// Subspace estimates that are refined, the best first: the error has local minima.
const REFINED_STARTS: usize = 3;

/// Where a refinement only compares models: (steps at most, tolerance).
const ROUGH: (usize, f64) = (30, 1e-4);

/// One projection of the data, good for models of all orders.
pub(super) struct Basis {
    pub weighting: Weighting,
    pub horizon: usize,
    pub projection: Projection,
}

/// Projects the records for every horizon and weighting. What cannot be projected (a horizon too long
/// for inputs that excite little) is left out, unless nothing is left.
pub(super) fn bases(
    data: &WorkingData,
    horizons: &[usize],
    settings: &IdentificationSettings,
) -> Result<Vec<Basis>, SysidError> {
    let (mut bases, mut failure) = (Vec::new(), None);
    let ones = match settings.offsets {
        OffsetChoice::Found => OnesRow::OnTop,
        OffsetChoice::Means | OffsetChoice::None => OnesRow::Without,
    };
    for &horizon in horizons {
        let factor = match Factor::new(data, horizon, horizon, ones, FactorMethod::Gram) {
            Ok(factor) => factor,
            Err(error) => {
                failure.get_or_insert(error);
                continue;
            }
        };
        for &weighting in &settings.weightings {
            match factor.project(weighting) {
                Ok(projection) => bases.push(Basis {
                    weighting,
                    horizon,
                    projection,
                }),
                Err(error) => {
                    failure.get_or_insert(error);
                }
            }
        }
    }
    match failure {
        Some(error) if bases.is_empty() => Err(error),
        _ => Ok(bases),
    }
}

/// A model of scaled deviations, the constant channel included, and where it comes from.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub model: SystemMatrices,
    pub weighting: Weighting,
    pub horizon: usize,
    /// Spectral radius before poles were moved inside, if they were.
    pub unstable_radius: Option<f64>,
    /// Mean logarithm of the simulation's squared errors on the records it was made from.
    pub loss: f64,
}

/// How carefully a model is refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Care {
    /// To compare it with others.
    Rough,
    /// To keep it.
    Full,
}

/// What all candidates share.
pub(super) struct Search<'a> {
    pub settings: &'a IdentificationSettings,
    pub structure: InputStructure,
}

impl Search<'_> {
    /// All subspace estimates of one order, the best on these records first.
    pub fn subspace(
        &self,
        data: &WorkingData,
        bases: &[Basis],
        order: usize,
    ) -> Result<Vec<Candidate>, SysidError> {
        let (mut found, mut failure) = (Vec::new(), None);
        for basis in bases {
            match self.subspace_model(data, basis, order) {
                Ok(candidate) => found.push(candidate),
                // The horizon that allows the largest order says what the limit is.
                Err(error) => match (&failure, &error) {
                    (
                        Some(SysidError::Order { largest: known, .. }),
                        SysidError::Order { largest, .. },
                    ) if largest <= known => {}
                    (Some(SysidError::Order { .. }) | None, _) => failure = Some(error),
                    _ => {}
                },
            }
        }
        found.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        match failure {
            Some(error) if found.is_empty() => Err(error),
            _ => Ok(found),
        }
    }

    fn subspace_model(
        &self,
        data: &WorkingData,
        basis: &Basis,
        order: usize,
    ) -> Result<Candidate, SysidError> {
        let dynamics = basis.projection.dynamics(order)?;
        let stable = stabilise(dynamics.a.as_ref(), self.settings.stability_radius)?;
        let fit = fit_inputs(
            data,
            stable.a.as_ref(),
            dynamics.c.as_ref(),
            &self.structure,
        )?;
        let k = Mat::zeros(order, dynamics.c.nrows());
        let model = SystemMatrices {
            a: stable.a,
            b: fit.b,
            c: dynamics.c,
            d: fit.d,
            k,
        };
        Ok(Candidate {
            loss: simulation_loss(data, &model)?,
            model,
            weighting: basis.weighting,
            horizon: basis.horizon,
            unstable_radius: stable.changed.then_some(stable.radius_before),
        })
    }

    /// The best of the first candidates after refinement of the simulated output.
    pub fn refined(
        &self,
        data: &WorkingData,
        candidates: &[Candidate],
        care: Care,
    ) -> Result<Candidate, SysidError> {
        let (mut best, mut failure): (Option<Candidate>, _) = (None, None);
        for candidate in candidates.iter().take(REFINED_STARTS) {
            match self.simulation(data, candidate, care) {
                Ok(refined) => {
                    if best.as_ref().is_none_or(|best| refined.loss < best.loss) {
                        best = Some(refined);
                    }
                }
                Err(error) => {
                    failure.get_or_insert(error);
                }
            }
        }
        let failure = failure.unwrap_or(SysidError::Numerical {
            what: "the subspace estimate",
            why: "no candidate is left".into(),
        });
        best.ok_or(failure)
    }

    /// A candidate refined on the simulated output, if the settings ask for it; unchanged if that
    /// makes it no better.
    pub fn simulation(
        &self,
        data: &WorkingData,
        candidate: &Candidate,
        care: Care,
    ) -> Result<Candidate, SysidError> {
        if !self.settings.refine {
            return Ok(candidate.clone());
        }
        let refined = self.run(data, &candidate.model, Focus::Simulation, care)?;
        let loss = simulation_loss(data, &refined)?;
        Ok(if loss < candidate.loss {
            Candidate {
                model: refined,
                loss,
                ..candidate.clone()
            }
        } else {
            candidate.clone()
        })
    }

    /// B, D and x(0) anew, for another structure or other records, then refined on the simulated
    /// output.
    pub fn refitted(
        &self,
        data: &WorkingData,
        candidate: &Candidate,
        care: Care,
    ) -> Result<Candidate, SysidError> {
        let from = &candidate.model;
        let fit = fit_inputs(data, from.a.as_ref(), from.c.as_ref(), &self.structure)?;
        let model = SystemMatrices {
            b: fit.b,
            d: fit.d,
            ..from.clone()
        };
        let refitted = Candidate {
            loss: simulation_loss(data, &model)?,
            model,
            ..candidate.clone()
        };
        self.simulation(data, &refitted, care)
    }

    /// A candidate with the K that predicts one step ahead best. A predictor that rounding made
    /// unstable (poles at the limit, in a basis that is badly conditioned) is mirrored; if that fails, K
    /// is 0.
    pub fn with_gain(
        &self,
        data: &WorkingData,
        candidate: &Candidate,
        care: Care,
    ) -> Result<Candidate, SysidError> {
        let mut model = self.run(data, &candidate.model, Focus::Gain, care)?;
        if spectral_radius(model.predictor().as_ref()) >= 1.0 {
            let p = model.outputs();
            let (a, c, k) = (model.a.as_ref(), model.c.as_ref(), model.k.as_ref());
            let equal = Mat::<f64>::identity(p, p);
            let mirrored = reflected_gain(a, c, k, equal.as_ref(), self.settings.stability_radius);
            model.k = mirrored.unwrap_or_else(|| Mat::zeros(a.nrows(), p));
            if spectral_radius(model.predictor().as_ref()) >= 1.0 {
                model.k.fill(0.0);
            }
        }
        Ok(Candidate {
            model,
            ..candidate.clone()
        })
    }

    /// A candidate refined one step ahead, all of it.
    pub fn prediction(
        &self,
        data: &WorkingData,
        candidate: &Candidate,
        care: Care,
    ) -> Result<Candidate, SysidError> {
        let model = self.run(data, &candidate.model, Focus::Prediction, care)?;
        Ok(Candidate {
            loss: simulation_loss(data, &model)?,
            model,
            ..candidate.clone()
        })
    }

    /// A candidate with the K that predicts as far ahead as the settings say.
    pub fn with_long_gain(
        &self,
        data: &WorkingData,
        candidate: &Candidate,
    ) -> Result<Candidate, SysidError> {
        let (steps, radius) = (self.settings.steps_ahead, self.settings.stability_radius);
        Ok(Candidate {
            model: refine_gain(data, &candidate.model, steps, radius)?,
            ..candidate.clone()
        })
    }

    fn run(
        &self,
        data: &WorkingData,
        start: &SystemMatrices,
        focus: Focus,
        care: Care,
    ) -> Result<SystemMatrices, SysidError> {
        let defaults = RefineSettings::default();
        let (iterations, tolerance) = match care {
            Care::Rough => (ROUGH.0.min(self.settings.max_iterations), ROUGH.1),
            Care::Full => (self.settings.max_iterations, defaults.tolerance),
        };
        let settings = RefineSettings {
            iterations,
            tolerance,
            radius: self.settings.stability_radius,
            // The determinant of the covariance is the likelihood of white innovations. What a
            // simulation leaves is anything but that, and one direction of it must not count for all.
            weighting: match focus {
                Focus::Simulation => OutputWeights::Equal,
                Focus::Prediction | Focus::Gain => OutputWeights::Covariance,
            },
        };
        Ok(refine(data, start, &self.structure, focus, &settings)?.matrices)
    }
}

/// Mean logarithm of the mean squared errors of the simulation.
pub(super) fn simulation_loss(
    data: &WorkingData,
    model: &SystemMatrices,
) -> Result<f64, SysidError> {
    Ok(mean_log(&simulation_errors(data, model)?))
}
