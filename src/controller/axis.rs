//! The axis machine: one of the two copies that command translation and rotation [C §3, §4].

use super::profile::{Phase, Profile};
use crate::math::{Sum, larger, limit, sign};
use crate::supervisor::Following;

/// State of an axis [C figure 4].
///
/// ```text
///                 command, too slow                       command, too fast or wrong way
///        ┌──────────────────────────────▶ ACCEL ─────────────────────────────┐
///        │                                │  ▲                               ▼
///      HOLD                     v reached │  │ command, faster    ┌────▶ DECCEL
///        ▲                                ▼  │                    │       │  │
///        │                               MOVE ────────────────────┘       │  │ v reached
///        │                                ▲     d comes near, stop        │  │
///        │                                └───────────────────────────────│──┘
///        └────────────────────────────────────────────────────────────────┘ speed 0
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// The displacement is servoed to the reference.
    #[default]
    Hold,
    /// The reference speed rises linearly to v.
    Accel,
    /// The reference speed stays at v.
    Move,
    /// The reference speed falls linearly: to v, or to rest at d.
    Deccel,
}

impl State {
    /// The paper's spelling.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "HOLD",
            Self::Accel => "ACCEL",
            Self::Move => "MOVE",
            Self::Deccel => "DECCEL",
        }
    }
}

/// A `move` or a `turn`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisCommand {
    /// Displacement d: m or rad, signed, may be infinite.
    pub distance: f32,
    /// Speed v ≥ 0: m/s or rad/s. Zero stops this axis alone.
    pub speed: f32,
    /// Acceleration a > 0: m/s² or rad/s².
    pub acceleration: f32,
}

/// What parameters decide about an axis. Units are m or rad, and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AxisConfig {
    /// Position gain k_p, 1/s.
    pub gain: f32,
    /// Largest following error: beyond it the reference waits.
    pub max_error: f32,
    /// A target is reached when the error is below this in HOLD.
    pub tolerance: f32,
    /// Below this speed the axis has come to rest.
    pub rest_speed: f32,
}

/// What an axis needs to know of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Nominal length T, s.
    pub period: f32,
    /// How many of them have passed.
    pub steps: u32,
    /// The measured speed, m/s or rad/s.
    pub speed: f32,
    /// How much of the command's speed there is to have, 0 to 1: the wheels' limit, shared by both axes.
    pub share: f32,
}

/// What an axis waits for in HOLD.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pending {
    Nothing,
    /// To be within tolerance of d, for so many seconds now.
    Target(f32),
    /// To come to rest, for so many seconds now.
    Rest(f32),
}

/// The longest an axis waits in HOLD before it reports all the same, s.
const PATIENCE: f32 = 0.5;

/// How much faster than commanded an axis may go to catch up with its reference.
const OVERSPEED: f32 = 1.03;
/// The share of the largest correction that even the slowest motion may use: less does not get a wheel past its stiction.
const CREEP: f32 = 0.2;

/// A following error of so many lags is a fault: in motion the reference waits at one, so the vehicle was carried away.
const FAR: f32 = 5.0;
/// Within this share of the largest error the reference waits …
const WAITING: f32 = 0.95;
/// … and a vehicle slower than this share of the command is held up.
const HELD_UP: f32 = 0.1;

/// What happened on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisEvent {
    /// d is reached; the residual s_ref − S in m or rad.
    Done(f32),
    /// The axis was told to stop and rests.
    AtRest,
}

/// One axis: its reference, its displacement S, and the error between them.
///
/// The order within a cycle is [`measure`](Self::measure) (what has happened), then commands, then [`advance`](Self::advance) (what shall happen).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    profile: Profile,
    state: State,
    /// S, since the last command.
    moved: Sum,
    /// s_ref − S. The axis carries this, not s_ref: it keeps its digits whatever S is.
    error: f32,
    /// The reference's displacement in the cycle under way.
    ahead: f32,
    reference_acceleration: f32,
    pending: Pending,
}

impl Default for Axis {
    fn default() -> Self {
        Self {
            profile: Profile::at_rest(),
            state: State::Hold,
            moved: Sum::default(),
            error: 0.0,
            ahead: 0.0,
            reference_acceleration: 0.0,
            pending: Pending::Nothing,
        }
    }
}

