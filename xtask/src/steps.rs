//! The steps of the verification.

use std::time::Instant;

use anyhow::{Result, ensure};
use clap::ValueEnum;

use crate::image::toolchain::{self, Toolchain};
use crate::image::vehicle::Vehicle;
use crate::image::{self, Which};
use crate::machine::{
    BASH, BROWSER, CXX, FIRMWARE_TARGET, LOGS, Machine, NEEDS, NEXTEST, NODE, Need, PYTHON,
};
use crate::run::{Outcome, Session};
use crate::{fuzz, page, python, readme, soak};

/// In this order: a later step finds the environment that an earlier one has set.
const STEPS: &[Step] = &[
    cargo("format", "fmt --all --check"),
    cargo("lints", "clippy --workspace --all-targets -- -D warnings"),
    cargo(
        "lints with defmt",
        "clippy --package vehicle-controller --lib --features defmt -- -D warnings",
    ),
    cargo(
        "lints of one vehicle",
        "clippy --package vehicle-controller --all-targets --no-default-features -- -D warnings",
    ),
    cargo(
        "lints with emulator",
        "clippy --ignore-rust-version --package hil-sim --all-targets --features emulator -- -D warnings",
    ),
    call("lints of the firmware", firmware_lints).needs(&FIRMWARE_TARGET),
    cargo("documentation", "doc --workspace --no-deps").env("RUSTDOCFLAGS", "-D warnings"),
    cargo(
        "lints of the fuzzers",
        "clippy --package fuzz --bins --features engine -- -D warnings",
    )
    .needs(&CXX),
    cargo(
        "lints with the network",
        "clippy --package base-bridge --all-targets --features dds,foxglove -- -D warnings",
    ),
    call("external serial client", |session, _| {
        python::prepare(session, &python::PYSERIAL)
    })
    .needs(&PYTHON),
    call("external ROS 2 peers", |session, _| {
        python::prepare(session, &python::ROS)
    })
    .needs(&PYTHON),
    call("tests", |session, machine| {
        tests(session, machine, "--workspace")
    }),
    // As the differential drive's firmware is built.
    call("tests of one vehicle", |session, machine| {
        tests(
            session,
            machine,
            "--package vehicle-controller --no-default-features",
        )
    }),
    call("tests on a network", |session, machine| {
        tests(
            session,
            machine,
            "--package base-bridge --features dds,foxglove --lib --bins --test dds --test foxglove",
        )
    }),
    // Whose nodes tell of themselves in another way.
    call("tests on Humble's network", |session, machine| {
        tests(
            session,
            machine,
            "--package base-bridge --features humble,foxglove --test dds the_node_is_known",
        )
    }),
    call("page: packages", |session, _| page::packages(session)).needs(&NODE),
    call("page: checks", |session, _| page::checks(session)).needs(&NODE),
    call("page: built", |session, _| page::built(session)).needs(&NODE),
    call("page: end to end", |session, _| page::end_to_end(session)).needs(&BROWSER),
    // Among the tests already; here it says so when there are none.
    cargo(
        "real logs",
        "test --package hil-sim --test replay the_real_logs",
    )
    .needs(&LOGS),
    cargo("doc tests", "test --workspace --doc"),
    cargo(
        "benchmarks run",
        "bench --package hil-sim --bench speed -- --test",
    ),
    call("fuzzing", |session, _| {
        fuzz::run(session, &fuzz::Options::usual())
    })
    .needs(&CXX),
    call("soak", |session, _| {
        soak::run(session, &soak::Options::usual())
    }),
    call("no_std", |session, _| {
        toolchain::run(session, "build", "--package vehicle-controller --lib")
    })
    .needs(&FIRMWARE_TARGET),
    call("firmware", |session, _| {
        for_each_vehicle(|vehicle| image::firmware(session, vehicle).map(drop))?;
        let elf = image::firmware(session, Vehicle::default())?;
        session.set("VEHICLE_CONTROLLER_IMAGE", elf);
        Ok(Outcome::Passed)
    })
    .needs(&FIRMWARE_TARGET),
    call("firmware size", |session, _| {
        image::size(session, Which::default(), true)?;
        image::sizes(session)?;
        Ok(Outcome::Passed)
    })
    .needs(&FIRMWARE_TARGET),
    call("firmware panics", |session, _| {
        for_each_vehicle(|vehicle| image::panics(session, vehicle.into()))
    })
    .needs(&FIRMWARE_TARGET),
    call("firmware stack", |session, _| {
        for_each_vehicle(|vehicle| image::stack(session, vehicle.into(), true))
    })
    .needs(&FIRMWARE_TARGET),
    call("a panic is found", |session, _| {
        image::artificial_panic(session)
    })
    .needs(&FIRMWARE_TARGET),
    call("emulated board", emulated).needs(&FIRMWARE_TARGET),
    call("soak of the image", |session, _| {
        soak::run(session, &soak::Options::emulated())
    })
    .needs(&FIRMWARE_TARGET),
    call("README", |session, _| {
        readme::check(session, &session.root.join("README.md"))
    })
    .needs(&BASH),
    call("the page of ROS 2", |session, _| {
        readme::check(session, &session.root.join("docs/ros2.md"))
    })
    .needs(&BASH),
    call("the tools of the estimate", |session, _| {
        readme::check(session, &session.root.join("docs/estimation.md"))
    })
    .needs(&BASH),
];

