//! What happens to a base from outside: pushes, and things that break.

use crate::faults::{EncoderFault, Fault, MotorFault, Side};
use crate::robot::Robot;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use vehicle_controller::params::Id;

/// The largest pushes on a base of such motors, N and N·m, where its motors together can push with so much, N, and such is its wheel base, m.
const PUSH: (f64, f64) = (5.0, 0.3);
const PUSHED_FORCE: f64 = 141.5;
const PUSHED_BASE: f64 = 0.2;

/// A push: N along the base, N·m about it, for so many seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shove {
    /// N.
    pub force: f64,
    /// N·m.
    pub torque: f64,
    /// s.
    pub seconds: f64,
}

impl Shove {
    /// A random one, in proportion to what the motors of the robot can push with, so that to withstand it takes the same share of their voltage.
    pub fn random(random: &mut ChaCha8Rng, robot: &Robot, size: f64) -> Self {
        let physics = &robot.physics;
        let (motor, wheels) = (&physics.motor, &physics.wheels);
        // F = 2 k U/(R r)
        let radius = 0.25 * (wheels.diameter_left + wheels.diameter_right);
        let supply = f64::from(robot.params.get(Id::Supply));
        let most = 2.0 * motor.torque_constant * supply / (motor.resistance * radius);
        let scale = size * most / PUSHED_FORCE;
        let (force, torque) = (PUSH.0 * scale, PUSH.1 * scale * wheels.base / PUSHED_BASE);
        Self {
            force: random.random_range(-force..=force),
            torque: random.random_range(-torque..=torque),
            seconds: log(random, 0.02, 2.0),
        }
    }
}

/// A number between two, each decade as likely as another.
pub fn log(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random::<f64>())
}

/// A random fault of any kind but those of the parameters' flash, which are a matter of saving, not of driving.
pub fn fault(random: &mut ChaCha8Rng, robot: &Robot) -> Fault {
    let side = [Side::Left, Side::Right, Side::Both][random.random_range(0..3)];
    match random.random_range(0..14) {
        0 | 1 => Fault::Encoder(side, EncoderFault::Stuck),
        2 => Fault::Encoder(side, EncoderFault::OpenA),
        3 => Fault::Encoder(side, EncoderFault::OpenB),
        4 => Fault::Encoder(side, EncoderFault::Swapped),
        5 => Fault::Encoder(side, EncoderFault::Scale(random.random_range(-2.0..3.0))),
        6 => Fault::Encoder(side, EncoderFault::Drop(random.random_range(0.05..0.95))),
        7 => {
            let counts = log(random, 5.0, 3000.0) as i64;
            let sign = if random.random() { 1 } else { -1 };
            Fault::Encoder(side, EncoderFault::Jump(sign * counts))
        }
        8 => Fault::Motor(side, MotorFault::Open),
        9 => Fault::Motor(side, MotorFault::Short),
        10 => Fault::Motor(side, MotorFault::Weak(random.random_range(0.05..0.9))),
        11 => Fault::Battery(robot.physics.battery.voltage * random.random_range(0.3..1.7)),
        _ => Fault::LinkCut,
    }
}

/// The name of a fault's kind.
pub fn kind(fault: &Fault) -> &'static str {
    match fault {
        Fault::Encoder(_, EncoderFault::Stuck) => "encoder stuck",
        Fault::Encoder(_, EncoderFault::OpenA) => "encoder open-a",
        Fault::Encoder(_, EncoderFault::OpenB) => "encoder open-b",
        Fault::Encoder(_, EncoderFault::Swapped) => "encoder swapped",
        Fault::Encoder(_, EncoderFault::Scale(_)) => "encoder scale",
        Fault::Encoder(_, EncoderFault::Drop(_)) => "encoder drop",
        Fault::Encoder(_, EncoderFault::Jump(_)) => "encoder jump",
        Fault::Motor(_, MotorFault::Open) => "motor open",
        Fault::Motor(_, MotorFault::Short) => "motor short",
        Fault::Motor(_, MotorFault::Weak(_)) => "motor weak",
        Fault::Controller(_) => "controller",
        Fault::Battery(_) => "battery",
        Fault::LinkCut => "link cut",
        Fault::FlashCut(_) => "flash cut",
    }
}
