//! `hil-sim`: drive a simulated robot base, run scripts on it, replay logs, draw what happened.

mod calibrating;
mod console;
mod hermosillo;
mod journey;
mod message_log;
mod monte_carlo;
mod options;
mod run;
mod soaking;
mod trace_file;
mod umbmarking;
mod web;

use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, Parser, Subcommand};
use console::{Far, Speed};
use hil_sim::base::Base;
use hil_sim::map::sketch::Sketch;
use hil_sim::plot;
use hil_sim::replay::{Log, replay};
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use hil_sim::script::Script;
use hil_sim::trace;
use message_log::MessageLog;
use run::Watcher;
use std::ffi::OsStr;
use std::io::Write;
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trace_file::TraceFile;
use web::Served;

/// A simulated robot base: the real vehicle controller on simulated motors, battery, tyres and encoders.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    drive: Drive,
}

#[derive(Subcommand)]
enum Command {
    /// Drive the base from this terminal, from a page in a browser, from a pseudo-terminal or over TCP, in real time
    Drive(Drive),
    /// Run a script of `<seconds> <protocol line>` lines; prints `<seconds>\t<line>` for each line the base sends
    Run(Run),
    /// Feed recorded encoder counts through the vehicle and the estimator
    Replay(Replay),
    /// Learn the gains from logs with ground truth, and show what that is worth
    Calibrate(calibrating::Options),
    /// Drive the classical square test, and compare what it says with what the filter learns from it
    Umbmark(umbmarking::Options),
    /// Drive the experiment of the bi-steerable car: odometry by each relation of its axle, before and after a calibration
    Hermosillo(hermosillo::Options),
    /// Try the estimator on many bases with gains and errors drawn from the parameters: is it as wrong as it says?
    Consistency(monte_carlo::Consistency),
    /// Send particles along a log or a script's run, and hold the estimator's linear covariance against theirs
    Propagate(monte_carlo::Propagate),
    /// Count the instructions of an image's control interrupt while a script runs
    #[cfg(feature = "emulator")]
    #[command(hide = true)]
    Count(Count),
    /// Drive at random for hours, and see that nothing trips without cause and nothing moves that should not
    #[command(hide = true)]
    Soak(soaking::Options),
    /// Draw a trace
    Plot(Plot),
    /// Draw the figures of Brooks's paper: motions with bounds, forward and backward reasoning
    Brooks(Figures),
    /// List the robots
    Robots,
}

#[derive(Args)]
struct Simulated {
    /// A robot's name (see `robots`) or the path of its .toml file
    #[arg(long, default_value = "default")]
    robot: String,
    /// Run this image of the firmware on an emulated board, in place of the library on this computer
    #[arg(long, value_name = "F.elf")]
    image: Option<PathBuf>,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Write a trace of the run (CSV)
    #[arg(long, value_name = "F.csv")]
    trace: Option<PathBuf>,
}

#[derive(Args)]
struct Drive {
    #[command(flatten)]
    base: Simulated,
    /// How fast simulated time passes: a factor, or `max`
    #[arg(long, default_value = "1", value_name = "X|max")]
    speed: Speed,
    /// Offer the serial line as a pseudo-terminal
    #[arg(long, conflicts_with = "tcp")]
    pty: bool,
    /// Offer the serial line as a TCP port on loopback
    #[arg(long, value_name = "127.0.0.1:PORT", value_parser = parse_address)]
    tcp: Option<SocketAddr>,
    /// Offer a page that shows the base and drives it
    #[arg(
        long,
        value_name = "127.0.0.1:PORT",
        num_args = 0..=1,
        default_missing_value = "127.0.0.1:8080",
        conflicts_with_all = ["pty", "tcp"]
    )]
    web: Option<web::Address>,
    /// Let others than this computer have the page: whoever reaches it can drive the base
    #[arg(long, requires = "web")]
    web_allow_remote: bool,
}

#[derive(Args)]
struct Run {
    /// The script
    script: PathBuf,
    #[command(flatten)]
    base: Simulated,
    /// Time between two rows of the trace
    #[arg(long, default_value_t = 0.01, value_name = "S")]
    trace_period: f64,
    /// Write the run as messages of ROS 2, for Foxglove and `ros2 bag`
    #[arg(long, value_name = "F.mcap")]
    mcap: Option<PathBuf>,
    /// Draw the run
    #[arg(long, value_name = "F.svg|F.png")]
    plot: Option<PathBuf>,
    /// Draw the map, as it was each time the script asked with GetMap (four times at most)
    #[arg(long, value_name = "F.svg|F.png")]
    map: Option<PathBuf>,
}

