//! A motor controller of somebody else's, between the board and a motor, seen from outside: it takes speeds or position increments in its own units, and
//! closes the loop itself.
//!
//! It has its own lines to the motor's encoder and to the bridge. Of what is wrong between the encoder and the board it knows nothing, and the board
//! nothing of what it does.

use crate::peripherals::{ControllerWires, Order};
use crate::plant::BridgeInput;
use serde::Deserialize;

/// What a motor controller was set up with: `[controller]` of a robot's file. A unit is a count of the encoder, or so many of them.
///
/// ```text
///     v = v_target + position_gain (target − position)
///     duty = (v + speed_gain (v − v_measured) + integral_gain ∫ (v − v_measured) dt) / top_speed
/// ```
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerParams {
    /// What the board believes of it: units while a motor's circumference rolls a metre, of the first and of the second motor \[1/m\].
    pub units_per_metre: [f64; 2],
    /// Its electronic gear: counts of the encoder for each unit \[1\].
    #[serde(default = "one")]
    pub counts_per_unit: f64,
    /// How often it acts \[s\].
    #[serde(default = "millisecond")]
    pub period: f64,
    /// After so long a silence it shorts its motor \[s\].
    pub timeout: f64,
    /// Bandwidth of its speed observers \[rad/s\].
    pub bandwidth: f64,
    /// What it takes full duty to be worth \[units/s\].
    pub top_speed: f64,
    /// \[1\]
    pub speed_gain: f64,
    /// \[1/s\]
    pub integral_gain: f64,
    /// \[1/s\]; of no matter to one that takes speeds.
    pub position_gain: f64,
    /// A position that is off by no more than this is right \[units\].
    #[serde(default)]
    pub dead_zone: f64,
}

fn one() -> f64 {
    1.0
}

fn millisecond() -> f64 {
    1e-3
}

impl ControllerParams {
    /// Whether the parameters describe a possible motor controller.
    ///
    /// # Errors
    /// A message that begins with the name of the first that does not.
    pub fn validate(&self) -> Result<(), String> {
        let [first, second] = self.units_per_metre;
        // The rest of what could be wrong a motor controller may be: one with gains of 0 does nothing.
        for (name, value, is_positive) in [
            ("units_per_metre", first.min(second), true),
            ("counts_per_unit", self.counts_per_unit, true),
            ("period", self.period, true),
            ("timeout", self.timeout, true),
            ("bandwidth", self.bandwidth, true),
            ("top_speed", self.top_speed, true),
            ("speed_gain", self.speed_gain, false),
            ("integral_gain", self.integral_gain, false),
            ("position_gain", self.position_gain, false),
            ("dead_zone", self.dead_zone, false),
        ] {
            let good = if is_positive {
                value > 0.0
            } else {
                value >= 0.0
            };
            if !good || !value.is_finite() {
                let wish = if is_positive {
                    "positive"
                } else {
                    "zero or positive"
                };
                return Err(format!("{name} = {value} must be {wish} and finite"));
            }
        }
        // An explicit observer with its poles at −ω is stable up to ωT = 2, and of use far below.
        if self.bandwidth * self.period > 0.5 {
            return Err(format!(
                "bandwidth = {} must not be above half a radian in its period",
                self.bandwidth
            ));
        }
        Ok(())
    }
}

/// Position and speed, from a position in steps: critically damped, without a lag at a constant speed.
///
/// ```text
///     x += (v + 2ω (x_measured − x)) T      v += ω² (x_measured − x) T
/// ```
#[derive(Clone, Copy, Debug, Default)]
struct Tracker {
    position: f64,
    speed: f64,
}

impl Tracker {
    fn at_rest(position: f64) -> Self {
        Self {
            position,
            speed: 0.0,
        }
    }

    fn follow(&mut self, position: f64, bandwidth: f64, dt: f64) {
        let error = position - self.position;
        self.position += (self.speed + 2.0 * bandwidth * error) * dt;
        self.speed += bandwidth * bandwidth * error * dt;
    }
}

/// What it does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    /// Nothing: the motor has no supply. Shorted, it brakes.
    Idle { shorted: bool },
    /// It keeps a speed, units/s.
    Speed(f64),
    /// It follows a target, units.
    Position(i64),
}

/// A motor controller.
#[derive(Clone, Debug)]
pub struct MotorController {
    params: ControllerParams,
    mode: Mode,
    /// Of the motor, units; of the target.
    motor: Tracker,
    target: Tracker,
    /// ∫ (v − v_measured) dt, units.
    integral: f64,
    output: BridgeInput,
    /// Until it acts again, s.
    due: f64,
    /// Since the last order, s.
    silence: f64,
    is_dead: bool,
}

