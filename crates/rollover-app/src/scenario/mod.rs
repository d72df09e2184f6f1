//! Scenarios as data: what is driven where, by whom, and what the controllers may do.

mod controller_file;
mod controllers;
mod load;
mod place;
mod recording;
mod recording_check;

use std::collections::BTreeMap;

use serde::Deserialize;
use vehicle_dyn::driver::DriverParameters;
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::CourseDescription;
use vehicle_dyn::sensors::{Channel, SensorDescription};
use vehicle_dyn::terrain::GroundDescription;

pub use controllers::{
    ControllerSettings, DataMatrix, DataSettings, LtrPenalty, ModelSettings, Prediction,
    ReferenceAhead,
};
pub use load::{ScenarioError, embedded_names, embedded_text, load};
pub use recording::{FurtherRecord, RecordRecipe, RecordingRecipe};
pub use recording_check::GroundOf;

use crate::toml_place::suggested;

/// Name of the controller that every scenario has: the driver alone.
pub const DRIVER: &str = "driver";

/// Name of the policy that every scenario has beside it: the driver, held at the lowest target speed
/// allowed. A controller that is slower is worth nothing.
pub const FLOOR: &str = "floor";

/// The channel that controllers are given.
pub const CONTROLLER_CHANNEL: Channel = Channel::LoadTransferRatio;

/// The channels by which the driver steers.
pub const DRIVER_CHANNELS: [Channel; 4] = [
    Channel::Speed,
    Channel::Heading,
    Channel::PositionX,
    Channel::PositionY,
];

/// A scenario file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name, also the name of its file.
    pub name: String,
    /// What it shows, in a sentence or two.
    pub description: String,
    /// Name of an embedded vehicle, or path of a vehicle file.
    pub vehicle: String,
    /// Length of a run, s.
    pub duration_s: f64,
    /// Control sample time, s.
    pub sample_time_s: f64,
    /// Speed at the start and reference afterwards, km/h.
    pub speed_reference_kmh: f64,
    /// The ground: friction, and what makes it uneven or slippery here and there.
    pub ground: GroundDescription,
    /// Sensors by channel; a channel without one is measured perfectly. Controllers read `ltr`, the
    /// driver [`DRIVER_CHANNELS`].
    #[serde(default)]
    pub sensors: BTreeMap<Channel, SensorDescription>,
    /// The driver, who steers in every run and is the reference of the controllers. Without one here
    /// it is the vehicle's own.
    #[serde(default)]
    pub driver: Option<DriverParameters>,
    /// The road to be driven.
    pub course: CourseDescription,
    /// Bounds on the inputs, for every controller.
    pub bounds: InputBounds,
    /// How the controllers' data are recorded.
    pub recording: RecordingRecipe,
    /// Controllers by name. [`DRIVER`] and [`FLOOR`] are always there and are not listed.
    #[serde(deserialize_with = "controller_file::controllers")]
    pub controllers: BTreeMap<String, ControllerSettings>,
}

/// Bounds on the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputBounds {
    /// Lowest and highest steering-wheel angle, deg.
    pub steering_wheel_deg: [f64; 2],
    /// Lowest and highest target speed, km/h.
    pub target_speed_kmh: [f64; 2],
}

impl Scenario {
    /// Names of all controllers, the driver first.
    #[must_use]
    pub fn controller_names(&self) -> Vec<&str> {
        [DRIVER, FLOOR]
            .into_iter()
            .chain(self.controllers.keys().map(String::as_str))
            .collect()
    }

    /// The settings of a controller, or `None` for [`DRIVER`] and [`FLOOR`].
    ///
    /// # Errors
    /// When the scenario has no controller of that name.
    pub fn controller(&self, name: &str) -> Result<Option<&ControllerSettings>, ScenarioError> {
        if [DRIVER, FLOOR].contains(&name) {
            return Ok(None);
        }
        self.controllers
            .get(name)
            .map(Some)
            .ok_or_else(|| ScenarioError::UnknownController {
                scenario: self.name.clone(),
                controller: name.to_owned(),
                suggestion: suggested(name, self.controller_names()),
                known: self.controller_names().join(", "),
            })
    }

    /// Target speed where no controller decides: the lowest allowed for [`FLOOR`], else the
    /// reference, km/h.
    #[must_use]
    pub fn fixed_target_speed_kmh(&self, name: &str, speed_reference_kmh: f64) -> f64 {
        if name == FLOOR {
            self.bounds.target_speed_kmh[0]
        } else {
            speed_reference_kmh
        }
    }

    /// The scenario on the mirror image of its course and ground. The recording is what it was: a
    /// controller must not depend on which way the recorded turns went.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let mut mirrored = self.clone();
        mirrored.recording.ground = Some(self.recording_ground().clone());
        mirrored.course = self.course.mirrored();
        mirrored.ground = self.ground.mirrored();
        mirrored
    }

    /// Who drives `vehicle`: the scenario's driver, or else the vehicle's own.
    ///
    /// # Errors
    /// When neither file has one.
    pub fn driver_of(
        &self,
        vehicle: &VehicleParameters,
    ) -> Result<DriverParameters, ScenarioError> {
        self.driver
            .or(vehicle.driver)
            .ok_or_else(|| ScenarioError::NoDriver {
                scenario: self.name.clone(),
                vehicle: vehicle.name.clone(),
            })
    }

    /// Another vehicle than the scenario's takes its own driver along, if it has one.
    pub fn swap_vehicle(&mut self, vehicle: &VehicleParameters) {
        self.driver = vehicle.driver.or(self.driver);
    }

    /// Number of control steps of a run.
    #[must_use]
    pub fn steps(&self) -> usize {
        steps(self.duration_s, self.sample_time_s)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "checked positive and small"
)]
fn steps(duration_s: f64, sample_time_s: f64) -> usize {
    (duration_s / sample_time_s).round() as usize
}
