//! The rig: plant, fake peripherals, the real controller and interpreter, and a serial line, all in one simulated time.

use crate::faults::{Fault, FaultSet, FaultyLink};
use crate::motor_controller::MotorController;
use crate::peripherals::{FakeFlash, Harness, Wires, converted};
use crate::plant::{BridgeInput, Command, Input, Plant, Push};
use crate::robot::{Drives, Model, Robot};
use crate::trace::Row;
use crate::vehicle::{Desk, Vehicle, steers, vehicle};
use anyhow::{Result, bail};
use vehicle_controller::controller::{Controller, Event, Inputs, Interface, Snapshot};
use vehicle_controller::interpreter::{Identity, Interpreter};
use vehicle_controller::map::Atlas;
use vehicle_controller::params::store::Store;
use vehicle_controller::supervisor::{self, Place};
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::Kind;
use vehicle_controller::vehicle::gains::OFFSET;

/// The period of the control loop.
pub const PERIOD: Duration = Duration::millis(1);
/// Plant steps in a period.
pub const SUBSTEPS: u32 = 4;
/// How long an erase of the parameters' flash takes, in periods.
const ERASE_PERIODS: u64 = 250;
/// Words of it that are written in a period, at most: idle comes around every few tens of microseconds.
const STORE_STEPS: u32 = 16;

/// A simulated base, complete.
#[derive(Debug)]
pub struct Rig {
    plant: Plant,
    harness: Harness,
    faults: FaultSet,
    /// Of the motors, if they have controllers of their own.
    controllers: Option<[MotorController; 2]>,
    robot: Robot,
    ideal: bool,
    /// None if the battery is not measured.
    battery_divider: Option<f64>,
    controller: Controller<Vehicle>,
    desk: Desk,
    interpreter: Interpreter,
    atlas: Atlas,
    store: Store<FakeFlash>,
    now: Instant,
    /// When the controller was powered up: its own time begins there.
    powered_up: Instant,
    push: Push,
    push_until: Instant,
    estop: bool,
    serial: FaultyLink,
}