impl MotorController {
    /// One that has just been powered up, its motor off.
    pub fn new(params: &ControllerParams) -> Self {
        Self {
            params: params.clone(),
            mode: Mode::Idle { shorted: false },
            motor: Tracker::default(),
            target: Tracker::default(),
            integral: 0.0,
            output: BridgeInput::Open,
            due: 0.0,
            silence: 0.0,
            is_dead: false,
        }
    }

    /// What it tells its bridge.
    pub fn output(&self) -> BridgeInput {
        self.output
    }

    /// From here on it takes its orders and does nothing, or it is well again.
    pub fn set_dead(&mut self, is_dead: bool) {
        self.is_dead = is_dead;
        if is_dead {
            self.rest(false);
        }
    }

    /// Takes what has arrived. To switch off waits for nothing.
    pub fn listen(&mut self, wires: &ControllerWires, counts: i64) {
        let Some((order, units)) = wires.take() else {
            return;
        };
        self.silence = 0.0;
        if self.is_dead {
            return;
        }
        match order {
            Order::Off => self.rest(false),
            Order::Brake => self.rest(true),
            Order::Speed(speed) => {
                self.wake(counts);
                self.mode = Mode::Speed(f64::from(speed));
            }
            Order::Advance => {
                self.wake(counts);
                let from = match self.mode {
                    Mode::Position(target) => target,
                    _ => self.units(counts).round() as i64,
                };
                self.mode = Mode::Position(from + units);
            }
        }
    }

    /// Time passes, s; its encoder is at this count. What it tells its bridge.
    pub fn step(&mut self, counts: i64, dt: f64) -> BridgeInput {
        self.silence += dt;
        self.due -= dt;
        // Half a step: the sums of steps round.
        if self.due < 0.5 * dt {
            self.due += self.params.period;
            self.act(counts);
        }
        self.output
    }

    fn units(&self, counts: i64) -> f64 {
        counts as f64 / self.params.counts_per_unit
    }

    /// The motor gets the supply again, where it is.
    fn wake(&mut self, counts: i64) {
        if matches!(self.mode, Mode::Idle { .. }) {
            self.target = Tracker::at_rest(self.units(counts).round());
            self.integral = 0.0;
        }
    }

    fn rest(&mut self, shorted: bool) {
        self.mode = Mode::Idle { shorted };
        self.output = if shorted {
            BridgeInput::Duty(0.0)
        } else {
            BridgeInput::Open
        };
    }

