//! Middle layer: the control loop [C §4, §5], in terms of the virtual vehicle.
//!
//! [`Controller::tick`] runs at a fixed rate and is all that runs there. Whoever commands it, the serial interpreter or a task on the same
//! processor, calls the paper's interface procedures on an [`Interface`], which may live at a lower priority:
//!
//! ```text
//!     Interface ── Request ──▶ Controller      commands, each replacing the last
//!     Interface ◀── Snapshot ── Controller     what is known, once a tick
//!               ◀── Event ─────                targets reached, stops, faults
//! ```

pub mod axis;
mod clock;
pub mod correction;
pub mod estimator;
mod history;
mod interface;
pub mod profile;

pub use axis::{Axis, AxisCommand, AxisConfig, State};
pub use correction::CorrectionError;
pub use estimator::{Estimate, Estimator, Noise, Pose};
pub use history::MAX_AGE;
pub use interface::{Interface, Limits, Observation, Refusal};

use crate::supervisor::Fault;
use crate::time::{Duration, Instant};
use crate::vehicle::{Motion, Twist, VirtualVehicle, Wheel};
use axis::AxisEvent;
use clock::Clock;
use estimator::Correction;
use heapless::{Deque, Vec};

/// Everything that parameters decide, in SI units and ready to use: the control loop converts nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Config<C> {
    /// Nominal period of the tick.
    pub period: Duration,
    /// The translation axis, m.
    pub translation: AxisConfig,
    /// The rotation axis, rad.
    pub rotation: AxisConfig,
    /// Deceleration of Stop, m/s².
    pub stop_acceleration: f32,
    /// Angular deceleration of Stop, rad/s².
    pub stop_turn_acceleration: f32,
    /// Random odometric error.
    pub noise: Noise,
    /// Battery voltage to assume when none is measured, V.
    pub nominal_supply: f32,
    /// The vehicle's own.
    pub vehicle: C,
}

/// What an interface asks of the controller. The next tick carries it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request<C> {
    /// Replace the translation's command.
    Move(AxisCommand),
    /// Replace the rotation's command.
    Turn(AxisCommand),
    /// Decelerate both axes and hold.
    Stop,
    /// Motors off at once, fault `estop` latched.
    EStop,
    /// Clear the latched fault.
    ClearFault,
    /// Motor power on.
    Enable,
    /// Stop, then motor power off.
    Disable,
    /// Correct the estimate.
    Correct(Correction),
    /// Take new parameters over.
    Configure(Config<C>),
}

/// Why the vehicle was stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StopReason {
    /// The Stop command.
    Command,
    /// The Disable command.
    Disable,
}

impl StopReason {
    /// The name that the protocol uses.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::Disable => "disable",
        }
    }
}

/// Something that happened in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// A move reached its target; the residual in m.
    MoveDone(f32),
    /// A turn reached its target; the residual in rad.
    TurnDone(f32),
    /// The vehicle rests after a stop.
    Stopped(StopReason),
    /// A fault was latched.
    Fault(Fault),
}

/// The events of one tick.
pub type Events = Vec<Event, 4>;

/// What the board measured besides the encoders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Battery voltage, V, where it is measured.
    pub supply: Option<f32>,
    /// The emergency-stop circuit is open.
    pub estop: bool,
}

/// Motor power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    Enabled,
    /// Stopping, off at rest.
    Disabling,
    Disabled,
}

/// One axis in a snapshot; m or rad, and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisSnapshot {
    /// State of the axis machine.
    pub state: State,
    /// Displacement since the last command, S or α.
    pub displacement: f64,
    /// Reference minus displacement.
    pub error: f32,
    /// Measured speed.
    pub speed: f32,
    /// Reference speed.
    pub reference_speed: f32,
    /// Measured acceleration.
    pub acceleration: f32,
}

/// All that is known after a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// The tick's instant.
    pub time: Instant,
    /// How many requests have been carried out since start-up, modulo 2³².
    pub requests: u32,
    /// Odometry.
    pub estimator: Estimator,
    /// Translation.
    pub translation: AxisSnapshot,
    /// Rotation.
    pub rotation: AxisSnapshot,
    /// Wheels, left first.
    pub wheels: [Wheel; 2],
    /// Battery voltage, filtered, V.
    pub supply: f32,
    /// Motor power is on.
    pub enabled: bool,
    /// The latched fault.
    pub fault: Option<Fault>,
    /// The fault's cause persists.
    pub fault_persists: bool,
}

impl AxisSnapshot {
    /// s_ref or α_ref, counted as the displacement is.
    #[must_use]
    pub fn reference(&self) -> f64 {
        self.displacement + f64::from(self.error)
    }
}

