//! `cargo xtask panics`: after start-up nothing in the firmware may stop it.
//!
//! From the idle loop and from every handler in the vector table, all machine code that can be reached is followed.
//! Nothing on the way may be a panic, stop the processor, be a function that never returns, or go where only the running program knows. (A loop that
//! ends under a condition may still run for ever: that is the watchdog's.)

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::ops::RangeInclusive;

use anyhow::{Result, ensure};

use super::elf::Image;
use super::graph::{Graph, Step};
use super::source::{Place, Sources};

/// The numbers of the exceptions after which there is nothing left to do.
const FAULTS: RangeInclusive<u32> = 2..=6;

/// A name that only something that panics has.
fn panics(name: &str) -> bool {
    const STARTS: [&str; 9] = [
        "core::panicking::",
        "core::option::unwrap_failed",
        "core::option::expect_failed",
        "core::result::unwrap_failed",
        "core::cell::panic_",
        "core::str::slice_error_fail",
        "defmt::export::panic",
        "alloc::",
        "cortex_m::asm::udf",
    ];
    const NAMES: [&str; 8] = [
        "rust_begin_unwind",
        "__rustc::rust_begin_unwind",
        "_defmt_panic",
        "__defmt_default_panic",
        "abort",
        "__aeabi_idiv0",
        "__aeabi_ldiv0",
        "core::intrinsics::abort",
    ];
    STARTS.iter().any(|start| name.starts_with(start))
        || NAMES.contains(&name)
        || name.starts_with("core::") && name.ends_with("_fail")
        || name.starts_with("core::slice::") && name.contains("_fail")
}

/// Something that must not be reachable, and the instruction that does it or calls it.
struct Offence {
    function: u32,
    site: u32,
    what: String,
}

/// What was found.
pub struct Report {
    pub text: String,
    /// Each way to stop the firmware, with how one gets there.
    pub offences: Vec<String>,
}

/// Follows everything that runs after start-up.
pub fn report(image: &Image, sources: &Sources) -> Result<Report> {
    let idle = idle(image)?;
    let handlers = image.handlers()?;
    let roots: BTreeSet<u32> = handlers.keys().copied().chain(idle.clone()).collect();
    let graph = Graph::new(image, roots.iter().copied().chain([image.entry]))?;
    // Faults, and interrupts that nobody serves, end in a loop on purpose: until the watchdog resets.
    let last =
        |numbers: &[u32]| numbers.len() > 1 || numbers.iter().any(|number| FAULTS.contains(number));
    let serving = roots
        .iter()
        .copied()
        .filter(|root| !handlers.get(root).is_some_and(|numbers| last(numbers)));
    let sink = |function: u32| panics(&image.name(function));
    let paths = graph.paths(roots.iter().copied(), sink);
    let mut must_return: BTreeSet<u32> = graph.paths(serving, sink).into_keys().collect();
    must_return.retain(|function| !idle.contains(function));
    let offences = offences(image, &graph, &paths, &must_return);

    let mut text = String::new();
    // Writing into a string cannot fail.
    let names: Vec<_> = roots.iter().map(|&root| image.name(root)).collect();
    let _ = writeln!(
        text,
        "from {} (every handler in the vector table but the reset, which is start-up, and the idle loop)\n\
         {} functions can be reached",
        names.join(", "),
        paths.len()
    );
    let offences: Vec<_> = offences
        .iter()
        .map(|offence| show(image, sources, &graph, &paths, offence))
        .collect();
    for (number, offence) in offences.iter().enumerate() {
        let _ = write!(text, "\n{}. {offence}", number + 1);
    }
    remaining(&mut text, image, sources, &graph, &paths);
    let _ = writeln!(
        text,
        "\nways to stop the firmware after start-up: {}",
        offences.len()
    );
    Ok(Report { text, offences })
}

/// The idle loop, which must not be inlined into `main`: start-up may panic, and the two must be told apart.
pub fn idle(image: &Image) -> Result<Vec<u32>> {
    let named = image
        .functions
        .iter()
        .filter(|(_, function)| function.name == "idle" || function.name.ends_with("::idle"));
    let idle: Vec<_> = named.map(|(&start, _)| start).collect();
    ensure!(
        !idle.is_empty(),
        "no function named idle: mark it #[inline(never)]"
    );
    Ok(idle)
}

