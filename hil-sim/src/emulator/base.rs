//! The base with the shipped image in it: the plant of the simulator, and the emulated board as its controller.

use super::board::{Bridge, Nucleo};
use super::encoders::Encoders;
use super::flash::Flash;
use super::knowledge::Knowledge;
use super::lockstep::{Core, Meeting, Stretch};
use super::program::Program;
use super::wiring::Wiring;
use crate::base::Base;
use crate::faults::{Fault, FaultSet};
use crate::peripherals::stored;
use crate::plant::{BridgeInput, Input, Plant, Push};
use crate::rig::{PERIOD, SUBSTEPS};
use crate::robot::{Drives, Model, Robot};
use crate::trace::Row;
use crate::vehicle::steers;
use anyhow::{Result, bail, ensure};
use rigless::emulator::Watch;
use rigless::image::Image;
use rigless::time::VirtualNanos;
use std::path::Path;
use vehicle_controller::controller::State;
use vehicle_controller::params::Params;
use vehicle_controller::time::{self, Instant};
use vehicle_controller::vehicle::Kind;

/// The image has so long to start, ns.
const START_PATIENCE_NS: u64 = 100_000_000;
/// While it starts, it is looked after this often, ns.
const START_STEP_NS: u64 = 10_000;
/// The control interrupt comes so long before the period ends, ns: for its own time, and for the PWM to take the new duty over with its next cycle.
const TICK_NS: u64 = 100_000;

/// Where the image keeps its parameters.
const PARAMETERS: u64 = 0x0810_0000;

/// How a board is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setup {
    /// Frequency of the watchdog's oscillator, 17 000 to 47 000 Hz.
    pub lsi_hz: u64,
    /// What is in the flash besides the image: addresses and bytes.
    pub flash: Vec<(u64, Vec<u8>)>,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            lsi_hz: 32_000,
            flash: Vec::new(),
        }
    }
}

/// A base that the image of the firmware controls.
#[derive(Debug)]
pub struct ImageBase {
    pub(super) core: Core,
    /// How long before the simulation began the board was powered up, ns.
    power_on: u64,
    knowledge: Knowledge,
    pub(super) program: Program,
    up: bool,
    plant: Plant,
    vehicle: Kind,
    battery_divider: f64,
    faults: FaultSet,
    encoders: Encoders,
    bridges: [Bridge; 2],
    /// Width of the servo's pulses, s.
    servo: Option<f64>,
    now: Instant,
    push: Push,
    push_until: Instant,
    received: Vec<u8>,
    backlog: usize,
    power_fails: bool,
}

impl ImageBase {
    /// Powers a robot up with an image in its flash, and its parameters where the image keeps them. The same image, robot and seed give the same run, bit for bit.
    ///
    /// # Errors
    /// If the image cannot be read, does not fit, or the robot is not one that it can drive.
    pub fn new(image: &Path, robot: &Robot, seed: u64) -> Result<Self> {
        Self::with(image, robot, seed, &Setup::default())
    }

    /// The same with a board that is set up in another way.
    ///
    /// # Errors
    /// As [`Self::new`], and if the set-up is not one that a board can have.
    pub fn with(image: &Path, robot: &Robot, seed: u64, setup: &Setup) -> Result<Self> {
        if robot.model == Model::Ideal {
            bail!(
                "an image drives motors, and this robot's wheels turn as they are told: choose another robot"
            );
        }
        ensure!(
            robot.drives == Drives::Bridge,
            "the image drives bridges, and this robot's motors have controllers of their own: choose another robot"
        );
        ensure!(
            (17_000..=47_000).contains(&setup.lsi_hz),
            "the watchdog's oscillator runs at 17 to 47 kHz, not at {} Hz",
            setup.lsi_hz
        );
        let path = image;
        let image = Image::read(path, None)?;
        let knowledge = Knowledge::find(image.bytes())?;
        let program = Program::load(image.bytes())?;
        let wiring = Wiring::new(&robot.physics.chassis, program.vehicle())?;
        let mut flash = Flash::default();
        for (address, bytes) in image.segments() {
            ensure!(
                flash.place(address, bytes),
                "the image has {} bytes at {address:#010x}, outside the flash",
                bytes.len()
            );
        }
        let mut images = vec![image];
        let stored =
            (robot.params != Params::default()).then(|| (PARAMETERS, stored(&robot.params)));
        for (address, bytes) in stored.iter().chain(&setup.flash) {
            ensure!(
                flash.place(*address, bytes),
                "{} bytes at {address:#010x} are outside the flash",
                bytes.len()
            );
            images.push(Image::new(path, bytes.clone(), Some(*address))?);
        }
        let board = Nucleo::new(flash, setup.lsi_hz)?;
        let plant = Plant::new(&robot.physics, seed);
        let now = Instant::from_ticks(0);
        let mut core = Core::power_up(board, images)?;
        sense(&core, &plant, robot.physics.battery.divider)?;
        let (power_on, received) = align(&mut core, program.control()?.address)?;
        Ok(Self {
            core,
            power_on,
            knowledge,
            program,
            up: !received.is_empty(),
            faults: FaultSet::new(&plant, seed),
            encoders: Encoders::new(wiring),
            plant,
            vehicle: robot.params.vehicle(),
            battery_divider: robot.physics.battery.divider,
            bridges: [Bridge::default(); 2],
            servo: None,
            now,
            push: Push::default(),
            push_until: now,
            received,
            backlog: 0,
            power_fails: false,
        })
    }

