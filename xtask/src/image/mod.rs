//! The firmware's image: building it, and proving things about the machine code that the linker left.

pub mod build;
mod elf;
mod size;
pub mod toolchain;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::run::Session;
use elf::Image;

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
