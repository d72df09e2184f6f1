//! The initial state that explains a record best.

use deepc_core::faer::{Mat, MatRef};

use super::StateSpace;
use crate::error::SysidError;

/// What an initial state is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InitialStateFor {
    /// Simulation from the inputs alone; the sensitivity of y(t) is C Aᵗ.
    Simulation,
    /// One-step prediction from inputs and outputs; the sensitivity of ŷ(t|t−1) is C (A − K C)ᵗ.
    Prediction,
}

/// Directions of x(0) whose effect on the record is below this fraction of the strongest one's are
/// left at zero; the columns have been scaled to size 1 before.
const RANK_TOLERANCE: f64 = 1e-12;

/// A sensitivity below this fraction of the largest one changes nothing any more.
const NEGLIGIBLE: f64 = 1e-20;

/// Rows put into the triangle at a time.
const CHUNK: usize = 256;

impl StateSpace {
    /// x(0), n values, by least squares on the record: `inputs` T×M and `outputs` T×p as recorded.
    /// Every output counts in units of its scale. Directions that the record does not see
    /// (unobservable ones, or in a record shorter than the order) stay at zero.
    ///
    /// Orthogonal transformations only, a chunk of rows at a time: no matrix grows with T and no
    /// condition number is squared, so that poles near or on the unit circle do no harm.
    ///
    /// # Errors
    /// A shape does not fit, a value is not finite, or the model (for simulation) or its predictor
    /// is so unstable that the record is beyond the range of numbers.
    pub fn initial_state(
        &self,
        inputs: MatRef<'_, f64>,
        outputs: MatRef<'_, f64>,
        purpose: InitialStateFor,
    ) -> Result<Vec<f64>, SysidError> {
        let inputs = self.input_deviations(inputs)?;
        let outputs = self.output_deviations(inputs.nrows(), outputs)?;
        let (n, p) = (self.order(), self.outputs.len());
        if n == 0 || outputs.nrows() == 0 {
            return Ok(vec![0.0; n]);
        }
        let origin = vec![0.0; n];
        let (explained, transition) = match purpose {
            InitialStateFor::Simulation => (
                self.matrices.simulate(&origin, inputs.as_ref()),
                self.matrices.a.clone(),
            ),
            InitialStateFor::Prediction => (
                self.one_step(&origin, inputs.as_ref(), outputs.as_ref()),
                self.matrices.predictor(),
            ),
        };
        let residual = &outputs - &explained;
        let weights: Vec<f64> = self.outputs.iter().map(|y| 1.0 / y.scale).collect();
        let mut sensitivity = Mat::from_fn(p, n, |i, j| weights[i] * self.matrices.c[(i, j)]);
        let mut triangle = Triangle::new(n);
        let mut largest = 0.0_f64;
        for t in 0..residual.nrows() {
            let size = sensitivity.norm_max();
            let row_finite = (0..p).all(|i| residual[(t, i)].is_finite());
            if !(size.is_finite() && row_finite) {
                return Err(diverged(purpose, transition.as_ref()));
            }
            largest = largest.max(size);
            if size <= NEGLIGIBLE * largest {
                break;
            }
            for (i, weight) in weights.iter().enumerate() {
                triangle.push(
                    sensitivity.row(i).iter().copied(),
                    weight * residual[(t, i)],
                );
            }
            sensitivity = &sensitivity * &transition;
        }
        triangle.solve()
    }
}

fn diverged(purpose: InitialStateFor, transition: MatRef<'_, f64>) -> SysidError {
    let radius = match super::poles::spectral_radius(transition) {
        Ok(radius) => radius,
        Err(error) => return error,
    };
    SysidError::Unstable {
        what: match purpose {
            InitialStateFor::Simulation => "A",
            InitialStateFor::Prediction => "A − K C",
        },
        radius,
        limit: 1.0,
        remedy: "the record is too long to run it; enforce stability or cut the record",
    }
}

/// The triangular factor of all rows [sensitivity, residual] seen so far.
struct Triangle {
    /// Rows are filled from the top; the first n+1 hold the factor of the former ones.
    rows: Mat<f64>,
    filled: usize,
}

impl Triangle {
    fn new(n: usize) -> Self {
        Self {
            rows: Mat::zeros(n + 1 + CHUNK.max(n), n + 1),
            filled: 0,
        }
    }

    fn push(&mut self, sensitivity: impl Iterator<Item = f64>, residual: f64) {
        if self.filled == self.rows.nrows() {
            self.compress();
        }
        let row = self.rows.row_mut(self.filled);
        let values = sensitivity.chain(std::iter::once(residual));
        row.iter_mut().zip(values).for_each(|(entry, v)| *entry = v);
        self.filled += 1;
    }

    fn compress(&mut self) {
        let columns = self.rows.ncols();
        let factor = self.rows.qr();
        let r = factor.thin_R();
        let compressed = Mat::from_fn(columns, columns, |i, j| {
            if i <= j && i < r.nrows() {
                r[(i, j)]
            } else {
                0.0
            }
        });
        self.rows.fill(0.0);
        self.rows.get_mut(..columns, ..).copy_from(&compressed);
        self.filled = columns;
    }

    fn solve(mut self) -> Result<Vec<f64>, SysidError> {
        self.compress();
        let n = self.rows.ncols() - 1;
        let sizes: Vec<f64> = (0..n).map(|j| self.rows.get(..n, j).norm_l2()).collect();
        let unit = |j: usize| if sizes[j] > 0.0 { sizes[j] } else { 1.0 };
        let scaled = Mat::from_fn(n, n, |i, j| self.rows[(i, j)] / unit(j));
        let svd = scaled.svd().map_err(|error| SysidError::Numerical {
            what: "the singular values of the initial state's sensitivity",
            why: format!("{error:?}"),
        })?;
        let (u, v) = (svd.U(), svd.V());
        let values: Vec<f64> = svd.S().column_vector().iter().copied().collect();
        let mut x = vec![0.0; n];
        for (index, &value) in values.iter().enumerate() {
            if value <= RANK_TOLERANCE * values[0] || value == 0.0 {
                continue;
            }
            let along: f64 = (0..n).map(|i| u[(i, index)] * self.rows[(i, n)]).sum();
            for (j, x) in x.iter_mut().enumerate() {
                *x += v[(j, index)] * along / value;
            }
        }
        x.iter_mut().enumerate().for_each(|(j, x)| *x /= unit(j));
        Ok(x)
    }
}

impl super::SystemMatrices {
    /// A − K C, n×n.
    pub(crate) fn predictor(&self) -> Mat<f64> {
        &self.a - &self.k * &self.c
    }
}
