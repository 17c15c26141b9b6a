//! The parameters of the chassis, `[physics.chassis]` of a robot's file. All places are measured
//! from the middle of the rear axle.

use serde::Deserialize;

use super::super::params::{Must, WheelsParams};

/// What stands on which wheels.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Chassis {
    /// Two wheels, each with its motor, and casters. Nothing more is to be said of it.
    #[default]
    Differential,
    /// Three wheels that point the same way: the first motor drives all, the second one steers all.
    Synchro(SynchroParams),
    /// A front wheel, driven by the first motor and steered by a servo, and two free rear wheels.
    Tricycle(TricycleParams),
    /// Four wheels: the two motors drive the rear ones; a servo steers the front axle, and the rear
    /// one with it.
    Bisteerable(BisteerableParams),
}

/// A synchro drive. Its wheels stand at the corners of an equilateral triangle about the centre of
/// mass, one in front; the left and the right one are those of `[physics.wheels]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SynchroParams {
    /// True rolling diameter of the front wheel \[m\].
    pub front_diameter: f64,
    /// By which the front, the left and the right wheel point to the left of the heading \[rad\].
    #[serde(default)]
    pub misalignment: [f64; 3],
    /// Moment of inertia of what is steered, beyond the backlash \[kg·m²\].
    pub steering_inertia: f64,
    /// Torque that the wheels oppose to being turned where they stand, all together \[N·m\].
    pub steering_friction: f64,
    /// Gear ratio from the steering's motor to the heading over that from the drive's motor, which
    /// is alike, to the wheels \[1\].
    #[serde(default = "one")]
    pub steer_gear: f64,
    /// Counts of the steering's encoder per turn of the heading \[1\].
    pub steer_counts_per_turn: f64,
    /// What a rate of the heading is multiplied by where the speed of the second wheel's rim is
    /// told or asked for \[m\].
    pub steer_lever: f64,
}

/// A tricycle. `[physics.wheels]` has the rear wheels; its reference point is midway between them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TricycleParams {
    /// True distance from the rear axle to where the front wheel touches \[m\].
    pub wheel_base: f64,
    /// True rolling diameter of the front wheel \[m\].
    pub front_diameter: f64,
    /// Centre of mass ahead of the rear axle \[m\].
    pub centre_of_mass: f64,
    /// The steering servo.
    #[serde(flatten)]
    pub servo: ServoParams,
}

/// A car whose axles are both steered, or only the front one. `[physics.wheels]` has the driven
/// rear wheels, with the rear track as their base.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BisteerableParams {
    /// How the rear axle is steered.
    pub rear: RearSteering,
    /// True distance between the axles \[m\].
    pub wheel_base: f64,
    /// True distance between the front wheels' contact points \[m\].
    pub front_track: f64,
    /// True rolling diameter of the left front wheel \[m\].
    pub front_diameter_left: f64,
    /// True rolling diameter of the right front wheel \[m\].
    pub front_diameter_right: f64,
    /// Centre of mass ahead of the rear axle \[m\].
    pub centre_of_mass: f64,
    /// The steering servo.
    #[serde(flatten)]
    pub servo: ServoParams,
}

/// What the rear axle does when the front one is at an angle φ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RearSteering {
    /// It is at −φ, as the Cycab's: the middle of the car moves along the heading, and is the
    /// reference point.
    Opposite,
    /// It stays straight: the reference point is midway between the rear wheels.
    Fixed,
}

/// A steering servo with its sensors.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ServoParams {
    /// Largest angle to either side, as the servo has it \[rad\].
    pub steer_max: f64,
    /// Fastest rate \[rad/s\].
    pub steer_rate: f64,
    /// Time constant with which a small difference goes away \[s\].
    pub steer_lag: f64,
    /// Width of the pulse for straight ahead \[s\].
    #[serde(default = "usual_pulse")]
    pub pulse_centre: f64,
    /// Width of the pulse per angle; negative for a servo that turns the other way \[s/rad\].
    pub pulse_per_radian: f64,
    /// Voltage of the potentiometer for straight ahead \[V\].
    #[serde(default = "usual_centre")]
    pub pot_centre: f64,
    /// Voltage of the potentiometer per angle \[V/rad\].
    pub pot_per_radian: f64,
    /// Standard deviation of the noise on that voltage \[V\].
    #[serde(default)]
    pub pot_noise: f64,
    /// Counts of the steering's encoder per turn of the steering \[1\].
    pub steer_counts_per_turn: f64,
    /// Where the wheel, or the front axle, truly points when servo and sensors say straight ahead
    /// \[rad\].
    #[serde(default)]
    pub steer_offset: f64,
}

