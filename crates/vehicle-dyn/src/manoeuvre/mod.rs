//! Standard manoeuvres as data, run on a vehicle, with the figures of merit of their standards.
//!
//! A [`ManoeuvreFile`] is a TOML file with the numbers of a standard; [`ManoeuvreFile::perform`]
//! drives its runs on a flat pad and computes the figures. Tests that a standard derives from
//! another one (such as the handwheel angle A from slowly increasing steer) run by themselves.
//!
//! ```
//! use vehicle_dyn::manoeuvre::{self, RunSettings};
//!
//! let sedan = vehicle_dyn::vehicles::embedded("sedan")?;
//! let file = manoeuvre::find("slowly-increasing-steer")?;
//! let done = file.perform(&sedan, RunSettings::default(), &mut |_| {
//!     std::ops::ControlFlow::Continue(())
//! })?;
//! let angle = done.report.figure("handwheel angle A at 0.3 g").and_then(|f| f.as_number());
//! assert!(angle.is_some_and(|angle| angle > 5.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | kind | standard | figures |
//! |---|---|---|
//! | `slowly_increasing_steer` | NHTSA, FMVSS 126 S7.6 | handwheel angle A at 0.3 g, gradients |
//! | `sine_with_dwell` | FMVSS 126 | yaw rate ratios, lateral displacement, pass or fail |
//! | `fishhook` (1a, 1b), `j_turn` | NHTSA rollover rating | two-wheel lift and its speed, LTR, roll angle |
//! | `lane_change` | ISO 3888-1, ISO 3888-2 | cones, lanes, highest speed passed |
//! | `step_steer`, `frequency_response` | ISO 7401 | response times, overshoot, gains, TB factor |
//! | `circular` | ISO 4138 | understeer, steering, sideslip and roll gradients |
//! | `tilt_table` | SAE J2180 | lift angle, tilt table ratio, axle that lifts first |
//!
//! # What differs from the proving ground
//! - Signals are the simulation's own: no filters, no sensor offsets, one run where a standard asks
//!   for several. A run starts in equilibrium at its speed, and the steering half a second later.
//! - Steering machines obey the vehicle's own actuator (`[steering]` of the vehicle file). A demand
//!   beyond its limits is a [`Warning`] with both numbers.
//! - g is 9.81 m/s².
//! - A series of the NHTSA tests ends at its first two-wheel lift. The rating's supplements (5.5
//!   times A where the first series shows no lift, outriggers, tyre wear) are left out.
//! - Vehicles here have no stability control, which FMVSS 126 is about: a failed sine with dwell
//!   says how much there would be to do.

mod bench;
mod circular;
mod convergence;
mod error;
mod file;
mod lane_change;
mod lanes;
mod range;
mod report;
mod rollover_series;
pub mod signal;
mod sine_with_dwell;
mod slowly_increasing_steer;
pub mod steering;
mod tilt_table;
mod trace;
mod transient_response;

pub use bench::{OnRun, RunSettings, TWO_WHEEL_LIFT_M};
pub use circular::{Circular, CircularMethod, ConstantRadius, ConstantSpeed};
pub use convergence::{RunConvergence, converges};
pub use error::ManoeuvreError;
pub use file::{ManoeuvreFile, embedded_text, find, names};
pub use lane_change::{LaneChange, LaneChangeDriver};
pub use lanes::{Lane, LaneDescription, LaneEdge, Outline, Track, TrackMonitor};
pub use report::{
    Bound, Curve, Figure, ManoeuvreReport, Requirement, RunReport, Value, Verdict, Warning,
};
pub use rollover_series::{Fishhook, JTurn, Reversal};
pub use sine_with_dwell::SineWithDwell;
pub use slowly_increasing_steer::{SlowlyIncreasingSteer, SteeringScale};
pub use tilt_table::{TiltTable, leaning_lift_angle_deg, rigid_lift_angle_deg};
pub use trace::{Extremes, Trace, TraceRow};
pub use transient_response::{FrequencyResponse, StepSteer};

use serde::{Deserialize, Serialize};

use crate::parameters::VehicleParameters;
use bench::Bench;

