//! What turns the wheels' direction: a hobby servo, and a potentiometer that says where it is.

use crate::board::nucleo_f429zi::sensors::VOLTS_PER_STEP;
use stm32f4xx_hal::gpio::{Analog, PC2, PC8};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::timer::PwmChannel;
use vehicle_controller::vehicle::steering::{Config, PULSE_PERIOD};
use vehicle_controller::vehicle::{Counter, ServoSteering, Voltmeter};

/// A servo with a potentiometer or this encoder.
pub type Steering<Q> = ServoSteering<Pulse, Potentiometer, Q>;
/// The servo's pulse.
type Pulse = PwmChannel<pac::TIM8, 2>;

/// The pulse's resolution is a third of a microsecond. Its period is 60 000 of these steps, which fits into the timer's 16 bits.
const STEPS_PER_SECOND: u32 = 3_000_000;
/// Steps from pulse to pulse.
const PERIOD_STEPS: u32 = (PULSE_PERIOD * STEPS_PER_SECOND as f32) as u32;

/// The steering, without its encoder.
pub struct Parts {
    pulse: Pulse,
    potentiometer: Potentiometer,
}

impl Parts {
    /// Starts it. The servo is limp.
    pub fn start(timer: pac::TIM8, pulse: PC8, potentiometer: PC2, rcc: &mut Rcc) -> Self {
        let period = fugit::TimerDurationU32::from_ticks(PERIOD_STEPS);
        let (_, (_, _, channel, _)) = timer.pwm::<STEPS_PER_SECOND>(period, rcc);
        let mut channel = channel.with(pulse);
        channel.set_duty(0);
        channel.enable();
        Self {
            pulse: channel,
            potentiometer: Potentiometer::start(potentiometer),
        }
    }

    /// Puts it together.
    ///
    /// # Errors
    /// A message if the servo's output refused.
    pub fn assemble<Q>(self, encoder: Q, config: &Config) -> Result<Steering<Q>, &'static str>
    where
        Q: embedded_hal_02::Qei<Count: Counter>,
    {
        ServoSteering::new(self.pulse, self.potentiometer, encoder, config)
            .map_err(|_| "the servo's output refused")
    }
}

/// The potentiometer: a fourth place of the converter's group.
pub struct Potentiometer {
    adc: pac::ADC1,
    /// It stays analog.
    _pin: PC2<Analog>,
}

impl Potentiometer {
    /// PC2.
    const CHANNEL: u8 = 12;

    /// Puts it behind the others in the group, of which three of the four places are taken. Call it before the first conversion.
    fn start(pin: PC2) -> Self {
        // SAFETY: who owns the converter has set it up and converts only later; then it starts conversions and reads the first three results, and
        // this reads the fourth.
        let adc = unsafe { pac::ADC1::steal() };
        adc.smpr1().modify(|_, w| w.smp12().cycles84());
        // SAFETY: three are channels that were there, the last is one, too.
        adc.jsqr().modify(|old, w| unsafe {
            w.jl().bits(3);
            w.jsq1().bits(old.jsq2().bits());
            w.jsq2().bits(old.jsq3().bits());
            w.jsq3().bits(old.jsq4().bits());
            w.jsq4().bits(Self::CHANNEL)
        });
        Self {
            adc,
            _pin: pin.into_analog(),
        }
    }
}

impl Voltmeter for Potentiometer {
    /// It is a tick old, or the one that began with this tick.
    fn volts(&mut self) -> f32 {
        f32::from(self.adc.jdr4().read().jdata().bits()) * VOLTS_PER_STEP
    }
}
