//! The table of faults: the one place where a fault is defined.

/// What a fault does to the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reaction {
    /// Both axes decelerate at the stop rates; at rest, or when a deadline has passed, the motors are switched off.
    Stop,
    /// The motors are switched off at once: their bridges short them, which brakes, and are disabled half a second later.
    Off,
}

impl Reaction {
    /// Its name in `docs/safety.md`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stop => "stop",
            Self::Off => "off",
        }
    }
}

macro_rules! faults {
    ($($(#[$doc:meta])* $id:ident $name:literal $reaction:ident, $cause:literal, $clears:literal;)*) => {
        /// A latched fault: motion is refused until it is cleared.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub enum Fault {
            $($(#[$doc])* $id,)*
        }

        impl Fault {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$id),*];

            /// The name that the protocol uses.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$id => $name,)* }
            }

            /// What it does to the motion.
            #[must_use]
            pub const fn reaction(self) -> Reaction {
                match self { $(Self::$id => Reaction::$reaction,)* }
            }

            /// What is seen when it is latched, for people.
            #[must_use]
            pub const fn cause(self) -> &'static str {
                match self { $(Self::$id => $cause,)* }
            }

            /// When `ClearFault` takes it away, for people.
            #[must_use]
            pub const fn clears(self) -> &'static str {
                match self { $(Self::$id => $clears,)* }
            }
        }
    };
}

faults! {
    /// The emergency stop was pressed, or the EStop command given.
    Estop "estop" Off,
        "emergency-stop circuit open, stop button pressed, or the EStop command",
        "circuit closed and button released";
    /// A motor output could not be written.
    Output "output" Off,
        "a PWM channel or a pin of a motor driver refused to be written",
        "the outputs can be written";
    /// The watchdog had to reset the controller.
    Watchdog "watchdog" Off,
        "the watchdog reset the controller: the tick or the main loop hung",
        "at once";
    /// A wheel does not turn although its motor has the voltage for it; nobody knows whether wheel or encoder stands.
    NoMotion "no-motion" Off,
        "a wheel's counts stand while its motor's voltage would turn it: blocked, no power, or a dead encoder (without current sensing they look alike)",
        "at once; it comes back with the next motion if its cause lasts";
    /// The same, and the motor's current says that it stands.
    Stall "stall" Off,
        "as no-motion for half a second, and the motor's current is that of a motor that stands",
        "at once";
    /// The same, and the motor's current says that it turns.
    EncoderStuck "encoder-stuck" Off,
        "as no-motion, and the motor's current is that of a motor that turns: the encoder is stuck or unplugged",
        "at once";
    /// The count flickers by one and goes nowhere.
    EncoderChannel "encoder-channel" Off,
        "as no-motion, and the count flickers by one: one of the encoder's two channels is lost",
        "at once";
    /// A wheel turns against its motor's voltage.
    EncoderSign "encoder-sign" Off,
        "a wheel's counts run against its motor's voltage: encoder or motor reversed, or the base is overpowered",
        "at once";
    /// More counts in a tick than a wheel can make.
    EncoderJump "encoder-jump" Off,
        "more counts within 10 ms than 3 times max_wheel_speed can make; they are left out of the pose",
        "at once";
    /// A wheel turns too fast or too slowly for its motor's voltage.
    Mismatch "mismatch" Off,
        "a wheel's speed does not fit its motor's voltage: counts are lost or added, a weak motor, or motor parameters that are not the motor's",
        "at once";
    /// The motors work against each other.
    WheelsFighting "wheels-fighting" Off,
        "both motors push, in opposite directions although no turn is under way, and neither wheel moves",
        "at once";
    /// A motor takes more current than allowed.
    Overcurrent "overcurrent" Off,
        "a motor's current above max_current for 20 ms",
        "currents below max_current";
    /// A wheel is faster than it may be.
    Overspeed "overspeed" Off,
        "a wheel above 1.25 times max_wheel_speed for 30 ms",
        "wheels below max_wheel_speed";
    /// The base is not where its reference is.
    Following "following" Off,
        "an axis 5 times its lag away from its reference for 50 ms, or held up for a second",
        "at once";
    /// The wheels do not point where they are told to.
    Steering "steering" Stop,
        "the steering is more than 10 degrees from where it is told to point for half a second: jammed, without power, or a torn sensor",
        "at once; it comes back with the next motion if its cause lasts";
    /// The battery is empty, or its sense wire broken.
    Undervoltage "undervoltage" Stop,
        "battery below supply_min times supply for 0.1 s while the motors are on",
        "battery above supply_min times supply";
    /// The battery's voltage is too high.
    Overvoltage "overvoltage" Off,
        "battery above supply_max times supply for 0.1 s while the motors are on",
        "battery below supply_max times supply";
    /// A motion without an end, and nobody there.
    Link "link" Stop,
        "no accepted line for deadman seconds during a motion without a finite target; an axis with a target goes on to it",
        "at once: ClearFault is a sign of life";
    /// Ticks came too late, or not at all.
    Overrun "overrun" Stop,
        "20 ticks missed in a row, or more than every third one for long",
        "at once";
    /// The estimate is no number any more.
    Estimator "estimator" Stop,
        "the pose or its covariance is not finite",
        "after ResetPos";
    /// The stored parameters cannot be read.
    Storage "storage" Off,
        "at the start: what was saved last cannot be read any more; an older set or the defaults are in force",
        "at once: it says that they have been looked at";
}

/// Which of the wheels a fault is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Place {
    /// The base as a whole.
    Base,
    /// The left wheel, its motor or its encoder.
    Left,
    /// The right one.
    Right,
    /// Both wheels alike.
    Both,
}

impl Place {
    /// The name that the protocol uses; none for the base as a whole.
    #[must_use]
    pub const fn name(self) -> Option<&'static str> {
        match self {
            Self::Base => None,
            Self::Left => Some("left"),
            Self::Right => Some("right"),
            Self::Both => Some("both"),
        }
    }
}

impl Fault {
    /// What the encoders, or the wheels' directions, have said until now may be wrong, or something of it is missing: the base may be anywhere.
    #[must_use]
    pub const fn doubts_odometry(self) -> bool {
        match self {
            Self::NoMotion
            | Self::EncoderStuck
            | Self::EncoderChannel
            | Self::EncoderSign
            | Self::EncoderJump
            | Self::Mismatch
            | Self::Steering
            | Self::Overrun
            | Self::Estimator => true,
            Self::Estop
            | Self::Output
            | Self::Watchdog
            | Self::Stall
            | Self::WheelsFighting
            | Self::Overcurrent
            | Self::Overspeed
            | Self::Following
            | Self::Undervoltage
            | Self::Overvoltage
            | Self::Link
            | Self::Storage => false,
        }
    }
}
