//! One side of the drive: motor, gear, wheel and tyre, reduced to a force that is linear in the
//! speed over ground.

use super::gear::{Contact, Gear, Mesh};
use super::motor::Motor;
use super::params::Physics;
use super::tyre::Tyre;

/// Speed below which the rolling resistance fades \[rad/s\].
const ROLLING_FADE: f64 = 0.02;

/// A driven wheel with its motor.
#[derive(Clone, Debug)]
pub(super) struct Wheel {
    /// The motor.
    pub motor: Motor,
    /// The gear.
    pub gear: Gear,
    /// The tyre.
    pub tyre: Tyre,
    /// R_w \[m\].
    pub radius: f64,
    /// J_w \[kg·m²\].
    pub inertia: f64,
    /// Torque of the rolling resistance \[N·m\].
    pub rolling: f64,
    /// φ_m \[rad\].
    pub angle: f64,
    /// φ_m − φ_w \[rad\].
    pub twist: f64,
    /// ω_m \[rad/s\].
    pub motor_speed: f64,
    /// ω_w \[rad/s\].
    pub speed: f64,
}

/// What the motor's side does in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    /// It stood and stands, as long as the stiction holds.
    Standing,
    /// It ends the step at rest, whatever torque that takes.
    Stopped,
    /// It turns in the direction of this sign.
    Sliding(f64),
}

/// What a step is taken to be like before it is known. Friction and contacts have no derivative;
/// each combination of their branches is linear, and the right one is found by trying.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    contact: Contact,
    motion: Motion,
    /// Grip of the tyre \[N·s/m\].
    pub grip: f64,
}

/// One step of a wheel under a guess: equations that are linear in the ground's speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trial {
    /// A of the force on the body, F = A − B·v_c' \[N\].
    pub force: f64,
    /// B of the force on the body \[N·s/m\].
    pub slope: f64,
    mesh: Mesh,
    /// Inertia that the tyre's force meets on the wheel \[kg·m²\].
    pub own: f64,
    /// ω_w' = wheel_fixed + wheel_rate·v_c'
    pub wheel_fixed: f64,
    wheel_rate: f64,
    /// ω_m' = motor_fixed + motor_rate·ω_w'
    motor_fixed: f64,
    motor_rate: f64,
}

