//! The only thing that is kept of the recording: the triangular factor of its windows.

use deepc_core::faer::{Mat, MatRef};
use deepc_core::hankel::{
    FactorMethod, FactorReport, OnesRow, RANK_TOLERANCE, factor_windows, leading_condition,
    stacked_position,
};

use crate::error::SysidError;
use crate::working::{WorkingData, WorkingRecord};

/// Rᵀ of `col(U_f, U_p, Y_p, Y_f)`, lower triangular, from M inputs and p outputs:
///
/// | rows | block | |
/// |---|---|---|
/// | M·f | `U_f` | inputs of the future horizon f |
/// | M·past | `U_p` | inputs of the past horizon |
/// | p·past | `Y_p` | outputs of the past horizon |
/// | p·f | `Y_f` | outputs of the future horizon |
///
/// One column per window of past + f samples of one record. Its size does not depend on the
/// number of samples, and everything that follows is computed from it alone.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    pub past: usize,
    pub future: usize,
    /// M.
    pub inputs: usize,
    /// p.
    pub outputs: usize,
    /// Samples of all records that hold a window.
    pub samples: usize,
    lower: Mat<f64>,
    report: FactorReport,
}

impl Factor {
    /// With `ones`, the mean of every row of the stack is taken out, so that constants in the
    /// records (offsets that are not known) change nothing.
    ///
    /// # Errors
    /// [`SysidError::Setting`], [`SysidError::TooShort`], [`SysidError::NotExciting`].
    pub fn new(
        data: &WorkingData,
        past: usize,
        future: usize,
        ones: OnesRow,
        method: FactorMethod,
    ) -> Result<Self, SysidError> {
        for (field, steps, least) in [("past", past, 1), ("future", future, 2)] {
            if steps < least {
                return Err(SysidError::Setting {
                    field,
                    found: steps.to_string(),
                    allowed: format!("give at least {least}"),
                });
            }
        }
        let (m, p) = (data.inputs.len(), data.outputs.len());
        let window = past.saturating_add(future);
        let extra = usize::from(ones == OnesRow::OnTop);
        let rows = window.saturating_mul(m + p).saturating_add(extra);
        let lengths = || data.records.iter().map(WorkingRecord::samples);
        let usable = || lengths().filter(|&samples| samples >= window);
        let columns: usize = usable().map(|samples| samples + 1 - window).sum();
        if columns < rows {
            // Every record loses window − 1 columns.
            let lost = usable().count().max(1).saturating_mul(window - 1);
            return Err(SysidError::TooShort {
                longest: lengths().max().unwrap_or(0),
                past,
                future,
                channels: m + p,
                needed: rows.saturating_add(lost),
                window,
            });
        }
        let records: Vec<_> = data.records.iter().map(channels).collect();
        let positions = positions(m, p, past, future);
        let (mut lower, report) = factor_windows(&records, window, &positions, ones, method);
        if ones == OnesRow::OnTop {
            let size = lower.nrows() - 1;
            lower = lower.submatrix(1, 1, size, size).to_owned();
        }
        let factor = Self {
            past,
            future,
            inputs: m,
            outputs: p,
            samples: usable().sum(),
            lower,
            report,
        };
        factor.check_excitation()?;
        Ok(factor)
    }

    /// The future inputs must excite in every direction: whatever they do not excite cannot be
    /// told from the state.
    fn check_excitation(&self) -> Result<(), SysidError> {
        let size = self.inputs * self.future;
        if size == 0 || leading_condition(self.lower.as_ref(), size) < 0.1 / RANK_TOLERANCE {
            return Ok(());
        }
        let block = self.future_inputs();
        let sigma = block.singular_values().map_err(|_| SysidError::Numerical {
            what: "the singular value decomposition of the future inputs",
            why: format!("no convergence for a {size}×{size} matrix"),
        })?;
        let (largest, smallest) = (sigma[0], sigma[size - 1]);
        let rank = sigma
            .iter()
            .filter(|&&s| s > RANK_TOLERANCE * largest)
            .count();
        if rank < size {
            return Err(SysidError::NotExciting {
                rank,
                needed: size,
                future: self.future,
                smallest: smallest / largest,
            });
        }
        Ok(())
    }

    /// How it was computed.
    pub fn report(&self) -> &FactorReport {
        &self.report
    }

    /// Rows before `Y_f`: `U_f`, `U_p`, `Y_p`.
    pub fn rows_before_outputs(&self) -> usize {
        self.inputs * self.future + (self.inputs + self.outputs) * self.past
    }

    /// `U_f` in its own coordinates: lower triangle, (M·f)².
    pub fn future_inputs(&self) -> MatRef<'_, f64> {
        let size = self.inputs * self.future;
        self.lower.submatrix(0, 0, size, size)
    }

    /// `col(U_p, Y_p)`: its coordinates along `U_f`, (M + p)past×M·f.
    pub fn past_along_inputs(&self) -> MatRef<'_, f64> {
        let (size, rows) = (
            self.inputs * self.future,
            (self.inputs + self.outputs) * self.past,
        );
        self.lower.submatrix(size, 0, rows, size)
    }

    /// `col(U_p, Y_p)`: what is orthogonal to `U_f`, a lower triangle.
    pub fn past_beside_inputs(&self) -> MatRef<'_, f64> {
        let (size, rows) = (
            self.inputs * self.future,
            (self.inputs + self.outputs) * self.past,
        );
        self.lower.submatrix(size, size, rows, rows)
    }

    /// `Y_f` in the coordinates of all rows, p·f×all.
    pub fn future_outputs(&self) -> MatRef<'_, f64> {
        let before = self.rows_before_outputs();
        self.lower.subrows(before, self.outputs * self.future)
    }
}

fn channels(record: &WorkingRecord) -> Vec<&[f64]> {
    let columns = |series: &'_ Mat<f64>| series.ncols();
    let inputs = (0..columns(&record.inputs)).map(|j| record.inputs.col_as_slice(j));
    let outputs = (0..columns(&record.outputs)).map(|j| record.outputs.col_as_slice(j));
    inputs.chain(outputs).collect()
}

/// Where each row of the time-major stack of all channels stands.
fn positions(m: usize, p: usize, past: usize, future: usize) -> Vec<usize> {
    let window = past + future;
    let mut positions = vec![0; window * (m + p)];
    for time in 0..window {
        for input in 0..m {
            let row = match time.checked_sub(past) {
                Some(ahead) => stacked_position(ahead, input, m),
                None => m * future + stacked_position(time, input, m),
            };
            positions[stacked_position(time, input, m + p)] = row;
        }
        for output in 0..p {
            positions[stacked_position(time, m + output, m + p)] =
                m * window + stacked_position(time, output, p);
        }
    }
    positions
}
