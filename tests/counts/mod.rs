//! Fake encoders and motors, and vehicles built on them, for the tests of odometry.
#![allow(dead_code, reason = "each test file uses its own part")]

pub mod base;

use embedded_hal_02::{Direction, Qei};
use nalgebra::Matrix3;
use std::cell::Cell;
use std::f64::consts::PI;
use std::rc::Rc;
use vehicle_controller::controller::{Estimator, Noise};
use vehicle_controller::params::Params;
use vehicle_controller::time::Duration;
use vehicle_controller::vehicle::differential::{self, DifferentialDrive, Geometry};
use vehicle_controller::vehicle::gains::OFFSETS;
use vehicle_controller::vehicle::{
    Calibration, Counter, Drive, OutputError, VirtualVehicle, WheelCommand, servo,
};

/// Wheel base of the default robot, m.
pub const BASE: f64 = 0.2;
/// Its metres per count: 84 mm wheels, 2796.8 counts per turn.
pub const COUNT: f64 = PI * 0.084 / 2796.8;

/// The random errors of `vectors/pose_covariance.csv`: `κ_S` = 1e-5 m²/m, `κ_drift` = (0.3°)²/m, `κ_rot` = 2e-4 rad²/rad.
pub fn noise() -> Noise {
    Noise {
        translation: 1e-5,
        drift: 0.3_f64.to_radians().powi(2) as f32,
        rotation: 2e-4,
        steering: [0.0; OFFSETS],
    }
}

/// A counter that shows the low bits of a count.
pub trait Bits: Counter {
    /// The low bits.
    fn low(count: i64) -> Self;
}

impl Bits for u16 {
    fn low(count: i64) -> Self {
        count as Self
    }
}

impl Bits for u32 {
    fn low(count: i64) -> Self {
        count as Self
    }
}

/// An encoder whose count the test sets.
#[derive(Debug)]
pub struct Tape<B> {
    count: Rc<Cell<i64>>,
    bits: std::marker::PhantomData<B>,
}

impl<B: Bits> Qei for Tape<B> {
    type Count = B;

    fn count(&self) -> B {
        B::low(self.count.get())
    }

    fn direction(&self) -> Direction {
        Direction::Upcounting
    }
}

/// A motor that does nothing.
#[derive(Debug)]
pub struct NoMotor;

impl Drive for NoMotor {
    fn knows_duty(&self) -> bool {
        true
    }

    fn configure(&mut self, _: &servo::Config) {}

    fn command(&mut self, _: WheelCommand, _: f32, _: f32) -> Result<f32, OutputError> {
        Ok(0.0)
    }

    fn off(&mut self) -> Result<(), OutputError> {
        Ok(())
    }
}

/// A differential drive on two tapes.
pub type Vehicle<B> = DifferentialDrive<Tape<B>, Tape<B>, NoMotor, NoMotor>;
/// The counts that the two encoders show, left and right.
pub type Counts = [Rc<Cell<i64>>; 2];

/// The geometry of the default robot.
pub fn geometry() -> Geometry {
    Geometry::new(BASE, COUNT, COUNT, Calibration::NOMINAL)
}

/// The default parameters with another geometry.
pub fn config(geometry: Geometry) -> differential::Config {
    differential::Config {
        geometry,
        ..Params::default()
            .build::<differential::Config>(Duration::millis(1))
            .vehicle
    }
}

/// A vehicle whose encoders show `start` at first.
pub fn vehicle<B: Bits>(config: &differential::Config, start: [i64; 2]) -> (Vehicle<B>, Counts) {
    let counts = start.map(|count| Rc::new(Cell::new(count)));
    let tape = |wheel: usize| Tape {
        count: Rc::clone(&counts[wheel]),
        bits: std::marker::PhantomData,
    };
    let vehicle = DifferentialDrive::new(tape(0), tape(1), NoMotor, NoMotor, config);
    (vehicle, counts)
}

/// A vehicle with 16-bit counters, and its dead reckoning.
#[derive(Debug)]
pub struct Odometry {
    /// Where it is believed to be.
    pub estimator: Estimator,
    vehicle: Vehicle<u16>,
    counts: Counts,
}

impl Odometry {
    /// Starts at the origin.
    pub fn new(geometry: Geometry, noise: Noise) -> Self {
        let (vehicle, counts) = vehicle(&config(geometry), [0, 0]);
        Self {
            estimator: Estimator::new(noise),
            vehicle,
            counts,
        }
    }

    /// A tick: the encoders show these totals, `dt` seconds after the last.
    pub fn tick(&mut self, totals: [i64; 2], dt: f32) {
        for (count, total) in self.counts.iter().zip(totals) {
            count.set(total);
        }
        let motion = self.vehicle.sense(dt);
        self.estimator
            .advance(motion.increment, self.vehicle.resolution());
    }
}

/// What an encoder shows that has turned by `counts`, with its edge anywhere: `phase` is 0 to 1.
pub fn quantised(counts: f64, phase: f64) -> i64 {
    (counts + phase).floor() as i64
}

/// The smallest eigenvalue in correlation scale, where a variance of zero counts as one.
pub fn smallest_eigenvalue(c: &Matrix3<f64>) -> f64 {
    let d = c
        .diagonal()
        .map(|v| if v > 0.0 { 1.0 / v.sqrt() } else { 0.0 });
    c.component_mul(&(d * d.transpose()))
        .symmetric_eigenvalues()
        .min()
}

/// Deterministic noise: SplitMix64, and the sum of twelve for a normal deviate (its variance is exactly 1).
#[derive(Debug)]
pub struct Random(pub u64);

impl Random {
    /// Between `low` and `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let unit = ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64;
        low + unit * (high - low)
    }

    /// Mean 0, variance 1.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.between(-0.5, 0.5)).sum()
    }
}
