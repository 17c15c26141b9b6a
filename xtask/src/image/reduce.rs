//! From the decoder's account of an instruction to the little of it that matters here.

use anyhow::{Result, anyhow};
use capstone::arch::arm::{ArmCC, ArmOperand, ArmOperandType, ArmReg, ArmShift};
use capstone::prelude::*;
use capstone::{Insn, RegId};

use self::instruction as I;
use super::decode::{Instruction, LINK, Operation, Register};

/// What an instruction does to control, stack and addresses.
pub fn reduce(decoder: &Capstone, instruction: &Insn) -> Result<Instruction> {
    let address = instruction.address() as u32;
    let detail = decoder
        .insn_detail(instruction)
        .map_err(|error| anyhow!("{error}"))?;
    let arch = detail.arch_detail();
    let arm = arch
        .arm()
        .ok_or_else(|| anyhow!("no details at {address:#x}"))?;
    let operands: Vec<_> = arm.operands().collect();
    let kind = instruction.id().0;
    let text = format!(
        "{} {}",
        instruction.mnemonic().unwrap_or_default(),
        instruction.op_str().unwrap_or_default()
    );
    let decoded = Decoded {
        kind,
        address,
        operands: &operands,
        writeback: arm.writeback(),
        text: &text,
    };
    let mut writes = 0;
    // The library's own account, and beside it the rule that a result comes first, in case the account has a gap.
    let first = operands.first().filter(|_| !decoded.reads_first());
    let first = first.and_then(|operand| register_of(&operand.op_type));
    for register in detail.regs_write().iter().copied().chain(first) {
        if let Some(Register(number)) = general(register) {
            writes |= 1 << number;
        }
    }
    let conditional = !matches!(arm.cc(), ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
    let compares = matches!(kind, I::CBZ | I::CBNZ);
    Ok(Instruction {
        next: address + instruction.len() as u32,
        conditional: conditional || compares,
        operation: decoded.operation(),
        writes,
        literal: decoded.literal(),
        text,
    })
}

struct Decoded<'a> {
    kind: u32,
    address: u32,
    operands: &'a [ArmOperand],
    writeback: bool,
    text: &'a str,
}

