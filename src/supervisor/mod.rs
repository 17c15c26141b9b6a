//! Beside the middle layer: what may take motion away.

mod heartbeat;

pub use heartbeat::Heartbeat;

/// A latched fault: motors are off and motion is refused until it is cleared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fault {
    /// The emergency stop was pressed, or the EStop command given.
    Estop,
    /// A motor output could not be written.
    Output,
    /// The watchdog had to reset the controller.
    Watchdog,
    /// Parameters were stored, and none of the sets can be read: the base has its defaults.
    Storage,
}

impl Fault {
    /// The name that the protocol uses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Estop => "estop",
            Self::Output => "output",
            Self::Watchdog => "watchdog",
            Self::Storage => "storage",
        }
    }
}
