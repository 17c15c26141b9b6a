//! The parameters of a robot base, as a TOML file gives them, and the check that they make sense.

use serde::Deserialize;

pub use super::chassis::params::{
    BisteerableParams, Chassis, RearSteering, ServoParams, SynchroParams, TricycleParams,
};

/// Everything the plant needs to know about a robot base, in SI units.
///
/// All quantities of the motors are referred to the wheel's shaft: behind the gearbox.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Physics {
    /// The body: mass, inertia, casters.
    pub body: BodyParams,
    /// The driven wheels.
    pub wheels: WheelsParams,
    /// The gear motors.
    pub motor: MotorParams,
    /// The battery.
    pub battery: BatteryParams,
    /// The H-bridges.
    pub bridge: BridgeParams,
    /// The tyres' grip.
    pub tyre: TyreParams,
    /// The encoders.
    pub encoder: EncoderParams,
    /// Which wheels there are; a differential drive if the file has no such section.
    #[serde(default)]
    pub chassis: Chassis,
}

/// The body. The centre of mass of a differential drive is taken to lie on the wheels' axle, midway
/// between the wheels; those of other chassis say where it is.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyParams {
    /// Mass \[kg\].
    pub mass: f64,
    /// Moment of inertia about the vertical axis through the centre of mass \[kg·m²\].
    pub yaw_inertia: f64,
    /// The part of the weight that the wheels carry, 0..1; the casters carry the rest. With 0 and
    /// no caster friction the robot is jacked up. Chassis that have no casters have 1.
    pub load_share: f64,
    /// Where the casters are, ahead of the axle (negative: behind it) \[m\].
    pub caster_position: f64,
    /// Drag of the casters over their load \[1\].
    pub caster_friction: f64,
}

/// The driven wheels of a differential drive; the left and the right one at the rear of others.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelsParams {
    /// True rolling diameter of the left wheel \[m\].
    pub diameter_left: f64,
    /// True rolling diameter of the right wheel \[m\].
    pub diameter_right: f64,
    /// True distance between the wheels' contact points \[m\].
    pub base: f64,
    /// Moment of inertia of one wheel, any of the robot's, beyond the backlash \[kg·m²\].
    pub inertia: f64,
    /// Rolling resistance over the wheel's load \[1\].
    pub rolling_resistance: f64,
}

/// The gear motors, both alike but for `spread`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotorParams {
    /// Winding resistance, with that of the bridge and the leads \[Ω\].
    pub resistance: f64,
    /// Torque constant and back-EMF constant at the wheel \[N·m/A = V·s/rad\].
    pub torque_constant: f64,
    /// Inertia of rotor and gears at the wheel: the rotor's times the gear ratio squared \[kg·m²\].
    pub inertia: f64,
    /// Viscous friction \[N·m·s/rad\].
    pub viscous: f64,
    /// Coulomb friction when turning \[N·m\].
    pub coulomb: f64,
    /// Friction to be overcome from rest, not below `coulomb` \[N·m\].
    pub stiction: f64,
    /// Speed at which the friction is half way from `stiction` to `coulomb` \[rad/s\].
    pub stribeck_speed: f64,
    /// Total backlash of the gear at the wheel \[rad\].
    pub backlash: f64,
    /// Stiffness of the gear in contact \[N·m/rad\].
    pub gear_stiffness: f64,
    /// Damping of the gear in contact \[N·m·s/rad\].
    pub gear_damping: f64,
    /// Relative standard deviation of torque constant, resistance and dry friction from motor to
    /// motor \[1\].
    pub spread: f64,
}

/// The battery.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatteryParams {
    /// Open-circuit voltage \[V\].
    pub voltage: f64,
    /// Internal resistance \[Ω\].
    pub resistance: f64,
    /// Its voltage over the voltage that the controller's input gets of it \[1\].
    #[serde(default = "usual_divider")]
    pub divider: f64,
}

/// 100 kΩ over 10 kΩ.
fn usual_divider() -> f64 {
    11.0
}

/// The H-bridges.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BridgeParams {
    /// Duty cycle, 0..1, below which nothing reaches the motor \[1\].
    pub dead_band: f64,
    /// Voltage of its current output per current, about 1.65 V \[V/A\].
    pub current_sensitivity: f64,
}

/// The tyres' grip.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TyreParams {
    /// Coefficient of friction between tyre and floor \[1\].
    pub friction: f64,
    /// Force over load per slip ratio, at small slip \[1\].
    pub creep: f64,
    /// Speed added to the reference of the slip ratio, which keeps it finite at rest \[m/s\].
    pub rest_speed: f64,
}

/// The encoders, on the motor's side of the backlash.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderParams {
    /// Counts (edges of both channels) per turn of the wheel \[1\].
    pub counts_per_turn: f64,
}

/// What a parameter must be.
#[derive(Clone, Copy)]
pub(super) enum Must {
    BePositive,
    NotBeNegative,
    NotBeZero,
    BeFinite,
    BeFraction,
    BeBelowOne,
}

