//! What the network asks for, in the lines of the protocol: speeds, fixes, goals. Pure: what is refused is refused here, before it can move anything.

pub mod observation;
pub mod posture;
pub mod velocity;

pub use velocity::Velocity;

/// Why something that came in is not passed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// NaN or infinity, or a number that no base can mean.
    NotFinite,
    /// Its stamp is too old.
    Stale,
    /// Its stamp is of the future.
    Future,
    /// It is in a frame that this base does not know.
    Frame,
    /// A covariance that is not symmetric and positive, or not said at all.
    Covariance,
    /// A quaternion of no rotation.
    Orientation,
    /// There is no base to take it: the line is lost, or the handshake not over.
    NoBase,
}

impl Refusal {
    /// In words, for diagnostics.
    pub fn name(self) -> &'static str {
        match self {
            Self::NotFinite => "not finite",
            Self::Stale => "stale",
            Self::Future => "of the future",
            Self::Frame => "unknown frame",
            Self::Covariance => "covariance",
            Self::Orientation => "orientation",
            Self::NoBase => "no base",
        }
    }
}

/// A number as a line has it: so many decimals, and no zeros behind them.
pub fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    if text == "-0" { "0" } else { text }.to_owned()
}
