//! Stage 2: block Hankel matrices of a data set, and whether its inputs excite the plant.

mod error;
mod excitation;
mod rank;
mod stacking;

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

pub use error::HankelError;
pub use excitation::{ChannelExcitation, ExcitationReport, PersistentlyExciting, SingularValueGap};
pub use rank::RANK_TOLERANCE;
pub use stacking::{block_hankel, stack, stack_into, stacked_position, unstack_into};

use crate::data::{Dataset, Record};
use stacking::windows;

/// The two horizons, in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Horizons {
    /// Past window `T_ini`: long enough to fix the plant's state (at least its lag).
    pub past: usize,
    /// Prediction horizon N.
    pub future: usize,
}

impl Horizons {
    /// `past` = `T_ini` and `future` = N samples.
    #[must_use]
    pub fn new(past: usize, future: usize) -> Self {
        Self { past, future }
    }

    /// Window L = `T_ini` + N.
    #[must_use]
    pub fn window(&self) -> usize {
        self.past.saturating_add(self.future)
    }
}

/// Sizes shared by everything built from one Hankel matrix: m inputs, p outputs, horizons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shape {
    /// Input channels m.
    pub inputs: usize,
    /// Output channels p.
    pub outputs: usize,
    /// Horizons `T_ini` and N.
    pub horizons: Horizons,
}

impl Shape {
    /// Length of the stacked past (`u_ini`, `y_ini`): (m + p)·`T_ini`.
    #[must_use]
    pub fn past_rows(&self) -> usize {
        (self.inputs + self.outputs) * self.horizons.past
    }

    /// Length of the stacked future (u, y): (m + p)·N.
    #[must_use]
    pub fn future_rows(&self) -> usize {
        (self.inputs + self.outputs) * self.horizons.future
    }

    /// Rows of the stacked Hankel matrix: (m + p)·L.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.past_rows() + self.future_rows()
    }

    /// One value per row of the stacked Hankel matrix, from one value per channel.
    pub(crate) fn per_row<T: Copy>(&self, inputs: &[T], outputs: &[T]) -> Vec<T> {
        let Horizons { past, future } = self.horizons;
        let blocks = [
            (inputs, past),
            (outputs, past),
            (inputs, future),
            (outputs, future),
        ];
        blocks
            .into_iter()
            .flat_map(|(values, steps)| values.repeat(steps))
            .collect()
    }

    /// First row and number of rows of the four blocks `U_p`, `Y_p`, `U_f`, `Y_f`.
    pub(crate) fn blocks(&self) -> [(usize, usize); 4] {
        let Horizons { past, future } = self.horizons;
        let sizes = [
            self.inputs * past,
            self.outputs * past,
            self.inputs * future,
            self.outputs * future,
        ];
        let mut first = 0;
        sizes.map(|size| {
            let block = (first, size);
            first += size;
            block
        })
    }
}

/// The stacked block Hankel matrix H of order L of a data set, one column per window of L
/// samples, partitioned by name. Its rows are `col(u_ini, y_ini, u, y)`, each stacked
/// time-major:
///
/// | block | rows | |
/// |---|---|---|
/// | `U_p` | m·`T_ini` | past inputs |
/// | `Y_p` | p·`T_ini` | past outputs |
/// | `U_f` | m·N | future inputs |
/// | `Y_f` | p·N | future outputs |
#[derive(Debug, Clone)]
pub struct HankelMatrix {
    dataset: Dataset,
    shape: Shape,
    matrix: Mat<f64>,
}

