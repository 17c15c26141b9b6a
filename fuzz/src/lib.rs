//! Fuzz targets: what must hold whatever comes. `cargo xtask fuzz` runs them under libFuzzer; the tests run them over the kept corpus.
//!
//! Each target is a function of some bytes that panics if the library breaks a promise. Nothing lives on from one call to the next, so each failing
//! input fails alone.

pub mod base;
pub mod grammar;
pub mod interpreter;
pub mod invariant;
pub mod lines;
pub mod protocol;
pub mod replies;
pub mod tick;
