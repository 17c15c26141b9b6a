//! The bridge on a network, against Cyclone DDS: a simulated base at a pseudo-terminal, the bridge's own program, and a peer in Python, in a network namespace
//! of their own.
//!
//! Needs `ROS_PYTHON`, an interpreter that has `cyclonedds` (`cargo xtask test` makes one); without it the tests say so and are left out.
#![cfg(unix)]

#[path = "../common/mod.rs"]
mod common;

mod alone;
mod commands;
mod endings;
mod enhanced;
mod fleet;
mod loopback;
mod messages;
mod peer;
mod stage;
mod timing;
