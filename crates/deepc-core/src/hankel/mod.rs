//! Stage 2: block Hankel matrices of a data set, and whether its inputs excite the plant.

mod error;
mod excitation;
mod factor;
mod gram;
mod proof;
mod rank;
mod selection;
mod shape;
mod stacking;
mod triangle;
mod windows;

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

pub use error::HankelError;
pub use excitation::{ChannelExcitation, ExcitationReport, ExcitingRole, SingularValueGap};
pub use factor::{FactorMethod, FactorReport, GRAM_CONDITION_LIMIT, HankelFactor, OnesRow};
pub use proof::{HankelData, PersistentlyExciting};
pub use rank::RANK_TOLERANCE;
pub use selection::{PastWindow, Selection};
pub use shape::{Block, Blocks, Horizons, Shape};
pub use stacking::{block_hankel, stack, stack_into, stacked_position, unstack_into};
pub use windows::{factor_windows, leading_condition};

use crate::data::{Dataset, Record};
pub(crate) use rank::ChannelScales;
use stacking::{window_columns, windows};
pub(crate) use triangle::{BlockQr, Triangle};

/// How the columns of a data matrix were taken from the records.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arrangement {
    /// Every window of L samples: neighbouring columns share L − 1 samples.
    Hankel,
    /// Windows that follow each other and share no sample (Damen, Van den Hof, Hajdasinski 1982;
    /// Coulson, Lygeros, Dörfler 2022): independent noise in different columns, as averaging and
    /// robust formulations assume, for L times the data.
    Page,
    /// Some of these columns, selected.
    Selection,
}

impl Arrangement {
    fn name(self) -> &'static str {
        match self {
            Self::Hankel => "Hankel",
            Self::Page => "Page",
            Self::Selection => "selected data",
        }
    }
}

/// The stacked block Hankel matrix H of order L of a data set, one column per window of L
/// samples, partitioned by name. Its rows are `col(u_ini, d_ini, y_ini, d, u, y)`, each stacked
/// time-major:
///
/// | block | rows | |
/// |---|---|---|
/// | `U_p` | m·`T_ini` | past inputs |
/// | `D_p` | q·`T_ini` | past measured disturbances |
/// | `Y_p` | p·`T_ini` | past outputs |
/// | `D_f` | q·N | future measured disturbances |
/// | `U_f` | m·N | future inputs |
/// | `Y_f` | p·N | future outputs |
///
/// What is known when the controller decides stands above what it decides.
#[derive(Debug, Clone)]
pub struct HankelMatrix {
    dataset: Dataset,
    shape: Shape,
    arrangement: Arrangement,
    /// Record (from 0) and first sample of every column.
    starts: Vec<(usize, usize)>,
    matrix: Mat<f64>,
}

impl HankelMatrix {
    /// Builds H from all records; no column crosses from one record to the next.
    ///
    /// # Errors
    /// A horizon is 0, there is no record, or one is shorter than L.
    pub fn build(dataset: &Dataset, horizons: Horizons) -> Result<Self, HankelError> {
        Self::arrange(dataset, horizons, 1, Arrangement::Hankel)
    }

    /// Builds the Page matrix ([`Arrangement::Page`]) instead: ⌊T/L⌋ columns per record.
    ///
    /// # Errors
    /// As [`HankelMatrix::build`].
    pub fn build_page(dataset: &Dataset, horizons: Horizons) -> Result<Self, HankelError> {
        Self::arrange(dataset, horizons, horizons.window(), Arrangement::Page)
    }

