//! The microcontroller: the models of the peripherals that the base uses, on a bus of their own.
//!
//! The part that `rigless` ships maps its flash read-only. This one puts the same models on a bus whose flash the flash interface programs, and leaves
//! out what the board does not use: an access to anything else is unmapped, which fails a run. What the bus needs to know (clock gates, clocks, reset
//! values where the vendor's tables are wrong) is restated from the reference manual, RM0090; the clocks come from the shipped part's own description.

use super::flash::Flash;
use rigless::cpu::armv7m;
use rigless::device::{ErasedDevice, ResetCause};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::stm32f427::generated::rcc::Register as RccRegister;
use rigless::soc::stm32f427::{CPU, Stm32f427, builder};
use rigless::soc::{Bus, Error, Gate, Peripheral, Region, WriteModify};
use rigless::time::VirtualNanos;

/// Where the flash begins.
pub const FLASH_BASE: u64 = 0x0800_0000;
/// How much of it there is.
pub const FLASH_BYTES: u64 = 2 << 20;

/// RM0090 section 2.3; the flash interface programs the flash.
static MEMORY: [Region; 5] = [
    Region::flash("flash", FLASH_BASE, FLASH_BYTES)
        .erased_to(0xFF)
        .programmed_by("FLASH"),
    Region::ram("ccm", 0x1000_0000, 64 << 10),
    Region::system("system", 0x1FFF_0000, 32 << 10),
    Region::ram("sram", 0x2000_0000, 192 << 10),
    Region::ram("backup_sram", 0x4002_4000, 4 << 10),
];

/// The peripherals of the part, and where each one's clock is switched on (RM0090 sections 6.3.10 to 6.3.14) and the peripheral reset (6.3.5 to 6.3.9).
const GATED: [(&str, &str, &str, &str, &str); 16] = [
    ("PWR", "APB1ENR", "PWREN", "APB1RSTR", "PWRRST"),
    ("GPIOA", "AHB1ENR", "GPIOAEN", "AHB1RSTR", "GPIOARST"),
    ("GPIOB", "AHB1ENR", "GPIOBEN", "AHB1RSTR", "GPIOBRST"),
    ("GPIOC", "AHB1ENR", "GPIOCEN", "AHB1RSTR", "GPIOCRST"),
    ("GPIOD", "AHB1ENR", "GPIODEN", "AHB1RSTR", "GPIODRST"),
    ("GPIOE", "AHB1ENR", "GPIOEEN", "AHB1RSTR", "GPIOERST"),
    ("GPIOH", "AHB1ENR", "GPIOHEN", "AHB1RSTR", "GPIOHRST"),
    ("TIM1", "APB2ENR", "TIM1EN", "APB2RSTR", "TIM1RST"),
    ("TIM2", "APB1ENR", "TIM2EN", "APB1RSTR", "TIM2RST"),
    ("TIM3", "APB1ENR", "TIM3EN", "APB1RSTR", "TIM3RST"),
    ("TIM4", "APB1ENR", "TIM4EN", "APB1RSTR", "TIM4RST"),
    ("TIM5", "APB1ENR", "TIM5EN", "APB1RSTR", "TIM5RST"),
    ("TIM8", "APB2ENR", "TIM8EN", "APB2RSTR", "TIM8RST"),
    ("USART3", "APB1ENR", "USART3EN", "APB1RSTR", "UART3RST"),
    ("ADC1", "APB2ENR", "ADC1EN", "APB2RSTR", "ADCRST"),
    ("C_ADC", "APB2ENR", "ADC1EN", "APB2RSTR", "ADCRST"),
];
/// Those that answer without a clock of their own to be switched on.
const UNGATED: [&str; 5] = ["RCC", "FLASH", "IWDG", "DBG", armv7m::DWT];

