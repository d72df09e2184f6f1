//! How the data of the controllers are recorded.

use serde::Deserialize;
use vehicle_dyn::road::CourseDescription;
use vehicle_dyn::terrain::GroundDescription;

use super::{Scenario, steps};

/// The paper's data recipe: the driver follows a winding road, white noise on both inputs.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingRecipe {
    /// Length of the recording, s.
    pub duration_s: f64,
    /// Target speed before noise, km/h.
    pub target_speed_kmh: f64,
    /// Standard deviation of the noise on the steering wheel, deg per sample.
    pub steering_wheel_noise_deg: f64,
    /// Standard deviation of the noise on the target speed, km/h per sample.
    pub target_speed_noise_kmh: f64,
    /// The road of the recording.
    pub course: CourseDescription,
    /// The ground of the recording; that of the scenario where it is absent.
    pub ground: Option<GroundDescription>,
    /// Further drives, each a record of its own: the vehicle starts anew, and no window of data
    /// reaches from one record into the next. They come after the first record, in this order.
    #[serde(default)]
    pub more: Vec<FurtherRecord>,
}

/// A further record of a recording. What it leaves out is as in the first record.
///
/// Its noise comes from a seed of its own, derived from the recording's seed and from its place in
/// the list: neither adding a record nor changing one alters those before it.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FurtherRecord {
    /// Length of the record, s.
    pub duration_s: Option<f64>,
    /// Target speed before noise, km/h.
    pub target_speed_kmh: Option<f64>,
    /// Standard deviation of the noise on the steering wheel, deg per sample.
    pub steering_wheel_noise_deg: Option<f64>,
    /// Standard deviation of the noise on the target speed, km/h per sample.
    pub target_speed_noise_kmh: Option<f64>,
    /// The road of the record.
    pub course: Option<CourseDescription>,
    /// The ground of the record.
    pub ground: Option<GroundDescription>,
}

/// How one record is made, with everything filled in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordRecipe<'a> {
    /// Length of the record, s.
    pub duration_s: f64,
    /// Target speed before noise, km/h.
    pub target_speed_kmh: f64,
    /// Standard deviation of the noise on the steering wheel, deg per sample.
    pub steering_wheel_noise_deg: f64,
    /// Standard deviation of the noise on the target speed, km/h per sample.
    pub target_speed_noise_kmh: f64,
    /// The road.
    pub course: &'a CourseDescription,
    /// The ground under it.
    pub ground: &'a GroundDescription,
}

impl Scenario {
    /// The ground under the course of the first record.
    #[must_use]
    pub fn recording_ground(&self) -> &GroundDescription {
        self.recording.ground.as_ref().unwrap_or(&self.ground)
    }

    /// The records that the recording consists of, at least one.
    #[must_use]
    pub fn records(&self) -> Vec<RecordRecipe<'_>> {
        let first = RecordRecipe {
            duration_s: self.recording.duration_s,
            target_speed_kmh: self.recording.target_speed_kmh,
            steering_wheel_noise_deg: self.recording.steering_wheel_noise_deg,
            target_speed_noise_kmh: self.recording.target_speed_noise_kmh,
            course: &self.recording.course,
            ground: self.recording_ground(),
        };
        let further = self.recording.more.iter().map(|r| r.after(first));
        std::iter::once(first).chain(further).collect()
    }
}

impl FurtherRecord {
    /// With what it leaves out from the first record.
    fn after<'a>(&'a self, first: RecordRecipe<'a>) -> RecordRecipe<'a> {
        let or = |own: Option<f64>, value: f64| own.unwrap_or(value);
        RecordRecipe {
            duration_s: or(self.duration_s, first.duration_s),
            target_speed_kmh: or(self.target_speed_kmh, first.target_speed_kmh),
            steering_wheel_noise_deg: or(
                self.steering_wheel_noise_deg,
                first.steering_wheel_noise_deg,
            ),
            target_speed_noise_kmh: or(self.target_speed_noise_kmh, first.target_speed_noise_kmh),
            course: self.course.as_ref().unwrap_or(first.course),
            ground: self.ground.as_ref().unwrap_or(first.ground),
        }
    }
}

impl RecordRecipe<'_> {
    /// Number of samples.
    #[must_use]
    pub fn samples(&self, sample_time_s: f64) -> usize {
        steps(self.duration_s, sample_time_s)
    }
}
