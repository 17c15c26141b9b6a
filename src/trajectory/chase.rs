//! Heads to a posture that moves ("their current target is replaced with this newest target", [C §7]).

use super::frame::{offset, turn_to};
use super::progress::{Order, Progress, rests};
use super::{KinematicLimits, Posture, Vertex};
use crate::controller::{AxisCommand, Pose};
use crate::math::{larger, limit, sign, sin_cos, smaller, sqrt};
use crate::time::{self, Duration, Instant};
use core::f32::consts::PI;

/// The target's velocity is smoothed over so long, s: where it is seen is known to a centimetre or so.
const SMOOTHING: f32 = 0.5;
/// What its direction turns by is smoothed over so long, s.
const RATE_SMOOTHING: f32 = 1.0;
/// It is not taken to have turned by more than this, rad.
const FARTHEST: f32 = 1.0;
/// Targets that come closer together than this tell nothing of its velocity, s: half of the time between the fastest updates, for they do not come evenly.
const SHORTEST: f32 = 0.01;
/// A target is taken to go on as it did for so much longer than the time between the last two.
const LATENESS: f32 = 1.25;
/// The base points to where the goal will be so much later, s …
const LOOK_TIME: f32 = 0.8;
/// … and by this share of the time between two targets. The nearer the point that it heads to, the more it swerves with every new target that is not where it was
/// expected.
const LOOK_PACE: f32 = 0.5;
/// Nearer than this a goal has no direction, m.
const THERE: f32 = 0.02;
/// A base that stands that near sets out again only for what is farther than this, m: a target that stands is seen now here, now there.
const AWAY: f32 = 0.05;
/// Nearer than this one that lies behind is gone to backward, m: to turn around takes longer than it is worth.
const NEAR: f32 = 0.1;
/// The faster than the target, the farther from it, 1/s: a slow target is followed slowly, not in leaps.
const EAGERNESS: f32 = 2.0;
/// A target that is as fast as the base would go is caught up with at so much of its speed: a default speed is no limit.
const CATCH_UP: f32 = 1.2;
/// Below this speeds do not differ, m/s.
const SLOW: f32 = 0.02;
/// A turn or a way that differs from the one under way by less than this needs no command, rad and m.
const LEAST: f32 = 1.7e-3;

/// Chases one target after the other. Pure, as the [`Follower`](super::Follower) is.
///
/// Between two updates the target is taken to go on with its velocity u. A trapezoid that lands on it would stay behind, as it brakes to rest there. So the
/// goal lies as far ahead of the target as braking from the target's own speed takes:
///
/// ```text
///     goal = target + u t + u |u|/(2 a_s)
/// ```
///
/// Moving along with the target then is a steady state, and when no more targets come the base comes to rest by itself. u turns as the target does: with the rate
/// ω of its direction by ω times the time since it was measured, halfway on the way to the goal.
#[derive(Clone, Copy, Debug)]
pub struct Chase {
    target: Option<Posture>,
    /// When it came.
    seen: Instant,
    /// What its velocity is measured from.
    mark: Vertex,
    marked: Instant,
    /// Time between the last two that were told apart, s.
    pace: f32,
    /// u, m/s.
    velocity: [f32; 2],
    /// What its direction turns by, rad/s.
    rate: f32,
    /// Where the commands go from their starts, m and rad.
    moving: f32,
    turning: f32,
    /// The speed of the last move, m/s.
    speed: f32,
    /// The rotation had the last order.
    turned: bool,
    /// It stands where the target is.
    there: bool,
}

impl Default for Chase {
    fn default() -> Self {
        Self {
            target: None,
            seen: Instant::from_ticks(0),
            mark: Vertex::default(),
            marked: Instant::from_ticks(0),
            pace: 0.0,
            velocity: [0.0; 2],
            rate: 0.0,
            moving: 0.0,
            turning: 0.0,
            speed: 0.0,
            turned: false,
            there: false,
        }
    }
}

impl Chase {
    /// Replaces the target. What is not finite replaces nothing.
    pub fn replace(&mut self, target: Posture, now: Instant, limits: &KinematicLimits) {
        if !(target.x.is_finite() && target.y.is_finite()) {
            return;
        }
        let is_first = self.target.is_none();
        self.target = Some(target);
        self.seen = now;
        let interval = time::seconds(time::since(now, self.marked));
        if !is_first && interval < SHORTEST {
            return;
        }
        let step = [target.x - self.mark.x, target.y - self.mark.y].map(|way| way as f32);
        self.mark = Vertex {
            x: target.x,
            y: target.y,
        };
        self.marked = now;
        if is_first {
            return;
        }
        self.pace = interval;
        let share = interval / (interval + SMOOTHING);
        let [u, v] = self.velocity;
        for (velocity, step) in self.velocity.iter_mut().zip(step) {
            *velocity += share * (step / interval - *velocity);
        }
        // The sine of the angle between the two is their cross product over |u|².
        let [new_u, new_v] = self.velocity;
        let square = larger(u * u + v * v, new_u * new_u + new_v * new_v);
        let rate = if square > SLOW * SLOW {
            (u * new_v - v * new_u) / (square * interval)
        } else {
            0.0
        };
        if rate.is_finite() {
            self.rate += interval / (interval + RATE_SMOOTHING) * (rate - self.rate);
        }
        // Nobody keeps up with more than the vehicle's own speed.
        let [u, v] = self.velocity;
        let fastest = sqrt(u * u + v * v);
        let limit = limits.straight_speed();
        if !fastest.is_finite() {
            self.velocity = [0.0; 2];
            self.rate = 0.0;
        } else if fastest > limit {
            self.velocity = [u * limit / fastest, v * limit / fastest];
        }
    }