impl HankelMatrix {
    /// Builds H from all records; no column crosses from one record to the next.
    ///
    /// # Errors
    /// A horizon is 0, there is no record, or one is shorter than L.
    pub fn build(dataset: &Dataset, horizons: Horizons) -> Result<Self, HankelError> {
        for (name, steps) in [("past", horizons.past), ("future", horizons.future)] {
            if steps == 0 {
                return Err(HankelError::EmptyHorizon { name });
            }
        }
        if dataset.records().is_empty() {
            return Err(HankelError::NoRecords);
        }
        let window = horizons.window();
        let (m, p) = (dataset.inputs(), dataset.outputs());
        for (index, record) in dataset.records().iter().enumerate() {
            if windows(record.samples(), window) == 0 {
                return Err(HankelError::RecordTooShort {
                    record: index + 1,
                    samples: record.samples(),
                    window,
                    needed: (m + 1).saturating_mul(window) - 1,
                });
            }
        }
        let shape = Shape {
            inputs: m,
            outputs: p,
            horizons,
        };
        let inputs: Vec<_> = dataset.records().iter().map(Record::inputs).collect();
        let outputs: Vec<_> = dataset.records().iter().map(Record::outputs).collect();
        let (inputs, outputs) = (
            block_hankel(&inputs, window),
            block_hankel(&outputs, window),
        );
        let mut matrix = Mat::zeros(shape.rows(), inputs.ncols());
        let (past_u, past_y) = (m * horizons.past, p * horizons.past);
        let sources = [
            inputs.subrows(0, past_u),
            outputs.subrows(0, past_y),
            inputs.subrows(past_u, m * horizons.future),
            outputs.subrows(past_y, p * horizons.future),
        ];
        for ((first, rows), source) in shape.blocks().into_iter().zip(sources) {
            matrix.as_mut().subrows_mut(first, rows).copy_from(source);
        }
        Ok(Self {
            dataset: dataset.clone(),
            shape,
            matrix,
        })
    }

    /// Measures persistent excitation of order L + `plant_order`.
    ///
    /// # Errors
    /// Only if a singular value decomposition does not converge: poor data are no error here.
    pub fn excitation(&self, plant_order: usize) -> Result<ExcitationReport, HankelError> {
        ExcitationReport::measure(self, plant_order)
    }

    /// Proves persistent excitation of order L + `plant_order`, where `plant_order` is an upper
    /// bound on the order n of the plant.
    ///
    /// # Errors
    /// Too few samples, or inputs that do not excite: the message says what to record.
    pub fn require_persistently_exciting(
        self,
        plant_order: usize,
    ) -> Result<PersistentlyExciting, HankelError> {
        PersistentlyExciting::require(self, plant_order)
    }

    /// Declares the inputs persistently exciting without looking. For data whose excitation is
    /// known by other means, or to study what poor data do.
    #[must_use]
    pub fn assume_persistently_exciting(self) -> PersistentlyExciting {
        PersistentlyExciting::assume(self)
    }

    /// The data set it was built from.
    #[must_use]
    pub fn dataset(&self) -> &Dataset {
        &self.dataset
    }

    /// Sizes.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Horizons.
    #[must_use]
    pub fn horizons(&self) -> Horizons {
        self.shape.horizons
    }

    /// Number of columns J.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.matrix.ncols()
    }

    /// The whole matrix H, (m + p)L×J, rows `col(u_ini, y_ini, u, y)`.
    #[must_use]
    pub fn stacked(&self) -> MatRef<'_, f64> {
        self.matrix.as_ref()
    }

    /// `U_p`, m·`T_ini`×J.
    #[must_use]
    pub fn past_inputs(&self) -> MatRef<'_, f64> {
        self.block(0)
    }

    /// `Y_p`, p·`T_ini`×J.
    #[must_use]
    pub fn past_outputs(&self) -> MatRef<'_, f64> {
        self.block(1)
    }

    /// `U_f`, m·N×J.
    #[must_use]
    pub fn future_inputs(&self) -> MatRef<'_, f64> {
        self.block(2)
    }

    /// `Y_f`, p·N×J.
    #[must_use]
    pub fn future_outputs(&self) -> MatRef<'_, f64> {
        self.block(3)
    }

    fn block(&self, index: usize) -> MatRef<'_, f64> {
        let (first, rows) = self.shape.blocks()[index];
        self.matrix.subrows(first, rows)
    }

    /// H with every channel divided by its scale.
    pub(crate) fn scaled_rows(&self, inputs: &[f64], outputs: &[f64]) -> Mat<f64> {
        let scales = self.shape.per_row(inputs, outputs);
        Mat::from_fn(self.matrix.nrows(), self.matrix.ncols(), |i, j| {
            self.matrix[(i, j)] / scales[i]
        })
    }

    /// Root mean square of every input and output channel (1 for a channel that is zero).
    pub(crate) fn channel_scales(&self) -> (Vec<f64>, Vec<f64>) {
        let records = self.dataset.records();
        let inputs: Vec<_> = records.iter().map(Record::inputs).collect();
        let outputs: Vec<_> = records.iter().map(Record::outputs).collect();
        (
            rank::channel_scales(&inputs),
            rank::channel_scales(&outputs),
        )
    }
}
