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
pub mod belief;
mod clock;
mod compound;
pub mod correction;
pub mod estimator;
mod history;
mod interface;
mod messages;
pub mod profile;
mod reckoning;
mod refusal;
mod sensing;
mod snapshot;
mod steered;
mod stopping;
mod stretch;

pub use axis::{Axis, AxisCommand, AxisConfig, Cycle, State};
pub use belief::Belief;
pub use correction::CorrectionError;
pub use estimator::{Estimate, Estimator, Noise, Odometer, Passage, Pose};
pub use history::MAX_AGE;
pub use interface::{Interface, Limits, Observation, Procedure};
pub use messages::{Action, Config, Event, Events, NoRoom, REQUESTS, Request, StopReason};
pub use refusal::Refusal;
pub use sensing::{Inputs, Sensing};
pub use snapshot::{AxisSnapshot, Snapshot};
pub use stretch::Stretch;

use crate::supervisor::{Fault, Place, Supervisor};
use crate::time::{self, Instant};
use crate::vehicle::gains::OFFSETS;
use crate::vehicle::{Motion, OutputError, Twist, VirtualVehicle};
use axis::AxisEvent;
use clock::{Clock, Elapsed};
use heapless::Deque;
use sensing::Readings;
use steered::Steered;

/// Motor power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Power {
    Enabled,
    /// Stopping, off at rest.
    Disabling,
    Disabled,
}

/// What the motors do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motors {
    /// Nothing: until the first motion command, and after a fault or Disable until the next. Their drivers are off too, once the wheels have had
    /// [`BRAKING`] to come to rest.
    Off,
    /// They follow the axes.
    Driving,
    /// Nothing, because both axes hold within tolerance.
    Resting,
}

/// The control loop: estimator, two axes, and the vehicle that they drive.
#[derive(Debug)]
pub struct Controller<V: VirtualVehicle> {
    vehicle: V,
    config: Config<V::Config>,
    clock: Clock,
    /// The nominal period, s.
    period: f32,
    estimator: Estimator,
    translation: Axis,
    rotation: Axis,
    motion: Motion,
    readings: Readings,
    /// The outputs could not be switched off.
    output_failed: bool,
    power: Power,
    motors: Motors,
    /// So long are the bridges still to short the motors that were switched off, s.
    braking: f32,
    supervisor: Supervisor,
    fault: Option<Fault>,
    stopping: Option<StopReason>,
    /// A stop for a fault's sake has so long, s.
    deadline: f32,
    requests: Deque<Request<V::Config>, REQUESTS>,
    ticket: u32,
    /// An emergency stop was asked for; the last ticket of one.
    emergency: bool,
    emergency_ticket: u32,
    emergency_done: u32,
    /// How much of the wanted speed the references have.
    share: f32,
    steered: Steered,
    time: Instant,
    events: Events,
}

/// Motors that are switched off brake for this long before their drivers are switched off, s: longer than any base takes to stop with shorted motors.
const BRAKING: f32 = 0.5;
/// Relative change of the wheels' limit that is taken for ripple of the battery voltage.
const SHARE_RIPPLE: f32 = 0.02;
/// In HOLD the motors rest once the error is below this share of the tolerance …
const REST_BELOW: f32 = 0.3;
/// … and work again when it exceeds this one.
const REST_UNTIL: f32 = 0.6;

/// What motors do cannot be compared with duties that nobody knows: every motion would be a fault.
fn without_unknown_duty<V: VirtualVehicle>(config: &mut Config<V::Config>, vehicle: &V) {
    if !vehicle.knows_duty() {
        config.supervision.motor.speed_gain = 0.0;
    }
}

