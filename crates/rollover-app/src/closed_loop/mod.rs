//! One run: the vehicle, its driver and a controller between them.

mod build;
mod plant;
mod preview;
mod recorded;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use deepc_core::controller::{Controller, Origin, Plant, Reference};
use vehicle_dyn::metrics::{Outcome, two_wheel_clearance_m};
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

pub(crate) use build::deepc_problem;
pub use build::{Built, controller};
pub use plant::{DrivenVehicle, INPUTS, OUTPUTS};
pub use preview::SteeringProfile;
pub use recorded::{Recorded, Watch};

use crate::interrupt::{Interrupt, Interrupted};
use crate::run_log::{LogRow, LogWriter, SolveStatus};
use crate::scenario::Scenario;

/// What to run. The recording and the controller's settings are in `controller` already.
pub struct Run<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// Its vehicle.
    pub vehicle: &'a ReadyVehicle,
    /// The ground under its course.
    pub terrain: Terrain,
    /// Speed at the start and reference afterwards, km/h.
    pub speed_reference_kmh: f64,
    /// Seed of the sensors' random numbers.
    pub seed: u64,
    /// Target speed where no controller decides, km/h.
    pub fixed_target_speed_kmh: f64,
    /// What the controller is told of the driver's steering ahead; without, his present wish is held.
    pub preview: Option<SteeringProfile>,
    /// The controller; `None` leaves the driver alone.
    pub controller: Option<Box<dyn Controller>>,
}

impl<'a> Run<'a> {
    /// The driver alone at the scenario's speed, with seed 0.
    #[must_use]
    pub fn of_driver(scenario: &'a Scenario, vehicle: &'a ReadyVehicle, terrain: Terrain) -> Self {
        Self {
            scenario,
            vehicle,
            terrain,
            speed_reference_kmh: scenario.speed_reference_kmh,
            seed: 0,
            fixed_target_speed_kmh: scenario.speed_reference_kmh,
            preview: None,
            controller: None,
        }
    }
}

/// A finished run.
pub struct Finished {
    /// How it ended.
    pub outcome: Outcome,
    /// Its log, as written.
    pub rows: Vec<LogRow>,
}

/// Runs to the end of the scenario, or to the rollover, writing every step to `log`, if there is one.
///
/// # Errors
/// When the simulation or the disk fails, or as [`Interrupted`] when the user stops it; the log
/// then holds every step taken.
pub fn run(
    mut run: Run<'_>,
    log: Option<&Path>,
    interrupt: &Interrupt,
    mut progress: impl FnMut(),
) -> Result<Finished> {
    let mut plant = DrivenVehicle::new(
        run.scenario,
        run.vehicle,
        &run.scenario.course,
        run.terrain.clone(),
        run.speed_reference_kmh,
        (run.seed, "run"),
    )?;
    let mut writer = log.map(LogWriter::create).transpose()?;
    let mut rows = Vec::with_capacity(run.scenario.steps());
    let mut reference = run.controller.as_ref().map(|c| c.new_reference());
    while rows.len() < run.scenario.steps() && !plant.ended() {
        if interrupt.is_raised() {
            finish(writer)?;
            return Err(interrupted(rows.len(), run.scenario, log).into());
        }
        let wanted = [plant.driver_steering_deg(), run.speed_reference_kmh];
        let decision = match (run.controller.as_deref_mut(), reference.as_mut()) {
            (Some(controller), Some(reference)) => {
                match &run.preview {
                    None => reference.hold(&wanted, &[0.0; OUTPUTS])?,
                    Some(profile) => profile.fill(
                        reference,
                        &wanted,
                        (plant.location().station_m, plant.observation().speed_m_s),
                        run.scenario.sample_time_s,
                    )?,
                }
                decide(controller, reference)
            }
            _ => Decision::passthrough([wanted[0], run.fixed_target_speed_kmh]),
        };
        let mut output = [0.0];
        if let Err(error) = plant.step(&decision.input, &mut output) {
            finish(writer)?;
            return Err(error).with_context(|| {
                format!(
                    "the run stopped after {:.2} s; {}",
                    rows.len() as f64 * run.scenario.sample_time_s,
                    kept(rows.len(), log)
                )
            });
        }
        if let Some(controller) = run.controller.as_deref_mut() {
            // What is lost is not a number: the controller has a rule for it (decision 7).
            controller.observe(&decision.input, &[plant.measured_ltr()]);
        }
        let row = log_row(rows.len() + 1, &plant, &wanted, &decision, output[0]);
        if let Some(writer) = &mut writer {
            writer.append(&row)?;
        }
        rows.push(row);
        progress();
    }
    finish(writer)?;
    if let Some(time_s) = plant.not_finite_s() {
        bail!(
            "the vehicle's state is not finite at {time_s:.2} s; {}",
            kept(rows.len(), log)
        );
    }
    Ok(Finished {
        outcome: plant.outcome(),
        rows,
    })
}

