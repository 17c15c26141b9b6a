//! The ROS 2 messages of a mobile base, as the distributions from Humble to Jazzy have them: plain structs in the order of their fields, whose bytes on a
//! network or in a log are CDR. No ROS installation is needed, to build or to run.
//!
//! Lengths are metres, angles radians, times seconds and nanoseconds, as REP 103 has it.

#[macro_use]
mod message;
pub mod base;
mod cdr;
pub mod diagnostic_msgs;
pub mod geometry_msgs;
#[cfg(feature = "mcap")]
pub mod log;
pub mod nav_msgs;
mod schema;
pub mod sensor_msgs;
pub mod services;
pub mod std_msgs;
pub mod tf2_msgs;

pub use cdr::{CdrError, from_cdr, to_cdr};
pub use message::RosMessage;
pub use schema::schema;
