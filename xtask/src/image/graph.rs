//! The call graph: every function that can be reached from some roots, and who calls whom from where.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use anyhow::Result;

use super::decode::{Code, decode};
use super::elf::Image;
use super::flow::{Flow, follow};

pub struct Graph {
    code: Code,
    pub functions: BTreeMap<u32, Flow>,
}

/// One step of a path: the instruction that calls, and what it calls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    pub site: u32,
    pub target: u32,
}

impl Graph {
    /// Follows everything that the roots call.
    pub fn new(image: &Image, roots: impl IntoIterator<Item = u32>) -> Result<Self> {
        let code = decode(image)?;
        let functions = functions(image, &code, roots);
        Ok(Self { code, functions })
    }

    /// Where a function jumps from to the stretch of code that ends in this instruction. The compiler makes one call of
    /// many that are alike; these tell them apart.
    pub fn origins(&self, function: u32, site: u32) -> Vec<u32> {
        let Some(flow) = self.functions.get(&function) else {
            return Vec::new();
        };
        let mut at = site;
        loop {
            let before = self.code.range(..at).next_back();
            let before = before.filter(|(before, instruction)| {
                instruction.next == at && instruction.goes_on() && self.comes_back(flow, **before)
            });
            let jumps = flow.jumps.get(&at).into_iter().flatten().copied();
            match before {
                Some((&before, _)) if flow.jumps.contains_key(&at) => {
                    return jumps.chain([before]).collect();
                }
                Some((&before, _)) => at = before,
                None => return jumps.collect(),
            }
        }
    }

    /// Whether what an instruction calls, if it calls, ever returns.
    fn comes_back(&self, flow: &Flow, site: u32) -> bool {
        let mut targets = flow
            .calls
            .range((site, 0)..=(site, u32::MAX))
            .map(|((_, target), _)| self.functions.get(target))
            .peekable();
        targets.peek().is_none() || targets.flatten().any(|flow| flow.returns)
    }

    /// The shortest way to each function from the roots; `stop` says which are not entered.
    pub fn paths(
        &self,
        roots: impl IntoIterator<Item = u32>,
        stop: impl Fn(u32) -> bool,
    ) -> BTreeMap<u32, Vec<Step>> {
        let mut paths: BTreeMap<u32, Vec<Step>> = BTreeMap::new();
        let mut pending: VecDeque<u32> = VecDeque::new();
        for root in roots {
            paths.insert(root, Vec::new());
            pending.push_back(root);
        }
        while let Some(entry) = pending.pop_front() {
            let Some(flow) = self.functions.get(&entry).filter(|_| !stop(entry)) else {
                continue;
            };
            for &(site, target) in flow.calls.keys() {
                if !paths.contains_key(&target) {
                    let mut path = paths[&entry].clone();
                    path.push(Step { site, target });
                    paths.insert(target, path);
                    pending.push_back(target);
                }
            }
        }
        paths
    }
}

/// Whether a function returns decides what its callers run into after the call. So all are taken not to return
/// until the opposite is seen, and then their callers are followed anew.
fn functions(
    image: &Image,
    code: &Code,
    roots: impl IntoIterator<Item = u32>,
) -> BTreeMap<u32, Flow> {
    let mut functions: BTreeMap<u32, Flow> = BTreeMap::new();
    let mut callers: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    let mut pending: BTreeSet<u32> = roots.into_iter().collect();
    while let Some(entry) = pending.pop_first() {
        let flow = follow(image, code, entry, |target| {
            functions.get(&target).is_some_and(|flow| flow.returns)
        });
        for &(_, target) in flow.calls.keys() {
            callers.entry(target).or_default().insert(entry);
            if !functions.contains_key(&target) && target != entry {
                pending.insert(target);
            }
        }
        let returned = functions.get(&entry).is_some_and(|flow| flow.returns);
        if flow.returns && !returned {
            pending.extend(callers.get(&entry).into_iter().flatten());
        }
        functions.insert(entry, flow);
    }
    functions
}
