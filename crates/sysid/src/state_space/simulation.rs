//! Simulation and k-step prediction in the units of the recording.

use deepc_core::faer::{Mat, MatRef};

use super::simulate::row_times;
use super::{StateSpace, check_finite};
use crate::error::SysidError;

impl StateSpace {
    /// Outputs T×p of the noise-free model from x(0) (n values) for `inputs` T×M: the inputs, then
    /// the measured disturbances, as recorded (offsets included, in and out).
    ///
    /// # Errors
    /// A shape does not fit or a value is not finite.
    pub fn simulate(
        &self,
        initial_state: &[f64],
        inputs: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, SysidError> {
        self.check_state(initial_state)?;
        let inputs = self.input_deviations(inputs)?;
        let deviations = self.matrices.simulate(initial_state, inputs.as_ref());
        Ok(self.with_output_offsets(deviations))
    }

    /// Predictions ŷ(t|t−k) T×p, `k` samples ahead: row t uses the outputs up to t−k and the
    /// inputs up to t. Rows before k−1 have no output to use and predict from x(0) alone.
    /// `inputs` T×M as in [`simulate`](Self::simulate), `outputs` T×p, x(0) n values; the state is
    /// that of the predictor, see [`initial_state`](Self::initial_state).
    ///
    /// # Errors
    /// `k` is 0, a shape does not fit or a value is not finite.
    pub fn predict(
        &self,
        k: usize,
        initial_state: &[f64],
        inputs: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, SysidError> {
        let mut all = self.predictions(k, initial_state, inputs, outputs)?;
        all.pop().ok_or_else(no_step)
    }

    /// The predictions of [`predict`](Self::predict) for k = 1..=`steps`, in one pass over the data
    /// of O(T·n·(n+M+p)) and O(T·p²) more per step:
    ///
    /// ```text
    /// ŷ(t|t−k−1) = ŷ(t|t−k) − C A^(k−1) K e(t−k),    e(t) = y(t) − ŷ(t|t−1)
    /// ```
    ///
    /// # Errors
    /// `steps` is 0, a shape does not fit or a value is not finite.
    pub fn predictions(
        &self,
        steps: usize,
        initial_state: &[f64],
        inputs: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    ) -> Result<Vec<Mat<f64>>, SysidError> {
        if steps == 0 {
            return Err(no_step());
        }
        self.check_state(initial_state)?;
        let inputs = self.input_deviations(inputs)?;
        let outputs = self.output_deviations(inputs.nrows(), outputs)?;
        let (samples, p) = outputs.shape();
        let mut ahead = self.one_step(initial_state, inputs.as_ref(), outputs.as_ref());
        let innovations = &outputs - &ahead;
        let mut all = Vec::with_capacity(steps);
        let mut gain = self.matrices.k.clone();
        for k in 1..=steps {
            all.push(self.with_output_offsets(ahead.clone()));
            if k == steps {
                break;
            }
            let response = &self.matrices.c * &gain;
            for j in 0..p {
                for i in 0..p {
                    let weight = response[(i, j)];
                    if weight == 0.0 {
                        continue;
                    }
                    for t in k..samples {
                        ahead[(t, i)] -= weight * innovations[(t - k, j)];
                    }
                }
            }
            gain = &self.matrices.a * &gain;
        }
        Ok(all)
    }

    /// One-step predictions of deviations, T×p.
    pub(super) fn one_step(
        &self,
        initial_state: &[f64],
        inputs: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    ) -> Mat<f64> {
        let (system, n) = (&self.matrices, self.order());
        let (samples, p) = outputs.shape();
        let driven = inputs * system.b.transpose();
        let direct = inputs * system.d.transpose();
        let mut ahead = Mat::zeros(samples, p);
        let (mut x, mut next, mut e) = (initial_state.to_vec(), vec![0.0; n], vec![0.0; p]);
        for t in 0..samples {
            for (i, e) in e.iter_mut().enumerate() {
                ahead[(t, i)] = row_times(system.c.as_ref(), i, &x) + direct[(t, i)];
                *e = outputs[(t, i)] - ahead[(t, i)];
            }
            for (i, next) in next.iter_mut().enumerate() {
                *next = row_times(system.a.as_ref(), i, &x)
                    + driven[(t, i)]
                    + row_times(system.k.as_ref(), i, &e);
            }
            std::mem::swap(&mut x, &mut next);
        }
        ahead
    }

    fn check_state(&self, initial_state: &[f64]) -> Result<(), SysidError> {
        if initial_state.len() != self.order() {
            return Err(SysidError::Series {
                series: "the initial state",
                rows: initial_state.len(),
                columns: 1,
                expected: format!("{}×1, the order of the model", self.order()),
            });
        }
        let state = MatRef::from_column_major_slice(initial_state, initial_state.len(), 1);
        check_finite("the initial state", state)
    }

    /// Checked inputs without their offsets, T×M.
    pub(super) fn input_deviations(&self, inputs: MatRef<'_, f64>) -> Result<Mat<f64>, SysidError> {
        let channels: Vec<_> = self.inputs.iter().chain(&self.disturbances).collect();
        if inputs.ncols() != channels.len() {
            return Err(SysidError::Series {
                series: "the input series",
                rows: inputs.nrows(),
                columns: inputs.ncols(),
                expected: format!(
                    "T×{}: {} input(s), then {} measured disturbance(s)",
                    channels.len(),
                    self.inputs.len(),
                    self.disturbances.len()
                ),
            });
        }
        check_finite("the input series", inputs)?;
        Ok(Mat::from_fn(inputs.nrows(), inputs.ncols(), |k, j| {
            inputs[(k, j)] - channels[j].offset
        }))
    }

    /// Checked outputs without their offsets, T×p.
    pub(super) fn output_deviations(
        &self,
        samples: usize,
        outputs: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, SysidError> {
        let p = self.outputs.len();
        if outputs.shape() != (samples, p) {
            return Err(SysidError::Series {
                series: "the output series",
                rows: outputs.nrows(),
                columns: outputs.ncols(),
                expected: format!(
                    "{samples}×{p}: as many rows as the inputs, one column per output"
                ),
            });
        }
        check_finite("the output series", outputs)?;
        Ok(Mat::from_fn(samples, p, |k, i| {
            outputs[(k, i)] - self.outputs[i].offset
        }))
    }

    fn with_output_offsets(&self, mut deviations: Mat<f64>) -> Mat<f64> {
        for (i, channel) in self.outputs.iter().enumerate() {
            let column = deviations.col_mut(i).iter_mut();
            column.for_each(|value| *value += channel.offset);
        }
        deviations
    }
}

fn no_step() -> SysidError {
    SysidError::Setting {
        field: "steps",
        found: "0".to_owned(),
        allowed: "predict at least 1 sample ahead".to_owned(),
    }
}
