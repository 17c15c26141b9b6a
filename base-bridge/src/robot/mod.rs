//! What is known of the base: what it said of itself in the handshake, and what it says while it drives.

pub mod handshake;
pub mod knowledge;
pub mod telemetry;

pub use handshake::Handshake;
pub use knowledge::{Estimate, Knowledge, Vehicle};
pub use telemetry::{Field, Telemetry};
