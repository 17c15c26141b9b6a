//! Postures to straight legs and corners, with the speeds at which they can be driven.

use super::corner::Room;
use super::frame::turn_to;
use super::{Corner, KinematicLimits};
use crate::controller::Pose;
use crate::math::{smaller, sqrt, wrap};
use heapless::Vec;

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

/// From one posture to the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// A number is not finite, or a speed not above 0.
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
            Self::Range(_) => "a posture's number is out of range",
            Self::Start(_) => "the vehicle does not point to the posture",
            Self::Sharp(_) => "a posture's turn is too sharp for the vehicle",
        })
    }
}
impl core::error::Error for PathError {}

/// Postures closer together than this are one place, m.
const ONE_PLACE: f32 = 1e-3;
/// A heading that is off by less than this is taken on the way, rad (1°).
const AIMED: f32 = 0.0175;

/// Legs and corners through up to N postures.
#[derive(Clone, Debug, PartialEq)]
pub struct Path<const N: usize> {
    legs: Vec<Leg, N>,
    limits: KinematicLimits,
}

impl<const N: usize> Path<N> {
    /// The path from a pose at which the vehicle stands through the postures, the last of which it stops at. It misses no corner by more than `miss`, m.
    ///
    /// A corner may take half of each of its legs, and all of one at whose other end the vehicle stops; what cannot be rounded so is turned on the spot.
    /// Then speeds are lowered where a leg is too short to go from one to the next: first backward, so that the vehicle can slow down, then
    /// forward, so that it can speed up. A lower speed only makes room, so once each way is enough.
    ///
    /// # Errors
    /// [`PathError`] names the posture that the vehicle cannot come to.
    pub fn plan(
        start: &Pose,
        postures: &[Posture],
        miss: f32,
        limits: &KinematicLimits,
    ) -> Result<Self, PathError> {
        let mut path = Self {
            legs: Vec::new(),
            limits: *limits,
        };
        path.lay(start, postures)?;
        path.round(miss);
        path.slow_down();
        path.speed_up();
        if limits.turns_in_place {
            Ok(path)
        } else {
            path.without_turns(start)
        }
    }

    /// Its legs, one to a posture.
    #[must_use]
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// What it was planned for.
    #[must_use]
    pub fn limits(&self) -> &KinematicLimits {
        &self.limits
    }

    fn lay(&mut self, start: &Pose, postures: &[Posture]) -> Result<(), PathError> {
        let (mut x, mut y) = (start.x, start.y);
        let mut heading = wrap(start.theta) as f32;
        for (n, posture) in postures.iter().enumerate() {
            let (dx, dy) = ((posture.x - x) as f32, (posture.y - y) as f32);
            let square = dx * dx + dy * dy;
            let speed = smaller(
                posture.speed.unwrap_or(self.limits.speed),
                self.limits.straight_speed(),
            );
            let finite = square + posture.heading.unwrap_or_default();
            if !(finite.is_finite() && speed > 0.0) {
                return Err(PathError::Range(n));
            }
            let mut length = sqrt(square);
            if length < ONE_PLACE {
                length = 0.0;
            } else {
                heading = libm::atan2f(dy, dx);
            }
            let leg = Leg {
                to: Vertex {
                    x: posture.x,
                    y: posture.y,
                },
                heading,
                length,
                speed,
                end: Passage::Stop(posture.heading),
            };
            self.legs.push(leg).map_err(|_| PathError::Full)?;
            heading = posture.heading.unwrap_or(heading);
            (x, y) = (posture.x, posture.y);
        }
        Ok(())
    }