/// Time from the start of a run to the start of its steering, s.
pub const LEAD_IN_S: f64 = 0.5;

/// A manoeuvre with the numbers of its standard; `kind` tells which.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Manoeuvre {
    /// Slowly increasing steer.
    SlowlyIncreasingSteer(SlowlyIncreasingSteer),
    /// Sine with dwell.
    SineWithDwell(Box<SineWithDwell>),
    /// Fishhook 1a and 1b.
    Fishhook(Fishhook),
    /// J-turn.
    JTurn(JTurn),
    /// Double lane change, obstacle avoidance.
    LaneChange(Box<LaneChange>),
    /// Step input.
    StepSteer(StepSteer),
    /// Continuous sinusoidal input.
    FrequencyResponse(FrequencyResponse),
    /// Steady-state circular driving.
    Circular(Circular),
    /// Tilt table.
    TiltTable(TiltTable),
}

/// A manoeuvre that was driven.
#[derive(Debug, Clone, PartialEq)]
pub struct Performed {
    /// Figures, verdict and warnings.
    pub report: ManoeuvreReport,
    /// Every run of the report, in the same order.
    pub traces: Vec<Trace>,
}

/// What a manoeuvre concludes beyond its runs.
struct Conclusion {
    figures: Vec<Figure>,
    curves: Vec<Curve>,
    verdict: Verdict,
}

impl Manoeuvre {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        match self {
            Self::SlowlyIncreasingSteer(manoeuvre) => manoeuvre.check(),
            Self::SineWithDwell(manoeuvre) => manoeuvre.check(),
            Self::Fishhook(manoeuvre) => manoeuvre.check(),
            Self::JTurn(manoeuvre) => manoeuvre.check(),
            Self::LaneChange(manoeuvre) => manoeuvre.check(),
            Self::StepSteer(manoeuvre) => manoeuvre.check(),
            Self::FrequencyResponse(manoeuvre) => manoeuvre.check(),
            Self::Circular(manoeuvre) => manoeuvre.check(),
            Self::TiltTable(manoeuvre) => manoeuvre.check(),
        }
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        match self {
            Self::SlowlyIncreasingSteer(manoeuvre) => manoeuvre.run(bench),
            Self::SineWithDwell(manoeuvre) => manoeuvre.run(bench),
            Self::Fishhook(manoeuvre) => manoeuvre.run(bench),
            Self::JTurn(manoeuvre) => manoeuvre.run(bench),
            Self::LaneChange(manoeuvre) => manoeuvre.run(bench),
            Self::StepSteer(manoeuvre) => manoeuvre.run(bench),
            Self::FrequencyResponse(manoeuvre) => manoeuvre.run(bench),
            Self::Circular(manoeuvre) => manoeuvre.run(bench),
            Self::TiltTable(manoeuvre) => manoeuvre.run(bench),
        }
    }
}

impl ManoeuvreFile {
    /// Drives all runs of the manoeuvre with a vehicle. `on_run` is told after every run and may
    /// stop.
    ///
    /// The same inputs give the same bits.
    ///
    /// # Errors
    /// [`ManoeuvreError`] when a number is out of range, a sub-test gives no result, the vehicle
    /// cannot be simulated, or `on_run` asked to stop. A run that ends in a rollover is none.
    pub fn perform(
        &self,
        vehicle: &VehicleParameters,
        settings: RunSettings,
        on_run: OnRun<'_>,
    ) -> Result<Performed, ManoeuvreError> {
        self.check()?;
        let mut bench = Bench::new(vehicle, self.friction, settings, on_run);
        let conclusion = self.manoeuvre.run(&mut bench)?;
        Ok(Performed {
            report: ManoeuvreReport {
                manoeuvre: self.name.clone(),
                vehicle: vehicle.name.clone(),
                standard: self.standard.clone(),
                friction: self.friction,
                runs: bench.runs,
                figures: conclusion.figures,
                curves: conclusion.curves,
                verdict: conclusion.verdict,
                warnings: bench.warnings,
            },
            traces: bench.traces,
        })
    }
}
