//! One wheel in front that is driven and steered, two behind that roll freely (theory section 1).

mod geometry;

pub use geometry::{Geometry, Steered};
