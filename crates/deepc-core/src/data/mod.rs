//! Stage 1: recorded data, checked once at the door.
//!
//! A [`Dataset`] is one clock, named input and output channels, and one or more [`Record`]s.
//! Every value in it is finite, every record has the same channels and at least one sample;
//! later stages rely on that and do not check again.

mod csv_file;
mod dataset;
mod error;

pub use csv_file::{CsvLayout, OutputTiming};
pub use dataset::{Dataset, Record};
pub use error::{DataError, SamplePlace};
