//! What a path is told, and what it is made of.

use super::Corner;

/// A place to come by, or to come to [C §7].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Posture {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// A heading to take there, rad: the vehicle stops for it, and turns. Without one the path goes by, rounding the corner.
    pub heading: Option<f32>,
    /// v_s on the way there, m/s, above 0; the fastest that there is if left out.
    pub speed: Option<f32>,
}

/// A point of the plane, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Vertex {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
}

/// What happens at the end of a leg.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Passage {
    /// It goes over into the next one.
    Rounded(Corner),
    /// The vehicle stops, and takes a heading (rad) if there is one.
    Stop(Option<f32>),
}

impl Default for Passage {
    fn default() -> Self {
        Self::Stop(None)
    }
}

/// From one posture to the next one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Leg {
    /// Where it leads.
    pub to: Vertex,
    /// Its direction, rad, within ±π.
    pub heading: f32,
    /// From posture to posture, m.
    pub length: f32,
    /// v_s between its corners, m/s.
    pub speed: f32,
    /// How it ends.
    pub end: Passage,
}

/// Why postures make no path. The number is the posture's, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PathError {
    /// There are more of them than there is room for.
    Full,
    /// There is no speed, or no acceleration, to go or to turn with.
    Still,
    /// A number is not finite, or a speed not above 0; or there is no posture at all.
    Range(usize),
    /// The vehicle cannot turn on the spot, and there is no other way to set out for it.
    Start(usize),
    /// The vehicle cannot turn on the spot, and its corner cannot be rounded, or its heading not taken.
    Sharp(usize),
}

impl core::fmt::Display for PathError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Full => "there is no room for another posture",
            Self::Still => "a speed or an acceleration is zero",
            Self::Range(_) => "a posture's number is out of range",
            Self::Start(_) => "the vehicle does not point to the posture",
            Self::Sharp(_) => "a posture's turn is too sharp for the vehicle",
        })
    }
}
impl core::error::Error for PathError {}
