//! Stage 1: recorded data, checked once at the door.
//!
//! A [`Dataset`] is one clock, named channels (inputs, measured disturbances, outputs) and one or
//! more [`Record`]s. Every value in it is finite, every record has the same channels and at least
//! one sample; later stages rely on that and do not check again.

mod csv_file;
mod dataset;
mod error;

pub use csv_file::{CsvLayout, OutputTiming};
pub use dataset::{Dataset, Record};
pub use error::{DataError, SamplePlace};

/// Whether two sample times are the same. They are typed in, not measured: only rounding may
/// separate equal ones.
pub(crate) fn same_sample_time(a_s: f64, b_s: f64) -> bool {
    (a_s - b_s).abs() <= 1e-9 * a_s
}