    fn act(&mut self, counts: i64) {
        let params = &self.params;
        let (bandwidth, dt) = (params.bandwidth, params.period);
        self.motor
            .follow(counts as f64 / params.counts_per_unit, bandwidth, dt);
        let speed = match self.mode {
            Mode::Idle { .. } => return,
            _ if self.silence > params.timeout => return self.rest(true),
            Mode::Speed(speed) => speed,
            Mode::Position(target) => {
                self.target.follow(target as f64, bandwidth, dt);
                let error = self.target.position - self.motor.position;
                if error.abs() <= params.dead_zone {
                    self.target.speed
                } else {
                    self.target.speed + params.position_gain * error
                }
            }
        };
        let error = speed - self.motor.speed;
        let wanted = speed + params.speed_gain * error + params.integral_gain * self.integral;
        let duty = wanted / params.top_speed;
        // What is saturated already is not wound up.
        if duty.abs() < 1.0 || duty * error < 0.0 {
            self.integral += error * dt;
        }
        self.output = BridgeInput::Duty(duty.clamp(-1.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::{ControllerLine, Wires};
    use std::rc::Rc;
    use vehicle_controller::vehicle::{IncrementOutput, SpeedOutput};

    const DT: f64 = 250e-6;

    fn params() -> ControllerParams {
        ControllerParams {
            units_per_metre: [1000.0; 2],
            counts_per_unit: 2.0,
            period: 1e-3,
            timeout: 0.1,
            bandwidth: 100.0,
            top_speed: 1000.0,
            speed_gain: 2.0,
            integral_gain: 10.0,
            position_gain: 20.0,
            dead_zone: 0.0,
        }
    }

    fn controller() -> (MotorController, Rc<Wires>, ControllerLine) {
        let wires = Rc::new(Wires::default());
        let line = ControllerLine::new(Rc::clone(&wires), 1000.0);
        (MotorController::new(&params()), wires, line)
    }

    /// A motor that follows its duty with a time constant of 50 ms and 1000 units/s at full duty: where it is after some seconds of orders, units.
    fn run(
        controller: &mut MotorController,
        wires: &Wires,
        (mut position, mut speed): (f64, f64),
        seconds: f64,
        mut order: impl FnMut(u32),
    ) -> (f64, f64) {
        for k in 0..(seconds * 1e3).round() as u32 {
            order(k);
            let counts = |position: f64| (2.0 * position).floor() as i64;
            controller.listen(&wires.controller, counts(position));
            for _ in 0..4 {
                let wanted = match controller.step(counts(position), DT) {
                    BridgeInput::Duty(duty) => 1000.0 * duty,
                    // Free: it runs on.
                    BridgeInput::Open => speed,
                };
                speed += (wanted - speed) * DT / 0.05;
                position += speed * DT;
            }
        }
        (position, speed)
    }

    #[test]
    fn increments_are_followed_and_end_where_they_add_up_to() {
        let (mut controller, wires, mut line) = controller();
        // 100 units from where it stands, which is not where it was switched on.
        let after = run(&mut controller, &wires, (37.0, 0.0), 1.0, |k| {
            line.advance(i32::from(k < 100)).unwrap();
        });
        // A count is half a unit.
        assert!((after.0 - 137.0).abs() < 1.0, "{after:?}");
    }

    #[test]
    fn a_speed_is_kept_and_silence_stops_it() {
        let (mut controller, wires, mut line) = controller();
        let driven = run(&mut controller, &wires, (0.0, 0.0), 2.0, |_| {
            line.set_speed(0.3).unwrap();
        });
        // 0.3 m/s are 300 units/s; the counts make the observed speed flicker by some per cent.
        assert!((driven.1 - 300.0).abs() < 6.0, "{driven:?}");
        // 0.1 s at that speed, and then a twentieth of a second's worth to run out.
        let stopped = run(&mut controller, &wires, driven, 1.0, |_| {});
        assert_eq!(controller.output(), BridgeInput::Duty(0.0));
        let gone = stopped.0 - driven.0;
        assert!((gone - 45.0).abs() < 3.0, "{gone}");
    }

    #[test]
    fn what_is_off_is_free_at_once_and_begins_anew_where_it_is() {
        let (mut controller, wires, mut line) = controller();
        let there = run(&mut controller, &wires, (0.0, 0.0), 0.5, |_| {
            line.advance(1).unwrap();
        });
        IncrementOutput::off(&mut line).unwrap();
        controller.listen(&wires.controller, 0);
        assert_eq!(controller.output(), BridgeInput::Open);
        IncrementOutput::brake(&mut line).unwrap();
        controller.listen(&wires.controller, 0);
        assert_eq!(controller.output(), BridgeInput::Duty(0.0));
        // Carried 200 units back, it stays there.
        let carried = (there.0 - 200.0, 0.0);
        let settled = run(&mut controller, &wires, carried, 0.2, |_| {
            IncrementOutput::off(&mut line).unwrap();
        });
        let mut at = settled;
        for _ in 0..25 {
            at = run(&mut controller, &wires, at, 0.02, |_| {
                line.advance(0).unwrap();
            });
            assert!((at.0 - carried.0).abs() < 1.0, "{at:?}");
        }
    }

    #[test]
    fn a_dead_one_does_nothing() {
        let (mut controller, wires, mut line) = controller();
        controller.set_dead(true);
        let after = run(&mut controller, &wires, (0.0, 0.0), 0.5, |_| {
            line.advance(1).unwrap();
        });
        assert_eq!(
            (after, controller.output()),
            ((0.0, 0.0), BridgeInput::Open)
        );
    }

    #[test]
    fn a_bad_value_is_named() {
        assert_eq!(params().validate(), Ok(()));
        let bad = |change: fn(&mut ControllerParams)| {
            let mut params = params();
            change(&mut params);
            params.validate().unwrap_err()
        };
        assert!(bad(|p| p.units_per_metre[1] = 0.0).starts_with("units_per_metre = 0 "));
        assert!(bad(|p| p.timeout = f64::NAN).starts_with("timeout = NaN "));
        assert!(bad(|p| p.dead_zone = -1.0).starts_with("dead_zone = -1 "));
        assert!(bad(|p| p.bandwidth = 600.0).starts_with("bandwidth = 600 "));
    }
}
