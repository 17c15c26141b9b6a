//! NUCLEO-F429ZI: STM32F429ZI at 168 MHz. `docs/firmware.md` draws the wiring and says how to check it.
//!
//! | signal | pin | connector | |
//! |---|---|---|---|
//! | left encoder A, B | PC6, PC7 | CN7-1, CN7-11 | TIM3, pull-ups and input filter on |
//! | right encoder A, B | PD12, PD13 | CN10-21, CN10-19 | TIM4, the same |
//! | left PWM, direction, enable | PE9, PE8, PE12 | CN10-4, CN10-18, CN10-26 | TIM1 CH1, 20 kHz |
//! | right PWM, direction, enable | PE11, PE10, PE14 | CN10-6, CN10-24, CN10-28 | TIM1 CH2 |
//! | battery | PA3 | CN9-1 | ADC1, through a divider to 3.3 V |
//! | left, right current | PC0, PC3 | CN9-3, CN9-5 | ADC1, optional |
//! | emergency stop | PE13 | CN10-10 | normally closed to ground, optional |
//! | blue button | PC13 | on board | stops |
//! | LEDs | PB0, PB7, PB14 | on board | green: alive, blue: a motor is driven, red: fault |
//! | serial | PD8, PD9 | ST-LINK's USB | USART3, 115 200 baud |
//!
//! Other vehicles than the differential drive (`vehicle/`) have the same motors and encoders, with another meaning, and may have:
//!
//! | signal | pin | connector | |
//! |---|---|---|---|
//! | steering servo | PC8 | CN8-2 | TIM8 CH3, a pulse every 20 ms |
//! | steering potentiometer | PC2 | CN10-9 | ADC1 |
//! | steering encoder A, B of a car | PA15, PB3 | CN7-9, CN7-15 | TIM2, pull-ups and input filter on; a tricycle's is the right encoder |

mod fault;
mod flash;
mod sensors;
mod vehicle;
mod wheels;

pub use fault::halt;
pub use flash::ParamFlash;
pub use sensors::Sensors;
pub use vehicle::{Config, KIND, Parts, TARGET, Vehicle};

use super::ResetCause;
use cortex_m::peripheral::DWT;
use embedded_hal_nb::serial::{ErrorType, Write};
use stm32f4xx_hal::gpio::{Output, Pin};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc;
use stm32f4xx_hal::timer::{self, CounterHz};
use stm32f4xx_hal::{pac, serial};
use vehicle_controller::controller::Snapshot;
use vehicle_controller::time::{self, Duration, Instant};
use wheels::Wheels;

/// Core clock, cycles in a microsecond.
const SYSCLK_MHZ: u32 = 168;
/// The ST-LINK's clock output, MHz.
const HSE_MHZ: u32 = 8;
/// How long the ST-LINK's clock is waited for, in turns of a loop of a few cycles at 16 MHz: about five milliseconds.
const HSE_PATIENCE: u32 = 16_000;

/// The board, with everything on it running but the tick, and the motors off.
pub struct Board {
    pub reset_cause: ResetCause,
    pub parts: Parts,
    pub sensors: Sensors,
    pub flash: ParamFlash,
    pub leds: Leds,
    pub watchdog: Watchdog,
    pub clock: Clock,
    pub timer: Ticker,
    pub receiver: Receiver,
    pub transmitter: Transmitter,
}

impl Board {
    /// Starts the board. The watchdog comes first: whatever hangs from here on ends in a reset.
    ///
    /// # Errors
    /// A message if a peripheral refused its settings.
    pub fn start(
        mut core: cortex_m::Peripherals,
        device: pac::Peripherals,
        watchdog: Duration,
    ) -> Result<Self, &'static str> {
        let watchdog = Watchdog::start(device.IWDG, watchdog)?;
        let reset_cause = take_reset_cause(&device.RCC);
        let clocks = clocks(&device.RCC);
        let mut rcc = device.RCC.freeze(clocks);
        let gpioa = device.GPIOA.split(&mut rcc);
        let gpiob = device.GPIOB.split(&mut rcc);
        let gpioc = device.GPIOC.split(&mut rcc);
        let gpiod = device.GPIOD.split(&mut rcc);
        let gpioe = device.GPIOE.split(&mut rcc);

        let pins = wheels::Pins {
            encoders: ((gpioc.pc6, gpioc.pc7), (gpiod.pd12, gpiod.pd13)),
            pwm: (gpioe.pe9, gpioe.pe11),
            direction: (gpioe.pe8, gpioe.pe10),
            enable: (gpioe.pe12, gpioe.pe14),
        };
        let timers = (device.TIM1, device.TIM3, device.TIM4);
        let wheels = Wheels::start(timers, pins, &mut rcc);