fn tests(session: &mut Session, machine: &Machine, packages: &str) -> Result<Outcome> {
    let runner = if machine.has(&NEXTEST) {
        "nextest run"
    } else if packages.contains("--test ") {
        "test"
    } else {
        "test --lib --bins --tests"
    };
    session.run(&mut session.cargo(&format!("{runner} {packages} --no-fail-fast")))
}

/// The firmware's own code is only compiled for the board.
fn firmware_lints(session: &mut Session, _: &Machine) -> Result<Outcome> {
    if Toolchain::present(session) != Some(Toolchain::Target) {
        let why = "clippy needs rustup's library for the board, and the distribution's is in use";
        return Ok(Outcome::Skipped(why.into()));
    }
    for vehicle in Vehicle::value_variants() {
        let lints = format!(
            "clippy --target {} {} -- -D warnings",
            toolchain::TARGET,
            vehicle.package()
        );
        let outcome = session.run(&mut session.cargo(&lints))?;
        if !matches!(outcome, Outcome::Passed) {
            return Ok(outcome);
        }
    }
    Ok(Outcome::Passed)
}

/// Does something with the image of each vehicle, all of them also after one has failed.
fn for_each_vehicle(mut work: impl FnMut(Vehicle) -> Result<()>) -> Result<Outcome> {
    let mut failed = Vec::new();
    for &vehicle in Vehicle::value_variants() {
        if let Err(error) = work(vehicle) {
            eprintln!("{}: {error:#}", vehicle.name());
            failed.push(vehicle.name());
        }
    }
    ensure!(failed.is_empty(), "failed for {}", failed.join(", "));
    Ok(Outcome::Passed)
}

/// The tests that run the image; an earlier step has told them where it is.
fn emulated(session: &mut Session, machine: &Machine) -> Result<Outcome> {
    let runner = if machine.has(&NEXTEST) {
        "nextest run"
    } else {
        "test"
    };
    let tests = "--ignore-rust-version --package hil-sim --features emulator --lib --test image_* --no-fail-fast";
    session.run(&mut session.cargo(&format!("{runner} {tests}")))
}

struct Step {
    name: &'static str,
    work: Work,
    env: Option<(&'static str, &'static str)>,
    /// Without it the step is skipped.
    needs: Option<&'static Need>,
}

enum Work {
    Cargo(&'static str),
    Call(fn(&mut Session, &Machine) -> Result<Outcome>),
}

const fn cargo(name: &'static str, arguments: &'static str) -> Step {
    Step {
        name,
        work: Work::Cargo(arguments),
        env: None,
        needs: None,
    }
}

const fn call(name: &'static str, work: fn(&mut Session, &Machine) -> Result<Outcome>) -> Step {
    Step {
        name,
        work: Work::Call(work),
        env: None,
        needs: None,
    }
}

impl Step {
    const fn env(mut self, name: &'static str, value: &'static str) -> Self {
        self.env = Some((name, value));
        self
    }

    const fn needs(mut self, need: &'static Need) -> Self {
        self.needs = Some(need);
        self
    }

    fn run(&self, session: &mut Session, machine: &Machine) -> Result<Outcome> {
        if let Some(need) = self.needs.filter(|need| !machine.has(need)) {
            return Ok(Outcome::Skipped(format!(
                "no {}: {}",
                need.name, need.without
            )));
        }
        match self.work {
            Work::Cargo(arguments) => session.run(session.cargo(arguments).envs(self.env)),
            Work::Call(work) => work(session, machine),
        }
    }
}

/// Runs every step; whether none has failed.
pub fn run_all(session: &mut Session) -> bool {
    let machine = Machine::look(session, NEEDS);
    run(session, &machine, |_| true)
}

/// Runs those of the live page; whether none has failed.
pub fn run_page(session: &mut Session) -> bool {
    let machine = Machine::look(session, &[&NODE, &BROWSER]);
    run(session, &machine, |step| step.name.starts_with("page: "))
}

/// Runs the steps that are wanted, also after one has failed; whether none has.
fn run(session: &mut Session, machine: &Machine, is_wanted: fn(&Step) -> bool) -> bool {
    let mut summary = Vec::new();
    let (mut passed, mut failed, mut skipped) = (0, 0, 0);
    for step in STEPS.iter().filter(|step| is_wanted(step)) {
        println!("\n== {}", step.name);
        let start = Instant::now();
        let outcome = step.run(session, machine).into();
        let seconds = start.elapsed().as_secs_f64();
        match outcome {
            Outcome::Passed => passed += 1,
            Outcome::Failed(_) => failed += 1,
            Outcome::Skipped(_) => skipped += 1,
        }
        println!("-- {outcome} ({seconds:.1} s)");
        summary.push(format!("{:24}{seconds:>7.1} s  {outcome}", step.name));
    }
    println!("\n== summary\n{}\n", summary.join("\n"));
    let left_out = if skipped > 0 {
        format!(", {skipped} skipped")
    } else {
        String::new()
    };
    println!("{passed} passed, {failed} failed{left_out}");
    failed == 0
}
