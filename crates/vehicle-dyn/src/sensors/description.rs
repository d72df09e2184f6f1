//! A sensor as data.

use serde::{Deserialize, Serialize};

/// One sensor. Everything is off unless it is given. "Unit" is that of the measured quantity.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorDescription {
    /// Corner frequency of a first-order lag, Hz; absent is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth_hz: Option<f64>,
    /// Age of what is measured, s: a whole number of samples.
    pub delay_s: f64,
    /// Relative error of the slope (no unit): 0.01 reads one per cent too much.
    pub scale_error: f64,
    /// Constant error, unit.
    pub bias: f64,
    /// Standard deviation of white Gaussian noise, unit.
    pub noise_standard_deviation: f64,
    /// Step of the quantiser, unit; 0 is none. Rounds to the nearest multiple, halves away from 0.
    pub quantisation: f64,
    /// Share of the samples that are lost in the long run, in [0, 1] (no unit).
    pub drop_out_probability: f64,
    /// Mean length of a drop-out, s, at least one sample: a chain of two states (Gilbert 1960). Absent:
    /// each sample is lost independently of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drop_out_mean_length_s: Option<f64>,
    /// What a lost sample reads.
    pub drop_out_mode: DropOutMode,
}

/// What a lost sample reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DropOutMode {
    /// Not a number, so that whoever reads it knows that it is lost.
    #[default]
    Nan,
    /// What was read last, as a sensor bus does that repeats its last message; not a number before
    /// the first one.
    HoldLast,
}

/// A sensor that cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensorError {
    /// A field is out of its range.
    #[error("sensors.{channel}.{field} = {value}: must be {range}")]
    OutOfRange {
        /// Channel of the sensor.
        channel: String,
        /// Field of [`SensorDescription`].
        field: &'static str,
        /// Value found.
        value: f64,
        /// What is allowed.
        range: String,
    },
    /// The time between samples cannot be used.
    #[error("the sensors' sample time is {value} s: must be in (0, 10] s")]
    SampleTime {
        /// Value found, s.
        value: f64,
    },
}

/// Longest delay, and longest mean drop-out, s.
const LONGEST_S: f64 = 10.0;
/// Rounding allowed in a whole number of samples.
const WHOLE: f64 = 1e-6;

impl SensorDescription {
    /// Checks every field against its range; what depends on the sample time is checked by
    /// [`super::Sensor::new`].
    ///
    /// # Errors
    /// [`SensorError::OutOfRange`] with channel, field, number and range.
    pub fn check(&self, channel: &str) -> Result<(), SensorError> {
        let bandwidth = self.bandwidth_hz.unwrap_or(1.0);
        let length = self.drop_out_mean_length_s.unwrap_or(1.0);
        for (field, value, low, high, range) in [
            (
                "bandwidth_hz",
                bandwidth,
                1e-3,
                1e6,
                "in [1e-3, 1e6] Hz, or absent",
            ),
            ("delay_s", self.delay_s, 0.0, LONGEST_S, "in [0, 10] s"),
            (
                "scale_error",
                self.scale_error,
                -0.99,
                10.0,
                "in [-0.99, 10]",
            ),
            ("bias", self.bias, -1e6, 1e6, "in [-1e6, 1e6]"),
            (
                "noise_standard_deviation",
                self.noise_standard_deviation,
                0.0,
                1e6,
                "in [0, 1e6]",
            ),
            ("quantisation", self.quantisation, 0.0, 1e6, "in [0, 1e6]"),
            (
                "drop_out_probability",
                self.drop_out_probability,
                0.0,
                1.0,
                "in [0, 1]",
            ),
            (
                "drop_out_mean_length_s",
                length,
                0.0,
                LONGEST_S,
                "in [one sample, 10] s, or absent",
            ),
        ] {
            if !(low..=high).contains(&value) {
                return Err(out_of_range(channel, field, value, range.to_owned()));
            }
        }
        Ok(())
    }

    /// The delay in samples.
    pub(super) fn delay_samples(
        &self,
        sample_time_s: f64,
        channel: &str,
    ) -> Result<usize, SensorError> {
        let samples = self.delay_s / sample_time_s;
        let whole = samples.round();
        if (samples - whole).abs() > WHOLE {
            let (below, above) = (
                samples.floor() * sample_time_s,
                samples.ceil() * sample_time_s,
            );
            let range = format!(
                "a whole number of samples of {sample_time_s} s, such as {below:.6} or {above:.6} s"
            );
            return Err(out_of_range(channel, "delay_s", self.delay_s, range));
        }
        // Checked: not negative and at most 10 s.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        Ok(whole as usize)
    }

    /// Probabilities of losing a sample after a good one and of a good one after a lost one.
    pub(super) fn drop_out_chances(
        &self,
        sample_time_s: f64,
        channel: &str,
    ) -> Result<[f64; 2], SensorError> {
        let lost = self.drop_out_probability;
        let Some(length_s) = self.drop_out_mean_length_s else {
            return Ok([lost, 1.0 - lost]);
        };
        let samples = length_s / sample_time_s;
        // As often as a drop-out begins, one ends: (1 − lost) · begin = lost · end.
        let end = 1.0 / samples;
        let begin = if lost < 1.0 {
            lost * end / (1.0 - lost)
        } else {
            f64::INFINITY
        };
        if samples < 1.0 - WHOLE || begin > 1.0 {
            let shortest = sample_time_s * (lost / (1.0 - lost)).max(1.0);
            let range = if lost < 1.0 {
                format!(
                    "at least {shortest:.6} s with samples {sample_time_s} s apart of which {lost} are lost"
                )
            } else {
                "absent when every sample is lost".to_owned()
            };
            return Err(out_of_range(
                channel,
                "drop_out_mean_length_s",
                length_s,
                range,
            ));
        }
        Ok([begin, end.min(1.0)])
    }
}

fn out_of_range(channel: &str, field: &'static str, value: f64, range: String) -> SensorError {
    SensorError::OutOfRange {
        channel: channel.to_owned(),
        field,
        value,
        range,
    }
}
