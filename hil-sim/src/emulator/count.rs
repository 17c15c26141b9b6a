//! Counts the instructions of the control interrupt, exactly, on the image as it is shipped; and those of corrections, paths and the map, which wait for no
//! interrupt but are interrupted.

use super::program::{Flow, Function, Program};
use anyhow::Result;
use rigless::emulator::{Hit, Watch};
use std::collections::{BTreeMap, HashMap};
use std::fmt;

/// The period of the control interrupt, ns.
const PERIOD_NS: u64 = 1_000_000;

/// Counts while the image runs.
#[derive(Debug)]
pub(super) struct Counter {
    entry: u64,
    exits: Vec<u64>,
    /// Where calls are, whom they call and where they come back to.
    calls: HashMap<u64, (usize, u64)>,
    names: Vec<String>,
    /// The interrupt that is under way: the count at its first instruction.
    entered: Option<u64>,
    pending: Vec<Call>,
    /// Of the interrupt that is under way, by callee.
    parts: BTreeMap<usize, (u64, u64)>,
    outside: Outside,
    counts: Counts,
}

#[derive(Debug)]
struct Call {
    callee: usize,
    back: u64,
    count: u64,
}

/// What was counted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Instructions of each call of the handler.
    pub ticks: Vec<u64>,
    /// When each call began, ns.
    pub starts: Vec<u64>,
    /// What was spent in each function that the handler calls, directly or not, with all that it calls in turn.
    pub parts: BTreeMap<String, PartCount>,
    /// The same of corrections, paths and the map, outside of the handler, without the interrupts that came in between; `most` is that of one call.
    pub outside: BTreeMap<String, PartCount>,
}

/// What was spent in a function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartCount {
    /// How often it was called.
    pub calls: u64,
    /// Instructions, in all.
    pub total: u64,
    /// Most instructions in one call of the handler.
    pub most: u64,
}

/// What is counted of idle, corrections, paths and the map: names of their functions begin so.
const COUNTED: [&str; 6] = [
    "vehicle_controller::trajectory::",
    "vehicle_controller::controller::interface::",
    "vehicle_controller::controller::correction::",
    "vehicle_controller::controller::history::",
    "vehicle_controller::interpreter::map::",
    "vehicle_controller::map::",
];

/// Counts what idle spends on them.
#[derive(Debug, Default)]
struct Outside {
    /// Where calls are, whom they call and where they come back to.
    calls: HashMap<u64, (String, u64)>,
    pending: Vec<OutsideCall>,
    /// The other interrupt, of the serial line: its first instruction, its returns, and the count when it began.
    receive: (u64, Vec<u64>, Option<u64>),
    /// Spent in interrupts so far.
    interrupted: u64,
}

#[derive(Debug)]
struct OutsideCall {
    callee: String,
    back: u64,
    count: u64,
    interrupted: u64,
}

impl Outside {
    fn new(program: &Program) -> Result<Self> {
        let mut calls = HashMap::new();
        for function in program.reachable(program.idle()?) {
            for (at, flow) in program.flow(function) {
                if let Flow::Call { target, back } = flow
                    && let Some(callee) = program.function(target)
                    && COUNTED.iter().any(|part| callee.name.contains(part))
                {
                    calls.insert(at, (callee.name.clone(), back));
                }
            }
        }
        let receive = program.receive()?;
        Ok(Self {
            calls,
            receive: (receive.address, exits(program, receive), None),
            ..Self::default()
        })
    }

    fn watches(&self) -> impl Iterator<Item = u64> {
        let (entry, exits, _) = &self.receive;
        let calls = self.calls.iter().flat_map(|(at, (_, back))| [*at, *back]);
        calls.chain([*entry]).chain(exits.iter().copied())
    }

    /// The core is about to run a watched instruction, and not in the control interrupt.
    fn hit(&mut self, at: u64, count: u64, counts: &mut BTreeMap<String, PartCount>) {
        let (entry, exits, entered) = &mut self.receive;
        if at == *entry {
            *entered = Some(count);
        }
        if let Some(begun) = *entered {
            if exits.contains(&at) {
                *entered = None;
                self.interrupted += count + 1 - begun;
            }
            return;
        }
        while let Some(call) = self.pending.pop_if(|call| call.back == at) {
            let spent = (count - call.count) - (self.interrupted - call.interrupted);
            let part = counts.entry(call.callee).or_default();
            part.calls += 1;
            part.total += spent;
            part.most = part.most.max(spent);
        }
        if let Some((callee, back)) = self.calls.get(&at) {
            self.pending.push(OutsideCall {
                callee: callee.clone(),
                back: *back,
                count: count + 1,
                interrupted: self.interrupted,
            });
        }
    }

    /// The control interrupt took so much. If it interrupted the other one, that counts it.
    fn interrupt(&mut self, spent: u64) {
        let (_, _, entered) = self.receive;
        if entered.is_none() {
            self.interrupted += spent;
        }
    }

    fn restart(&mut self) {
        self.pending.clear();
        self.receive.2 = None;
    }
}

impl Counter {
    /// A counter for this program, of the whole handler or of its parts too.
    pub(super) fn new(program: &Program, by_part: bool) -> Result<Self> {
        let control = program.control()?;
        let mut counter = Self {
            entry: control.address,
            exits: Vec::new(),
            calls: HashMap::new(),
            names: Vec::new(),
            entered: None,
            pending: Vec::new(),
            parts: BTreeMap::new(),
            outside: if by_part {
                Outside::new(program)?
            } else {
                Outside::default()
            },
            counts: Counts::default(),
        };
        let mut callees = HashMap::new();
        let parts = by_part.then(|| program.reachable(control));
        for function in parts.unwrap_or_default() {
            for (at, flow) in program.flow(function) {
                if let Flow::Call { target, back } = flow {
                    let callee = *callees.entry(target).or_insert_with(|| {
                        let known = program.function(target).map(|f| f.name.clone());
                        counter
                            .names
                            .push(known.unwrap_or(format!("{target:#010x}")));
                        counter.names.len() - 1
                    });
                    counter.calls.insert(at, (callee, back));
                }
            }
        }
        counter.exits = exits(program, control);
        Ok(counter)
    }

