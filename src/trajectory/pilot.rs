//! Paths and chases, driven through the interface procedures: nothing but moves and turns.

use super::progress::rests;
use super::{
    Chase, Follower, KinematicLimits, Order, Path, PathError, PathEvent, Posture, Progress,
    Tolerance,
};
use crate::controller::{AxisCommand, Interface, Procedure, Refusal, Snapshot};
use crate::math::{larger, smaller};
use crate::time::{self, Duration, Instant};

/// How paths are driven.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// The largest distance of a path from a corner, m.
    pub corner: f32,
    /// How near to a posture the base has to stop.
    pub tolerance: Tolerance,
    /// A target that was not replaced for so long is not chased any more, s.
    pub chase_timeout: f32,
    /// What the vehicle can do.
    pub limits: KinematicLimits,
    /// The controller's period, s.
    pub period: f32,
}

/// Why a path or a chase ended before its time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Ending {
    /// The base was told to stop, or disabled.
    Stop,
    /// It was told to move.
    Move,
    /// It was told to turn.
    Turn,
    /// A fault was latched.
    Fault,
    /// It was told to follow another path, or to chase.
    Replaced,
    /// No target has come for too long.
    Timeout,
    /// The vehicle cannot drive it from where it has come to rest.
    Refused,
}

impl Ending {
    /// The name that the protocol uses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Move => "move",
            Self::Turn => "turn",
            Self::Fault => "fault",
            Self::Replaced => "replaced",
            Self::Timeout => "timeout",
            Self::Refused => "refused",
        }
    }
}

/// What the pilot is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Errand {
    /// Follows a path.
    Path,
    /// Chases a target.
    Chase,
}

impl Errand {
    /// The name that the protocol uses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Chase => "chase",
        }
    }
}

/// What has happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Notice {
    /// On the path.
    Path(PathEvent),
    /// It has ended before its time.
    End(Errand, Ending),
}

/// Why a path or a chase was refused. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unable {
    /// The base may not move now.
    Motion(Refusal),
    /// The postures make no path.
    Path(PathError),
}

impl core::fmt::Display for Unable {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Motion(refusal) => refusal.fmt(f),
            Self::Path(error) => error.fmt(f),
        }
    }
}
impl core::error::Error for Unable {}

impl From<Refusal> for Unable {
    fn from(refusal: Refusal) -> Self {
        Self::Motion(refusal)
    }
}

