//! What must hold in every tick.

use super::book::Book;
use super::sight::{AxisSight, Sight};
use crate::robot::Robot;
use vehicle_controller::params::Id;
use vehicle_controller::supervisor::{Fault, Reaction};

/// The nominal period, s.
const PERIOD: f64 = 1e-3;
/// A stop for a fault's sake may take this much longer than its ramps, and so long besides, s: the controller's deadline.
const STOP_SHARE: f64 = 1.25;
const STOP_PATIENCE: f64 = 0.6;
/// An f32's rounding of a speed, and the thousandth by which the last cycle of a profile may be steeper.
const ROUNDING: f64 = 3e-7;
const STEEPER: f64 = 1.001;
/// What looking costs, ms: a look may be a tick late, and the deadline may be counted in whole ticks.
const LATE_MS: u64 = 3;
/// Rounding of a correlation.
const CORRELATION: f64 = 1e-9;

/// Something that must not be.
#[derive(Clone, Debug)]
pub struct Complaint {
    /// What kind.
    pub kind: &'static str,
    /// With its numbers.
    pub detail: String,
}

/// What happened to the latched fault in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// This one is latched now.
    Latched(Fault),
    /// None is any more.
    Cleared,
}

/// Looks at each tick.
#[derive(Clone, Debug)]
pub struct Watch {
    /// Largest following errors, m and rad.
    lag: [f64; 2],
    /// What one count of each encoder may do to an error, m and rad.
    counts: [f64; 2],
    /// Largest speeds, m/s and rad/s.
    max_speed: [f64; 2],
    before: Option<Sight>,
    /// The motors are to be off from then on, ms, whoever wanted it.
    off_by: Option<u64>,
    /// A fault wants it.
    off_for_fault: bool,
    /// The references are to stand from then on, ms.
    still_by: [Option<u64>; 2],
    /// When a fault was latched that nothing has moved the base since, ms.
    latched_at: Option<(Fault, u64)>,
    /// The longest from a latched fault to the last voltage on a motor, ms: for faults that switch off, and for those that stop.
    pub worst: [u64; 2],
}

impl Watch {
    /// For a robot at rest.
    pub fn new(robot: &Robot) -> Self {
        let get = |id| f64::from(robot.params.get(id));
        let diameter = get(Id::LeftDiameter).max(get(Id::RightDiameter));
        let count = std::f64::consts::PI * diameter / get(Id::CountsPerTurn);
        Self {
            counts: [count, 2.0 * count / get(Id::WheelBase)],
            lag: [get(Id::MoveLag), get(Id::TurnLag).to_radians()],
            max_speed: [get(Id::MaxSpeed), get(Id::MaxTurnSpeed).to_radians()],
            before: None,
            off_by: None,
            off_for_fault: false,
            still_by: [None; 2],
            latched_at: None,
            worst: [0; 2],
        }
    }

    /// A motion of an axis was sent that may be accepted.
    pub fn note_motion(&mut self, axis: usize) {
        self.off_by = None;
        self.off_for_fault = false;
        self.still_by[axis] = None;
        self.latched_at = None;
    }

    /// Motor power may come back: what Disable wanted need not be any more.
    pub fn note_enable(&mut self) {
        if !self.off_for_fault {
            self.off_by = None;
        }
    }

    /// Stop was accepted.
    pub fn note_stop(&mut self, now: u64, book: &Book) {
        for axis in [0, 1] {
            self.still_by[axis] = Some(now + ms(self.ramp(axis, book)) + LATE_MS);
        }
    }

    /// Disable was accepted.
    pub fn note_disable(&mut self, now: u64, book: &Book) {
        self.note_stop(now, book);
        let ramp = self.ramp(0, book).max(self.ramp(1, book));
        let by = now + ms(STOP_SHARE * ramp + STOP_PATIENCE) + LATE_MS;
        self.off_by = Some(self.off_by.map_or(by, |earlier| earlier.min(by)));
    }

    /// What an axis takes to stand, s.
    fn ramp(&self, axis: usize, book: &Book) -> f64 {
        let speed = self.before.map_or(0.0, |sight| sight.axes[axis].reference);
        speed.abs() / book.stop_rate(axis) + PERIOD
    }