    /// What the drivers of the motors are told.
    pub fn bridges(&self) -> [Bridge; 2] {
        self.bridges
    }

    /// What the steering's servo is told: the width of its pulses, s.
    pub fn servo(&self) -> Option<f64> {
        self.servo
    }

    /// What the controller knows, as bytes; nothing before it has started.
    fn snapshot(&self) -> Result<Option<Vec<u8>>> {
        let (address, size) = self.knowledge.place();
        if !self.up {
            return Ok(None);
        }
        self.core
            .hold(move |held| held.read(address, size))?
            .map(Some)
    }

    /// A row of the trace whose time is the board's own: that of the tick from which its numbers are.
    ///
    /// # Errors
    /// If what the controller knows cannot be read.
    pub fn known(&self) -> Result<Row> {
        let [true_x, true_y, true_theta] = self.plant.pose();
        let [left_current, right_current] = self.plant.current();
        let has_front = self.vehicle == Kind::BiSteerable;
        let fronts = self
            .plant
            .front_counts()
            .map(|count| has_front.then_some(count));
        let mut row = Row {
            true_x,
            true_y,
            true_theta,
            left_current,
            right_current,
            move_state: State::Hold.name().to_owned(),
            turn_state: State::Hold.name().to_owned(),
            fault: "none".to_owned(),
            // Filled with what the image knows, where it has started.
            steer: steers(self.vehicle).then_some(0.0),
            true_steer: steers(self.vehicle).then(|| self.plant.steering()),
            front_left_count: fronts[0],
            front_right_count: fronts[1],
            ..Row::default()
        };
        if let Some(snapshot) = self.snapshot()? {
            self.knowledge.tell(&snapshot, &mut row)?;
        }
        Ok(row)
    }

    /// An instant of the simulation on the board's clock.
    fn instant(&self, instant: Instant) -> VirtualNanos {
        VirtualNanos(self.power_on + instant.ticks() * 1000)
    }

    fn advance_plant(&mut self) {
        let push = if self.now < self.push_until {
            self.push
        } else {
            Push::default()
        };
        let command = self.faults.bridges(self.bridges.map(told));
        let input = Input {
            command,
            push,
            steering: self.servo,
        };
        let dt = PERIOD.ticks() as f64 * 1e-6 / f64::from(SUBSTEPS);
        for _ in 0..SUBSTEPS {
            self.plant.step(dt, &input);
        }
    }

    fn cut_link(&mut self, cut: bool) -> Result<()> {
        self.backlog = self.core.hold(move |held| {
            let line = held.session.board_mut().line();
            line.map_or(0, |line| {
                line.set_cut(cut);
                line.backlog()
            })
        })?;
        Ok(())
    }
}

impl Base for ImageBase {
    fn send(&mut self, bytes: &[u8]) -> Result<()> {
        let bytes = bytes.to_vec();
        self.backlog = self.core.hold(move |held| {
            let line = held.session.board_mut().line();
            line.map_or(0, |line| {
                line.send(&bytes);
                line.backlog()
            })
        })?;
        Ok(())
    }

    fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.received)
    }

    /// Bytes that have not begun their way to the base yet.
    fn backlog(&self) -> usize {
        self.backlog
    }

    fn push(&mut self, force: f64, torque: f64, seconds: f64) {
        self.push = Push { force, torque };
        self.push_until = time::after(self.now, time::Duration::from_ticks((seconds * 1e6) as u64));
    }

    fn set_estop(&mut self, open: bool) -> Result<()> {
        self.core
            .hold(move |held| held.session.board_mut().set_estop(held.stop.at, open))
    }

    fn inject(&mut self, fault: Fault) -> Result<()> {
        match fault {
            Fault::LinkCut => self.cut_link(true),
            Fault::FlashCut(bytes) => self.cut_flash(bytes),
            fault => self.faults.inject(fault, &mut self.plant),
        }
    }

    fn clear_faults(&mut self) -> Result<()> {
        self.faults.clear(&mut self.plant);
        self.cut_link(false)
    }

    fn cut_flash(&mut self, bytes: u64) -> Result<()> {
        self.core.hold(move |held| {
            held.observer.expect_reset();
            held.session.board_mut().part.flash.cut_after(bytes);
        })
    }

    /// The board is without power for the next tick.
    fn power_cycle(&mut self) -> Result<()> {
        self.power_fails = true;
        Ok(())
    }

    fn now(&self) -> Instant {
        self.now
    }

    fn clock(&self) -> Result<f64> {
        Ok(self.known()?.t)
    }

    fn plant(&self) -> &Plant {
        &self.plant
    }

    fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// One millisecond: the plant moves on, and while the encoders turn as it did the board runs. Fails if the image does something that the emulated
    /// board has no answer to.
    fn tick(&mut self) -> Result<()> {
        let from = self.now;
        self.advance_plant();
        self.now = time::after(self.now, PERIOD);
        self.encoders.follow(&self.plant, &mut self.faults);
        let edges = self
            .encoders
            .edges(self.instant(from), PERIOD.ticks() * 1000 - TICK_NS);
        sense(&self.core, &self.plant, self.battery_divider)?;
        let power_fails = std::mem::take(&mut self.power_fails);
        self.core.hold(move |held| {
            let at = held.stop.at;
            let part = &mut held.session.board_mut().part;
            if power_fails {
                part.lose_power(at);
                held.observer.expect_reset();
            } else {
                part.restore_power(at);
            }
        })?;
        let until = self.instant(self.now);
        let Meeting {
            bytes,
            backlog,
            bridges,
            servo,
            problem,
        } = self.core.run(Stretch { until, edges })?;
        self.received.extend(bytes);
        self.up |= !self.received.is_empty();
        self.backlog = backlog;
        self.bridges = bridges;
        self.servo = servo;
        if let Some(problem) = problem {
            let seconds = self.now.ticks() as f64 * 1e-6;
            bail!("the image is not at home on this board at {seconds:.3} s: {problem}");
        }
        Ok(())
    }

    fn holds(&self) -> Result<bool> {
        let snapshot = self.snapshot()?;
        snapshot.map_or(Ok(false), |snapshot| self.knowledge.holds(&snapshot))
    }

    fn row(&self) -> Result<Row> {
        let mut row = self.known()?;
        // The image's clock starts anew with every reset.
        row.t = self.now.ticks() as f64 * 1e-6;
        Ok(row)
    }
}

/// Puts the voltages of battery, current sensors and potentiometer on the analog inputs.
fn sense(core: &Core, plant: &Plant, battery_divider: f64) -> Result<()> {
    let [left, right] = plant.current_signal();
    let volts = [
        plant.bus_voltage() / battery_divider,
        left,
        right,
        plant.steering_signal(),
    ];
    core.hold(move |held| held.session.board_mut().sense(volts))
}

/// What a driver makes of its pins.
fn told(bridge: Bridge) -> BridgeInput {
    if bridge.enabled {
        BridgeInput::Duty(bridge.duty)
    } else {
        BridgeInput::Open
    }
}

/// Lets the board start until its control interrupt comes at the end of the simulation's periods, as the library's tick does: it then reads what the
/// encoders did in a period, and what it puts out is what drives the next one. Gives the time that has passed since power-on, ns, and what was said.
fn align(core: &mut Core, control: u64) -> Result<(u64, Vec<u8>)> {
    let entry = Watch::Instruction(control);
    core.hold(move |held| held.session.watch(entry))?;
    let (mut now, mut said) = (0, Vec::new());
    let begun = loop {
        ensure!(
            now < START_PATIENCE_NS,
            "the image's control interrupt has not begun {} ms after power-on",
            START_PATIENCE_NS / 1_000_000
        );
        now += START_STEP_NS;
        let meeting = core.run(Stretch::to(VirtualNanos(now)))?;
        said.extend(meeting.bytes);
        if let Some(problem) = meeting.problem {
            bail!("the image is not at home on this board: {problem}");
        }
        if let Some(begun) = core.hold(|held| held.observer.last_hit())? {
            break begun.0;
        }
    };
    core.hold(move |held| held.session.unwatch(entry))?;
    let aligned = begun + TICK_NS;
    said.extend(core.run(Stretch::to(VirtualNanos(aligned)))?.bytes);
    Ok((aligned, said))
}
