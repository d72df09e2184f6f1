//! An independent multi-body model as the judge of `vehicle-dyn`: its parameter sets, its
//! trajectories, and our vehicle driven through them.

pub mod drive;
pub mod parameters;
pub mod trajectory;
