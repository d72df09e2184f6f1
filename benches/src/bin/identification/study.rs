//! The synthetic study: a known system, several noise levels, many seeds, everything automatic.

use std::time::Instant;

use anyhow::Result;
use benches::synthetic;
use indicatif::ProgressBar;
use serde::Serialize;
use sysid::{InitialStateFor, identify};

/// Samples of a recording.
pub const SAMPLES: usize = 3000;

/// Signal-to-noise ratios in dB.
pub const LEVELS_DB: [f64; 2] = [20.0, 10.0];

/// One recording identified.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    pub snr_db: f64,
    pub seed: u64,
    pub order: usize,
    pub horizon: usize,
    /// NRMSE fit of the simulated output to the output without noise, in %.
    pub fit_noise_free: f64,
    pub stable: bool,
    pub time_ms: f64,
}

/// Identifies the recordings of all seeds at all levels.
pub fn run(seeds: u64, bar: &ProgressBar) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for snr_db in LEVELS_DB {
        for seed in 0..seeds {
            bar.set_message(format!("study: {snr_db} dB, seed {seed}"));
            trials.push(trial(seed, snr_db)?);
            bar.inc(1);
        }
    }
    Ok(trials)
}

fn trial(seed: u64, snr_db: f64) -> Result<Trial> {
    let recording = synthetic::record(seed, SAMPLES, snr_db)?;
    let start = Instant::now();
    let found = identify(&recording.data)?;
    let time_ms = start.elapsed().as_secs_f64() * 1e3;
    let record = &recording.data.records()[0];
    let model = &found.model;
    let initial = model.initial_state(
        record.inputs(),
        record.outputs(),
        InitialStateFor::Simulation,
    )?;
    let simulated = model.simulate(&initial, record.inputs())?;
    let truth = recording.noise_free.col(0);
    let mean = truth.sum() / SAMPLES as f64;
    let spread = truth.iter().map(|y| (y - mean).powi(2)).sum::<f64>();
    let errors = truth.iter().zip(simulated.col(0).iter());
    let error = errors.map(|(y, model)| (y - model).powi(2)).sum::<f64>();
    Ok(Trial {
        snr_db,
        seed,
        order: model.order(),
        horizon: found.report.horizon,
        fit_noise_free: 100.0 * (1.0 - (error / spread).sqrt()),
        stable: model.is_stable()?,
        time_ms,
    })
}

/// Median, least and number of right orders of one level.
pub struct Summary {
    pub snr_db: f64,
    pub seeds: usize,
    pub median: f64,
    pub least: f64,
    pub right_order: usize,
    pub stable: usize,
    pub median_time_ms: f64,
}

pub fn summaries(trials: &[Trial]) -> Vec<Summary> {
    let level = |snr_db: f64| {
        let of_level: Vec<_> = trials
            .iter()
            .filter(|t| t.snr_db.total_cmp(&snr_db).is_eq())
            .collect();
        let median = |of: fn(&Trial) -> f64| {
            let mut values: Vec<_> = of_level.iter().map(|t| of(t)).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        };
        let fits = of_level.iter().map(|t| t.fit_noise_free);
        Summary {
            snr_db,
            seeds: of_level.len(),
            median: median(|t| t.fit_noise_free),
            least: fits.fold(f64::INFINITY, f64::min),
            right_order: of_level
                .iter()
                .filter(|t| t.order == synthetic::ORDER)
                .count(),
            stable: of_level.iter().filter(|t| t.stable).count(),
            median_time_ms: median(|t| t.time_ms),
        }
    };
    LEVELS_DB.into_iter().map(level).collect()
}
