//! From a recording to a model, with everything else found from the data.

mod candidate;
mod effects;
mod evaluate;
mod feedthrough;
mod focus;
mod folds;
mod horizon;
mod offsets;
mod order;
mod report;
mod response;
mod settings;

use std::ops::ControlFlow;

use deepc_core::data::Dataset;
use deepc_core::faer::MatRef;

pub use order::OrderTrial;
pub use report::{
    EffectVerdict, IdentificationReport, InputEffect, UNIDENTIFIED_RATIO,
    UNIDENTIFIED_RESPONSE_RATIO,
};
pub use response::UncertainResponse;
pub use settings::{Feedthrough, FocusChoice, IdentificationSettings, OffsetChoice};

use candidate::{Basis, Candidate, Care, Search, bases};
use evaluate::{
    ROUNDING, effective_samples, innovation_covariance, mean_log, mean_squares,
    mean_squares_by_part, simulated,
};
use focus::{Focused, Way};
use folds::Fold;
use order::{Trial, choose};

use crate::error::SysidError;
use crate::state_space::{StateSpace, SystemMatrices};
use crate::uncertainty::Uncertainty;
use crate::working::{Centre, WorkingData};

/// Parts of every held-out record whose errors are compared.
const PARTS: usize = 4;

/// A model and how it came about.
#[derive(Debug, Clone)]
pub struct Identification {
    /// The model: stable, in the units of the recording.
    pub model: StateSpace,
    /// Order, alternatives, uncertainty and warnings.
    pub report: IdentificationReport,
    pub(crate) uncertainty: Uncertainty,
}

/// How far a long identification is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub stage: &'static str,
    /// Steps done.
    pub done: usize,
    /// Steps in all.
    pub total: usize,
}

/// The best model of a recording: horizon, order, feedthrough, focus and noise model are chosen on
/// held-out samples.
///
/// ```
/// use deepc_core::data::Dataset;
///
/// // A tank of first order, shaken by a pseudo-random valve, its level at 40.
/// let (mut level, mut valves, mut levels) = (0.0, Vec::new(), Vec::new());
/// for k in 0..400_u32 {
///     let valve = f64::from(k * k * 7 % 101) / 50.0 - 1.0;
///     level = 0.9 * level + 0.5 * valve;
///     valves.push(valve);
///     levels.push(40.0 + level);
/// }
/// let mut data = Dataset::new(1.0, ["valve"], ["level"])?;
/// data.push_rows(&valves, &levels)?;
///
/// let identification = sysid::identify(&data)?;
/// println!("{}", identification.report);
/// assert_eq!(identification.model.order(), 1);
/// assert!((identification.model.steady_state_gain()?[(0, 0)] - 5.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The recording is too short, a channel is constant, or the inputs do not excite the plant.
pub fn identify(data: &Dataset) -> Result<Identification, SysidError> {
    let settings = IdentificationSettings::default();
    identify_with(data, &settings, &mut |_| ControlFlow::Continue(()))
}

