//! The receding-horizon controller.

#[path = "../common/mod.rs"]
mod common;

mod closed_loop;
mod disturbances;
mod faults;
mod overridden;
mod plants;
mod policy;
mod rates;
mod statistics;
mod switching;
