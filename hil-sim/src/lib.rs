//! A simulated robot base: the real controller and interpreter of `vehicle-controller` on fake peripherals, driven by a plant that is written from
//! physics and shares no kinematics with them.

pub mod base;
pub mod calibrate;
pub mod consistency;
#[cfg(feature = "emulator")]
pub mod emulator;
pub mod faults;
pub mod map;
pub mod motor_controller;
pub mod peripherals;
pub mod plant;
pub mod plot;
pub mod prior;
pub mod propagation;
pub mod random;
pub mod replay;
pub mod rig;
pub mod robot;
pub mod script;
pub mod se2;
pub mod settings;
pub mod soak;
pub mod statistics;
pub mod steered_axle;
pub mod trace;
pub mod umbmark;
pub mod vehicle;
