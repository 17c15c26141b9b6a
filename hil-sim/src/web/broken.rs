//! What can be wrong with a simulated base, and what is.

use hil_sim::faults::{EncoderFault, Fault, MotorFault, Side};
use hil_sim::robot::{Drives, Model, Robot};
use vehicle_controller::vehicle::Kind;

/// What this robot can have broken, each with numbers to begin with.
pub fn possible(robot: &Robot) -> Vec<Fault> {
    // The other motor of a tricycle is not connected.
    let sides: &[Side] = if robot.params.vehicle() == Kind::Tricycle {
        &[Side::Left]
    } else {
        &[Side::Left, Side::Right, Side::Both]
    };
    let encoder = [
        EncoderFault::Stuck,
        EncoderFault::OpenA,
        EncoderFault::OpenB,
        EncoderFault::Swapped,
        EncoderFault::Scale(1.1),
        EncoderFault::Drop(0.05),
        EncoderFault::Jump(500),
    ];
    let motor = [MotorFault::Open, MotorFault::Short, MotorFault::Weak(0.5)];
    let dynamic = robot.model == Model::Dynamic;
    let mut faults = Vec::new();
    for side in sides {
        faults.extend(encoder.map(|fault| Fault::Encoder(*side, fault)));
        if dynamic {
            faults.extend(motor.map(|fault| Fault::Motor(*side, fault)));
        }
        if robot.drives != Drives::Bridge {
            faults.push(Fault::Controller(*side));
        }
    }
    if dynamic {
        let low = robot.physics.battery.voltage * 0.7;
        faults.push(Fault::Battery((low * 10.0).round() / 10.0));
    }
    faults.extend([Fault::LinkCut, Fault::FlashCut(20)]);
    faults
}

/// What is wrong at the moment: of each part the last thing that was done to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Broken {
    encoders: [Option<EncoderFault>; 2],
    motors: [Option<MotorFault>; 2],
    controllers: [bool; 2],
    battery: Option<f64>,
    link: bool,
    flash: Option<u64>,
}

impl Broken {
    /// A fault begins.
    pub fn note(&mut self, fault: Fault) {
        match fault {
            Fault::Encoder(side, fault) => {
                // A jump is over at once.
                let lasting = (!matches!(fault, EncoderFault::Jump(_))).then_some(fault);
                side.wheels()
                    .for_each(|wheel| self.encoders[wheel] = lasting);
            }
            Fault::Motor(side, fault) => {
                side.wheels()
                    .for_each(|wheel| self.motors[wheel] = Some(fault));
            }
            Fault::Controller(side) => {
                side.wheels()
                    .for_each(|wheel| self.controllers[wheel] = true);
            }
            Fault::Battery(volts) => self.battery = Some(volts),
            Fault::LinkCut => self.link = true,
            Fault::FlashCut(byte) => self.flash = Some(byte),
        }
    }

    /// All that can be mended is; whether the line was cut.
    pub fn clear(&mut self) -> bool {
        let cut = self.link;
        *self = Self {
            flash: self.flash,
            ..Self::default()
        };
        cut
    }

    /// The board has started anew: if power was to fail in a save, it has, or it did before.
    pub fn restarted(&mut self) {
        self.flash = None;
    }

    /// What is wrong, in the words that a script has for it.
    pub fn list(&self) -> Vec<String> {
        let dead = self.controllers.map(|dead| dead.then_some(()));
        let mut faults = of_sides(self.encoders, Fault::Encoder);
        faults.extend(of_sides(self.motors, Fault::Motor));
        faults.extend(of_sides(dead, |side, ()| Fault::Controller(side)));
        faults.extend(self.battery.map(Fault::Battery));
        faults.extend(self.link.then_some(Fault::LinkCut));
        faults.extend(self.flash.map(Fault::FlashCut));
        faults.iter().map(Fault::to_string).collect()
    }
}

fn of_sides<F: Copy + PartialEq>(
    faults: [Option<F>; 2],
    named: impl Fn(Side, F) -> Fault,
) -> Vec<Fault> {
    match faults {
        [Some(left), Some(right)] if left == right => vec![named(Side::Both, left)],
        [left, right] => {
            let left = left.map(|fault| named(Side::Left, fault));
            let right = right.map(|fault| named(Side::Right, fault));
            left.into_iter().chain(right).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hil_sim::base::Base;
    use hil_sim::rig::Rig;

    fn broken(faults: &[&str]) -> Broken {
        let mut broken = Broken::default();
        for fault in faults {
            let words: Vec<&str> = fault.split(' ').collect();
            broken.note(Fault::parse(&words).unwrap());
        }
        broken
    }

    #[test]
    fn a_fault_replaces_the_one_of_the_same_part() {
        let list = |faults: &[&str]| broken(faults).list();
        assert_eq!(
            list(&["left motor weak 0.5", "right encoder stuck"]),
            ["right encoder stuck", "left motor weak 0.5"]
        );
        assert_eq!(
            list(&["both motor open", "left motor short"]),
            ["left motor short", "right motor open"]
        );
        assert_eq!(
            list(&["left motor open", "right motor open"]),
            ["both motor open"]
        );
        assert!(list(&["left encoder stuck", "left encoder jump 5"]).is_empty());
        assert_eq!(list(&["battery 8", "battery 9"]), ["battery 9"]);
        assert_eq!(list(&["left controller dead"]), ["left controller dead"]);
    }

    #[test]
    fn clearing_mends_all_but_a_power_cut_to_come() {
        let mut broken = broken(&["link cut", "flash cut 20", "both encoder stuck"]);
        assert!(broken.clear());
        assert!(!broken.clear());
        assert_eq!(broken.list(), ["flash cut 20"]);
        broken.restarted();
        assert!(broken.list().is_empty());
    }

    /// Each robot takes all that it is said to be able to have.
    #[test]
    fn what_is_possible_can_be_done() {
        for name in Robot::presets() {
            let robot = Robot::load(name).unwrap();
            let mut base = Rig::new(&robot, 1).unwrap();
            let faults = possible(&robot);
            assert!(faults.len() > 8, "{name}");
            for fault in faults {
                Base::inject(&mut base, fault).unwrap();
            }
        }
    }
}