/// Reset values that the vendor's tables have wrong (RM0090 sections 18.4.12, 17.4.12, 30.6.1, 8.4.1, 8.4.3, 8.4.4).
const RESETS: [(&str, &str, u64); 13] = [
    ("TIM1", "ARR", 0xFFFF),
    ("TIM2", "ARR", 0xFFFF_FFFF),
    ("TIM3", "ARR", 0xFFFF),
    ("TIM4", "ARR", 0xFFFF),
    ("TIM5", "ARR", 0xFFFF_FFFF),
    ("TIM8", "ARR", 0xFFFF),
    ("USART3", "SR", 0x0000_00C0),
    ("GPIOA", "MODER", 0xA800_0000),
    ("GPIOA", "OSPEEDR", 0x0C00_0000),
    ("GPIOA", "PUPDR", 0x6400_0000),
    ("GPIOB", "MODER", 0x0000_0280),
    ("GPIOB", "OSPEEDR", 0x0000_00C0),
    ("GPIOB", "PUPDR", 0x0000_0100),
];
/// The ports that reset to inputs without pulls; their tables are those of port A.
const PLAIN_PORTS: [&str; 4] = ["GPIOC", "GPIOD", "GPIOE", "GPIOH"];

/// The microcontroller of the board.
#[derive(Debug)]
pub struct Part {
    bus: Bus,
    /// The models; the bus that they come with is not used.
    pub(super) models: Stm32f427,
    pub(super) flash: Flash,
    /// For each slot of the bus, which model answers.
    wiring: Box<[Model]>,
    pub(super) slots: Slots,
}

/// Which model answers for a slot.
#[derive(Clone, Copy, Debug)]
enum Model {
    /// The flash interface of this crate.
    Flash,
    /// The model at this slot of the shipped part.
    Shipped(usize),
}

/// Where the registers of what is wired to the world are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slots {
    rcc: usize,
    flash: usize,
    pwr: usize,
    pub(super) ports: [usize; 5],
    pub(super) pwm: usize,
    pub(super) servo: usize,
    pub(super) encoders: [usize; 3],
    pub(super) serial: usize,
}

fn bus() -> Result<Bus, Error> {
    let shipped = builder().build()?;
    let named = |name: &'static str| {
        let found = shipped.peripheral(name).copied();
        found.ok_or(Error::UnknownInstance { instance: name })
    };
    let names = UNGATED.into_iter().chain(GATED.map(|gated| gated.0));
    let peripherals: Vec<Peripheral> = names.clone().map(named).collect::<Result<_, _>>()?;
    let mut description = Bus::builder(CPU, &MEMORY, peripherals);
    for (instance, register, value) in RESETS {
        description = description.reset(instance, register, value);
    }
    for port in PLAIN_PORTS {
        for register in ["MODER", "OSPEEDR", "PUPDR"] {
            description = description.reset(port, register, 0);
        }
    }
    for timer in ["TIM1", "TIM2", "TIM3", "TIM4", "TIM5", "TIM8"] {
        description = description.write_modify(timer, "SR", WriteModify::ZeroToClear);
    }
    for (instance, enable, enabled, reset, held) in GATED {
        description = description
            .gate(instance, Gate::by("RCC", enable, enabled))
            .reset_by(instance, Gate::by("RCC", reset, held));
    }
    for name in names {
        if let Some(clock) = shipped.clock_of(name) {
            description = description.clocked_by(name, clock);
        }
    }
    // The watchdog starts its oscillator, the oscillator's failure breaks the PWM, and the converter's enable reaches its common block.
    for sink in ["RCC", "TIM1", "TIM8", "C_ADC", "ADC1"] {
        description = description.reads_requests(sink);
    }
    description.build()
}

