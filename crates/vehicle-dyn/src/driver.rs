//! The driver: a preview path follower that sees the road ahead and the measured state.
//!
//! Each tick the driver looks `preview_time_s` ahead along the vehicle's heading, and turns the
//! handwheel in proportion to how far the course lies beside that point, and to how fast the
//! vehicle drifts away from the course. It stands for the paper's Simple Driver Model.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::road::{Course, Location};
use crate::simulation::Observation;
use crate::units::wrap_angle;

/// Parameters of the driver. All are the driver's, none the vehicle's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriverParameters {
    /// How far ahead the driver looks, s.
    pub preview_time_s: f64,
    /// Handwheel per offset of the course from the preview point, deg/m.
    pub preview_gain_deg_per_m: f64,
    /// Handwheel per speed of drifting from the course, deg·s/m.
    pub error_rate_gain_deg_s_per_m: f64,
    /// Growth of the handwheel per offset of the vehicle from the course, deg/(m·s); 0 is none.
    pub integral_gain_deg_per_m_s: f64,
    /// Time constant of the driver's arms, s.
    pub lag_s: f64,
    /// Largest handwheel angle, deg.
    pub handwheel_limit_deg: f64,
    /// Largest handwheel rate, deg/s.
    pub handwheel_rate_limit_deg_per_s: f64,
}

/// A driver parameter out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("driver.{field} = {value}: must be in {range}")]
pub struct DriverError {
    /// Field of [`DriverParameters`].
    pub field: &'static str,
    /// Value found.
    pub value: f64,
    /// Allowed interval with its unit.
    pub range: &'static str,
}

impl DriverParameters {
    /// Field, least and largest value, and the same as text with the unit.
    pub(crate) const RANGES: [(&'static str, f64, f64, &'static str); 7] = [
        ("preview_time_s", 0.05, 10.0, "[0.05, 10] s"),
        ("preview_gain_deg_per_m", 0.0, 1e4, "[0, 1e4] deg/m"),
        ("error_rate_gain_deg_s_per_m", 0.0, 1e3, "[0, 1e3] deg s/m"),
        ("integral_gain_deg_per_m_s", 0.0, 1e3, "[0, 1e3] deg/(m s)"),
        ("lag_s", 0.0, 2.0, "[0, 2] s"),
        ("handwheel_limit_deg", 1.0, 2e3, "[1, 2e3] deg"),
        ("handwheel_rate_limit_deg_per_s", 1.0, 1e4, "[1, 1e4] deg/s"),
    ];

    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`DriverError`] with field, number and range.
    pub fn check(&self) -> Result<(), DriverError> {
        let values = [
            self.preview_time_s,
            self.preview_gain_deg_per_m,
            self.error_rate_gain_deg_s_per_m,
            self.integral_gain_deg_per_m_s,
            self.lag_s,
            self.handwheel_limit_deg,
            self.handwheel_rate_limit_deg_per_s,
        ];
        for ((field, low, high, range), value) in Self::RANGES.into_iter().zip(values) {
            if !(value >= low && value <= high) {
                return Err(DriverError {
                    field,
                    value,
                    range,
                });
            }
        }
        Ok(())
    }
}

/// What the driver decided in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriverAction {
    /// Handwheel angle, positive to the left, deg.
    pub handwheel_deg: f64,
    /// Where the vehicle is on the course.
    pub location: Location,
}

/// A driver with the state of arms and memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Driver {
    parameters: DriverParameters,
    handwheel_deg: f64,
    integral_deg: f64,
    station_m: Option<f64>,
    overridden: bool,
}

impl Driver {
    /// A driver with straight handwheel.
    ///
    /// # Errors
    /// [`DriverError`] when a parameter is out of range.
    pub fn new(parameters: &DriverParameters) -> Result<Self, DriverError> {
        parameters.check()?;
        Ok(Self {
            parameters: *parameters,
            handwheel_deg: 0.0,
            integral_deg: 0.0,
            station_m: None,
            overridden: false,
        })
    }

    /// The handwheel angle for the next tick of `tick_s` from what is measured now.
    pub fn step(&mut self, course: &Course, measured: &Observation, tick_s: f64) -> DriverAction {
        let parameters = &self.parameters;
        let location = course.locate(measured.x_m, measured.y_m, self.station_m);
        self.station_m = Some(location.station_m);
        let preview_m = measured.speed_m_s.max(0.0) * parameters.preview_time_s;
        let (sin, cos) = measured.yaw_rad.sin_cos();
        let ahead = course.locate(
            measured.x_m + preview_m * cos,
            measured.y_m + preview_m * sin,
            Some(location.station_m + preview_m),
        );
        let travel_direction = measured.yaw_rad + measured.sideslip_rad - location.heading_rad;
        let speed = measured.speed_m_s.hypot(measured.lateral_speed_m_s);
        let drift_m_s = speed * wrap_angle(travel_direction).sin();

        // While another hand holds the wheel, the driver's memory must not wind up.
        if !self.overridden {
            self.integral_deg -=
                parameters.integral_gain_deg_per_m_s * location.lateral_offset_m * tick_s;
        }
        let limit = parameters.handwheel_limit_deg;
        self.integral_deg = self.integral_deg.clamp(-limit, limit);
        let wanted = -parameters.preview_gain_deg_per_m * ahead.lateral_offset_m
            - parameters.error_rate_gain_deg_s_per_m * drift_m_s
            + self.integral_deg;
        let wanted = wanted.clamp(-limit, limit);
        // Exact for a constant target over the tick; a lag of 0 follows at once.
        let share = if parameters.lag_s > 0.0 {
            -(-tick_s / parameters.lag_s).exp_m1()
        } else {
            1.0
        };
        let largest = parameters.handwheel_rate_limit_deg_per_s * tick_s;
        let change = (share * (wanted - self.handwheel_deg)).clamp(-largest, largest);
        self.handwheel_deg += change;
        DriverAction {
            handwheel_deg: self.handwheel_deg,
            location,
        }
    }

    /// Tells the driver which handwheel angle was applied. When it is not the driver's own by more
    /// than `tolerance_deg`, the integral rests until the driver is back in charge.
    pub fn notify_applied(&mut self, applied_deg: f64, tolerance_deg: f64) {
        self.overridden = (applied_deg - self.handwheel_deg).abs() > tolerance_deg;
    }
}
