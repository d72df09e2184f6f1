//! Running the equations.

use deepc_core::faer::{Mat, MatRef};

use super::SystemMatrices;
use crate::kernels::{Output, march};

impl SystemMatrices {
    /// Outputs T×p of the noise-free system from x(0) for inputs T×M; deviations in and out.
    pub(crate) fn simulate(&self, initial: &[f64], inputs: MatRef<'_, f64>) -> Mat<f64> {
        let (samples, p) = (inputs.nrows(), self.outputs());
        let mut outputs = vec![0.0; samples * p];
        march(
            self,
            initial,
            &by_sample(inputs),
            &mut outputs,
            &mut [],
            Output::Simulated,
        );
        MatRef::from_row_major_slice(&outputs, samples, p).to_owned()
    }
}

/// A series T×M, row by row.
pub(crate) fn by_sample(series: MatRef<'_, f64>) -> Vec<f64> {
    let (samples, channels) = series.shape();
    let mut rows = vec![0.0; samples * channels];
    for (j, column) in series.col_iter().enumerate() {
        let to = rows.iter_mut().skip(j).step_by(channels);
        to.zip(column.iter()).for_each(|(to, from)| *to = *from);
    }
    rows
}

/// Row i of a matrix times x.
pub(crate) fn row_times(matrix: MatRef<'_, f64>, i: usize, x: &[f64]) -> f64 {
    x.iter().enumerate().map(|(j, x)| matrix[(i, j)] * x).sum()
}
