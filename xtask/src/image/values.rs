//! What a register may hold, as far as it matters: a few addresses, or a place on the stack.

use super::decode::{LINK, REGISTERS, Register};

/// How many addresses are kept apart: a function pointer chosen among more is rare.
const MOST: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Unknown,
    /// One of these.
    Constants([u32; MOST], usize),
    /// So many bytes below where the stack pointer was when the function was called.
    Stack(i32),
}

impl Value {
    pub fn constant(value: u32) -> Self {
        Self::Constants([value; MOST], 1)
    }

    pub fn constants(&self) -> Option<&[u32]> {
        match self {
            Self::Constants(values, count) => values.get(..*count),
            _ => None,
        }
    }

    /// Either of two.
    pub fn or(self, other: Self) -> Self {
        let (Some(ours), Some(theirs)) = (self.constants(), other.constants()) else {
            return if self == other { self } else { Self::Unknown };
        };
        let mut all = [ours, theirs].concat();
        all.sort_unstable();
        all.dedup();
        let Some(&first) = all.first().filter(|_| all.len() <= MOST) else {
            return Self::Unknown;
        };
        let mut values = [first; MOST];
        values[..all.len()].copy_from_slice(&all);
        Self::Constants(values, all.len())
    }

    /// Whatever it is, changed like this.
    pub fn map(self, constant: impl Fn(u32) -> u32, stack: impl Fn(i32) -> Option<i32>) -> Self {
        match self {
            Self::Unknown => Self::Unknown,
            Self::Stack(depth) => stack(depth).map_or(Self::Unknown, Self::Stack),
            Self::Constants(values, count) => {
                let mapped = values[..count].iter().map(|&value| constant(value));
                mapped
                    .map(Self::constant)
                    .reduce(Self::or)
                    .unwrap_or(Self::Unknown)
            }
        }
    }
}

/// The stack's depth and the registers before an instruction.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub depth: i32,
    registers: [Value; REGISTERS],
}

impl State {
    pub fn at_entry() -> Self {
        Self {
            depth: 0,
            registers: [Value::Unknown; REGISTERS],
        }
    }

    pub fn get(&self, register: Register) -> Value {
        self.registers[usize::from(register.0)]
    }

    pub fn set(&mut self, register: Register, value: Value) {
        self.registers[usize::from(register.0)] = value;
    }

    /// Forgets the registers whose bits are set.
    pub fn forget(&mut self, registers: u16) {
        for (number, value) in self.registers.iter_mut().enumerate() {
            if registers & (1 << number) != 0 {
                *value = Value::Unknown;
            }
        }
    }

    /// Forgets what a called function may overwrite.
    pub fn forget_after_call(&mut self) {
        let scratch = [0, 1, 2, 3, 12, LINK.0];
        self.forget(scratch.iter().map(|number| 1 << number).sum());
    }

    /// Where two ways meet; the deeper stack counts.
    pub fn or(&self, other: &Self) -> Self {
        let mut both = self.clone();
        both.depth = self.depth.max(other.depth);
        for (ours, theirs) in both.registers.iter_mut().zip(other.registers) {
            *ours = ours.or(theirs);
        }
        both
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_keeps_both_constants_in_any_order() {
        let both = Value::constant(8).or(Value::constant(4));
        assert_eq!(both.constants(), Some(&[4, 8][..]));
        assert_eq!(both, Value::constant(4).or(Value::constant(8)));
        assert_eq!(both.or(Value::constant(8)), both);
        assert_eq!(both.or(Value::Unknown), Value::Unknown);
        assert_eq!(Value::constant(4).or(Value::Stack(4)), Value::Unknown);
    }

    #[test]
    fn too_many_constants_are_unknown() {
        let values = (0..=MOST as u32).map(Value::constant);
        assert_eq!(values.reduce(Value::or), Some(Value::Unknown));
    }
}
