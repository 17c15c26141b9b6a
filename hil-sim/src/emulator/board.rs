//! The NUCLEO-F429ZI with its motor drivers, encoders and switches: what is soldered to which pin.

use super::flash::Flash;
use super::line::Line;
use super::part::Part;
use crate::faults::levels;
use rigless::cpu;
use rigless::device::Level;
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::Mcu;
use rigless::snapshot::Store;
use rigless::soc::Error;
use rigless::soc::stm32f427::peripherals::adc;
use rigless::soc::stm32f427::peripherals::gpio::{Gpio, Pin};
use rigless::soc::stm32f427::peripherals::tim;
use rigless::time::VirtualNanos;
use std::num::{NonZeroU32, NonZeroU64};

/// USART3 among the serial ports of the part.
pub(super) const SERIAL_PORT: usize = 2;
/// TIM3, TIM4 and TIM2 among the general timers: the left encoder, the right one, and that of a car's steering.
const ENCODER_TIMERS: [usize; 3] = [1, 2, 0];
/// The pins of each encoder, A and B, and the alternate function that they are on.
const ENCODER_PINS: [([Place; 2], u8); 3] = [
    ([Place(C, 6), Place(C, 7)], 2),
    ([Place(D, 12), Place(D, 13)], 2),
    ([Place(A, 15), Place(B, 3)], 1),
];
/// PWM of the left driver and the right one: channels 1 and 2 of TIM1, alternate function 1.
const PWM_CHANNELS: [u8; 2] = [1, 2];
const PWM_PINS: [Place; 2] = [Place(E, 9), Place(E, 11)];
const PWM_FUNCTION: u8 = 1;
/// PWM of the steering's servo: channel 3 of TIM8, alternate function 3.
const SERVO_CHANNEL: u8 = 3;
const SERVO_PIN: Place = Place(C, 8);
const SERVO_FUNCTION: u8 = 3;
/// High is forward.
const DIRECTION_PINS: [Place; 2] = [Place(E, 8), Place(E, 10)];
/// High is on; the drivers pull it down.
const ENABLE_PINS: [Place; 2] = [Place(E, 12), Place(E, 14)];
/// The serial port, on alternate function 7.
const SERIAL_PINS: [Place; 2] = [Place(D, 8), Place(D, 9)];
const SERIAL_FUNCTION: u8 = 7;
/// The emergency-stop circuit: a normally closed contact to ground.
const ESTOP_PIN: Place = Place(E, 13);
/// The blue button, to the supply; the board pulls it down.
const BUTTON_PIN: Place = Place(C, 13);
/// Green, blue, red.
const LED_PINS: [Place; 3] = [Place(B, 0), Place(B, 7), Place(B, 14)];
/// The battery on PA3, the current sensors on PC0 and PC3, the steering's potentiometer on PC2: channels of the converter.
const ANALOG_CHANNELS: [u8; 4] = [3, 10, 13, 12];

/// The ST-LINK's clock on OSC_IN, Hz.
const CRYSTAL_HZ: u64 = 8_000_000;
const SUPPLY_MILLIVOLTS: u32 = 3300;
const CORE_HZ: NonZeroU64 = NonZeroU64::new(168_000_000).unwrap();
/// What a Cortex-M4 at 168 MHz retires with flash wait states behind its caches, taken branches and divisions: 1.4 cycles each.
const INSTRUCTIONS_PER_SECOND: NonZeroU64 = NonZeroU64::new(120_000_000).unwrap();

const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const E: usize = 4;

/// A pin: its port by its place in the alphabet, and its number.
#[derive(Clone, Copy, Debug)]
struct Place(usize, u8);

/// What a motor driver is told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// The driver's outputs are on; without them the motor coasts.
    pub enabled: bool,
    /// Duty with its sign, −1 to 1.
    pub duty: f64,
}

impl Bridge {
    /// True if the driver puts no voltage on the motor.
    #[must_use]
    pub fn is_off(&self) -> bool {
        !self.enabled || self.duty == 0.0
    }
}

/// The board.
#[derive(Debug)]
pub struct Nucleo {
    /// The microcontroller.
    pub part: Part,
    /// Position of each encoder, in counts.
    counts: [i64; 3],
    estop_open: bool,
    button_pressed: bool,
}