impl Axis {
    /// Takes in the displacement since the last cycle; `steps` is the number of nominal periods that have passed.
    #[inline]
    pub fn measure(&mut self, moved: f32, steps: u32) {
        self.moved.add(moved);
        if steps > 0 {
            self.error += self.ahead;
            self.ahead = 0.0;
        }
        self.error -= moved;
    }

    /// Replaces the command. S restarts at 0; the following error stays, so that nothing steps, as far as a following error goes: a vehicle that was
    /// carried away sets out from where it is.
    pub fn command(&mut self, config: &AxisConfig, command: AxisCommand) {
        self.moved = Sum::default();
        self.error = limit(self.error, config.max_error);
        if command.speed > 0.0 {
            // S := 0 and s_ref := e, so d − e remains.
            self.profile.go(
                command.distance - self.error,
                command.speed,
                command.acceleration,
            );
            self.pending = if command.distance.is_finite() {
                Pending::Target(0.0)
            } else {
                Pending::Nothing
            };
        } else {
            self.profile.stop(command.acceleration);
            self.pending = Pending::Rest(0.0);
        }
    }

    /// Lets go: HOLD where the vehicle is, reference at rest. S goes on counting.
    pub fn release(&mut self) {
        let moved = self.moved;
        *self = Self::default();
        self.moved = moved;
    }

    /// Ends where the vehicle is: nothing moves it any further. What is left of a target is told; an axis that has ended keeps its error, as far as a
    /// following error goes.
    pub fn end(&mut self, config: &AxisConfig) -> Option<AxisEvent> {
        if self.is_settled() && self.profile.has_landed() {
            self.error = limit(self.error, config.max_error);
            return None;
        }
        let residual = self.error + self.ahead + self.profile.remaining();
        let is_awaited = matches!(self.pending, Pending::Target(_));
        self.release();
        if is_awaited {
            self.moved = Sum::new(-residual);
        }
        is_awaited.then_some(AxisEvent::Done(residual))
    }

    /// The reference is held back at rest by what its vehicle has to do first: it sets out, and has not moved yet.
    pub fn set_out(&mut self) {
        if self.state != State::Hold && self.profile.speed() == 0.0 {
            self.state = State::Accel;
        }
    }

    /// Where the reference is driven: the command's acceleration, toward the target; 0 for an axis that has landed or is to come to rest.
    #[must_use]
    pub fn urge(&self) -> f32 {
        self.profile.urge()
    }

    /// Advances the reference by `steps` cycles of nominal length (0: none is due yet).
    pub fn advance(&mut self, config: &AxisConfig, cycle: &Cycle) -> Option<AxisEvent> {
        if self.is_settled() && self.profile.has_landed() {
            self.ahead = 0.0;
            self.reference_acceleration = 0.0;
            return None;
        }
        self.advance_reference(config, cycle)
    }

    fn advance_reference(&mut self, config: &AxisConfig, cycle: &Cycle) -> Option<AxisEvent> {
        for _ in 1..cycle.steps {
            self.advance_missed(config, cycle);
        }
        if cycle.steps > 0 {
            self.advance_one(config, cycle);
        }
        if !self.profile.has_landed() {
            return None;
        }
        if self.state != State::Hold {
            self.state = State::Hold;
            // S := S − d, where d is s_ref at the end of this cycle.
            self.moved = Sum::new(-(self.error + self.ahead));
        }
        self.settle(config, cycle.speed, cycle.steps as f32 * cycle.period)
    }

    /// A cycle that was missed: the reference has been there already. Apart from [`Self::advance_reference`], which is then no loop in most ticks.
    #[cold]
    #[inline(never)]
    fn advance_missed(&mut self, config: &AxisConfig, cycle: &Cycle) {
        self.advance_one(config, cycle);
        self.error += self.ahead;
        self.ahead = 0.0;
    }

    #[inline]
    fn advance_one(&mut self, config: &AxisConfig, cycle: &Cycle) {
        if self.profile.has_landed() {
            self.ahead = 0.0;
            self.reference_acceleration = 0.0;
            return;
        }
        let step = self.profile.step(cycle.period, cycle.share);
        self.reference_acceleration = step.speed_change / cycle.period;
        self.state = match step.phase {
            Phase::Accelerating => State::Accel,
            Phase::Cruising => State::Move,
            Phase::Decelerating => State::Deccel,
        };
        self.ahead = self.wait_for_vehicle(config, step.displacement, cycle.speed);
    }