    /// Rounds what can be rounded.
    fn round(&mut self, miss: f32) {
        let last = self.legs.len().saturating_sub(1);
        for n in 0..last {
            let (Some(before), Some(behind)) = (self.legs.get(n), self.legs.get(n + 1)) else {
                return;
            };
            if before.end != Passage::Stop(None) || before.length == 0.0 || behind.length == 0.0 {
                continue;
            }
            let starts = self.corner_before(n).is_none();
            let ends = n + 1 == last || behind.end != Passage::Stop(None);
            let room = |leg: &Leg, at_rest: bool| Room {
                length: if at_rest {
                    leg.length
                } else {
                    0.5 * leg.length
                },
                at_rest,
            };
            let angle = wrap(f64::from(behind.heading) - f64::from(before.heading)) as f32;
            let wanted = smaller(before.speed, behind.speed);
            let rooms = [room(before, starts), room(behind, ends)];
            let corner = Corner::fit(angle, wanted, rooms, miss, &self.limits);
            self.set_corner(n, corner);
        }
    }

    fn slow_down(&mut self) {
        for n in (1..self.legs.len()).rev() {
            let exit = self.corner_after(n).map_or(0.0, |corner| corner.speed);
            self.bound(n - 1, self.reachable(n, exit));
        }
    }

    fn speed_up(&mut self) {
        for n in 0..self.legs.len() {
            let entry = self.corner_before(n).map_or(0.0, |corner| corner.speed);
            self.bound(n, self.reachable(n, entry));
        }
    }

    /// The speed at one end of a leg that goes with that at the other end.
    fn reachable(&self, n: usize, speed: f32) -> f32 {
        let acceleration = Room::RUN_UP * self.limits.acceleration;
        sqrt(speed * speed + 2.0 * acceleration * self.straight(n))
    }

    /// Lets the corner at the end of a leg be driven at no more than a speed.
    fn bound(&mut self, n: usize, speed: f32) {
        if let Some(corner) = self.corner_after(n)
            && corner.speed > speed
        {
            let slowed = if speed < self.limits.slowest {
                None
            } else {
                corner.slowed(speed, &self.limits)
            };
            self.set_corner(n, slowed);
        }
    }

    fn set_corner(&mut self, n: usize, corner: Option<Corner>) {
        if let Some(leg) = self.legs.get_mut(n) {
            leg.end = corner.map_or(Passage::Stop(None), Passage::Rounded);
        }
    }

    fn corner_after(&self, n: usize) -> Option<Corner> {
        match self.legs.get(n)?.end {
            Passage::Rounded(corner) => Some(corner),
            Passage::Stop(_) => None,
        }
    }

    fn corner_before(&self, n: usize) -> Option<Corner> {
        self.corner_after(n.checked_sub(1)?)
    }

    /// What corners leave of a leg, m.
    #[must_use]
    pub fn straight(&self, n: usize) -> f32 {
        let lead = |corner: Option<Corner>| corner.map_or(0.0, |corner| corner.lead);
        self.legs.get(n).map_or(0.0, |leg| {
            leg.length - lead(self.corner_before(n)) - lead(self.corner_after(n))
        })
    }

    /// The way from the end of what is straight of a leg to where the vehicle stops next, m.
    #[must_use]
    pub fn beyond(&self, n: usize) -> f32 {
        let mut sum = 0.0;
        for (n, leg) in self.legs.iter().enumerate().skip(n) {
            let Passage::Rounded(corner) = leg.end else {
                break;
            };
            sum += corner.length + self.straight(n + 1);
        }
        sum
    }

    /// Itself, if no stop takes a turn.
    fn without_turns(self, start: &Pose) -> Result<Self, PathError> {
        let apart = |a: f32, b: f32| wrap(f64::from(a) - f64::from(b)).abs() as f32 > AIMED;
        let mut heading = None;
        for (n, leg) in self.legs.iter().enumerate() {
            if n == 0 && turn_to(start, leg.heading).abs() > AIMED {
                return Err(PathError::Start(0));
            }
            if heading.is_some_and(|heading| apart(heading, leg.heading)) {
                return Err(PathError::Sharp(n.saturating_sub(1)));
            }
            heading = match leg.end {
                Passage::Rounded(_) => None,
                Passage::Stop(heading) => heading.or(Some(leg.heading)),
            };
            if heading.is_some_and(|heading| apart(heading, leg.heading)) {
                return Err(PathError::Sharp(n));
            }
        }
        Ok(self)
    }
}
