//! Small programs for the tests, compiled and linked for the board while they run.

use std::fs;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use super::elf::Image;
use super::toolchain::{TARGET, Toolchain};
use crate::run::Session;

/// A program without interrupts: the reset leads to the idle loop.
const PRELUDE: &str = r#"
#![no_std]
#![no_main]
#![allow(dead_code, static_mut_refs)]
use core::arch::naked_asm;
use core::hint::black_box;
use core::ptr::{read_volatile, write_volatile};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

#[unsafe(link_section = ".vector_table")]
#[used]
static VECTORS: [unsafe extern "C" fn(); 2] = [Reset, Reset];

#[unsafe(no_mangle)]
unsafe extern "C" fn Reset() {
    unsafe { idle() }
}

static mut INPUT: usize = 0;
fn input() -> usize {
    unsafe { read_volatile(&raw const INPUT) }
}
fn output(value: usize) {
    unsafe { write_volatile(&raw mut INPUT, value) }
}

/// A function in assembler.
macro_rules! naked {
    ($name:ident: $($line:literal),*) => {
        #[unsafe(no_mangle)]
        #[unsafe(naked)]
        unsafe extern "C" fn $name() { naked_asm!(".fpu fpv4-sp-d16", $($line),*) }
    };
}

/// The idle loop.
macro_rules! idle {
    ($($body:tt)*) => {
        #[unsafe(no_mangle)]
        #[inline(never)]
        unsafe extern "C" fn idle() { loop { $($body)* } }
    };
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn leaf() {
    output(1);
}
"#;

/// Where a program's own text begins in its file.
pub const FIRST_LINE: usize = 54;

const LINKER_SCRIPT: &str = "
ENTRY(Reset)
_stack_start = 0x20001000;
_stack_end = 0x20000000;
SECTIONS {
  .vector_table 0x08000000 : { KEEP(*(.vector_table)) }
  .text : { *(.text .text.*) }
  .rodata : { *(.rodata .rodata.*) }
  .data 0x20001000 : { *(.data .data.*) }
  .bss : { *(.bss .bss.*) }
  /DISCARD/ : { *(.ARM.exidx .ARM.exidx.*) }
}";

/// The image of a program whose `idle` is in `source`. None, and a line that says so, without a Rust for the board.
pub fn image(source: &str) -> Option<Image> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    if Toolchain::present(&Session::new()) != Some(Toolchain::Target) {
        eprintln!("LEFT OUT: rustup has no library for {TARGET}");
        return None;
    }
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("xtask-{}-{number}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("fixture.rs"), format!("{PRELUDE}{source}")).unwrap();
    fs::write(folder.join("fixture.x"), LINKER_SCRIPT).unwrap();
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let options = "--edition 2024 -C opt-level=s -C panic=abort -C debuginfo=2 -C link-arg=-Tfixture.x -o fixture.elf";
    let output = Command::new(rustc)
        .args(["fixture.rs", "--target", TARGET])
        .args(options.split(' '))
        .current_dir(&folder)
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let image = Image::read(&folder.join("fixture.elf")).unwrap();
    fs::remove_dir_all(&folder).unwrap();
    Some(image)
}
