//! The live page: the base's serial line, and the simulated world around it, for pages in browsers.
//!
//! The server runs in a thread of its own; the simulation stays as it is and meets it at the hub.

mod address;
mod broken;
mod client;
mod door;
mod hub;
mod lines;
mod listen;
mod names;
mod pace;
mod page;
mod pulse;
mod requests;
mod seat;
mod streams;
mod world;

pub use address::Address;

use crate::console::{Port, Speed, say};
use anyhow::{Context, Result, bail};
use door::House;
use hil_sim::robot::Robot;
use hub::{Hub, ToBase};
use lines::Lines;
use names::Names;
use page::Page;
use std::io::Write;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use world::World;

/// Lines that wait for the base, at most. A driver that sends more is closed.
const MAX_LINES: usize = 64;
/// Requests to the simulated world that wait.
const MAX_ASKED: usize = 16;
/// While more bytes than this are on their way to the base, lines wait here, where they are counted: two of the longest.
const MAX_ON_THE_WAY: usize = 512;

/// Simulated seconds in a second, at most: a base tells fifty lines of telemetry in each.
const MAX_SPEED: f64 = 100.0;

/// What is served.
pub struct Served<'a> {
    /// The robot.
    pub robot: &'a Robot,
    /// What it is called.
    pub name: &'a str,
    /// The firmware's image controls it.
    pub image: bool,
    /// How fast simulated time is to pass.
    pub speed: Speed,
}

/// Listens, and prints where the page is.
///
/// # Errors
/// If the address is not to be had, or others than this computer could reach it and that was not asked for.
pub fn open(address: &Address, allow_remote: bool, served: &Served<'_>) -> Result<Port> {
    let socket = address.choose(allow_remote)?;
    let speed = match served.speed {
        Speed::Times(times) if times <= MAX_SPEED => times,
        _ => bail!(
            "a page shows what happens as it happens: with --web, --speed may be up to {MAX_SPEED}"
        ),
    };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .enable_time()
        .build()
        .context("the page's server")?;
    let listener = {
        let _inside = runtime.enter();
        listen::bind(socket)?
    };
    let bound = listener.local_addr()?;
    if bound.ip().is_unspecified() {
        let port = bound.port();
        say(format_args!(
            "the page is at http://127.0.0.1:{port}/, and at port {port} of every address of this computer"
        ))?;
    } else {
        say(format_args!("the page is at http://{bound}/"))?;
    }
    std::io::stdout().flush().context("standard output")?;
    if !bound.ip().is_loopback() {
        eprintln!(
            "whoever reaches this address can drive the base: there is no password and no encryption"
        );
    }

    let (lines, input) = sync_channel(MAX_LINES);
    let (asked, requests) = sync_channel(MAX_ASKED);
    let hello = world::hello(served.robot, served.name, served.image, speed);
    let hub = Arc::new(Hub::new(hello, ToBase { lines, asked }));
    let router = door::router(House {
        names: Names::of(bound, address.host.as_deref()),
        page: Page::new(),
        hub: Arc::clone(&hub),
    });
    std::thread::Builder::new()
        .name("web".into())
        .spawn(move || runtime.block_on(listen::serve(listener, router)))
        .context("the page's server")?;

    let passing = Arc::clone(&hub);
    let mut world = World::new(Arc::clone(&hub), requests, served.robot, speed);
    let mut lines = Lines::default();
    Ok(Port {
        input: Box::new(move || {
            loop {
                if let Some(line) = passing.pass(input.try_recv()?) {
                    return Ok(line);
                }
            }
        }),
        output: Box::new(move |bytes| {
            lines.push(bytes, |line| hub.tell_line(line));
            Ok(())
        }),
        impatient: false,
        max_on_the_way: MAX_ON_THE_WAY,
        beside: Some(Box::new(move |base| world.attend(base))),
    })
}
