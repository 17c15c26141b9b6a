//! Postures to straight legs and corners, with the speeds at which they can be driven.

use super::corner::Room;
use super::frame::turn_to;
use super::{Corner, KinematicLimits, Leg, Passage, PathError, Posture, Vertex};
use crate::controller::Pose;
use crate::math::{larger, smaller, sqrt, wrap};
use heapless::Deque;

/// Postures closer together than this are one place, m.
const ONE_PLACE: f32 = 1e-3;
/// A heading that is off by less than this is taken on the way, rad (1°).
const AIMED: f32 = 0.0175;

/// A posture, and what a plan has made of it, as small as it goes: the corner is worked out again from its speed when it is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Waypoint {
    x: f64,
    y: f64,
    /// NaN: none.
    heading: f32,
    /// NaN: none.
    wanted: f32,
    /// Direction of the leg that leads here, rad, and its length, m.
    direction: f32,
    length: f32,
    /// v_s of the corner, m/s; 0: a stop.
    corner: f32,
}

impl Waypoint {
    fn posture(&self) -> Posture {
        let given = |x: f32| (!x.is_nan()).then_some(x);
        Posture {
            x: self.x,
            y: self.y,
            heading: given(self.heading),
            speed: given(self.wanted),
        }
    }

    /// The heading in which the vehicle leaves, after a stop.
    fn facing(&self) -> f32 {
        if self.heading.is_nan() {
            self.direction
        } else {
            self.heading
        }
    }
}

/// A queue of up to N postures, and the legs and corners that lead through them. What has been passed is taken off its front.
#[derive(Clone, Debug, PartialEq)]
pub struct Path<const N: usize> {
    waypoints: Deque<Waypoint, N>,
    /// T of the corner at which the first leg begins, m; 0: there the vehicle stood.
    entry: f32,
    /// The largest distance from a corner, m.
    miss: f32,
    limits: KinematicLimits,
}

impl<const N: usize> Default for Path<N> {
    fn default() -> Self {
        Self {
            waypoints: Deque::new(),
            entry: 0.0,
            miss: 0.0,
            limits: KinematicLimits::default(),
        }
    }
}

impl<const N: usize> Path<N> {
    /// Adds a posture behind the last one. It takes part in the next [plan](Self::plan); [`Self::join`] joins it to one that is there.
    ///
    /// # Errors
    /// [`PathError::Range`] with its number, [`PathError::Full`].
    pub fn push(&mut self, posture: &Posture) -> Result<(), PathError> {
        let heading = posture.heading.unwrap_or(f32::NAN);
        let wanted = posture.speed.unwrap_or(f32::NAN);
        let finite = posture.heading.is_none_or(f32::is_finite);
        let moves = posture.speed.is_none_or(|speed| speed > 0.0);
        if !(finite && moves && (posture.x + posture.y).is_finite()) {
            return Err(PathError::Range(self.waypoints.len()));
        }
        let waypoint = Waypoint {
            x: posture.x,
            y: posture.y,
            heading,
            wanted,
            direction: 0.0,
            length: 0.0,
            corner: 0.0,
        };
        self.waypoints
            .push_back(waypoint)
            .map_err(|_| PathError::Full)
    }

    /// Forgets all postures.
    pub fn clear(&mut self) {
        self.waypoints.clear();
    }

    /// The postures that are left.
    pub fn postures(&self) -> impl Iterator<Item = Posture> {
        self.waypoints.iter().map(Waypoint::posture)
    }

    /// How many are left.
    #[must_use]
    pub fn len(&self) -> usize {
        self.waypoints.len()
    }

