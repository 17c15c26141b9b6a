//! Faults that are put into a simulated base from outside: what can go wrong, and how a script says it.

mod encoder;
mod link;
mod set;

pub use encoder::FaultyEncoder;
#[cfg(feature = "emulator")]
pub(crate) use encoder::levels;
pub use link::FaultyLink;
pub use set::FaultSet;

use anyhow::{Result, anyhow, bail, ensure};
use std::fmt;

/// Which wheels a fault concerns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The left one.
    Left,
    /// The right one.
    Right,
    /// Both.
    Both,
}

/// What can be wrong with an encoder or its cable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncoderFault {
    /// It is unplugged, or its disc is loose: the count stands.
    Stuck,
    /// The wire of channel A is broken: the pull-up keeps it high.
    OpenA,
    /// The same with channel B.
    OpenB,
    /// A and B are exchanged: it counts backward. Where its disc stands when that happens is not known; it is taken to be where no edge arises from it.
    Swapped,
    /// Another disc than the controller believes: so many times the counts.
    Scale(f64),
    /// Each count is lost with this probability.
    Drop(f64),
    /// Noise adds so many counts, once; before and afterwards the encoder is sound.
    Jump(i64),
}

/// What can be wrong with a motor or its cable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotorFault {
    /// A wire is broken: no current flows.
    Open,
    /// The leads touch each other: the motor brakes, whatever its bridge is told.
    Short,
    /// It gets this part of its voltage, 0 to 1.
    Weak(f64),
}

/// What can go wrong with a base. A later fault of the same part replaces the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// At an encoder.
    Encoder(Side, EncoderFault),
    /// At a motor.
    Motor(Side, MotorFault),
    /// A motor controller takes its orders and does nothing.
    Controller(Side),
    /// The battery's open-circuit voltage is this, V.
    Battery(f64),
    /// The serial line carries nothing, either way.
    LinkCut,
    /// Power fails before this byte of what is written to the parameter storage from now on.
    FlashCut(u64),
}

/// Counts that a jump may have: more than any counter of 16 bits can tell from fewer.
const MAX_JUMP: i64 = 1_000_000;
/// What a script may scale counts by.
const MAX_SCALE: f64 = 100.0;

const USAGE: &str = "!fault takes `left|right|both encoder …`, `left|right|both motor …`, `left|right|both controller dead`, `battery <volts>`, `link cut` or `flash cut <byte>`";
const ENCODER_USAGE: &str = "an encoder's fault is stuck, open-a, open-b, swapped, `scale <factor>`, `drop <probability>` or `jump <counts>`";
const MOTOR_USAGE: &str = "a motor's fault is open, short or `weak <factor>`";

impl Side {
    /// The wheels: 0 is the left one.
    pub fn wheels(self) -> impl Iterator<Item = usize> {
        let sides: &[usize] = match self {
            Self::Left => &[0],
            Self::Right => &[1],
            Self::Both => &[0, 1],
        };
        sides.iter().copied()
    }
}

impl Fault {
    /// Reads what follows `!fault` in a script.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(words: &[&str]) -> Result<Self> {
        match words {
            ["battery", volts] => {
                let volts = number(volts)?;
                ensure!(volts >= 0.0, "a battery has 0 V or more");
                Ok(Self::Battery(volts))
            }
            ["link", "cut"] => Ok(Self::LinkCut),
            ["flash", "cut", byte] => match byte.parse() {
                Ok(byte) => Ok(Self::FlashCut(byte)),
                Err(_) => bail!("`{byte}` is not the number of a byte"),
            },
            [side @ ("left" | "right" | "both"), part, fault @ ..] => {
                let side = match *side {
                    "left" => Side::Left,
                    "right" => Side::Right,
                    _ => Side::Both,
                };
                match *part {
                    "encoder" => Ok(Self::Encoder(side, EncoderFault::parse(fault)?)),
                    "motor" => Ok(Self::Motor(side, MotorFault::parse(fault)?)),
                    "controller" => match fault {
                        ["dead"] => Ok(Self::Controller(side)),
                        _ => bail!("a motor controller's fault is dead"),
                    },
                    other => bail!(
                        "a side has an encoder, a motor and perhaps a controller, no `{other}`"
                    ),
                }
            }
            _ => bail!("{USAGE}"),
        }
    }
}

