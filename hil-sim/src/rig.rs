//! The rig: plant, fake peripherals, the real controller and interpreter, and a serial line, all in one simulated time.

use crate::faults::{Fault, FaultSet, FaultyLink};
use crate::peripherals::{FakeDrive, FakeQei, Wires, converted};
use crate::plant::{Command, Input, Plant, Push};
use crate::robot::{Model, Robot};
use crate::trace::Row;
use anyhow::{Result, bail};
use std::rc::Rc;
use vehicle_controller::controller::{Controller, Inputs, Interface, Snapshot};
use vehicle_controller::interpreter::{Desk, Identity, Interpreter};
use vehicle_controller::params::Params;
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::DifferentialDrive;

/// The vehicle of every simulated robot.
pub type Vehicle = DifferentialDrive<FakeQei, FakeQei, FakeDrive, FakeDrive>;

/// The period of the control loop.
pub const PERIOD: Duration = Duration::millis(1);
/// Plant steps in a period.
pub const SUBSTEPS: u32 = 4;
/// A simulated base, complete.
#[derive(Debug)]
pub struct Rig {
    plant: Plant,
    wires: [Rc<Wires>; 2],
    faults: FaultSet,
    ideal: bool,
    /// None if the battery is not measured.
    battery_divider: Option<f64>,
    controller: Controller<Vehicle>,
    desk: Desk,
    interpreter: Interpreter,
    now: Instant,
    push: Push,
    push_until: Instant,
    estop: bool,
    serial: FaultyLink,
}

/// A vehicle on fake peripherals.
///
/// # Errors
/// None: the fakes never refuse.
pub fn vehicle(wires: &[Rc<Wires>; 2], robot: &Robot, params: &Params) -> Result<Vehicle> {
    let config = params.build(PERIOD).vehicle;
    let drive = |wheel: usize| -> Result<FakeDrive> {
        let wires = Rc::clone(&wires[wheel]);
        Ok(match robot.model {
            Model::Dynamic => FakeDrive::bridge(wires, config.servo[wheel])?,
            Model::Ideal => FakeDrive::Ideal(wires),
        })
    };
    let qei = |wheel: usize| FakeQei::new(Rc::clone(&wires[wheel]), robot.narrow_counters);
    Ok(DifferentialDrive::new(
        qei(0),
        qei(1),
        drive(0)?,
        drive(1)?,
        &config,
    ))
}

impl Rig {
    /// Powers a robot up. The same robot and seed give the same run, bit for bit.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn new(robot: &Robot, seed: u64) -> Result<Self> {
        let plant = Plant::new(&robot.physics, seed);
        let wires = [Rc::new(Wires::default()), Rc::new(Wires::default())];
        let faults = FaultSet::new(&plant, seed);
        for (wires, count) in wires.iter().zip(plant.counts()) {
            wires.edges.set(count);
        }
        let vehicle = vehicle(&wires, robot, &robot.params)?;
        let mut controller = Controller::new(vehicle, robot.params.build(PERIOD), None);
        let now = Instant::from_ticks(0);
        let ideal = robot.model == Model::Ideal;
        let battery_divider = (!ideal).then_some(robot.physics.battery.divider);
        controller.tick(now, &convert(&plant, battery_divider));
        let desk = Interface::new(controller.snapshot(), robot.params.limits());
        let identity = Identity {
            target: "hil-sim",
            reset_cause: "power-on",
            period: PERIOD,
        };
        Ok(Self {
            plant,
            wires,
            faults,
            ideal,
            battery_divider,
            controller,
            desk,
            interpreter: Interpreter::new(identity, robot.params),
            now,
            push: Push::default(),
            push_until: now,
            estop: false,
            serial: FaultyLink::default(),
        })
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
            Fault::LinkCut => self.serial.set_cut(true),
            Fault::FlashCut(_) => bail!("this base has no parameter storage"),
            fault => self.faults.inject(fault, &mut self.plant)?,
        }
        Ok(())
    }

    /// All that was wrong is well. The encoders count on from where they are.
    pub fn clear_faults(&mut self) {
        self.faults.clear(&mut self.plant);
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
        self.advance_plant();
        self.serial.advance(PERIOD);
        self.interpreter.receive_from(&mut self.serial);
        self.interpret();
        self.now = time::after(self.now, PERIOD);
        let inputs = Inputs {
            estop_open: self.estop,
            ..analog
        };
        for event in self.controller.tick(self.now, &inputs) {
            self.interpreter.notify(*event);
        }
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
        self.interpret();
        self.interpreter.transmit_to(&mut self.serial);
    }

    fn advance_plant(&mut self) {
        let push = if self.now < self.push_until {
            self.push
        } else {
            Push::default()
        };
        let [left, right] = &self.wires;
        let command = if self.ideal {
            Command::Speed([f64::from(left.speed.get()), f64::from(right.speed.get())])
        } else {
            self.faults.bridges([left.bridge(), right.bridge()])
        };
        let input = Input { command, push };
        let dt = PERIOD.ticks() as f64 * 1e-6 / f64::from(SUBSTEPS);
        for _ in 0..SUBSTEPS {
            self.plant.step(dt, &input);
        }
        let counts = self.plant.counts();
        left.edges.set(self.faults.encoders[0].show(counts[0]));
        right.edges.set(self.faults.encoders[1].show(counts[1]));
    }

    fn interpret(&mut self) {
        self.interpreter.poll(&mut self.desk);
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
        Row {
            t: snapshot.time.ticks() as f64 * 1e-6,
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
        }
    }
}

/// What the converter makes of the analog inputs. Nobody measures the battery of an ideal robot.
fn convert(plant: &Plant, battery_divider: Option<f64>) -> Inputs {
    Inputs {
        battery: battery_divider.map(|divider| converted(plant.bus_voltage() / divider)),
        currents: plant.current_signal().map(|volts| Some(converted(volts))),
        ..Inputs::default()
    }
}
