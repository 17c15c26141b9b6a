//! The shipped image of the firmware, unmodified, on an emulated board that drives the simulated plant.

mod base;
mod bench;
mod board;
mod count;
mod debug_info;
mod encoders;
mod fault;
mod flash;
mod knowledge;
mod line;
mod live_watch;
mod lockstep;
mod observer;
mod part;
mod program;
mod strict;
mod wiring;

pub use base::{ImageBase, Setup};
pub use bench::Outcome;
pub use board::Bridge;
pub use count::{Counts, PartCount};
pub use fault::Fault;