impl EncoderFault {
    fn parse(words: &[&str]) -> Result<Self> {
        Ok(match words {
            ["stuck"] => Self::Stuck,
            ["open-a"] => Self::OpenA,
            ["open-b"] => Self::OpenB,
            ["swapped"] => Self::Swapped,
            ["scale", factor] => {
                let factor = number(factor)?;
                ensure!(
                    factor.abs() <= MAX_SCALE,
                    "a scale is {} to {MAX_SCALE}",
                    -MAX_SCALE
                );
                Self::Scale(factor)
            }
            ["drop", probability] => Self::Drop(fraction(probability)?),
            ["jump", counts] => {
                let counts: i64 = counts
                    .parse()
                    .map_err(|_| anyhow!("`{counts}` is not a number of counts"))?;
                ensure!(
                    (-MAX_JUMP..=MAX_JUMP).contains(&counts),
                    "a jump is {} to {MAX_JUMP} counts",
                    -MAX_JUMP
                );
                Self::Jump(counts)
            }
            _ => bail!("{ENCODER_USAGE}"),
        })
    }
}

impl MotorFault {
    fn parse(words: &[&str]) -> Result<Self> {
        Ok(match words {
            ["open"] => Self::Open,
            ["short"] => Self::Short,
            ["weak", factor] => Self::Weak(fraction(factor)?),
            _ => bail!("{MOTOR_USAGE}"),
        })
    }
}

/// As a script has it.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Encoder(side, fault) => write!(f, "{side} encoder {fault}"),
            Self::Motor(side, fault) => write!(f, "{side} motor {fault}"),
            Self::Controller(side) => write!(f, "{side} controller dead"),
            Self::Battery(volts) => write!(f, "battery {volts}"),
            Self::LinkCut => f.write_str("link cut"),
            Self::FlashCut(byte) => write!(f, "flash cut {byte}"),
        }
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Right => "right",
            Self::Both => "both",
        })
    }
}

impl fmt::Display for EncoderFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stuck => f.write_str("stuck"),
            Self::OpenA => f.write_str("open-a"),
            Self::OpenB => f.write_str("open-b"),
            Self::Swapped => f.write_str("swapped"),
            Self::Scale(factor) => write!(f, "scale {factor}"),
            Self::Drop(probability) => write!(f, "drop {probability}"),
            Self::Jump(counts) => write!(f, "jump {counts}"),
        }
    }
}

impl fmt::Display for MotorFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Open => f.write_str("open"),
            Self::Short => f.write_str("short"),
            Self::Weak(factor) => write!(f, "weak {factor}"),
        }
    }
}

/// A finite number of a script.
///
/// # Errors
/// If it is none.
pub(crate) fn number(word: &str) -> Result<f64> {
    match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(anyhow!("`{word}` is not a number")),
    }
}

fn fraction(word: &str) -> Result<f64> {
    let number = number(word)?;
    ensure!((0.0..=1.0).contains(&number), "`{word}` is not from 0 to 1");
    Ok(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Fault> {
        Fault::parse(&text.split_whitespace().collect::<Vec<_>>())
    }

    #[test]
    fn faults_are_read_and_written_alike() {
        for text in [
            "left encoder stuck",
            "right encoder open-a",
            "both encoder open-b",
            "left encoder swapped",
            "right encoder scale -0.5",
            "left encoder drop 0.25",
            "both encoder jump -500",
            "left motor open",
            "right motor short",
            "both motor weak 0.5",
            "left controller dead",
            "battery 8.5",
            "link cut",
            "flash cut 17",
        ] {
            assert_eq!(parse(text).unwrap().to_string(), text);
        }
    }

    #[test]
    fn mistakes_are_told() {
        for (text, message) in [
            ("", USAGE),
            ("middle encoder stuck", USAGE),
            ("battery", USAGE),
            ("battery x", "`x` is not a number"),
            ("battery -1", "a battery has 0 V or more"),
            ("link", USAGE),
            ("flash cut", USAGE),
            ("flash cut -1", "`-1` is not the number of a byte"),
            ("left", USAGE),
            (
                "left wheel stuck",
                "a side has an encoder, a motor and perhaps a controller, no `wheel`",
            ),
            ("left encoder", ENCODER_USAGE),
            ("left encoder stuck 1", ENCODER_USAGE),
            ("left encoder scale", ENCODER_USAGE),
            ("left encoder scale inf", "`inf` is not a number"),
            ("left encoder scale 101", "a scale is -100 to 100"),
            ("left encoder drop 1.5", "`1.5` is not from 0 to 1"),
            ("left encoder jump 1.5", "`1.5` is not a number of counts"),
            (
                "left encoder jump 1000001",
                "a jump is -1000000 to 1000000 counts",
            ),
            ("both motor stuck", MOTOR_USAGE),
            ("both controller", "a motor controller's fault is dead"),
            ("both motor weak -0.1", "`-0.1` is not from 0 to 1"),
        ] {
            assert_eq!(parse(text).unwrap_err().to_string(), message, "{text}");
        }
    }
}
