//! The physics of a robot base with two driven wheels: battery, bridges, motors, gears, tyres, body
//! and encoders.
//!
//! It is written from mechanics alone and shares nothing with the controller: the true wheel
//! diameters and wheel base are parameters here, and may differ from what the controller believes.
//!
//! Each step is semi-implicit: all forces that could make a stiff system (gear, tyre, back-EMF,
//! drag) are taken at the end of the step as dampings and springs, which makes the equations
//! linear. Wheel by wheel the motor's and the wheel's speed are eliminated, a system of three is
//! left for the body. Of itself such a step only takes energy out, so it is stable at any length;
//! 250 µs is meant.

mod battery;
mod body;
mod bridge;
mod encoder;
mod gear;
mod input;
mod motor;
mod params;
#[cfg(test)]
mod robots;
#[cfg(test)]
mod tests;
mod tyre;
mod wheel;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use battery::{Battery, Consumer};
use body::{Body, Velocity};
use bridge::Bridge;
use encoder::Encoder;
use gear::Gear;
pub use input::{BridgeInput, Command, Input, Push};
use motor::Motor;
pub use params::{
    BatteryParams, BodyParams, BridgeParams, EncoderParams, MotorParams, Physics, TyreParams,
    WheelsParams,
};
use tyre::Tyre;
use wheel::Wheel;

/// How often the branches of a step may be corrected. Two or three are common when something
/// changes; the rest is for steps in which both wheels start to slide at once.
const MAX_TRIALS: usize = 8;

/// Voltage of the bridges' current outputs at no current \[V\].
pub const CURRENT_ZERO: f64 = 1.65;

/// A robot base in motion. Index 0 is the left wheel, 1 the right one.
#[derive(Clone, Debug)]
pub struct Plant {
    battery: Battery,
    bridge: Bridge,
    wheels: [Wheel; 2],
    body: Body,
    encoders: [Encoder; 2],
    bus: f64,
    current: [f64; 2],
    /// V/A.
    current_sensitivity: f64,
}

impl Plant {
    /// A robot base at rest at the origin.
    ///
    /// The seed determines what is unknown about a real one: where the encoders' discs and the
    /// gears stand within a count and within the backlash, and how much each motor is off by
    /// `motor.spread`. The parameters should have been validated.
    pub fn new(physics: &Physics, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let load = 0.5 * physics.body.load_share * physics.body.mass * body::GRAVITY;
        let diameters = [physics.wheels.diameter_left, physics.wheels.diameter_right];
        let mut encoders = [0, 1].map(|_| Encoder::new(&physics.encoder, 0.0));
        let wheels = [0, 1].map(|side| {
            // Always the same draws in the same order, so that no parameter changes what another
            // one gets.
            encoders[side] = Encoder::new(&physics.encoder, random.random());
            let place = random.random::<f64>() - 0.5;
            let factors = [(); 3].map(|()| 1.0 + physics.motor.spread * normal(&mut random));
            let radius = 0.5 * diameters[side];
            Wheel {
                motor: Motor::new(&physics.motor, factors),
                gear: Gear::new(&physics.motor),
                tyre: Tyre::new(&physics.tyre, load),
                radius,
                inertia: physics.wheels.inertia,
                rolling: physics.wheels.rolling_resistance * load * radius,
                angle: 0.0,
                twist: place * physics.motor.backlash,
                motor_speed: 0.0,
                speed: 0.0,
            }
        });
        let battery = Battery::new(&physics.battery);
        Self {
            bus: battery.open_circuit(),
            battery,
            bridge: Bridge::new(&physics.bridge),
            wheels,
            body: Body::new(&physics.body, physics.wheels.base),
            encoders,
            current: [0.0; 2],
            current_sensitivity: physics.bridge.current_sensitivity,
        }
    }

    /// Moves on by `dt` \[s\] under a constant input.
    pub fn step(&mut self, dt: f64, input: &Input) {
        match input.command {
            Command::Bridges(bridges) => self.drive(dt, bridges, input.push),
            Command::Speed(rims) => self.roll(dt, rims),
        }
    }

