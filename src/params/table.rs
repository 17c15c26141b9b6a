//! The table of parameters: the one place where a parameter is defined.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// What may happen when a parameter changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Takes effect at once.
    Value,
    /// Takes effect at once; 0 or 1.
    Switch,
    /// Changes what counts or outputs mean: refused while the vehicle moves.
    Geometry,
    /// As [`Kind::Geometry`], 0 or 1.
    Wiring,
}

/// What is known of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// Its name, lower case.
    pub name: &'static str,
    /// Its unit; `-` if it has none.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f32,
    /// Largest value.
    pub max: f32,
    /// Value of a new base.
    pub default: f32,
    /// What a change of it means.
    pub kind: Kind,
}

macro_rules! parameters {
    ($($(#[$doc:meta])* $id:ident $name:literal $unit:literal $min:literal .. $max:literal = $default:literal $kind:ident;)*) => {
        /// A parameter.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum Id {
            $($(#[$doc])* $id,)*
        }

        impl Id {
            /// All parameters, in the order in which they are listed.
            pub const ALL: [Self; Self::COUNT] = [$(Self::$id),*];
            /// How many there are.
            pub const COUNT: usize = [$($name),*].len();

            /// What is known of it.
            #[must_use]
            pub const fn spec(self) -> Spec {
                match self {
                    $(Self::$id => Spec {
                        name: $name,
                        unit: $unit,
                        min: $min,
                        max: $max,
                        default: $default,
                        kind: Kind::$kind,
                    },)*
                }
            }
        }
    };
}

impl Id {
    /// The parameter of that name, in any case.
    #[must_use]
    pub fn find(name: &[u8]) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|id| id.spec().name.as_bytes().eq_ignore_ascii_case(name))
    }

    /// What it is stored under, whatever its place in the table: the CRC-32 of its name.
    #[must_use]
    pub fn key(self) -> u32 {
        KEYS.get(self as usize).copied().unwrap_or_default()
    }

    /// True if a value is one that it can have, whatever the others are.
    #[must_use]
    pub fn allows(self, value: f32) -> bool {
        let spec = self.spec();
        let is_switch = matches!(spec.kind, Kind::Switch | Kind::Wiring);
        (spec.min..=spec.max).contains(&value) && (!is_switch || value == 0.0 || value == 1.0)
    }
}

static KEYS: [u32; Id::COUNT] = {
    let crc = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);
    let mut keys = [0; Id::COUNT];
    let mut at = 0;
    while at < Id::COUNT {
        keys[at] = crc.checksum(Id::ALL[at].spec().name.as_bytes());
        at += 1;
    }
    keys
};

