//! Columns as the page carries them: fewer samples, 16 bits each, in base 64.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// How a column is thinned out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Thinning {
    /// Smallest and largest value of every two display intervals, in their order: no peak is lost.
    Peaks,
    /// The value at the display instant, a line between samples: smooth motion.
    Smooth,
}

/// The instants of the display.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Grid {
    /// Time of the first instant, s.
    pub(super) start_s: f64,
    /// Interval, s.
    pub(super) step_s: f64,
    /// Instants.
    pub(super) count: usize,
}

/// A column in the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Packed {
    /// Value of the code 0.
    low: f64,
    /// Value of the code 65534.
    high: f64,
    /// Little-endian 16-bit codes in base 64; 65535 is a gap.
    data: String,
}

const GAP: u16 = u16::MAX;
const LARGEST_CODE: f64 = 65534.0;
/// Samples farther apart than this many display intervals have a gap between them.
const BRIDGED_INTERVALS: f64 = 2.5;

impl Packed {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the code is in [0, 65534]"
    )]
    pub(super) fn of(values: &[f64]) -> Self {
        let known = values.iter().copied().filter(|v| v.is_finite());
        let (low, high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        let span = high - low;
        let code = |v: &f64| {
            if !v.is_finite() {
                GAP
            } else if span > 0.0 {
                ((v - low) / span * LARGEST_CODE).round() as u16
            } else {
                0
            }
        };
        let bytes: Vec<u8> = values.iter().map(code).flat_map(u16::to_le_bytes).collect();
        let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
        Self {
            low: finite(low),
            high: finite(high),
            data: STANDARD.encode(bytes),
        }
    }
}

impl Grid {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the start of the grid is not after any time"
    )]
    fn index(&self, time_s: f64) -> usize {
        // A time that is an instant of the grid but for rounding belongs to it.
        ((time_s - self.start_s) / self.step_s + 1e-6)
            .floor()
            .max(0.0) as usize
    }

    /// The grid from `start_s` to `end_s`.
    pub(super) fn over(start_s: f64, end_s: f64, step_s: f64) -> Self {
        let mut grid = Self {
            start_s,
            step_s,
            count: 0,
        };
        grid.count = grid.index(end_s) + 2;
        grid
    }

    /// The column on the grid.
    pub(super) fn sample(&self, time_s: &[f64], values: &[f64], thinning: Thinning) -> Vec<f64> {
        match thinning {
            Thinning::Peaks => self.peaks(time_s, values),
            Thinning::Smooth => self.smooth(time_s, values),
        }
    }

    fn peaks(&self, time_s: &[f64], values: &[f64]) -> Vec<f64> {
        let mut shown = vec![f64::NAN; self.count];
        let mut k = 0;
        while k < time_s.len() {
            let bin = self.index(time_s[k]) / 2;
            let begin = k;
            while k < time_s.len() && self.index(time_s[k]) / 2 == bin {
                k += 1;
            }
            let known = || (begin..k).filter(|&i| values[i].is_finite());
            let low = known().min_by(|&a, &b| values[a].total_cmp(&values[b]));
            let high = known().max_by(|&a, &b| values[a].total_cmp(&values[b]));
            if let (Some(low), Some(high)) = (low, high) {
                let (first, second) = (low.min(high), low.max(high));
                // A single sample keeps its place.
                if first == second && k - begin == 1 {
                    shown[self.index(time_s[first])] = values[first];
                } else {
                    shown[2 * bin] = values[first];
                    if let Some(place) = shown.get_mut(2 * bin + 1) {
                        *place = values[second];
                    }
                }
            }
        }
        self.bridge(time_s, values, &mut shown);
        shown
    }

    /// Draws lines over instants that no sample fell on, though there are some around: the log's
    /// clock and the display's are not the same.
    fn bridge(&self, time_s: &[f64], values: &[f64], shown: &mut [f64]) {
        let mut next = 0;
        for (index, place) in shown.iter_mut().enumerate() {
            let t = self.start_s + index as f64 * self.step_s;
            while next < time_s.len() && time_s[next] < t {
                next += 1;
            }
            if place.is_finite() || next == 0 || next == time_s.len() {
                continue;
            }
            let (before, after) = (next - 1, next);
            let span = time_s[after] - time_s[before];
            if span <= BRIDGED_INTERVALS * self.step_s {
                // Stays a gap if one of the two is.
                let share = (t - time_s[before]) / span;
                *place = values[before] + share * (values[after] - values[before]);
            }
        }
    }

    fn smooth(&self, time_s: &[f64], values: &[f64]) -> Vec<f64> {
        let mut shown = vec![f64::NAN; self.count];
        let (Some(&begin), Some(&end)) = (time_s.first(), time_s.last()) else {
            return shown;
        };
        let mut next = 0;
        for (index, value) in shown.iter_mut().enumerate() {
            let t = self.start_s + index as f64 * self.step_s;
            if t < begin - self.step_s || t > end + self.step_s {
                continue;
            }
            // The instants beside the ends show the ends.
            let t = t.clamp(begin, end);
            while next + 1 < time_s.len() && time_s[next + 1] <= t {
                next += 1;
            }
            let after = (next + 1).min(time_s.len() - 1);
            let span = time_s[after] - time_s[next];
            let share = if span > 0.0 {
                (t - time_s[next]) / span
            } else {
                0.0
            };
            if share > 1e-6 && span > BRIDGED_INTERVALS * self.step_s {
                // A hole in the log.
                continue;
            }
            *value = if share > 0.0 {
                values[next] + share * (values[after] - values[next])
            } else {
                values[next]
            };
        }
        shown
    }
}