    /// Looks at a tick: what is not as it must be, and what happened to the fault.
    pub fn look(
        &mut self,
        now: u64,
        sight: &Sight,
        book: &Book,
    ) -> (Vec<Complaint>, Option<Change>) {
        let mut complaints = Vec::new();
        let mut complain = |kind, detail: String| complaints.push(Complaint { kind, detail });
        if !sight.is_finite {
            complain("a number is not finite", format!("{sight:?}"));
        }
        if !is_covariance(&sight.covariance) {
            complain(
                "the covariance is not positive semi-definite",
                format!("{:?}", sight.covariance),
            );
        }
        let change = self.change(now, sight, book);
        if sight.is_driven() {
            self.note_driven(now);
        }
        // In the tick of the fault itself a motor may be seen as it was.
        if let Some(by) = self.off_by.filter(|by| now > *by) {
            let moving = sight.axes.iter().any(|axis| axis.reference != 0.0);
            if sight.is_driven() {
                let detail = format!("{} ms late: duties {:?}", now - by, sight.duties);
                complain("a motor is driven that should be off", detail);
            }
            if moving {
                complain("a reference moves though the motors are off", String::new());
            }
        }
        for axis in [0, 1] {
            let seen = &sight.axes[axis];
            if self.still_by[axis].is_some_and(|by| now > by) && seen.reference != 0.0 {
                let detail = format!("axis {axis}: {}", seen.reference);
                complain("a reference moves that was to stop", detail);
            }
            if seen.reference.abs() > self.max_speed[axis] * (1.0 + 1e-6) {
                let detail = format!("axis {axis}: {}", seen.reference);
                complain("a reference is beyond the limits", detail);
            }
            if let Some(before) = &self.before
                && let Some(detail) = self.steps(axis, before, sight, book)
            {
                complain("a reference steps", detail);
            }
        }
        self.before = Some(*sight);
        (complaints, change)
    }

    /// Takes note of a fault that was latched or cleared.
    fn change(&mut self, now: u64, sight: &Sight, book: &Book) -> Option<Change> {
        if sight.fault == book.latched {
            return None;
        }
        let Some(fault) = sight.fault else {
            return Some(Change::Cleared);
        };
        self.latched_at = Some((fault, now));
        self.off_for_fault = true;
        let mut goes_on = [false; 2];
        let by = match fault.reaction() {
            Reaction::Off => now,
            Reaction::Stop => {
                let mut ramps = [0, 1].map(|axis| self.ramp(axis, book));
                if fault == Fault::Link {
                    // One that is coming to rest goes on with that.
                    for (axis, ramp) in ramps.iter_mut().enumerate() {
                        let stop = book.stop_rate(axis);
                        let slowest = book.resting_rates(axis).fold(stop, f64::min);
                        *ramp *= stop / slowest;
                    }
                }
                let mut seconds = STOP_SHARE * ramps[0].max(ramps[1]) + STOP_PATIENCE;
                if fault == Fault::Link {
                    // One with an end goes on to it, at its own pace and waiting for whoever holds the base up.
                    for (axis, motion) in book.finite() {
                        goes_on[axis] = true;
                        let detour = 3.0 * self.max_speed[axis] / motion.acceleration;
                        let pace = motion.distance / motion.speed;
                        seconds = seconds.max(2.0 * (pace + detour) + 5.0);
                    }
                }
                for axis in [0, 1] {
                    if !goes_on[axis] {
                        self.still_by[axis] = Some(now + ms(ramps[axis]) + LATE_MS);
                    }
                }
                now + ms(seconds) + LATE_MS
            }
        };
        if goes_on != [false; 2] {
            self.latched_at = None;
        }
        self.off_by = Some(self.off_by.map_or(by, |earlier| earlier.min(by)));
        Some(Change::Latched(fault))
    }

    fn note_driven(&mut self, now: u64) {
        if let Some((fault, at)) = self.latched_at {
            let worst = &mut self.worst[usize::from(fault.reaction() == Reaction::Stop)];
            // Its voltage lasts until the tick after.
            *worst = (*worst).max(now + 1 - at);
        }
    }

