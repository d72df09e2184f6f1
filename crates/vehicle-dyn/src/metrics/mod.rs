//! Rollover measures, the outcome of a run, and its peaks.
//!
//! | measure | from | saturates at lift-off |
//! |---|---|---|
//! | [`load_transfer_ratio`] | wheel loads | no: beyond ±1 in dynamic lift and on landing |
//! | [`load_transfer_of_sum`] | wheel loads | yes, at ±1 |
//! | [`QuasiStaticTransfer`] | lateral acceleration | no, but the acceleration does |
//! | [`LoadTransferIndex`] | roll angle, roll rate, lateral acceleration | no |
//! | [`two_wheel_clearance_m`] | gaps under the wheels | begins there |
//! | [`time_to_rollover`] | a simulation into the future | ends there |
//! | [`TimeToLift`], [`time_to_roll_angle_s`] | one of the above and its rate | ends there |
//!
//! `docs/rollover-measures.md` has formulas, ranges, and when to use which. Every measure but
//! [`time_to_rollover`] is a few products per tick and allocates nothing.

mod load_transfer;
mod outcome;
mod run_measures;
mod time_to_rollover;
mod wheel_lift;

pub use load_transfer::{
    LoadTransferIndex, QuasiStaticTransfer, load_transfer_of_sum, load_transfer_ratio,
};
pub use outcome::{
    Outcome, OutcomeMonitor, OutcomeRules, OutcomeRulesError, ROLLOVER_ROLL_RAD,
    SPIN_LEAST_SPEED_M_S, SPIN_SIDESLIP_RAD,
};
pub use run_measures::{RunMeasures, RunRecorder, RunSample};
pub use time_to_rollover::{TimeToLift, TimeToRollover, time_to_roll_angle_s, time_to_rollover};
pub use wheel_lift::{NHTSA_TWO_WHEEL_LIFT_M, two_wheel_clearance_m, two_wheels_unloaded};