impl Snapshot {
    /// True unless both axes hold and the wheels stand (below 1 mm/s).
    #[must_use]
    pub fn is_moving(&self) -> bool {
        const STANDSTILL: f32 = 1e-3;
        self.translation.state != State::Hold
            || self.rotation.state != State::Hold
            || self.wheels.iter().any(|w| w.speed.abs() > STANDSTILL)
    }
}

/// The control loop: estimator, two axes, and the vehicle that they drive.
#[derive(Debug)]
pub struct Controller<V: VirtualVehicle> {
    vehicle: V,
    config: Config<V::Config>,
    clock: Clock,
    estimator: Estimator,
    translation: Axis,
    rotation: Axis,
    motion: Motion,
    supply: f32,
    estop: bool,
    power: Power,
    /// Outputs are off until the first motion command, and after a fault until the next.
    active: bool,
    /// At rest within tolerance: the motors are left alone.
    resting: bool,
    fault: Option<Fault>,
    stopping: Option<StopReason>,
    requests: Deque<Request<V::Config>, REQUESTS>,
    carried_out: u32,
    time: Instant,
}

/// How many requests can wait for a tick.
pub const REQUESTS: usize = 4;
/// Time constant of the supply's filter, s.
const SUPPLY_FILTER: f32 = 0.05;
/// The supply that is assumed is never below this share of the nominal one: a broken sense wire must not multiply the duty.
const SUPPLY_FLOOR: f32 = 0.5;
/// In HOLD the motors rest once the error is below this share of the tolerance …
const REST_BELOW: f32 = 0.3;
/// … and work again when it exceeds this one.
const REST_UNTIL: f32 = 0.6;

impl<V: VirtualVehicle<Config: Copy>> Controller<V> {
    /// Takes the vehicle over. `fault` is one that the start-up found, such as a watchdog reset.
    pub fn new(vehicle: V, config: Config<V::Config>, fault: Option<Fault>) -> Self {
        Self {
            vehicle,
            config,
            clock: Clock::new(config.period),
            estimator: Estimator::new(config.noise),
            translation: Axis::default(),
            rotation: Axis::default(),
            motion: Motion::default(),
            supply: config.nominal_supply,
            estop: false,
            power: Power::Enabled,
            active: false,
            resting: false,
            fault,
            stopping: None,
            requests: Deque::new(),
            carried_out: 0,
            time: Instant::from_ticks(0),
        }
    }

    /// Hands a request over for the next tick.
    ///
    /// # Errors
    /// Returns the request if four are waiting already; an [`Interface`] never has more than one under way.
    pub fn request(&mut self, request: Request<V::Config>) -> Result<(), Request<V::Config>> {
        self.requests.push_back(request)
    }

    /// One cycle of the control loop. Call it every `period`; a late, missed or double call loses no counts and steps no reference.
    pub fn tick(&mut self, now: Instant, inputs: &Inputs) -> Events {
        let mut events = Events::new();
        let elapsed = self.clock.tick(now);
        self.time = now;
        self.measure_supply(inputs.supply);

        self.motion = self.vehicle.sense(elapsed.seconds);
        let increment = self.motion.increment;
        self.estimator.advance(increment, self.vehicle.resolution());
        self.translation
            .measure(increment.translation, elapsed.steps);
        self.rotation.measure(increment.rotation, elapsed.steps);

        self.estop = inputs.estop;
        if inputs.estop {
            self.trip(Fault::Estop, &mut events);
        }
        while let Some(request) = self.requests.pop_front() {
            self.carry_out(request, &mut events);
            self.carried_out = self.carried_out.wrapping_add(1);
        }

        if self.active {
            self.advance(elapsed.steps, &mut events);
        }
        // Not `else`: a stop that has come to rest may just have ended the activity.
        if !self.active {
            self.translation.release();
            self.rotation.release();
            if self.vehicle.off().is_err() {
                self.trip(Fault::Output, &mut events);
            }
        }
        events
    }

    /// What is known, after a tick.
    pub fn snapshot(&self) -> Snapshot {
        let axis = |axis: &Axis, speed, acceleration| AxisSnapshot {
            state: axis.state(),
            displacement: axis.displacement(),
            error: axis.error(),
            speed,
            reference_speed: axis.reference_speed(),
            acceleration,
        };
        let Motion {
            speed,
            acceleration,
            ..
        } = self.motion;
        Snapshot {
            time: self.time,
            requests: self.carried_out,
            estimator: self.estimator,
            translation: axis(
                &self.translation,
                speed.translation,
                acceleration.translation,
            ),
            rotation: axis(&self.rotation, speed.rotation, acceleration.rotation),
            wheels: self.vehicle.wheels(),
            supply: self.supply,
            enabled: self.power == Power::Enabled,
            fault: self.fault,
            fault_persists: self.fault == Some(Fault::Estop) && self.estop,
        }
    }

    fn measure_supply(&mut self, supply: Option<f32>) {
        let nominal = self.config.nominal_supply;
        let measured = supply.filter(|v| v.is_finite()).unwrap_or(nominal);
        let period = self.config.translation.period;
        self.supply += (measured - self.supply) * period / (SUPPLY_FILTER + period);
    }