impl<V: VirtualVehicle<Config: Copy>> Controller<V> {
    /// Takes the vehicle over. `fault` is one that the start-up found, such as a watchdog reset.
    pub fn new(vehicle: V, mut config: Config<V::Config>, fault: Option<Fault>) -> Self {
        without_unknown_duty(&mut config, &vehicle);
        let mut estimator = Estimator::new(config.noise);
        estimator.configure(&config, vehicle.influence());
        Self {
            vehicle,
            config,
            clock: Clock::new(config.period),
            period: time::seconds(config.period),
            estimator,
            translation: Axis::default(),
            rotation: Axis::default(),
            motion: Motion::default(),
            readings: Readings::new(&config.sensing),
            output_failed: false,
            power: Power::Enabled,
            motors: Motors::Off,
            braking: 0.0,
            supervisor: Supervisor::default(),
            fault,
            stopping: None,
            deadline: f32::INFINITY,
            requests: Deque::new(),
            ticket: 0,
            emergency: false,
            emergency_ticket: 0,
            emergency_done: 0,
            share: 1.0,
            steered: Steered::default(),
            time: Instant::from_ticks(0),
            events: Events::new(),
        }
    }

    /// Hands a request over for the next tick: one of the [`Interface`]'s, or an [`Action`] of anybody's.
    ///
    /// # Errors
    /// [`NoRoom`] if four are waiting already; an [`Interface`] has at most one under way. An emergency stop and a sign of life need no room.
    pub fn request(&mut self, request: impl Into<Request<V::Config>>) -> Result<(), NoRoom> {
        let request = request.into();
        self.supervisor.sign_of_life();
        if let Action::EStop = request.action {
            self.emergency = true;
            self.emergency_ticket = request.ticket.unwrap_or(self.emergency_ticket);
            return Ok(());
        }
        if let (Action::Live, None) = (request.action, request.ticket) {
            return Ok(());
        }
        self.requests.push_back(request).map_err(|_| NoRoom)
    }

    /// One cycle of the control loop; returns what happened in it. Call it every `period`; a late, missed or double call loses no counts and steps no reference.
    pub fn tick(&mut self, now: Instant, inputs: &Inputs) -> &[Event] {
        self.events.clear();
        let elapsed = self.clock.tick(now);
        self.time = now;
        self.readings
            .update(&self.config.sensing, inputs, self.period);

        self.motion = self.vehicle.sense(elapsed.seconds);
        let increment = self.counted(elapsed.seconds);
        if self.vehicle.steers() {
            self.estimator.set_influence(self.vehicle.influence());
        }
        self.estimator.advance(increment, self.vehicle.resolution());
        self.translation
            .measure(increment.translation, elapsed.steps);
        self.rotation.measure(increment.rotation, elapsed.steps);

        if self.readings.estop {
            self.trip(Fault::Estop, Place::Base);
        }
        if self.motors != Motors::Off {
            self.supervise(elapsed);
        }
        // In a cycle that is not due yet the references stand between two steps.
        while elapsed.steps > 0 && self.carry_out_next() {}
        // An emergency stop waits for no cycle, and has the last word: what was asked before it and still waits for one moves nothing.
        if core::mem::take(&mut self.emergency) {
            for request in &mut self.requests {
                if request.action.may_move() {
                    request.action = Action::Live;
                }
            }
            self.trip(Fault::Estop, Place::Base);
            self.emergency_done = self.emergency_ticket;
        }

        if self.motors != Motors::Off {
            self.advance(elapsed);
        }
        // Not `else`: a stop that has come to rest may just have ended the activity.
        if self.motors == Motors::Off {
            self.translation.release();
            self.rotation.release();
            let off = if self.braking > 0.0 {
                self.braking -= elapsed.seconds;
                let braked = self.vehicle.brake();
                if braked.is_err() {
                    // What cannot be told to brake may still be driven: then its driver is off at once.
                    self.braking = 0.0;
                    let _ = self.vehicle.off();
                }
                braked
            } else {
                self.vehicle.off()
            };
            self.output_failed = off.is_err();
            if self.output_failed {
                self.trip(Fault::Output, Place::Base);
            }
        }
        &self.events
    }

    /// What is known, after a tick.
    pub fn snapshot(&self) -> Snapshot {
        let mut snapshot = Snapshot::new(&self.estimator);
        self.update_snapshot(&mut snapshot);
        snapshot
    }

