//! The end: motors off, and a reset by the watchdog.

use core::arch::naked_asm;
use stm32f4xx_hal::pac;

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
    /// Where the processor has put the address of the instruction, in its frame of eight words.
    const PROGRAM_COUNTER: usize = 6;
    outputs_off();
    let top = &raw const _stack_start as usize;
    let bottom = &raw const _stack_end as usize;
    if (bottom..top - 32).contains(&(stack as usize)) {
        // SAFETY: the frame lies within the stack, where any word can be read.
        let at = unsafe { stack.add(PROGRAM_COUNTER).read_volatile() };
        defmt::error!("hard fault at {=u32:#010x}", at);
    } else {
        defmt::error!("hard fault: the stack has overflown");
    }
    halt()
}

unsafe extern "C" {
    // From memory.x.
    static _stack_start: u32;
    static _stack_end: u32;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    halt()
}