fn offences(
    image: &Image,
    graph: &Graph,
    paths: &BTreeMap<u32, Vec<Step>>,
    must_return: &BTreeSet<u32>,
) -> Vec<Offence> {
    let mut offences = Vec::new();
    for &function in paths.keys() {
        let (Some(flow), false) = (
            graph.functions.get(&function),
            panics(&image.name(function)),
        ) else {
            continue;
        };
        for &(site, target) in flow.calls.keys() {
            let name = image.name(target);
            if panics(&name) {
                offences.push(Offence {
                    function,
                    site,
                    what: format!("calls {name}"),
                });
            }
        }
        for (&site, fault) in &flow.faults {
            if !fault.is_about_the_stack() {
                offences.push(Offence {
                    function,
                    site,
                    what: fault.to_string(),
                });
            }
        }
        // A panic under another name, such as a loop without an end. Its callers do not return either, nor do those
        // of a panic, but they are told by that.
        let passes_on = flow.calls.keys().any(|&(_, target)| {
            graph
                .functions
                .get(&target)
                .is_none_or(|flow| !flow.returns)
        });
        let is_told = flow
            .faults
            .values()
            .any(|fault| !fault.is_about_the_stack());
        let hangs = !flow.returns && !passes_on && !is_told;
        if hangs && must_return.contains(&function) {
            offences.push(Offence {
                function,
                site: function,
                what: format!("{} never returns", image.name(function)),
            });
        }
    }
    offences
}

/// The way from a root to the offence, with the line of each call.
fn show(
    image: &Image,
    sources: &Sources,
    graph: &Graph,
    paths: &BTreeMap<u32, Vec<Step>>,
    offence: &Offence,
) -> String {
    let mut text = format!("{}\n", offence.what);
    let path = paths.get(&offence.function).map(Vec::as_slice);
    let path = path.unwrap_or_default();
    let root = match path.first() {
        Some(first) => image.function_at(first.site).map(|(start, _)| start),
        None => Some(offence.function),
    };
    let root = root.unwrap_or(offence.function);
    let _ = writeln!(text, "   {}", image.name(root));
    for step in path {
        let _ = writeln!(
            text,
            "   -> {}  called at {}",
            image.name(step.target),
            sources.line(step.site)
        );
    }
    let mut shown = BTreeSet::new();
    let origins = graph.origins(offence.function, offence.site);
    for site in origins.into_iter().chain([offence.site]) {
        let places = sources.places(site);
        let lines: Vec<_> = places.iter().map(|place| place.line.clone()).collect();
        if shown.insert(lines) {
            let _ = writeln!(text, "   at {site:#010x}:");
            for Place { line, function } in places {
                let _ = writeln!(text, "      {line}  {}", function.unwrap_or_default());
            }
        }
    }
    text
}

/// The panics that are in the image all the same, and who may call them: start-up.
fn remaining(
    text: &mut String,
    image: &Image,
    sources: &Sources,
    graph: &Graph,
    paths: &BTreeMap<u32, Vec<Step>>,
) {
    let names: BTreeMap<u32, &str> = image
        .functions
        .iter()
        .filter(|(_, function)| panics(&function.name))
        .map(|(&start, function)| (start, function.name.as_str()))
        .collect();
    let _ = writeln!(text, "\n{} panicking functions in the image", names.len());
    for (&panic, name) in &names {
        let _ = writeln!(text, "   {name}");
        let mut lines = BTreeSet::new();
        let callers = graph.functions.iter();
        for (&caller, flow) in callers.filter(|(caller, _)| !names.contains_key(caller)) {
            for &(site, _) in flow.calls.keys().filter(|(_, target)| *target == panic) {
                let when = if paths.contains_key(&caller) {
                    "after start-up"
                } else {
                    "start-up only"
                };
                let (name, line) = (image.name(caller), sources.line(site));
                lines.insert(format!("      from {name} at {line} ({when})\n"));
            }
        }
        text.extend(lines);
    }
}
