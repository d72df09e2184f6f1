//! Running the equations.

use deepc_core::faer::{Mat, MatRef};

use super::SystemMatrices;

impl SystemMatrices {
    /// Outputs T×p of the noise-free system from x(0) for inputs T×M; deviations in and out.
    pub(crate) fn simulate(&self, initial: &[f64], inputs: MatRef<'_, f64>) -> Mat<f64> {
        let (samples, p) = (inputs.nrows(), self.outputs());
        let mut outputs = Mat::zeros(samples, p);
        let (mut state, mut next) = (initial.to_vec(), vec![0.0; self.order()]);
        let mut output = vec![0.0; p];
        for k in 0..samples {
            self.observe(&state, inputs, k, &mut output);
            for (channel, &value) in output.iter().enumerate() {
                outputs[(k, channel)] = value;
            }
            self.advance(&state, inputs, k, &mut next);
            std::mem::swap(&mut state, &mut next);
        }
        outputs
    }

    /// C x + D u(k).
    pub(crate) fn observe(
        &self,
        state: &[f64],
        inputs: MatRef<'_, f64>,
        k: usize,
        out: &mut [f64],
    ) {
        step(self.c.as_ref(), self.d.as_ref(), state, inputs, k, out);
    }

    /// A x + B u(k).
    pub(crate) fn advance(
        &self,
        state: &[f64],
        inputs: MatRef<'_, f64>,
        k: usize,
        out: &mut [f64],
    ) {
        step(self.a.as_ref(), self.b.as_ref(), state, inputs, k, out);
    }
}

fn step(
    on_state: MatRef<'_, f64>,
    on_inputs: MatRef<'_, f64>,
    state: &[f64],
    inputs: MatRef<'_, f64>,
    k: usize,
    out: &mut [f64],
) {
    out.fill(0.0);
    for (j, &value) in state.iter().enumerate() {
        for (i, out) in out.iter_mut().enumerate() {
            *out += on_state[(i, j)] * value;
        }
    }
    for j in 0..inputs.ncols() {
        let value = inputs[(k, j)];
        for (i, out) in out.iter_mut().enumerate() {
            *out += on_inputs[(i, j)] * value;
        }
    }
}

/// Row i of a matrix times x.
pub(crate) fn row_times(matrix: MatRef<'_, f64>, i: usize, x: &[f64]) -> f64 {
    x.iter().enumerate().map(|(j, x)| matrix[(i, j)] * x).sum()
}
