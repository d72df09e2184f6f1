//! The linear MPC: the same inputs as other roads to them, the contract, faults, offsets.

mod contract;
mod exactness;
mod offsets;
mod plants;
mod textbook;
