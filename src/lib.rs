//! The standard vehicle controller.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod controller;
pub mod interpreter;
pub mod math;
pub mod params;
pub mod supervisor;
pub mod time;
pub mod vehicle;
