//! Columns near the operating point.

use faer::MatRef;

use super::error::HankelError;
use super::gram::spreads;
use super::shape::Block;
use super::stacking::stack_into;
use super::{Arrangement, HankelMatrix};
use crate::data::Record;

/// A past window, as a query. Rows are time, oldest first; columns are channels.
#[derive(Debug, Clone, Copy)]
pub struct PastWindow<'a> {
    /// `u_ini`, `T_ini`×m.
    pub inputs: MatRef<'a, f64>,
    /// `d_ini`, `T_ini`×q.
    pub disturbances: MatRef<'a, f64>,
    /// `y_ini`, `T_ini`×p.
    pub outputs: MatRef<'a, f64>,
}

/// The columns nearest to a past window.
#[derive(Debug, Clone)]
pub struct Selection {
    /// The matrix of these columns alone, in their order. Whether they still excite is measured
    /// as ever ([`HankelMatrix::excitation`]); its report says what it can prove.
    pub hankel: HankelMatrix,
    /// Their positions in the matrix selected from, rising.
    pub columns: Vec<usize>,
    /// Their distances: root mean square over the past window of the difference in standard
    /// deviations of the channel.
    pub distances: Vec<f64>,
}

impl HankelMatrix {
    /// Selects the `count` columns whose past is nearest to `query`, every channel measured in its
    /// standard deviations: a local linear model of a nonlinear plant (Select-DPC: Näf, Moffat,
    /// Eising, Dörfler 2025, arXiv 2503.18845; contextual sampling: Beerwerth, Alrifaee 2025, arXiv
    /// 2503.23890). Ties go to
    /// the earlier column.
    ///
    /// Too few columns do not span what the plant can do: (m + q)L + n at least, and with noise
    /// several times as many.
    ///
    /// # Errors
    /// `count` is 0 or more than there are columns, or `query` has the wrong size or is not
    /// finite.
    pub fn select_columns(
        &self,
        query: &PastWindow<'_>,
        count: usize,
    ) -> Result<Selection, HankelError> {
        if count == 0 || count > self.columns() {
            return Err(HankelError::Columns {
                found: count,
                available: self.columns(),
            });
        }
        let query = self.stacked_query(query)?;
        let deviations = self.deviations_per_row();
        let past: Vec<_> = past_rows(self).collect();
        let distance = |column: usize| -> f64 {
            let values = self.stacked().col(column);
            let squares = past
                .iter()
                .zip(&query)
                .map(|(&row, value)| ((values[row] - value) / deviations[row]).powi(2));
            (squares.sum::<f64>() / past.len() as f64).sqrt()
        };
        let mut ranked: Vec<_> = (0..self.columns()).map(|j| (distance(j), j)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        ranked.truncate(count);
        ranked.sort_by_key(|&(_, column)| column);
        let columns: Vec<_> = ranked.iter().map(|&(_, column)| column).collect();
        let matrix = faer::Mat::from_fn(self.matrix.nrows(), count, |i, j| {
            self.matrix[(i, columns[j])]
        });
        Ok(Selection {
            hankel: Self {
                dataset: self.dataset.clone(),
                shape: self.shape,
                arrangement: Arrangement::Selection,
                starts: columns.iter().map(|&column| self.starts[column]).collect(),
                matrix,
            },
            distances: ranked.iter().map(|&(distance, _)| distance).collect(),
            columns,
        })
    }

    fn stacked_query(&self, query: &PastWindow<'_>) -> Result<Vec<f64>, HankelError> {
        let shape = self.shape;
        let steps = shape.horizons.past;
        let mut stacked = Vec::new();
        for (name, series, channels) in [
            ("the past of the inputs", query.inputs, shape.inputs),
            (
                "the past of the disturbances",
                query.disturbances,
                shape.disturbances,
            ),
            ("the past of the outputs", query.outputs, shape.outputs),
        ] {
            if series.shape() != (steps, channels) {
                return Err(HankelError::Query {
                    name,
                    rows: series.nrows(),
                    columns: series.ncols(),
                    expected_rows: steps,
                    expected_columns: channels,
                });
            }
            for sample in 0..steps {
                for channel in 0..channels {
                    let value = series[(sample, channel)];
                    if !value.is_finite() {
                        return Err(HankelError::QueryNotFinite {
                            name,
                            value,
                            sample,
                            channel,
                        });
                    }
                }
            }
            let first = stacked.len();
            stacked.resize(first + steps * channels, 0.0);
            stack_into(series, &mut stacked[first..]);
        }
        Ok(stacked)
    }

    fn deviations_per_row(&self) -> Vec<f64> {
        let records: Vec<_> = self
            .dataset
            .records()
            .iter()
            .map(Record::channels)
            .collect();
        let deviations: Vec<_> = spreads(&records).iter().map(|s| s.deviation).collect();
        let (inputs, others) = deviations.split_at(self.shape.inputs);
        let (disturbances, outputs) = others.split_at(self.shape.disturbances);
        self.shape.per_row(inputs, disturbances, outputs)
    }
}

/// Rows of `U_p`, `D_p` and `Y_p`.
fn past_rows(hankel: &HankelMatrix) -> impl Iterator<Item = usize> {
    let shape = hankel.shape;
    let blocks = [
        Block::PastInputs,
        Block::PastDisturbances,
        Block::PastOutputs,
    ];
    blocks
        .into_iter()
        .flat_map(move |block| shape.rows_of(block))
}
