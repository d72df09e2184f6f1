//! Conversions at the border: inside the crate everything is SI (rad, m, s, kg, N).

/// One kilometre per hour in m/s.
pub const KMH: f64 = 1.0 / 3.6;

/// One mile per hour in m/s.
pub const MPH: f64 = 0.447_04;

/// One degree in rad.
pub const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Standard gravity of the paper's load transfer ratio, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// The angle in rad moved by whole turns into (−π, π].
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    // Odd in its argument, so that a mirrored run stays bit-exactly mirrored.
    angle_rad - turn * (angle_rad / turn).round()
}