    /// True if none is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waypoints.is_empty()
    }

    /// Plans the way from a pose at which the vehicle stands through the postures, the last of which it stops at. It misses no corner by more than `miss`, m.
    ///
    /// A corner may take half of each of its legs, and all of one at whose other end the vehicle stops; what cannot be rounded so is turned on the spot.
    /// Then speeds are lowered where a leg is too short to go from one to the next: first backward, so that the vehicle can slow down, then
    /// forward, so that it can speed up. A lower speed only makes room, so once each way is enough.
    ///
    /// # Errors
    /// [`PathError`] names the posture that the vehicle cannot come to. The postures stay, without a plan.
    pub fn plan(
        &mut self,
        start: &Pose,
        miss: f32,
        limits: &KinematicLimits,
    ) -> Result<(), PathError> {
        if self.is_empty() {
            return Err(PathError::Range(0));
        }
        if !limits.can_move() {
            return Err(PathError::Still);
        }
        self.limits = *limits;
        self.miss = miss;
        self.entry = 0.0;
        self.lay(start)?;
        self.round();
        self.slow_down();
        self.speed_up();
        if limits.turns_in_place {
            Ok(())
        } else {
            self.without_turns(start)
        }
    }

    /// Joins the last posture to a planned path that the vehicle drives at v_s (m/s), with so much left of the first leg (m): where it can, the stop that was the
    /// last one becomes a corner.
    ///
    /// # Errors
    /// [`PathError`] if the vehicle cannot come there; then the posture is gone again.
    pub fn join(&mut self, speed: f32, left: f32) -> Result<(), PathError> {
        let joined = self.join_last(speed, left);
        if joined.is_err() {
            self.waypoints.pop_back();
            // What ends the path is a stop again.
            if let Some(last) = self.waypoints.back_mut() {
                last.corner = 0.0;
            }
        }
        joined
    }

    fn join_last(&mut self, speed: f32, left: f32) -> Result<(), PathError> {
        let last = self.waypoints.len().saturating_sub(1);
        let Some(n) = last.checked_sub(1) else {
            return Err(PathError::Range(last));
        };
        let Some(before) = self.waypoints.get(n).copied() else {
            return Err(PathError::Range(last));
        };
        self.lay_one(last, before.x, before.y, before.facing())?;
        let exit = self.corner_before(n).map(|corner| corner.speed);
        let room = if n == 0 {
            Room {
                length: left,
                at: Some(speed),
            }
        } else {
            let lead = self.corner_before(n).map_or(0.0, |corner| corner.lead);
            Room {
                length: before.length - lead,
                at: Some(exit.unwrap_or(0.0)),
            }
        };
        let length = self.waypoints.get(last).map_or(0.0, |last| last.length);
        let behind = Room {
            length,
            at: Some(0.0),
        };
        self.fit(n, [room, behind]);
        let turns = |waypoint: &Waypoint| {
            waypoint.corner == 0.0 && apart(before.facing(), waypoint.direction)
        };
        let last_turns = self.waypoints.back().is_some_and(Self::turns_there);
        let is_stop = self.corner_after(n).is_none();
        let sharp = is_stop && self.waypoints.back().is_some_and(turns);
        if !self.limits.turns_in_place && (sharp || last_turns) {
            return Err(PathError::Sharp(last));
        }
        Ok(())
    }

    /// The first posture is behind the vehicle.
    pub fn pass(&mut self) {
        self.entry = self.corner_after(0).map_or(0.0, |corner| corner.lead);
        self.waypoints.pop_front();
    }

    /// A leg that is left, with the corner at its end.
    #[must_use]
    pub fn leg(&self, n: usize) -> Option<Leg> {
        let waypoint = self.waypoints.get(n)?;
        let heading = waypoint.posture().heading;
        Some(Leg {
            to: Vertex {
                x: waypoint.x,
                y: waypoint.y,
            },
            heading: waypoint.direction,
            length: waypoint.length,
            speed: self.speed(waypoint),
            end: self
                .corner_after(n)
                .map_or(Passage::Stop(heading), Passage::Rounded),
        })
    }

    /// All that are left.
    pub fn legs(&self) -> impl Iterator<Item = Leg> {
        (0..self.len()).filter_map(|n| self.leg(n))
    }

    /// What it was planned for.
    #[must_use]
    pub fn limits(&self) -> &KinematicLimits {
        &self.limits
    }

    fn speed(&self, waypoint: &Waypoint) -> f32 {
        let wanted = waypoint.posture().speed.unwrap_or(self.limits.speed);
        smaller(wanted, self.limits.straight_speed())
    }

    fn lay(&mut self, start: &Pose) -> Result<(), PathError> {
        let (mut x, mut y) = (start.x, start.y);
        let mut facing = wrap(start.theta) as f32;
        for n in 0..self.waypoints.len() {
            self.lay_one(n, x, y, facing)?;
            if let Some(waypoint) = self.waypoints.get(n) {
                (x, y, facing) = (waypoint.x, waypoint.y, waypoint.facing());
            }
        }
        Ok(())
    }

    /// A leg from a point to a posture; one of no length points where the vehicle does.
    fn lay_one(&mut self, n: usize, x: f64, y: f64, facing: f32) -> Result<(), PathError> {
        let waypoint = self.waypoints.get_mut(n).ok_or(PathError::Range(n))?;
        let (dx, dy) = ((waypoint.x - x) as f32, (waypoint.y - y) as f32);
        let square = dx * dx + dy * dy;
        if !square.is_finite() {
            return Err(PathError::Range(n));
        }
        let length = sqrt(square);
        (waypoint.length, waypoint.direction) = if length < ONE_PLACE {
            (0.0, facing)
        } else {
            (length, libm::atan2f(dy, dx))
        };
        waypoint.corner = 0.0;
        Ok(())
    }

    /// Rounds what can be rounded.
    fn round(&mut self) {
        let last = self.waypoints.len().saturating_sub(1);
        for n in 0..last {
            let (Some(before), Some(behind)) = (self.waypoints.get(n), self.waypoints.get(n + 1))
            else {
                return;
            };
            let starts = self.corner_before(n).is_none();
            let ends = n + 1 == last || !behind.heading.is_nan();
            let room = |leg: &Waypoint, at_rest: bool| Room {
                length: if at_rest {
                    leg.length
                } else {
                    0.5 * leg.length
                },
                at: at_rest.then_some(0.0),
            };
            let rooms = [room(before, starts), room(behind, ends)];
            self.fit(n, rooms);
        }
    }

    /// The corner at the end of a leg, if there may be one and there is room for it.
    fn fit(&mut self, n: usize, room: [Room; 2]) {
        let (Some(before), Some(behind)) = (self.waypoints.get(n), self.waypoints.get(n + 1))
        else {
            return;
        };
        if !before.heading.is_nan() || before.length == 0.0 || behind.length == 0.0 {
            return;
        }
        let angle = wrap(f64::from(behind.direction) - f64::from(before.direction)) as f32;
        let wanted = smaller(self.speed(before), self.speed(behind));
        let corner = Corner::fit(angle, wanted, room, self.miss, &self.limits);
        self.set_corner(n, corner.map_or(0.0, |corner| corner.speed));
    }

    fn slow_down(&mut self) {
        for n in (1..self.waypoints.len()).rev() {
            let exit = self.corner_after(n).map_or(0.0, |corner| corner.speed);
            self.bound(n - 1, self.reachable(n, exit));
        }
    }

    fn speed_up(&mut self) {
        for n in 0..self.waypoints.len() {
            let entry = self.corner_before(n).map_or(0.0, |corner| corner.speed);
            self.bound(n, self.reachable(n, entry));
        }
    }

    /// The speed at one end of a leg that goes with that at the other end.
    fn reachable(&self, n: usize, speed: f32) -> f32 {
        let acceleration = Room::RUN_UP * self.limits.acceleration;
        sqrt(speed * speed + 2.0 * acceleration * larger(self.straight(n), 0.0))
    }

    /// Lets the corner at the end of a leg be driven at no more than a speed: it needs no more room then.
    fn bound(&mut self, n: usize, speed: f32) {
        if let Some(waypoint) = self.waypoints.get(n)
            && waypoint.corner > speed
        {
            let slowest = smaller(self.limits.slowest, waypoint.corner);
            self.set_corner(n, if speed < slowest { 0.0 } else { speed });
        }
    }

    fn set_corner(&mut self, n: usize, speed: f32) {
        if let Some(waypoint) = self.waypoints.get_mut(n) {
            waypoint.corner = speed;
        }
    }

    fn corner_after(&self, n: usize) -> Option<Corner> {
        let waypoint = self.waypoints.get(n)?;
        let behind = self.waypoints.get(n + 1)?;
        let angle = wrap(f64::from(behind.direction) - f64::from(waypoint.direction)) as f32;
        (waypoint.corner > 0.0).then(|| Corner::within(angle, waypoint.corner, &self.limits))
    }

    fn corner_before(&self, n: usize) -> Option<Corner> {
        self.corner_after(n.checked_sub(1)?)
    }

    /// What corners leave of a leg, m.
    #[must_use]
    pub fn straight(&self, n: usize) -> f32 {
        let lead = |corner: Option<Corner>| corner.map_or(0.0, |corner| corner.lead);
        let entry = if n == 0 {
            self.entry
        } else {
            lead(self.corner_before(n))
        };
        self.waypoints
            .get(n)
            .map_or(0.0, |leg| leg.length - entry - lead(self.corner_after(n)))
    }

    /// The way from the end of what is straight of the first leg to where the vehicle stops next, m.
    #[must_use]
    pub fn beyond(&self) -> f32 {
        let mut sum = 0.0;
        let mut before = self.corner_after(0);
        let mut n = 1;
        while let Some(corner) = before {
            before = self.corner_after(n);
            let leg = self.waypoints.get(n).map_or(0.0, |leg| leg.length);
            sum += corner.length + leg - corner.lead - before.map_or(0.0, |next| next.lead);
            n += 1;
        }
        sum
    }

    /// True if a vehicle that has come straight there has a heading to take.
    fn turns_there(waypoint: &Waypoint) -> bool {
        apart(waypoint.facing(), waypoint.direction)
    }

    /// Whether the vehicle can go from a pose straight to a posture.
    ///
    /// # Errors
    /// [`PathError`] of the posture 0, or [`PathError::Still`]: what [`Self::plan`] would say.
    pub fn may_go(
        start: &Pose,
        posture: &Posture,
        limits: &KinematicLimits,
    ) -> Result<(), PathError> {
        if !limits.can_move() {
            return Err(PathError::Still);
        }
        let (dx, dy) = ((posture.x - start.x) as f32, (posture.y - start.y) as f32);
        let direction = if sqrt(dx * dx + dy * dy) < ONE_PLACE {
            wrap(start.theta) as f32
        } else {
            libm::atan2f(dy, dx)
        };
        if limits.turns_in_place {
            Ok(())
        } else if turn_to(start, direction).abs() > AIMED {
            Err(PathError::Start(0))
        } else if posture
            .heading
            .is_some_and(|heading| apart(heading, direction))
        {
            Err(PathError::Sharp(0))
        } else {
            Ok(())
        }
    }

    /// Refuses a stop that takes a turn.
    fn without_turns(&self, start: &Pose) -> Result<(), PathError> {
        let mut facing = None;
        for (n, waypoint) in self.waypoints.iter().enumerate() {
            if n == 0 && turn_to(start, waypoint.direction).abs() > AIMED {
                return Err(PathError::Start(0));
            }
            if facing.is_some_and(|facing| apart(facing, waypoint.direction)) {
                return Err(PathError::Sharp(n.saturating_sub(1)));
            }
            if Self::turns_there(waypoint) {
                return Err(PathError::Sharp(n));
            }
            facing = (waypoint.corner == 0.0).then(|| waypoint.facing());
        }
        Ok(())
    }
}

fn apart(a: f32, b: f32) -> bool {
    wrap(f64::from(a) - f64::from(b)).abs() as f32 > AIMED
}