impl Part {
    /// The part with this flash.
    ///
    /// # Errors
    /// If the description contradicts the vendor's tables.
    pub fn new(flash: Flash) -> Result<Self, Error> {
        let bus = bus()?;
        let models = Stm32f427::new()?;
        let wiring = bus
            .slots()
            .iter()
            .map(|slot| match slot.peripheral().name {
                "FLASH" => Ok(Model::Flash),
                name => models.bus().slot(name).map(Model::Shipped),
            })
            .collect::<Result<_, _>>()?;
        let slots = Slots {
            rcc: bus.slot("RCC")?,
            flash: bus.slot("FLASH")?,
            pwr: bus.slot("PWR")?,
            ports: [
                bus.slot("GPIOA")?,
                bus.slot("GPIOB")?,
                bus.slot("GPIOC")?,
                bus.slot("GPIOD")?,
                bus.slot("GPIOE")?,
            ],
            pwm: bus.slot("TIM1")?,
            servo: bus.slot("TIM8")?,
            encoders: [bus.slot("TIM3")?, bus.slot("TIM4")?, bus.slot("TIM2")?],
            serial: bus.slot("USART3")?,
        };
        let mut part = Self {
            bus,
            models,
            flash,
            wiring,
            slots,
        };
        part.check()?;
        Ok(part)
    }

    /// The crystal and the supply of the board, and the oscillator of the watchdog.
    pub(super) fn fit(&mut self, crystal_hz: u64, supply_millivolts: u32, lsi_hz: u64) {
        self.models.rcc.attach_crystals(crystal_hz, 0);
        self.models.rcc.calibrate_lsi(lsi_hz);
        let registers = self.bus.slot_mut(self.slots.pwr).registers_mut();
        self.models.pwr.set_supply(supply_millivolts, registers);
        self.models.adc[0].set_reference(supply_millivolts);
    }

    /// Power fails, as it does in a write to the flash that is cut off.
    pub(super) fn lose_power(&mut self, at: VirtualNanos) {
        self.flash.note_power_loss();
        let (_, mut context) = self.bus.drive(at, self.slots.flash);
        context.request_power(false);
    }

    /// Power comes back, if it was lost; whether it was.
    pub(super) fn restore_power(&mut self, at: VirtualNanos) -> bool {
        let lost = std::mem::take(&mut self.flash.lost_power);
        if lost {
            let (_, mut context) = self.bus.drive(at, self.slots.flash);
            context.request_power(true);
        }
        lost
    }

    /// The model of a port and its registers, the port by its place in the alphabet.
    pub(super) fn bus_and_models(&mut self) -> (&mut Bus, &mut Stm32f427) {
        (&mut self.bus, &mut self.models)
    }
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        &self.bus
    }

    fn bus_mut(&mut self) -> &mut Bus {
        &mut self.bus
    }

    /// A system reset (RM0090 section 6.1.1): all is new but what is soldered on, the content of the flash and the flags that say why.
    fn reset(&mut self, _at: VirtualNanos, cause: ResetCause) {
        let flags = self.bus.slots()[self.slots.rcc]
            .registers()
            .get(RccRegister::Csr);
        // The description built this once; it cannot fail now, and a reset has nobody to tell.
        let Ok(mut fresh) = Stm32f427::new() else {
            return;
        };
        self.bus.reset();
        let (crystal, lsi) = (self.models.rcc.crystals().0, self.models.rcc.lsi_hz());
        let supply = self.models.pwr.supply();
        fresh.usart[super::board::SERIAL_PORT]
            .inherit(&mut self.models.usart[super::board::SERIAL_PORT]);
        fresh.adc[0].inherit(&self.models.adc[0]);
        self.models = fresh;
        self.fit(crystal, supply, lsi);
        let registers = self.bus.slot_mut(self.slots.rcc).registers_mut();
        // A power-on leaves the flags as the reset values have them.
        if cause != ResetCause::PowerOn {
            self.models.rcc.restarted(cause, flags, registers);
        }
        self.flash.restart();
    }

    /// Only the serial line has something outside that speaks when it likes.
    fn poll(&mut self, now: VirtualNanos) {
        let (registers, mut context) = self.bus.drive(now, self.slots.serial);
        let serial = &mut self.models.usart[super::board::SERIAL_PORT];
        ErasedDevice::poll(serial, registers, &mut context);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        let model: Option<&mut dyn ErasedDevice> = match self.wiring.get(slot) {
            Some(Model::Flash) => Some(&mut self.flash),
            Some(Model::Shipped(shipped)) => self.models.split(*shipped).1,
            None => None,
        };
        (&mut self.bus, model)
    }
}
