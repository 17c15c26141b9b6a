//! Motors that are switched off brake first; their drivers follow half a second later.

use std::cell::Cell;
use std::rc::Rc;
use vehicle_controller::controller::{Action, AxisCommand, Controller, Inputs};
use vehicle_controller::params::Params;
use vehicle_controller::time::{Duration, Instant};
use vehicle_controller::vehicle::{
    Motion, OutputError, Twist, VirtualVehicle, Wheel, differential,
};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Told {
    Drive,
    Brake,
    Off,
}

/// Remembers what its motors were told last.
struct Recorder {
    told: Rc<Cell<Told>>,
    /// Its PWM refuses to be written.
    refuses: bool,
}

impl VirtualVehicle for Recorder {
    type Config = differential::Config;

    fn configure(&mut self, _: &Self::Config) {}

    fn resolution(&self) -> Twist {
        Twist::ZERO
    }

    fn sense(&mut self, _: f32) -> Motion {
        Motion::default()
    }

    fn drive(&mut self, _: Twist, _: Twist, _: f32, _: f32) -> Result<(), OutputError> {
        self.told.set(Told::Drive);
        Ok(())
    }

    fn brake(&mut self) -> Result<(), OutputError> {
        self.told.set(Told::Brake);
        if self.refuses {
            return Err(OutputError);
        }
        Ok(())
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.told.set(Told::Off);
        Ok(())
    }

    fn wheels(&self) -> [Wheel; 2] {
        [Wheel::default(); 2]
    }
}

const AHEAD: AxisCommand = AxisCommand {
    distance: f32::INFINITY,
    speed: 0.3,
    acceleration: 0.5,
};

const PERIOD: Duration = Duration::millis(1);

#[test]
fn brakes_for_half_a_second_and_lets_go() {
    let told = Rc::new(Cell::new(Told::Drive));
    let config = Params::default().build(PERIOD);
    let recorder = Recorder {
        told: Rc::clone(&told),
        refuses: false,
    };
    let mut controller = Controller::new(recorder, config, None);
    let mut now = 0;
    let mut tick = |controller: &mut Controller<Recorder>| {
        controller.tick(Instant::from_ticks(now), &Inputs::default());
        now += PERIOD.ticks();
        told.get()
    };
    // Nothing has moved: there is nothing to brake.
    assert_eq!(tick(&mut controller), Told::Off);
    controller.request(Action::Move(AHEAD)).unwrap();
    assert_eq!(tick(&mut controller), Told::Drive);
    controller.request(Action::EStop).unwrap();
    for k in 0..500 {
        assert_eq!(tick(&mut controller), Told::Brake, "after {k} ms");
    }
    // Half a second, to a tick: it is added up in f32.
    tick(&mut controller);
    assert_eq!(tick(&mut controller), Told::Off);
    // A second stop does not brake what is off.
    controller.request(Action::EStop).unwrap();
    assert_eq!(tick(&mut controller), Told::Off);
}

#[test]
fn a_driver_that_cannot_be_told_to_brake_is_off_in_the_same_tick() {
    let told = Rc::new(Cell::new(Told::Drive));
    let config = Params::default().build(PERIOD);
    let recorder = Recorder {
        told: Rc::clone(&told),
        refuses: true,
    };
    let mut controller = Controller::new(recorder, config, None);
    controller.request(Action::Move(AHEAD)).unwrap();
    controller.tick(Instant::from_ticks(0), &Inputs::default());
    assert_eq!(told.get(), Told::Drive);
    controller.request(Action::EStop).unwrap();
    for now in 1..700 {
        controller.tick(
            Instant::from_ticks(now * PERIOD.ticks()),
            &Inputs::default(),
        );
        assert_eq!(told.get(), Told::Off, "after {now} ms");
    }
}
