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

use super::ResetCause;
use core::arch::naked_asm;
use cortex_m::peripheral::DWT;
use embedded_hal_nb::serial::{ErrorType, Read, Write};
use stm32f4xx_hal::gpio::{Analog, Input, Output, PA3, PC0, PC3, Pin};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{self, Enable};
use stm32f4xx_hal::timer::{self, CounterHz, PwmChannel};
use stm32f4xx_hal::{pac, qei::Qei, serial};
use vehicle_controller::controller::{Inputs, Snapshot};
use vehicle_controller::time::{self, Duration, Instant};
use vehicle_controller::vehicle::{DifferentialDrive, Servo, differential};

/// A motor's driver: PWM, direction, enable.
type Motor<const CHANNEL: u8, const DIRECTION: u8, const ENABLE: u8> =
    Servo<PwmChannel<pac::TIM1, CHANNEL>, Pin<'E', DIRECTION, Output>, Pin<'E', ENABLE, Output>>;
/// The left motor.
pub type LeftMotor = Motor<0, 8, 12>;
/// The right motor.
pub type RightMotor = Motor<1, 10, 14>;
/// The vehicle on this board.
pub type Vehicle = DifferentialDrive<Qei<pac::TIM3>, Qei<pac::TIM4>, LeftMotor, RightMotor>;

/// Core clock, cycles in a microsecond.
const SYSCLK_MHZ: u32 = 168;
/// The ST-LINK's clock output, MHz.
const HSE_MHZ: u32 = 8;
/// How long the ST-LINK's clock is waited for, in turns of a loop of a few cycles at 16 MHz: about a millisecond.
const HSE_PATIENCE: u32 = 4000;
/// Encoder inputs must be stable for six samples of the timer's clock / 8 (84 MHz / 8): 0.57 µs, which passes edges up to some 800 kHz.
const ENCODER_FILTER: u8 = 0b1000;

/// The board, with everything on it running and the motors off.
pub struct Board {
    pub reset_cause: ResetCause,
    pub left_encoder: Qei<pac::TIM3>,
    pub right_encoder: Qei<pac::TIM4>,
    pub left_motor: LeftMotor,
    pub right_motor: RightMotor,
    pub sensors: Sensors,
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
        config: &differential::Config,
    ) -> Result<Self, &'static str> {
        let watchdog = Watchdog::start(device.IWDG, watchdog);
        let reset_cause = take_reset_cause(&device.RCC);
        let clocks = clocks(&device.RCC);
        let mut rcc = device.RCC.freeze(clocks);
        let gpioa = device.GPIOA.split(&mut rcc);
        let gpiob = device.GPIOB.split(&mut rcc);
        let gpioc = device.GPIOC.split(&mut rcc);
        let gpiod = device.GPIOD.split(&mut rcc);
        let gpioe = device.GPIOE.split(&mut rcc);

        // The drivers are disabled before anything else can move.
        let left_enable = gpioe.pe12.into_push_pull_output();
        let right_enable = gpioe.pe14.into_push_pull_output();
        let (_, (left_pwm, right_pwm, ..)) = device.TIM1.pwm_hz(20.kHz(), &mut rcc);
        let mut left_pwm = left_pwm.with(gpioe.pe9);
        let mut right_pwm = right_pwm.with(gpioe.pe11);
        left_pwm.set_duty(0);
        right_pwm.set_duty(0);
        left_pwm.enable();
        right_pwm.enable();
        let refused = |_| "a motor output refused";
        let [left, right] = config.servo;
        let left_motor = Servo::new(
            left_pwm,
            gpioe.pe8.into_push_pull_output(),
            left_enable,
            left,
        )
        .map_err(refused)?;
        let right_motor = Servo::new(
            right_pwm,
            gpioe.pe10.into_push_pull_output(),
            right_enable,
            right,
        )
        .map_err(refused)?;

        let left_encoder = Qei::new(
            device.TIM3,
            (
                gpioc.pc6.into_alternate().internal_pull_up(true),
                gpioc.pc7.into_alternate().internal_pull_up(true),
            ),
            &mut rcc,
        );
        let right_encoder = Qei::new(
            device.TIM4,
            (
                gpiod.pd12.into_alternate().internal_pull_up(true),
                gpiod.pd13.into_alternate().internal_pull_up(true),
            ),
            &mut rcc,
        );
        filter_encoders();

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
        let (transmitter, receiver) = device
            .USART3
            .serial(
                (gpiod.pd8, gpiod.pd9),
                serial::Config::default().baudrate(115_200.bps()),
                &mut rcc,
            )
            .map_err(|_| "the serial port refused its settings")?
            .split();
        let mut receiver = Receiver(receiver);
        receiver.0.listen();

        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        let mut timer = device.TIM5.counter_hz(&mut rcc);
        timer
            .start(1.kHz())
            .map_err(|_| "the tick's timer refused its rate")?;
        timer.listen(timer::Event::Update);
        Ok(Self {
            reset_cause,
            left_encoder,
            right_encoder,
            left_motor,
            right_motor,
            sensors,
            leds: Leds {
                green: gpiob.pb0.into_push_pull_output(),
                blue: gpiob.pb7.into_push_pull_output(),
                red: gpiob.pb14.into_push_pull_output(),
            },
            watchdog,
            clock: Clock(time::CycleClock::new(DWT::cycle_count())),
            timer: Ticker(timer),
            receiver,
            transmitter: Transmitter(transmitter),
        })
    }
}