fn one() -> f64 {
    1.0
}

/// Servos' pulses are 1 ms to 2 ms wide.
fn usual_pulse() -> f64 {
    0.0015
}

/// Half of 3.3 V.
fn usual_centre() -> f64 {
    1.65
}

impl Chassis {
    /// Whether the parameters describe a possible chassis on these wheels.
    ///
    /// # Errors
    ///
    /// A message that begins with the first offending parameter as `chassis.key`.
    pub(in super::super) fn validate(&self, wheels: &WheelsParams) -> Result<(), String> {
        match self {
            Self::Differential => Ok(()),
            Self::Synchro(synchro) => synchro.validate(),
            Self::Tricycle(tricycle) => {
                all(&[
                    ("wheel_base", tricycle.wheel_base, Must::BePositive),
                    ("front_diameter", tricycle.front_diameter, Must::BePositive),
                ])?;
                between_axles(tricycle.centre_of_mass, tricycle.wheel_base)?;
                tricycle.servo.validate()
            }
            Self::Bisteerable(car) => car.validate(wheels),
        }
    }
}

impl SynchroParams {
    fn validate(&self) -> Result<(), String> {
        let [front, left, right] = self.misalignment;
        all(&[
            ("front_diameter", self.front_diameter, Must::BePositive),
            ("misalignment", front, Must::BeFinite),
            ("misalignment", left, Must::BeFinite),
            ("misalignment", right, Must::BeFinite),
            ("steering_inertia", self.steering_inertia, Must::BePositive),
            (
                "steering_friction",
                self.steering_friction,
                Must::NotBeNegative,
            ),
            ("steer_gear", self.steer_gear, Must::BePositive),
            (
                "steer_counts_per_turn",
                self.steer_counts_per_turn,
                Must::BePositive,
            ),
            ("steer_lever", self.steer_lever, Must::BePositive),
        ])
    }
}

impl BisteerableParams {
    fn validate(&self, wheels: &WheelsParams) -> Result<(), String> {
        let (left, right) = (self.front_diameter_left, self.front_diameter_right);
        all(&[
            ("wheel_base", self.wheel_base, Must::BePositive),
            ("front_track", self.front_track, Must::BePositive),
            ("front_diameter_left", left, Must::BePositive),
            ("front_diameter_right", right, Must::BePositive),
        ])?;
        between_axles(self.centre_of_mass, self.wheel_base)?;
        self.servo.validate()?;
        // The wheels' common centre must stay outside of the car, 1/k = L/(tan φ_f − tan φ_r) from
        // its axis; an axle's centre cannot be steered by a right angle.
        let angle = self.servo.steer_max + self.servo.steer_offset.abs();
        let axles = match self.rear {
            RearSteering::Opposite => 2.0,
            RearSteering::Fixed => 1.0,
        };
        let half_track = 0.5 * self.front_track.max(wheels.base);
        if angle >= std::f64::consts::FRAC_PI_2
            || self.wheel_base <= half_track * axles * angle.tan()
        {
            return Err(format!(
                "chassis.steer_max = {} must leave the centre of the circle outside of the wheels",
                self.servo.steer_max
            ));
        }
        Ok(())
    }
}