#[derive(Args)]
struct Figures {
    /// The picture
    #[arg(short, long, value_name = "F.svg|F.png")]
    output: PathBuf,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[cfg(feature = "emulator")]
#[derive(Args)]
struct Count {
    /// The script
    script: PathBuf,
    /// The image of the firmware
    #[arg(long, value_name = "F.elf")]
    image: PathBuf,
    /// A robot's name or the path of its .toml file
    #[arg(long, default_value = "default")]
    robot: String,
    /// Seed of everything random
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Args)]
struct Replay {
    /// Logs: CSV with columns t,left,right (counts since the row before) and optionally x,y,theta; of vehicles that steer t,drive,steer or t,left,right,steer (rad)
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    #[command(flatten)]
    told: options::Told,
    /// Write a row per log row (CSV); one log only
    #[arg(long, value_name = "F.csv")]
    out: Option<PathBuf>,
    /// Draw paths and errors
    #[arg(long, value_name = "F.svg|F.png")]
    plot: Option<PathBuf>,
}

#[derive(Args)]
struct Plot {
    /// The trace
    trace: PathBuf,
    /// The picture
    #[arg(short, long, value_name = "F.svg|F.png")]
    output: PathBuf,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        None => drive_command(&cli.drive),
        Some(Command::Drive(drive)) => drive_command(&drive),
        Some(Command::Run(run)) => run_command(&run),
        Some(Command::Replay(replay)) => replay_command(&replay),
        Some(Command::Calibrate(options)) => calibrating::calibrate_command(&options),
        Some(Command::Umbmark(options)) => umbmarking::umbmark_command(&options),
        Some(Command::Hermosillo(options)) => hermosillo::hermosillo_command(&options),
        Some(Command::Consistency(options)) => monte_carlo::consistency_command(&options),
        Some(Command::Propagate(options)) => monte_carlo::propagate_command(&options),
        #[cfg(feature = "emulator")]
        Some(Command::Count(count)) => count_command(&count),
        Some(Command::Soak(options)) => soaking::soak_command(&options),
        Some(Command::Plot(plot)) => plot_command(&plot),
        Some(Command::Brooks(figures)) => brooks_command(&figures),
        Some(Command::Robots) => robots_command(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever read the output has seen enough.
        Err(error) if is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .downcast_ref::<std::io::Error>()
        .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}

/// `127.0.0.1:4000`, `localhost:4000` or just `4000`.
fn parse_address(text: &str) -> Result<SocketAddr> {
    if let Ok(port) = text.parse::<u16>() {
        return Ok(SocketAddr::from(([127, 0, 0, 1], port)));
    }
    let mut addresses = text
        .to_socket_addrs()
        .map_err(|_| anyhow!("write an address like 127.0.0.1:4000, or a port"))?;
    addresses
        .next()
        .ok_or_else(|| anyhow!("{text} has no address"))
}

impl Simulated {
    fn power_up(&self) -> Result<Box<dyn Base>> {
        let robot = Robot::load(&self.robot)?;
        Ok(match &self.image {
            Some(image) => emulated(image, &robot, self.seed)?,
            None => Box::new(Rig::new(&robot, self.seed)?),
        })
    }
}

#[cfg(feature = "emulator")]
fn emulated(image: &Path, robot: &Robot, seed: u64) -> Result<Box<dyn Base>> {
    let base = hil_sim::emulator::ImageBase::new(image, robot, seed)?;
    Ok(Box::new(base))
}

#[cfg(not(feature = "emulator"))]
fn emulated(_: &Path, _: &Robot, _: u64) -> Result<Box<dyn Base>> {
    bail!(
        "--image needs the emulator, which this hil-sim was built without: \
         run `cargo emulator …` in its repository"
    )
}

fn drive_command(drive: &Drive) -> Result<()> {
    let mut base = drive.base.power_up()?;
    let far = match (&drive.web, drive.tcp) {
        (Some(address), _) => Far::Web(address.clone(), drive.web_allow_remote),
        (None, Some(address)) => Far::Tcp(address),
        (None, None) if drive.pty => Far::Pty,
        (None, None) => Far::Terminal,
    };
    let trace = TraceFile::create(drive.base.trace.as_deref(), false, 0.01)?;
    let served = Served {
        robot: &Robot::load(&drive.base.robot)?,
        name: robot_name(&drive.base.robot),
        image: drive.base.image.is_some(),
        speed: drive.speed,
    };
    console::drive(base.as_mut(), &served, &far, trace)
}

/// A preset's name, or that of a robot's file without its folder, which is nobody else's business.
fn robot_name(robot: &str) -> &str {
    let stem = Path::new(robot).file_stem().and_then(OsStr::to_str);
    stem.unwrap_or(robot)
}

fn run_command(run: &Run) -> Result<()> {
    let script = Script::load(&run.script)?;
    for picture in [&run.plot, &run.map].into_iter().flatten() {
        plot::check_name(picture)?;
    }
    if !(run.trace_period > 0.0 && run.trace_period.is_finite()) {
        bail!("--trace-period must be above 0");
    }
    let mut base = run.base.power_up()?;
    let keep = run.plot.is_some();
    let mut trace = TraceFile::create(run.base.trace.as_deref(), keep, run.trace_period)?;
    let mut messages = match &run.mcap {
        Some(path) => Some(MessageLog::create(path, &Robot::load(&run.base.robot)?)?),
        None => None,
    };
    let mut watchers: Vec<&mut dyn Watcher> = Vec::new();
    watchers.extend(trace.as_mut().map(|trace| trace as &mut dyn Watcher));
    watchers.extend(
        messages
            .as_mut()
            .map(|messages| messages as &mut dyn Watcher),
    );
    let mut out = run::Transcript::new(std::io::BufWriter::new(std::io::stdout().lock()));
    run::run(
        base.as_mut(),
        &script,
        run.base.seed,
        &mut watchers,
        &mut out,
    )?;
    if let Some(messages) = messages {
        messages.finish()?;
    }
    if let Some(picture) = &run.map {
        let title = title(&run.script, &run.base.robot);
        draw_map(&out.text(), &title, picture)?;
    }
    if let Some(trace) = trace {
        let rows = trace.into_rows()?;
        if let Some(picture) = &run.plot {
            let asked = plot::asked_paths(&script, &out.text(), &rows);
            let title = title(&run.script, &run.base.robot);
            plot::plot(&rows, &asked, &title, picture)?;
        }
    }
    Ok(())
}

#[cfg(feature = "emulator")]
fn count_command(count: &Count) -> Result<()> {
    let script = Script::load(&count.script)?;
    let robot = Robot::load(&count.robot)?;
    let mut base = hil_sim::emulator::ImageBase::new(&count.image, &robot, count.seed)?;
    base.count(true)?;
    run::run(
        &mut base,
        &script,
        count.seed,
        &mut [],
        &mut std::io::sink(),
    )?;
    write!(std::io::stdout(), "{}", base.counts()?).context("standard output")
}

/// What the base has told of its map, a panel for each time.
fn draw_map(said: &str, title: &str, picture: &Path) -> Result<()> {
    let lines = said
        .lines()
        .filter_map(|line| Some(line.split_once('\t')?.1));
    let sketches = Sketch::all(lines)?;
    if sketches.is_empty() {
        bail!("--map: the script does not ask for the map with GetMap");
    }
    let charts: Result<Vec<_>> = sketches
        .iter()
        .take(4)
        .enumerate()
        .map(|(index, sketch)| {
            let forward = index + 1 < sketches.len().min(4);
            sketch.chart(&format!("GetMap {}", index + 1), forward)
        })
        .collect();
    plot::plot_charts(&charts?, title, picture)
}

fn brooks_command(figures: &Figures) -> Result<()> {
    let charts = hil_sim::map::figures::figures(figures.seed)?;
    let title = "Brooks, Visual Map Making for a Mobile Robot (1985): figures 1 to 5";
    plot::plot_charts(&charts, title, &figures.output)
}

fn title(script: &Path, robot: &str) -> String {
    format!(
        "{} on {robot}",
        script.file_name().unwrap_or_default().to_string_lossy()
    )
}

fn replay_command(args: &Replay) -> Result<()> {
    let robot = args.told.load()?;
    if args.out.is_some() && args.logs.len() > 1 {
        bail!("--out is for one log");
    }
    if let Some(picture) = &args.plot {
        plot::check_name(picture)?;
    }
    let mut paths = Vec::new();
    for path in &args.logs {
        let log = Log::load(path)?;
        let replayed = replay(&log, &robot, &robot.params)?;
        write!(std::io::stdout(), "{}", replayed.report()).context("standard output")?;
        if let Some(out) = &args.out {
            replayed.write(out)?;
        }
        paths.push(replayed.path());
    }
    if let Some(picture) = &args.plot {
        plot::plot_replay(&paths, &format!("Replay on {}", args.told.robot), picture)?;
    }
    Ok(())
}

fn plot_command(args: &Plot) -> Result<()> {
    let rows = trace::read(&args.trace)?;
    let title = args.trace.file_name().unwrap_or_default().to_string_lossy();
    plot::plot(&rows, &[], &title, &args.output)
}

fn robots_command() -> Result<()> {
    for name in Robot::presets() {
        let description = Robot::load(name)?.description;
        writeln!(std::io::stdout(), "{name:<20}{description}").context("standard output")?;
    }
    Ok(())
}