/// 168 MHz from the ST-LINK's 8 MHz, or from the internal oscillator (1 % off) if the ST-LINK gives none.
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

    fn start(iwdg: pac::IWDG, timeout: Duration) -> Self {
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
        watchdog.feed();
        watchdog
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
    /// Clears the interrupt's request.
    pub fn acknowledge(&mut self) {
        self.0.clear_flags(timer::Flag::Update);
    }
}

/// The analog inputs and the stop inputs.
pub struct Sensors {
    adc: pac::ADC1,
    estop: Pin<'E', 13, Input>,
    button: Pin<'C', 13, Input>,
    /// They stay analog.
    _pins: (PA3<Analog>, PC0<Analog>, PC3<Analog>),
}

impl Sensors {
    const VOLTS_PER_STEP: f32 = 3.3 / 4095.0;

    /// The three analog inputs are an injected group: one start converts all, each into a register of its own.
    fn start(
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
        let sensors = Self {
            adc,
            estop,
            button,
            _pins: pins,
        };
        sensors.convert();
        sensors
    }

    fn convert(&self) {
        self.adc.cr2().modify(|_, w| w.jswstart().start());
    }

    /// What was measured since the last call, a tick ago; starts the next conversion.
    pub fn read(&mut self) -> Inputs {
        let volts = |code: u16| f32::from(code) * Self::VOLTS_PER_STEP;
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

/// The receiving half of the serial port.
pub struct Receiver(serial::Rx<pac::USART3>);

impl Receiver {
    /// The byte that has come, or an error for one that was garbled or lost; `None` if there is none.
    pub fn read(&mut self) -> Option<Result<u8, serial::Error>> {
        match self.0.read() {
            Ok(byte) => Some(Ok(byte)),
            Err(nb::Error::Other(error)) => Some(Err(error)),
            Err(nb::Error::WouldBlock) => None,
        }
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

/// Switches both motors off by the shortest way: the timer lets go of the PWM pins, which become low outputs, as the enable pins do.
fn outputs_off() {
    // SAFETY: this is the end: no other code runs any more.
    let (timer, port) = unsafe { (pac::TIM1::steal(), pac::GPIOE::steal()) };
    port.bsrr().write(|w| {
        w.br12()
            .set_bit()
            .br14()
            .set_bit()
            .br9()
            .set_bit()
            .br11()
            .set_bit()
    });
    timer.bdtr().reset();
    port.moder()
        .modify(|_, w| w.moder9().output().moder11().output());
}

/// Ends in a reset by the watchdog, with the motors off.
pub fn halt() -> ! {
    cortex_m::interrupt::disable();
    outputs_off();
    loop {
        cortex_m::asm::nop();
    }
}

/// A hard fault, which every other fault becomes. The stack may be what is broken: it is taken anew before anything is pushed.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "mov sp, r1",
        "b {fault}",
        fault = sym fault,
    )
}

/// An interrupt that nobody serves: none is enabled.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn DefaultHandler() -> ! {
    naked_asm!("b HardFault")
}

/// Switches off, tells where it happened, and waits for the watchdog.
extern "C" fn fault(stack: *const u32) -> ! {
    outputs_off();
    defmt::error!("hard fault, stack at {=u32:#010x}", stack as u32);
    halt()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    halt()
}