    /// What it must be told of.
    pub(super) fn watches(&self) -> impl Iterator<Item = Watch> {
        let calls = self.calls.iter().flat_map(|(at, (_, back))| [*at, *back]);
        let mut all: Vec<u64> = calls.chain(self.exits.clone()).collect();
        all.extend(self.outside.watches());
        all.push(self.entry);
        all.sort_unstable();
        all.dedup();
        all.into_iter().map(Watch::Instruction)
    }

    /// The core is about to run a watched instruction.
    pub(super) fn hit(&mut self, hit: &Hit) {
        // The count is of the instructions before it.
        let (at, count) = (hit.address, hit.instruction_count);
        if at == self.entry && self.entered.is_none() {
            self.entered = Some(count);
            self.counts.starts.push(hit.at.0);
        }
        let Some(entered) = self.entered else {
            self.outside.hit(at, count, &mut self.counts.outside);
            return;
        };
        while let Some(call) = self.pending.pop_if(|call| call.back == at) {
            let (calls, spent) = self.parts.entry(call.callee).or_default();
            *calls += 1;
            *spent += count - call.count;
        }
        if let Some((callee, back)) = self.calls.get(&at) {
            // The call itself belongs to the caller.
            self.pending.push(Call {
                callee: *callee,
                back: *back,
                count: count + 1,
            });
        }
        if self.pending.is_empty() && self.exits.contains(&at) {
            self.counts.ticks.push(count + 1 - entered);
            self.outside.interrupt(count + 1 - entered);
            self.entered = None;
            for (callee, (calls, spent)) in std::mem::take(&mut self.parts) {
                let name = self.names.get(callee).cloned().unwrap_or_default();
                let part = self.counts.parts.entry(name).or_default();
                part.calls += calls;
                part.total += spent;
                part.most = part.most.max(spent);
            }
        }
    }

    /// A reset: what was under way is over.
    pub(super) fn restart(&mut self) {
        self.entered = None;
        self.pending.clear();
        self.parts.clear();
        self.outside.restart();
    }

    /// What was counted so far.
    pub(super) fn counts(&self) -> &Counts {
        &self.counts
    }
}

/// Where the handler returns: in itself, or in what it jumps to as its last act.
fn exits(program: &Program, control: &Function) -> Vec<u64> {
    let mut exits = Vec::new();
    let mut waiting = vec![control];
    let mut seen = Vec::new();
    while let Some(function) = waiting.pop() {
        if seen.contains(&function.address) {
            continue;
        }
        seen.push(function.address);
        for (at, flow) in program.flow(function) {
            match flow {
                Flow::Return => exits.push(at),
                Flow::Jump(target) => waiting.extend(program.function(target)),
                Flow::Call { .. } => {}
            }
        }
    }
    exits
}

impl Counts {
    /// Instructions of the handler that half of its calls do not exceed.
    #[must_use]
    pub fn median(&self) -> u64 {
        let mut sorted = self.ticks.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied().unwrap_or_default()
    }

    /// Most instructions of one call of the handler.
    #[must_use]
    pub fn maximum(&self) -> u64 {
        self.ticks.iter().copied().max().unwrap_or_default()
    }

    /// How far the starts are from an exact grid of milliseconds: between the earliest and the latest against it, µs.
    #[must_use]
    pub fn jitter(&self) -> f64 {
        let late = self.starts.iter().zip(0..).map(|(start, tick)| {
            let grid: u64 = tick * PERIOD_NS;
            *start as i64 - grid as i64
        });
        let (least, most) = late.fold((i64::MAX, i64::MIN), |(least, most), late| {
            (least.min(late), most.max(late))
        });
        if self.starts.is_empty() {
            0.0
        } else {
            (most - least) as f64 * 1e-3
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ticks = self.ticks.len();
        writeln!(
            f,
            "{ticks} ticks; instructions in a tick: median {}, maximum {}; starts within {:.3} us of a grid of 1 ms",
            self.median(),
            self.maximum(),
            self.jitter()
        )?;
        writeln!(
            f,
            "{:>8} {:>8} {:>8}  of these, with all that it calls, in",
            "mean", "maximum", "calls"
        )?;
        let mean = |part: &PartCount| part.total as f64 / ticks.max(1) as f64;
        write_parts(f, &self.parts, mean)?;
        if self.outside.is_empty() {
            return Ok(());
        }
        writeln!(
            f,
            "outside of the ticks; instructions of a call, without what interrupts it\n{:>8} {:>8} {:>8}  of",
            "mean", "maximum", "calls"
        )?;
        write_parts(f, &self.outside, |part| {
            part.total as f64 / part.calls as f64
        })
    }
}

fn write_parts(
    f: &mut fmt::Formatter<'_>,
    parts: &BTreeMap<String, PartCount>,
    mean: impl Fn(&PartCount) -> f64,
) -> fmt::Result {
    let mut parts: Vec<_> = parts.iter().collect();
    parts.sort_by_key(|(name, part)| (std::cmp::Reverse(part.total), (*name).clone()));
    for (name, part) in parts {
        writeln!(
            f,
            "{:8.1} {:8} {:8}  {name}",
            mean(part),
            part.most,
            part.calls
        )?;
    }
    Ok(())
}
