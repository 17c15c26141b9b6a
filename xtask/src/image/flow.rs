//! One function's control flow: follows every way through it, with the stack's depth and the addresses in registers.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;

use super::decode::{Code, Instruction, Operation};
use super::elf::Image;
use super::table;
use super::values::{State, Value};

/// Deeper than this a stack grows in a loop.
const BOTTOMLESS: i32 = 1 << 16;

/// What one needs to know of a function to know what calling it does.
#[derive(Debug, Default)]
pub struct Flow {
    /// From which instruction which function is called, and how many bytes this one has on the stack then.
    /// The jump to another function at a function's end is such a call, too.
    pub calls: BTreeMap<(u32, u32), i32>,
    /// The most bytes it has on the stack itself.
    pub depth: i32,
    /// Whether it ever comes back.
    pub returns: bool,
    /// What stands in the way of knowing more, or stops the program, by its instruction's address.
    pub faults: BTreeMap<u32, Fault>,
    /// From which instructions one jumps to which, other than to the next one.
    pub jumps: BTreeMap<u32, BTreeSet<u32>>,
}

/// Something that no instruction on the way of a running controller may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// Stops the program.
    Trap,
    /// Goes where only the running program knows.
    Indirect(String),
    /// Is none that the decoder knows, or no code at all.
    Undecodable,
    /// Takes the stack somewhere unknown.
    Stack(String),
    /// Returns with something left on the stack: the analysis has misread the function.
    Unbalanced(i32),
}

impl Fault {
    /// Whether only the bound on the stack suffers.
    pub fn is_about_the_stack(&self) -> bool {
        matches!(self, Self::Stack(_) | Self::Unbalanced(_))
    }

    /// Whether a stack may be deeper for it than what was seen.
    pub fn hides_something(&self) -> bool {
        *self != Self::Trap
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Trap => write!(f, "an instruction that stops the program"),
            Self::Indirect(text) => write!(f, "`{text}` to an address that is not known"),
            Self::Undecodable => write!(f, "no instruction that can be decoded"),
            Self::Stack(text) => write!(f, "`{text}` moves the stack by an unknown amount"),
            Self::Unbalanced(depth) => write!(f, "a return with {depth} bytes on the stack"),
        }
    }
}

/// Follows a function from its first instruction. `returns` says of another one whether it ever comes back.
pub fn follow<R: Fn(u32) -> bool>(image: &Image, code: &Code, entry: u32, returns: R) -> Flow {
    let mut walk = Walk {
        image,
        code,
        range: extent(image, entry),
        returns,
        flow: Flow::default(),
        states: BTreeMap::from([(entry, State::at_entry())]),
        pending: vec![entry],
    };
    while let Some(address) = walk.pending.pop() {
        let state = walk.states.get(&address).cloned();
        if let Some(state) = state {
            walk.step(address, &state);
        }
    }
    walk.flow
}

/// The function that an address is in, to its end; without a symbol, up to the next one.
fn extent(image: &Image, address: u32) -> Range<u32> {
    if let Some((start, function)) = image.function_at(address) {
        return start..function.end;
    }
    let next = image.functions.range(address + 1..).next();
    address..next.map_or(u32::MAX, |(&start, _)| start)
}

struct Walk<'a, R> {
    image: &'a Image,
    code: &'a Code,
    range: Range<u32>,
    returns: R,
    flow: Flow,
    /// Before each instruction reached so far.
    states: BTreeMap<u32, State>,
    pending: Vec<u32>,
}

