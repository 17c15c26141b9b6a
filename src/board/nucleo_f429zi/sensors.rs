//! What the tick reads besides the encoders.

use stm32f4xx_hal::gpio::{Analog, Input, PA3, PC0, PC3, Pin};
use stm32f4xx_hal::pac;
use stm32f4xx_hal::rcc::{self, Enable};
use vehicle_controller::controller::Inputs;

/// The analog inputs and the stop inputs.
pub struct Sensors {
    adc: pac::ADC1,
    estop: Pin<'E', 13, Input>,
    button: Pin<'C', 13, Input>,
    /// They stay analog.
    _pins: (PA3<Analog>, PC0<Analog>, PC3<Analog>),
}

/// What a step of the converter amounts to, V.
pub const VOLTS_PER_STEP: f32 = 3.3 / 4095.0;

impl Sensors {
    /// The three analog inputs are an injected group: one start converts all, each into a register of its own.
    pub(super) fn start(
        adc: pac::ADC1,
        common: &pac::ADC_COMMON,
        rcc: &mut rcc::Rcc,
        estop: Pin<'E', 13, Input>,
        button: Pin<'C', 13, Input>,
        pins: (PA3<Analog>, PC0<Analog>, PC3<Analog>),
    ) -> Self {
        pac::ADC1::enable(rcc);
        // 84 MHz / 4 = 21 MHz; with 84 cycles of sampling, a group takes 14 µs.
        common.ccr().modify(|_, w| w.adcpre().div4());
        adc.cr1().write(|w| w.scan().enabled());
        adc.smpr1()
            .write(|w| w.smp10().cycles84().smp13().cycles84());
        adc.smpr2().write(|w| w.smp3().cycles84());
        // The last three of the four places: channels 3, 10 and 13.
        // SAFETY: all are channels.
        adc.jsqr().write(|w| unsafe {
            w.jl()
                .bits(2)
                .jsq2()
                .bits(3)
                .jsq3()
                .bits(10)
                .jsq4()
                .bits(13)
        });
        adc.cr2().write(|w| w.adon().enabled());
        Self {
            adc,
            estop,
            button,
            _pins: pins,
        }
    }

    /// Starts a conversion of the analog inputs.
    pub(super) fn convert(&self) {
        self.adc.cr2().modify(|_, w| w.jswstart().start());
    }

    /// What was measured since the last call, a tick ago; starts the next conversion.
    pub fn read(&mut self) -> Inputs {
        let volts = |code: u16| f32::from(code) * VOLTS_PER_STEP;
        let battery = volts(self.adc.jdr1().read().jdata().bits());
        let left = volts(self.adc.jdr2().read().jdata().bits());
        let right = volts(self.adc.jdr3().read().jdata().bits());
        self.convert();
        Inputs {
            battery: Some(battery),
            currents: [Some(left), Some(right)],
            estop_open: self.estop.is_high(),
            stop_button: self.button.is_high(),
        }
    }
}