impl Must {
    /// Whether a value is that; otherwise a message that begins with its name.
    pub(super) fn check(self, name: &str, value: f64) -> Result<(), String> {
        let (good, wish) = match self {
            Self::BePositive => (value > 0.0, "positive"),
            Self::NotBeNegative => (value >= 0.0, "zero or positive"),
            Self::NotBeZero => (value != 0.0, "other than zero"),
            Self::BeFinite => (true, "finite"),
            Self::BeFraction => ((0.0..=1.0).contains(&value), "from 0 to 1"),
            Self::BeBelowOne => ((0.0..1.0).contains(&value), "from 0 to below 1"),
        };
        if good && value.is_finite() {
            Ok(())
        } else {
            Err(format!("{name} = {value} must be {wish} and finite"))
        }
    }
}

impl Physics {
    /// Whether the parameters describe a possible robot.
    ///
    /// # Errors
    ///
    /// A message that names the first offending parameter as `section.key`.
    pub fn validate(&self) -> Result<(), String> {
        use Must::{BeBelowOne, BeFinite, BeFraction, BePositive, NotBeNegative};
        let (body, wheels, motor) = (&self.body, &self.wheels, &self.motor);
        let parameters = [
            ("body.mass", body.mass, BePositive),
            ("body.yaw_inertia", body.yaw_inertia, BePositive),
            ("body.load_share", body.load_share, BeFraction),
            ("body.caster_position", body.caster_position, BeFinite),
            ("body.caster_friction", body.caster_friction, NotBeNegative),
            ("wheels.diameter_left", wheels.diameter_left, BePositive),
            ("wheels.diameter_right", wheels.diameter_right, BePositive),
            ("wheels.base", wheels.base, BePositive),
            ("wheels.inertia", wheels.inertia, BePositive),
            (
                "wheels.rolling_resistance",
                wheels.rolling_resistance,
                NotBeNegative,
            ),
            ("motor.resistance", motor.resistance, BePositive),
            ("motor.torque_constant", motor.torque_constant, BePositive),
            ("motor.inertia", motor.inertia, BePositive),
            ("motor.viscous", motor.viscous, NotBeNegative),
            ("motor.coulomb", motor.coulomb, NotBeNegative),
            ("motor.stiction", motor.stiction, NotBeNegative),
            ("motor.stribeck_speed", motor.stribeck_speed, BePositive),
            ("motor.backlash", motor.backlash, NotBeNegative),
            ("motor.gear_stiffness", motor.gear_stiffness, BePositive),
            ("motor.gear_damping", motor.gear_damping, NotBeNegative),
            ("motor.spread", motor.spread, NotBeNegative),
            ("battery.voltage", self.battery.voltage, BePositive),
            ("battery.resistance", self.battery.resistance, NotBeNegative),
            ("battery.divider", self.battery.divider, BePositive),
            ("bridge.dead_band", self.bridge.dead_band, BeBelowOne),
            (
                "bridge.current_sensitivity",
                self.bridge.current_sensitivity,
                BePositive,
            ),
            ("tyre.friction", self.tyre.friction, BePositive),
            ("tyre.creep", self.tyre.creep, BePositive),
            ("tyre.rest_speed", self.tyre.rest_speed, BePositive),
            (
                "encoder.counts_per_turn",
                self.encoder.counts_per_turn,
                BePositive,
            ),
        ];
        for (name, value, must) in parameters {
            must.check(name, value)?;
        }
        if motor.stiction < motor.coulomb {
            return Err(format!(
                "motor.stiction = {} must not be below motor.coulomb = {}",
                motor.stiction, motor.coulomb
            ));
        }
        // A motor that is off by three standard deviations must still have a positive resistance.
        if motor.spread > 0.2 {
            return Err(format!(
                "motor.spread = {} must not be above 0.2",
                motor.spread
            ));
        }
        self.chassis.validate(wheels)
    }
}

#[cfg(test)]
mod tests {
    use super::super::robots;

    #[test]
    fn the_robots_are_valid() {
        for physics in [robots::default(), robots::uncalibrated(), robots::robuter()] {
            assert_eq!(physics.validate(), Ok(()));
        }
    }

    #[test]
    fn a_bad_value_is_named() {
        for (value, good) in [
            (f64::NAN, false),
            (f64::INFINITY, false),
            (0.0, false),
            (-1.0, false),
            (1.0, true),
        ] {
            let mut physics = robots::default();
            physics.wheels.base = value;
            let answer = physics.validate();
            assert_eq!(answer.is_ok(), good, "{value}");
            assert!(good || answer.unwrap_err().starts_with("wheels.base = "));
        }
        let mut physics = robots::default();
        physics.motor.stiction = 0.01;
        assert!(
            physics
                .validate()
                .unwrap_err()
                .starts_with("motor.stiction = ")
        );
        physics = robots::default();
        physics.bridge.dead_band = 1.0;
        assert!(
            physics
                .validate()
                .unwrap_err()
                .starts_with("bridge.dead_band = ")
        );
    }

    #[test]
    fn an_unknown_key_is_refused() {
        let text = format!("{}\nphase = 0.5\n", robots::DEFAULT);
        assert!(toml::from_str::<super::Physics>(&text).is_err());
    }
}
