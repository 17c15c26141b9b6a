//! What the tools of the estimate have in common on the command line.

use anyhow::Result;
use clap::Args;
use hil_sim::robot::Robot;
use hil_sim::settings;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A robot, and what its controller is told in place of what is in its file.
#[derive(Args)]
pub struct Told {
    /// A robot's name (see `robots`) or the path of its .toml file
    #[arg(long, default_value = "default")]
    pub robot: String,
    /// Set a parameter; may be given again
    #[arg(long, value_name = "NAME=VALUE")]
    pub set: Vec<String>,
}

impl Told {
    /// The robot with these parameters.
    pub fn load(&self) -> Result<Robot> {
        told(&self.robot, &self.set)
    }
}

/// A robot with these settings.
pub fn told(robot: &str, set: &[String]) -> Result<Robot> {
    let mut robot = Robot::load(robot)?;
    settings::apply(&mut robot.params, set)?;
    Ok(robot)
}

/// The time from fix to fix, s; or the word in its place.
#[derive(Clone, Copy, Debug)]
pub struct Every(pub Option<f64>);

impl Every {
    /// Seconds, or `end`: one fix, at the end.
    pub fn or_end(text: &str) -> Result<Self, String> {
        Self::or(text, "end")
    }

    /// Seconds, or `none`: no fixes.
    pub fn or_none(text: &str) -> Result<Self, String> {
        Self::or(text, "none")
    }

    fn or(text: &str, word: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            _ if text == word => Ok(Self(None)),
            Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(Self(Some(seconds))),
            _ => Err(format!("write seconds above 0, or `{word}`")),
        }
    }
}

/// How much of something long is done, on the standard error.
pub fn bar(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    let template = format!("{{wide_bar}} {{percent}} % of the {what}, {{eta}} left");
    bar.set_style(
        ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}
