//! What is known of the base: what it said of itself in the handshake, and what it says while it drives.

pub mod estimate;
pub mod handshake;
pub mod telemetry;

pub use estimate::Estimate;
pub use handshake::Handshake;
pub use ros_messages::base::knowledge::{Knowledge, Vehicle};
pub use telemetry::{Field, Telemetry};
