//! Everything that takes little time and needs no process of its own, in one binary: each one
//! compiles the linear algebra it uses anew. `cargo test -p sysid --test suite validation` runs one
//! file.

#[path = "../common/mod.rs"]
mod common;
#[path = "../subspace_support/mod.rs"]
mod subspace_support;

mod figures;
mod state_space;
mod state_space_analysis;
mod state_space_file;
mod subspace_exact;
mod subspace_reference;
mod subspace_second;
mod validation;
mod validation_reference;
