//! How long until wheels lift, or until the vehicle lies on its side.

use serde::Serialize;

use super::ROLLOVER_ROLL_RAD;
use crate::simulation::{Command, Simulation, SimulationError};

/// Steps in which the future is searched, s.
const LOOK_AHEAD_TICK_S: f64 = 0.01;

/// What lies ahead if the command is held, each `None` if it does not happen within the horizon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TimeToRollover {
    /// Until both wheels of one side carry nothing, s; 0 if they carry nothing now.
    pub two_wheel_lift_s: Option<f64>,
    /// Until the roll exceeds [`ROLLOVER_ROLL_RAD`], s; 0 if it does now.
    pub rollover_s: Option<f64>,
}

/// Time to rollover by simulating a copy of `simulation` with `command` held, as Chen and Peng 2001
/// define it: to the next 10 ms, or to the next whole number of integration steps above. The
/// simulation itself stays as it is.
///
/// It costs as much as driving that long; a real-time system has [`TimeToLift`].
///
/// # Errors
/// As [`Simulation::step`], and [`SimulationError::TimeStep`] when `horizon_s` is not in (0, 60] s.
pub fn time_to_rollover(
    simulation: &Simulation,
    command: Command,
    horizon_s: f64,
) -> Result<TimeToRollover, SimulationError> {
    if !(horizon_s > 0.0 && horizon_s <= 60.0) {
        return Err(SimulationError::TimeStep {
            what: "horizon",
            value: horizon_s,
            range: "in (0, 60]",
        });
    }
    let mut future = simulation.clone();
    let now = future.observation();
    let tick_s = whole_substeps_s(simulation.substep_s());
    let mut found = TimeToRollover {
        two_wheel_lift_s: now.two_wheel_lift().then_some(0.0),
        rollover_s: (now.roll_rad.abs() > ROLLOVER_ROLL_RAD).then_some(0.0),
    };
    let mut tick = 0_u32;
    while found.rollover_s.is_none() && f64::from(tick + 1) * tick_s <= horizon_s + 1e-9 {
        tick += 1;
        let seen = future.step(command, tick_s)?;
        let elapsed = f64::from(tick) * tick_s;
        if found.two_wheel_lift_s.is_none() && seen.two_wheel_lift() {
            found.two_wheel_lift_s = Some(elapsed);
        }
        if seen.roll_rad.abs() > ROLLOVER_ROLL_RAD {
            found.rollover_s = Some(elapsed);
        }
    }
    Ok(found)
}

fn whole_substeps_s(substep_s: f64) -> f64 {
    // Rounded first: 0.01/0.001 may lie a bit above 10.
    let substeps = (LOOK_AHEAD_TICK_S / substep_s - 1e-6).ceil().max(1.0);
    substeps * substep_s
}

/// Time until the roll angle reaches `limit_rad` if the roll rate stays as it is, s: what a real-time
/// system gets from a gyroscope. `None` while the vehicle rolls back or stands still, 0 beyond the
/// limit.
///
/// It ignores that a tipping vehicle speeds up, so it is too long early and right late.
#[must_use]
pub fn time_to_roll_angle_s(roll_rad: f64, roll_rate_rad_s: f64, limit_rad: f64) -> Option<f64> {
    let remaining = limit_rad - roll_rad.abs();
    if remaining <= 0.0 {
        return Some(0.0);
    }
    let outward = outward(roll_rad, roll_rate_rad_s);
    (outward > 0.0).then(|| remaining / outward)
}

/// Time to lift-off from a load transfer measure and its rate, as a real-time system computes it:
/// `(1 − |x|)/(d|x|/dt)`. The rate is a difference over one sample behind a first-order filter.
///
/// Feed it the [`super::LoadTransferIndex`] (roll angle, roll rate and lateral acceleration are what
/// vehicles measure) or the load transfer ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeToLift {
    inverse_sample_time: f64,
    /// Share of the newest difference in the filtered rate.
    share: f64,
    last: Option<f64>,
    rate_per_s: Option<f64>,
}

impl TimeToLift {
    /// An estimator for samples `sample_time_s` apart, with the time constant `filter_s` of the rate;
    /// 0 is no filter. Both are taken as positive.
    #[must_use]
    pub fn new(sample_time_s: f64, filter_s: f64) -> Self {
        let share = if filter_s > 0.0 {
            -(-sample_time_s / filter_s).exp_m1()
        } else {
            1.0
        };
        Self {
            inverse_sample_time: 1.0 / sample_time_s,
            share,
            last: None,
            rate_per_s: None,
        }
    }

    /// Takes the next sample of the measure and returns the time to |measure| = 1, s: 0 beyond it,
    /// `None` for the first sample, while it falls, and for a sample that is not finite (which is
    /// then left out).
    pub fn update(&mut self, measure: f64) -> Option<f64> {
        if !measure.is_finite() {
            self.last = None;
            return None;
        }
        if let Some(last) = self.last.replace(measure) {
            let difference = (measure - last) * self.inverse_sample_time;
            let rate = self.rate_per_s.get_or_insert(difference);
            *rate += self.share * (difference - *rate);
        }
        let remaining = 1.0 - measure.abs();
        if remaining <= 0.0 {
            return Some(0.0);
        }
        let outward = outward(measure, self.rate_per_s?);
        (outward > 0.0).then(|| remaining / outward)
    }
}

/// Rate of `|value|`; from 0 every way leads outwards.
fn outward(value: f64, rate: f64) -> f64 {
    if value == 0.0 {
        rate.abs()
    } else {
        rate * value.signum()
    }
}