impl Decoded<'_> {
    fn operation(&self) -> Operation {
        use Operation as O;
        let target = self.immediate(self.operands.len().wrapping_sub(1));
        match (self.kind, self.register(0)) {
            (I::B | I::CBZ | I::CBNZ, _) => {
                target.map_or(O::Jump, |target| O::Branch(target as u32))
            }
            (I::BL, _) => target.map_or(O::Jump, |target| O::Call(target as u32)),
            (I::BLX, Some(register)) => O::CallRegister(register),
            // No compiler keeps anything but the return address there when it jumps to it.
            (I::BX, Some(LINK)) => O::Return(0),
            (I::BX | I::BXJ, register) => register.map_or(O::Jump, O::JumpRegister),
            (I::TBB | I::TBH, _) => self.table(),
            (I::UDF | I::TRAP | I::BKPT | I::SVC | I::HLT, _) => O::Trap,
            (I::MOV, _) if self.is(0, ArmReg::ARM_REG_PC) => {
                self.register(1).map_or(O::Jump, O::JumpRegister)
            }
            _ if self.writes_program_counter() => self.popped().map_or(O::Jump, O::Return),
            _ if self.moves_stack() => self.stack(),
            (_, Some(to)) => self.value(to),
            _ => O::Other,
        }
    }

    fn table(&self) -> Operation {
        let halfwords = self.kind == I::TBH;
        match self.memory(0) {
            Some((base, 0)) if base == ArmReg::ARM_REG_PC => Operation::Table {
                at: None,
                halfwords,
            },
            Some((base, 0)) => match general(RegId(base as u16)) {
                Some(register) => Operation::Table {
                    at: Some(register),
                    halfwords,
                },
                None => Operation::Jump,
            },
            _ => Operation::Jump,
        }
    }

    fn writes_program_counter(&self) -> bool {
        let listed = |operand: &ArmOperand| {
            register_of(&operand.op_type) == Some(RegId(ArmReg::ARM_REG_PC as u16))
        };
        match self.kind {
            I::POP | I::LDM | I::LDMDB => self.operands.iter().any(listed),
            _ => !self.reads_first() && self.is(0, ArmReg::ARM_REG_PC),
        }
    }

    /// What `pop {…, pc}`, `ldm sp!, {…, pc}` or `ldr pc, [sp], #4` takes from the stack.
    fn popped(&self) -> Option<i32> {
        match self.kind {
            I::POP | I::LDM | I::LDR if self.moves_stack() => match self.stack() {
                Operation::Stack(bytes) => Some(-bytes),
                _ => None,
            },
            _ => None,
        }
    }

    fn moves_stack(&self) -> bool {
        let through_memory = self.writeback
            && (0..self.operands.len())
                .any(|n| matches!(self.memory(n), Some((base, _)) if base == ArmReg::ARM_REG_SP));
        match self.kind {
            I::PUSH | I::POP | I::VPUSH | I::VPOP => true,
            // `msr` may change which stack is in use, or where it is.
            I::MSR => ["msp", "psp", "control"]
                .iter()
                .any(|register| self.text.to_lowercase().contains(register)),
            _ if self.is_multiple() => self.writeback && self.is(0, ArmReg::ARM_REG_SP),
            _ => through_memory || !self.reads_first() && self.is(0, ArmReg::ARM_REG_SP),
        }
    }

    fn stack(&self) -> Operation {
        let bytes = |from: usize| {
            let listed = self.operands.iter().skip(from);
            listed.map(|operand| width(&operand.op_type)).sum::<i32>()
        };
        let last = self.operands.len().wrapping_sub(1);
        match self.kind {
            I::PUSH | I::VPUSH => Operation::Stack(bytes(0)),
            I::POP | I::VPOP => Operation::Stack(-bytes(0)),
            I::STMDB | I::VSTMDB => Operation::Stack(bytes(1)),
            I::LDM | I::VLDMIA => Operation::Stack(-bytes(1)),
            I::SUB | I::SUBW if self.adds_to_stack() => self
                .immediate(last)
                .map_or(Operation::StackUnknown, Operation::Stack),
            I::ADD | I::ADDW if self.adds_to_stack() => self
                .immediate(last)
                .map_or(Operation::StackUnknown, |bytes| Operation::Stack(-bytes)),
            I::MOV => self
                .register(1)
                .map_or(Operation::StackUnknown, Operation::StackFrom),
            // Before: `str r4, [sp, #-8]!`; after: `ldr r4, [sp], #8`.
            I::STR | I::STRD | I::LDR | I::LDRD => {
                let before = (0..self.operands.len()).find_map(|n| self.memory(n));
                match (before, self.immediate(last)) {
                    (Some((_, 0)), Some(after)) => Operation::Stack(-self.signed(last, after)),
                    (Some((_, before)), None) => Operation::Stack(-before),
                    _ => Operation::StackUnknown,
                }
            }
            _ => Operation::StackUnknown,
        }
    }

    /// An address or a part of one put into a register.
    fn value(&self, to: Register) -> Operation {
        use Operation as O;
        let last = self.operands.len().wrapping_sub(1);
        let shifted = |operand: &ArmOperand| operand.shift != ArmShift::Invalid;
        if self.operands.iter().any(shifted) {
            return O::Other;
        }
        let from = self.register(last.saturating_sub(1));
        match (self.kind, self.immediate(last)) {
            (I::MOVW | I::MOV | I::MOVS, Some(value)) => O::Constant(to, value as u32),
            (I::MOVT, Some(value)) => O::Upper(to, (value as u32) << 16),
            (I::MOV | I::MOVS, None) => match self.register(1) {
                Some(from) => O::Copy(to, from),
                None if self.is(1, ArmReg::ARM_REG_SP) => O::CopyStack(to),
                None => O::Other,
            },
            (I::LDR, None) if !self.writeback => self
                .literal()
                .map_or(O::Other, |address| O::Literal(to, address)),
            (I::ADR, Some(offset)) => {
                O::Constant(to, self.program_counter().wrapping_add_signed(offset))
            }
            (I::ADD | I::ADDW | I::SUB | I::SUBW, Some(value)) => {
                let value = match self.kind {
                    I::ADD | I::ADDW => value,
                    _ => value.wrapping_neg(),
                };
                match from {
                    Some(from) => O::Add(to, from, value),
                    None if self.adds_to_stack() => O::AddStack(to, value),
                    None if self.is(1, ArmReg::ARM_REG_PC) => {
                        O::Constant(to, self.program_counter().wrapping_add_signed(value))
                    }
                    None => O::Other,
                }
            }
            (I::BFC, Some(bits)) if self.immediate(1) == Some(0) => O::Align(to, to, bits as u32),
            (I::BIC, Some(mask)) if (mask as u32 + 1).is_power_of_two() => {
                let bits = (mask as u32).trailing_ones();
                from.map_or(O::Other, |from| O::Align(to, from, bits))
            }
            _ => O::Other,
        }
    }

    /// Where a load relative to the program counter reads.
    fn literal(&self) -> Option<u32> {
        if !matches!(
            self.kind,
            I::LDR | I::LDRD | I::LDRB | I::LDRH | I::LDRSB | I::LDRSH | I::VLDR
        ) {
            return None;
        }
        (0..self.operands.len()).find_map(|n| match self.memory(n) {
            Some((ArmReg::ARM_REG_PC, offset)) => {
                Some(self.program_counter().wrapping_add_signed(offset))
            }
            _ => None,
        })
    }

    /// As instructions see it: four bytes ahead, and a multiple of four.
    fn program_counter(&self) -> u32 {
        (self.address & !3) + 4
    }

    /// Whether the stack pointer is what something is added to or subtracted from.
    fn adds_to_stack(&self) -> bool {
        // `sub sp, #8` is short for `sub sp, sp, #8`.
        self.is(1, ArmReg::ARM_REG_SP) || self.operands.len() == 2 && self.is(0, ArmReg::ARM_REG_SP)
    }

    /// Whether the first operand is a source.
    fn reads_first(&self) -> bool {
        matches!(
            self.kind,
            I::STR
                | I::STRB
                | I::STRH
                | I::STRD
                | I::STM
                | I::STMDB
                | I::VSTMIA
                | I::VSTMDB
                | I::VLDMIA
                | I::VLDMDB
                | I::LDM
                | I::LDMDB
                | I::PUSH
                | I::CMP
                | I::CMN
                | I::TST
                | I::TEQ
                | I::CBZ
                | I::CBNZ
        )
    }

    /// Several registers at the address in the first operand.
    fn is_multiple(&self) -> bool {
        matches!(
            self.kind,
            I::STM | I::STMDB | I::LDM | I::LDMDB | I::VSTMIA | I::VSTMDB | I::VLDMIA | I::VLDMDB
        )
    }

    fn is(&self, operand: usize, register: ArmReg::Type) -> bool {
        self.operands
            .get(operand)
            .and_then(|operand| register_of(&operand.op_type))
            == Some(RegId(register as u16))
    }

    fn register(&self, operand: usize) -> Option<Register> {
        general(register_of(&self.operands.get(operand)?.op_type)?)
    }

    fn immediate(&self, operand: usize) -> Option<i32> {
        match self.operands.get(operand)?.op_type {
            ArmOperandType::Imm(value) => Some(value),
            _ => None,
        }
    }

    /// An offset behind a memory operand may be one to subtract.
    fn signed(&self, operand: usize, value: i32) -> i32 {
        match self.operands.get(operand) {
            Some(operand) if operand.subtracted => -value,
            _ => value,
        }
    }

    /// Base and offset of an operand in memory that has no index.
    fn memory(&self, operand: usize) -> Option<(ArmReg::Type, i32)> {
        match self.operands.get(operand)?.op_type {
            ArmOperandType::Mem(memory) => {
                Some((ArmReg::Type::from(memory.base().0), memory.disp()))
            }
            _ => None,
        }
    }
}

