//! Trajectories of the reference model: a folder with `NAME/RUN.csv`, `NAME.parameters.json` and
//! `summary.json`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
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
    /// Time up to which the reference holds, s; `None` is to the end, and so is NaN.
    #[serde(default)]
    pub valid_until: Option<f64>,
    /// Length of the run, s, where the summary gives it: a file that ends before is cut.
    #[serde(default, rename = "T")]
    pub duration_s: Option<f64>,
}

/// How far before its stated end a run may stop, s: a row or two.
const END_TOLERANCE_S: f64 = 0.05;

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

impl Sample {
    /// The first column without a finite number.
    fn not_finite(&self) -> Option<(&'static str, f64)> {
        [
            ("t_s", self.t_s),
            ("vx_mps", self.vx_mps),
            ("vy_mps", self.vy_mps),
            ("yawrate_radps", self.yawrate_radps),
            ("delta_rad", self.delta_rad),
            ("ax_mps2", self.ax_mps2),
            ("ay_total_mps2", self.ay_total_mps2),
            ("roll_rad", self.roll_rad),
            ("pitch_rad", self.pitch_rad),
            ("LTR", self.LTR),
            ("acc_cmd_mps2", self.acc_cmd_mps2),
        ]
        .into_iter()
        .find(|(_, value)| !value.is_finite())
    }
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
        // Python writes NaN and Infinity, which JSON does not have.
        let runs: Vec<RunSummary> = json5::from_str(&text)
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

    fn read(folder: &Path, mut summary: RunSummary) -> Result<Self> {
        summary.valid_until = summary.valid_until.filter(|end| end.is_finite());
        let file = format!("{}.csv", summary.name);
        let path: PathBuf = folder.join(&summary.vehicle).join(file);
        ensure!(
            summary.v0.is_finite() && summary.v0 >= 0.0,
            "v0 of run {} in the summary is {}: must be a speed in m/s",
            summary.name,
            summary.v0
        );
        let mut reader = csv::Reader::from_path(&path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let mut samples: Vec<Sample> = Vec::new();
        for (index, row) in reader.deserialize().enumerate() {
            let sample: Sample = row.with_context(|| format!("in {}", path.display()))?;
            if summary.valid_until.is_some_and(|end| sample.t_s >= end) {
                break;
            }
            let line = index + 2;
            if let Some((column, value)) = sample.not_finite() {
                bail!(
                    "in {}, line {line}: {column} is {value}; end the run before, by valid_until in summary.json",
                    path.display()
                );
            }
            if let Some(last) = samples.last().filter(|last| last.t_s >= sample.t_s) {
                bail!(
                    "in {}, line {line}: t_s is {} after {}; times must rise",
                    path.display(),
                    sample.t_s,
                    last.t_s
                );
            }
            samples.push(sample);
        }
        ensure!(
            samples.len() >= 2,
            "{} has {} usable samples, and 2 are needed",
            path.display(),
            samples.len()
        );
        let whole = summary.duration_s.filter(|duration| duration.is_finite());
        let expected =
            whole.map(|duration| summary.valid_until.map_or(duration, |t| t.min(duration)));
        let last = samples[samples.len() - 1].t_s;
        if let Some(expected) = expected.filter(|expected| last < expected - END_TOLERANCE_S) {
            bail!(
                "{} ends at {last} s, and summary.json says {expected} s: the file is cut",
                path.display()
            );
        }
        Ok(Self { summary, samples })
    }
}