    /// How a reference changed more than it may; None if it did not.
    fn steps(&self, axis: usize, before: &Sight, sight: &Sight, book: &Book) -> Option<String> {
        let (then, now) = (&before.axes[axis], &sight.axes[axis]);
        if then.reference == now.reference {
            return None;
        }
        let elapsed = (sight.clock - before.clock.min(sight.clock)) as f64 * 1e-6;
        let periods = (elapsed / PERIOD).round();
        let allowed = book.allowed(axis);
        let change = (now.reference - then.reference).abs();
        let grows = now.reference.abs() > then.reference.abs();
        let rate = if grows {
            allowed.faster
        } else {
            allowed.slower
        };
        let step = rate * (elapsed + sight.blur) * STEEPER + ROUNDING * self.max_speed[axis];
        let too_fast = grows && now.reference.abs() > allowed.speed * (1.0 + 1e-6);
        if change <= step && !too_fast {
            return None;
        }
        let released = now.reference == 0.0 && !sight.is_driven();
        // An encoder that jumps takes the axis along at once, whatever its speed is said to be.
        let [x, y, theta] = [0, 1, 2].map(|i| sight.pose[i] - before.pose[i]);
        let rolled = [x.hypot(y), theta.abs()][axis];
        if released || (!grows && self.waits(axis, [then, now], step, rolled)) {
            return None;
        }
        Some(format!(
            "axis {axis}: from {} to {} in {periods} periods, allowed {allowed:?}",
            then.reference, now.reference
        ))
    }

    /// The reference waits for a vehicle that is as far behind as it may be: it goes on from the vehicle's speed, or stands.
    fn waits(&self, axis: usize, [then, now]: [&AxisSight; 2], step: f64, rolled: f64) -> bool {
        // An axis that has stopped forgets its error at once.
        let error = then.error.abs().max(now.error.abs());
        let speeds = 2.0 * (then.reference.abs() + step) + then.speed.abs() + now.speed.abs();
        let reached = error + rolled.max(speeds * PERIOD) + self.counts[axis];
        let is_behind = reached >= self.lag[axis];
        let is_its_speed = (now.reference.abs() - now.speed.abs()).abs() <= step;
        is_behind && (is_its_speed || now.reference == 0.0)
    }
}

fn ms(seconds: f64) -> u64 {
    (seconds * 1e3).ceil() as u64
}

