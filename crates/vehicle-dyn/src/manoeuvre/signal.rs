//! Figures of a signal over time, for traces of any origin.
//!
//! A signal is a slice of (time in s, value), times rising. Between samples it is taken as
//! straight.

use nalgebra::{SMatrix, SVector};

/// A straight line through points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Rise per unit of x.
    pub slope: f64,
    /// Value at x = 0.
    pub intercept: f64,
    /// Points it was fitted to.
    pub points: usize,
}

impl Line {
    /// Value at `x`.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        self.intercept + self.slope * x
    }
}

/// Least-squares line through `(x, y)`; `None` for fewer than two different x.
#[must_use]
pub fn linear_fit(points: &[(f64, f64)]) -> Option<Line> {
    let count = points.len() as f64;
    if points.len() < 2 {
        return None;
    }
    let mean_x = points.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_y = points.iter().map(|p| p.1).sum::<f64>() / count;
    let (mut xx, mut xy, mut largest) = (0.0, 0.0, 0.0_f64);
    for (x, y) in points {
        xx += (x - mean_x) * (x - mean_x);
        xy += (x - mean_x) * (y - mean_y);
        largest = largest.max(x.abs());
    }
    // What is left of equal x is rounding.
    if xx <= count * (largest * 1e-12).powi(2) {
        return None;
    }
    let slope = xy / xx;
    Some(Line {
        slope,
        intercept: mean_y - slope * mean_x,
        points: points.len(),
    })
}

/// The signal's value at `time_s`; `None` outside of its samples.
#[must_use]
pub fn value_at(signal: &[(f64, f64)], time_s: f64) -> Option<f64> {
    let after = signal.partition_point(|sample| sample.0 < time_s);
    let next = signal.get(after)?;
    if next.0 <= time_s {
        return Some(next.1);
    }
    let last = signal.get(after.checked_sub(1)?)?;
    let share = (time_s - last.0) / (next.0 - last.0);
    Some(last.1 + share * (next.1 - last.1))
}

/// When the signal first reaches `level` from below, at or after `from_s`; `None` if it never does.
#[must_use]
pub fn first_reach(signal: &[(f64, f64)], level: f64, from_s: f64) -> Option<f64> {
    let begin = signal.partition_point(|sample| sample.0 < from_s);
    let first = signal.get(begin)?;
    if first.1 >= level {
        // The rise may lie in the interval that `from_s` is in.
        let before = begin.checked_sub(1).and_then(|index| signal.get(index));
        return Some(match before {
            Some(last) if last.1 < level => crossing(last, first, level).max(from_s),
            _ => from_s.max(first.0),
        });
    }
    signal[begin..]
        .windows(2)
        .find(|pair| pair[0].1 < level && pair[1].1 >= level)
        .map(|pair| crossing(&pair[0], &pair[1], level))
}

fn crossing(last: &(f64, f64), next: &(f64, f64), level: f64) -> f64 {
    last.0 + (level - last.1) / (next.1 - last.1) * (next.0 - last.0)
}

/// Mean of the samples in `[from_s, to_s]`; `None` if there are none.
#[must_use]
pub fn mean(signal: &[(f64, f64)], from_s: f64, to_s: f64) -> Option<f64> {
    let inside = signal
        .iter()
        .filter(|sample| sample.0 >= from_s && sample.0 <= to_s);
    let (count, sum) = inside.fold((0_usize, 0.0), |(count, sum), sample| {
        (count + 1, sum + sample.1)
    });
    (count > 0).then(|| sum / count as f64)
}

/// The answer of a signal to a step of its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepResponse {
    /// Value it settles at.
    pub steady: f64,
    /// From the step to 90 % of the steady value, s; `None` if it never gets there.
    pub response_time_s: Option<f64>,
    /// From the step to the largest value, s; `None` if that is the last sample, so that the
    /// signal may go on rising.
    pub peak_time_s: Option<f64>,
    /// By how much the largest value exceeds the steady one, in parts of it; zero for a signal
    /// that does not overshoot.
    pub overshoot: Option<f64>,
}

