//! Fakes of the peripherals: they implement the traits that the real ones implement, and meet the plant on shared wires.

mod controller;
mod drive;
mod flash;

pub use controller::{ControllerLine, ControllerWires, Order};
pub use drive::FakeDrive;
pub use flash::{FakeFlash, FlashError, Wear, stored};

use crate::plant::BridgeInput;
use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_hal::pwm::{ErrorType as PwmErrorType, SetDutyCycle};
use embedded_hal_02::{Direction, Qei};
use embedded_hal_nb::serial::{ErrorType as SerialErrorType, Read, Write};
use std::cell::Cell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;
use vehicle_controller::time::Duration;
use vehicle_controller::vehicle::{
    Counter, OutputError, ServoSteering, Steering, Voltmeter, steering,
};

/// The wires of one wheel.
#[derive(Debug, Default)]
pub struct Wires {
    /// Encoder edges since power-on; a counter shows the low bits of it.
    pub edges: Cell<i64>,
    /// PWM compare value, out of [`FULL_DUTY`].
    pub duty: Cell<u16>,
    /// Level of the direction pin.
    pub forward: Cell<bool>,
    /// Level of the driver's enable pin.
    pub enabled: Cell<bool>,
    /// The speed that an ideal motor was told, m/s.
    pub speed: Cell<f32>,
    /// What the motor's own controller was told, if it has one.
    pub controller: ControllerWires,
    /// What that one was asked for since the motor was last off: the integral of the commanded speed, m.
    pub asked: Cell<f64>,
}

impl Wires {
    /// What the bridge is told.
    pub fn bridge(&self) -> BridgeInput {
        let duty = f64::from(self.duty.get()) / f64::from(FULL_DUTY);
        match (self.enabled.get(), self.forward.get()) {
            (false, _) => BridgeInput::Open,
            (true, true) => BridgeInput::Duty(duty),
            (true, false) => BridgeInput::Duty(-duty),
        }
    }
}

/// The wires of a steering servo and its sensors.
#[derive(Debug, Default)]
pub struct SteeringWires {
    /// Width of the pulses, out of [`FULL_PULSE`] of their period; 0: there are none.
    pub pulse: Cell<u16>,
    /// Voltage at the potentiometer, V.
    pub volts: Cell<f32>,
    /// Counts of the encoder.
    pub counts: Rc<Wires>,
    /// An angle that was measured elsewhere, rad: what a log says of it.
    pub angle: Cell<Option<f32>>,
}

impl SteeringWires {
    /// Width of the pulses, s.
    pub fn pulse(&self) -> Option<f64> {
        let pulse = self.pulse.get();
        (pulse > 0)
            .then(|| f64::from(pulse) / f64::from(FULL_PULSE) * f64::from(steering::PULSE_PERIOD))
    }
}

/// All wires of a base.
#[derive(Clone, Debug, Default)]
pub struct Harness {
    /// Of the motors with their encoders: left and right, or what the vehicle has instead.
    pub wheels: [Rc<Wires>; 2],
    /// Of a car's front wheels, which have encoders only.
    pub front: [Rc<Wires>; 2],
    /// Of the steering.
    pub steering: Rc<SteeringWires>,
}

/// The reload value of a servo's PWM: 20 ms in microseconds.
pub const FULL_PULSE: u16 = 20_000;
/// The reload value of a 20 kHz PWM from a 168 MHz timer.
pub const FULL_DUTY: u16 = 8400;

/// A count of 16 or 32 bits: which, the robot's file says.
#[derive(Clone, Copy, Debug)]
pub enum Count {
    /// From a 16-bit timer.
    Narrow(u16),
    /// From a 32-bit timer.
    Wide(u32),
}

impl Counter for Count {
    fn since(self, earlier: Self) -> i32 {
        match (self, earlier) {
            (Self::Narrow(now), Self::Narrow(then)) => now.since(then),
            (Self::Wide(now), Self::Wide(then)) => now.since(then),
            _ => unreachable!("a counter does not change its width"),
        }
    }
}

/// A quadrature counter.
#[derive(Debug)]
pub struct FakeQei {
    wires: Rc<Wires>,
    narrow: bool,
}

impl FakeQei {
    /// A counter of 16 bits, or of 32.
    pub fn new(wires: Rc<Wires>, narrow: bool) -> Self {
        Self { wires, narrow }
    }
}

impl Qei for FakeQei {
    type Count = Count;

    fn count(&self) -> Count {
        let edges = self.wires.edges.get();
        if self.narrow {
            Count::Narrow(edges as u16)
        } else {
            Count::Wide(edges as u32)
        }
    }

    fn direction(&self) -> Direction {
        Direction::Upcounting
    }
}

/// A PWM channel.
#[derive(Debug)]
pub struct FakePwm(Rc<Wires>);

impl PwmErrorType for FakePwm {
    type Error = Infallible;
}

impl SetDutyCycle for FakePwm {
    fn max_duty_cycle(&self) -> u16 {
        FULL_DUTY
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.duty.set(duty);
        Ok(())
    }
}

