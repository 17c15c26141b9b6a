//! The vehicle on this board: one of the library's geometries. This is the one place where an image's features choose it.
//!
//! Each file has the same names: the types `Vehicle` and `Config`; `KIND`, whose parameters they are; `NAME`, as in the image's features; `TARGET`,
//! what the image says that it runs on; `Parts`, what the vehicle takes of the board, and how it is put together.

#[cfg(any(
    all(feature = "synchro", feature = "tricycle"),
    all(feature = "synchro", feature = "bisteerable"),
    all(feature = "tricycle", feature = "bisteerable"),
))]
compile_error!(
    "an image is for one vehicle: choose one of the features `synchro`, `tricycle` and `bisteerable`, or none for the differential drive"
);

#[cfg_attr(feature = "synchro", path = "synchro.rs")]
#[cfg_attr(feature = "tricycle", path = "tricycle.rs")]
#[cfg_attr(feature = "bisteerable", path = "bisteerable.rs")]
#[cfg_attr(
    not(any(feature = "synchro", feature = "tricycle", feature = "bisteerable")),
    path = "differential.rs"
)]
mod chosen;
#[cfg(any(feature = "tricycle", feature = "bisteerable"))]
mod steering;

use stm32f4xx_hal::gpio::{Debugger, Pin};
use stm32f4xx_hal::pac;

pub use chosen::{Config, KIND, Parts, TARGET, Vehicle};

/// The vehicle's name, for whoever has the image's file: it is found by the symbol, which `memory.x` keeps.
#[unsafe(no_mangle)]
static VEHICLE: [u8; chosen::NAME.len()] = chosen::NAME;

/// What of the microcontroller the board itself has no use for, and a vehicle may have.
#[allow(dead_code, reason = "each vehicle uses another part of it")]
pub struct Spare {
    pub tim2: pac::TIM2,
    pub tim8: pac::TIM8,
    pub pa15: Pin<'A', 15, Debugger>,
    pub pb3: Pin<'B', 3, Debugger>,
    pub pc2: Pin<'C', 2>,
    pub pc8: Pin<'C', 8>,
}
