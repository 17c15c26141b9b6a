//! The state of a base, as messages: whoever has a base to tell of, real or simulated, tells the same of it.
//!
//! ```text
//! knowledge, readings ─▶ frames, covariance, joints ─▶ report ─▶ messages ─▶ a network, a log
//! ```

pub mod covariance;
pub mod frames;
pub mod joints;
pub mod knowledge;
pub mod messages;
pub mod names;
#[cfg(feature = "mcap")]
pub mod recorder;
pub mod report;

pub use messages::{Message, footprint, messages};
pub use names::{Names, Topics};
pub use report::{Level, Motion, Report, Status};
