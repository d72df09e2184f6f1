//! Everything that needs no process of its own, in one binary: each one compiles the linear algebra
//! it uses anew, for 15 to 30 s. `cargo test -p deepc-core --test suite bad_input` runs one file.

#[path = "../common/mod.rs"]
mod common;
mod formulations_support;

mod arrangements;
mod assessment;
mod assessment_order;
mod assessment_output_predictor;
mod assessment_tuning;
mod bad_input;
mod csv_rows;
mod disturbances;
mod examples_data;
mod formulations_edges;
mod formulations_forms;
mod formulations_gain;
mod formulations_methods;
mod formulations_numbers;
mod fundamental_lemma;
mod hard_and_soft_slack;
mod long_recordings;
mod online;
mod paper_size;
mod reference_optima;
mod window_factor;
