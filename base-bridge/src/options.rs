//! The command line.

use anyhow::{Context, Result, ensure};
use base_bridge::line::Door;
use base_bridge::line::serial::Serial;
use base_bridge::line::simulated::Simulated;
use base_bridge::line::tcp::Tcp;
use base_bridge::params::Params;
use clap::{ArgGroup, Parser};
use std::path::PathBuf;

/// Joins a base, real or simulated, to a ROS 2 network. One process a base.
#[derive(Debug, Parser)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
#[command(group(ArgGroup::new("base").args(["port", "tcp", "sim"])))]
pub struct Options {
    /// The base's serial port, as /dev/ttyACM0 or a link in /dev/serial/by-id
    #[arg(long)]
    port: Option<PathBuf>,
    /// The base behind a TCP port, as 127.0.0.1:4000
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// A simulated base in this process: a robot of `cargo sim robots`, or the path of a .toml file
    #[arg(long, value_name = "ROBOT", num_args = 0..=1, default_missing_value = "default")]
    sim: Option<String>,
    /// What is random in a simulated base
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The node's name
    #[arg(long, default_value = "base")]
    name: String,
    /// Its namespace, as robot1: before each topic and service that does not begin with a slash
    #[arg(long, default_value = "")]
    namespace: String,
    /// A file of parameters, as ROS 2 has them; may be repeated, the last one counts
    #[arg(long, value_name = "FILE")]
    params_file: Vec<PathBuf>,
    /// A parameter, behind all files; may be repeated
    #[arg(short, long = "param", value_name = "NAME:=VALUE")]
    param: Vec<String>,
    /// Nothing leaves this computer, as with ROS_LOCALHOST_ONLY=1
    #[cfg(feature = "node")]
    #[arg(long)]
    pub localhost_only: bool,
    /// Joins no network: for --print and --mcap alone
    #[cfg(feature = "node")]
    #[arg(long)]
    pub offline: bool,
    /// Serves what is published to Foxglove
    #[cfg(feature = "foxglove")]
    #[arg(
        long,
        value_name = "127.0.0.1:PORT",
        num_args = 0..=1,
        default_missing_value = "127.0.0.1:8765"
    )]
    pub foxglove: Option<std::net::SocketAddr>,
    /// Writes what is published to a file that Foxglove and `ros2 bag` open; one that is there is kept
    #[arg(long, value_name = "FILE")]
    pub mcap: Option<PathBuf>,
    /// Prints what is published
    #[arg(long)]
    pub print: bool,
    /// Prints all parameters with their values, as a file, and ends
    #[arg(long)]
    pub list_params: bool,
}

impl Options {
    /// The node's own name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its namespace.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The node's full name, as /robot1/base.
    pub fn node(&self) -> String {
        match self.namespace.trim_matches('/') {
            "" => format!("/{}", self.name),
            namespace => format!("/{namespace}/{}", self.name),
        }
    }

    /// The parameters, files before options.
    pub fn params(&self) -> Result<Params> {
        let mut params = Params::default();
        for file in &self.params_file {
            let name = || file.display().to_string();
            let text = std::fs::read_to_string(file).with_context(name)?;
            params.read(&text, &self.node()).with_context(name)?;
        }
        for assignment in &self.param {
            params.assign(assignment)?;
        }
        Ok(params)
    }

    /// The line to the base.
    pub fn door(&self, params: &Params) -> Result<Box<dyn Door>> {
        if let Some(port) = &self.port {
            return Ok(Box::new(Serial::new(port.clone(), params.baud as u32)));
        }
        if let Some(address) = &self.tcp {
            return Ok(Box::new(Tcp::new(address.clone())));
        }
        ensure!(self.sim.is_some(), "which base? --port, --tcp or --sim");
        let robot = self.sim.as_deref().unwrap_or_default();
        Ok(Box::new(Simulated::new(robot, self.seed)?))
    }
}