        let sensors = Sensors::start(
            device.ADC1,
            &device.ADC_COMMON,
            &mut rcc,
            gpioe.pe13.into_pull_up_input(),
            gpioc.pc13.into_floating_input(),
            (
                gpioa.pa3.into_analog(),
                gpioc.pc0.into_analog(),
                gpioc.pc3.into_analog(),
            ),
        );
        let spare = vehicle::Spare {
            tim2: device.TIM2,
            tim8: device.TIM8,
            pa15: gpioa.pa15,
            pb3: gpiob.pb3,
            pc2: gpioc.pc2,
            pc8: gpioc.pc8,
        };
        let parts = Parts::start(wheels, spare, &mut rcc);
        let (transmitter, receiver) = open_serial(device.USART3, gpiod.pd8, gpiod.pd9, &mut rcc)?;

        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        // The converter is awake by now, and done before the first tick.
        sensors.convert();
        Ok(Self {
            reset_cause,
            parts,
            sensors,
            leds: Leds {
                green: gpiob.pb0.into_push_pull_output(),
                blue: gpiob.pb7.into_push_pull_output(),
                red: gpiob.pb14.into_push_pull_output(),
            },
            watchdog,
            clock: Clock(time::CycleClock::new(DWT::cycle_count())),
            timer: Ticker(device.TIM5.counter_hz(&mut rcc)),
            flash: ParamFlash::new(device.FLASH),
            receiver,
            transmitter,
        })
    }
}

/// The serial port: 115 200 baud, 8N1.
fn open_serial(
    usart: pac::USART3,
    tx: Pin<'D', 8>,
    rx: Pin<'D', 9>,
    rcc: &mut rcc::Rcc,
) -> Result<(Transmitter, Receiver), &'static str> {
    // The pull-up keeps the line quiet while the ST-LINK starts.
    let rx = rx.into_alternate().internal_pull_up(true);
    let config = serial::Config::default().baudrate(115_200.bps());
    let (tx, mut rx) = usart
        .serial((tx, rx), config, rcc)
        .map_err(|_| "the serial port refused its settings")?
        .split();
    rx.listen();
    // SAFETY: only the receiver's registers are touched through it, and nobody else has those.
    let registers = unsafe { pac::USART3::steal() };
    Ok((Transmitter(tx), Receiver(registers)))
}

/// 168 MHz from the ST-LINK's 8 MHz, or from the internal oscillator if the ST-LINK gives none: 1 % off at 25 °C, a few percent in the cold or heat.
fn clocks(rcc: &pac::RCC) -> rcc::Config {
    rcc.cr()
        .modify(|_, w| w.hsebyp().set_bit().hseon().set_bit());
    let mut patience = HSE_PATIENCE;
    while rcc.cr().read().hserdy().bit_is_clear() && patience > 0 {
        patience -= 1;
    }
    let source = if patience > 0 {
        rcc::Config::hse(HSE_MHZ.MHz()).bypass_hse_oscillator()
    } else {
        rcc.cr().modify(|_, w| w.hseon().clear_bit());
        defmt::warn!(
            "no clock from the ST-LINK: the internal oscillator is up to some percent off"
        );
        rcc::Config::hsi()
    };
    source
        .sysclk(SYSCLK_MHZ.MHz())
        .pclk1(42.MHz())
        .pclk2(84.MHz())
}

/// Reads the reset flags and clears them. A power-on sets several, and the pin's is set by every reset.
fn take_reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    if flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set() {
        ResetCause::Watchdog
    } else if flags.lpwrrstf().bit_is_set() {
        ResetCause::LowPower
    } else if flags.sftrstf().bit_is_set() {
        ResetCause::Software
    } else if flags.porrstf().bit_is_set() {
        ResetCause::PowerOn
    } else if flags.borrstf().bit_is_set() {
        ResetCause::BrownOut
    } else {
        ResetCause::ResetPin
    }
}

/// The independent watchdog.
pub struct Watchdog(pac::IWDG);

impl Watchdog {
    const START: u16 = 0xCCCC;
    const UNLOCK: u16 = 0x5555;
    const FEED: u16 = 0xAAAA;
    /// The smallest prescaler gives the finest time-out: 4 cycles of a nominal 32 kHz.
    const TICKS_PER_MILLISECOND: u64 = 8;
    /// Register updates take up to five cycles of the slow oscillator, 0.3 ms; the loop must end if it does not run at all.
    const PATIENCE: u32 = 20_000;

