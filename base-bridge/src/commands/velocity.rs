//! `cmd_vel`: two speeds, for as long as somebody goes on saying them.
//!
//! ```text
//!            a twist                    a twist, or each REFRESH
//!   Idle ─────────────▶ Driving ────────────────────────────────▶ m inf v, t inf ω
//!    ▲                     │ silent for the timeout
//!    └───────── Stop ◀─────┘
//! ```
//! The base's deadman is behind it: it stops a base whose bridge has died. This stops one whose bridge lives, and whose driver does not.

use super::{Refusal, decimal};

/// Speeds are said again after this, s: a line that was refused or damaged is made good.
const REFRESH: f64 = 0.2;
/// A stamp may be of the future by this, s: clocks of two computers.
pub const MAX_FUTURE: f64 = 0.1;
/// Faster than anything that rolls, m/s and rad/s: such a number is none.
const ABSURD: f64 = 1e6;

/// What the base can do, from its parameters: m/s and rad/s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Of the translation.
    pub speed: f64,
    /// Of the rotation.
    pub turn_speed: f64,
    /// Of a wheel that goes at v ± `lever` ω, and that lever, m; none for other vehicles.
    pub wheel: Option<(f64, f64)>,
}

impl Limits {
    /// The factor, up to 1, by which these speeds become possible: both, so that the curvature stays.
    fn factor(&self, v: f64, omega: f64) -> f64 {
        let share = |limit: f64, value: f64| {
            if value.abs() > limit {
                limit / value.abs()
            } else {
                1.0
            }
        };
        let wheel = self.wheel.map_or(1.0, |(limit, lever)| {
            share(limit, v.abs() + lever * omega.abs())
        });
        share(self.speed, v)
            .min(share(self.turn_speed, omega))
            .min(wheel)
    }
}

/// A line to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// A speed of the translation.
    Move(String),
    /// A speed of the rotation.
    Turn(String),
    /// The driver is silent.
    Stop,
}

/// What has been said to an axis, and when.
#[derive(Clone, Debug, Default)]
struct Axis {
    said: Option<(String, f64)>,
}

impl Axis {
    /// The line, if it is to be said now.
    fn say(&mut self, line: String, now: f64) -> Option<String> {
        let known = self
            .said
            .as_ref()
            .is_some_and(|(said, at)| *said == line && now < at + REFRESH);
        if known {
            return None;
        }
        self.said = Some((line.clone(), now));
        Some(line)
    }
}

/// The speeds that are wished for.
#[derive(Clone, Debug)]
pub struct Velocity {
    timeout: f64,
    limits: Limits,
    /// m/s, rad/s, and when they were heard.
    wish: Option<(f64, f64, f64)>,
    translation: Axis,
    rotation: Axis,
    limited: u64,
    timeouts: u64,
}

impl Velocity {
    /// For a base that is stopped when nobody has said anything for `timeout` s.
    pub fn new(timeout: f64) -> Self {
        Self {
            timeout,
            limits: Limits::default(),
            wish: None,
            translation: Axis::default(),
            rotation: Axis::default(),
            limited: 0,
            timeouts: 0,
        }
    }

    /// What the base can do. Before it is known, it is told to do nothing.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Takes a twist: linear x, y, z in m/s, angular x, y, z in rad/s, said `age` s ago. What such a base cannot do (y, z, roll, pitch) is left out.
    ///
    /// # Errors
    /// If there is a number that is none anywhere in it, or it is too old or of the future. Then it is no sign of life either.
    pub fn receive(
        &mut self,
        linear: [f64; 3],
        angular: [f64; 3],
        age: f64,
        now: f64,
    ) -> Result<(), Refusal> {
        let all = linear.iter().chain(&angular);
        // Not `>`: a NaN is neither.
        if !all.clone().all(|x| x.abs() <= ABSURD) {
            return Err(Refusal::NotFinite);
        }
        if age > self.timeout {
            return Err(Refusal::Stale);
        }
        if age < -MAX_FUTURE {
            return Err(Refusal::Future);
        }
        let (v, omega) = (linear[0], angular[2]);
        let factor = self.limits.factor(v, omega);
        self.limited += u64::from(factor < 1.0);
        // The silence begins with the measure of the driver's wish, not with its arrival.
        let heard = now - age.max(0.0);
        self.wish = Some((v * factor, omega * factor, heard));
        Ok(())
    }

