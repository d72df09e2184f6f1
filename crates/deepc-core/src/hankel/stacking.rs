//! The stacking order, in one place.
//!
//! A time series w with c channels is stacked time-major: col(w(0), w(1), …), so that channel
//! `i` of time `k` stands at position k·c + i. Nothing else in this crate computes such a
//! position.

use faer::{Mat, MatMut, MatRef};

/// Position of channel `channel` at time `time` in a stacked vector of `channels` channels.
#[must_use]
pub fn stacked_position(time: usize, channel: usize, channels: usize) -> usize {
    time * channels + channel
}

/// Stacks a T×c series into `out` (T·c values).
///
/// # Panics
/// If `out` does not have T·c entries.
pub fn stack_into(series: MatRef<'_, f64>, out: &mut [f64]) {
    let channels = series.ncols();
    assert_eq!(
        out.len(),
        series.nrows() * channels,
        "length of the stacked vector"
    );
    for channel in 0..channels {
        for (time, value) in series.col(channel).iter().enumerate() {
            out[stacked_position(time, channel, channels)] = *value;
        }
    }
}

/// Stacks a T×c series.
#[must_use]
pub fn stack(series: MatRef<'_, f64>) -> Vec<f64> {
    let mut out = vec![0.0; series.nrows() * series.ncols()];
    stack_into(series, &mut out);
    out
}

/// Writes a stacked vector (T·c values) into a T×c series.
///
/// # Panics
/// If `stacked` does not have T·c entries.
pub fn unstack_into(stacked: &[f64], mut series: MatMut<'_, f64>) {
    let channels = series.ncols();
    assert_eq!(
        stacked.len(),
        series.nrows() * channels,
        "length of the stacked vector"
    );
    for channel in 0..channels {
        for (time, value) in series.as_mut().col_mut(channel).iter_mut().enumerate() {
            *value = stacked[stacked_position(time, channel, channels)];
        }
    }
}

/// Block Hankel matrix of depth `depth` of several series with the same c channels: (c·depth)×J,
/// column j is a stacked window of `depth` samples. Windows never cross from one series to the
/// next (a mosaic Hankel matrix; van Waarde, De Persis, Camlibel, Tesi 2020), so
/// J = Σ (Tᵢ − depth + 1) over the series with at least `depth` samples.
#[must_use]
pub fn block_hankel(series: &[MatRef<'_, f64>], depth: usize) -> Mat<f64> {
    let starts = series.iter().enumerate().flat_map(|(index, one)| {
        let count = windows(one.nrows(), depth);
        (0..count).map(move |start| (index, start))
    });
    window_columns(series, depth, &starts.collect::<Vec<_>>())
}

/// One column per window of `depth` samples: series number and first sample.
pub(super) fn window_columns(
    series: &[MatRef<'_, f64>],
    depth: usize,
    starts: &[(usize, usize)],
) -> Mat<f64> {
    let channels = series.first().map_or(0, |s| s.shape().1);
    let mut columns = Mat::zeros(channels * depth, starts.len());
    for (column, &(index, start)) in starts.iter().enumerate() {
        let window = series[index].subrows(start, depth);
        stack_into(window, columns.col_as_slice_mut(column));
    }
    columns
}

/// Windows of `depth` samples in a record of `samples` samples.
pub(crate) fn windows(samples: usize, depth: usize) -> usize {
    (samples + 1).saturating_sub(depth)
}

#[cfg(test)]
mod tests {
    use faer::mat;

    use super::*;

    #[test]
    fn stacking_puts_all_channels_of_a_time_together() {
        let series = mat![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
        assert_eq!(stack(series.as_ref()), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn unstacking_undoes_stacking() {
        let series = mat![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
        let mut back = Mat::zeros(2, 3);
        unstack_into(&stack(series.as_ref()), back.as_mut());
        assert_eq!(back, series);
    }

    #[test]
    fn hankel_columns_are_stacked_windows_of_two_channels() {
        let series = mat![[1.0, 10.0], [2.0, 20.0], [3.0, 30.0], [4.0, 40.0]];
        let hankel = block_hankel(&[series.as_ref()], 3);
        let expected = mat![
            [1.0, 2.0],
            [10.0, 20.0],
            [2.0, 3.0],
            [20.0, 30.0],
            [3.0, 4.0],
            [30.0, 40.0],
        ];
        assert_eq!(hankel, expected);
    }

    #[test]
    fn no_column_of_a_mosaic_crosses_a_record_boundary() {
        let first = mat![[1.0], [2.0], [3.0]];
        let second = mat![[7.0], [8.0]];
        let third = mat![[9.0]];
        let all = [first.as_ref(), second.as_ref(), third.as_ref()];
        let expected = mat![[1.0, 2.0, 7.0], [2.0, 3.0, 8.0]];
        assert_eq!(block_hankel(&all, 2), expected);
    }

    #[test]
    fn a_series_shorter_than_the_depth_has_no_window() {
        assert_eq!((windows(3, 5), windows(4, 5), windows(5, 5)), (0, 0, 1));
    }
}
