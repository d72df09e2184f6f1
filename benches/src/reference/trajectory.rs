//! Trajectories of the reference model: a folder with `NAME/RUN.csv`, `NAME.parameters.json` and
//! `summary.json`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

/// What `summary.json` says of one run. Other keys are not needed.
#[derive(Debug, Clone, Deserialize)]
pub struct RunSummary {
    /// Name of the vehicle's folder.
    pub vehicle: String,
    /// Name of the run and its file.
    pub name: String,
    /// Speed at the start, m/s.
    pub v0: f64,
    /// Time up to which the reference holds, s; `None` is to the end.
    pub valid_until: Option<f64>,
}

/// One sample of a trajectory, in ISO 8855 axes. The reference's own columns, SI units.
#[allow(non_snake_case, reason = "names of the reference")]
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Sample {
    /// Time, s.
    pub t_s: f64,
    /// Forward speed, m/s.
    pub vx_mps: f64,
    /// Lateral speed, m/s.
    pub vy_mps: f64,
    /// Yaw rate, rad/s.
    pub yawrate_radps: f64,
    /// Mean angle of the front wheels, rad.
    pub delta_rad: f64,
    /// Longitudinal acceleration, m/s².
    pub ax_mps2: f64,
    /// Lateral tyre forces over mass, m/s².
    pub ay_total_mps2: f64,
    /// Roll angle of the body, rad.
    pub roll_rad: f64,
    /// Pitch angle of the body, rad.
    pub pitch_rad: f64,
    /// Load transfer ratio.
    pub LTR: f64,
    /// Commanded acceleration, m/s².
    pub acc_cmd_mps2: f64,
}

/// One run of the reference with what holds of it.
#[derive(Debug, Clone)]
pub struct Trajectory {
    /// Its summary.
    pub summary: RunSummary,
    /// Samples up to the end of validity.
    pub samples: Vec<Sample>,
}

impl Trajectory {
    /// The runs of `vehicle` that `folder` holds.
    ///
    /// # Errors
    /// When the summary or a file is missing, malformed or empty.
    pub fn read_all(folder: &Path, vehicle: &str) -> Result<Vec<Self>> {
        let path = folder.join("summary.json");
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let runs: Vec<RunSummary> = serde_json::from_str(&text)
            .with_context(|| format!("{} is no summary of runs", path.display()))?;
        let runs: Vec<_> = runs
            .into_iter()
            .filter(|run| run.vehicle == vehicle)
            .collect();
        ensure!(
            !runs.is_empty(),
            "{} has no run of vehicle `{vehicle}`",
            path.display()
        );
        runs.into_iter()
            .map(|run| Self::read(folder, run))
            .collect()
    }

    fn read(folder: &Path, summary: RunSummary) -> Result<Self> {
        let file = format!("{}.csv", summary.name);
        let path: PathBuf = folder.join(&summary.vehicle).join(file);
        let mut reader = csv::Reader::from_path(&path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let mut samples = Vec::new();
        for row in reader.deserialize() {
            let sample: Sample = row.with_context(|| format!("in {}", path.display()))?;
            if summary.valid_until.is_some_and(|end| sample.t_s >= end) {
                break;
            }
            samples.push(sample);
        }
        ensure!(
            samples.len() >= 2,
            "{} has {} usable samples, and 2 are needed",
            path.display(),
            samples.len()
        );
        Ok(Self { summary, samples })
    }
}
