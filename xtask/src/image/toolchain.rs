//! A Rust that builds for the board's processor: rustup's if it has or can get the target, else a distribution's.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, bail};

use crate::debian;
use crate::run::{Outcome, Session, capture, succeeds};

pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Debian's Rust has no library for the board, but its sources, from which cargo makes one.
const PACKAGES: &str = "rustc-web cargo-web rust-web-src lld";
const DISTRIBUTION: &str = "/usr/bin/rustc";

const PROBE: Duration = Duration::from_secs(20);
const DOWNLOAD: Duration = Duration::from_secs(120);

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Toolchain {
    /// The compiler that runs everything else has the target's library.
    Target,
    /// Debian's compiler builds the library along with the firmware.
    Distribution,
}

impl Toolchain {
    /// What this machine has; nothing is installed.
    pub fn present(session: &Session) -> Option<Self> {
        if has_target(session) {
            return Some(Self::Target);
        }
        let library = "/usr/lib/rustlib/src/rust/library/core";
        let version = session.command("ld.lld", ["--version"]);
        (has_sources(session, library) && succeeds(version, PROBE)).then_some(Self::Distribution)
    }

    /// What this machine has, or can get.
    pub fn get(session: &Session) -> Result<Self> {
        if let Some(toolchain) = Self::present(session) {
            return Ok(toolchain);
        }
        println!("Rust for {TARGET} is missing: asking rustup for it");
        let rustup = session.command("rustup", ["target", "add", TARGET]);
        if succeeds(rustup, DOWNLOAD) && has_target(session) {
            return Ok(Self::Target);
        }
        debian::install(
            session,
            PACKAGES,
            &format!("no Rust for {TARGET}"),
            &format!("install it with `rustup target add {TARGET}`"),
        )?;
        match Self::present(session) {
            Some(toolchain) => Ok(toolchain),
            None => bail!("no Rust for {TARGET}: neither rustup nor apt-get could install it"),
        }
    }

    /// `cargo <subcommand> --target … <arguments>` with what this toolchain needs beside.
    pub fn cargo(self, session: &Session, subcommand: &str, arguments: &str) -> Command {
        let line = format!("{subcommand} --target {TARGET} {arguments}");
        match self {
            Self::Target => session.cargo(&line),
            Self::Distribution => {
                let mut cargo = session.command("/usr/bin/cargo", line.split_whitespace());
                cargo.args(["-Z", "build-std=core"]);
                // `-Z` on a stable compiler; and no linker comes with it.
                cargo.env("RUSTC_BOOTSTRAP", "1");
                cargo.env("RUSTC", DISTRIBUTION);
                cargo.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld");
                cargo
            }
        }
    }
}

/// Asks the compiler, not rustup: a toolchain may come from elsewhere.
fn has_target(session: &Session) -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let ask = session.command(rustc, ["--print", "target-libdir", "--target", TARGET]);
    capture(ask, PROBE).is_ok_and(|(_, folder)| Path::new(folder.trim()).is_dir())
}

fn has_sources(session: &Session, library: &str) -> bool {
    let ask = session.command(DISTRIBUTION, ["--print", "sysroot"]);
    Path::new("/usr/bin/cargo").exists() && Path::new(library).is_dir() && succeeds(ask, PROBE)
}

/// Compiles something for the board, in full view.
pub fn run(session: &Session, subcommand: &str, arguments: &str) -> Result<Outcome> {
    let toolchain = Toolchain::get(session)?;
    session.run(&mut toolchain.cargo(session, subcommand, arguments))
}
