//! How far back and ahead the subspace methods look.

use crate::error::SysidError;
use crate::working::{WorkingData, WorkingRecord};

/// Block rows s tried. At 100 Hz modes of 1 Hz need s·Ts of half a period, and short horizons are the
/// better ones for fast plants: neither is known before.
const LADDER: [usize; 6] = [10, 20, 40, 80, 160, 320];

/// Columns of a Hankel matrix for every row of it, so that the noise is averaged.
const COLUMNS_PER_ROW: f64 = 1.5;

/// Rows of a Hankel matrix whose factor still takes well below a second.
const MOST_ROWS: usize = 1000;

/// The ladder as far as the recording is long enough, or the horizons given.
pub(super) fn horizons(
    data: &WorkingData,
    given: Option<&[usize]>,
) -> Result<Vec<usize>, SysidError> {
    if let Some(given) = given {
        return Ok(given.to_vec());
    }
    let channels = data.inputs.len() + data.outputs.len();
    let fits = |s: usize| {
        let rows = 2 * s * channels;
        let columns: usize = (data.records.iter())
            .map(|record| (record.samples() + 1).saturating_sub(2 * s))
            .sum();
        rows <= MOST_ROWS && columns as f64 >= COLUMNS_PER_ROW * rows as f64
    };
    // Short records: from the shortest horizon that says anything.
    let short = [3, 5, 7];
    let ladder: Vec<_> = LADDER.into_iter().filter(|&s| fits(s)).collect();
    let found = if ladder.is_empty() {
        short.into_iter().filter(|&s| fits(s)).collect()
    } else {
        ladder
    };
    if found.is_empty() {
        let s = short[0];
        let longest = data.records.iter().map(WorkingRecord::samples).max();
        return Err(SysidError::TooShort {
            longest: longest.unwrap_or(0),
            past: s,
            future: s,
            channels,
            needed: 2 * s - 1 + 3 * s * channels,
            window: 2 * s,
        });
    }
    Ok(found)
}
