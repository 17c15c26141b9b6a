//! Instructions, reduced to what they do to the flow of control, to the stack pointer and to addresses in registers.

use std::collections::BTreeMap;

use anyhow::{Result, anyhow};
use capstone::arch::arm::{ArchExtraMode, ArchMode};
use capstone::prelude::*;

use super::elf::Image;
use super::reduce::reduce;

/// One of r0 to r12, or the link register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register(pub u8);

pub const LINK: Register = Register(14);
/// Their number, the stack pointer's place among them unused.
pub const REGISTERS: usize = 15;

/// What an instruction means here.
#[derive(Clone, Debug, PartialEq)]
pub enum Operation {
    /// Goes on to the next instruction; only the registers it writes matter.
    Other,
    Branch(u32),
    Call(u32),
    CallRegister(Register),
    JumpRegister(Register),
    /// Back to the caller, with so many bytes taken from the stack by the same instruction.
    Return(i32),
    /// A jump over as many bytes or halfwords as a table says, twice: the one behind the instruction, or where a register points.
    Table {
        at: Option<Register>,
        halfwords: bool,
    },
    /// A jump to where nothing here can tell.
    Jump,
    /// Stops the program: `udf`, `bkpt`, `svc`.
    Trap,
    /// The stack grows by so many bytes, or shrinks.
    Stack(i32),
    StackFrom(Register),
    /// A new stack pointer from who knows where.
    StackUnknown,
    Constant(Register, u32),
    /// `movt`: the upper half.
    Upper(Register, u32),
    /// A word in the program's own constants.
    Literal(Register, u32),
    Copy(Register, Register),
    CopyStack(Register),
    Add(Register, Register, i32),
    AddStack(Register, i32),
    /// Clears this many low bits.
    Align(Register, Register, u32),
}

/// One decoded instruction.
#[derive(Clone, Debug, PartialEq)]
pub struct Instruction {
    pub next: u32,
    /// Whether it may be passed over, by an `it` before it or a condition of its own.
    pub conditional: bool,
    pub operation: Operation,
    /// Bit by bit, the registers whose contents are another afterwards.
    pub writes: u16,
    /// Where it reads a constant from near it, if it does.
    pub literal: Option<u32>,
    pub text: String,
}

impl Instruction {
    /// Whether the next instruction may follow, as far as this one knows.
    pub fn goes_on(&self) -> bool {
        let leaves = matches!(
            self.operation,
            Operation::Branch(_)
                | Operation::JumpRegister(_)
                | Operation::Return(_)
                | Operation::Table { .. }
                | Operation::Jump
                | Operation::Trap
        );
        self.conditional || !leaves
    }
}

/// All of an image's instructions, by address.
pub type Code = BTreeMap<u32, Instruction>;

/// Decodes every stretch of code. What cannot be decoded is missing: whoever gets there has to say so.
pub fn decode(image: &Image) -> Result<Code> {
    let decoder = Capstone::new()
        .arm()
        .mode(ArchMode::Thumb)
        .extra_mode([ArchExtraMode::MClass].into_iter())
        .detail(true)
        .build()
        .map_err(|error| anyhow!("{error}"))?;
    let mut code = Code::new();
    for stretch in &image.code {
        let mut at = stretch.start;
        while at < stretch.end {
            let Some(bytes) = image.constant(at, stretch.end - at) else {
                return Err(anyhow!("code at {at:#x} is not in flash"));
            };
            let instructions = decoder
                .disasm_all(bytes, u64::from(at))
                .map_err(|error| anyhow!("{error}"))?;
            for instruction in instructions.iter() {
                let decoded = reduce(&decoder, instruction)?;
                let address = instruction.address() as u32;
                at = decoded.next;
                code.insert(address, decoded);
            }
            // The decoder stops where it does not understand; what follows may be code all the same.
            if at < stretch.end {
                at += wide(bytes, (at - stretch.start) as usize);
            }
        }
    }
    Ok(code)
}

/// The length of an instruction nobody understands: its first five bits tell.
fn wide(bytes: &[u8], at: usize) -> u32 {
    match bytes.get(at + 1) {
        Some(byte) if byte >> 3 >= 0b11101 => 4,
        _ => 2,
    }
}
