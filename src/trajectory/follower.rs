//! Where the base is on its path, to what it is to be commanded next.

use super::frame::{offset, turn_to};
use super::progress::{Order, PathEvent, Progress, Tolerance, rests};
use super::{Corner, KinematicLimits, Leg, Passage, Path, PathError, Posture};
use crate::controller::{AxisCommand, Pose};
use crate::math::{larger, limit, sin_cos, smaller, sqrt};
use core::f32::consts::{FRAC_PI_2, PI};
use core::ops::ControlFlow;

/// What the follower is about.
///
/// ```text
///     Aim ──▶ Leg ──▶ Corner          rounded: on to the next leg
///      ▲       ▲  │      │
///      │       └──│──────┘
///      │          ▼
///      └────── Station ──▶ Done       a stop, with or without a heading; too far off: once more
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Turns on the spot to the leg's heading.
    Aim,
    /// Drives the straight part of a leg.
    Leg,
    /// Drives a corner; the rotation's reference is on its way.
    Corner,
    /// Stands at the end of a leg, and turns to its heading.
    Station,
    Done,
}

/// A heading error below this is none, rad (0.06°).
const AIMED: f32 = 1e-3;
/// A vehicle that moves and points to its first posture as well as this does not stop to turn, rad (10°).
const POINTED: f32 = 0.175;
/// How often it comes once more to a place that it has missed.
const APPROACHES: u8 = 3;
/// The longest that it waits for the vehicle to come where the reference is, s.
const PATIENCE: f32 = 0.5;
/// Below this a vehicle stands, m/s and rad/s.
const STANDSTILL: f32 = 5e-3;
/// A way left below this is none, m.
const ARRIVED: f32 = 1e-3;
/// On a leg, turns smaller than this are left undone, rad (0.1°): the lateral error that asks for one is below a millimetre.
const LEAST_TURN: f32 = 1.7e-3;
/// A lateral error is taken out over the way of so many seconds …
const REGAIN_TIME: f32 = 1.0;
/// … but no less than this, m: what the vehicle is late by must be short against it.
const REGAIN_LENGTH: f32 = 0.3;
/// The steepest angle at which the leg is regained, rad (20°).
const STEEPEST_REGAIN: f32 = 0.35;
/// So long before a corner's turn no other one is begun, s.
const UNSTEERED_TIME: f32 = 0.2;
/// Of the limits of turning, a correction on a leg takes this much.
const GENTLE: f32 = 0.5;
/// A corner of less than this is left to what corrects the heading on a leg, rad (0.2°).
const STRAIGHT: f32 = 3.5e-3;
/// The sine of the shallowest corner (15°) at which the turn's start can set the lateral error right that it ends with.
const SHALLOW: f32 = 0.26;

/// Follows one path. Pure: what is known goes in, an order and an event come out.
///
/// A correction of the estimate moves the path under the vehicle; nothing of it reaches the axes but by the next command, which starts from their present
/// reference speeds: nothing steps, and accelerations stay within the limits. On a leg a lateral error e asks for the heading θ_leg − atan(e/ℓ) and goes
/// down as exp(−S/ℓ). A corner turns from the heading that the vehicle has, and starts where that turn ends on the next leg.
#[derive(Clone, Debug)]
pub struct Follower<const N: usize> {
    path: Path<N>,
    tolerance: Tolerance,
    /// The leg under way. Aside from the path's own only while a place is approached once more.
    leg: Leg,
    /// Direction of the one behind it, rad.
    next: f32,
    /// From the end of what is straight of it to the next stop, m.
    beyond: f32,
    /// So many postures have been passed.
    passed: u32,
    /// It has stood at the leg's end for so long, s.
    waited: f32,
    /// So often the place may be approached once more.
    approaches: u8,
    phase: Phase,
    /// The translation's command since the last stop.
    moving: Option<AxisCommand>,
    /// The vehicle has begun to slow down for the corner at the end of this leg.
    slowing: bool,
    /// Where the rotation's command goes from its start, rad.
    turning: f32,
}

impl<const N: usize> Default for Follower<N> {
    fn default() -> Self {
        Self {
            path: Path::default(),
            tolerance: Tolerance::default(),
            leg: Leg::default(),
            next: 0.0,
            beyond: 0.0,
            passed: 0,
            waited: 0.0,
            approaches: 0,
            phase: Phase::Done,
            moving: None,
            slowing: false,
            turning: 0.0,
        }
    }
}

impl<const N: usize> Follower<N> {
    /// The queue of postures. It is not the follower's to drive until it [starts](Self::start).
    #[must_use]
    pub fn path(&self) -> &Path<N> {
        &self.path
    }

    /// Forgets the postures; whatever is under way has ended.
    pub fn clear(&mut self) {
        self.path.clear();
        self.phase = Phase::Done;
    }

