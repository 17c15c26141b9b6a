//! The firmware's image: building it, and proving things about the machine code that the linker left.

mod artificial;
pub mod build;
mod decode;
mod elf;
#[cfg(test)]
mod fixture;
mod flow;
mod graph;
mod panics;
mod reduce;
mod size;
mod source;
mod stack;
mod table;
#[cfg(test)]
mod tests;
pub mod toolchain;
mod values;
pub mod vehicle;

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Result, bail, ensure};
use clap::{Args, ValueEnum};

use crate::run::{Outcome, Session, succeeds};
use elf::Image;
use source::Sources;
use vehicle::Vehicle;

pub use artificial::check as artificial_panic;

/// The board's microcontroller, as probe-rs calls it.
const CHIP: &str = "STM32F429ZITx";

/// Which image is looked at.
#[derive(Args, Default)]
pub struct Which {
    /// Another ELF file than the firmware of this repository, which is built first
    elf: Option<PathBuf>,
    /// The firmware of this vehicle
    #[arg(long, default_value = "differential", conflicts_with = "elf")]
    vehicle: Vehicle,
}

impl From<Vehicle> for Which {
    fn from(vehicle: Vehicle) -> Self {
        Self { elf: None, vehicle }
    }
}

impl Which {
    fn path(self, session: &Session) -> Result<PathBuf> {
        build::given_or_built(session, self.elf, self.vehicle)
    }

    /// The limits of size and stack are the differential drive's; a file is taken for one.
    fn is_promised(&self) -> bool {
        self.vehicle == Vehicle::Differential
    }

    fn read(self, session: &Session) -> Result<Image> {
        Image::read(&self.path(session)?)
    }
}

/// `cargo firmware`; the ELF file.
pub fn firmware(session: &Session, vehicle: Vehicle) -> Result<PathBuf> {
    let elf = build::firmware(session, vehicle)?;
    println!("{}", size::summary(&Image::read(&elf)?));
    Ok(elf)
}

/// `cargo flash`.
pub fn flash(session: &Session, vehicle: Vehicle) -> Result<()> {
    let elf = firmware(session, vehicle)?;
    let probe = session.command("probe-rs", ["--version"]);
    ensure!(
        succeeds(probe, Duration::from_secs(20)),
        "probe-rs is missing: install it with `cargo install --locked probe-rs-tools`, or as https://probe.rs says"
    );
    let mut probe = session.command("probe-rs", ["run", "--chip", CHIP]);
    match session.run(probe.arg(elf))? {
        Outcome::Passed => Ok(()),
        Outcome::Failed(why) | Outcome::Skipped(why) => bail!("probe-rs: {why}"),
    }
}

/// `cargo xtask size`.
pub fn size(session: &Session, which: Which, check: bool) -> Result<()> {
    let promised = which.is_promised();
    let image = which.read(session)?;
    print!("{}", size::report(&image, promised));
    if check && promised {
        size::check(&image)?;
    }
    Ok(())
}

/// `cargo xtask sizes`: a line for each vehicle's image.
pub fn sizes(session: &Session) -> Result<()> {
    let images = Vehicle::value_variants().iter().map(|&vehicle| {
        let image = Which::from(vehicle).read(session)?;
        Ok((vehicle, image))
    });
    let images: Vec<_> = images.collect::<Result<_>>()?;
    print!("{}", size::table(&images));
    Ok(())
}

/// `cargo xtask panics`.
pub fn panics(session: &Session, which: Which) -> Result<()> {
    let image = which.read(session)?;
    let sources = Sources::new(&image, session.root.clone())?;
    let report = panics::report(&image, &sources)?;
    print!("{}", report.text);
    ensure!(
        report.offences.is_empty(),
        "ways to stop the firmware after start-up: {}",
        report.offences.len()
    );
    Ok(())
}

/// `cargo xtask stack`.
pub fn stack(session: &Session, which: Which, check: bool) -> Result<()> {
    let promised = which.is_promised();
    let image = which.read(session)?;
    let sources = Sources::new(&image, session.root.clone())?;
    let bound = stack::bound(&image, &sources)?;
    print!("{}", bound.text);
    if check {
        stack::check_room(&bound)?;
    }
    if check && promised {
        stack::check_promise(&bound)?;
    }
    Ok(())
}

/// `cargo xtask count`: the instructions of a control tick, counted on the emulated board.
pub fn count(session: &Session, script: &str, which: Which) -> Result<()> {
    let robot = which.vehicle.robot();
    let image = which.path(session)?;
    let mut simulator = session.cargo(
        "run --release --ignore-rust-version --package hil-sim --features emulator -- count",
    );
    simulator.arg(script).arg("--image").arg(image);
    simulator.args(["--robot", robot]);
    match session.run(&mut simulator)? {
        Outcome::Passed => Ok(()),
        Outcome::Failed(why) | Outcome::Skipped(why) => bail!("nothing counted: {why}"),
    }
}
