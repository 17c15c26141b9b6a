//! The table of parameters: the one place where a parameter is defined.

use crate::vehicle;
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
    /// The vehicles that have it.
    pub vehicles: Kinds,
}

/// The vehicles that have a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kinds(u8);

impl Kinds {
    const ALL: Self = Self(u8::MAX);

    const fn and(self, kind: vehicle::Kind) -> Self {
        Self(self.0 | 1 << kind as u8)
    }

    /// True if that vehicle has it.
    #[must_use]
    pub const fn include(self, kind: vehicle::Kind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }
}

macro_rules! kinds {
    () => {
        Kinds::ALL
    };
    ($($kind:ident)+) => {
        Kinds(0)$(.and(vehicle::Kind::$kind))+
    };
}

/// Two lists: what every firmware has, and what only those of other vehicles than the differential drive have. After `for` come the vehicles that have the
/// parameter, if not all do.
macro_rules! parameters {
    (
        {$($(#[$doc:meta])* $id:ident $name:literal $unit:literal $min:literal .. $max:literal = $default:literal $kind:ident $(for $($vehicle:ident)+)?;)*}
        {$($(#[$own_doc:meta])* $own:ident $own_name:literal $own_unit:literal $own_min:literal .. $own_max:literal = $own_default:literal $own_kind:ident for $($own_vehicle:ident)+;)*}
    ) => {
        /// A parameter.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum Id {
            $($(#[$doc])* $id,)*
            $($(#[$own_doc])* #[cfg(feature = "vehicles")] $own,)*
        }

        impl Id {
            /// All parameters of all vehicles, in the order in which they are listed.
            pub const ALL: [Self; Self::COUNT] = [
                $(Self::$id,)*
                $(#[cfg(feature = "vehicles")] Self::$own,)*
            ];
            /// How many there are.
            pub const COUNT: usize = [
                $($name,)*
                $(#[cfg(feature = "vehicles")] $own_name,)*
            ].len();

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
                        vehicles: kinds!($($($vehicle)+)?),
                    },)*
                    $(#[cfg(feature = "vehicles")]
                    Self::$own => Spec {
                        name: $own_name,
                        unit: $own_unit,
                        min: $own_min,
                        max: $own_max,
                        default: $own_default,
                        kind: Kind::$own_kind,
                        vehicles: kinds!($($own_vehicle)+),
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

    /// True if that vehicle has it. A firmware for the differential drive alone has no other parameters.
    #[must_use]
    pub fn is_of(self, kind: vehicle::Kind) -> bool {
        !cfg!(feature = "vehicles") || self.spec().vehicles.include(kind)
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
    {
        /// Distance of the wheels' contacts; of a tricycle or a car, that of its axles.
        WheelBase "wheel_base" "m" 0.02..5.0 = 0.2 Geometry for Differential Tricycle BiSteerable;
        /// Diameter of the left wheel.
        LeftDiameter "left_diameter" "m" 0.005..2.0 = 0.084 Geometry for Differential BiSteerable;
        /// Diameter of the right wheel.
        RightDiameter "right_diameter" "m" 0.005..2.0 = 0.084 Geometry for Differential BiSteerable;
        /// Encoder counts per turn of a wheel (all four edges, gear ratio included).
        CountsPerTurn "counts_per_turn" "-" 4.0..1e7 = 2796.8 Geometry;
        /// k_r: true over nominal diameter of the right wheel.
        GainRight "gain_right" "-" 0.8..1.25 = 1.0 Geometry for Differential BiSteerable;
        /// k_l: the same of the left wheel.
        GainLeft "gain_left" "-" 0.8..1.25 = 1.0 Geometry for Differential BiSteerable;
        /// k_b: true over nominal wheel base.
        GainBase "gain_base" "-" 0.8..1.25 = 1.0 Geometry for Differential Tricycle BiSteerable;
        /// The left encoder counts down when its wheel rolls forward.
        LeftEncoderReversed "left_encoder_reversed" "-" 0.0..1.0 = 0.0 Wiring;
        /// The same of the right one.
        RightEncoderReversed "right_encoder_reversed" "-" 0.0..1.0 = 0.0 Wiring for Differential Synchro BiSteerable;
        /// The left motor turns backward when its direction pin is high.
        LeftMotorReversed "left_motor_reversed" "-" 0.0..1.0 = 0.0 Wiring;
        /// The same of the right one.
        RightMotorReversed "right_motor_reversed" "-" 0.0..1.0 = 0.0 Wiring for Differential Synchro BiSteerable;

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
        KDrift "k_drift" "deg2/m2" 0.0..100.0 = 0.04 Value for Differential BiSteerable;
        /// K_rot: prior variance of the rotation's scale.
        KRot "k_rot" "-" 0.0..0.01 = 2e-4 Value;
        /// K_scale: prior variance of what the gains of both wheels have in common.
        KScale "k_scale" "-" 0.0..0.01 = 5e-5 Value;
        /// The lower triangular root of the gains' covariance, as it was learned (right, left, base); all 0: the prior.
        SpreadRr "spread_rr" "-" -1.0..1.0 = 0.0 Value;
        /// The next element, by rows.
        SpreadLr "spread_lr" "-" -1.0..1.0 = 0.0 Value for Differential BiSteerable;
        /// The next one.
        SpreadLl "spread_ll" "-" -1.0..1.0 = 0.0 Value for Differential BiSteerable;
        /// The next one.
        SpreadBr "spread_br" "-" -1.0..1.0 = 0.0 Value;
        /// The next one.
        SpreadBl "spread_bl" "-" -1.0..1.0 = 0.0 Value for Differential BiSteerable;
        /// The last one.
        SpreadBb "spread_bb" "-" -1.0..1.0 = 0.0 Value;
        /// Largest squared Mahalanobis distance of an observation; 0: any.
        Gate "gate" "-" 0.0..1e6 = 25.0 Value;

        /// Largest distance of a path from a corner that it rounds; 0: corners are turned on the spot.
        Corner "corner" "m" 0.0..10.0 = 0.1 Value;
        /// How near to a posture the base has to stop; farther off, it comes once more.
        Arrival "arrival" "m" 5e-4..1.0 = 0.003 Value;
        /// The same of a heading: it waits until it is there.
        ArrivalTurn "arrival_turn" "deg" 0.05..90.0 = 0.4 Value;
        /// A target that was not replaced for so long is not chased any more.
        ChaseTimeout "chase_timeout" "s" 0.1..60.0 = 1.5 Value;

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

        /// Bound of a turn's error: the map's, which is a guarantee.
        BoundTurn "bound_turn" "deg" 0.0..180.0 = 5.0 Value;
        /// Bound of what the heading's error grows by on a run.
        BoundTurnPerM "bound_turn_per_m" "deg/m" 0.0..180.0 = 0.6 Value;
        /// Bound of a run's error, whatever its length.
        BoundDist "bound_dist" "m" 0.0..10.0 = 0.05 Value;
        /// Bound of what a run's error grows by with its length.
        BoundDistRel "bound_dist_rel" "-" 0.0..1.0 = 0.05 Value;

        /// A motion without an end is stopped after this time without an accepted line; 0: never.
        Deadman "deadman" "s" 0.0..60.0 = 1.0 Value;
        /// Lines without a check are refused, and every line that is sent has one.
        RequireCrc "require_crc" "-" 0.0..1.0 = 0.0 Switch;
    }
    {
        /// Distance of the contacts of an axle's wheels.
        Track "track" "m" 0.02..5.0 = 0.2 Geometry for BiSteerable;
        /// Diameter of the driven wheel, or of all of them.
        WheelDiameter "wheel_diameter" "m" 0.005..2.0 = 0.065 Geometry for Synchro Tricycle;
        /// k_d: its true over its nominal diameter.
        GainDrive "gain_drive" "-" 0.8..1.25 = 1.0 Geometry for Synchro Tricycle;
        /// Encoder counts of the steering for a full turn of the heading.
        TurnCounts "turn_counts" "-" 4.0..1e7 = 4096.0 Geometry for Synchro;
        /// Speed of a circumference that the steering's motor is told, for each rad/s of the heading.
        TurnLever "turn_lever" "m" 0.005..2.0 = 0.1 Geometry for Synchro;
        /// k_α: true over nominal rotation.
        GainTurn "gain_turn" "-" 0.8..1.25 = 1.0 Geometry for Synchro;
        /// Rotation that no encoder sees, for each distance.
        TurnDrift "turn_drift" "deg/m" -14.0..14.0 = 0.0 Geometry for Synchro;
        /// K_turn_drift: its prior variance.
        KTurnDrift "k_turn_drift" "deg2/m2" 0.0..100.0 = 0.04 Value for Synchro;

        /// The farthest that the steering turns, to either side.
        SteerMax "steer_max" "deg" 1.0..90.0 = 35.0 Geometry for Tricycle BiSteerable;
        /// Its fastest.
        SteerRate "steer_rate" "deg/s" 1.0..3600.0 = 120.0 Value for Tricycle BiSteerable;
        /// φ₀: the true steering angle where its sensor says 0.
        SteerOffset "steer_offset" "deg" -14.0..14.0 = 0.0 Geometry for Tricycle BiSteerable;
        /// Width of the servo's pulse at an angle of 0.
        ServoCentre "servo_centre" "us" 500.0..2500.0 = 1500.0 Geometry for Tricycle BiSteerable;
        /// What it changes by for each degree; negative for a servo that turns the other way.
        ServoScale "servo_scale" "us/deg" -200.0..200.0 = 10.0 Geometry for Tricycle BiSteerable;
        /// Voltage of the steering's potentiometer at an angle of 0.
        PotCentre "pot_centre" "V" 0.0..3.3 = 1.65 Geometry for Tricycle BiSteerable;
        /// Angle for each volt; 0: an encoder measures it.
        PotScale "pot_scale" "deg/V" -1000.0..1000.0 = 60.0 Geometry for Tricycle BiSteerable;
        /// Counts of that encoder for a full turn of the steering, negative if they fall in a turn to the left; it is at 0 where the base is switched on.
        SteerCounts "steer_counts" "-" -1e7..1e7 = 4096.0 Geometry for Tricycle BiSteerable;
        /// κ_steer: a white part of the steering angle along the path.
        NoiseSteer "noise_steer" "deg2*m" 0.0..100.0 = 0.0025 Value for Tricycle BiSteerable;
        /// K_steer: prior variance of the steering's offset.
        KSteer "k_steer" "deg2" 0.0..100.0 = 4.0 Value for Tricycle BiSteerable;

        /// The rear axle is steered against the front axle, by the same angle; otherwise not at all.
        RearSteered "rear_steered" "-" 0.0..1.0 = 0.0 Wiring for BiSteerable;
        /// The wheels that tell the motion: 0 those of the rear axle, 1 those of the front axle, 2 all four.
        Odometry "odometry" "-" 0.0..2.0 = 0.0 Geometry for BiSteerable;
        /// The relation of a steered axle's wheels as it is printed in the paper, to the first order; otherwise the exact one.
        PrintedRelation "printed_relation" "-" 0.0..1.0 = 0.0 Wiring for BiSteerable;

        /// The last row of the root of the gains' covariance: that of the offset.
        SpreadOr "spread_or" "-" -1.0..1.0 = 0.0 Value for Synchro Tricycle BiSteerable;
        /// The next element.
        SpreadOl "spread_ol" "-" -1.0..1.0 = 0.0 Value for BiSteerable;
        /// The next one.
        SpreadOb "spread_ob" "-" -1.0..1.0 = 0.0 Value for Synchro Tricycle BiSteerable;
        /// The last one.
        SpreadOo "spread_oo" "-" -1.0..1.0 = 0.0 Value for Synchro Tricycle BiSteerable;
    }
}