parameters! {
    /// Distance of the wheels' contacts.
    WheelBase "wheel_base" "m" 0.02..5.0 = 0.2 Geometry;
    /// Diameter of the left wheel.
    LeftDiameter "left_diameter" "m" 0.005..2.0 = 0.084 Geometry;
    /// Diameter of the right wheel.
    RightDiameter "right_diameter" "m" 0.005..2.0 = 0.084 Geometry;
    /// Encoder counts per turn of a wheel (all four edges, gear ratio included).
    CountsPerTurn "counts_per_turn" "-" 4.0..1e7 = 2796.8 Geometry;
    /// k_r: true over nominal diameter of the right wheel.
    GainRight "gain_right" "-" 0.8..1.25 = 1.0 Geometry;
    /// k_l: the same of the left wheel.
    GainLeft "gain_left" "-" 0.8..1.25 = 1.0 Geometry;
    /// k_b: true over nominal wheel base.
    GainBase "gain_base" "-" 0.8..1.25 = 1.0 Geometry;
    /// The left encoder counts down when its wheel rolls forward.
    LeftEncoderReversed "left_encoder_reversed" "-" 0.0..1.0 = 0.0 Wiring;
    /// The same of the right one.
    RightEncoderReversed "right_encoder_reversed" "-" 0.0..1.0 = 0.0 Wiring;
    /// The left motor turns backward when its direction pin is high.
    LeftMotorReversed "left_motor_reversed" "-" 0.0..1.0 = 0.0 Wiring;
    /// The same of the right one.
    RightMotorReversed "right_motor_reversed" "-" 0.0..1.0 = 0.0 Wiring;

    /// v of a move that gives none.
    MoveSpeed "move_speed" "m/s" 0.0..20.0 = 0.3 Value;
    /// a of a move that gives none.
    MoveAccel "move_accel" "m/s2" 0.001..50.0 = 0.5 Value;
    /// v of a turn that gives none.
    TurnSpeed "turn_speed" "deg/s" 0.0..3600.0 = 90.0 Value;
    /// a of a turn that gives none.
    TurnAccel "turn_accel" "deg/s2" 0.1..36_000.0 = 180.0 Value;
    /// Deceleration of Stop.
    StopAccel "stop_accel" "m/s2" 0.001..50.0 = 1.0 Value;
    /// Angular deceleration of Stop.
    StopTurnAccel "stop_turn_accel" "deg/s2" 0.1..36_000.0 = 360.0 Value;
    /// The largest v of a move.
    MaxSpeed "max_speed" "m/s" 0.001..20.0 = 0.7 Value;
    /// The largest a of a move.
    MaxAccel "max_accel" "m/s2" 0.001..50.0 = 2.0 Value;
    /// The largest v of a turn.
    MaxTurnSpeed "max_turn_speed" "deg/s" 0.1..3600.0 = 360.0 Value;
    /// The largest a of a turn.
    MaxTurnAccel "max_turn_accel" "deg/s2" 0.1..36_000.0 = 1440.0 Value;
    /// The fastest that a wheel can roll; both axes are scaled alike to stay below it.
    MaxWheelSpeed "max_wheel_speed" "m/s" 0.001..30.0 = 0.75 Value;

    /// κ_S: variance of the distance per distance.
    NoiseS "noise_s" "m2/m" 0.0..0.1 = 5e-6 Value;
    /// κ_drift: variance of the heading per distance.
    NoiseDrift "noise_drift" "deg2/m" 0.0..100.0 = 0.01 Value;
    /// κ_rot: variance of the heading per rotation.
    NoiseRot "noise_rot" "deg2/deg" 0.0..10.0 = 0.015 Value;
    /// K_drift: prior variance of the wheels' imbalance, as heading per distance.
    KDrift "k_drift" "deg2/m2" 0.0..100.0 = 0.04 Value;
    /// K_rot: prior variance of the rotation's scale.
    KRot "k_rot" "-" 0.0..0.01 = 2e-4 Value;
    /// K_scale: prior variance of what the gains of both wheels have in common.
    KScale "k_scale" "-" 0.0..0.01 = 5e-5 Value;
    /// The lower triangular root of the gains' covariance, as it was learned (right, left, base); all 0: the prior.
    SpreadRr "spread_rr" "-" -1.0..1.0 = 0.0 Value;
    /// The next element, by rows.
    SpreadLr "spread_lr" "-" -1.0..1.0 = 0.0 Value;
    /// The next one.
    SpreadLl "spread_ll" "-" -1.0..1.0 = 0.0 Value;
    /// The next one.
    SpreadBr "spread_br" "-" -1.0..1.0 = 0.0 Value;
    /// The next one.
    SpreadBl "spread_bl" "-" -1.0..1.0 = 0.0 Value;
    /// The last one.
    SpreadBb "spread_bb" "-" -1.0..1.0 = 0.0 Value;
    /// Largest squared Mahalanobis distance of an observation; 0: any.
    Gate "gate" "-" 0.0..1e6 = 25.0 Value;

    /// Position gain of the translation.
    MoveGain "move_gain" "1/s" 0.0..100.0 = 8.0 Value;
    /// Position gain of the rotation.
    TurnGain "turn_gain" "1/s" 0.0..100.0 = 10.0 Value;
    /// Following error beyond which the translation's reference waits.
    MoveLag "move_lag" "m" 1e-4..1.0 = 0.006 Value;
    /// Following error beyond which the rotation's reference waits.
    TurnLag "turn_lag" "deg" 0.01..90.0 = 4.0 Value;
    /// A move is done when the error is below this.
    MoveTolerance "move_tolerance" "m" 1e-6..0.1 = 0.001 Value;
    /// A turn is done when the error is below this.
    TurnTolerance "turn_tolerance" "deg" 1e-4..10.0 = 0.2 Value;
    /// Bandwidth of the wheel speed observers.
    ObserverBandwidth "observer_bandwidth" "Hz" 0.5..200.0 = 30.0 Value;
    /// Voltage that overcomes the motors' friction.
    MotorFriction "motor_friction" "V" 0.0..24.0 = 0.42 Value;
    /// Voltage per speed of the wheel's circumference.
    MotorSpeedGain "motor_speed_gain" "V*s/m" 0.0..1000.0 = 13.3 Value;
    /// Voltage per acceleration.
    MotorAccelGain "motor_accel_gain" "V*s2/m" 0.0..1000.0 = 0.5 Value;
    /// Proportional gain of the wheel servos.
    ServoP "servo_p" "V*s/m" 0.0..10_000.0 = 25.0 Value;
    /// Integral gain of the wheel servos.
    ServoI "servo_i" "V/m" 0.0..100_000.0 = 250.0 Value;
    /// Largest part of the integral in the output.
    ServoILimit "servo_i_limit" "V" 0.0..48.0 = 3.0 Value;
    /// Largest duty.
    MaxDuty "max_duty" "-" 0.05..1.0 = 0.98 Value;
    /// Nominal battery voltage.
    Supply "supply" "V" 3.0..60.0 = 12.0 Value;

    /// Battery voltage over the voltage at the board's input: 11 for 100 kΩ over 10 kΩ; 0: not connected, `supply` is assumed.
    BatteryDivider "battery_divider" "-" 0.0..100.0 = 11.0 Value;
    /// Current per voltage of the motors' current sensors; 0: there are none.
    CurrentScale "current_scale" "A/V" 0.0..1000.0 = 0.0 Value;
    /// Voltage of the current sensors at no current.
    CurrentZero "current_zero" "V" 0.0..5.0 = 0.0 Value;
    /// Resistance of a motor's winding with its bridge and wires; 0: not known. With it and a current sensor, a blocked motor is told from a dead encoder.
    MotorResistance "motor_resistance" "ohm" 0.0..1000.0 = 0.0 Value;
    /// Share by which a wheel's speed may be off what its motor's voltage makes of it, before that is a fault; 1 or more: encoders are not watched.
    MotorTolerance "motor_tolerance" "-" 0.1..10.0 = 0.25 Value;
    /// Largest current of a motor; 0: no limit.
    MaxCurrent "max_current" "A" 0.0..1000.0 = 0.0 Value;
    /// Lowest battery voltage over `supply`, where it is measured; 0: no limit.
    SupplyMin "supply_min" "-" 0.0..1.0 = 0.75 Value;
    /// Highest battery voltage over `supply`, where it is measured.
    SupplyMax "supply_max" "-" 1.0..10.0 = 1.35 Value;
    /// A normally closed emergency-stop circuit is connected: open stops the base.
    EstopInput "estop_input" "-" 0.0..1.0 = 0.0 Switch;

    /// A motion without an end is stopped after this time without an accepted line; 0: never.
    Deadman "deadman" "s" 0.0..60.0 = 1.0 Value;
    /// Lines without a check are refused, and every line that is sent has one.
    RequireCrc "require_crc" "-" 0.0..1.0 = 0.0 Switch;
}
