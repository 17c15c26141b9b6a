//! The shipped image of the firmware, unmodified, on an emulated board that drives the simulated plant.

mod base;
mod board;
mod debug_info;
mod flash;
mod knowledge;
mod line;
mod live_watch;
mod lockstep;
mod observer;
mod part;
mod strict;

pub use base::ImageBase;
pub use board::Bridge;