    /// The part of a reference step that keeps the error within its bound; the rest is taken back.
    fn wait_for_vehicle(&mut self, config: &AxisConfig, step: f32, speed: f32) -> f32 {
        let direction = sign(step);
        let room = larger(config.max_error - self.error * direction, 0.0);
        let wanted = step * direction;
        if wanted <= room {
            return step;
        }
        let taken = room * direction;
        self.profile
            .wait(step - taken, larger(speed * direction, 0.0));
        taken
    }

    fn settle(&mut self, config: &AxisConfig, speed: f32, elapsed: f32) -> Option<AxisEvent> {
        match &mut self.pending {
            Pending::Nothing => None,
            Pending::Target(waited) => {
                let residual = self.error + self.ahead;
                if residual.abs() >= config.tolerance && *waited < PATIENCE {
                    *waited += elapsed;
                    return None;
                }
                self.pending = Pending::Nothing;
                Some(AxisEvent::Done(residual))
            }
            Pending::Rest(waited) => {
                if speed.abs() >= config.rest_speed && *waited < PATIENCE {
                    *waited += elapsed;
                    return None;
                }
                self.release();
                self.moved = Sum::default();
                Some(AxisEvent::AtRest)
            }
        }
    }

    /// Velocity to command: v_ref + k_p (s_ref − S), with v_ref the mean of the cycle under way.
    ///
    /// The correction is bounded by that of the largest error, so a vehicle that was pushed away comes back gently, and while the reference moves
    /// the whole by 3 % above the command, so a vehicle that was held up does not race after it.
    #[inline]
    #[must_use]
    pub fn velocity(&self, config: &AxisConfig, period: f32) -> f32 {
        let reference = self.ahead / period;
        let velocity = reference + limit(config.gain * self.error, config.gain * config.max_error);
        if self.state == State::Hold {
            velocity
        } else if velocity.abs() <= self.profile.pace() {
            // Which is well within what follows.
            velocity
        } else {
            let pace = larger(self.profile.pace(), reference.abs());
            let creep = CREEP * config.gain * config.max_error;
            limit(velocity, larger(OVERSPEED * pace, creep))
        }
    }

    /// What the speed that the reference strives for cannot exceed, above 0.
    #[inline]
    #[must_use]
    pub fn fastest_speed(&self) -> f32 {
        larger(self.profile.pace(), self.profile.speed().abs())
    }

    /// The speed that the reference strives for, signed.
    #[must_use]
    pub fn wanted_speed(&self) -> f32 {
        self.profile.wanted_speed()
    }

    /// Acceleration of the reference in the cycle under way.
    #[must_use]
    pub fn acceleration(&self) -> f32 {
        self.reference_acceleration
    }

    /// The state.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// S, m or rad.
    #[must_use]
    pub fn displacement(&self) -> Sum {
        self.moved
    }

    /// s_ref − S at this cycle's instant, m or rad.
    #[must_use]
    pub fn error(&self) -> f32 {
        self.error
    }

    /// Reference speed at the end of the cycle under way.
    #[must_use]
    pub fn reference_speed(&self) -> f32 {
        self.profile.speed()
    }

    /// True if it goes on and on: nothing but a command ends it.
    #[must_use]
    pub fn is_endless(&self) -> bool {
        self.pending == Pending::Nothing && !self.profile.has_landed()
    }

    /// How well a vehicle of this speed follows the reference, which has had so much of the command's speed.
    #[inline]
    #[must_use]
    pub fn following(&self, config: &AxisConfig, speed: f32, share: f32) -> Following {
        if self.error.abs() < WAITING * config.max_error {
            return Following::Closely;
        }
        if self.error.abs() > FAR * config.max_error {
            Following::FarOff
        } else if self.state != State::Hold && speed.abs() < HELD_UP * share * self.profile.pace() {
            Following::HeldUp
        } else {
            Following::Closely
        }
    }

    /// True if the reference stands and nothing is awaited.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.state == State::Hold && self.pending == Pending::Nothing
    }
}
