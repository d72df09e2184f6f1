//! Tests that span crates live in this package's `tests/` folder; the package itself is empty.