/// Figures of a step response from zero: `step_s` is the time of the step, `steady` the value in
/// the end. `None` when that is zero, so that there is nothing to compare with.
#[must_use]
pub fn step_response(signal: &[(f64, f64)], step_s: f64, steady: f64) -> Option<StepResponse> {
    if steady == 0.0 || !steady.is_finite() {
        return None;
    }
    let relative: Vec<(f64, f64)> = signal.iter().map(|s| (s.0, s.1 / steady)).collect();
    let after = relative.iter().filter(|sample| sample.0 >= step_s);
    let peak = after.fold(None, |best: Option<&(f64, f64)>, sample| match best {
        Some(best) if best.1 >= sample.1 => Some(best),
        _ => Some(sample),
    });
    let last = relative.last().map(|sample| sample.0);
    Some(StepResponse {
        steady,
        response_time_s: first_reach(&relative, 0.9, step_s).map(|time| time - step_s),
        peak_time_s: peak
            .filter(|peak| Some(peak.0) != last)
            .map(|peak| peak.0 - step_s),
        overshoot: peak.map(|peak| (peak.1 - 1.0).max(0.0)),
    })
}

/// The first local maximum after `from_s` that is above zero and that nothing within `guard_s`
/// around it exceeds: `(time, value)`.
#[must_use]
pub fn first_peak(signal: &[(f64, f64)], from_s: f64, guard_s: f64) -> Option<(f64, f64)> {
    let begin = signal.partition_point(|sample| sample.0 <= from_s);
    let end = signal.last()?.0;
    signal[begin..].iter().copied().find(|&(time, value)| {
        let low = signal.partition_point(|sample| sample.0 < time - guard_s);
        let high = signal.partition_point(|sample| sample.0 <= time + guard_s);
        value > 0.0
            && time + guard_s <= end
            && signal[low..high].iter().all(|sample| sample.1 <= value)
    })
}

/// Integral of the integral of the signal from `from_s`, where both are zero, to `to_s`; `None`
/// when the signal does not cover that time.
#[must_use]
pub fn double_integral(signal: &[(f64, f64)], from_s: f64, to_s: f64) -> Option<f64> {
    let mut last = (from_s, value_at(signal, from_s)?);
    let end = (to_s, value_at(signal, to_s)?);
    let inside = signal
        .iter()
        .copied()
        .filter(|sample| sample.0 > from_s && sample.0 < to_s);
    let (mut rate, mut total) = (0.0, 0.0);
    for next in inside.chain(std::iter::once(end)) {
        let step = next.0 - last.0;
        // Exact for a straight line between the samples.
        total += step * rate + step * step * (2.0 * last.1 + next.1) / 6.0;
        rate += 0.5 * step * (last.1 + next.1);
        last = next;
    }
    Some(total)
}

/// A sine of known frequency in a signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SineFit {
    /// Amplitude, in the signal's unit.
    pub amplitude: f64,
    /// Phase against `sin(2π f t)` of the signal's own time, in (−π, π], rad.
    pub phase_rad: f64,
}

/// Least-squares fit of a sine of frequency `frequency_hz` on a mean and a drift to the samples in
/// `[from_s, to_s]`; `None` for fewer than five samples or a frequency they cannot tell.
#[must_use]
pub fn sine_fit(
    signal: &[(f64, f64)],
    frequency_hz: f64,
    from_s: f64,
    to_s: f64,
) -> Option<SineFit> {
    let mut normal = SMatrix::<f64, 4, 4>::zeros();
    let mut right = SVector::<f64, 4>::zeros();
    let mut count = 0_usize;
    for (time, value) in signal.iter().filter(|s| s.0 >= from_s && s.0 <= to_s) {
        let (sin, cos) = (std::f64::consts::TAU * frequency_hz * time).sin_cos();
        let row = SVector::<f64, 4>::new(sin, cos, 1.0, time - from_s);
        normal += row * row.transpose();
        right += row * *value;
        count += 1;
    }
    if count < 5 {
        return None;
    }
    let found = normal.cholesky()?.solve(&right);
    found
        .iter()
        .all(|value| value.is_finite())
        .then(|| SineFit {
            amplitude: found[0].hypot(found[1]),
            phase_rad: found[1].atan2(found[0]),
        })
}
