//! Joins a base to a ROS 2 network, without ROS: its lines to messages, and back.
//!
//! ```text
//! line ─▶ client ─▶ robot ─▶ clock ─▶ ros_messages::base ─▶ network
//!      ◀─        ◀─ commands ◀─────────────────── asked ◀─
//! ```
//! All but `line` and `network` is without threads, clocks and ports; `app` puts it together, in one loop.

pub mod app;
pub mod aside;
pub mod asked;
pub mod client;
pub mod clock;
pub mod commands;
#[cfg(feature = "node")]
pub mod dds;
#[cfg(feature = "foxglove")]
pub mod foxglove;
pub mod line;
pub mod log;
pub mod network;
pub mod params;
pub mod robot;
pub mod time;