impl Wheel {
    /// A driven wheel at rest, with its tyre under a load \[N\]. The motor's three factors are its
    /// spread; `place`, −½..½, is where in the backlash it stands.
    pub(super) fn new(
        physics: &Physics,
        diameter: f64,
        load: f64,
        factors: [f64; 3],
        place: f64,
    ) -> Self {
        let radius = 0.5 * diameter;
        Self {
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
    }

    /// A wheel that nothing drives: its gear has a gap without end, and the motor behind it stands.
    pub(super) fn free(physics: &Physics, diameter: f64, load: f64) -> Self {
        let mut wheel = Self::new(physics, diameter, load, [1.0; 3], 0.0);
        wheel.gear.half_gap = f64::INFINITY;
        wheel.motor.open = true;
        wheel.motor.blocked = true;
        wheel
    }

    /// Angle by which the wheel itself has turned, beyond the backlash \[rad\].
    #[inline]
    pub(super) fn turned(&self) -> f64 {
        self.angle - self.twist
    }

    /// The first guess for a step of `dt` \[s\], from the state before it; `ground` and `lateral`
    /// are the speeds over ground where the tyre touches \[m/s\].
    #[inline]
    pub(super) fn guess(&self, ground: f64, lateral: f64, dt: f64) -> Guess {
        Guess {
            contact: self
                .gear
                .contact(self.twist + dt * (self.motor_speed - self.speed)),
            motion: if self.motor.blocked {
                Motion::Stopped
            } else if self.motor_speed == 0.0 {
                Motion::Standing
            } else {
                Motion::Sliding(1f64.copysign(self.motor_speed))
            },
            grip: self.tyre.grip(self.radius * self.speed, ground, lateral),
        }
    }

    /// Sets up a step of `dt` \[s\] with a voltage on the motor \[V\] under a guess.
    #[inline]
    pub(super) fn attempt(&self, guess: &Guess, voltage: f64, dt: f64) -> Trial {
        let mesh = self.gear.mesh(guess.contact, self.twist, dt);
        // J_m·ω_m' = J_m·ω_m + dt·(K·(V − K·ω_m')/R − b·ω_m' − s·T_f) − h − g·(ω_m' − ω_w')
        let (motor_fixed, motor_rate, reflected) = if let Motion::Sliding(sign) = guess.motion {
            let own = self.motor.inertia + dt * self.motor.damping();
            let inverse = 1.0 / (own + mesh.rate);
            let torque =
                self.motor.stall_torque(voltage) - sign * self.motor.dry_friction(self.motor_speed);
            let impulse = self.motor.inertia * self.motor_speed + dt * torque - mesh.fixed;
            // g − g²/a_m = g·(a_m − g)/a_m is what the wheel feels of the motor; written so,
            // nothing cancels.
            (
                impulse * inverse,
                mesh.rate * inverse,
                mesh.rate * own * inverse,
            )
        } else {
            (0.0, 0.0, mesh.rate)
        };
        // The rolling resistance as a damping, M_r·ω'/(|ω| + ω_r)
        let rolling = self.rolling / (self.speed.abs() + ROLLING_FADE);
        // J_w·ω_w' = J_w·ω_w + h + g·(ω_m' − ω_w') − dt·M_r' − dt·D·R·(R·ω_w' − v_c'), with ω_m'
        // put in
        let own = self.inertia + dt * rolling + reflected;
        let pull = guess.grip * self.radius;
        let inverse = 1.0 / (own + dt * pull * self.radius);
        let impulse = self.inertia * self.speed + mesh.fixed + mesh.rate * motor_fixed;
        let wheel_fixed = impulse * inverse;
        Trial {
            // F = D·(R·ω_w' − v_c') = D·R·ω_fixed − D·(1 − dt·D·R²/ã)·v_c', where 1 − dt·D·R²/ã =
            // own/ã
            force: pull * wheel_fixed,
            slope: guess.grip * own * inverse,
            mesh,
            own,
            wheel_fixed,
            wheel_rate: dt * pull * inverse,
            motor_fixed,
            motor_rate,
        }
    }

    /// Corrects a guess that the outcome of its trial contradicts; whether it did.
    #[inline]
    pub(super) fn judge(
        &self,
        guess: &mut Guess,
        trial: &Trial,
        voltage: f64,
        (ground, lateral): (f64, f64),
        dt: f64,
    ) -> bool {
        let (motor_speed, wheel_speed) = trial.speeds(ground);
        let mut wrong = false;

        let contact = self
            .gear
            .judge(guess.contact, self.twist, motor_speed - wheel_speed, dt);
        if contact != guess.contact {
            guess.contact = contact;
            wrong = true;
        }

        match guess.motion {
            Motion::Standing => {
                // It holds while |K·V/R − T_gear| ≤ T_s.
                let gear = (trial.mesh.fixed - trial.mesh.rate * wheel_speed) / dt;
                let torque = self.motor.stall_torque(voltage) - gear;
                if torque.abs() > self.motor.dry_friction(0.0) {
                    guess.motion = Motion::Sliding(1f64.copysign(torque));
                    wrong = true;
                }
            }
            // Dry friction can stop the motor, but not turn it back.
            Motion::Sliding(sign) if motor_speed * sign < 0.0 => {
                guess.motion = Motion::Stopped;
                wrong = true;
            }
            Motion::Sliding(_) | Motion::Stopped => {}
        }

        let compliance = dt * self.radius * self.radius / trial.own;
        let rim = self.radius * wheel_speed;
        wrong
            | self
                .tyre
                .judge(&mut guess.grip, rim, (ground, lateral), compliance)
    }

    /// Ends a step: takes over the speeds of a trial and moves on.
    #[inline]
    pub(super) fn settle(&mut self, guess: &Guess, trial: &Trial, ground: f64, dt: f64) {
        let (mut motor_speed, wheel_speed) = trial.speeds(ground);
        if matches!(guess.motion, Motion::Sliding(sign) if motor_speed * sign < 0.0) {
            motor_speed = 0.0;
        }
        self.motor_speed = motor_speed;
        self.speed = flush(wheel_speed);
        // φ' = φ + dt·ω'
        self.angle += dt * motor_speed;
        self.twist += dt * (motor_speed - wheel_speed);
    }

    /// Turns motor and wheel together at a speed of the rim \[m/s\].
    #[inline]
    pub(super) fn follow(&mut self, rim: f64, dt: f64) {
        let omega = rim / self.radius;
        self.motor_speed = omega;
        self.speed = omega;
        self.angle += dt * omega;
    }
}

impl Trial {
    /// The same step with a speed of the wheel that has been found elsewhere \[rad/s\].
    #[inline]
    pub(super) fn turning(mut self, wheel_speed: f64) -> Self {
        (self.wheel_fixed, self.wheel_rate) = (wheel_speed, 0.0);
        self
    }

    /// ω_m' and ω_w' for a speed over ground \[rad/s\].
    #[inline]
    fn speeds(&self, ground: f64) -> (f64, f64) {
        let wheel_speed = self.wheel_fixed + self.wheel_rate * ground;
        (
            self.motor_fixed + self.motor_rate * wheel_speed,
            wheel_speed,
        )
    }
}

/// Zero for what is below anything real \[any\]. Speeds that die out by a factor per step would
/// come to lie among the subnormal numbers, on which processors are slow.
#[inline]
pub(super) fn flush(speed: f64) -> f64 {
    if speed.abs() < 1e-30 { 0.0 } else { speed }
}
