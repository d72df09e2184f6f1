//! Which order: of those that held-out samples cannot tell apart, the most likely one.

use serde::{Deserialize, Serialize};

use super::candidate::Candidate;
use super::evaluate::ROUNDING;
use crate::subspace::Weighting;

/// Held-out squared errors that differ by less than this fraction are the same.
const MARGIN: f64 = 0.01;

/// Difference of the information criterion that is very strong evidence (Kass and Raftery 1995).
const VERY_STRONG: f64 = 10.0;

/// A model order that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OrderTrial {
    /// n.
    pub order: usize,
    /// Horizon of the subspace estimate it was refined from.
    pub horizon: usize,
    /// Its weighting.
    pub weighting: Weighting,
    /// Fit of the simulation on held-out samples, NRMSE in %, the worst output.
    pub held_out_fit: f64,
    /// Mean logarithm of the held-out squared errors of scaled outputs, simulated and predicted.
    pub held_out_score: f64,
    /// The same logarithm on the samples it was made from, simulated.
    pub training_score: f64,
    /// Independent samples that these are worth, as coloured as the errors are.
    pub effective_samples: f64,
    /// Parameters.
    pub parameters: usize,
}

impl OrderTrial {
    /// The Bayesian information criterion per effective sample.
    #[must_use]
    pub fn information_criterion(&self) -> f64 {
        let samples = self.effective_samples.max(2.0);
        self.training_score + self.parameters as f64 * samples.ln() / samples
    }
}

/// Orders beyond the best so far that are tried in vain before larger ones are given up.
const PATIENCE: usize = 3;

/// One order with its best models, one per fold.
pub(super) struct Trial {
    pub candidates: Vec<Candidate>,
    /// Held-out mean squared errors of every part, per output.
    pub parts: Vec<Vec<f64>>,
    pub report: OrderTrial,
}

/// Position of the order to take.
///
/// Held-out errors alone are noisy where the noise is large; the information criterion alone takes
/// every order that explains what is no noise (nonlinearity, drift). So the criterion chooses among the
/// orders whose held-out errors are not significantly above the least, and a larger order needs very
/// strong evidence.
pub(super) fn choose(trials: &[Trial]) -> usize {
    let reports = || trials.iter().map(|trial| &trial.report).enumerate();
    let scores = reports().min_by(|a, b| a.1.held_out_score.total_cmp(&b.1.held_out_score));
    let best = scores.map_or(0, |(position, _)| position);
    let tied = || {
        reports().filter(|(position, _)| {
            let (excess, error) = excess(&trials[*position].parts, &trials[best].parts);
            excess <= (2.0 * error).max(MARGIN)
        })
    };
    let evidence = |smaller: &OrderTrial, larger: &OrderTrial| {
        let gain = smaller.information_criterion() - larger.information_criterion();
        gain * larger.effective_samples
    };
    let beaten = |small: &OrderTrial| {
        let larger = tied().filter(|(_, other)| other.order > small.order);
        larger
            .into_iter()
            .any(|(_, large)| evidence(small, large) > VERY_STRONG)
    };
    let chosen = tied().find(|(_, report)| !beaten(report));
    chosen.map_or(best, |(position, _)| position)
}

/// How much larger the errors are than the best ones, relative to these, and the standard error of
/// that: from the parts, mean over the outputs.
fn excess(parts: &[Vec<f64>], best: &[Vec<f64>]) -> (f64, f64) {
    let count = best.len() as f64;
    let outputs = best.first().map_or(0, Vec::len);
    let mut differences = vec![0.0; best.len()];
    for output in 0..outputs {
        let mean = best.iter().map(|part| part[output]).sum::<f64>() / count;
        if mean <= ROUNDING {
            continue;
        }
        for (difference, (part, best)) in differences.iter_mut().zip(parts.iter().zip(best)) {
            *difference += (part[output] - best[output]) / mean / outputs as f64;
        }
    }
    let mean = differences.iter().sum::<f64>() / count;
    let squares = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
    (mean, (squares / (count * (count - 1.0).max(1.0))).sqrt())
}

/// Whether the last orders tried were no better than a smaller one.
pub(super) fn is_hopeless(trials: &[Trial]) -> bool {
    let scores = trials.iter().map(|trial| trial.report.held_out_score);
    let best = scores.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    trials.len() > best.map_or(0, |(position, _)| position) + PATIENCE
}
