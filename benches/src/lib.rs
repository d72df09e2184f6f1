//! Benchmarks live in this package's `benches/` folder; the package itself is empty.
