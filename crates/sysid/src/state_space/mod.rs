//! The model: matrices with the channels they belong to.

mod coordinates;
mod file;
mod initial_state;
mod matlab;
mod poles;
mod response;
mod simulate;
mod simulation;
mod zeros;

use std::collections::HashSet;

use deepc_core::faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use crate::error::SysidError;

pub use initial_state::InitialStateFor;
pub use poles::Mode;

/// One signal of a model: its name, the offset that the matrices do not see, and its typical size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Name as in the recording.
    pub name: String,
    /// Operating point, in the channel's unit.
    pub offset: f64,
    /// Typical size of deviations from it (their root mean square in the recording), above 0.
    pub scale: f64,
}

impl Channel {
    /// Without offset and with scale 1.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            offset: 0.0,
            scale: 1.0,
        }
    }
}

/// Plain matrices of the innovation form.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemMatrices {
    /// A, n×n.
    pub a: Mat<f64>,
    /// B, n×M (M inputs and measured disturbances).
    pub b: Mat<f64>,
    /// C, p×n.
    pub c: Mat<f64>,
    /// D, p×M.
    pub d: Mat<f64>,
    /// Innovation gain K, n×p; zero for an output-error model.
    pub k: Mat<f64>,
}

impl SystemMatrices {
    /// Order n.
    #[must_use]
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Number of inputs and measured disturbances M.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.b.ncols()
    }

    /// Number of outputs p.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.c.nrows()
    }
}

/// A discrete state-space model in innovation form, in the units of the recording, about its
/// offsets; see the crate's documentation for the equations.
///
/// It is serialised in the format of the model file, see [`to_json`](Self::to_json).
///
/// ```
/// use deepc_core::faer::{Mat, mat};
/// use sysid::{Channel, StateSpace, SystemMatrices};
///
/// // A tank: the level falls by a tenth per minute and rises by 2 cm per volt of the valve.
/// let matrices = SystemMatrices {
///     a: mat![[0.9]],
///     b: mat![[2.0]],
///     c: mat![[1.0]],
///     d: mat![[0.0]],
///     k: mat![[0.0]],
/// };
/// let level = Channel { offset: 12.0, ..Channel::new("level") };
/// let model = StateSpace::new(60.0, vec![Channel::new("valve")], vec![], vec![level], matrices)?;
/// assert!(model.is_stable()?);
/// assert!((model.steady_state_gain()?[(0, 0)] - 20.0).abs() < 1e-12);
/// let levels = model.simulate(&[0.0], Mat::full(3, 1, 1.0).as_ref())?;
/// assert!((levels[(2, 0)] - (12.0 + 2.0 + 1.8)).abs() < 1e-12);
/// let same = StateSpace::from_json(&model.to_json()?)?;
/// assert_eq!(same, model);
/// # Ok::<(), sysid::SysidError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "file::ModelFile", into = "file::ModelFile")]
pub struct StateSpace {
    sample_time_s: f64,
    inputs: Vec<Channel>,
    disturbances: Vec<Channel>,
    outputs: Vec<Channel>,
    matrices: SystemMatrices,
    innovation_covariance: Mat<f64>,
}

impl StateSpace {
    /// Puts a model together. `disturbances` may be empty; its channels are the last columns of B
    /// and D.
    ///
    /// # Errors
    /// A shape does not fit, a value is not finite, a scale or the sample time is not above 0, or a
    /// channel has no name or that of another.
    pub fn new(
        sample_time_s: f64,
        inputs: Vec<Channel>,
        disturbances: Vec<Channel>,
        outputs: Vec<Channel>,
        matrices: SystemMatrices,
    ) -> Result<Self, SysidError> {
        if !(sample_time_s.is_finite() && sample_time_s > 0.0) {
            return Err(SysidError::SampleTime {
                found: sample_time_s,
            });
        }
        let (n, all, p) = (
            matrices.a.nrows(),
            inputs.len() + disturbances.len(),
            outputs.len(),
        );
        for (name, matrix, rows, columns) in [
            ("A", &matrices.a, n, n),
            ("B", &matrices.b, n, all),
            ("C", &matrices.c, p, n),
            ("D", &matrices.d, p, all),
            ("K", &matrices.k, n, p),
        ] {
            check_matrix(name, matrix.as_ref(), rows, columns)?;
        }
        let mut names = HashSet::new();
        for channel in inputs.iter().chain(&disturbances).chain(&outputs) {
            if channel.name.trim().is_empty() || !names.insert(channel.name.as_str()) {
                return Err(SysidError::ChannelName {
                    channel: channel.name.clone(),
                });
            }
            let wrong = |field, found, allowed| SysidError::Channel {
                field,
                channel: channel.name.clone(),
                found,
                allowed,
            };
            if !channel.offset.is_finite() {
                return Err(wrong("offset", channel.offset, "give a finite value"));
            }
            if !(channel.scale.is_finite() && channel.scale > 0.0) {
                return Err(wrong("scale", channel.scale, "give a finite value above 0"));
            }
        }
        Ok(Self {
            sample_time_s,
            inputs,
            disturbances,
            outputs,
            matrices,
            innovation_covariance: Mat::zeros(p, p),
        })
    }

