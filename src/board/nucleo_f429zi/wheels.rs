//! The two motors and the two encoders that every vehicle on this board is made of.

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;
use stm32f4xx_hal::gpio::{Output, Pin};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::timer::PwmChannel;
use stm32f4xx_hal::{pac, qei::Qei, rcc::Rcc};
use vehicle_controller::vehicle::{Servo, servo};

type Pwm<const CHANNEL: u8> = PwmChannel<pac::TIM1, CHANNEL>;
type PortE<const PIN: u8> = Pin<'E', PIN, Output>;
/// The left motor.
pub type LeftMotor = Servo<Pwm<0>, PortE<8>, PortE<12>>;
/// The right motor.
#[allow(dead_code, reason = "a tricycle has none")]
pub type RightMotor = Servo<Pwm<1>, PortE<10>, PortE<14>>;
/// The left encoder.
pub type LeftEncoder = Qei<pac::TIM3>;
/// The right encoder.
pub type RightEncoder = Qei<pac::TIM4>;

/// Encoder inputs must be stable for six samples of the timer's clock / 8 (84 MHz / 8): 0.57 µs, which passes edges up to some 800 kHz.
pub const ENCODER_FILTER: u8 = 0b1000;

/// The drivers, off, and the encoders.
pub struct Wheels {
    pub left_encoder: LeftEncoder,
    pub right_encoder: RightEncoder,
    pub left_bridge: Bridge<Pwm<0>, PortE<8>, PortE<12>>,
    #[allow(dead_code, reason = "a tricycle has none")]
    pub right_bridge: Bridge<Pwm<1>, PortE<10>, PortE<14>>,
}

/// Their pins, left first.
pub struct Pins {
    pub encoders: ((Pin<'C', 6>, Pin<'C', 7>), (Pin<'D', 12>, Pin<'D', 13>)),
    pub pwm: (Pin<'E', 9>, Pin<'E', 11>),
    pub direction: (Pin<'E', 8>, Pin<'E', 10>),
    pub enable: (Pin<'E', 12>, Pin<'E', 14>),
}

impl Wheels {
    /// Starts them, the drivers first: they are disabled before anything else can move.
    pub fn start(
        (pwm, left_timer, right_timer): (pac::TIM1, pac::TIM3, pac::TIM4),
        pins: Pins,
        rcc: &mut Rcc,
    ) -> Self {
        let left_enable = pins.enable.0.into_push_pull_output();
        let right_enable = pins.enable.1.into_push_pull_output();
        let (_, (left_pwm, right_pwm, ..)) = pwm.pwm_hz(20.kHz(), rcc);
        let mut left_pwm = left_pwm.with(pins.pwm.0);
        let mut right_pwm = right_pwm.with(pins.pwm.1);
        left_pwm.set_duty(0);
        right_pwm.set_duty(0);
        left_pwm.enable();
        right_pwm.enable();
        let left_bridge = Bridge {
            pwm: left_pwm,
            direction: pins.direction.0.into_push_pull_output(),
            enable: left_enable,
        };
        let right_bridge = Bridge {
            pwm: right_pwm,
            direction: pins.direction.1.into_push_pull_output(),
            enable: right_enable,
        };

        let (left, right) = pins.encoders;
        let left = (
            left.0.into_alternate().internal_pull_up(true),
            left.1.into_alternate().internal_pull_up(true),
        );
        let right = (
            right.0.into_alternate().internal_pull_up(true),
            right.1.into_alternate().internal_pull_up(true),
        );
        let wheels = Self {
            left_encoder: Qei::new(left_timer, left, rcc),
            right_encoder: Qei::new(right_timer, right, rcc),
            left_bridge,
            right_bridge,
        };
        filter_encoders();
        wheels
    }
}

/// A motor's driver.
pub struct Bridge<P, D, E> {
    pwm: P,
    direction: D,
    enable: E,
}

impl<P: SetDutyCycle, D: OutputPin, E: OutputPin> Bridge<P, D, E> {
    /// Puts a servo before it.
    ///
    /// # Errors
    /// A message if an output refused.
    pub fn servo(self, config: servo::Config) -> Result<Servo<P, D, E>, &'static str> {
        Servo::new(self.pwm, self.direction, self.enable, config)
            .map_err(|_| "a motor output refused")
    }
}

/// The HAL leaves the encoders' input filters off.
fn filter_encoders() {
    // SAFETY: the timers count edges and nothing else; no one writes these registers any more.
    let (left, right) = unsafe { (pac::TIM3::steal(), pac::TIM4::steal()) };
    left.ccmr1_input()
        .modify(|_, w| unsafe { w.ic1f().bits(ENCODER_FILTER).ic2f().bits(ENCODER_FILTER) });
    right
        .ccmr1_input()
        .modify(|_, w| unsafe { w.ic1f().bits(ENCODER_FILTER).ic2f().bits(ENCODER_FILTER) });
}