/// A heading without the jumps where it is counted anew.
pub(super) fn unwrapped_deg(values: &[f64]) -> Vec<f64> {
    let mut turns = 0.0;
    let mut last = f64::NAN;
    let unwrap = |&v: &f64| {
        if v.is_finite() {
            if last.is_finite() {
                turns -= ((v - last) / 360.0).round();
            }
            last = v;
        }
        v + 360.0 * turns
    };
    values.iter().map(unwrap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn no_peak_is_lost() {
        let time: Vec<f64> = (1..=1000).map(|k| f64::from(k) / 100.0).collect();
        let mut values = vec![0.0; 1000];
        values[317] = 1.7;
        values[318] = -1.3;
        let grid = Grid::over(time[0], time[999], 0.1);
        let shown = grid.sample(&time, &values, Thinning::Peaks);
        assert!(shown.contains(&1.7) && shown.contains(&-1.3));
        assert!(shown.len() < 110);
    }

    #[test]
    fn at_the_rate_of_the_log_every_sample_keeps_its_place() {
        let time: Vec<f64> = (0..50).map(|k| 10.0 + f64::from(k) / 25.0).collect();
        let values: Vec<f64> = time.iter().map(|t| (t * 7.0).sin()).collect();
        let grid = Grid::over(time[0], time[49], 0.04);
        let smooth = grid.sample(&time, &values, Thinning::Smooth);
        for (shown, value) in smooth.iter().zip(&values) {
            assert!((shown - value).abs() < 1e-6);
        }
    }

    #[test]
    fn clocks_that_differ_leave_no_gaps() {
        let time: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.0437).collect();
        let grid = Grid::over(time[0], time[199], 0.0437 * 0.98);
        let shown = grid.sample(&time, &time, Thinning::Peaks);
        let inside = &shown[..grid.count - 2];
        assert!(inside.iter().all(|v| v.is_finite()), "{shown:?}");
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let time: Vec<f64> = (0..100).map(f64::from).collect();
        let mut values = vec![2.0; 100];
        values[40..60].fill(f64::NAN);
        let grid = Grid::over(0.0, 99.0, 1.0);
        for thinning in [Thinning::Peaks, Thinning::Smooth] {
            let shown = grid.sample(&time, &values, thinning);
            assert!(shown[45].is_nan() && shown[30].is_finite(), "{thinning:?}");
        }
        let packed = Packed::of(&values);
        let codes = STANDARD.decode(packed.data).expect("it is base 64");
        assert_eq!(codes[100..102], [255, 255]);
        assert_eq!(codes[..2], [0, 0]);
    }

    #[test]
    fn a_heading_that_is_counted_anew_turns_on() {
        let shown = unwrapped_deg(&[170.0, 179.0, -179.0, -170.0, f64::NAN, 179.0]);
        let expected = [170.0, 179.0, 181.0, 190.0];
        assert_eq!(bits(&shown[..4]), bits(&expected));
        assert!(shown[4].is_nan());
        assert_eq!(bits(&shown[5..]), bits(&[179.0]));
    }
}
