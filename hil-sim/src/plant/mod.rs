//! The physics of a robot base with two motors: battery, bridges, motors, gears, tyres, body and
//! encoders. Two wheels and casters, or one of the other chassis.
//!
//! It is written from mechanics alone and shares nothing with the controller: the true wheel
//! diameters and wheel base are parameters here, and may differ from what the controller believes.
//!
//! Each step is semi-implicit: all forces that could make a stiff system (gear, tyre, back-EMF,
//! drag) are taken at the end of the step as dampings and springs, which makes the equations
//! linear. Wheel by wheel the motor's and the wheel's speed are eliminated, a system of three is
//! left for the body. Only the steering servo is no part of that: no force on the wheels moves it. Of itself such a step only takes energy out, so it is stable at any length;
//! 250 µs is meant.

mod balance;
mod battery;
mod body;
mod bridge;
mod chassis;
mod encoder;
mod gear;
mod input;
mod motor;
mod params;
#[cfg(test)]
mod robots;
mod servo;
mod stance;
#[cfg(test)]
mod tests;
mod tyre;
mod wheel;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use battery::{Battery, Consumer};
use body::Body;
use bridge::Bridge;
use chassis::Undercarriage;
use encoder::Encoder;
pub use input::{BridgeInput, Command, Input, Push};
pub use params::{
    BatteryParams, BisteerableParams, BodyParams, BridgeParams, Chassis, EncoderParams,
    MotorParams, Physics, RearSteering, ServoParams, SynchroParams, TricycleParams, TyreParams,
    WheelsParams,
};
use servo::Servo;
use wheel::Wheel;

/// How often the branches of a step may be corrected. Two or three are common when something
/// changes; the rest is for steps in which both wheels start to slide at once.
const MAX_TRIALS: usize = 8;

/// Voltage of the bridges' current outputs at no current \[V\].
pub const CURRENT_ZERO: f64 = 1.65;

/// A robot base in motion. Index 0 is the first motor with its wheel, 1 the second one: left and
/// right of a differential drive and of a car's rear, drive and steering of a synchro drive; a
/// tricycle's second one is not connected.
#[derive(Clone, Debug)]
pub struct Plant {
    battery: Battery,
    bridge: Bridge,
    wheels: [Wheel; 2],
    body: Body,
    undercarriage: Undercarriage,
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
        let sides = chassis::sides(physics);
        let mut encoders = [0, 1].map(|_| Encoder::new(&physics.encoder, 0.0));
        let wheels = [0, 1].map(|i| {
            let side = &sides[i];
            // Always the same draws in the same order, so that no parameter changes what another
            // one gets.
            encoders[i] = Encoder::new(&side.physics.encoder, random.random());
            let place = random.random::<f64>() - 0.5;
            let factors = [(); 3].map(|()| 1.0 + physics.motor.spread * normal(&mut random));
            let mut wheel = Wheel::new(&side.physics, side.diameter, side.load, factors, place);
            wheel.rolling = side.rolling;
            wheel
        });
        let undercarriage = Undercarriage::new(physics, &wheels, &mut random);
        let battery = Battery::new(&physics.battery);
        Self {
            bus: battery.open_circuit(),
            battery,
            bridge: Bridge::new(&physics.bridge),
            wheels,
            body: undercarriage.body(physics),
            undercarriage,
            encoders,
            current: [0.0; 2],
            current_sensitivity: physics.bridge.current_sensitivity,
        }
    }

    /// Moves on by `dt` \[s\] under a constant input.
    pub fn step(&mut self, dt: f64, input: &Input) {
        if let Some(servo) = self.undercarriage.servo_mut() {
            servo.step(input.steering, dt);
        }
        match input.command {
            Command::Bridges(bridges) => self.drive(dt, bridges, input.push),
            Command::Speed(rims) => {
                self.undercarriage
                    .roll(&mut self.body, &mut self.wheels, rims, dt);
                self.bus = self.battery.open_circuit();
                self.current = [0.0; 2];
            }
        }
    }

    /// A step of the real thing.
    #[inline]
    fn drive(&mut self, dt: f64, mut bridges: [BridgeInput; 2], push: Push) {
        if !self.undercarriage.has_second_motor() {
            bridges[1] = BridgeInput::Open;
        }
        let voltage = self.feed(bridges);
        self.undercarriage
            .drive(&mut self.body, &mut self.wheels, voltage, push, dt);
        for ((current, wheel), voltage) in self.current.iter_mut().zip(&self.wheels).zip(voltage) {
            *current = wheel.motor.current(voltage, wheel.motor_speed);
        }
    }

    /// What the bridges let through to the motors \[V\], with the bus as it then is.
    #[inline]
    fn feed(&mut self, bridges: [BridgeInput; 2]) -> [f64; 2] {
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
        [
            left.motor.share() * drive[0] * self.bus,
            right.motor.share() * drive[1] * self.bus,
        ]
    }

    /// Where the reference point is, and the heading: x, y \[m\], θ \[rad\], counterclockwise, not
    /// wrapped.
    ///
    /// The point is the middle of the (rear) axle; the body's centre of a synchro drive, whose
    /// heading is where its wheels point; the middle of a car whose axles are steered against each
    /// other.
    pub fn pose(&self) -> [f64; 3] {
        self.undercarriage.pose(&self.body, &self.wheels)
    }

    /// Speed along the heading \[m/s\] and rate of the heading \[rad/s\].
    pub fn speed(&self) -> (f64, f64) {
        self.undercarriage.speed(&self.body, &self.wheels)
    }

    /// True steering angle \[rad\], to the left: of a tricycle's wheel, of the middle of a car's
    /// front axle, of a synchro drive's wheels from its body's axis; 0 without steering.
    pub fn steering(&self) -> f64 {
        self.undercarriage.steering(&self.wheels)
    }

    /// Voltage of the steering servo's potentiometer \[V\]; 0 without a servo.
    pub fn steering_signal(&self) -> f64 {
        self.undercarriage.servo().map_or(0.0, Servo::signal)
    }

    /// Counts of the encoder on the steering servo since the start, positive to the left; 0 without
    /// a servo.
    pub fn steering_counts(&self) -> i64 {
        self.undercarriage.servo().map_or(0, Servo::counts)
    }

    /// Counts of the encoders on a car's front wheels since the start, positive forward; 0 of
    /// others.
    pub fn front_counts(&self) -> [i64; 2] {
        self.undercarriage.front_counts()
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
