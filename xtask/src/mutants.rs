//! Mutation testing: does any test notice when the supervisor does something else?
//!
//! `.cargo/mutants.toml` says what is changed, what is not worth it and why, and which tests have to notice.

use anyhow::Result;

use crate::run::{Outcome, Session};

/// What to change.
#[derive(clap::Args)]
pub struct Options {
    /// Only a part of them, such as 0/4: for several machines, or several evenings
    #[arg(long)]
    shard: Option<String>,
    /// List them, and test none
    #[arg(long)]
    list: bool,
}

/// Changes the code, one place at a time, in a copy of the repository; fails if a change goes unnoticed.
pub fn run(session: &Session, options: &Options) -> Result<Outcome> {
    let mut version = session.cargo("mutants --version");
    if !matches!(session.run(&mut version), Ok(Outcome::Passed)) {
        let install = session.run(&mut session.cargo("install --locked cargo-mutants"))?;
        if !matches!(install, Outcome::Passed) {
            return Ok(install);
        }
    }
    let mut mutants = session.cargo("mutants --jobs 1 --output target");
    if let Some(shard) = &options.shard {
        mutants.args(["--shard", shard]);
    }
    if options.list {
        mutants.arg("--list");
    }
    session.run(&mut mutants)
}