    /// The same, into an earlier snapshot of this controller, which spares copying what has not changed.
    pub fn update_snapshot(&self, snapshot: &mut Snapshot) {
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
        self.estimator.update_copy(&mut snapshot.estimator);
        snapshot.time = self.time;
        snapshot.ticket = self.ticket;
        snapshot.emergency_ticket = self.emergency_done;
        snapshot.translation = axis(
            &self.translation,
            speed.translation,
            acceleration.translation,
        );
        snapshot.rotation = axis(&self.rotation, speed.rotation, acceleration.rotation);
        snapshot.wheels = self.vehicle.wheels();
        if self.vehicle.steers() {
            snapshot.steering = [self.vehicle.steering(); OFFSETS];
        }
        snapshot.supply = self.readings.supply;
        snapshot.currents = self.readings.currents;
        snapshot.enabled = self.power == Power::Enabled;
        snapshot.fault = self.fault;
        snapshot.fault_persists = self.fault_persists();
    }

    /// Carries out the request that has waited longest, if any. It is read where it lies: the largest take as long to copy as to carry out.
    fn carry_out_next(&mut self) -> bool {
        let Some(Request { action, ticket }) = self.requests.front() else {
            return false;
        };
        let ticket = ticket.unwrap_or(self.ticket);
        match action {
            Action::Move(command) if self.may_move() => {
                let command = *command;
                self.wake();
                self.translation.command(&self.config.translation, command);
            }
            Action::Turn(command) if self.may_move() => {
                let command = *command;
                self.wake();
                self.rotation.command(&self.config.rotation, command);
            }
            // A fault came between the command's acceptance and this tick.
            Action::Move(_) | Action::Turn(_) | Action::Live => {}
            Action::Stop => self.stop(StopReason::Command),
            // Never queued: see `request`.
            Action::EStop => self.trip(Fault::Estop, Place::Base),
            Action::ClearFault => {
                if !self.fault_persists() {
                    self.fault = None;
                }
            }
            Action::Enable => {
                self.power = Power::Enabled;
                if self.stopping == Some(StopReason::Disable) {
                    // What Disable wanted is taken back, not what a fault wants.
                    self.stopping = Some(if self.fault.is_some() {
                        StopReason::Fault
                    } else {
                        StopReason::Command
                    });
                }
            }
            Action::Disable => {
                self.power = Power::Disabling;
                self.stop(StopReason::Disable);
            }
            Action::Correct(correction) => {
                if correction.gains() != self.estimator.calibration().gains {
                    self.vehicle.set_gains(correction.gains());
                }
                self.estimator.apply(correction, self.vehicle.influence());
            }
            Action::Configure(config) => {
                if config.period != self.config.period {
                    self.clock = Clock::new(config.period);
                }
                self.period = time::seconds(config.period);
                self.vehicle.configure(&config.vehicle);
                let influence = self.vehicle.influence();
                self.estimator.configure(config, influence);
                self.config = *config;
                without_unknown_duty(&mut self.config, &self.vehicle);
            }
        }
        self.ticket = ticket;
        self.requests.pop_front();
        true
    }

    fn may_move(&self) -> bool {
        self.fault.is_none() && !self.readings.estop && self.power == Power::Enabled
    }

    fn wake(&mut self) {
        if self.motors == Motors::Off {
            let wheels = self.vehicle.wheels();
            self.supervisor.start(&wheels);
        }
        self.motors = Motors::Driving;
        self.stopping = None;
    }