/// A digital output.
#[derive(Debug)]
pub struct FakePin {
    wires: Rc<Wires>,
    level: fn(&Wires) -> &Cell<bool>,
}

impl PinErrorType for FakePin {
    type Error = Infallible;
}

impl OutputPin for FakePin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        (self.level)(&self.wires).set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        (self.level)(&self.wires).set(true);
        Ok(())
    }
}

/// A servo's PWM channel.
#[derive(Debug)]
pub struct FakePulse(Rc<SteeringWires>);

impl PwmErrorType for FakePulse {
    type Error = Infallible;
}

impl SetDutyCycle for FakePulse {
    fn max_duty_cycle(&self) -> u16 {
        FULL_PULSE
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.pulse.set(duty);
        Ok(())
    }
}

/// A potentiometer at the board's converter.
#[derive(Debug)]
pub struct FakePotentiometer(Rc<SteeringWires>);

impl Voltmeter for FakePotentiometer {
    fn volts(&mut self) -> f32 {
        self.0.volts.get()
    }
}

/// A steering: the library's, on fake peripherals; its angle may come from a log.
#[derive(Debug)]
pub struct FakeSteering {
    wires: Rc<SteeringWires>,
    servo: ServoSteering<FakePulse, FakePotentiometer, FakeQei>,
}

impl FakeSteering {
    /// A servo with its sensors on these wires.
    ///
    /// # Errors
    /// None: the fakes never refuse.
    pub fn new(wires: &Rc<SteeringWires>, config: &steering::Config) -> Result<Self, OutputError> {
        Ok(Self {
            wires: Rc::clone(wires),
            servo: ServoSteering::new(
                FakePulse(Rc::clone(wires)),
                FakePotentiometer(Rc::clone(wires)),
                FakeQei::new(Rc::clone(&wires.counts), false),
                config,
            )?,
        })
    }
}

impl Steering for FakeSteering {
    fn configure(&mut self, config: &steering::Config) {
        self.servo.configure(config);
    }

    fn angle(&mut self) -> f32 {
        let measured = self.servo.angle();
        self.wires.angle.get().unwrap_or(measured)
    }

    fn steer(&mut self, angle: f32) -> Result<(), OutputError> {
        self.servo.steer(angle)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        self.servo.off()
    }
}

/// What a 12-bit converter of 3.3 V makes of a voltage, in V. It sees whole millivolts, as the emulated one does: the two run alike then.
pub fn converted(volts: f64) -> f32 {
    const REFERENCE: f64 = 3.3;
    const FULL_SCALE: f64 = 4095.0;
    let millivolts = (volts * 1e3).round();
    let code = (millivolts * 1e-3 / REFERENCE * FULL_SCALE)
        .clamp(0.0, FULL_SCALE)
        .floor();
    (code / FULL_SCALE * REFERENCE) as f32
}

/// A serial port at 115 200 baud, both ways.
#[derive(Debug, Default)]
pub struct FakeSerial {
    /// Bytes on their way to the base.
    pub to_base: VecDeque<u8>,
    /// Bytes that have come from the base.
    pub from_base: VecDeque<u8>,
    /// What the line could have carried by now and has not, in millionths of a byte: to the base, from it.
    credit: [i64; 2],
}

impl FakeSerial {
    /// Ten bits a byte.
    const BYTES_PER_SECOND: i64 = 11_520;
    const BYTE: i64 = 1_000_000;
    /// The tick comes 0.1 ms before a period's end, and to read a line takes the board some 0.05 ms: so much of the line's time is missing before a tick.
    const LATENCY_US: i64 = 150;

    /// Lets time pass. A line that had nothing to carry does not save its time up: a byte from the base may begin at once, no more.
    pub fn advance(&mut self, elapsed: Duration) {
        let earned = elapsed.ticks() as i64 * Self::BYTES_PER_SECOND;
        for credit in &mut self.credit {
            *credit = (*credit).min(Self::BYTE) + earned;
        }
    }

    fn spend(credit: &mut i64) -> nb::Result<(), Infallible> {
        if *credit < Self::BYTE {
            return Err(nb::Error::WouldBlock);
        }
        *credit -= Self::BYTE;
        Ok(())
    }
}

impl SerialErrorType for FakeSerial {
    type Error = Infallible;
}

impl Read<u8> for FakeSerial {
    fn read(&mut self) -> nb::Result<u8, Infallible> {
        if self.to_base.is_empty() {
            // The next byte begins when it is put on the line.
            self.credit[0] = -Self::LATENCY_US * Self::BYTES_PER_SECOND;
            return Err(nb::Error::WouldBlock);
        }
        Self::spend(&mut self.credit[0])?;
        self.to_base.pop_front().ok_or(nb::Error::WouldBlock)
    }
}

impl Write<u8> for FakeSerial {
    fn write(&mut self, byte: u8) -> nb::Result<(), Infallible> {
        Self::spend(&mut self.credit[1])?;
        self.from_base.push_back(byte);
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        Ok(())
    }
}