    fn carry_out(&mut self, request: Request<V::Config>, events: &mut Events) {
        match request {
            Request::Move(command) if self.may_move() => {
                self.wake();
                self.translation.command(command);
            }
            Request::Turn(command) if self.may_move() => {
                self.wake();
                self.rotation.command(command);
            }
            // A fault came between the command's acceptance and this tick.
            Request::Move(_) | Request::Turn(_) => {}
            Request::Stop => self.stop(StopReason::Command, events),
            Request::EStop => self.trip(Fault::Estop, events),
            Request::ClearFault => {
                if !(self.fault == Some(Fault::Estop) && self.estop) {
                    self.fault = None;
                }
            }
            Request::Enable => self.power = Power::Enabled,
            Request::Disable => {
                self.power = Power::Disabling;
                self.stop(StopReason::Disable, events);
            }
            Request::Correct(correction) => self.estimator.apply(&correction),
            Request::Configure(config) => {
                self.estimator.set_noise(config.noise);
                self.vehicle.configure(&config.vehicle);
                self.config = config;
            }
        }
    }

    fn may_move(&self) -> bool {
        self.fault.is_none() && self.power == Power::Enabled
    }

    fn wake(&mut self) {
        self.active = true;
        self.resting = false;
        self.stopping = None;
    }

    fn stop(&mut self, reason: StopReason, events: &mut Events) {
        if !self.active {
            self.translation = Axis::default();
            self.rotation = Axis::default();
            self.come_to_rest(reason, events);
            return;
        }
        let stop = |acceleration| AxisCommand {
            distance: 0.0,
            speed: 0.0,
            acceleration,
        };
        self.resting = false;
        self.stopping = Some(reason);
        self.translation
            .command(stop(self.config.stop_acceleration));
        self.rotation
            .command(stop(self.config.stop_turn_acceleration));
    }

    fn come_to_rest(&mut self, reason: StopReason, events: &mut Events) {
        self.stopping = None;
        if self.power == Power::Disabling {
            self.power = Power::Disabled;
            self.active = false;
        }
        note(events, Event::Stopped(reason));
    }

    fn trip(&mut self, fault: Fault, events: &mut Events) {
        self.active = false;
        self.stopping = None;
        if self.power == Power::Disabling {
            self.power = Power::Disabled;
        }
        if self.fault.is_none() {
            self.fault = Some(fault);
            note(events, Event::Fault(fault));
        }
    }

    fn advance(&mut self, steps: u32, events: &mut Events) {
        let speed = self.motion.speed;
        let moved = self
            .translation
            .advance(&self.config.translation, speed.translation, steps);
        if let Some(AxisEvent::Done(residual)) = moved {
            note(events, Event::MoveDone(residual));
        }
        let turned = self
            .rotation
            .advance(&self.config.rotation, speed.rotation, steps);
        if let Some(AxisEvent::Done(residual)) = turned {
            note(events, Event::TurnDone(residual));
        }
        if let Some(reason) = self.stopping
            && self.translation.is_settled()
            && self.rotation.is_settled()
        {
            self.come_to_rest(reason, events);
        }
        if !self.active {
            return;
        }
        self.resting = self.may_rest();
        let driven = if self.resting {
            self.vehicle.off()
        } else {
            self.drive()
        };
        if driven.is_err() {
            self.trip(Fault::Output, events);
        }
    }

    /// HOLD with hysteresis: between stiction and the gears' play an integral would hunt for ever.
    fn may_rest(&self) -> bool {
        let within = |axis: &Axis, config: &AxisConfig, speed: f32| {
            let share = if self.resting { REST_UNTIL } else { REST_BELOW };
            axis.is_settled()
                && axis.error().abs() < share * config.tolerance
                && (self.resting || speed.abs() < config.rest_speed)
        };
        let Twist {
            translation,
            rotation,
        } = self.motion.speed;
        within(&self.translation, &self.config.translation, translation)
            && within(&self.rotation, &self.config.rotation, rotation)
    }

    fn drive(&mut self) -> Result<(), crate::vehicle::OutputError> {
        let config = &self.config;
        let speed = Twist {
            translation: self.translation.velocity(&config.translation),
            rotation: self.rotation.velocity(&config.rotation),
        };
        let acceleration = Twist {
            translation: self.translation.acceleration(),
            rotation: self.rotation.acceleration(),
        };
        let supply = self.supply.max(SUPPLY_FLOOR * config.nominal_supply);
        self.vehicle
            .drive(speed, acceleration, supply, config.translation.period)
    }
}

/// A tick has at most a fault, a stop and two targets to tell, so the list cannot overflow.
fn note(events: &mut Events, event: Event) {
    let _ = events.push(event);
}
