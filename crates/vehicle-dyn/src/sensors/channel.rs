//! The channels of a vehicle and the sensors on them.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::sensor::name_hash;
use super::{Measurement, Sensor, SensorDescription, SensorError};
use crate::simulation::Observation;

/// A quantity that a vehicle measures: a field of [`Observation`], by whose name it goes, so that the
/// name tells the unit of noise, bias and quantisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Channel {
    /// Load transfer ratio (no unit), as measured by wheel-load sensors or an estimator.
    #[serde(rename = "ltr")]
    LoadTransferRatio,
    /// Speed along the heading, m/s.
    #[serde(rename = "speed_m_s")]
    Speed,
    /// Lateral acceleration, m/s².
    #[serde(rename = "lateral_acceleration_m_s2")]
    LateralAcceleration,
    /// Roll angle, rad.
    #[serde(rename = "roll_rad")]
    RollAngle,
    /// Roll rate, rad/s.
    #[serde(rename = "roll_rate_rad_s")]
    RollRate,
    /// Yaw rate, rad/s.
    #[serde(rename = "yaw_rate_rad_s")]
    YawRate,
    /// Heading, rad.
    #[serde(rename = "yaw_rad")]
    Heading,
    /// World x, m.
    #[serde(rename = "x_m")]
    PositionX,
    /// World y, m.
    #[serde(rename = "y_m")]
    PositionY,
}

impl Channel {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::LoadTransferRatio,
        Self::Speed,
        Self::LateralAcceleration,
        Self::RollAngle,
        Self::RollRate,
        Self::YawRate,
        Self::Heading,
        Self::PositionX,
        Self::PositionY,
    ];

    /// Name in files and messages: that of the field of [`Observation`].
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LoadTransferRatio => "ltr",
            Self::Speed => "speed_m_s",
            Self::LateralAcceleration => "lateral_acceleration_m_s2",
            Self::RollAngle => "roll_rad",
            Self::RollRate => "roll_rate_rad_s",
            Self::YawRate => "yaw_rate_rad_s",
            Self::Heading => "yaw_rad",
            Self::PositionX => "x_m",
            Self::PositionY => "y_m",
        }
    }

    /// Its value.
    #[must_use]
    pub fn value(self, observation: &Observation) -> f64 {
        // The field is the same to read and to write.
        let mut copy = *observation;
        *self.field(&mut copy)
    }

    /// Its field, to read or to replace.
    pub fn field(self, observation: &mut Observation) -> &mut f64 {
        match self {
            Self::LoadTransferRatio => &mut observation.ltr,
            Self::Speed => &mut observation.speed_m_s,
            Self::LateralAcceleration => &mut observation.lateral_acceleration_m_s2,
            Self::RollAngle => &mut observation.roll_rad,
            Self::RollRate => &mut observation.roll_rate_rad_s,
            Self::YawRate => &mut observation.yaw_rate_rad_s,
            Self::Heading => &mut observation.yaw_rad,
            Self::PositionX => &mut observation.x_m,
            Self::PositionY => &mut observation.y_m,
        }
    }
}

impl std::fmt::Display for Channel {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name())
    }
}

/// The sensors of a vehicle. Channels without one are measured perfectly.
#[derive(Debug, Clone)]
pub struct Sensors {
    sensors: Vec<(Channel, Sensor)>,
}

impl Sensors {
    /// Sensors for samples `sample_time_s` apart; the same seed gives the same readings.
    ///
    /// # Errors
    /// [`SensorError`] with channel, field, number and range.
    pub fn new(
        descriptions: &BTreeMap<Channel, SensorDescription>,
        sample_time_s: f64,
        seed: u64,
    ) -> Result<Self, SensorError> {
        let sensors = descriptions
            .iter()
            .map(|(channel, description)| {
                let sensor = Sensor::new(description, sample_time_s, seed, channel.name())?;
                Ok((*channel, sensor))
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { sensors })
    }

    /// What is measured of `observation`: a copy with the sensors' readings in place of the fields.
    /// Lost samples are not a number, or held, as their sensor is described.
    pub fn measure(&mut self, observation: &Observation) -> Observation {
        let mut measured = *observation;
        for (channel, sensor) in &mut self.sensors {
            let field = channel.field(&mut measured);
            let Measurement { value, .. } = sensor.measure(*field);
            *field = value;
        }
        measured
    }

    /// All sensors back to before their first sample.
    pub fn reset(&mut self) {
        for (_, sensor) in &mut self.sensors {
            sensor.reset();
        }
    }
}

/// A seed for a named purpose, so that what shares a seed (a recording and a run on it) does not
/// share random numbers.
#[must_use]
pub fn derived_seed(seed: u64, purpose: &str) -> u64 {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&name_hash(purpose).to_le_bytes());
    // Not a sensor's stream, even one that is called like the purpose.
    key[16] = 1;
    ChaCha8Rng::from_seed(key).random()
}
