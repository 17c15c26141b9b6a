//! The project's chores: `cargo xtask test` is the whole verification, `cargo xtask readme` its check of the README.

mod diff;
mod machine;
mod pyserial;
mod readme;
mod run;
mod steps;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;

use crate::run::{Outcome, Session};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "The project's chores")]
enum Chore {
    /// Verify everything: format, lints, docs, tests, firmware target, README
    Test,
    /// Run the commands of a README's `console` blocks and compare what they print
    Readme {
        /// Another file than the repository's README.md
        #[arg(long)]
        file: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    let mut session = Session::new();
    let good = match Chore::parse() {
        Chore::Test => steps::run_all(&mut session),
        Chore::Readme { file } => {
            let file = file.unwrap_or_else(|| session.root.join("README.md"));
            let outcome = Outcome::from(readme::check(&session, &file));
            println!("\n{outcome}");
            !matches!(outcome, Outcome::Failed(_))
        }
    };
    if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