    /// A step of the real thing.
    #[inline]
    fn drive(&mut self, dt: f64, bridges: [BridgeInput; 2], push: Push) {
        for (wheel, bridge) in self.wheels.iter_mut().zip(bridges) {
            wheel.motor.open = bridge == BridgeInput::Open;
        }
        let [left, right] = &self.wheels;
        let drive = bridges.map(|input| match input {
            BridgeInput::Duty(duty) => self.bridge.drive(duty),
            BridgeInput::Open => 0.0,
        });
        let consumer = |wheel: &Wheel, drive: f64| Consumer {
            drive,
            strength: wheel.motor.share(),
            conductance: wheel.motor.conductance(),
            emf: wheel.motor.emf_constant * wheel.motor_speed,
        };
        self.bus = self
            .battery
            .bus([consumer(left, drive[0]), consumer(right, drive[1])]);
        // V = s·d·V_bus
        let voltage = [
            left.motor.share() * drive[0] * self.bus,
            right.motor.share() * drive[1] * self.bus,
        ];

        let start = self.body.turned(dt);
        let damping = self.body.caster_damping(start);
        let ground = self.body.ground(start);
        let mut guesses = [
            left.guess(ground[0], start.lateral, dt),
            right.guess(ground[1], start.lateral, dt),
        ];
        let mut remaining = MAX_TRIALS;
        let (trials, velocity, ground) = loop {
            let trials = [
                left.attempt(&guesses[0], voltage[0], dt),
                right.attempt(&guesses[1], voltage[1], dt),
            ];
            let grip = guesses[0].grip + guesses[1].grip;
            let velocity = self.body.solve(start, &trials, grip, damping, push, dt);
            let ground = self.body.ground(velocity);
            remaining -= 1;
            if remaining == 0 {
                break (trials, velocity, ground);
            }
            let lateral = velocity.lateral;
            let wrong = [
                left.judge(
                    &mut guesses[0],
                    &trials[0],
                    voltage[0],
                    (ground[0], lateral),
                    dt,
                ),
                right.judge(
                    &mut guesses[1],
                    &trials[1],
                    voltage[1],
                    (ground[1], lateral),
                    dt,
                ),
            ];
            if wrong == [false; 2] {
                break (trials, velocity, ground);
            }
        };

        for (side, wheel) in self.wheels.iter_mut().enumerate() {
            wheel.settle(&guesses[side], &trials[side], ground[side], dt);
            self.current[side] = wheel.motor.current(voltage[side], wheel.motor_speed);
        }
        self.body.travel(velocity, dt);
    }

    /// A step of ideal wheels.
    fn roll(&mut self, dt: f64, rims: [f64; 2]) {
        for (wheel, rim) in self.wheels.iter_mut().zip(rims) {
            wheel.follow(rim, dt);
        }
        self.bus = self.battery.open_circuit();
        self.current = [0.0; 2];
        // u = (v_l + v_r)/2, r = (v_r − v_l)/b
        let forward = 0.5 * (rims[0] + rims[1]);
        let yaw = 0.5 * (rims[1] - rims[0]) / self.body.half_base;
        self.body.travel(
            Velocity {
                forward,
                lateral: 0.0,
                yaw,
            },
            dt,
        );
    }

    /// Where the middle of the axle is, and the heading: x, y \[m\], θ \[rad\], counterclockwise,
    /// not wrapped.
    pub fn pose(&self) -> [f64; 3] {
        self.body.pose
    }

    /// Forward speed \[m/s\] and yaw rate \[rad/s\] of the body.
    pub fn speed(&self) -> (f64, f64) {
        (self.body.velocity.forward, self.body.velocity.yaw)
    }

    /// Speeds of the wheels' rims, R·ω_w \[m/s\]. They differ from the speed over ground by the
    /// slip.
    pub fn wheel_speed(&self) -> [f64; 2] {
        self.wheels
            .each_ref()
            .map(|wheel| wheel.radius * wheel.speed)
    }

    /// Currents of the windings \[A\], positive when they drive forward.
    pub fn current(&self) -> [f64; 2] {
        self.current
    }

    /// Voltages of the bridges' current outputs \[V\].
    pub fn current_signal(&self) -> [f64; 2] {
        self.current
            .map(|current| CURRENT_ZERO + self.current_sensitivity * current)
    }

    /// Voltage of the bus \[V\].
    pub fn bus_voltage(&self) -> f64 {
        self.bus
    }

    /// Counts of the encoders since the start, positive forward. The first reading is 0.
    pub fn counts(&self) -> [i64; 2] {
        [0, 1].map(|side| self.encoders[side].counts(self.wheels[side].angle))
    }

    /// Scales the voltage that one motor gets: 1 for a sound motor, 0 for one without power.
    ///
    /// # Panics
    ///
    /// If `wheel` is neither 0 nor 1.
    pub fn set_strength(&mut self, wheel: usize, strength: f64) {
        self.wheels[wheel].motor.strength = strength;
    }

    /// What a fault leaves of the voltage of one motor: 1 for all of it. It multiplies with the strength.
    ///
    /// # Panics
    ///
    /// If `wheel` is neither 0 nor 1.
    pub fn set_power(&mut self, wheel: usize, power: f64) {
        self.wheels[wheel].motor.power = power;
    }

    /// Replaces the battery's open-circuit voltage \[V\]; None: it is the robot's own again.
    pub fn set_battery(&mut self, voltage: Option<f64>) {
        self.battery.replace(voltage);
    }

    /// Holds one motor, or lets it go. Held, its wheel still moves within the backlash and the tyre
    /// may slide.
    ///
    /// # Panics
    ///
    /// If `wheel` is neither 0 nor 1.
    pub fn set_blocked(&mut self, wheel: usize, blocked: bool) {
        self.wheels[wheel].motor.blocked = blocked;
    }
}

/// A normal variate of standard deviation 1, cut at three: no motor leaves the factory further off.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    // Box–Muller: √(−2·ln(1 − a))·cos(2π·b); 1 − a is never 0
    let (a, b): (f64, f64) = (random.random(), random.random());
    let value = (-2.0 * (1.0 - a).ln()).sqrt() * (std::f64::consts::TAU * b).cos();
    value.clamp(-3.0, 3.0)
}