    fn start(iwdg: pac::IWDG, timeout: Duration) -> Result<Self, &'static str> {
        let watchdog = Self(iwdg);
        watchdog.key(Self::START);
        watchdog.key(Self::UNLOCK);
        let reload = timeout.to_millis() * Self::TICKS_PER_MILLISECOND;
        watchdog.0.pr().write(|w| w.pr().divide_by4());
        watchdog.0.rlr().write(|w| w.rl().set(reload as u16));
        let mut patience = Self::PATIENCE;
        while watchdog.0.sr().read().bits() != 0 && patience > 0 {
            patience -= 1;
        }
        if patience == 0 {
            return Err("the watchdog's oscillator does not run");
        }
        watchdog.feed();
        Ok(watchdog)
    }

    /// Puts the reset off by another time-out.
    pub fn feed(&self) {
        self.key(Self::FEED);
    }

    fn key(&self, key: u16) {
        // SAFETY: any value is allowed; these three have a meaning.
        self.0.kr().write(|w| unsafe { w.key().bits(key) });
    }
}

/// Time, from the core's cycle counter.
pub struct Clock(time::CycleClock<SYSCLK_MHZ>);

impl Clock {
    /// Now. Call it at least every 25 seconds.
    pub fn now(&mut self) -> Instant {
        self.0.at(DWT::cycle_count())
    }
}

/// What makes the tick.
pub struct Ticker(CounterHz<pac::TIM5>);

impl Ticker {
    /// Begins to tick.
    ///
    /// # Errors
    /// A message if the timer refuses.
    pub fn start(&mut self) -> Result<(), &'static str> {
        self.0
            .start(1.kHz())
            .map_err(|_| "the tick's timer refused its rate")?;
        self.0.listen(timer::Event::Update);
        Ok(())
    }

    /// Clears the interrupt's request.
    pub fn acknowledge(&mut self) {
        self.0.clear_flags(timer::Flag::Update);
    }
}

/// Steps of the tick's timer since the last tick was due.
pub fn steps_since_due() -> u32 {
    // SAFETY: only read, which has no effect; the HAL's counter does not offer it.
    unsafe { (*pac::TIM5::ptr()).cnt().read().bits() }
}

/// What share of the tick's period so many steps of its timer are.
pub fn share_of_period(steps: u32) -> f32 {
    // SAFETY: only read, which has no effect; it is written once, at the start.
    let last = unsafe { (*pac::TIM5::ptr()).arr().read().bits() };
    steps as f32 / (last as f32 + 1.0)
}

/// The three LEDs.
pub struct Leds {
    green: Pin<'B', 0, Output>,
    blue: Pin<'B', 7, Output>,
    red: Pin<'B', 14, Output>,
}

impl Leds {
    /// Green blinks once a second; blue: a motor is driven; red: a fault is latched.
    pub fn show(&mut self, snapshot: &Snapshot) {
        let milliseconds = (snapshot.time.ticks() / 1000) as u32;
        let driven = snapshot.wheels.iter().any(|wheel| wheel.duty != 0.0);
        self.green.set_state((milliseconds % 1000 < 500).into());
        self.blue.set_state(driven.into());
        self.red.set_state(snapshot.fault.is_some().into());
    }
}

/// The receiving half of the serial port. The HAL's own throws a good byte away with the news that the next one was lost.
pub struct Receiver(pac::USART3);

impl Receiver {
    /// The byte that has come, and whether one was lost: behind it, as the receiver was full, or in its place, as it was garbled.
    pub fn read(&mut self) -> (Option<u8>, bool) {
        let status = self.0.sr().read();
        if status.rxne().bit_is_clear() && status.ore().bit_is_clear() {
            return (None, false);
        }
        let byte = self.0.dr().read().dr().bits() as u8;
        let garbled = status.fe().bit_is_set() || status.nf().bit_is_set();
        let byte = (status.rxne().bit_is_set() && !garbled).then_some(byte);
        (byte, garbled || status.ore().bit_is_set())
    }
}

/// The sending half of the serial port.
pub struct Transmitter(serial::Tx<pac::USART3>);

impl ErrorType for Transmitter {
    type Error = serial::Error;
}

impl Write<u8> for Transmitter {
    fn write(&mut self, byte: u8) -> nb::Result<(), serial::Error> {
        Write::write(&mut self.0, byte)
    }

    fn flush(&mut self) -> nb::Result<(), serial::Error> {
        Write::flush(&mut self.0)
    }
}
