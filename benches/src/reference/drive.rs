//! Our vehicle driven through a run of the reference: its steering, its commanded acceleration.

use anyhow::{Context, Result};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::{Command, InitialPose, LongitudinalDemand, Observation, Simulation};
use vehicle_dyn::terrain::Terrain;

use super::trajectory::{Sample, Trajectory};

/// Speed hold of the reference runs: commanded acceleration per speed error, 1/s.
const HOLD_PER_S: f64 = 2.0;
/// A run is taken for one with speed hold when its commands agree with it to this, m/s².
const HOLD_TOLERANCE_M_S2: f64 = 1e-3;
/// Between samples the steering is interpolated in ticks of this length, s.
const TICK_S: f64 = 1e-3;

/// Drives `vehicle` through `run` and observes it at the times of the run's samples.
///
/// # Errors
/// When the simulation fails; the message names the run.
pub fn drive(vehicle: &VehicleParameters, run: &Trajectory) -> Result<Vec<Observation>> {
    let pose = InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s: run.summary.v0,
    };
    let context = || format!("run {}", run.summary.name);
    let mut simulation =
        Simulation::new(vehicle, Terrain::flat(1.0), pose).with_context(context)?;
    let mut seen = simulation.observation();
    let mut observed = vec![seen];
    let held = holds_speed(run);
    for pair in run.samples.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let ticks = ((to.t_s - from.t_s) / TICK_S).round();
        let mut tick = 0.0;
        while tick < ticks {
            // The middle of the tick: the command is held over it.
            let share = (tick + 0.5) / ticks;
            let acceleration = if held {
                HOLD_PER_S * (run.summary.v0 - seen.speed_m_s)
            } else {
                from.acc_cmd_mps2
            };
            let command = Command {
                handwheel_rad: vehicle.steering.ratio
                    * (from.delta_rad + share * (to.delta_rad - from.delta_rad)),
                longitudinal: LongitudinalDemand::Acceleration(acceleration),
            };
            seen = simulation.step(command, TICK_S).with_context(context)?;
            tick += 1.0;
        }
        observed.push(seen);
    }
    Ok(observed)
}

fn holds_speed(run: &Trajectory) -> bool {
    run.samples.iter().all(|sample: &Sample| {
        let held = HOLD_PER_S * (run.summary.v0 - sample.vx_mps);
        (sample.acc_cmd_mps2 - held).abs() < HOLD_TOLERANCE_M_S2
    })
}
