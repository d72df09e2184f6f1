//! The frequency response with its uncertainty, in the units of the recording.

use deepc_core::faer::{Mat, c64};

use super::Identification;
use crate::error::SysidError;

/// A frequency response at one frequency, with its standard errors.
#[derive(Debug, Clone)]
pub struct UncertainResponse {
    /// In Hz.
    pub frequency_hz: f64,
    /// p×M, inputs before measured disturbances.
    pub response: Mat<c64>,
    /// Root mean square distance from the true response in the complex plane, p×M.
    pub standard_error: Mat<f64>,
    /// Standard error of the magnitude, p×M.
    pub magnitude_standard_error: Mat<f64>,
}

impl Identification {
    /// The frequency response of the model and its standard errors (Ljung 1999, chapter 9).
    ///
    /// # Errors
    /// A frequency is negative, not finite or above half the sampling rate.
    pub fn frequency_response(
        &self,
        frequencies_hz: &[f64],
    ) -> Result<Vec<UncertainResponse>, SysidError> {
        let sample_time_s = self.model.sample_time_s();
        let largest_hz = 0.5 / sample_time_s;
        let mut omega = Vec::with_capacity(frequencies_hz.len());
        for &found_hz in frequencies_hz {
            if !(0.0..=largest_hz).contains(&found_hz) {
                return Err(SysidError::Frequency {
                    found_hz,
                    largest_hz,
                });
            }
            omega.push(2.0 * std::f64::consts::PI * found_hz * sample_time_s);
        }
        let inputs: Vec<f64> = (self.model.inputs().iter())
            .chain(self.model.disturbances())
            .map(|channel| channel.scale)
            .collect();
        let outputs = self.model.outputs();
        // The last input of the scaled model is the constant.
        let unit = |i: usize, j: usize| outputs[i].scale / inputs[j];
        let of = |matrix: &Mat<f64>| {
            Mat::from_fn(outputs.len(), inputs.len(), |i, j| {
                matrix[(i, j)] * unit(i, j)
            })
        };
        let errors = self.uncertainty.frequency_response_error(&omega);
        let responses = errors.iter().zip(frequencies_hz).map(|(error, &hz)| {
            let response = Mat::from_fn(outputs.len(), inputs.len(), |i, j| {
                error.response[(i, j)] * unit(i, j)
            });
            UncertainResponse {
                frequency_hz: hz,
                response,
                standard_error: of(&error.complex),
                magnitude_standard_error: of(&error.magnitude),
            }
        });
        Ok(responses.collect())
    }
}
