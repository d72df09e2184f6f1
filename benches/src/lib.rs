//! What the benchmarks share: a plant, the problems posed on it, the moments replayed, and the
//! back ends that solve them. Everything is deterministic.
//!
//! The criterion benches in `benches/` watch single numbers while one works on the code; the
//! program `performance` measures the comparison in `docs/performance.md`.

pub mod backend;
pub mod case;
pub mod output;
pub mod plant;
pub mod reference;
pub mod replay;
pub mod synthetic;
pub mod validation;