    /// With the covariance of the innovation e, p×p, in squared units of the outputs.
    ///
    /// # Errors
    /// The shape does not fit, a value is not finite, or a variance is below 0.
    pub fn with_innovation_covariance(mut self, covariance: Mat<f64>) -> Result<Self, SysidError> {
        let p = self.outputs.len();
        check_matrix("the innovation covariance", covariance.as_ref(), p, p)?;
        for (i, output) in self.outputs.iter().enumerate() {
            if covariance[(i, i)] < 0.0 {
                return Err(SysidError::Channel {
                    field: "innovation variance",
                    channel: output.name.clone(),
                    found: covariance[(i, i)],
                    allowed: "give 0 or more",
                });
            }
        }
        self.innovation_covariance = covariance;
        Ok(self)
    }

    /// Sample time Ts in seconds.
    #[must_use]
    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Order n.
    #[must_use]
    pub fn order(&self) -> usize {
        self.matrices.order()
    }

    /// The m inputs.
    #[must_use]
    pub fn inputs(&self) -> &[Channel] {
        &self.inputs
    }

    /// The q measured disturbances.
    #[must_use]
    pub fn disturbances(&self) -> &[Channel] {
        &self.disturbances
    }

    /// The p outputs.
    #[must_use]
    pub fn outputs(&self) -> &[Channel] {
        &self.outputs
    }

    /// A, B, C, D, K in the units of the recording.
    #[must_use]
    pub fn matrices(&self) -> &SystemMatrices {
        &self.matrices
    }

    /// Plain matrices.
    #[must_use]
    pub fn into_matrices(self) -> SystemMatrices {
        self.matrices
    }

    /// Covariance of the innovation e, p×p; zero if it is not known.
    #[must_use]
    pub fn innovation_covariance(&self) -> MatRef<'_, f64> {
        self.innovation_covariance.as_ref()
    }

    /// The model with an input or measured disturbance (counted together, from 0) that does
    /// nothing: its columns of B and D are zero. For an effect that the data do not identify.
    ///
    /// # Panics
    /// `input` is not below M.
    #[must_use]
    pub fn without_effect_of(mut self, input: usize) -> Self {
        self.matrices.b.col_mut(input).fill(0.0);
        self.matrices.d.col_mut(input).fill(0.0);
        self
    }
}

fn check_matrix(
    matrix: &'static str,
    values: MatRef<'_, f64>,
    expected_rows: usize,
    expected_columns: usize,
) -> Result<(), SysidError> {
    if values.shape() != (expected_rows, expected_columns) {
        return Err(SysidError::MatrixShape {
            matrix,
            rows: values.nrows(),
            columns: values.ncols(),
            expected_rows,
            expected_columns,
        });
    }
    check_finite(matrix, values)
}

fn check_finite(matrix: &'static str, values: MatRef<'_, f64>) -> Result<(), SysidError> {
    for column in 0..values.ncols() {
        for (row, &value) in values.col(column).iter().enumerate() {
            if !value.is_finite() {
                return Err(SysidError::MatrixNotFinite {
                    matrix,
                    row,
                    column,
                    value,
                });
            }
        }
    }
    Ok(())
}