    fn arrange(
        dataset: &Dataset,
        horizons: Horizons,
        stride: usize,
        arrangement: Arrangement,
    ) -> Result<Self, HankelError> {
        let shape = check(dataset, horizons)?;
        let starts = starts(dataset, horizons.window(), stride);
        let mut matrix = Mat::zeros(shape.rows(), starts.len());
        for (column, &(record, start)) in starts.iter().enumerate() {
            let record = &dataset.records()[record];
            shape.write_window(record, start, matrix.col_as_slice_mut(column));
        }
        Ok(Self {
            dataset: dataset.clone(),
            shape,
            arrangement,
            starts,
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

    /// The whole matrix H, (m + q + p)L×J, rows `col(u_ini, d_ini, y_ini, d, u, y)`.
    #[must_use]
    pub fn stacked(&self) -> MatRef<'_, f64> {
        self.matrix.as_ref()
    }

    /// Its blocks by name, J columns each.
    #[must_use]
    pub fn blocks(&self) -> Blocks<'_> {
        Blocks::of(self.stacked(), self.shape)
    }

    /// How its columns were taken from the records.
    #[must_use]
    pub fn arrangement(&self) -> Arrangement {
        self.arrangement
    }

    /// Record number (from 1) and first sample (from 0) of column `column`, if there is one.
    #[must_use]
    pub fn origin(&self, column: usize) -> Option<(usize, usize)> {
        let &(record, start) = self.starts.get(column)?;
        Some((record + 1, start))
    }

    /// H with every channel divided by its scale.
    pub(crate) fn scaled_rows(&self, scales: &ChannelScales) -> Mat<f64> {
        let scales = scales.per_row(self.shape);
        Mat::from_fn(self.matrix.nrows(), self.matrix.ncols(), |i, j| {
            self.matrix[(i, j)] / scales[i]
        })
    }

    /// Root mean square of every channel.
    pub(crate) fn channel_scales(&self) -> ChannelScales {
        ChannelScales::of(&self.dataset)
    }
}

impl HankelData for HankelMatrix {
    fn dataset(&self) -> &Dataset {
        &self.dataset
    }

    fn shape(&self) -> Shape {
        self.shape
    }

    fn arrangement(&self) -> Arrangement {
        self.arrangement
    }

    fn scaled_stacked(&self, scales: &ChannelScales) -> Mat<f64> {
        self.scaled_rows(scales)
    }

    fn scaled_inputs(&self, channels: &[usize], depth: usize, scales: &[f64]) -> (Mat<f64>, usize) {
        let series = |record: &Record| {
            let all = record.channels();
            Mat::from_fn(record.samples(), channels.len(), |k, i| {
                all[channels[i]][k] / scales[i]
            })
        };
        let series: Vec<_> = self.dataset.records().iter().map(series).collect();
        let views: Vec<_> = series.iter().map(Mat::as_ref).collect();
        let starts = match self.arrangement {
            Arrangement::Hankel => starts(&self.dataset, depth, 1),
            Arrangement::Page => starts(&self.dataset, depth, self.horizons().window()),
            Arrangement::Selection => self.starts.clone(),
        };
        let columns = starts.len();
        (window_columns(&views, depth, &starts), columns)
    }
}

/// Sizes, if every record holds a window.
fn check(dataset: &Dataset, horizons: Horizons) -> Result<Shape, HankelError> {
    for (name, steps) in [("past", horizons.past), ("future", horizons.future)] {
        if steps == 0 {
            return Err(HankelError::EmptyHorizon { name });
        }
    }
    if dataset.records().is_empty() {
        return Err(HankelError::NoRecords);
    }
    let shape = Shape {
        inputs: dataset.inputs(),
        disturbances: dataset.disturbances(),
        outputs: dataset.outputs(),
        horizons,
    };
    let window = horizons.window();
    for (index, record) in dataset.records().iter().enumerate() {
        if windows(record.samples(), window) == 0 {
            let exciting = shape.inputs + shape.disturbances;
            return Err(HankelError::RecordTooShort {
                record: index + 1,
                samples: record.samples(),
                window,
                exciting,
                needed: (exciting + 1).saturating_mul(window) - 1,
            });
        }
    }
    Ok(shape)
}

/// Record (from 0) and first sample of every window of `depth` samples, `stride` samples apart.
fn starts(dataset: &Dataset, depth: usize, stride: usize) -> Vec<(usize, usize)> {
    let records = dataset.records().iter().enumerate();
    let starts = records.flat_map(|(index, record)| {
        let count = windows(record.samples(), depth);
        (0..count).step_by(stride).map(move |start| (index, start))
    });
    starts.collect()
}