fn register_of(operand: &ArmOperandType) -> Option<RegId> {
    match operand {
        ArmOperandType::Reg(register) => Some(*register),
        _ => None,
    }
}

/// The registers that may hold an address, the stack pointer and the program counter aside.
fn general(register: RegId) -> Option<Register> {
    match u32::from(register.0) {
        ArmReg::ARM_REG_LR => Some(LINK),
        number @ ArmReg::ARM_REG_R0..=ArmReg::ARM_REG_R12 => {
            Some(Register((number - ArmReg::ARM_REG_R0) as u8))
        }
        _ => None,
    }
}

/// The bytes that a register takes on the stack.
fn width(operand: &ArmOperandType) -> i32 {
    match register_of(operand).map(|register| u32::from(register.0)) {
        Some(ArmReg::ARM_REG_D0..=ArmReg::ARM_REG_D31) => 8,
        Some(_) => 4,
        None => 0,
    }
}

/// The decoder's numbers of the instructions that matter here, as constants to match against.
mod instruction {
    use capstone::arch::arm::ArmInsn as A;

    pub const ADD: u32 = A::ARM_INS_ADD as u32;
    pub const ADDW: u32 = A::ARM_INS_ADDW as u32;
    pub const ADR: u32 = A::ARM_INS_ADR as u32;
    pub const B: u32 = A::ARM_INS_B as u32;
    pub const BFC: u32 = A::ARM_INS_BFC as u32;
    pub const BIC: u32 = A::ARM_INS_BIC as u32;
    pub const BKPT: u32 = A::ARM_INS_BKPT as u32;
    pub const BL: u32 = A::ARM_INS_BL as u32;
    pub const BLX: u32 = A::ARM_INS_BLX as u32;
    pub const BX: u32 = A::ARM_INS_BX as u32;
    pub const BXJ: u32 = A::ARM_INS_BXJ as u32;
    pub const CBNZ: u32 = A::ARM_INS_CBNZ as u32;
    pub const CBZ: u32 = A::ARM_INS_CBZ as u32;
    pub const CMN: u32 = A::ARM_INS_CMN as u32;
    pub const CMP: u32 = A::ARM_INS_CMP as u32;
    pub const HLT: u32 = A::ARM_INS_HLT as u32;
    pub const LDM: u32 = A::ARM_INS_LDM as u32;
    pub const LDMDB: u32 = A::ARM_INS_LDMDB as u32;
    pub const LDR: u32 = A::ARM_INS_LDR as u32;
    pub const LDRB: u32 = A::ARM_INS_LDRB as u32;
    pub const LDRD: u32 = A::ARM_INS_LDRD as u32;
    pub const LDRH: u32 = A::ARM_INS_LDRH as u32;
    pub const LDRSB: u32 = A::ARM_INS_LDRSB as u32;
    pub const LDRSH: u32 = A::ARM_INS_LDRSH as u32;
    pub const MOV: u32 = A::ARM_INS_MOV as u32;
    pub const MOVS: u32 = A::ARM_INS_MOVS as u32;
    pub const MOVT: u32 = A::ARM_INS_MOVT as u32;
    pub const MOVW: u32 = A::ARM_INS_MOVW as u32;
    pub const MSR: u32 = A::ARM_INS_MSR as u32;
    pub const POP: u32 = A::ARM_INS_POP as u32;
    pub const PUSH: u32 = A::ARM_INS_PUSH as u32;
    pub const STM: u32 = A::ARM_INS_STM as u32;
    pub const STMDB: u32 = A::ARM_INS_STMDB as u32;
    pub const STR: u32 = A::ARM_INS_STR as u32;
    pub const STRB: u32 = A::ARM_INS_STRB as u32;
    pub const STRD: u32 = A::ARM_INS_STRD as u32;
    pub const STRH: u32 = A::ARM_INS_STRH as u32;
    pub const SUB: u32 = A::ARM_INS_SUB as u32;
    pub const SUBW: u32 = A::ARM_INS_SUBW as u32;
    pub const SVC: u32 = A::ARM_INS_SVC as u32;
    pub const TBB: u32 = A::ARM_INS_TBB as u32;
    pub const TBH: u32 = A::ARM_INS_TBH as u32;
    pub const TEQ: u32 = A::ARM_INS_TEQ as u32;
    /// `udf #254`, which LLVM puts where nothing should get.
    pub const TRAP: u32 = A::ARM_INS_TRAP as u32;
    pub const TST: u32 = A::ARM_INS_TST as u32;
    pub const UDF: u32 = A::ARM_INS_UDF as u32;
    pub const VLDMDB: u32 = A::ARM_INS_VLDMDB as u32;
    pub const VLDMIA: u32 = A::ARM_INS_VLDMIA as u32;
    pub const VLDR: u32 = A::ARM_INS_VLDR as u32;
    pub const VPOP: u32 = A::ARM_INS_VPOP as u32;
    pub const VPUSH: u32 = A::ARM_INS_VPUSH as u32;
    pub const VSTMDB: u32 = A::ARM_INS_VSTMDB as u32;
    pub const VSTMIA: u32 = A::ARM_INS_VSTMIA as u32;
}