    /// What is to be sent now.
    pub fn orders(&mut self, now: f64) -> Vec<Order> {
        let Some((v, omega, heard)) = self.wish else {
            return Vec::new();
        };
        if now >= heard + self.timeout {
            self.forget();
            self.timeouts += 1;
            return vec![Order::Stop];
        }
        // A car turns only while it moves: the translation goes first.
        let speed = line("m", v, 4);
        let turn = line("t", omega.to_degrees(), 3);
        let speed = self.translation.say(speed, now).map(Order::Move);
        let turn = self.rotation.say(turn, now).map(Order::Turn);
        speed.into_iter().chain(turn).collect()
    }

    /// Somebody wishes for speeds, or has until a moment ago.
    pub fn is_driving(&self) -> bool {
        self.wish.is_some()
    }

    /// When there will be something to send, if nothing comes in.
    pub fn next_deadline(&self) -> Option<f64> {
        let (.., heard) = self.wish?;
        let axes = [&self.translation, &self.rotation];
        let said = axes.into_iter().map(|axis| axis.said.as_ref());
        said.map(|said| said.map_or(0.0, |(_, at)| at + REFRESH))
            .reduce(f64::min)
            .map(|refresh| refresh.min(heard + self.timeout))
    }

    /// Nobody wishes for anything: the base has been told something else, or its line is lost.
    pub fn forget(&mut self) {
        self.wish = None;
        self.translation = Axis::default();
        self.rotation = Axis::default();
    }

    /// Twists that were beyond what the base can do.
    pub fn limited(&self) -> u64 {
        self.limited
    }

    /// Silences that have stopped the base.
    pub fn timeouts(&self) -> u64 {
        self.timeouts
    }
}