    /// Ends where it is. The postures that are left stay in the queue.
    pub fn end(&mut self) {
        self.phase = Phase::Done;
    }

    /// How many postures have been passed.
    #[must_use]
    pub fn passed(&self) -> u32 {
        self.passed
    }

    /// Adds a posture behind the last one; of a path under way, if there is a progress on it.
    ///
    /// # Errors
    /// [`PathError`] if there is no room, or the vehicle cannot come there. Nothing has changed.
    pub fn push(
        &mut self,
        posture: &Posture,
        progress: Option<&Progress>,
    ) -> Result<(), PathError> {
        self.path.push(posture)?;
        let (Some(progress), false) = (progress, self.is_done()) else {
            return Ok(());
        };
        let (ahead, _) = offset(&progress.pose, &self.leg.to, self.leg.heading);
        // Two updates until that is seen.
        let speed = progress.translation.reference_speed.abs();
        let left = match self.phase {
            Phase::Leg => ahead - 2.0 * speed * progress.interval,
            Phase::Aim if speed == 0.0 => self.leg.length,
            // It stands there, or is in the corner.
            _ => 0.0,
        };
        self.path.join(speed, left)?;
        if !matches!(self.phase, Phase::Corner) {
            self.look();
        }
        Ok(())
    }

    /// Plans a path through the postures in the queue and begins to follow it. A vehicle that moves, and does not point to the first one, must have come to
    /// rest: see [`Self::may_start`].
    ///
    /// # Errors
    /// [`PathError`] if the vehicle cannot come to one of them; an empty queue is out of [range](PathError::Range). The postures stay.
    pub fn start(
        &mut self,
        pose: &Pose,
        miss: f32,
        tolerance: Tolerance,
        limits: &KinematicLimits,
    ) -> Result<(), PathError> {
        self.path.plan(pose, miss, limits)?;
        self.tolerance = tolerance;
        self.passed = 0;
        self.phase = Phase::Aim;
        self.look();
        Ok(())
    }

    /// True if the vehicle can start on the path that is planned: it stands, or points to the first posture and can still stop there.
    #[must_use]
    pub fn may_start(&self, progress: &Progress) -> bool {
        let (translation, rotation) = (&progress.translation, &progress.rotation);
        if !rests(rotation) {
            return false;
        }
        if rests(translation) {
            return true;
        }
        let speed = translation.reference_speed;
        let acceleration = Self::LATE * self.path.limits().acceleration;
        let to_corner = self.path.straight(0);
        let points = turn_to(&progress.pose, self.leg.heading).abs() < POINTED;
        points && speed > 0.0 && 0.5 * speed * speed < acceleration * to_corner
    }

    /// Of the acceleration, so much is relied on where the way to slow down begins with an update.
    const LATE: f32 = 0.8;

    /// Reads the leg under way off the path.
    fn look(&mut self) {
        if let Some(leg) = self.path.leg(0) {
            self.leg = leg;
            self.next = self.path.leg(1).map_or(leg.heading, |next| next.heading);
            self.beyond = self.path.beyond();
            self.approaches = APPROACHES;
        }
    }

