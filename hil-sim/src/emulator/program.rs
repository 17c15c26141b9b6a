//! The image's machine code: its functions, and where one calls another or returns (ARMv7-M ARM, chapter A5).

use anyhow::{Context, Result, anyhow};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// The interrupt of TIM5 (RM0090 table 63).
const TIM5_INTERRUPT: u64 = 50;
/// The interrupt of USART3.
const USART3_INTERRUPT: u64 = 39;
/// The exceptions before the first interrupt in the vector table.
const EXCEPTIONS: u64 = 16;

/// A function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Function {
    /// Its name, without the compiler's decoration.
    pub name: String,
    /// Its first instruction.
    pub address: u64,
    size: u64,
}

/// What an instruction does to the flow of control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flow {
    /// Calls a function and comes back behind it.
    Call { target: u64, back: u64 },
    /// Goes on somewhere else.
    Jump(u64),
    /// Returns.
    Return,
}

/// The code of an image.
#[derive(Debug)]
pub(super) struct Program {
    functions: BTreeMap<u64, Function>,
    /// Where code turns into data, and data into code again.
    is_code_from: BTreeMap<u64, bool>,
    sections: Vec<(u64, Vec<u8>)>,
    vehicle: Option<String>,
}

/// Where the image says which vehicle it is for.
const VEHICLE: &str = "VEHICLE";

impl Program {
    /// Reads the code of an ELF file.
    pub(super) fn load(elf: &[u8]) -> Result<Self> {
        let file = object::File::parse(elf).context("the image is not an ELF file")?;
        let mut functions = BTreeMap::new();
        let mut is_code_from = BTreeMap::new();
        let mut vehicle = None;
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            match name.split('.').next() {
                Some("$t") => drop(is_code_from.insert(symbol.address(), true)),
                Some("$d") => drop(is_code_from.insert(symbol.address(), false)),
                _ if symbol.kind() == SymbolKind::Text && symbol.size() > 0 => {
                    let address = symbol.address() & !1;
                    let name = format!("{:#}", rustc_demangle::demangle(name));
                    let size = symbol.size();
                    functions.insert(
                        address,
                        Function {
                            name,
                            address,
                            size,
                        },
                    );
                }
                _ if name == VEHICLE => {
                    let section = symbol.section_index().map(|at| file.section_by_index(at));
                    let section = section.context("the vehicle has no section")??;
                    let bytes = section.data_range(symbol.address(), symbol.size())?;
                    vehicle = bytes.map(|bytes| String::from_utf8_lossy(bytes).into_owned());
                }
                _ => {}
            }
        }
        let sections = file
            .sections()
            .filter(|section| {
                matches!(
                    section.kind(),
                    SectionKind::Text | SectionKind::ReadOnlyData
                ) && section.address() > 0
            })
            .map(|section| Ok((section.address(), section.data()?.to_vec())))
            .collect::<Result<_>>()?;
        Ok(Self {
            functions,
            is_code_from,
            sections,
            vehicle,
        })
    }

    /// The handler of the control interrupt.
    pub(super) fn control(&self) -> Result<&Function> {
        self.handler(TIM5_INTERRUPT)
    }

    /// The handler of the serial line's interrupt.
    pub(super) fn receive(&self) -> Result<&Function> {
        self.handler(USART3_INTERRUPT)
    }

    fn handler(&self, interrupt: u64) -> Result<&Function> {
        let vector = super::part::FLASH_BASE + 4 * (EXCEPTIONS + interrupt);
        let low = self.half_word(vector);
        let (Some(low), Some(high)) = (low, self.half_word(vector + 2)) else {
            return Err(anyhow!("the image has no vector table"));
        };
        let address = u64::from(low & !1) | u64::from(high) << 16;
        let found = self.functions.get(&address);
        found.ok_or_else(|| anyhow!("the image has no function at {address:#010x}, where the vector of interrupt {interrupt} leads"))
    }

    /// The function of what runs when nothing else does.
    pub(super) fn idle(&self) -> Result<&Function> {
        let found = self.functions.values().find(|f| f.name.ends_with("::idle"));
        found.ok_or_else(|| anyhow!("the image has no function `idle`"))
    }

    /// The function that begins at an address.
    pub(super) fn function(&self, address: u64) -> Option<&Function> {
        self.functions.get(&address)
    }

    /// The name of the vehicle that the image is for, if it says so.
    pub(super) fn vehicle(&self) -> Option<&str> {
        self.vehicle.as_deref()
    }

    /// The half-word at an address.
    pub(super) fn half_word(&self, address: u64) -> Option<u16> {
        self.sections.iter().find_map(|(base, bytes)| {
            let at = usize::try_from(address.checked_sub(*base)?).ok()?;
            let bytes = bytes.get(at..at + 2)?;
            Some(u16::from_le_bytes([bytes[0], bytes[1]]))
        })
    }

    /// The calls, jumps out and returns in a function, with their addresses.
    pub(super) fn flow(&self, function: &Function) -> Vec<(u64, Flow)> {
        let (mut at, end) = (function.address, function.address + function.size);
        let mut found = Vec::new();
        while at < end {
            let part = self.is_code_from.range(..=at).next_back();
            if part.is_some_and(|(_, is_code)| !is_code) {
                let next = self.is_code_from.range(at + 1..).next();
                at = next.map_or(end, |(next, _)| *next);
                continue;
            }
            let (Some(first), second) = (self.half_word(at), self.half_word(at + 2)) else {
                break;
            };
            let length = if first >= 0xE800 { 4 } else { 2 };
            match decode(at, first, second.unwrap_or_default()) {
                Some(Flow::Jump(target)) if (function.address..end).contains(&target) => {}
                Some(flow) => found.push((at, flow)),
                None => {}
            }
            at += length;
        }
        found
    }

    /// A function and all that it can reach by calls and jumps.
    pub(super) fn reachable(&self, from: &Function) -> Vec<&Function> {
        let mut seen = BTreeSet::from([from.address]);
        let mut waiting = vec![from.address];
        while let Some(address) = waiting.pop() {
            let Some(function) = self.function(address) else {
                continue;
            };
            for (_, flow) in self.flow(function) {
                if let Flow::Call { target, .. } | Flow::Jump(target) = flow
                    && seen.insert(target)
                {
                    waiting.push(target);
                }
            }
        }
        seen.iter()
            .filter_map(|address| self.function(*address))
            .collect()
    }
}

