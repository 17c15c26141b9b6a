//! The firmware's image: building it, and proving things about the machine code that the linker left.

pub mod build;
mod decode;
mod elf;
mod flow;
mod graph;
mod panics;
mod reduce;
mod size;
mod source;
mod stack;
mod table;
pub mod toolchain;
mod values;

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;

use crate::run::Session;
use elf::Image;
use source::Sources;

/// Which image is looked at.
#[derive(Args)]
pub struct Which {
    /// Another ELF file than the firmware of this repository, which is built first
    elf: Option<PathBuf>,
}

impl Which {
    fn read(self, session: &Session) -> Result<Image> {
        Image::read(&build::given_or_built(session, self.elf)?)
    }
}

/// `cargo firmware`.
pub fn firmware(session: &Session) -> Result<()> {
    let image = Image::read(&build::firmware(session)?)?;
    println!("{}", size::summary(&image));
    Ok(())
}

/// `cargo xtask size`.
pub fn size(session: &Session, which: Which, check: bool) -> Result<()> {
    let image = which.read(session)?;
    print!("{}", size::report(&image));
    if check {
        size::check(&image)?;
    }
    Ok(())
}

/// `cargo xtask panics`.
pub fn panics(session: &Session, which: Which) -> Result<()> {
    let image = which.read(session)?;
    let sources = Sources::new(&image, session.root.clone())?;
    let (text, offences) = panics::report(&image, &sources)?;
    print!("{text}");
    ensure!(
        offences == 0,
        "{offences} ways to stop the firmware after start-up"
    );
    Ok(())
}

/// `cargo xtask stack`.
pub fn stack(session: &Session, which: Which, check: bool) -> Result<()> {
    let image = which.read(session)?;
    let sources = Sources::new(&image, session.root.clone())?;
    let bound = stack::bound(&image, &sources)?;
    print!("{}", bound.text);
    if check {
        stack::check(&bound)?;
    }
    Ok(())
}
