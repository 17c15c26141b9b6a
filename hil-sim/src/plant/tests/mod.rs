//! The plant as a whole against closed forms.

mod drive;
mod floor;
mod robust;
mod steered;
mod synchro;
mod traction;

use super::{Command, Input, Physics, Plant, Push, robots};

/// The step that the simulator uses \[s\].
const DT: f64 = 250e-6;

/// Nothing from outside.
const NO_PUSH: Push = Push {
    force: 0.0,
    torque: 0.0,
};

/// Duty cycles and nothing else.
fn duty(left: f64, right: f64) -> Input {
    Input {
        command: Command::duty([left, right]),
        push: NO_PUSH,
        steering: None,
    }
}

/// A force on shorted motors.
fn force(newtons: f64) -> Input {
    Input {
        command: Command::duty([0.0; 2]),
        push: Push {
            force: newtons,
            torque: 0.0,
        },
        steering: None,
    }
}

impl Plant {
    /// Runs with a constant input for a number of seconds.
    fn run(&mut self, seconds: f64, input: &Input) {
        for _ in 0..(seconds / DT).round() as u64 {
            self.step(DT, input);
        }
    }

    /// Speeds of motors and wheels as if the base rolled at this speed without slip \[m/s\].
    fn rolling(&mut self, speed: f64) {
        self.body.velocity.forward = speed;
        for wheel in &mut self.wheels {
            wheel.speed = speed / wheel.radius;
            wheel.motor_speed = wheel.speed;
        }
    }

    /// Kinetic energy and the energy in the gears' springs \[J\].
    fn energy(&mut self) -> f64 {
        let (body, v) = (&self.body, self.body.velocity);
        let mut energy = body.mass * (v.forward * v.forward + v.lateral * v.lateral)
            + body.yaw_inertia * v.yaw * v.yaw;
        for wheel in self.wheels.iter().chain(&*self.undercarriage.free_wheels()) {
            let overlap = wheel
                .gear
                .excess(wheel.gear.contact(wheel.twist), wheel.twist);
            energy += wheel.motor.inertia * wheel.motor_speed * wheel.motor_speed
                + wheel.inertia * wheel.speed * wheel.speed
                + wheel.gear.stiffness * overlap * overlap;
        }
        0.5 * energy
    }
}
