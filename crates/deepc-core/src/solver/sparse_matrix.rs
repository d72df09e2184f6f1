//! A sparse matrix in compressed-column form.

use super::error::SolverError;

/// A rows×columns matrix in compressed-column (CSC) form. Row numbers rise within a column.
#[derive(Debug, Clone, PartialEq)]
pub struct CscMatrix {
    rows: usize,
    columns: usize,
    column_starts: Vec<usize>,
    row_indices: Vec<usize>,
    values: Vec<f64>,
}

impl CscMatrix {
    /// From compressed columns: entries `column_starts[j]..column_starts[j + 1]` of
    /// `row_indices` and `values` are column j.
    ///
    /// # Errors
    /// Lengths do not fit, a row number is out of range, or rows do not rise within a column.
    pub fn new(
        rows: usize,
        columns: usize,
        column_starts: Vec<usize>,
        row_indices: Vec<usize>,
        values: Vec<f64>,
    ) -> Result<Self, SolverError> {
        let wrong = |problem| Err(SolverError::SparseStructure { problem });
        if column_starts.len() != columns + 1 || column_starts[0] != 0 {
            return wrong("column_starts must have columns + 1 entries and begin with 0");
        }
        if row_indices.len() != values.len() || column_starts[columns] != values.len() {
            return wrong("row_indices and values must have column_starts[columns] entries");
        }
        if column_starts.windows(2).any(|pair| pair[0] > pair[1]) {
            return wrong("column_starts must not fall");
        }
        for j in 0..columns {
            let indices = &row_indices[column_starts[j]..column_starts[j + 1]];
            if indices.windows(2).any(|pair| pair[0] >= pair[1]) {
                return wrong("row numbers must rise within a column");
            }
            if indices.last().is_some_and(|&last| last >= rows) {
                return wrong("a row number is out of range");
            }
        }
        Ok(Self {
            rows,
            columns,
            column_starts,
            row_indices,
            values,
        })
    }

    /// From `(row, column, value)` triplets in any order; triplets of one place are added.
    ///
    /// # Errors
    /// A row or column number is out of range.
    pub fn from_triplets(
        rows: usize,
        columns: usize,
        mut triplets: Vec<(usize, usize, f64)>,
    ) -> Result<Self, SolverError> {
        if triplets.iter().any(|&(i, j, _)| i >= rows || j >= columns) {
            return Err(SolverError::SparseStructure {
                problem: "a triplet's row or column number is out of range",
            });
        }
        triplets.sort_by_key(|&(i, j, _)| (j, i));
        let mut column_starts = vec![0; columns + 1];
        let mut row_indices: Vec<usize> = Vec::with_capacity(triplets.len());
        let mut values: Vec<f64> = Vec::with_capacity(triplets.len());
        let mut previous = None;
        for (i, j, value) in triplets {
            if previous == Some((i, j)) {
                let last = values.len() - 1;
                values[last] += value;
                continue;
            }
            previous = Some((i, j));
            row_indices.push(i);
            values.push(value);
            column_starts[j + 1] = values.len();
        }
        for j in 1..=columns {
            column_starts[j] = column_starts[j].max(column_starts[j - 1]);
        }
        Self::new(rows, columns, column_starts, row_indices, values)
    }

    /// Rows.
    #[must_use]
    pub fn nrows(&self) -> usize {
        self.rows
    }

    /// Columns.
    #[must_use]
    pub fn ncols(&self) -> usize {
        self.columns
    }

    /// The stored values, column by column.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Column starts, row numbers and values, as [`CscMatrix::new`] takes them.
    #[must_use]
    pub fn into_parts(self) -> (Vec<usize>, Vec<usize>, Vec<f64>) {
        (self.column_starts, self.row_indices, self.values)
    }

    /// `(row, value)` of the stored entries of one column, rows rising.
    pub fn column(&self, column: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.column_starts[column]..self.column_starts[column + 1];
        range.map(|k| (self.row_indices[k], self.values[k]))
    }

    /// `(row, column, value)` of all stored entries.
    pub fn triplets(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        (0..self.columns).flat_map(|j| self.column(j).map(move |(i, value)| (i, j, value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triplets_of_one_place_are_added_and_order_does_not_matter() {
        let triplets = vec![(1, 2, 5.0), (0, 0, 1.0), (1, 2, -2.0), (2, 0, 4.0)];
        let matrix = CscMatrix::from_triplets(3, 4, triplets).unwrap();
        let stored: Vec<_> = matrix.triplets().collect();
        assert_eq!(stored, [(0, 0, 1.0), (2, 0, 4.0), (1, 2, 3.0)]);
        assert_eq!(matrix.column(3).count(), 0);
    }

    #[test]
    fn a_triplet_out_of_range_is_refused() {
        assert!(CscMatrix::from_triplets(2, 2, vec![(2, 0, 1.0)]).is_err());
        assert!(CscMatrix::from_triplets(2, 2, vec![(0, 2, 1.0)]).is_err());
    }

    #[test]
    fn unsorted_rows_are_refused() {
        let matrix = CscMatrix::new(2, 1, vec![0, 2], vec![1, 0], vec![1.0, 2.0]);
        assert!(matrix.is_err());
    }
}