fn finish(writer: Option<LogWriter>) -> Result<()> {
    writer.map_or(Ok(()), LogWriter::finish)
}

fn kept(steps: usize, log: Option<&Path>) -> String {
    match log {
        Some(log) => format!("{} holds the {steps} steps taken", log.display()),
        None => "it is run again the next time".into(),
    }
}

fn interrupted(steps: usize, scenario: &Scenario, log: Option<&Path>) -> Interrupted {
    Interrupted {
        after: format!(
            "after {:.2} s of {} s",
            steps as f64 * scenario.sample_time_s,
            scenario.duration_s
        ),
        kept: kept(steps, log),
    }
}

/// The controller's part of a log row.
struct Decision {
    input: [f64; INPUTS],
    status: SolveStatus,
    predicted_violation: f64,
    iterations: u32,
    time_us: f64,
}

impl Decision {
    fn passthrough(input: [f64; INPUTS]) -> Self {
        Self {
            input,
            status: SolveStatus::Passthrough,
            predicted_violation: 0.0,
            iterations: 0,
            time_us: 0.0,
        }
    }
}

/// Asks the controller.
fn decide(controller: &mut dyn Controller, reference: &Reference) -> Decision {
    let started = Instant::now();
    let step = controller.decide(reference);
    let time_us = started.elapsed().as_secs_f64() * 1e6;
    let status = match step.origin {
        Origin::Passthrough => SolveStatus::Passthrough,
        Origin::Unconstrained => SolveStatus::Unconstrained,
        Origin::Solver => SolveStatus::Solved,
        Origin::SecondSolver => SolveStatus::SolvedBySecond,
        Origin::Plan => SolveStatus::Plan,
        Origin::Fallback => SolveStatus::FallbackPlan,
        Origin::Hold => SolveStatus::FallbackHold,
        Origin::User => SolveStatus::FallbackUser,
    };
    Decision {
        input: [step.input[0], step.input[1]],
        status,
        predicted_violation: step.predicted_violation,
        iterations: step.iterations,
        time_us,
    }
}

fn log_row(
    step: usize,
    plant: &DrivenVehicle,
    wanted: &[f64; INPUTS],
    decision: &Decision,
    ltr: f64,
) -> LogRow {
    let seen = plant.observation();
    let [front_left, front_right, rear_left, rear_right] = seen.wheel_loads_n;
    let measured = plant.measured_ltr();
    LogRow {
        // A multiple of the sample time that prints as one would write it.
        time_s: (step as f64 * plant.sample_time_s() * 1e9).round() / 1e9,
        steering_wheel_deg: decision.input[0],
        target_speed_kmh: decision.input[1],
        steering_wheel_reference_deg: wanted[0],
        target_speed_reference_kmh: wanted[1],
        ltr,
        ltr_measured: measured.is_finite().then_some(measured),
        load_transfer_index: Some(plant.load_transfer_index()),
        lateral_acceleration_m_s2: Some(seen.lateral_acceleration_m_s2),
        yaw_rate_deg_s: Some(seen.yaw_rate_rad_s.to_degrees()),
        roll_rate_deg_s: Some(seen.roll_rate_rad_s.to_degrees()),
        two_wheel_clearance_m: Some(two_wheel_clearance_m(&seen.wheel_clearance_m)),
        load_front_left_n: front_left,
        load_front_right_n: front_right,
        load_rear_left_n: rear_left,
        load_rear_right_n: rear_right,
        roll_deg: seen.roll_rad.to_degrees(),
        speed_kmh: seen.speed_m_s * 3.6,
        path_deviation_m: plant.location().lateral_offset_m,
        station_m: Some(plant.location().station_m),
        x_m: seen.x_m,
        y_m: seen.y_m,
        yaw_deg: seen.yaw_rad.to_degrees(),
        sideslip_deg: seen.sideslip_rad.to_degrees(),
        solve_status: decision.status,
        predicted_violation: decision.predicted_violation,
        iterations: decision.iterations,
        step_time_us: decision.time_us,
    }
}
