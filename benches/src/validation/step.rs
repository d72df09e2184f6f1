//! Whether the step of 1 ms is small enough: every scenario and every manoeuvre with half of it.
//!
//! A vehicle on two wheels is an inverted pendulum: it makes whatever differs larger. So rows tell when
//! the first side lifted, and what the difference was up to then.

use std::fmt::Write;

use anyhow::{Context, Result, anyhow};
use serde::de::DeserializeOwned;
use vehicle_dyn::driver::{Driver, DriverParameters};
use vehicle_dyn::manoeuvre::{ManoeuvreFile, RunConvergence, RunSettings, converges};
use vehicle_dyn::metrics::{Outcome, OutcomeMonitor};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::{Course, CourseDescription};
use vehicle_dyn::simulation::{Command, DEFAULT_SUBSTEP_S, InitialPose, Simulation};
use vehicle_dyn::terrain::{GroundDescription, Terrain};
use vehicle_dyn::units::KMH;

use super::Row;

/// Largest change of LTR that half the step may bring.
pub const LTR_TOLERANCE: f64 = 1e-3;
/// A difference this far above the tolerance after lift-off comes from tipping, not from the step.
const TIPS: &str = "a vehicle on two wheels is unstable and makes every difference larger";

/// A road, its ground and who drives on it without a controller.
pub struct Drive {
    /// What it is of.
    pub name: String,
    vehicle: VehicleParameters,
    driver: DriverParameters,
    course: Course,
    terrain: Terrain,
    speed_kmh: f64,
    ticks: u32,
    tick_s: f64,
}

/// LTR at every tick of a drive.
pub struct Driven {
    /// Pairs of time (s) and LTR.
    pub ltr: Vec<(f64, f64)>,
    /// When a side first carried nothing, s.
    pub lift_s: Option<f64>,
    /// How it ended.
    pub outcome: Outcome,
}

/// The drives of a scenario file: its course, and the course of its recording, by the driver alone.
///
/// # Errors
/// When the text is no scenario; `origin` names it.
pub fn scenario_drives(text: &str, origin: &str) -> Result<Vec<Drive>> {
    let scenario: toml::Table = text.parse().with_context(|| format!("in {origin}"))?;
    let name: String = part(&scenario, "name", origin)?;
    let vehicle = vehicle_dyn::vehicles::find(&part::<String>(&scenario, "vehicle", origin)?)?;
    let driver = match scenario.get("driver") {
        Some(_) => part(&scenario, "driver", origin)?,
        None => vehicle
            .driver
            .with_context(|| format!("{origin} and its vehicle have no driver"))?,
    };
    let ground: GroundDescription = part(&scenario, "ground", origin)?;
    let tick_s: f64 = part(&scenario, "sample_time_s", origin)?;
    let mut drives = Vec::new();
    let recording: toml::Table = part(&scenario, "recording", origin)?;
    for (name, table, speed) in [
        (name.clone(), &scenario, "speed_reference_kmh"),
        (format!("{name}, recording"), &recording, "target_speed_kmh"),
    ] {
        let course = Course::new(&part::<CourseDescription>(table, "course", origin)?)?;
        let ground = match table.get("ground") {
            Some(_) => part(table, "ground", origin)?,
            None => ground.clone(),
        };
        let duration_s: f64 = part(table, "duration_s", origin)?;
        drives.push(Drive {
            name,
            vehicle: vehicle.clone(),
            driver,
            terrain: Terrain::build(&ground, &course)?,
            course,
            speed_kmh: part(table, speed, origin)?,
            ticks: ticks(duration_s, tick_s),
            tick_s,
        });
    }
    Ok(drives)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a positive and small count"
)]
fn ticks(duration_s: f64, tick_s: f64) -> u32 {
    (duration_s / tick_s).round() as u32
}

fn part<T: DeserializeOwned>(table: &toml::Table, key: &str, origin: &str) -> Result<T> {
    table
        .get(key)
        .ok_or_else(|| anyhow!("{origin} has no `{key}`"))?
        .clone()
        .try_into()
        .with_context(|| format!("`{key}` in {origin}"))
}

impl Drive {
    /// Name of the vehicle that drives.
    #[must_use]
    pub fn vehicle_name(&self) -> &str {
        &self.vehicle.name
    }

