//! Truth for tests and benchmarks.
