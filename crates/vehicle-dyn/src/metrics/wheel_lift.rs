//! Both wheels of one side off the ground.

/// Height of both wheels of a side at which NHTSA's dynamic rollover test counts a two-wheel lift:
/// two inches, m.
pub const NHTSA_TWO_WHEEL_LIFT_M: f64 = 0.0508;

/// Whether both wheels of one side carry nothing; loads front left, front right, rear left, rear
/// right in N.
#[must_use]
pub fn two_wheels_unloaded(loads_n: &[f64; 4]) -> bool {
    let [front_left, front_right, rear_left, rear_right] = loads_n.map(|load| load <= 0.0);
    (front_left && rear_left) || (front_right && rear_right)
}

/// How high both wheels of a side are off the ground at least, m: the smaller gap of the two, of the
/// side where it is larger; 0 as long as each side has a wheel on the ground. Gaps in the order
/// front left, front right, rear left, rear right.
#[must_use]
pub fn two_wheel_clearance_m(clearance_m: &[f64; 4]) -> f64 {
    let [front_left, front_right, rear_left, rear_right] = *clearance_m;
    front_left.min(rear_left).max(front_right.min(rear_right))
}
