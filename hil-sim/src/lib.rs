//! A simulated robot base: the real controller and interpreter of `vehicle-controller` on fake peripherals, driven by a plant that is written from
//! physics and shares no kinematics with them.

pub mod base;
pub mod calibrate;
#[cfg(feature = "emulator")]
pub mod emulator;
pub mod exponential;
pub mod faults;
pub mod peripherals;
pub mod plant;
pub mod plot;
pub mod replay;
pub mod rig;
pub mod robot;
pub mod script;
pub mod soak;
pub mod trace;
pub mod umbmark;
