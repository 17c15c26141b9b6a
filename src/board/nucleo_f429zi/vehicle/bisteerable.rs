//! A bi-steerable or an ordinary car: rear wheels with a motor and an encoder each, and a servo that steers. The steering's encoder, if it has one, is
//! on a timer of its own. No timer is left for encoders of the front wheels.

use super::Spare;
use super::steering::{self, Steering};
use crate::board::nucleo_f429zi::wheels::{
    ENCODER_FILTER, LeftEncoder, LeftMotor, RightEncoder, RightMotor, Wheels,
};
use stm32f4xx_hal::gpio::{Debugger, PA15, PB3};
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::{pac, qei::Qei};
use vehicle_controller::vehicle::{self, BiSteerable, bisteerable};

/// The steering's encoder.
type SteeringEncoder = Qei<pac::TIM2>;
/// The vehicle. The front wheels' encoders, which there are none of, have some type.
pub type Vehicle = BiSteerable<
    LeftEncoder,
    RightEncoder,
    LeftEncoder,
    RightEncoder,
    LeftMotor,
    RightMotor,
    Steering<SteeringEncoder>,
>;
/// What parameters decide about it.
pub type Config = bisteerable::Config;

/// Whose parameters it has.
pub const KIND: vehicle::Kind = vehicle::Kind::BiSteerable;
/// Its name.
pub const NAME: [u8; 11] = *b"bisteerable";
/// What the image runs on.
pub const TARGET: &str = "nucleo-f429zi-bisteerable";

/// What it is made of.
pub struct Parts {
    wheels: Wheels,
    steering: steering::Parts,
    steering_encoder: SteeringEncoder,
}

impl Parts {
    /// Starts the steering.
    pub fn start(wheels: Wheels, spare: Spare, rcc: &mut Rcc) -> Self {
        Self {
            wheels,
            steering: steering::Parts::start(spare.tim8, spare.pc8, spare.pc2, rcc),
            steering_encoder: start_encoder(spare.tim2, spare.pa15, spare.pb3, rcc),
        }
    }

    /// Puts it together.
    ///
    /// # Errors
    /// A message if an output refused.
    pub fn assemble(self, config: &Config) -> Result<Vehicle, &'static str> {
        let Self {
            wheels,
            steering,
            steering_encoder,
        } = self;
        let [left, right] = config.servo;
        Ok(Vehicle::new(
            wheels.left_encoder,
            wheels.right_encoder,
            None,
            wheels.left_bridge.servo(left)?,
            wheels.right_bridge.servo(right)?,
            steering.assemble(steering_encoder, &config.steering)?,
            config,
        ))
    }
}

/// Both pins were a JTAG probe's, which the ST-LINK does not use.
fn start_encoder(
    timer: pac::TIM2,
    a: PA15<Debugger>,
    b: PB3<Debugger>,
    rcc: &mut Rcc,
) -> SteeringEncoder {
    let pins = (
        a.into_alternate().internal_pull_up(true),
        b.into_alternate().internal_pull_up(true),
    );
    let encoder = Qei::new(timer, pins, rcc);
    // SAFETY: the timer counts edges and nothing else; no one writes this register any more.
    let registers = unsafe { pac::TIM2::steal() };
    registers
        .ccmr1_input()
        .modify(|_, w| unsafe { w.ic1f().bits(ENCODER_FILTER).ic2f().bits(ENCODER_FILTER) });
    encoder
}
