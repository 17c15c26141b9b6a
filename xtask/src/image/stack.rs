//! `cargo xtask stack`: how deep the stack can get.
//!
//! The machine code says what each function puts on it. The deepest way from the reset on is added to the deepest way
//! of every handler, as if each had interrupted the one before at its deepest: a bound for any priorities.

use std::collections::BTreeMap;
use std::fmt::Write;

use anyhow::{Context, Result, ensure};

use super::elf::Image;
use super::graph::{Graph, Step};
use super::source::Sources;

/// What issue and README promise.
const LIMIT: u32 = 8 * 1024;

/// What the processor saves before a handler: 8 core registers, 16 of the FPU, its status and a filler are 26 words, and
/// one word may go to keep the stack aligned to 8 bytes. That is 108; whole doublewords make 112.
const EXCEPTION_FRAME: u32 = 112;

/// The deepest way from a function: the bytes, and the calls on it.
#[derive(Clone, Debug, Default, PartialEq)]
struct Deepest {
    bytes: i32,
    steps: Vec<(Step, i32)>,
}

pub struct Bound {
    pub text: String,
    total: u32,
    /// What the linker left for the stack.
    room: Option<u32>,
}

/// The deepest way from a function on. Functions that call themselves, and ways that cannot be followed, are errors.
fn deepest(
    image: &Image,
    graph: &Graph,
    root: u32,
    known: &mut BTreeMap<u32, Deepest>,
    path: &mut Vec<u32>,
) -> Result<Deepest> {
    if let Some(deepest) = known.get(&root) {
        return Ok(deepest.clone());
    }
    if let Some(start) = path.iter().position(|&on| on == root) {
        let cycle = path[start..].iter().chain([&root]);
        let cycle: Vec<_> = cycle.map(|&function| image.name(function)).collect();
        anyhow::bail!("recursion: {}", cycle.join(" -> "));
    }
    let flow = graph
        .functions
        .get(&root)
        .with_context(|| format!("{} was not followed", image.name(root)))?;
    path.push(root);
    let mut deepest_here = Deepest {
        bytes: flow.depth,
        steps: Vec::new(),
    };
    for (&(site, target), &depth) in &flow.calls {
        let below = deepest(image, graph, target, known, path)?;
        let bytes = depth + below.bytes;
        if bytes > deepest_here.bytes {
            let first = (Step { site, target }, depth);
            deepest_here = Deepest {
                bytes,
                steps: [first].into_iter().chain(below.steps).collect(),
            };
        }
    }
    path.pop();
    known.insert(root, deepest_here.clone());
    Ok(deepest_here)
}

pub fn bound(image: &Image, sources: &Sources) -> Result<Bound> {
    let handlers = image.handlers()?;
    let roots = handlers.keys().copied().chain([image.entry]);
    let graph = Graph::new(image, roots)?;
    followed(image, &graph, sources)?;
    let mut known = BTreeMap::new();
    let mut text = String::new();
    let mut total = 0;
    for root in [image.entry].into_iter().chain(handlers.keys().copied()) {
        let deepest = deepest(image, &graph, root, &mut known, &mut Vec::new())?;
        let own = u32::try_from(deepest.bytes)?.next_multiple_of(8);
        let frame = if root == image.entry {
            0
        } else {
            EXCEPTION_FRAME
        };
        total += own + frame;
        // Writing into a string cannot fail.
        let _ = writeln!(text, "{own:>6}  {}", image.name(root));
        show(&mut text, image, &graph, root, &deepest);
        if frame > 0 {
            let _ = writeln!(text, "{frame:>6}  registers saved on entry");
        }
    }
    // Start-up runs only once: what the program needs from then on is worth knowing, too.
    for idle in super::panics::idle(image).unwrap_or_default() {
        let deepest = deepest(image, &graph, idle, &mut known, &mut Vec::new())?;
        let _ = writeln!(
            text,
            "not added, as the reset leads to it: {}",
            deepest.bytes
        );
        show(&mut text, image, &graph, idle, &deepest);
    }
    let room = room(image);
    let _ = writeln!(text, "{total:>6}  bytes of stack at most, of {LIMIT}");
    if let Some(room) = room {
        let _ = writeln!(text, "{room:>6}  bytes are there for it");
    }
    Ok(Bound { text, total, room })
}

/// Each function on the way, with what it holds while it calls the next.
fn show(text: &mut String, image: &Image, graph: &Graph, root: u32, deepest: &Deepest) {
    let mut function = root;
    for (step, depth) in &deepest.steps {
        let _ = writeln!(text, "          {depth:>6}  {}", image.name(function));
        function = step.target;
    }
    let last = graph.functions.get(&function).map_or(0, |flow| flow.depth);
    let _ = writeln!(text, "          {last:>6}  {}", image.name(function));
}

/// An error unless every function could be followed everywhere.
fn followed(image: &Image, graph: &Graph, sources: &Sources) -> Result<()> {
    let mut faults = Vec::new();
    for (&function, flow) in &graph.functions {
        for (&site, fault) in flow
            .faults
            .iter()
            .filter(|(_, fault)| fault.hides_something())
        {
            faults.push(format!(
                "{} at {site:#010x}, {}: {fault}",
                image.name(function),
                sources.line(site)
            ));
        }
    }
    ensure!(faults.is_empty(), "no bound:\n{}", faults.join("\n"));
    Ok(())
}

/// From the stack's start down to what lies below it: the linker says where, or the variables end there.
fn room(image: &Image) -> Option<u32> {
    let start = image.address_of("_stack_start")?;
    let end = image.address_of("_stack_end").or_else(|| {
        let below = image.sections.iter().filter(|section| section.in_ram);
        below
            .map(|section| section.address + section.size)
            .filter(|&end| end <= start)
            .max()
    })?;
    start.checked_sub(end)
}

/// Fails if the bound is above the promise.
pub fn check_promise(bound: &Bound) -> Result<()> {
    ensure!(
        bound.total <= LIMIT,
        "{} bytes of stack are more than {LIMIT}",
        bound.total
    );
    Ok(())
}

/// Fails if the bound is above what is there.
pub fn check_room(bound: &Bound) -> Result<()> {
    let room = bound
        .room
        .context("no symbol _stack_start: how much room there is, is unknown")?;
    ensure!(
        bound.total <= room,
        "{} bytes of stack, and room for {room}",
        bound.total
    );
    Ok(())
}