impl ServoParams {
    fn validate(&self) -> Result<(), String> {
        all(&[
            ("steer_max", self.steer_max, Must::BePositive),
            ("steer_rate", self.steer_rate, Must::BePositive),
            ("steer_lag", self.steer_lag, Must::NotBeNegative),
            ("pulse_centre", self.pulse_centre, Must::BePositive),
            ("pulse_per_radian", self.pulse_per_radian, Must::NotBeZero),
            ("pot_centre", self.pot_centre, Must::BeFinite),
            ("pot_per_radian", self.pot_per_radian, Must::NotBeZero),
            ("pot_noise", self.pot_noise, Must::NotBeNegative),
            (
                "steer_counts_per_turn",
                self.steer_counts_per_turn,
                Must::BePositive,
            ),
            ("steer_offset", self.steer_offset, Must::BeFinite),
        ])
    }
}

/// Checks parameters of the chassis.
fn all(parameters: &[(&str, f64, Must)]) -> Result<(), String> {
    parameters
        .iter()
        .try_for_each(|(key, value, must)| must.check(&format!("chassis.{key}"), *value))
}

/// No wheel may hang in the air.
fn between_axles(centre_of_mass: f64, wheel_base: f64) -> Result<(), String> {
    if (0.0..=wheel_base).contains(&centre_of_mass) {
        Ok(())
    } else {
        Err(format!(
            "chassis.centre_of_mass = {centre_of_mass} must be between the axles, from 0 to {wheel_base}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::params::Physics;
    use super::super::super::robots;
    use super::*;

    fn car(physics: &mut Physics) -> &mut BisteerableParams {
        match &mut physics.chassis {
            Chassis::Bisteerable(car) => car,
            _ => panic!("it is a car"),
        }
    }

    #[test]
    fn the_robots_are_valid() {
        for physics in robots::all() {
            assert_eq!(physics.validate(), Ok(()));
        }
    }

    #[test]
    fn a_bad_value_is_named() {
        let check = |change: fn(&mut BisteerableParams), name: &str| {
            let mut physics = robots::cycab();
            change(car(&mut physics));
            let error = physics.validate().unwrap_err();
            assert!(error.starts_with(&format!("chassis.{name} = ")), "{error}");
        };
        check(|car| car.wheel_base = 0.0, "wheel_base");
        check(|car| car.front_track = f64::NAN, "front_track");
        check(|car| car.centre_of_mass = 1.3, "centre_of_mass");
        check(|car| car.servo.pulse_per_radian = 0.0, "pulse_per_radian");
        check(|car| car.servo.steer_lag = -1.0, "steer_lag");
        // Half a track from the axis: atan(L/B) at two axles.
        check(|car| car.servo.steer_max = 0.79, "steer_max");
        check(|car| car.servo.steer_offset = -0.37, "steer_max");
        check(|car| car.servo.steer_max = 2.0, "steer_max");
        let mut physics = robots::cycab();
        car(&mut physics).servo.steer_max = 0.78;
        assert_eq!(physics.validate(), Ok(()));
    }

    #[test]
    fn an_unknown_key_is_refused_and_a_missing_one_told() {
        let parse = |text: &str| toml::from_str::<Chassis>(text);
        let tricycle = "kind = \"tricycle\"\nwheel_base = 1\nfront_diameter = 0.1\n\
            centre_of_mass = 0.5\nsteer_max = 1.0\nsteer_rate = 1.0\nsteer_lag = 0.0\n\
            pulse_per_radian = 5e-4\npot_per_radian = 1.0\n";
        let whole = format!("{tricycle}steer_counts_per_turn = 4096");
        let Ok(Chassis::Tricycle(parsed)) = parse(&whole) else {
            panic!("{:?}", parse(&whole));
        };
        assert_eq!((parsed.wheel_base, parsed.servo.pot_centre), (1.0, 1.65));
        let error = parse(tricycle).unwrap_err().to_string();
        assert!(error.contains("steer_counts_per_turn"), "{error}");
        let error = parse(&format!("{whole}\ntrack = 0.1")).unwrap_err();
        assert!(error.to_string().contains("track"), "{error}");
        let error = parse("kind = \"hexapod\"").unwrap_err().to_string();
        assert!(error.contains("synchro"), "{error}");
        assert_eq!(parse("kind = \"differential\""), Ok(Chassis::Differential));
    }
}