impl Nucleo {
    /// A board with this in its flash, and the watchdog's oscillator at this frequency (17 to 47 kHz).
    ///
    /// # Errors
    /// If the description of the part contradicts the vendor's tables.
    pub fn new(flash: Flash, lsi_hz: u64) -> Result<Self, Error> {
        let mut part = Part::new(flash)?;
        part.fit(CRYSTAL_HZ, SUPPLY_MILLIVOLTS, lsi_hz);
        part.models.usart[SERIAL_PORT].attach(Line::default());
        Ok(Self {
            part,
            counts: [0; 3],
            estop_open: false,
            button_pressed: false,
        })
    }

    /// What the pins say to each driver.
    pub fn bridges(&mut self, at: VirtualNanos) -> [Bridge; 2] {
        let enabled = ENABLE_PINS.map(|pin| self.is_high(pin));
        let forward = DIRECTION_PINS.map(|pin| self.is_high(pin));
        let duty = self.duties(at);
        [0, 1].map(|side| Bridge {
            enabled: enabled[side],
            duty: if forward[side] {
                duty[side]
            } else {
                -duty[side]
            },
        })
    }

    /// Width of the pulses that the pin gives to the steering's servo, s.
    pub fn servo(&mut self, at: VirtualNanos) -> Option<f64> {
        if self.function(SERVO_PIN) != Some(SERVO_FUNCTION) {
            return None;
        }
        let slot = self.part.slots.servo;
        let (bus, models) = self.part.bus_and_models();
        let (registers, mut context) = bus.drive(at, slot);
        let timer = &mut models.advanced[1];
        timer.drive_etr(Level::Low, registers, &mut context);
        let pulse = timer.pulse(tim::Channel::new(SERVO_CHANNEL)?, registers)?;
        // A servo takes no notice of a level that does not change.
        (pulse.width.0 > 0 && pulse.width < pulse.period).then_some(pulse.width.0 as f64 * 1e-9)
    }

    /// The part of the time for which each PWM pin is high.
    fn duties(&mut self, at: VirtualNanos) -> [f64; 2] {
        let routed = PWM_PINS.map(|pin| self.function(pin) == Some(PWM_FUNCTION));
        let levels = PWM_PINS.map(|pin| self.is_high(pin));
        let slot = self.part.slots.pwm;
        let (bus, models) = self.part.bus_and_models();
        let (registers, mut context) = bus.drive(at, slot);
        let timer = &mut models.advanced[0];
        // A timer is up to date as of the last time that it was touched; its trigger input is not connected.
        timer.drive_etr(Level::Low, registers, &mut context);
        let mut duty = [0.0; 2];
        for (side, duty) in duty.iter_mut().enumerate() {
            let Some(channel) = tim::Channel::new(PWM_CHANNELS[side]).filter(|_| routed[side])
            else {
                *duty = f64::from(levels[side]);
                continue;
            };
            *duty = match timer.pulse(channel, registers) {
                Some(pulse) => cycles(pulse.width) / cycles(pulse.period),
                // Not a PWM, but it may still be a level.
                None => f64::from(timer.output(channel, registers) == Some(Level::High)),
            };
        }
        duty
    }

    /// Moves an encoder to a position, one count at a time.
    pub fn turn(&mut self, at: VirtualNanos, encoder: usize, count: i64) {
        self.counts[encoder] = count;
        let levels = levels(count).map(Level::from);
        let (pins, function) = ENCODER_PINS[encoder];
        for (channel, (pin, level)) in pins.into_iter().zip(levels).enumerate() {
            self.drive(at, pin, Some(level));
            if self.function(pin) != Some(function) {
                continue;
            }
            let Some(channel) = tim::Channel::new(channel as u8 + 1) else {
                continue;
            };
            let slot = self.part.slots.encoders[encoder];
            let (bus, models) = self.part.bus_and_models();
            let (registers, mut context) = bus.drive(at, slot);
            models.tim[ENCODER_TIMERS[encoder]].drive_input(
                channel,
                level,
                registers,
                &mut context,
            );
        }
    }

