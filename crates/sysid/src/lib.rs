//! Subspace identification and the linear MPC baseline.
//!
//! Nothing is here yet. The crate holds the place of the model-based road beside `deepc-core`, on
//! whose data types, quadratic programs and controller trait it will stand.