/// What an instruction does to the flow of control; None for those that go on with the next one, and for conditional branches, which do not leave a
/// function.
fn decode(at: u64, first: u16, second: u16) -> Option<Flow> {
    match first {
        // BX LR; POP {…, PC}
        0x4770 | 0xBD00..=0xBDFF => return Some(Flow::Return),
        // B, T2
        0xE000..=0xE7FF => {
            let offset = sign_extend(u64::from(first & 0x7FF) << 1, 12);
            return Some(Flow::Jump(at.wrapping_add(4).wrapping_add(offset)));
        }
        // POP.W {…, PC}; LDR.W PC, [SP], #4
        0xE8BD if second & 0x8000 != 0 => return Some(Flow::Return),
        0xF85D if second == 0xFB04 => return Some(Flow::Return),
        0xF000..=0xF7FF if second & 0x9000 == 0x9000 => {}
        _ => return None,
    }
    // B.W, T4, and BL: imm = S:I1:I2:imm10:imm11:0 with I = NOT(J EOR S)
    let bit = |word: u16, bit: u16| u64::from(word >> bit & 1);
    let sign = bit(first, 10);
    let high = |j: u64| 1 ^ j ^ sign;
    let offset = sign << 24
        | high(bit(second, 13)) << 23
        | high(bit(second, 11)) << 22
        | u64::from(first & 0x3FF) << 12
        | u64::from(second & 0x7FF) << 1;
    let target = at.wrapping_add(4).wrapping_add(sign_extend(offset, 25));
    Some(if second & 0x4000 == 0 {
        Flow::Jump(target)
    } else {
        let back = at + 4;
        Flow::Call { target, back }
    })
}

fn sign_extend(value: u64, bits: u32) -> u64 {
    ((value << (64 - bits)) as i64 >> (64 - bits)) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_go_where_the_assembler_says() {
        // 8000262: 10 f0 0b fd  bl 0x8010c7c
        let call = decode(0x0800_0262, 0xF010, 0xFD0B);
        let (target, back) = (0x0801_0C7C, 0x0800_0266);
        assert_eq!(call, Some(Flow::Call { target, back }));
        // 800026e: 0c e0  b 0x800028a
        let jump = decode(0x0800_026E, 0xE00C, 0);
        assert_eq!(jump, Some(Flow::Jump(0x0800_028A)));
        // b .
        assert_eq!(
            decode(0x0800_0000, 0xE7FE, 0),
            Some(Flow::Jump(0x0800_0000))
        );
        // pop {r4, pc}; bx lr; pop.w {r4, pc}
        assert_eq!(decode(0, 0xBD10, 0), Some(Flow::Return));
        assert_eq!(decode(0, 0x4770, 0), Some(Flow::Return));
        assert_eq!(decode(0, 0xE8BD, 0x8010), Some(Flow::Return));
        // movs r0, #0; mrs r0, basepri
        assert_eq!(decode(0, 0x2000, 0), None);
        assert_eq!(decode(0, 0xF3EF, 0x8011), None);
    }
}
