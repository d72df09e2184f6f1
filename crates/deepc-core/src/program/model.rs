//! A future that a linear model predicts instead of data.

use faer::{Mat, MatRef};

use super::error::ProgramError;
use crate::hankel::{Horizons, Shape};

/// What a linear model says of the future, for [`CondensedProgram::from_model`].
///
/// With the stacked future f = col(u, y) of N steps,
///
/// ```text
/// f = Φ c + B η
/// ```
///
/// where the [`StateEstimator`] knows c (a state estimate, a constant 1, a preview of measured
/// disturbances) and η is free, usually the deviations of u. This crate knows no more of a model.
///
/// [`CondensedProgram::from_model`]: super::CondensedProgram::from_model
pub struct PredictionModel {
    /// m inputs, q measured disturbances, p outputs, horizons `T_ini` (what the estimator starts
    /// from, at least 1) and N.
    pub shape: Shape,
    /// In seconds.
    pub sample_time_s: f64,
    /// Φ, (m+p)N×(length of c), in the units of the channels.
    pub known: Mat<f64>,
    /// B, (m+p)N×(length of η).
    pub free: Mat<f64>,
    /// Typical size of every input (m), above 0: what a solver's tolerance is measured by.
    pub input_scales: Vec<f64>,
    /// Typical size of every output (p), above 0.
    pub output_scales: Vec<f64>,
    /// What knows c.
    pub estimator: Box<dyn StateEstimator>,
}

/// Knows the coordinates c of the present moment from the samples up to it.
///
/// # Contract
/// 1. [`start`](Self::start) forgets everything but the window it is given.
/// 2. After [`start`](Self::start), [`observe`](Self::observe) is called for every sample after the
///    window, oldest first, until the next start.
/// 3. Deterministic, and none of its methods allocates or panics on slices and windows of the
///    right shapes, whatever values they hold.
pub trait StateEstimator: Send {
    /// Length of c.
    fn coordinates(&self) -> usize;

    /// Starts from a full past window, `T_ini`×m, `T_ini`×q (0×0 without disturbances) and `T_ini`×p,
    /// oldest sample first.
    fn start(
        &mut self,
        inputs: MatRef<'_, f64>,
        disturbances: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    );

    /// Takes the sample (u(k), d(k), y(k)).
    fn observe(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]);

    /// Writes c for the sample after the last one taken. `preview`: what is expected of the measured
    /// disturbances, stacked time-major (qN).
    fn write(&self, preview: &[f64], c: &mut [f64]);
}

impl PredictionModel {
    /// Checks shapes and sizes.
    pub(super) fn check(&self) -> Result<(), ProgramError> {
        let Shape {
            inputs,
            outputs,
            horizons: Horizons { past, future },
            ..
        } = self.shape;
        for (field, found) in [
            ("inputs", inputs),
            ("outputs", outputs),
            ("horizons.past", past),
            ("horizons.future", future),
        ] {
            if found == 0 {
                return Err(ProgramError::ModelSize { field });
            }
        }
        let (rows, free) = (self.shape.future_rows(), self.free.ncols());
        for (name, matrix, expected_columns) in [
            (
                "the free response of the model",
                &self.known,
                self.estimator.coordinates(),
            ),
            ("the forced response of the model", &self.free, free),
        ] {
            if matrix.shape() != (rows, expected_columns) {
                return Err(ProgramError::Series {
                    name,
                    rows: matrix.nrows(),
                    columns: matrix.ncols(),
                    expected_rows: rows,
                    expected_columns,
                });
            }
            for (column, entries) in matrix.col_iter().enumerate() {
                if let Some(row) = entries.iter().position(|value| !value.is_finite()) {
                    return Err(ProgramError::Factorisation {
                        what: name,
                        row,
                        column,
                    });
                }
            }
        }
        for (field, scales, expected) in [
            ("input_scales", &self.input_scales, inputs),
            ("output_scales", &self.output_scales, outputs),
        ] {
            let valid = |scale: &f64| scale.is_finite() && *scale > 0.0;
            if scales.len() != expected || !scales.iter().all(valid) {
                return Err(ProgramError::ModelScales {
                    field,
                    found: scales.clone(),
                    expected,
                });
            }
        }
        Ok(())
    }

    /// Size of every entry of f.
    pub(super) fn future_scales(&self) -> Vec<f64> {
        let steps = self.shape.horizons.future;
        [
            self.input_scales.repeat(steps),
            self.output_scales.repeat(steps),
        ]
        .concat()
    }
}

/// The estimator, and whether it knows the present moment.
pub(super) struct Tracking {
    estimator: Box<dyn StateEstimator>,
    /// Entries of the preview of measured disturbances, the last ones of the known part.
    preview: usize,
    /// A sample was observed since the start or since everything was forgotten.
    told: bool,
    /// The estimator was started from a window and told every sample since.
    started: bool,
}

impl Tracking {
    pub fn new(estimator: Box<dyn StateEstimator>, preview: usize) -> Self {
        Self {
            estimator,
            preview,
            told: false,
            started: false,
        }
    }

    pub fn observe(&mut self, input: &[f64], disturbance: &[f64], output: &[f64]) {
        self.told = true;
        if self.started {
            self.estimator.observe(input, disturbance, output);
        }
    }

    pub fn forget(&mut self) {
        self.told = false;
        self.started = false;
    }

    /// Starts from a window if the past of it is not known better.
    pub fn prepare(
        &mut self,
        inputs: MatRef<'_, f64>,
        disturbances: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    ) {
        if !(self.told && self.started) {
            self.estimator.start(inputs, disturbances, outputs);
            self.started = true;
        }
    }

    pub fn write(&self, known: &[f64], c: &mut [f64]) {
        self.estimator
            .write(&known[known.len() - self.preview..], c);
    }

    /// Whether what was written can be used; if not, the estimate is of no use for the next
    /// moment, either.
    pub fn keep_if_finite(&mut self, c: &[f64]) {
        self.started &= c.iter().all(|value| value.is_finite());
    }
}
