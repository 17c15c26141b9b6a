//! The steps of the verification.

use std::time::Instant;

use anyhow::Result;

use crate::machine::{BASH, FIRMWARE_TARGET, LOGS, Machine, NEXTEST, Need, PYTHON};
use crate::run::{Outcome, Session};
use crate::{pyserial, readme};

/// In this order: a later step finds the environment that an earlier one has set.
const STEPS: &[Step] = &[
    cargo("format", "fmt --all --check"),
    cargo("lints", "clippy --workspace --all-targets -- -D warnings"),
    cargo(
        "lints with defmt",
        "clippy --package vehicle-controller --lib --features defmt -- -D warnings",
    ),
    cargo("documentation", "doc --workspace --no-deps").env("RUSTDOCFLAGS", "-D warnings"),
    call("external serial client", |session, _| {
        pyserial::prepare(session)
    })
    .needs(&PYTHON),
    call("tests", tests),
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
    cargo(
        "no_std",
        "build --package vehicle-controller --lib --target thumbv7em-none-eabihf",
    )
    .needs(&FIRMWARE_TARGET),
    call("README", |session, _| {
        readme::check(session, &session.root.join("README.md"))
    })
    .needs(&BASH),
];

fn tests(session: &mut Session, machine: &Machine) -> Result<Outcome> {
    let runner = if machine.has(&NEXTEST) {
        "nextest run --workspace --no-fail-fast"
    } else {
        "test --workspace --lib --bins --tests --no-fail-fast"
    };
    session.run(&mut session.cargo(runner))
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

/// Runs every step, also after one has failed; whether none has.
pub fn run_all(session: &mut Session) -> bool {
    let machine = Machine::look(session);
    let mut summary = Vec::new();
    let (mut passed, mut failed, mut skipped) = (0, 0, 0);
    for step in STEPS {
        println!("\n== {}", step.name);
        let start = Instant::now();
        let outcome = step.run(session, &machine).into();
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