    fn advance(&mut self, elapsed: Elapsed) {
        let steps = elapsed.steps;
        let period = self.period;
        let supply = self.readings.usable;
        // Mostly there is room for both at their fastest, and nothing to work out.
        let fastest = Twist {
            translation: self.translation.fastest_speed(),
            rotation: self.rotation.fastest_speed(),
        };
        let mut share = self.vehicle.share(fastest, supply);
        if share < 1.0 {
            let wanted = Twist {
                translation: self.translation.wanted_speed(),
                rotation: self.rotation.wanted_speed(),
            };
            share = self.vehicle.share(wanted, supply);
        }
        // Down at once, up only by more than the battery's ripple: a reference at the limit would follow that, and never cruise.
        if share < self.share || share > self.share * (1.0 + SHARE_RIPPLE) {
            self.share = share;
        }
        let (mut share, mut turn_share) = (self.share, self.share);
        if self.vehicle.steers() {
            [share, turn_share] = self.steered_shares(share);
        }
        let cycle = |speed, share| Cycle {
            period,
            steps,
            speed,
            share,
        };
        let speed = self.motion.speed;
        let moved = self
            .translation
            .advance(&self.config.translation, &cycle(speed.translation, share));
        if let Some(AxisEvent::Done(residual)) = moved {
            self.note(Event::MoveDone(residual));
        }
        if self.vehicle.steers() {
            self.end_turn_at_rest();
        }
        let turned = self
            .rotation
            .advance(&self.config.rotation, &cycle(speed.rotation, turn_share));
        if let Some(AxisEvent::Done(residual)) = turned {
            self.note(Event::TurnDone(residual));
        }
        if self.vehicle.steers() && share == 0.0 {
            self.translation.set_out();
            self.rotation.set_out();
        }
        if let Some(reason) = self.stopping {
            if reason == StopReason::Fault {
                self.deadline -= elapsed.seconds;
            }
            if self.deadline < 0.0 || (self.translation.is_settled() && self.rotation.is_settled())
            {
                self.come_to_rest(reason);
            }
        }
        if self.motors == Motors::Off {
            return;
        }
        let driven = if self.may_rest() {
            self.motors = Motors::Resting;
            self.rest(supply)
        } else {
            self.motors = Motors::Driving;
            // A tick that is not due yet was driven for by the last one. One that was missed is not made up for at once: what the reference has gone in it
            // is an error now, and is taken out as one.
            self.drive(supply, if steps > 0 { period } else { 0.0 })
        };
        if driven.is_err() {
            self.trip(Fault::Output, Place::Base);
        }
    }

    /// HOLD with hysteresis: between stiction and the gears' play an integral would hunt for ever.
    fn may_rest(&self) -> bool {
        let resting = self.motors == Motors::Resting;
        let within = |axis: &Axis, config: &AxisConfig, speed: f32| {
            let share = if resting { REST_UNTIL } else { REST_BELOW };
            axis.is_settled()
                && (resting || !self.vehicle.knows_duty() || !self.vehicle.holds_load())
                && axis.error().abs() < share * config.tolerance
                && (resting || speed.abs() < config.rest_speed)
        };
        let Twist {
            translation,
            rotation,
        } = self.motion.speed;
        let heading = || {
            if self.vehicle.steers() {
                self.rotation.is_settled()
            } else {
                within(&self.rotation, &self.config.rotation, rotation)
            }
        };
        within(&self.translation, &self.config.translation, translation) && heading()
    }

    /// Motors with controllers of their own stay where they are. Only letting go would tell whether they hold a load; and corrected for ever, by less than
    /// a count, they would step to and fro.
    fn rest(&mut self, supply: f32) -> Result<(), OutputError> {
        if self.vehicle.knows_duty() {
            self.vehicle.brake()
        } else {
            self.vehicle.drive(Twist::ZERO, Twist::ZERO, supply, 0.0)
        }
    }

    fn drive(&mut self, supply: f32, dt: f32) -> Result<(), OutputError> {
        let period = self.period;
        let speed = if self.vehicle.steers() {
            self.steered_speed(dt)
        } else {
            let config = &self.config;
            Twist {
                translation: self.translation.velocity(&config.translation, period),
                rotation: self.rotation.velocity(&config.rotation, period),
            }
        };
        let acceleration = Twist {
            translation: self.translation.acceleration(),
            rotation: self.rotation.acceleration(),
        };
        self.vehicle.drive(speed, acceleration, supply, dt)
    }

    /// A tick has at most a stop for each request, two targets, a stop that comes to rest and a fault of each rank to tell, so the list cannot overflow.
    fn note(&mut self, event: Event) {
        let _ = self.events.push(event);
    }
}
