//! What a steering machine does: handwheel angle over time.
//!
//! Angles are magnitudes in deg with the first turn positive; the caller gives the sign of the
//! direction. Times count from the start of steering.

/// Ramp to an angle, hold, and ramp back to zero: J-turn and step steer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampHoldReturn {
    /// Angle held, deg.
    pub amplitude_deg: f64,
    /// Rate of the first ramp, deg/s.
    pub rate_deg_per_s: f64,
    /// Time at the angle, s.
    pub hold_s: f64,
    /// Time of the ramp back, s.
    pub return_s: f64,
}

impl RampHoldReturn {
    /// Angle at `time_s` after the start of steering, deg.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        let ramp_s = self.amplitude_deg / self.rate_deg_per_s;
        let back_s = time_s - ramp_s - self.hold_s;
        if time_s <= ramp_s {
            self.rate_deg_per_s * time_s.max(0.0)
        } else if back_s <= 0.0 {
            self.amplitude_deg
        } else {
            self.amplitude_deg * (1.0 - back_s / self.return_s).max(0.0)
        }
    }

    /// When the steering is back at zero, s.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.amplitude_deg / self.rate_deg_per_s + self.hold_s + self.return_s
    }
}

/// One period of a sine with a dwell at its second peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SineWithDwell {
    /// Amplitude, deg.
    pub amplitude_deg: f64,
    /// Frequency of the sine, Hz.
    pub frequency_hz: f64,
    /// Time at the second peak, s.
    pub dwell_s: f64,
}

impl SineWithDwell {
    /// Angle at `time_s` after the start of steering, deg.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        let peak_s = 0.75 / self.frequency_hz;
        if time_s <= 0.0 || time_s >= self.end_s() {
            return 0.0;
        }
        let moving_s = if time_s <= peak_s {
            time_s
        } else {
            (time_s - self.dwell_s).max(peak_s)
        };
        self.amplitude_deg * (std::f64::consts::TAU * self.frequency_hz * moving_s).sin()
    }

    /// When the dwell ends, s.
    #[must_use]
    pub fn dwell_end_s(&self) -> f64 {
        0.75 / self.frequency_hz + self.dwell_s
    }

    /// When the steering is complete, s.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        1.0 / self.frequency_hz + self.dwell_s
    }
}

/// The fishhook from the start of its reversal: to the other side, hold, back to zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FishhookShape {
    /// Angle of both turns, deg.
    pub amplitude_deg: f64,
    /// Rate of both turns, deg/s.
    pub rate_deg_per_s: f64,
    /// Time at the second angle, s.
    pub hold_s: f64,
    /// Time of the ramp back to zero, s.
    pub return_s: f64,
}

impl FishhookShape {
    /// Angle at `time_s` after the start of steering, deg, when the reversal began at `reversal_s`
    /// (`None` before it).
    #[must_use]
    pub fn at(&self, time_s: f64, reversal_s: Option<f64>) -> f64 {
        let first = (self.rate_deg_per_s * time_s.max(0.0)).min(self.amplitude_deg);
        let Some(reversal_s) = reversal_s.filter(|start| time_s > *start) else {
            return first;
        };
        let since_s = time_s - reversal_s;
        let back_s = since_s - self.reversal_ramp_s() - self.hold_s;
        if back_s > 0.0 {
            -self.amplitude_deg * (1.0 - back_s / self.return_s).max(0.0)
        } else {
            (self.amplitude_deg - self.rate_deg_per_s * since_s).max(-self.amplitude_deg)
        }
    }

    /// Time of the first turn, s.
    #[must_use]
    pub fn first_ramp_s(&self) -> f64 {
        self.amplitude_deg / self.rate_deg_per_s
    }

    /// Time of the turn to the other side, s.
    #[must_use]
    pub fn reversal_ramp_s(&self) -> f64 {
        2.0 * self.amplitude_deg / self.rate_deg_per_s
    }

    /// When the steering is back at zero, s, for a reversal that began at `reversal_s`.
    #[must_use]
    pub fn end_s(&self, reversal_s: f64) -> f64 {
        reversal_s + self.reversal_ramp_s() + self.hold_s + self.return_s
    }
}