/// Positive semi-definite, to rounding: by its correlations, so that units do not matter.
fn is_covariance([xx, xy, xt, yy, yt, tt]: &[f64; 6]) -> bool {
    let variances = [xx, yy, tt];
    if variances.iter().any(|variance| **variance < 0.0) {
        return false;
    }
    let correlation = |c: f64, a: f64, b: f64| {
        let scale = (a * b).sqrt();
        if scale > 0.0 {
            c / scale
        } else if c == 0.0 {
            0.0
        } else {
            f64::INFINITY
        }
    };
    let (r, s, t) = (
        correlation(*xy, *xx, *yy),
        correlation(*xt, *xx, *tt),
        correlation(*yt, *yy, *tt),
    );
    let determinant = 1.0 + 2.0 * r * s * t - r * r - s * s - t * t;
    [r, s, t].iter().all(|c| c.abs() <= 1.0 + CORRELATION) && determinant >= -CORRELATION
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soak::line::{Answer, Motion, Said, Sent};

    /// A base that was told to move at 0.5 m/s with 1 m/s², and looked at in each tick.
    struct Desk {
        watch: Watch,
        book: Book,
        sight: Sight,
        now: u64,
    }

    impl Desk {
        fn new() -> Self {
            let robot = Robot::load("default").unwrap();
            let mut desk = Self {
                watch: Watch::new(&robot),
                book: Book::new(&robot.params),
                sight: Sight {
                    is_finite: true,
                    duties: [0.1; 2],
                    ..Sight::default()
                },
                now: 0,
            };
            let motion = Motion {
                endless: true,
                distance: 0.0,
                speed: 0.5,
                acceleration: 1.0,
                gives: [true; 2],
            };
            let sent = Sent {
                tag: 1,
                at: 0,
                said: Said::Motion(0, motion),
                while_latched: false,
            };
            desk.book.note_sent(&sent);
            desk.watch.note_motion(0);
            let refusal = None;
            desk.book.note_answer(0, &Answer { sent, refusal });
            desk
        }

        /// A tick later, with this reference: what is complained of.
        fn look(&mut self, reference: f64) -> Vec<&'static str> {
            self.now += 1;
            self.sight.clock = 1000 * self.now;
            self.sight.axes[0].reference = reference;
            let (complaints, change) = self.watch.look(self.now, &self.sight, &self.book);
            if let Some(Change::Latched(fault)) = change {
                self.book.note_fault(fault);
            }
            complaints.iter().map(|complaint| complaint.kind).collect()
        }
    }

    const STEPS: &str = "a reference steps";
    const DRIVEN: &str = "a motor is driven that should be off";

    #[test]
    fn a_reference_goes_as_it_was_told_and_not_otherwise() {
        let mut desk = Desk::new();
        assert!(desk.look(0.0).is_empty());
        assert!(desk.look(0.001).is_empty());
        assert_eq!(desk.look(0.0021), [STEPS], "10 % too fast");
        assert!(desk.look(0.0011).is_empty());
        assert_eq!(
            desk.look(0.0),
            [STEPS],
            "down at once while the motors are on"
        );
        let mut desk = Desk::new();
        desk.look(0.4999);
        assert!(desk.look(0.5).is_empty());
        assert_eq!(desk.look(0.5001), [STEPS], "beyond the command");
        // As far behind as it may be, a reference goes on from the speed of the base, and only down to it.
        desk.look(0.5);
        desk.sight.axes[0].error = 0.006;
        desk.sight.axes[0].speed = 0.3;
        assert!(desk.look(0.3).is_empty());
        assert_eq!(desk.look(0.2), [STEPS]);
    }

    #[test]
    fn motors_are_off_in_time() {
        let mut desk = Desk::new();
        desk.look(0.001);
        desk.sight.fault = Some(Fault::NoMotion);
        assert!(desk.look(0.001).is_empty());
        assert!(desk.look(0.001).contains(&DRIVEN));
        desk.sight.duties = [0.0; 2];
        assert!(desk.look(0.0).is_empty());
        desk.sight.duties = [0.0, 0.01];
        assert_eq!(desk.look(0.0), [DRIVEN]);

        // 0.5 m/s at 1 m/s²: a reference at rest after 0.5 s, motors off after 1.25·0.5 s + 0.6 s.
        let mut desk = Desk::new();
        for tick in 0..=500 {
            desk.look(f64::from(tick) * 1e-3);
        }
        desk.sight.fault = Some(Fault::Link);
        for tick in 1..=500 {
            let complaints = desk.look(0.5 - f64::from(tick) * 1e-3);
            assert!(complaints.is_empty(), "{tick} ms: {complaints:?}");
        }
        let late = (0..1000).position(|_| !desk.look(0.0).is_empty());
        let late = 500 + late.unwrap();
        assert!((1225..=1235).contains(&late), "{late} ms");
    }

    #[test]
    fn nothing_gets_faster_with_a_fault_latched_or_cleared() {
        let mut desk = Desk::new();
        desk.look(0.001);
        desk.sight.fault = Some(Fault::Link);
        assert!(desk.look(0.001).is_empty());
        assert_eq!(desk.look(0.002), [STEPS]);
        desk.sight.fault = None;
        desk.book.note_cleared(desk.now);
        assert!(desk.look(0.0015).is_empty());
        assert_eq!(desk.look(0.002), [STEPS]);
    }

    #[test]
    fn covariances_are_told_from_other_matrices() {
        for good in [
            [0.0; 6],
            [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            [1e-12, 1e-6, 0.0, 1.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            [4.0, -2.0, 0.0, 1.0, 0.0, 9.0],
        ] {
            assert!(is_covariance(&good), "{good:?}");
        }
        for bad in [
            [-1e-20, 0.0, 0.0, 1.0, 0.0, 1.0],
            [1.0, 1.001, 0.0, 1.0, 0.0, 1.0],
            [0.0, 1e-12, 0.0, 1.0, 0.0, 1.0],
            // Each pair is possible, all three are not.
            [1.0, 0.9, 0.9, 1.0, -0.9, 1.0],
            [1.0, f64::NAN, 0.0, 1.0, 0.0, 1.0],
        ] {
            assert!(!is_covariance(&bad), "{bad:?}");
        }
    }
}