    /// How old the target is.
    #[must_use]
    pub fn age(&self, now: Instant) -> Duration {
        time::since(now, self.seen)
    }

    /// The point that the base heads to; none before there is a target.
    #[must_use]
    pub fn goal(&self, now: Instant, limits: &KinematicLimits) -> Option<Vertex> {
        let target = self.target?;
        let age = self.extrapolated(now);
        let [u, v] = self.present_velocity(age);
        let ahead = age + sqrt(u * u + v * v) / (2.0 * limits.acceleration);
        Some(Vertex {
            x: target.x + f64::from(u * ahead),
            y: target.y + f64::from(v * ahead),
        })
    }

    /// For so long the target is taken to have gone on, s.
    fn extrapolated(&self, now: Instant) -> f32 {
        smaller(time::seconds(self.age(now)), LATENESS * self.pace)
    }

    /// u as it is on average until an age (s). What is measured is as old as half of a step and what smooths it.
    fn present_velocity(&self, age: f32) -> [f32; 2] {
        let [u, v] = self.velocity;
        let since = 0.5 * (self.pace + age) + SMOOTHING;
        let (sin, cos) = sin_cos(limit(self.rate * since, FARTHEST));
        [u * cos - v * sin, u * sin + v * cos]
    }

    /// What to command next, if anything: of a turn and a move that are both due, one after the other.
    pub fn update(
        &mut self,
        progress: &Progress,
        now: Instant,
        limits: &KinematicLimits,
    ) -> Option<Order> {
        let goal = self.goal(now, limits)?;
        let (to_goal, distance) = bearing(&progress.pose, &goal);
        let ahead = distance * sin_cos(to_goal).1;
        self.there =
            rests(&progress.translation) && distance < if self.there { AWAY } else { THERE };
        let [u, v] = self.present_velocity(self.extrapolated(now));
        let later = LOOK_TIME + LOOK_PACE * self.pace;
        let aim = Vertex {
            x: goal.x + f64::from(u * later),
            y: goal.y + f64::from(v * later),
        };
        let (bearing, _) = bearing(&progress.pose, &aim);
        let cos = sin_cos(bearing).1;
        let backward = distance < NEAR && cos < 0.0;
        let bearing = if backward {
            bearing - sign(bearing) * PI
        } else {
            bearing
        };
        let turn = self.turn(progress, bearing, distance);
        // What lies aside or behind is turned to first: then the way there is short.
        let share = if backward { -cos } else { larger(cos, 0.0) };
        let target_speed = sqrt(u * u + v * v);
        let speed = self
            .target
            .and_then(|target| target.speed)
            .unwrap_or(larger(limits.speed, CATCH_UP * target_speed));
        let eager = target_speed + EAGERNESS * distance;
        let wanted = share * smaller(smaller(speed, limits.steerable_speed()), eager);
        let due_turn = turn.and_then(|turn| self.due_turn(progress, turn, limits));
        let due_move = if self.there {
            None
        } else {
            self.due_move(progress, ahead, wanted, limits)
        };
        let order = if self.turned {
            due_move.or(due_turn)
        } else {
            due_turn.or(due_move)
        }?;
        match order {
            Order::Turn(command) => {
                self.turning = command.distance;
                self.turned = true;
            }
            Order::Move(command) => {
                self.moving = command.distance;
                self.speed = command.speed;
                self.turned = false;
            }
        }
        Some(order)
    }

    /// The turn that is left: to the goal, or there to the target's heading.
    fn turn(&self, progress: &Progress, bearing: f32, distance: f32) -> Option<f32> {
        if !self.there && distance > THERE {
            return Some(bearing);
        }
        let heading = self.target?.heading?;
        rests(&progress.translation).then(|| turn_to(&progress.pose, heading))
    }

    fn due_turn(&self, progress: &Progress, turn: f32, limits: &KinematicLimits) -> Option<Order> {
        let axis = &progress.rotation;
        let under_way = if rests(axis) {
            axis.error
        } else {
            self.turning - axis.displacement.get()
        };
        let translation = progress.translation.reference_speed.abs();
        let speed = limits.turn_speed_at(translation);
        let acceleration = if limits.turns_in_place {
            limits.turn_acceleration
        } else {
            limits.turn_acceleration_at(translation)
        };
        let due = (turn - under_way).abs() > LEAST && speed > 0.0 && acceleration > 0.0;
        due.then_some(Order::Turn(AxisCommand {
            distance: turn - progress.turns(),
            speed,
            acceleration,
        }))
    }

    fn due_move(
        &self,
        progress: &Progress,
        ahead: f32,
        speed: f32,
        limits: &KinematicLimits,
    ) -> Option<Order> {
        let axis = &progress.translation;
        let rests = rests(axis);
        let under_way = if rests {
            axis.error
        } else {
            self.moving - axis.displacement.get()
        };
        // Speeds within a tenth are the same: the bearing is never quite the same.
        let same = (speed - self.speed).abs() < 0.1 * larger(speed, SLOW);
        let away = (ahead - under_way).abs();
        let due = if rests {
            speed > 0.0 && ahead.abs() > THERE && away > LEAST
        } else {
            !same || away > LEAST
        };
        due.then_some(Order::Move(AxisCommand {
            distance: ahead - progress.moves(),
            speed,
            acceleration: limits.acceleration,
        }))
    }
}

/// The turn to a point, rad, and its distance, m.
fn bearing(pose: &Pose, goal: &Vertex) -> (f32, f32) {
    let (dx, dy) = offset(pose, goal, 0.0);
    let distance = sqrt(dx * dx + dy * dy);
    (turn_to(pose, libm::atan2f(dy, dx)), distance)
}