    /// Drives with the integration step `substep_s`.
    ///
    /// # Errors
    /// When the simulation fails.
    pub fn with_step(&self, substep_s: f64) -> Result<Driven> {
        // Courses begin at the origin along x.
        let pose = InitialPose {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
            speed_m_s: self.speed_kmh * KMH,
        };
        let terrain = self.terrain.clone();
        let mut simulation = Simulation::with_substep(&self.vehicle, terrain, pose, substep_s)?;
        let mut driver = Driver::new(&self.driver)?;
        let mut monitor = OutcomeMonitor::new(self.course.width_m());
        let mut seen = simulation.observation();
        let mut ltr = vec![(seen.time_s, seen.ltr)];
        let mut lift_s = None;
        for _ in 0..self.ticks {
            let action = driver.step(&self.course, &seen, self.tick_s);
            let command = Command::from_deg_kmh(action.handwheel_deg, self.speed_kmh);
            seen = simulation.step(command, self.tick_s)?;
            ltr.push((seen.time_s, seen.ltr));
            if seen.two_wheel_lift() {
                lift_s.get_or_insert(seen.time_s);
            }
            if !monitor.observe(&seen, action.location.lateral_offset_m) {
                break;
            }
        }
        Ok(Driven {
            ltr,
            lift_s,
            outcome: monitor.outcome(),
        })
    }

    /// The change of LTR with half the step.
    ///
    /// # Errors
    /// When a simulation fails.
    pub fn row(&self) -> Result<Row> {
        let whole = self.with_step(DEFAULT_SUBSTEP_S)?;
        let half = self.with_step(0.5 * DEFAULT_SUBSTEP_S)?;
        let (largest, time_s) = largest_difference(&whole.ltr, &half.ltr, f64::INFINITY);
        let lift_s = earlier(whole.lift_s, half.lift_s);
        let before = largest_difference(&whole.ltr, &half.ltr, lift_s.unwrap_or(f64::INFINITY)).0;
        let length_s = (whole.ltr.len().abs_diff(half.ltr.len())) as f64 * self.tick_s;
        Ok(row(&self.name, largest).remarked(format!(
            "{}{}",
            remark(largest, time_s, lift_s, before, length_s),
            if whole.outcome == Outcome::Completed {
                String::new()
            } else {
                format!("; it ends as {}", whole.outcome)
            }
        )))
    }
}

fn row(of: &str, largest: f64) -> Row {
    Row::absolute(
        format!("{of}: largest change of LTR with half the step, whole run"),
        "",
        0.0,
        LTR_TOLERANCE,
        largest,
    )
}

fn remark(largest: f64, time_s: f64, lift_s: Option<f64>, before: f64, length_s: f64) -> String {
    let mut text = match lift_s {
        None => "no side lifts".to_owned(),
        Some(lift_s) => {
            format!("first two-wheel lift at {lift_s:.2} s, change of LTR up to then {before:.1e}")
        }
    };
    if largest > LTR_TOLERANCE {
        let _ = write!(text, "; largest at {time_s:.2} s");
        if lift_s.is_some_and(|lift_s| time_s >= lift_s) {
            let _ = write!(text, ": {TIPS}");
        }
    }
    if length_s > 0.0 {
        let _ = write!(text, "; the two runs end {length_s:.3} s apart");
    }
    text
}

fn earlier(one: Option<f64>, other: Option<f64>) -> Option<f64> {
    one.into_iter().chain(other).reduce(f64::min)
}

/// Largest difference of two signals at equal times before `until_s`, and when.
#[must_use]
pub fn largest_difference(one: &[(f64, f64)], other: &[(f64, f64)], until_s: f64) -> (f64, f64) {
    one.iter().zip(other).filter(|(a, _)| a.0 < until_s).fold(
        (0.0, 0.0),
        |largest: (f64, f64), (a, b)| {
            let difference = (a.1 - b.1).abs();
            if difference > largest.0 {
                (difference, a.0)
            } else {
                largest
            }
        },
    )
}

/// A manoeuvre of a vehicle: its run with the largest change. What cannot be compared is NaN, which
/// passes nothing, and the remark says why.
#[must_use]
pub fn manoeuvre_row(file: &ManoeuvreFile, vehicle: &VehicleParameters) -> Row {
    match converges(file, vehicle, RunSettings::default()) {
        Ok(runs) => of_runs(&file.name, &runs),
        Err(error) => row(&file.name, f64::NAN).remarked(error.to_string()),
    }
}

fn of_runs(name: &str, runs: &[RunConvergence]) -> Row {
    let worst = runs
        .iter()
        .max_by(|a, b| a.ltr_difference.total_cmp(&b.ltr_difference));
    let Some(worst) = worst else {
        return row(name, f64::NAN).remarked("it has no runs");
    };
    let before = runs
        .iter()
        .map(|run| run.ltr_difference_before_lift)
        .fold(0.0, f64::max);
    let mut text = format!(
        "largest in run {} at {:.2} s; before a side lifts at most {before:.1e}",
        worst.run, worst.time_s
    );
    if worst.ltr_difference > LTR_TOLERANCE && worst.ltr_difference_before_lift <= LTR_TOLERANCE {
        let _ = write!(text, ": {TIPS}");
    }
    if worst.length_difference_s > 0.0 {
        let _ = write!(
            text,
            "; its two runs end {:.3} s apart",
            worst.length_difference_s
        );
    }
    row(name, worst.ltr_difference).remarked(text)
}
