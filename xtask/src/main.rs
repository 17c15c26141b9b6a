//! The project's chores: `cargo xtask test` is the whole verification, `cargo firmware` builds the image.

mod debian;
mod diff;
mod fuzz;
mod image;
mod machine;
mod mutants;
mod page;
mod python;
mod readme;
mod run;
mod soak;
mod steps;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

use crate::image::Which;
use crate::image::vehicle::Vehicle;
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
    /// Build the firmware: target/firmware/vehicle-controller.elf, .bin and .hex; vehicle-controller-tricycle.elf and so on for another vehicle
    Firmware {
        /// What it controls
        #[arg(long, default_value = "differential")]
        vehicle: Vehicle,
        /// Write it through the board's ST-LINK, too, and show the firmware's log
        #[arg(long)]
        flash: bool,
    },
    /// What the firmware takes of flash and RAM
    Size {
        #[command(flatten)]
        which: Which,
        /// Fail if it is more than the board's promise, which is the differential drive's
        #[arg(long)]
        check: bool,
    },
    /// What the firmware of each vehicle takes of flash and RAM
    Sizes,
    /// Whether anything that can be reached after start-up panics or never returns
    Panics {
        #[command(flatten)]
        which: Which,
        /// Put a panic into a copy of the repository, and see that it is found
        #[arg(long, conflicts_with = "elf")]
        artificial: bool,
    },
    /// How deep the stack can get
    Stack {
        #[command(flatten)]
        which: Which,
        /// Fail if it is deeper than there is room, or than the promise for the differential drive
        #[arg(long)]
        check: bool,
    },
    /// Count the instructions of the control tick on the emulated board
    Count {
        /// What the base is told meanwhile
        #[arg(long, default_value = "hil-sim/scenarios/every_state.script")]
        script: String,
        #[command(flatten)]
        which: Which,
    },
    /// Feed the library inputs that coverage leads to, and see that it keeps its promises
    Fuzz(fuzz::Options),
    /// Change the supervisor in hundreds of ways, one at a time, and see that a test notices each; takes an hour or two
    Mutants(mutants::Options),
    /// Drive at random for simulated hours, healthy and with faults, and see that nothing trips without cause and nothing moves that should not
    Soak(soak::Options),
    /// The live page: its packages, its checks, its build, and a browser that drives a simulated base by it
    Page,
    /// Watch a base through the live page for an hour, in a browser: memory of both, and how long a frame takes
    SoakPage(page::Soak),
}

fn main() -> ExitCode {
    let mut session = Session::new();
    let good = match Chore::parse() {
        Chore::Test => steps::run_all(&mut session),
        Chore::Firmware {
            vehicle,
            flash: false,
        } => told(&image::firmware(&session, vehicle).map(drop)),
        Chore::Firmware {
            vehicle,
            flash: true,
        } => told(&image::flash(&session, vehicle)),
        Chore::Size { which, check } => told(&image::size(&session, which, check)),
        Chore::Sizes => told(&image::sizes(&session)),
        Chore::Stack { which, check } => told(&image::stack(&session, which, check)),
        Chore::Count { script, which } => told(&image::count(&session, &script, which)),
        Chore::Panics {
            artificial: true, ..
        } => finished(image::artificial_panic(&session)),
        Chore::Panics { which, .. } => told(&image::panics(&session, which)),
        Chore::Fuzz(options) => finished(fuzz::run(&session, &options)),
        Chore::Mutants(options) => finished(mutants::run(&session, &options)),
        Chore::Soak(options) => finished(soak::run(&session, &options)),
        Chore::Page => steps::run_page(&mut session),
        Chore::SoakPage(options) => finished(page::soak(&session, &options)),
        Chore::Readme { file } => {
            let file = file.unwrap_or_else(|| session.root.join("README.md"));
            finished(readme::check(&session, &file))
        }
    };
    if good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Says how it ended; whether well.
fn finished(result: Result<Outcome>) -> bool {
    let outcome = Outcome::from(result);
    println!("\n{outcome}");
    !matches!(outcome, Outcome::Failed(_))
}

/// Says what went wrong; whether nothing did.
fn told(result: &Result<()>) -> bool {
    if let Err(error) = result {
        eprintln!("error: {error:#}");
    }
    result.is_ok()
}