    /// True once the last posture is reached, or the path has ended otherwise.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.phase == Phase::Done
    }

    /// What to command next, if anything, and what has happened.
    pub fn update(&mut self, progress: &Progress) -> (Option<Order>, Option<PathEvent>) {
        let leg = self.leg;
        match self.phase {
            Phase::Done => (None, None),
            Phase::Aim => (self.aim(progress, &leg), None),
            Phase::Leg => (self.drive(progress, &leg), None),
            Phase::Corner => self.round(progress),
            Phase::Station => self.stand(progress, &leg),
        }
    }

    /// On the spot; a vehicle that cannot has a path that needs none.
    fn aim(&mut self, progress: &Progress, leg: &Leg) -> Option<Order> {
        // What moves points well enough: it had been asked before it started.
        if rests(&progress.translation)
            && leg.length > 0.0
            && let ControlFlow::Break(order) = self.face(progress, leg.heading)
        {
            return order;
        }
        self.set_out();
        self.drive(progress, leg)
    }

    /// Goes on once the vehicle faces a heading; until then there is nothing else to do than an order that may be due.
    fn face(&mut self, progress: &Progress, heading: f32) -> ControlFlow<Option<Order>> {
        let limits = *self.path.limits();
        if !limits.turns_in_place {
            return ControlFlow::Continue(());
        }
        if !rests(&progress.rotation) {
            return ControlFlow::Break(None);
        }
        // What the axis is about to take out by itself needs no command.
        let turn = turn_to(&progress.pose, heading);
        if (turn - progress.rotation.error).abs() <= AIMED {
            return ControlFlow::Continue(());
        }
        let order = self.turn(turn, limits.turn_speed, limits.turn_acceleration);
        ControlFlow::Break(Some(order))
    }

    fn turn(&mut self, distance: f32, speed: f32, acceleration: f32) -> Order {
        self.turning = distance;
        Order::Turn(AxisCommand {
            distance,
            speed,
            acceleration,
        })
    }

    fn set_out(&mut self) {
        self.phase = Phase::Leg;
        self.moving = None;
        self.slowing = false;
    }

    fn drive(&mut self, progress: &Progress, leg: &Leg) -> Option<Order> {
        let (ahead, aside) = offset(&progress.pose, &leg.to, leg.heading);
        match leg.end {
            Passage::Rounded(corner) => self.drive_to_corner(progress, leg, &corner, ahead, aside),
            Passage::Stop(_) => {
                if self.moving.is_some()
                    && rests(&progress.translation)
                    && (ahead - progress.translation.error).abs() < ARRIVED
                {
                    self.phase = Phase::Station;
                    self.waited = 0.0;
                    return None;
                }
                self.go(progress, ahead, leg.speed)
                    .or_else(|| self.steer(progress, leg, aside, ahead))
            }
        }
    }

    fn drive_to_corner(
        &mut self,
        progress: &Progress,
        leg: &Leg,
        corner: &Corner,
        ahead: f32,
        aside: f32,
    ) -> Option<Order> {
        let speed = progress.translation.reference_speed;
        let next = self.next;
        // As the corner turns, and what the heading is off: not the other way round, where it is a hairpin.
        let turn = corner.angle + turn_to(&progress.pose, next - corner.angle);
        let to_corner = to_line(progress, leg, (turn, ahead, next)) - progress.moves();
        let left = to_corner - lead(corner, turn, speed.abs());
        let cycle = speed.abs() * progress.interval;
        if left <= 0.5 * cycle {
            self.phase = Phase::Corner;
            let turn = turn - progress.turns();
            return (corner.angle.abs() > STRAIGHT)
                .then(|| self.turn(turn, corner.turn_speed, corner.turn_acceleration));
        }
        // By the next update the vehicle may be this fast; then two more are left to be at the corner's speed.
        let acceleration = self.path.limits().acceleration;
        let soon = speed.abs() + acceleration * progress.interval;
        let braking = 0.5 * (soon * soon - corner.speed * corner.speed) / acceleration
            + 2.0 * soon * progress.interval;
        self.slowing |= to_corner - corner.lead <= braking;
        let wanted = if self.slowing {
            corner.speed
        } else {
            leg.speed
        };
        let rest = to_corner - corner.lead + progress.moves() + self.beyond;
        let order = self.go(progress, rest, wanted);
        // A turn that has not ended when the corner's begins would set out from the wrong rate; the corner sets right what it can by itself.
        if order.is_none() && left > UNSTEERED_TIME * speed.abs() {
            self.steer(progress, leg, aside, left)
        } else {
            order
        }
    }

    /// The move to the next stop, unless it is under way.
    fn go(&mut self, progress: &Progress, rest: f32, speed: f32) -> Option<Order> {
        let axis = &progress.translation;
        if let Some(moving) = self.moving
            && moving.speed == speed
        {
            let under_way = if rests(axis) {
                axis.error
            } else {
                moving.distance - axis.displacement.get()
            };
            if (under_way - rest).abs() < ARRIVED {
                return None;
            }
        }
        let command = AxisCommand {
            distance: rest - progress.moves(),
            speed,
            acceleration: self.path.limits().acceleration,
        };
        self.moving = Some(command);
        Some(Order::Move(command))
    }

    /// A turn that regains the leg, if one is due: the leg lies so far to the left, and so much of it is left.
    fn steer(&mut self, progress: &Progress, leg: &Leg, aside: f32, left: f32) -> Option<Order> {
        let limits = self.path.limits();
        let speed = progress.translation.reference_speed.abs();
        let length = larger(speed * REGAIN_TIME, REGAIN_LENGTH);
        // There is no way to regain it in what is left at the end: only the heading counts there.
        let slope = if left > 0.5 * length {
            limit(aside / length, STEEPEST_REGAIN)
        } else {
            0.0
        };
        let turn = turn_to(&progress.pose, leg.heading + slope);
        let under_way = if rests(&progress.rotation) {
            progress.rotation.error
        } else {
            self.turning - progress.rotation.displacement.get()
        };
        if (turn - under_way).abs() < LEAST_TURN {
            return None;
        }
        let turn_speed = gentle_turn_speed(limits, speed);
        let acceleration = GENTLE * limits.turn_acceleration_at(speed);
        (turn_speed > 0.0 && acceleration > 0.0).then(|| {
            let distance = turn - progress.turns();
            self.turn(distance, turn_speed, acceleration)
        })
    }

    /// Until the rotation's reference has landed.
    fn round(&mut self, progress: &Progress) -> (Option<Order>, Option<PathEvent>) {
        if !rests(&progress.rotation) {
            return (self.keep_speed(progress), None);
        }
        let passed = self.pass();
        self.phase = Phase::Leg;
        self.slowing = false;
        let leg = self.leg;
        (self.drive(progress, &leg), Some(passed))
    }

    fn pass(&mut self) -> PathEvent {
        self.path.pass();
        self.look();
        self.passed = self.passed.saturating_add(1);
        PathEvent::Posture(self.passed)
    }

    /// A turn that was due before the corner's speed was commanded came first: an update has one order.
    fn keep_speed(&mut self, progress: &Progress) -> Option<Order> {
        let moving = self.moving?;
        let Passage::Rounded(corner) = self.leg.end else {
            return None;
        };
        let rest = moving.distance - progress.translation.displacement.get();
        self.go(progress, rest, corner.speed)
    }

    fn stand(&mut self, progress: &Progress, leg: &Leg) -> (Option<Order>, Option<PathEvent>) {
        let heading = match leg.end {
            Passage::Stop(heading) => heading,
            Passage::Rounded(_) => None,
        };
        // A turn to the heading takes as long as it takes: the wait for what follows a reference begins when that stands.
        let still = rests(&progress.translation) && rests(&progress.rotation);
        self.waited = if still {
            self.waited + progress.interval
        } else {
            0.0
        };
        if !(self.waited > PATIENCE || self.stands(progress)) {
            return (None, None);
        }
        if self.approach_again(progress, leg) {
            return (None, None);
        }
        if let Some(heading) = heading
            && let ControlFlow::Break(order) = self.face(progress, heading)
        {
            return (order, None);
        }
        if !rests(&progress.rotation) {
            return (None, None);
        }
        if self.path.len() > 1 {
            self.phase = Phase::Aim;
            (None, Some(self.pass()))
        } else {
            self.path.pass();
            self.phase = Phase::Done;
            (None, Some(PathEvent::Done))
        }
    }

    /// True once the vehicle has come where the references are.
    fn stands(&self, progress: &Progress) -> bool {
        let Progress {
            translation,
            rotation,
            ..
        } = progress;
        translation.error.abs() < 0.5 * self.tolerance.distance
            && rotation.error.abs() < 0.5 * self.tolerance.heading
            && translation.speed.abs() < STANDSTILL
            && rotation.speed.abs() < STANDSTILL
    }

    /// A place that was missed, as the estimate has it now, gets a leg of its own.
    fn approach_again(&mut self, progress: &Progress, leg: &Leg) -> bool {
        let turns_in_place = self.path.limits().turns_in_place;
        let still = rests(&progress.rotation) && rests(&progress.translation);
        if !(still && turns_in_place && self.approaches > 0) {
            return false;
        }
        let (ahead, aside) = offset(&progress.pose, &leg.to, 0.0);
        let off = sqrt(ahead * ahead + aside * aside);
        if off <= self.tolerance.distance {
            return false;
        }
        self.approaches -= 1;
        // Forward or backward, whichever takes the smaller turn. What has no heading of its own points along the path again.
        let bearing = libm::atan2f(aside, ahead);
        let behind = turn_to(&progress.pose, bearing).abs() > FRAC_PI_2;
        self.leg = Leg {
            heading: if behind { bearing + PI } else { bearing },
            length: off,
            end: match leg.end {
                Passage::Stop(None) => Passage::Stop(Some(leg.heading)),
                end => end,
            },
            ..*leg
        };
        self.phase = Phase::Aim;
        true
    }
}

/// How far it is along the present heading to the next leg's line, m. Two lines that are all but one have no such point: then to the corner.
fn to_line(progress: &Progress, leg: &Leg, (turn, ahead, next): (f32, f32, f32)) -> f32 {
    let (_, aside) = offset(&progress.pose, &leg.to, next);
    let sin = sin_cos(turn).0;
    if sin.abs() > SHALLOW {
        -aside / sin
    } else {
        ahead
    }
}

/// T of a corner as it would be driven now: by another angle, and where the wheels do not give the corner's speed, by what they give.
fn lead(corner: &Corner, turn: f32, speed: f32) -> f32 {
    let share = smaller(speed / corner.speed, 1.0);
    let turn_speed = share * corner.turn_speed;
    let speed = share * corner.speed;
    let lead = Corner::at(turn, speed, turn_speed, corner.turn_acceleration).lead;
    // Towards half a turn it has no bound.
    smaller(lead, 2.0 * corner.lead)
}

fn gentle_turn_speed(limits: &KinematicLimits, speed: f32) -> f32 {
    smaller(GENTLE * limits.turn_speed, limits.turn_speed_at(speed))
}
