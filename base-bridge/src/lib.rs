//! Joins a base to a ROS 2 network, without ROS: its lines to messages, and back.
//!
//! ```text
//! line ─▶ client ─▶ robot ─▶ clock, frames ─▶ convert ─▶ network
//!      ◀─        ◀─ commands ◀─────────────────────────◀─
//! ```
//! All but `line` and `network` is without threads, clocks and ports; `app` puts it together, in one loop.

pub mod app;
pub mod client;
pub mod clock;
pub mod commands;
pub mod convert;
#[cfg(feature = "dds")]
pub mod dds;
pub mod frames;
pub mod line;
pub mod log;
pub mod names;
pub mod network;
pub mod params;
pub mod robot;
pub mod time;