/// `m inf v` and `t inf ω`: the sign is the distance's, the speed has none; with 0 the axis stops and holds. Rounded towards zero: a base refuses what is
/// beyond its limit by any digit.
fn line(command: &str, speed: f64, decimals: usize) -> String {
    let unit = 10_f64.powi(-(decimals as i32));
    // What a binary number is short of its decimals is not taken for a digit less.
    let units = (speed.abs() / unit + 1e-6).floor();
    let magnitude = decimal(units * unit, decimals);
    let sign = if speed < 0.0 && magnitude != "0" {
        "-"
    } else {
        ""
    };
    format!("{command} {sign}inf {magnitude}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn velocity() -> Velocity {
        let mut velocity = Velocity::new(0.25);
        velocity.set_limits(Limits {
            speed: 0.7,
            turn_speed: 2.0 * PI,
            wheel: Some((0.75, 0.1)),
        });
        velocity
    }

    fn say(velocity: &mut Velocity, v: f64, omega: f64, now: f64) -> Vec<String> {
        let linear = [v, 0.0, 0.0];
        let angular = [0.0, 0.0, omega];
        velocity.receive(linear, angular, 0.0, now).unwrap();
        sent(velocity, now)
    }

    fn sent(velocity: &mut Velocity, now: f64) -> Vec<String> {
        let orders = velocity.orders(now);
        let text = |order| match order {
            Order::Move(line) | Order::Turn(line) => line,
            Order::Stop => "Stop".to_owned(),
        };
        orders.into_iter().map(text).collect()
    }

    #[test]
    fn signs_are_those_of_the_distance() {
        let mut velocity = velocity();
        assert_eq!(say(&mut velocity, 0.3, 0.0, 0.0), ["m inf 0.3", "t inf 0"]);
        assert_eq!(
            say(&mut velocity, -0.3, -PI / 4.0, 0.01),
            ["m -inf 0.3", "t -inf 45"]
        );
        assert_eq!(
            say(&mut velocity, -1e-9, 1e-9, 0.02),
            ["m inf 0", "t inf 0"]
        );
    }

    #[test]
    fn what_is_known_is_said_again_after_a_while_only() {
        let mut velocity = velocity();
        say(&mut velocity, 0.3, 0.5, 0.0);
        assert_eq!(say(&mut velocity, 0.3, 0.5, 0.05).len(), 0);
        assert_eq!(say(&mut velocity, 0.3, 0.6, 0.1), ["t inf 34.377"]);
        assert_eq!(velocity.next_deadline(), Some(0.2));
        assert_eq!(say(&mut velocity, 0.3, 0.6, 0.2), ["m inf 0.3"]);
        assert_eq!(sent(&mut velocity, 0.301), ["t inf 34.377"]);
        assert_eq!(velocity.next_deadline(), Some(0.4));
    }

    #[test]
    fn silence_stops_once() {
        let mut velocity = velocity();
        say(&mut velocity, 0.3, 0.0, 1.0);
        assert_eq!(sent(&mut velocity, 1.249), ["m inf 0.3", "t inf 0"]);
        assert_eq!(sent(&mut velocity, 1.25), ["Stop"]);
        assert_eq!(sent(&mut velocity, 1.5).len(), 0);
        assert_eq!(velocity.next_deadline(), None);
        assert_eq!(velocity.timeouts(), 1);
        assert_eq!(say(&mut velocity, 0.3, 0.0, 2.0).len(), 2);
    }

    #[test]
    fn numbers_that_are_none_are_refused_wherever_they_are() {
        for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300] {
            for at in 0..6 {
                let mut numbers = [0.1; 6];
                numbers[at] = bad;
                let [a, b, c, d, e, f] = numbers;
                let mut velocity = velocity();
                let refused = velocity.receive([a, b, c], [d, e, f], 0.0, 0.0);
                assert_eq!(refused, Err(Refusal::NotFinite));
                assert!(!velocity.is_driving());
            }
        }
    }

    #[test]
    fn too_much_is_made_possible_on_the_same_curve() {
        for (v, omega) in [
            (7.0, 0.0),
            (0.0, -90.0),
            (-0.7, 3.0),
            (5.0, 50.0),
            (0.6, 6.0),
        ] {
            let mut velocity = velocity();
            say(&mut velocity, v, omega, 0.0);
            assert_eq!(velocity.limited(), 1);
            let (limited_v, limited_omega, _) = velocity.wish.unwrap();
            assert!((limited_v * omega - limited_omega * v).abs() < 1e-9);
            assert!(limited_v.abs() <= 0.7 + 1e-12);
            assert!(limited_v.abs() + 0.1 * limited_omega.abs() <= 0.75 + 1e-12);
            assert!(limited_omega.abs() <= 2.0 * PI + 1e-12);
        }
        let mut velocity = velocity();
        say(&mut velocity, 0.7, 0.5, 0.0);
        assert_eq!(velocity.limited(), 0);
        // Before the base is known it is told to do nothing.
        let mut unknown = Velocity::new(0.25);
        assert_eq!(say(&mut unknown, 0.3, 1.0, 0.0), ["m inf 0", "t inf 0"]);
    }

    #[test]
    fn old_stamps_and_those_of_the_future_are_refused() {
        let mut velocity = velocity();
        let mut receive = |age, now| velocity.receive([0.1, 0.0, 0.0], [0.0; 3], age, now);
        assert_eq!(receive(0.26, 1.0), Err(Refusal::Stale));
        assert_eq!(receive(-0.11, 1.0), Err(Refusal::Future));
        assert_eq!(receive(-0.05, 1.0), Ok(()));
        assert_eq!(receive(0.2, 1.0), Ok(()));
        // It is silent since it was stamped.
        assert_eq!(sent(&mut velocity, 1.06), ["Stop"]);
    }

    #[test]
    fn what_was_forgotten_does_not_come_back() {
        let mut velocity = velocity();
        say(&mut velocity, 0.3, 0.0, 0.0);
        velocity.forget();
        assert_eq!(sent(&mut velocity, 0.01).len(), 0);
        assert_eq!(sent(&mut velocity, 9.0).len(), 0);
    }
}
