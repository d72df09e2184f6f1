//! The run log: one CSV schema for every run, simulated or driven for real.
//!
//! A row belongs to one control step. Its inputs were applied over the interval that *ends* at
//! `time_s`; everything else was measured at that end. So a row pairs an input with its response,
//! the convention of `deepc-core`. Only `step_time_us` differs between two runs of one seed.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

/// One control step of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogRow {
    /// End of the step's interval, s since the start of the run.
    pub time_s: f64,
    /// Steering-wheel angle commanded over the interval, deg, left positive.
    pub steering_wheel_deg: f64,
    /// Target speed commanded over the interval, km/h.
    pub target_speed_kmh: f64,
    /// What the driver asked for, deg.
    pub steering_wheel_reference_deg: f64,
    /// The speed reference, km/h.
    pub target_speed_reference_kmh: f64,
    /// Load transfer ratio (paper eq. 2), dimensionless, positive in a left turn: the true one, where
    /// the source knows it.
    pub ltr: f64,
    /// What the controller was given of it: the sensor's reading; absent where the sample was
    /// lost, and in logs that have no such column.
    #[serde(default)]
    pub ltr_measured: Option<f64>,
    /// Load-transfer index from roll angle, roll rate and lateral acceleration, dimensionless; absent
    /// where it is not known, as are the four below.
    #[serde(default)]
    pub load_transfer_index: Option<f64>,
    /// Lateral acceleration at the centre of gravity, m/s², left positive.
    #[serde(default)]
    pub lateral_acceleration_m_s2: Option<f64>,
    /// Yaw rate, deg/s, counter-clockwise positive.
    #[serde(default)]
    pub yaw_rate_deg_s: Option<f64>,
    /// Roll rate of the body, deg/s, right side down positive.
    #[serde(default)]
    pub roll_rate_deg_s: Option<f64>,
    /// Height of both wheels of one side off the ground, m; 0 while each side has one on it.
    #[serde(default)]
    pub two_wheel_clearance_m: Option<f64>,
    /// Vertical tyre load, front left, N.
    pub load_front_left_n: f64,
    /// Vertical tyre load, front right, N.
    pub load_front_right_n: f64,
    /// Vertical tyre load, rear left, N.
    pub load_rear_left_n: f64,
    /// Vertical tyre load, rear right, N.
    pub load_rear_right_n: f64,
    /// Roll angle of the body, deg, right side down positive.
    pub roll_deg: f64,
    /// Forward speed, km/h.
    pub speed_kmh: f64,
    /// Distance from the course's centre line, m, left positive.
    pub path_deviation_m: f64,
    /// Distance along the course, m; absent in logs that do not know it.
    #[serde(default)]
    pub station_m: Option<f64>,
    /// Position east, m.
    pub x_m: f64,
    /// Position north, m.
    pub y_m: f64,
    /// Heading, deg, counter-clockwise positive.
    pub yaw_deg: f64,
    /// Sideslip angle at the centre of gravity, deg.
    pub sideslip_deg: f64,
    /// How the input was found.
    pub solve_status: SolveStatus,
    /// By how much the plan exceeds its softened output bound at worst, in LTR.
    pub predicted_violation: f64,
    /// Iterations of the QP solver in this step.
    pub iterations: u32,
    /// Wall-clock time of the controller's decision, µs.
    pub step_time_us: f64,
}

/// How the input of a step was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// No optimisation: the driver's own input, or the past window is not full yet.
    Passthrough,
    /// The unconstrained optimum respects every bound, so it is the optimum.
    Unconstrained,
    /// The QP solver's optimum.
    Solved,
    /// The second solver's optimum: the first one failed.
    SolvedBySecond,
    /// A later move of the previous solve's plan.
    Plan,
    /// The solve failed: the previous plan, shifted.
    FallbackPlan,
    /// The solve failed and no plan was left: the last input is held.
    FallbackHold,
    /// The solve failed, plan and hold were used up: the user's own choice.
    FallbackUser,
}

impl SolveStatus {
    /// Whether the step fell back because its solve failed.
    #[must_use]
    pub fn is_fallback(self) -> bool {
        matches!(
            self,
            Self::FallbackPlan | Self::FallbackHold | Self::FallbackUser
        )
    }
}

/// Writes a run log row by row. Whatever stops the run, the file holds whole rows only.
pub struct LogWriter {
    path: PathBuf,
    file: File,
    /// Rows not yet in the file.
    buffer: Vec<u8>,
    /// Length of the file, which holds whole rows only.
    whole_bytes: u64,
    rows: usize,
}

/// Rows between two flushes: half a second of a run at the paper's sample time.
const FLUSH_EVERY: usize = 50;

impl LogWriter {
    /// Creates the file, replacing an old one.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::create(path).with_context(|| {
            format!(
                "cannot write to {}: choose another folder with --out",
                path.display()
            )
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            file,
            buffer: Vec::new(),
            whole_bytes: 0,
            rows: 0,
        })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// When the disk refuses it (full, removed).
    pub fn append(&mut self, row: &LogRow) -> Result<()> {
        let mut csv = csv::WriterBuilder::new()
            .has_headers(self.rows == 0)
            .from_writer(&mut self.buffer);
        csv.serialize(row)?;
        csv.flush()?;
        drop(csv);
        self.rows += 1;
        if self.rows.is_multiple_of(FLUSH_EVERY) {
            self.flush()
        } else {
            Ok(())
        }
    }

    /// Writes out what is buffered and closes the file.
    ///
    /// # Errors
    /// When the disk refuses it (full, removed).
    pub fn finish(mut self) -> Result<()> {
        self.flush()
    }

    fn flush(&mut self) -> Result<()> {
        if let Err(error) = self.file.write_all(&self.buffer) {
            // Takes back half a row. The error at hand is the one to report; that the file
            // cannot be cut either would add nothing.
            let _ = self.file.set_len(self.whole_bytes);
            return Err(error).with_context(|| {
                format!(
                    "cannot write the log up to row {} of {}: is the disk full? Free some room or choose another folder with --out",
                    self.rows,
                    self.path.display()
                )
            });
        }
        self.whole_bytes += self.buffer.len() as u64;
        self.buffer.clear();
        Ok(())
    }
}

/// Reads a run log.
///
/// # Errors
/// Names the file and the line of the first row that cannot be read, and says so when there is
/// no row at all.
pub fn read(path: &Path) -> Result<Vec<LogRow>> {
    let mut reader = csv::Reader::from_path(path)
        .with_context(|| format!("cannot read the run log {}", path.display()))?;
    let rows = reader
        .deserialize()
        .collect::<Result<Vec<LogRow>, _>>()
        .with_context(|| format!("{} is not a complete run log", path.display()))?;
    if rows.is_empty() {
        bail!("the run log {} holds no rows", path.display());
    }
    Ok(rows)
}