impl Rig {
    /// Powers a robot up, with nothing stored: its parameters are its defaults. The same robot and seed give the same run, bit for bit.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn new(robot: &Robot, seed: u64) -> Result<Self> {
        Self::with_flash(robot, seed, FakeFlash::new(seed, ERASE_PERIODS))
    }

    /// The same with this in the flash of its parameters.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn with_flash(robot: &Robot, seed: u64, flash: FakeFlash) -> Result<Self> {
        let plant = Plant::new(&robot.physics, seed);
        let harness = Harness::default();
        let faults = FaultSet::new(&plant, seed);
        let controllers = match &robot.drives {
            Drives::Bridge => None,
            Drives::Speed(params) | Drives::Increment(params) => {
                Some([0, 1].map(|_| MotorController::new(params)))
            }
        };
        show(&harness, &plant, plant.counts());
        harness
            .steering
            .volts
            .set(converted(plant.steering_signal()));
        let now = Instant::from_ticks(0);
        let ideal = robot.model == Model::Ideal;
        let battery_divider = (!ideal).then_some(robot.physics.battery.divider);
        let inputs = convert(&plant, battery_divider);
        let Booted {
            controller,
            desk,
            interpreter,
            store,
        } = boot(robot, &harness, &inputs, flash)?;
        Ok(Self {
            plant,
            harness,
            faults,
            controllers,
            robot: robot.clone(),
            ideal,
            battery_divider,
            controller,
            desk,
            interpreter,
            atlas: Atlas::new(),
            store,
            now,
            powered_up: now,
            push: Push::default(),
            push_until: now,
            estop: false,
            serial: FaultyLink::default(),
        })
    }

    /// Power fails and comes back: all begins anew but the flash, the plant and what is on the wires to the base.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn power_cycle(&mut self) -> Result<()> {
        let mut flash = self.store.flash().clone();
        flash.power_on();
        let inputs = Inputs {
            estop_open: self.estop,
            ..convert(&self.plant, self.battery_divider)
        };
        let booted = boot(&self.robot, &self.harness, &inputs, flash)?;
        self.controller = booted.controller;
        self.desk = booted.desk;
        self.interpreter = booted.interpreter;
        self.atlas = Atlas::new();
        self.store = booted.store;
        self.powered_up = self.now;
        Ok(())
    }

    /// Power fails after so many further bytes written to the flash of the parameters, or milliseconds of an erase of it; the base then starts anew.
    pub fn cut_flash(&mut self, bytes: u64) {
        self.store.flash_mut().cut_after(bytes);
    }

    /// The flash of the parameters.
    pub fn flash(&self) -> &FakeFlash {
        self.store.flash()
    }

    /// Puts bytes on the line to the base; they arrive at 115 200 baud.
    pub fn send(&mut self, bytes: &[u8]) {
        self.serial.send(bytes);
    }

    /// Takes what has arrived from the base.
    pub fn receive(&mut self) -> Vec<u8> {
        self.serial.receive()
    }

    /// Bytes that have not reached the base yet.
    pub fn backlog(&self) -> usize {
        self.serial.backlog()
    }

    /// Pushes the base for some seconds: N along it, N·m about it.
    pub fn push(&mut self, force: f64, torque: f64, seconds: f64) {
        self.push = Push { force, torque };
        self.push_until = time::after(self.now, Duration::from_ticks((seconds * 1e6) as u64));
    }

    /// Opens the emergency-stop circuit, or closes it.
    pub fn set_estop(&mut self, open: bool) {
        self.estop = open;
    }

    /// Lets something go wrong from here on, in place of what was wrong with the same part.
    ///
    /// # Errors
    /// If this base has no such part.
    pub fn inject(&mut self, fault: Fault) -> Result<()> {
        match fault {
            Fault::Motor(..) | Fault::Battery(_) if self.ideal => {
                bail!("this robot's wheels turn as they are told: no motor or battery can fail")
            }
            Fault::Controller(side) => {
                let Some(controllers) = &mut self.controllers else {
                    bail!("this robot's motors have no controllers of their own");
                };
                for motor in side.wheels() {
                    controllers[motor].set_dead(true);
                }
            }
            Fault::LinkCut => self.serial.set_cut(true),
            Fault::FlashCut(bytes) => self.cut_flash(bytes),
            fault => self.faults.inject(fault, &mut self.plant)?,
        }
        Ok(())
    }

    /// All that was wrong is well. The encoders count on from where they are.
    pub fn clear_faults(&mut self) {
        self.faults.clear(&mut self.plant);
        for controller in self.controllers.iter_mut().flatten() {
            controller.set_dead(false);
        }
        self.serial.set_cut(false);
    }

    /// The simulated time.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// What the controller knows.
    pub fn snapshot(&self) -> &Snapshot {
        self.desk.snapshot()
    }

    /// What the drivers of the motors are told.
    pub fn bridges(&self) -> [BridgeInput; 2] {
        match &self.controllers {
            Some(controllers) => controllers.each_ref().map(MotorController::output),
            None => self.harness.wheels.each_ref().map(|wires| wires.bridge()),
        }
    }

    /// The wires of the wheels.
    pub fn wires(&self) -> [&Wires; 2] {
        self.harness.wheels.each_ref().map(|wires| &**wires)
    }

    /// The truth.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The truth, to meddle with.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// One period: the plant moves on and bytes travel, then the control loop ticks. A line that is complete before the tick takes effect in it, as it
    /// does on a board.
    pub fn tick(&mut self) {
        // Converted when the last tick had read the one before.
        let analog = convert(&self.plant, self.battery_divider);
        let steering = converted(self.plant.steering_signal());
        self.harness.steering.volts.set(steering);
        self.advance_plant();
        self.serial.advance(PERIOD);
        self.interpreter.receive_from(&mut self.serial);
        self.interpret();
        self.now = time::after(self.now, PERIOD);
        let inputs = Inputs {
            estop_open: self.estop,
            ..analog
        };
        let since_power_up = time::since(self.now, self.powered_up);
        let time = time::after(Instant::from_ticks(0), since_power_up);
        for event in self.controller.tick(time, &inputs) {
            self.interpreter.notify(*event);
        }
        self.deliver();
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
        self.interpret();
        self.interpreter.transmit_to(&mut self.serial);
        self.attend();
    }

    /// One period in which the board does nothing: it is in reset, or hangs. The plant moves on, and motor controllers hear nothing.
    pub fn tick_without_board(&mut self) {
        self.advance_plant();
        self.now = time::after(self.now, PERIOD);
    }

    /// Idle does what time there is for.
    fn attend(&mut self) {
        for _ in 0..STORE_STEPS {
            self.interpreter.attend(&mut self.store, &mut self.desk);
            if self.store.flash().is_off() {
                // The fakes never refuse.
                let _ = self.power_cycle();
            }
            if self.store.flash().is_erasing() {
                break;
            }
        }
    }

    fn advance_plant(&mut self) {
        let push = if self.now < self.push_until {
            self.push
        } else {
            Push::default()
        };
        let [left, right] = &self.harness.wheels;
        let command = if self.ideal {
            Command::Speed([f64::from(left.speed.get()), f64::from(right.speed.get())])
        } else {
            self.faults.bridges([left.bridge(), right.bridge()])
        };
        let mut input = Input {
            command,
            push,
            steering: self.harness.steering.pulse(),
        };
        let dt = PERIOD.ticks() as f64 * 1e-6 / f64::from(SUBSTEPS);
        for _ in 0..SUBSTEPS {
            if let Some([first, second]) = &mut self.controllers {
                let counts = self.plant.counts();
                let told = [first.step(counts[0], dt), second.step(counts[1], dt)];
                input.command = self.faults.bridges(told);
            }
            self.plant.step(dt, &input);
        }
        let [left, right] = self.plant.counts();
        let shown = [
            self.faults.encoders[0].show(left),
            self.faults.encoders[1].show(right),
        ];
        show(&self.harness, &self.plant, shown);
    }

    /// What the board has sent arrives at the motors' controllers.
    fn deliver(&mut self) {
        let counts = self.plant.counts();
        for (motor, controller) in self.controllers.iter_mut().flatten().enumerate() {
            controller.listen(&self.harness.wheels[motor].controller, counts[motor]);
        }
    }

    fn interpret(&mut self) {
        self.interpreter.poll(&mut self.desk, &mut self.atlas);
        while let Some(request) = self.desk.take_request() {
            // There is room: a desk has one under way, and an emergency stop needs none.
            let _ = self.controller.request(request);
        }
    }

    /// A row of the trace.
    pub fn row(&self) -> Row {
        let snapshot = self.snapshot();
        let estimate = snapshot.estimator.present();
        let c = &estimate.covariance;
        let [true_x, true_y, true_theta] = self.plant.pose();
        let (translation, rotation) = (&snapshot.translation, &snapshot.rotation);
        let [left, right] = &snapshot.wheels;
        let [left_current, right_current] = self.plant.current();
        let offset = snapshot.estimator.calibration().gains[OFFSET];
        let kind = self.robot.params.vehicle();
        let (steers, has_front) = (steers(kind), kind == Kind::BiSteerable);
        let fronts = self
            .plant
            .front_counts()
            .map(|count| has_front.then_some(count));
        Row {
            t: self.now.ticks() as f64 * 1e-6,
            true_x,
            true_y,
            true_theta,
            est_x: estimate.pose.x,
            est_y: estimate.pose.y,
            est_theta: estimate.pose.theta,
            cxx: c.m11,
            cxy: c.m12,
            cxt: c.m13,
            cyy: c.m22,
            cyt: c.m23,
            ctt: c.m33,
            s: translation.displacement.to_f64(),
            s_ref: translation.reference(),
            v_s: f64::from(translation.speed),
            v_s_ref: f64::from(translation.reference_speed),
            alpha: rotation.displacement.to_f64(),
            alpha_ref: rotation.reference(),
            v_alpha: f64::from(rotation.speed),
            v_alpha_ref: f64::from(rotation.reference_speed),
            move_state: translation.state.name().to_owned(),
            turn_state: rotation.state.name().to_owned(),
            left_count: left.count,
            right_count: right.count,
            left_speed: f64::from(left.speed),
            right_speed: f64::from(right.speed),
            left_duty: f64::from(left.duty),
            right_duty: f64::from(right.duty),
            left_current,
            right_current,
            battery: f64::from(snapshot.supply),
            fault: snapshot
                .fault
                .map_or("none", |fault| fault.name())
                .to_owned(),
            steer: steers.then(|| f64::from(snapshot.steering() - offset)),
            true_steer: steers.then(|| self.plant.steering()),
            front_left_count: fronts[0],
            front_right_count: fronts[1],
        }
    }
}