impl From<PathError> for Unable {
    fn from(error: PathError) -> Self {
        Self::Path(error)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Activity {
    Idle,
    /// Brings the vehicle to rest, to set out on the path or since there is nothing more to chase.
    Braking(Errand),
    /// Under way.
    Driving(Errand),
}

/// The time between two orders to a chasing base: each replaces a trapezoid that has hardly begun.
const CHASE_PERIOD: Duration = Duration::millis(10);
/// An update that comes later than this was none that one could count on, s.
const LATEST: f32 = 0.1;

/// Commands an [`Interface`] along a path or after a target. N postures have room in its queue.
///
/// Call [`update`](Self::update) whenever the interface has a new snapshot, and when it was told to do something. Whoever else commands a motion ends what the
/// pilot is about.
#[derive(Clone, Debug)]
pub struct Pilot<const N: usize = 32> {
    follower: Follower<N>,
    chase: Chase,
    settings: Settings,
    activity: Activity,
    /// Not told yet.
    ended: Option<Notice>,
    /// The instant of the snapshot that was looked at last.
    updated: Instant,
    /// The last update gave an order.
    ordered: bool,
    /// The translation and the rotation have been told to come to rest.
    braked: [bool; 2],
    /// Somebody has commanded one axis; the other one is still to be brought to rest.
    abandoned: Option<Order>,
    /// The last move and the last turn were the pilot's, and may still be told to be done.
    own: [bool; 2],
}

impl<const N: usize> Default for Pilot<N> {
    fn default() -> Self {
        Self {
            follower: Follower::default(),
            chase: Chase::default(),
            settings: Settings::default(),
            activity: Activity::Idle,
            ended: None,
            updated: Instant::from_ticks(0),
            ordered: false,
            braked: [false; 2],
            abandoned: None,
            own: [false; 2],
        }
    }
}

impl<const N: usize> Pilot<N> {
    /// The queue of postures; those that are left, while a path is followed.
    #[must_use]
    pub fn path(&self) -> &Path<N> {
        self.follower.path()
    }

    /// The number of the first of them: on a path under way, one more than have been passed.
    #[must_use]
    pub fn first(&self) -> u32 {
        match self.errand() {
            Some(Errand::Path) => self.follower.passed().saturating_add(1),
            _ => 1,
        }
    }

    /// What it is about, if anything.
    #[must_use]
    pub fn errand(&self) -> Option<Errand> {
        match self.activity {
            Activity::Idle => None,
            Activity::Braking(errand) | Activity::Driving(errand) => Some(errand),
        }
    }

    /// Adds a posture behind the last one; of a path under way, too.
    ///
    /// # Errors
    /// [`PathError`]; nothing has changed.
    #[inline(never)]
    pub fn append<C>(&mut self, desk: &Interface<C>, posture: &Posture) -> Result<(), PathError> {
        let progress = self.progress(desk.snapshot());
        let joins = self.activity == Activity::Driving(Errand::Path);
        self.follower.push(posture, joins.then_some(&progress))
    }

    /// Forgets the postures. A path under way ends: the caller stops the base.
    pub fn clear(&mut self) {
        self.follower.clear();
    }

    /// Follows the path through the postures in the queue, from where the base is. One that moves comes to rest first, unless it points to the first posture.
    /// A path that is under way goes on.
    ///
    /// # Errors
    /// [`Unable`]; an empty queue is [out of range](PathError::Range). Nothing has changed.
    pub fn start<C>(&mut self, desk: &mut Interface<C>, settings: &Settings) -> Result<(), Unable> {
        desk.may_move()?;
        match self.errand() {
            Some(Errand::Path) => Ok(()),
            _ => self.set_out(desk, settings),
        }
    }

    #[inline(never)]
    fn set_out<C>(&mut self, desk: &mut Interface<C>, settings: &Settings) -> Result<(), Unable> {
        let progress = self.progress(desk.snapshot());
        self.follower.start(
            &progress.pose,
            settings.corner,
            settings.tolerance,
            &settings.limits,
        )?;
        self.begin(desk, settings, Errand::Path);
        self.activity = if self.follower.may_start(&progress) {
            Activity::Driving(Errand::Path)
        } else {
            Activity::Braking(Errand::Path)
        };
        Ok(())
    }

    /// Goes to a posture: forgets all others, and starts.
    ///
    /// # Errors
    /// [`Unable`]; nothing has changed.
    #[inline(never)]
    pub fn go_to<C>(
        &mut self,
        desk: &mut Interface<C>,
        settings: &Settings,
        posture: &Posture,
    ) -> Result<(), Unable> {
        desk.may_move()?;
        Path::<N>::may_go(&desk.snapshot().estimator.pose(), posture, &settings.limits)?;
        self.follower.clear();
        self.follower.push(posture, None)?;
        self.set_out(desk, settings)
    }

    /// Chases a posture, which replaces the one before.
    ///
    /// # Errors
    /// [`Unable`]; nothing has changed.
    #[inline(never)]
    pub fn chase<C>(
        &mut self,
        desk: &mut Interface<C>,
        settings: &Settings,
        target: &Posture,
    ) -> Result<(), Unable> {
        desk.may_move()?;
        if !settings.limits.can_move() {
            return Err(PathError::Still.into());
        }
        if self.activity != Activity::Driving(Errand::Chase) {
            self.begin(desk, settings, Errand::Chase);
            self.follower.end();
            self.chase = Chase::default();
            self.activity = Activity::Driving(Errand::Chase);
        }
        self.settings = *settings;
        self.chase
            .replace(*target, desk.snapshot().time, &settings.limits);
        Ok(())
    }

    /// A move or a turn is done. True if nobody but the pilot asked for it.
    pub fn is_own(&mut self, done: Procedure) -> bool {
        let [moves, turns] = &mut self.own;
        let own = match done {
            Procedure::Move => core::mem::take(moves),
            Procedure::Turn => core::mem::take(turns),
            Procedure::Stop | Procedure::EmergencyStop => false,
        };
        own || self.errand().is_some()
    }

    /// The end of what has just been replaced: the next [`update`](Self::update) tells it, unless it is asked for before.
    pub fn take_end(&mut self) -> Option<Notice> {
        self.ended.take()
    }

    fn begin<C>(&mut self, desk: &mut Interface<C>, settings: &Settings, errand: Errand) {
        // A target that comes late, while the base brakes for want of one, belongs to the same chase.
        if let Some(before) = self.errand()
            && (before, errand) != (Errand::Chase, Errand::Chase)
        {
            self.ended = Some(Notice::End(before, Ending::Replaced));
        }
        // What was asked for before is what this replaces.
        desk.take_asked();
        self.settings = *settings;
        self.updated = desk.snapshot().time;
        self.ordered = false;
        self.braked = [false; 2];
        self.abandoned = None;
    }

    /// Gives the next order, if one is due, and tells what has happened. `yields`: others may want to command the base now, and have their turn after an order.
    #[inline(never)]
    pub fn update<C>(&mut self, desk: &mut Interface<C>, yields: bool) -> Option<Notice> {
        if self.ended.is_some() {
            return self.ended.take();
        }
        let asked = desk.take_asked();
        let [moves, turns] = &mut self.own;
        *moves &= matches!(asked, None | Some(Procedure::Turn));
        *turns &= matches!(asked, None | Some(Procedure::Move));
        let Some(errand) = self.errand() else {
            self.settle(desk, asked);
            return None;
        };
        let ending = match asked {
            _ if desk.snapshot().fault.is_some() => Some(Ending::Fault),
            Some(Procedure::EmergencyStop) => Some(Ending::Fault),
            Some(Procedure::Stop) => Some(Ending::Stop),
            Some(Procedure::Move) => Some(Ending::Move),
            Some(Procedure::Turn) => Some(Ending::Turn),
            None => None,
        };
        if let Some(ending) = ending {
            let [translation, rotation] = self.stops();
            self.abandoned = match ending {
                Ending::Move => Some(rotation),
                Ending::Turn => Some(translation),
                _ => None,
            };
            return Some(self.end(errand, ending));
        }
        let now = desk.snapshot().time;
        if now == self.updated || !desk.is_idle() {
            return None;
        }
        if yields && core::mem::take(&mut self.ordered) {
            return None;
        }
        if self.activity == Activity::Driving(Errand::Chase) {
            if self.chase.age(now) > seconds(self.settings.chase_timeout) {
                self.braked = [false; 2];
                self.activity = Activity::Braking(Errand::Chase);
            } else if time::since(now, self.updated) < CHASE_PERIOD {
                return None;
            }
        }
        let progress = self.progress(desk.snapshot());
        self.updated = now;
        match self.activity {
            Activity::Idle => None,
            Activity::Braking(errand) => self.brake(desk, &progress, errand),
            Activity::Driving(Errand::Path) => {
                let (order, event) = self.follower.update(&progress);
                if event == Some(PathEvent::Done) {
                    self.activity = Activity::Idle;
                }
                let refused = order.and_then(|order| self.give(desk, order, Errand::Path));
                // Whatever was passed before it.
                event.map(Notice::Path).or(refused)
            }
            Activity::Driving(Errand::Chase) => {
                let order = self.chase.update(&progress, now, &self.settings.limits)?;
                self.give(desk, order, Errand::Chase)
            }
        }
    }

    /// Brings to rest what the errand that has ended had an axis do, unless that has been commanded anew.
    fn settle<C>(&mut self, desk: &mut Interface<C>, asked: Option<Procedure>) {
        if asked.is_some() {
            self.abandoned = None;
        }
        if !desk.is_idle() {
            return;
        }
        let snapshot = desk.snapshot();
        let order = match self.abandoned.take() {
            Some(order @ Order::Move(_)) if !rests(&snapshot.translation) => order,
            Some(order @ Order::Turn(_)) if !rests(&snapshot.rotation) => order,
            _ => return,
        };
        // Refused, it has been stopped otherwise.
        self.command(desk, order).ok();
    }

    /// What brings the translation and the rotation to rest.
    fn stops(&self) -> [Order; 2] {
        let limits = &self.settings.limits;
        let stop = |acceleration| AxisCommand {
            distance: 0.0,
            speed: 0.0,
            acceleration,
        };
        [
            Order::Move(stop(limits.acceleration)),
            Order::Turn(stop(limits.turn_acceleration)),
        ]
    }

    fn end(&mut self, errand: Errand, ending: Ending) -> Notice {
        self.follower.end();
        self.activity = Activity::Idle;
        Notice::End(errand, ending)
    }

    fn give<C>(&mut self, desk: &mut Interface<C>, order: Order, errand: Errand) -> Option<Notice> {
        self.ordered = true;
        match self.command(desk, order) {
            // A car that stands turns as soon as it moves.
            Ok(()) | Err(Refusal::Busy | Refusal::Standing) => None,
            Err(Refusal::Fault(_)) => Some(self.end(errand, Ending::Fault)),
            Err(Refusal::Disabled) => Some(self.end(errand, Ending::Stop)),
            Err(_) => Some(self.end(errand, Ending::Refused)),
        }
    }

    /// Within what a command may ask for now: limits may have changed since the path was planned.
    fn command<C>(&mut self, desk: &mut Interface<C>, order: Order) -> Result<(), Refusal> {
        let limits = *desk.limits();
        let within = |command: AxisCommand, speed, acceleration| AxisCommand {
            speed: smaller(command.speed, speed),
            acceleration: smaller(command.acceleration, acceleration),
            ..command
        };
        let [moves, turns] = &mut self.own;
        let given = match order {
            Order::Move(command) => {
                *moves = true;
                desk.move_by(within(command, limits.speed, limits.acceleration))
            }
            Order::Turn(command) => {
                *turns = true;
                desk.turn_by(within(command, limits.turn_speed, limits.turn_acceleration))
            }
        };
        desk.take_asked();
        given
    }

    /// Each axis by itself, as a move and a turn with speed 0 do.
    fn brake<C>(
        &mut self,
        desk: &mut Interface<C>,
        progress: &Progress,
        errand: Errand,
    ) -> Option<Notice> {
        let orders = self.stops();
        for (braked, order) in self.braked.iter_mut().zip(orders) {
            if !core::mem::replace(braked, true) {
                return self.give(desk, order, errand);
            }
        }
        if desk.snapshot().is_moving() {
            return None;
        }
        if errand == Errand::Chase {
            return Some(self.end(errand, Ending::Timeout));
        }
        let Settings {
            corner,
            tolerance,
            limits,
            ..
        } = self.settings;
        match self
            .follower
            .start(&progress.pose, corner, tolerance, &limits)
        {
            Ok(()) => {
                self.activity = Activity::Driving(Errand::Path);
                None
            }
            Err(_) => Some(self.end(errand, Ending::Refused)),
        }
    }

    fn progress(&self, snapshot: &Snapshot) -> Progress {
        let interval = time::seconds(time::since(snapshot.time, self.updated));
        Progress {
            pose: snapshot.estimator.pose(),
            translation: snapshot.translation,
            rotation: snapshot.rotation,
            interval: smaller(larger(interval, self.settings.period), LATEST),
            delay: self.settings.period,
        }
    }
}

fn seconds(time: f32) -> Duration {
    Duration::from_ticks((time * 1e6) as u64)
}