/// The same with settings of one's own. `progress` is called between steps and may end the work.
///
/// # Errors
/// As [`identify`]; a setting is out of range, the order is larger than the data carry, or `progress`
/// ended the work ([`SysidError::Interrupted`]).
pub fn identify_with(
    data: &Dataset,
    settings: &IdentificationSettings,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Identification, SysidError> {
    let names = [data.input_names(), data.disturbance_names()].concat();
    settings.check(&names)?;
    let scaled = WorkingData::about(
        data,
        match settings.offsets {
            OffsetChoice::Found | OffsetChoice::Means => Centre::Means,
            OffsetChoice::None => Centre::Origin,
        },
    )?;
    let all = scaled.with_constant();
    let splits = folds::split(&scaled, settings.folds)?;
    let of_whole = |error| folds::of_whole_records(error, &scaled, settings.folds);
    let horizons = horizon::horizons(&splits[0].0, settings.horizons.as_deref());
    let horizons = horizons.map_err(of_whole)?;
    // Beyond a whole held-out record there is nothing to predict.
    let longest = splits.iter().map(|(_, held_out)| held_out.longest()).min();
    let settings = &IdentificationSettings {
        steps_ahead: settings.steps_ahead.min(longest.unwrap_or(1)),
        ..settings.clone()
    };
    let (first, last) = match settings.order {
        Some(order) => (order, order),
        None => (1, settings.max_order),
    };
    let mut search = Search {
        settings,
        structure: feedthrough::first_structure(&names, settings),
    };
    let mut steps = Steps::new((last - first).saturating_add(5), progress);

    steps.next("projecting the recording")?;
    let folds = folds::project(&splits, &horizons, settings).map_err(of_whole)?;
    let mut trials: Vec<Trial> = Vec::new();
    for order in first..=last {
        steps.next("making models of every order")?;
        match search.trial(&folds, order) {
            Ok(trial) => trials.push(trial),
            // Larger ones are beyond the data, too.
            Err(SysidError::Order { .. }) if !trials.is_empty() => break,
            Err(error) => return Err(error),
        }
        if order::is_hopeless(&trials) {
            break;
        }
    }
    let chosen = choose(&trials);
    let order = trials[chosen].report.order;

    steps.next("choosing feedthrough and focus")?;
    let found = bases(&scaled, &horizons, settings)?;
    let mut starts = search.subspace(&all, &found, order)?;
    let mut best = search.refined(&all, &starts, Care::Rough)?;
    for candidate in &trials[chosen].candidates {
        let refitted = search.refitted(&all, candidate, Care::Rough)?;
        if refitted.loss < best.loss {
            best = refitted;
        }
    }
    if settings.feedthrough == Feedthrough::Automatic {
        best = feedthrough::eliminate(&mut search, &all, best)?;
        starts = search.subspace(&all, &found, order)?;
    }
    let mut focused = search.focused(&folds, &trials[chosen].candidates)?;

    steps.next("making the model from all samples")?;
    let best = search.simulation(&all, &best, Care::Full)?;
    let last = match search.along(focused.way, &all, &best, || Ok(starts), Care::Full) {
        Ok(last) => last,
        // The way was open on every part, but is not on the whole: the start of all ways is left.
        Err(_) if focused.way != Way::Simulation => {
            focused.way = Way::Simulation;
            search.with_long_gain(&all, &best)?
        }
        Err(error) => return Err(error),
    };
    steps.next("measuring uncertainty")?;
    search.finish(&scaled, &all, trials, &focused, &last, &found)
}

/// Counts the steps and asks whether to go on.
struct Steps<'a> {
    done: usize,
    total: usize,
    progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

impl<'a> Steps<'a> {
    fn new(total: usize, progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Self {
        Self {
            done: 0,
            total,
            progress,
        }
    }

    fn next(&mut self, stage: &'static str) -> Result<(), SysidError> {
        let progress = Progress {
            stage,
            done: self.done,
            total: self.total,
        };
        self.done += 1;
        match (self.progress)(&progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(SysidError::Interrupted {
                done: progress.done,
                total: self.total,
            }),
        }
    }
}

impl Search<'_> {
    /// The best models of one order from the training records of every fold, judged on the others.
    fn trial(&self, folds: &[Fold], order: usize) -> Result<Trial, SysidError> {
        let part = 1.0 / folds.len() as f64;
        let (mut candidates, mut score, mut training_score, mut worth) =
            (Vec::new(), 0.0, 0.0, 0.0);
        let mut parts = Vec::new();
        let mut mean_fit = vec![0.0; folds[0].held_out.outputs.len()];
        for fold in folds {
            let training = &fold.training;
            let estimates = self.subspace(training, &fold.bases, order)?;
            let candidate = self.refined(training, &estimates, Care::Rough)?;
            let held_out = simulated(&fold.held_out, &candidate.model)?;
            let errors = mean_squares(&held_out);
            parts.extend(mean_squares_by_part(&held_out, PARTS));
            score += part * mean_log(&errors);
            let fits = fits(&fold.held_out, &errors);
            mean_fit
                .iter_mut()
                .zip(fits)
                .for_each(|(mean, fit)| *mean += part * fit);

            training_score += part * candidate.loss;
            worth += part * effective_samples(training, &candidate.model)?;
            candidates.push(candidate);
        }
        let (m, p) = (folds[0].training.inputs.len() - 1, mean_fit.len());
        Ok(Trial {
            report: OrderTrial {
                order,
                horizon: candidates[0].horizon,
                weighting: candidates[0].weighting,
                held_out_fit: mean_fit.into_iter().fold(f64::INFINITY, f64::min),
                held_out_score: score,
                training_score,
                effective_samples: worth * p as f64,
                parameters: order * (m + p) + feedthrough::entries(&self.structure, p),
            },
            candidates,
            parts,
        })
    }

    fn finish(
        &self,
        scaled: &WorkingData,
        all: &WorkingData,
        trials: Vec<Trial>,
        focused: &Focused,
        last: &Candidate,
        bases: &[Basis],
    ) -> Result<Identification, SysidError> {
        let uncertainty = Uncertainty::of(all, &last.model, &self.structure)?;
        let covariance = innovation_covariance(all, &last.model)?;
        let model = to_state_space(scaled, &last.model, covariance.as_ref())?;
        let radius = model.spectral_radius()?;
        if radius.is_nan() || radius >= 1.0 {
            return Err(SysidError::Unstable {
                what: "A of the identified model",
                radius,
                limit: 1.0,
                remedy: "record longer, or lower `stability_radius`",
            });
        }
        let effects = effects::effects(scaled, &model, &last.model, &uncertainty, self);
        let basis = bases
            .iter()
            .find(|b| (b.horizon, b.weighting) == (last.horizon, last.weighting));
        let values = basis.map_or(&[][..], |basis| &basis.projection.singular_values);
        let largest = values.first().copied().unwrap_or(1.0);
        let mut report = IdentificationReport {
            samples: scaled.samples(),
            records: scaled.records.len(),
            order: last.model.order(),
            trials: trials.into_iter().map(|trial| trial.report).collect(),
            horizon: last.horizon,
            weighting: last.weighting,
            singular_values: values.iter().map(|value| value / largest).collect(),
            offsets: self.settings.offsets,
            focus: match focused.way {
                Way::Prediction => FocusChoice::Prediction,
                Way::Simulation | Way::Subspace => FocusChoice::Simulation,
            },
            refined: focused.way != Way::Subspace,
            unstable_radius: last.unstable_radius,
            held_out_fit: focused.fit.clone(),
            held_out_prediction_fit: focused.prediction_fit.clone(),
            steps_ahead: self.settings.steps_ahead,
            effects,
            coloured_innovations: uncertainty.coloured,
            warnings: Vec::new(),
        };
        report.warnings = effects::warnings(&report, self.settings, radius);
        report
            .warnings
            .extend(offsets::warnings(scaled, self.settings.offsets));
        Ok(Identification {
            model,
            report,
            uncertainty,
        })
    }
}

/// The model without the constant channel, whose D becomes an offset of the outputs.
pub(crate) fn to_state_space(
    scaled: &WorkingData,
    model: &SystemMatrices,
    covariance: MatRef<'_, f64>,
) -> Result<StateSpace, SysidError> {
    let m = scaled.inputs.len();
    let mut data = scaled.with_records(Vec::new());
    for (i, output) in data.outputs.iter_mut().enumerate() {
        output.offset += model.d[(i, m)] * output.scale;
    }
    let mut matrices = model.clone();
    matrices.b = model.b.subcols(0, m).to_owned();
    matrices.d = model.d.subcols(0, m).to_owned();
    data.to_state_space(&matrices, covariance)
}

/// NRMSE fits in % from mean squared errors.
fn fits(data: &WorkingData, errors: &[f64]) -> Vec<f64> {
    let p = errors.len();
    let samples = data.samples() as f64;
    (0..p)
        .map(|channel| {
            let values = || {
                let records = data.records.iter();
                records.flat_map(move |r| r.outputs.col(channel).iter().copied())
            };
            let mean = values().sum::<f64>() / samples;
            let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / samples;
            // An output that stands still here is judged by its size in the whole recording.
            let variance = if variance > ROUNDING { variance } else { 1.0 };
            100.0 * (1.0 - (errors[channel] / variance).sqrt())
        })
        .collect()
}
