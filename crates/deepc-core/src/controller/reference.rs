//! What the plant should do over the horizon.

use faer::{Mat, MatMut, MatRef};

use super::error::ControllerError;
use crate::hankel::Shape;

/// References `u_r` (N×m) and `y_r` (N×p) over the horizon, and what is expected of the measured
/// disturbances (N×q); row 0 is the sample being decided. Filled in place, so that a control loop
/// need not allocate.
#[derive(Debug, Clone)]
pub struct Reference {
    inputs: Mat<f64>,
    outputs: Mat<f64>,
    disturbances: Mat<f64>,
    /// Whether `disturbances` was filled.
    previewed: bool,
}

impl Reference {
    /// All zero, for a horizon of N steps, without preview of disturbances.
    #[must_use]
    pub fn zeros(horizon: usize, inputs: usize, outputs: usize) -> Self {
        Self::with_disturbances(horizon, inputs, 0, outputs)
    }

    /// All zero, for a horizon of N steps, with room for a preview of q measured disturbances.
    /// Until one is given, the last measured values are held.
    #[must_use]
    pub fn with_disturbances(
        horizon: usize,
        inputs: usize,
        disturbances: usize,
        outputs: usize,
    ) -> Self {
        Self {
            inputs: Mat::zeros(horizon, inputs),
            outputs: Mat::zeros(horizon, outputs),
            disturbances: Mat::zeros(horizon, disturbances),
            previewed: false,
        }
    }

    /// The same values at every step: `input` (m) and `output` (p).
    ///
    /// # Errors
    /// A length does not fit; the reference is unchanged then.
    pub fn hold(&mut self, input: &[f64], output: &[f64]) -> Result<(), ControllerError> {
        self.preview(
            MatRef::from_row_major_slice(input, 1, input.len()),
            MatRef::from_row_major_slice(output, 1, output.len()),
        )
    }

    /// Values known in advance, k×m and k×p with any k ≥ 1 each: row 0 is the sample being
    /// decided. The last row is held where a preview is shorter than the horizon; rows beyond the
    /// horizon are not looked at.
    ///
    /// # Errors
    /// A preview has no rows or the wrong number of columns; the reference is unchanged then.
    pub fn preview(
        &mut self,
        inputs: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
    ) -> Result<(), ControllerError> {
        check("input", self.inputs.ncols(), inputs)?;
        check("output", self.outputs.ncols(), outputs)?;
        fill(self.inputs.as_mut(), inputs);
        fill(self.outputs.as_mut(), outputs);
        Ok(())
    }

    /// Disturbances known in advance, k×q with any k ≥ 1, as in [`Self::preview`]. They stay until
    /// others are given or [`Self::hold_measured_disturbances`] is called.
    ///
    /// # Errors
    /// The preview has no rows or the wrong number of columns; the reference is unchanged then.
    pub fn preview_disturbances(
        &mut self,
        disturbances: MatRef<'_, f64>,
    ) -> Result<(), ControllerError> {
        check("disturbance", self.disturbances.ncols(), disturbances)?;
        fill(self.disturbances.as_mut(), disturbances);
        self.previewed = true;
        Ok(())
    }

    /// The same disturbances (q) at every step.
    ///
    /// # Errors
    /// The length does not fit; the reference is unchanged then.
    pub fn hold_disturbances(&mut self, disturbance: &[f64]) -> Result<(), ControllerError> {
        self.preview_disturbances(MatRef::from_row_major_slice(
            disturbance,
            1,
            disturbance.len(),
        ))
    }

    /// Expects the disturbances measured last at every step, as a new reference does.
    pub fn hold_measured_disturbances(&mut self) {
        self.previewed = false;
    }

    /// The preview of the disturbances, N×q; `None` while the last measured ones are held.
    #[must_use]
    pub fn disturbances(&self) -> Option<MatRef<'_, f64>> {
        self.previewed.then(|| self.disturbances.as_ref())
    }

    /// Whether its shape fits a controller; a preview of disturbances may be missing.
    pub(super) fn fits(&self, shape: &Shape) -> bool {
        let steps = shape.horizons.future;
        let expected = (steps, shape.disturbances);
        self.inputs.shape() == (steps, shape.inputs)
            && self.outputs.shape() == (steps, shape.outputs)
            && self.disturbances().is_none_or(|d| d.shape() == expected)
    }

    pub(super) fn is_finite(&self) -> bool {
        self.inputs.is_all_finite()
            && self.outputs.is_all_finite()
            && self.disturbances().is_none_or(|d| d.is_all_finite())
    }

    /// `u_r`, N×m.
    #[must_use]
    pub fn inputs(&self) -> MatRef<'_, f64> {
        self.inputs.as_ref()
    }

    /// `y_r`, N×p.
    #[must_use]
    pub fn outputs(&self) -> MatRef<'_, f64> {
        self.outputs.as_ref()
    }
}

fn check(
    name: &'static str,
    expected: usize,
    preview: MatRef<'_, f64>,
) -> Result<(), ControllerError> {
    if preview.nrows() > 0 && preview.ncols() == expected {
        return Ok(());
    }
    Err(ControllerError::Reference {
        name,
        rows: preview.nrows(),
        columns: preview.ncols(),
        expected,
    })
}

fn fill(mut target: MatMut<'_, f64>, preview: MatRef<'_, f64>) {
    let last = preview.nrows() - 1;
    for channel in 0..target.ncols() {
        for (time, value) in target.as_mut().col_mut(channel).iter_mut().enumerate() {
            *value = preview[(time.min(last), channel)];
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::mat;

    use super::*;

    #[test]
    fn a_short_preview_is_held_at_its_last_row() {
        let mut reference = Reference::zeros(4, 2, 1);
        let inputs = mat![[1.0, 10.0], [2.0, 20.0]];
        reference
            .preview(inputs.as_ref(), mat![[5.0]].as_ref())
            .unwrap();
        let expected = mat![[1.0, 10.0], [2.0, 20.0], [2.0, 20.0], [2.0, 20.0]];
        assert_eq!(reference.inputs(), expected);
        assert_eq!(reference.outputs(), mat![[5.0], [5.0], [5.0], [5.0]]);
    }

    #[test]
    fn a_reference_for_other_channels_is_refused_with_the_counts() {
        let mut reference = Reference::zeros(4, 2, 2);
        let message = reference.hold(&[1.0], &[0.0, 0.0]).unwrap_err().to_string();
        assert!(message.contains("input reference is 1×1"), "{message}");
        assert!(message.contains("2 columns"), "{message}");
    }

    #[test]
    fn a_preview_of_disturbances_stays_until_it_is_taken_back() {
        let mut reference = Reference::with_disturbances(3, 1, 2, 1);
        assert!(reference.disturbances().is_none());
        reference.hold_disturbances(&[1.0, 2.0]).unwrap();
        let expected = mat![[1.0, 2.0], [1.0, 2.0], [1.0, 2.0]];
        assert_eq!(reference.disturbances().unwrap(), expected);
        let message = reference.hold_disturbances(&[1.0]).unwrap_err().to_string();
        assert!(
            message.contains("disturbance reference is 1×1"),
            "{message}"
        );
        assert_eq!(reference.disturbances().unwrap(), expected);
        reference.hold_measured_disturbances();
        assert!(reference.disturbances().is_none());
    }
}