/// Puts what the encoders show on their wires: these counts of the motors, and what the plant says of the others.
fn show(harness: &Harness, plant: &Plant, counts: [i64; 2]) {
    let wheels = harness.wheels.iter().zip(counts);
    for (wires, count) in wheels.chain(harness.front.iter().zip(plant.front_counts())) {
        wires.edges.set(count);
    }
    harness.steering.counts.edges.set(plant.steering_counts());
}

/// What starts with the power.
struct Booted {
    controller: Controller<Vehicle>,
    desk: Desk,
    interpreter: Interpreter,
    store: Store<FakeFlash>,
}

/// What the firmware does from power-on to its first tick.
fn boot(robot: &Robot, harness: &Harness, inputs: &Inputs, flash: FakeFlash) -> Result<Booted> {
    let mut store = Store::open(flash);
    let found = store.load_or_defaults(&robot.params);
    let params = &found.params;
    let vehicle = vehicle(harness, robot, params)?;
    let fault = found.lost.then_some(supervisor::Fault::Storage);
    let mut controller = Controller::new(vehicle, params.build(PERIOD), fault);
    controller.tick(Instant::from_ticks(0), inputs);
    let identity = Identity {
        target: "hil-sim",
        reset_cause: "power-on",
        period: PERIOD,
    };
    let mut interpreter = Interpreter::with_storage(identity, &robot.params, &found);
    if let Some(fault) = fault {
        interpreter.notify(Event::Fault(fault, Place::Base));
    }
    Ok(Booted {
        desk: Interface::new(controller.snapshot(), params.limits()),
        controller,
        interpreter,
        store,
    })
}

/// What the converter makes of the analog inputs. Nobody measures the battery of an ideal robot.
fn convert(plant: &Plant, battery_divider: Option<f64>) -> Inputs {
    Inputs {
        battery: battery_divider.map(|divider| converted(plant.bus_voltage() / divider)),
        currents: plant.current_signal().map(|volts| Some(converted(volts))),
        ..Inputs::default()
    }
}
