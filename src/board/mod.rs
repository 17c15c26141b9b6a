//! The boards: the only code that names a HAL or a PAC. A second board is a second file.

pub mod nucleo_f429zi;
mod rtt;

/// Why the controller started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The supply came up.
    PowerOn,
    /// The supply had dropped.
    BrownOut,
    /// The reset button, or a debug probe.
    ResetPin,
    /// The firmware asked for it.
    Software,
    /// The watchdog was not fed.
    Watchdog,
    /// The firmware tried to enter a low-power mode.
    LowPower,
}

impl ResetCause {
    /// What the boot event says.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PowerOn => "power-on",
            Self::BrownOut => "brown-out",
            Self::ResetPin => "reset-pin",
            Self::Software => "software",
            Self::Watchdog => "watchdog",
            Self::LowPower => "low-power",
        }
    }
}