    /// The voltages at the converter's pins, V: the battery behind its divider, the left and the right current sensor, the steering's potentiometer.
    pub fn sense(&mut self, volts: [f64; 4]) {
        for (channel, volts) in ANALOG_CHANNELS.into_iter().zip(volts) {
            let rail = f64::from(SUPPLY_MILLIVOLTS);
            let millivolts = (volts * 1e3).round().clamp(0.0, rail) as u32;
            if let Some(channel) = adc::Channel::new(channel) {
                self.part.models.adc[0].set_input(channel, millivolts);
            }
        }
    }

    /// Opens the emergency-stop circuit, or closes it.
    pub fn set_estop(&mut self, at: VirtualNanos, open: bool) {
        self.estop_open = open;
        self.drive(at, ESTOP_PIN, (!open).then_some(Level::Low));
    }

    /// Presses the blue button, or lets it go.
    pub fn press(&mut self, at: VirtualNanos, pressed: bool) {
        self.button_pressed = pressed;
        self.drive(at, BUTTON_PIN, Some(pressed.into()));
    }

    /// Which of the green, the blue and the red light are on.
    pub fn leds(&self) -> [bool; 3] {
        LED_PINS.map(|pin| self.is_high(pin))
    }

    /// The far end of the serial line.
    pub fn line(&mut self) -> Option<&mut Line> {
        self.part.models.usart[SERIAL_PORT].chip_mut()
    }

    /// Whether the serial port is connected to the ST-LINK.
    pub fn is_serial_routed(&self) -> bool {
        SERIAL_PINS
            .into_iter()
            .all(|pin| self.function(pin) == Some(SERIAL_FUNCTION))
    }

    /// Puts the levels of all that is outside on the pins: after power-on and after each reset.
    pub fn connect(&mut self, at: VirtualNanos) {
        self.set_estop(at, self.estop_open);
        self.press(at, self.button_pressed);
        // The drivers pull their inputs down.
        for pin in ENABLE_PINS
            .into_iter()
            .chain(PWM_PINS)
            .chain(DIRECTION_PINS)
            .chain([SERVO_PIN])
        {
            self.drive(at, pin, Some(Level::Low));
        }
        for encoder in 0..self.counts.len() {
            self.turn(at, encoder, self.counts[encoder]);
        }
    }

    fn drive(&mut self, at: VirtualNanos, pin: Place, level: Option<Level>) {
        let Place(port, number) = pin;
        let Some(number) = Pin::new(number) else {
            return;
        };
        let slot = self.part.slots.ports[port];
        let (bus, models) = self.part.bus_and_models();
        let (registers, mut context) = bus.drive(at, slot);
        models.gpio[port].drive(number, level, registers, &mut context);
    }

    fn is_high(&self, pin: Place) -> bool {
        let Place(port, number) = pin;
        let registers = self.part.bus().slots()[self.part.slots.ports[port]].registers();
        Pin::new(number).is_some_and(|number| {
            self.part.models.gpio[port].level(number, registers) == Level::High
        })
    }

    fn function(&self, pin: Place) -> Option<u8> {
        let Place(port, number) = pin;
        let registers = self.part.bus().slots()[self.part.slots.ports[port]].registers();
        Gpio::function(Pin::new(number)?, registers)
    }
}

/// A run starts from power-on; it is not saved.
impl Store for Nucleo {}

impl Board for Nucleo {
    fn name(&self) -> &'static str {
        "nucleo-f429zi"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32f429"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.part)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        const LINES: NonZeroU32 = NonZeroU32::new(91).unwrap();
        const REFERENCE_DIVIDER: NonZeroU32 = NonZeroU32::new(8).unwrap();
        let core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: CORE_HZ,
            interrupt_lines: LINES,
            priority_bits: 4,
            refclk_divider: REFERENCE_DIVIDER,
            instructions_per_second: INSTRUCTIONS_PER_SECOND,
            boot: "flash",
        }
        .spec_with_parts(
            &cpu::armv7m::windows(self.part.bus()),
            armv7m::Fpu::FpV4Sp,
            armv7m::MpuRegions::Eight,
        );
        vec![Target::new("stm32f429", &mut self.part, core)]
    }
}

/// A time in whole cycles of the PWM's timer: the emulator rounds it to nanoseconds, and a cycle has six.
fn cycles(time: VirtualNanos) -> f64 {
    const TIMER_MHZ: f64 = 168.0;
    (time.0 as f64 * TIMER_MHZ / 1e3).round()
}

#[cfg(test)]
mod tests;
