//! A whole base on ideal parts: controller, desk and interpreter at 1 kHz; its wheels roll and its steering turns as the plan says.

use super::{PERIOD, Wires};
use vehicle_controller::controller::{Controller, Inputs, Interface, Snapshot};
use vehicle_controller::interpreter::{Desk, Identity, Interpreter};
use vehicle_controller::map::Atlas;
use vehicle_controller::params::{Blueprint, Params};
use vehicle_controller::time::{self, Instant};
use vehicle_controller::vehicle::VirtualVehicle;

pub struct Base<V: VirtualVehicle<Config: Blueprint>> {
    controller: Controller<V>,
    desk: Desk<V::Config>,
    interpreter: Interpreter,
    atlas: Atlas,
    wires: Wires,
    now: Instant,
    said: Vec<u8>,
    /// The steering turns this fast, rad/s.
    pub rate: f32,
}

impl<V: VirtualVehicle<Config: Blueprint>> Base<V> {
    pub fn new((vehicle, wires): (V, Wires), params: &Params) -> Self {
        let mut controller = Controller::new(vehicle, params.build(PERIOD), None);
        let now = Instant::from_ticks(0);
        controller.tick(now, &Inputs::default());
        let identity = Identity {
            target: "test",
            reset_cause: "power-on",
            period: PERIOD,
        };
        Self {
            desk: Interface::new(controller.snapshot(), params.limits()),
            controller,
            interpreter: Interpreter::new(identity, *params),
            atlas: Atlas::new(),
            wires,
            now,
            said: Vec::new(),
            rate: f32::INFINITY,
        }
    }

    /// A period.
    pub fn tick(&mut self) {
        let dt = time::seconds(PERIOD);
        for wheel in &self.wires.wheels {
            wheel.roll(wheel.0.speed.get() * f64::from(dt));
        }
        let pointer = &self.wires.pointer;
        if !pointer.off.get() {
            let left = pointer.told.get() - pointer.is.get();
            let step = left.clamp(-self.rate * dt, self.rate * dt);
            pointer.is.set(pointer.is.get() + step);
        }
        self.poll();
        self.now = time::after(self.now, PERIOD);
        for event in self.controller.tick(self.now, &Inputs::default()) {
            self.interpreter.notify(*event);
        }
        self.desk.update(self.controller.snapshot());
        while self.desk.work() {}
        self.poll();
    }

    fn poll(&mut self) {
        self.interpreter.poll(&mut self.desk, &mut self.atlas);
        while let Some(request) = self.desk.take_request() {
            self.controller.request(request).expect("there is room");
        }
        self.said
            .extend(std::iter::from_fn(|| self.interpreter.transmit()));
    }

    pub fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1000.0).round() as u32 {
            self.tick();
        }
    }

    /// Sends a line, and gives what is said in the tick after it.
    pub fn ask(&mut self, line: &str) -> String {
        self.lines();
        self.say(line);
        self.tick();
        self.lines().pop().unwrap_or_default()
    }

    /// Sends a line.
    pub fn say(&mut self, line: &str) {
        for byte in line.bytes().chain([b'\n']) {
            self.interpreter.receive(byte);
        }
    }

    /// What has been said since the last time.
    pub fn lines(&mut self) -> Vec<String> {
        let said = String::from_utf8(std::mem::take(&mut self.said)).expect("it is ASCII");
        said.lines().map(str::to_owned).collect()
    }

    /// All that the interpreter keeps, written so that what is different looks different.
    pub fn kept(&self) -> String {
        format!("{:?}", self.interpreter)
    }

    pub fn snapshot(&self) -> &Snapshot {
        self.desk.snapshot()
    }

    pub fn wires(&self) -> &Wires {
        &self.wires
    }
}
