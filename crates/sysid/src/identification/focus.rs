//! What the model is refined for.

use std::cell::OnceCell;

use super::candidate::{Candidate, Care, Search};
use super::evaluate::Errors;
use super::fits;
use super::folds::Fold;
use super::settings::FocusChoice;
use crate::error::SysidError;
use crate::working::WorkingData;

/// A way from the simulation-refined model to the one that is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// As it is.
    Simulation,
    /// Refined one step ahead.
    Prediction,
    /// The best subspace estimate instead.
    Subspace,
}

/// The winner on held-out samples.
pub(super) struct Focused {
    pub way: Way,
    /// Fits on held-out samples, mean over the folds.
    pub fit: Vec<f64>,
    pub prediction_fit: Vec<f64>,
}

impl Search<'_> {
    /// The ways that the settings leave open.
    fn ways(&self) -> &'static [Way] {
        match (self.settings.refine, self.settings.focus) {
            (false, _) => &[Way::Subspace],
            (true, FocusChoice::Automatic) => &[Way::Simulation, Way::Prediction, Way::Subspace],
            (true, FocusChoice::Simulation) => &[Way::Simulation],
            (true, FocusChoice::Prediction) => &[Way::Prediction],
        }
    }

    /// The best way over all folds; `candidates` are their simulation-refined models.
    pub fn focused(&self, folds: &[Fold], candidates: &[Candidate]) -> Result<Focused, SysidError> {
        let (mut best, mut failure): (Option<(f64, Focused)>, _) = (None, None);
        let starts = folds.iter().zip(candidates).map(|(fold, candidate)| {
            let start = self.refitted(&fold.training, candidate, Care::Rough)?;
            Ok((fold, start, OnceCell::new()))
        });
        let starts = starts.collect::<Result<Vec<_>, SysidError>>()?;
        for &way in self.ways() {
            let judged = match self.judged(way, &starts) {
                Ok(judged) => judged,
                // A way that cannot be gone is none; if none can be, the first says why.
                Err(error) => {
                    failure.get_or_insert(error);
                    continue;
                }
            };
            let (score, fit, prediction_fit) = judged;
            if best.as_ref().is_none_or(|(least, _)| score < *least) {
                let focused = Focused {
                    way,
                    fit,
                    prediction_fit,
                };
                best = Some((score, focused));
            }
        }
        let failure = failure.unwrap_or(SysidError::Numerical {
            what: "the choice of a model",
            why: "no candidate is left".into(),
        });
        best.map(|(_, focused)| focused).ok_or(failure)
    }

    /// The score of one way, and the fits of simulation and prediction: means over the folds.
    fn judged(
        &self,
        way: Way,
        starts: &[(&Fold, Candidate, OnceCell<Candidate>)],
    ) -> Result<(f64, Vec<f64>, Vec<f64>), SysidError> {
        let part = 1.0 / starts.len() as f64;
        let (mut score, mut fit, mut prediction_fit) = (0.0, Vec::new(), Vec::new());
        for (fold, start, with_gain) in starts {
            let subspace = || self.subspace(&fold.training, &fold.bases, start.model.order());
            let model = self.along(
                way,
                &fold.training,
                (start, with_gain),
                subspace,
                Care::Rough,
            )?;
            let held_out = &fold.held_out;
            let errors = Errors::of(held_out, &model.model, self.settings.steps_ahead)?;
            score += part * errors.score();
            for (sums, errors) in [
                (&mut fit, &errors.simulation),
                (&mut prediction_fit, &errors.prediction),
            ] {
                sums.resize(errors.len(), 0.0);
                let fits = fits(held_out, errors).into_iter();
                sums.iter_mut()
                    .zip(fits)
                    .for_each(|(sum, fit)| *sum += part * fit);
            }
        }
        Ok((score, fit, prediction_fit))
    }

    /// Goes one way on these records. The cell keeps the simulation-refined model with its gain, which two ways
    /// start from. `subspace` gives the subspace estimates, the best first.
    pub fn along(
        &self,
        way: Way,
        data: &WorkingData,
        (simulation, with_gain): (&Candidate, &OnceCell<Candidate>),
        subspace: impl FnOnce() -> Result<Vec<Candidate>, SysidError>,
        care: Care,
    ) -> Result<Candidate, SysidError> {
        let shared = || -> Result<_, SysidError> {
            if let Some(known) = with_gain.get() {
                return Ok(known.clone());
            }
            let found = self.with_gain(data, simulation, care)?;
            Ok(with_gain.get_or_init(|| found).clone())
        };
        let model = match way {
            Way::Simulation => shared()?,
            Way::Prediction => self.prediction(data, &shared()?, care)?,
            Way::Subspace => {
                let estimates = subspace()?;
                self.with_gain(data, estimates.first().unwrap_or(simulation), care)?
            }
        };
        self.with_long_gain(data, &model)
    }
}
