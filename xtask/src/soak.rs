//! `cargo xtask soak`: hours of random driving in the simulator, on this computer or on emulated boards.

use anyhow::Result;
use clap::Args;

use crate::image::build;
use crate::image::vehicle::Vehicle;
use crate::run::{Outcome, Session};

/// What to soak.
#[derive(Args)]
pub struct Options {
    /// Simulated hours, in all; healthy driving and driving with faults have half of them each
    #[arg(long, default_value_t = 1.0)]
    hours: f64,
    /// Simulated minutes, in place of hours
    #[arg(long, conflicts_with = "hours")]
    minutes: Option<f64>,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One robot only; all that have motors otherwise
    #[arg(long)]
    robot: Option<String>,
    /// Only healthy driving: nothing breaks
    #[arg(long, conflicts_with = "faults")]
    healthy: bool,
    /// Only driving with faults
    #[arg(long)]
    faults: bool,
    /// Run the firmware's image on emulated boards
    #[arg(long)]
    image: bool,
    /// Pushes so many times as strong
    #[arg(long, default_value_t = 1.0, value_name = "X")]
    push: f64,
    /// Repeat one shard only, such as one with a finding
    #[arg(long)]
    shard: Option<u64>,
}

impl Options {
    /// As the verification soaks on this computer: an hour of healthy driving, and an hour with faults.
    pub fn usual() -> Self {
        Self {
            hours: 2.0,
            minutes: None,
            seed: 1,
            robot: None,
            healthy: false,
            faults: false,
            image: false,
            push: 1.0,
            shard: None,
        }
    }

    /// As it soaks the image: what takes a minute at most.
    pub fn emulated() -> Self {
        Self {
            minutes: Some(EMULATED_MINUTES),
            image: true,
            ..Self::usual()
        }
    }
}

/// Simulated minutes on the emulated board that a verification has time for.
const EMULATED_MINUTES: f64 = 2.0;

/// Runs the simulator's own soak.
pub fn run(session: &Session, options: &Options) -> Result<Outcome> {
    let mut command = if options.image {
        let image = build::given_or_built(session, None, Vehicle::default())?;
        let mut command = session.cargo(
            "run --release --ignore-rust-version --package hil-sim --features emulator -- soak",
        );
        command.arg("--image").arg(image);
        command
    } else {
        session.cargo("run --release --package hil-sim -- soak")
    };
    match options.minutes {
        Some(minutes) => command.args(["--minutes", &minutes.to_string()]),
        None => command.args(["--hours", &options.hours.to_string()]),
    };
    command.args(["--seed", &options.seed.to_string()]);
    if options.push != 1.0 {
        command.args(["--push", &options.push.to_string()]);
    }
    if let Some(robot) = &options.robot {
        command.args(["--robot", robot]);
    }
    if options.healthy {
        command.arg("--healthy");
    }
    if options.faults {
        command.arg("--faults");
    }
    if let Some(shard) = options.shard {
        command.args(["--shard", &shard.to_string()]);
    }
    session.run(&mut command)
}
