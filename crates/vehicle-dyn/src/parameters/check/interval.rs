//! Allowed intervals of one value.

/// An allowed interval; its upper end belongs to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Whether the lower end is allowed.
    pub low_belongs: bool,
    /// Upper end, allowed.
    pub high: f64,
}

/// `low < value ≤ high`.
pub(super) const fn above(low: f64, high: f64) -> Interval {
    Interval {
        low,
        low_belongs: false,
        high,
    }
}

/// `low ≤ value ≤ high`.
pub(super) const fn within(low: f64, high: f64) -> Interval {
    Interval {
        low,
        low_belongs: true,
        high,
    }
}

impl Interval {
    /// Whether a value is allowed; NaN is in no interval.
    #[must_use]
    pub fn contains(self, value: f64) -> bool {
        value <= self.high && (value > self.low || (self.low_belongs && value >= self.low))
    }
}

impl std::fmt::Display for Interval {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bracket = if self.low_belongs { '[' } else { '(' };
        write!(
            formatter,
            "{bracket}{}, {}]",
            short(self.low),
            short(self.high)
        )
    }
}

/// `1e5` instead of `100000`, but `0.5` as it is.
fn short(value: f64) -> String {
    if value.abs() >= 1e4 {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}