impl<R: Fn(u32) -> bool> Walk<'_, R> {
    fn step(&mut self, address: u32, before: &State) {
        let code = self.code;
        let Some(instruction) = code.get(&address) else {
            self.flow.faults.insert(address, Fault::Undecodable);
            return;
        };
        let mut after = before.clone();
        after.forget(instruction.writes);
        let goes_on = match &instruction.operation {
            Operation::Branch(target) => {
                self.go(address, *target, after.clone());
                false
            }
            Operation::Call(target) => {
                let comes_back = self.call(address, *target, before.depth);
                after.forget_after_call();
                comes_back
            }
            Operation::CallRegister(register) => {
                let comes_back = if let Some(targets) = self.code_addresses(before.get(*register)) {
                    targets.iter().fold(false, |comes_back, &target| {
                        self.call(address, target, before.depth) | comes_back
                    })
                } else {
                    self.fault(address, Fault::Indirect(instruction.text.clone()));
                    true
                };
                after.forget_after_call();
                comes_back
            }
            Operation::JumpRegister(register) => {
                let targets = self.code_addresses(before.get(*register));
                self.go_to_one_of(address, instruction, targets, &after);
                false
            }
            Operation::Return(popped) => {
                self.flow.returns = true;
                if before.depth != *popped {
                    self.fault(address, Fault::Unbalanced(before.depth - popped));
                }
                false
            }
            Operation::Table { at, halfwords } => {
                let origin = instruction.next;
                let start = match at.map(|register| before.get(register)) {
                    None => Some(origin),
                    Some(Value::Constants([start, ..], 1)) => Some(start),
                    Some(_) => None,
                };
                let targets = start.and_then(|start| {
                    table::targets(self.image, code, &self.range, start, origin, *halfwords)
                });
                self.go_to_one_of(address, instruction, targets, &after);
                false
            }
            Operation::Jump => {
                self.go_to_one_of(address, instruction, None, &after);
                false
            }
            Operation::Trap => {
                self.fault(address, Fault::Trap);
                false
            }
            _ => {
                self.compute(address, instruction, before, &mut after);
                true
            }
        };
        self.flow.depth = self.flow.depth.max(after.depth);
        if instruction.conditional {
            // Also the way on which nothing of it happened.
            after = after.or(before);
        }
        if goes_on || instruction.conditional {
            self.go(address, instruction.next, after);
        }
    }

    /// Instructions that go on to the next one.
    fn compute(
        &mut self,
        address: u32,
        instruction: &Instruction,
        before: &State,
        after: &mut State,
    ) {
        let image = self.image;
        match instruction.operation {
            Operation::Stack(bytes) => after.depth += bytes,
            Operation::StackFrom(register) => match before.get(register) {
                Value::Stack(depth) => after.depth = depth,
                // A fault handler that takes the whole stack anew is at its start.
                Value::Constants([top, ..], 1) if image.address_of("_stack_start") == Some(top) => {
                    after.depth = 0;
                }
                _ => self.fault(address, Fault::Stack(instruction.text.clone())),
            },
            Operation::StackUnknown => {
                self.fault(address, Fault::Stack(instruction.text.clone()));
            }
            Operation::Constant(to, value) => after.set(to, Value::constant(value)),
            Operation::Upper(to, upper) => {
                let lower = before.get(to);
                after.set(to, lower.map(|value| value & 0xffff | upper, |_| None));
            }
            Operation::Literal(to, at) => {
                after.set(to, image.word(at).map_or(Value::Unknown, Value::constant));
            }
            Operation::Copy(to, from) => after.set(to, before.get(from)),
            Operation::CopyStack(to) => after.set(to, Value::Stack(before.depth)),
            Operation::Add(to, from, value) => {
                let sum = before.get(from).map(
                    |constant| constant.wrapping_add_signed(value),
                    |depth| depth.checked_sub(value),
                );
                after.set(to, sum);
            }
            Operation::AddStack(to, value) => {
                after.set(to, Value::Stack(before.depth.saturating_sub(value)));
            }
            Operation::Align(to, from, bits) => {
                let low = 1_u32.checked_shl(bits).map_or(u32::MAX, |bit| bit - 1);
                let aligned = before.get(from).map(
                    |constant| constant & !low,
                    |depth| depth.checked_add_unsigned(low),
                );
                after.set(to, aligned);
            }
            _ => {}
        }
        if !(0..BOTTOMLESS).contains(&after.depth) {
            self.fault(address, Fault::Stack(instruction.text.clone()));
            after.depth = after.depth.clamp(0, BOTTOMLESS);
        }
    }

    /// Goes on at each of several addresses, if they are known.
    fn go_to_one_of(
        &mut self,
        from: u32,
        instruction: &Instruction,
        targets: Option<Vec<u32>>,
        state: &State,
    ) {
        match targets {
            Some(targets) => {
                for target in targets {
                    self.go(from, target, state.clone());
                }
            }
            None => self.fault(from, Fault::Indirect(instruction.text.clone())),
        }
    }

    /// Goes on at an address, which may be another function's.
    fn go(&mut self, from: u32, target: u32, state: State) {
        if !self.range.contains(&target) {
            let returns = self.call(from, target, state.depth);
            self.flow.returns |= returns;
            return;
        }
        let next = self.code.get(&from).map(|instruction| instruction.next);
        if next != Some(target) {
            self.flow.jumps.entry(target).or_default().insert(from);
        }
        let merged = match self.states.get(&target) {
            Some(known) => {
                let merged = known.or(&state);
                if merged == *known {
                    return;
                }
                merged
            }
            None => state,
        };
        self.states.insert(target, merged);
        self.pending.push(target);
    }

    /// Notes a call; whether it ever comes back.
    fn call(&mut self, site: u32, target: u32, depth: i32) -> bool {
        let known = self.flow.calls.entry((site, target)).or_default();
        *known = depth.max(*known);
        (self.returns)(target)
    }

    fn fault(&mut self, address: u32, fault: Fault) {
        self.flow.faults.insert(address, fault);
    }

    /// Where a register points, if all it may hold are addresses of Thumb code.
    fn code_addresses(&self, value: Value) -> Option<Vec<u32>> {
        let constants = value.constants()?;
        let all = constants
            .iter()
            .all(|address| address & 1 == 1 && self.code.contains_key(&(address & !1)));
        all.then(|| constants.iter().map(|address| address & !1).collect())
    }
}
