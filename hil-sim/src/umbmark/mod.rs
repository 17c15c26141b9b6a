//! The bidirectional square path experiment of J. Borenstein and L. Feng ("Measurement and correction of systematic odometry errors in mobile robots",
//! 1996), on a simulated base: the classical way to calibrate a differential drive, to hold the filter against.

mod closed_form;
mod squares;

pub use closed_form::{ClosedForm, Directions};
pub use squares::{Squares, drive};
