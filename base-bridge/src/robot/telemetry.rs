//! Telemetry lines.

use super::Vehicle;
use ros_messages::base::joints::Turned;

/// A field of a telemetry line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// The base's time, s.
    Time,
    /// m.
    X,
    /// m.
    Y,
    /// °.
    Theta,
    /// m/s.
    Speed,
    /// °/s.
    TurnSpeed,
    /// Counts of the left (or only) wheel.
    LeftCount,
    /// Counts of the right wheel, or of a synchro drive's steering.
    RightCount,
    /// m/s.
    LeftSpeed,
    /// m/s.
    RightSpeed,
    /// V.
    Battery,
    /// Its name, or `none`.
    Fault,
    /// Lines that found no room.
    Dropped,
    /// The angle of steered wheels, °.
    Steer,
    /// Share of its period that a tick took.
    TickLoad,
}

impl Field {
    const fn name(self) -> &'static str {
        match self {
            Self::Time => "t",
            Self::X => "x",
            Self::Y => "y",
            Self::Theta => "theta",
            Self::Speed => "v_s",
            Self::TurnSpeed => "v_alpha",
            Self::LeftCount => "left_count",
            Self::RightCount => "right_count",
            Self::LeftSpeed => "left_speed",
            Self::RightSpeed => "right_speed",
            Self::Battery => "battery",
            Self::Fault => "fault",
            Self::Dropped => "dropped",
            Self::Steer => "steer",
            Self::TickLoad => "tick_load",
        }
    }
}

/// All, in the order in which they are asked for: the base leaves out the last where a line would be too long.
const ALL: [Field; 15] = [
    Field::Time,
    Field::X,
    Field::Y,
    Field::Theta,
    Field::Speed,
    Field::TurnSpeed,
    Field::LeftCount,
    Field::RightCount,
    Field::LeftSpeed,
    Field::RightSpeed,
    Field::Battery,
    Field::Fault,
    Field::Dropped,
    Field::Steer,
    Field::TickLoad,
];

/// What to ask a vehicle for. An older base does not know `tick_load` and refuses the whole line.
pub fn fields(vehicle: Vehicle, knows_tick_load: bool) -> Vec<Field> {
    let steers = matches!(vehicle, Vehicle::Tricycle | Vehicle::Car);
    let wanted = |field: &Field| match field {
        Field::Steer => steers,
        Field::TickLoad => knows_tick_load,
        _ => true,
    };
    ALL.into_iter().filter(wanted).collect()
}

/// The `Stream` line that asks for these.
pub fn stream(period: f64, fields: &[Field]) -> String {
    let names: Vec<_> = fields.iter().map(|field| field.name()).collect();
    format!("Stream {period} {}", names.join(" "))
}

/// What a line says, in SI units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Telemetry {
    /// The base's time, s.
    pub time: f64,
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// rad.
    pub theta: f64,
    /// m/s.
    pub v: f64,
    /// rad/s.
    pub omega: f64,
    /// Counts.
    pub counts: [i64; 2],
    /// Of the wheels, m/s.
    pub wheel_speeds: [f64; 2],
    /// V.
    pub battery: f64,
    /// The fault that is latched.
    pub fault: Option<String>,
    /// Lines that found no room on the base's line since it started.
    pub dropped: u64,
    /// rad, positive to the left; 0 where nothing steers.
    pub steer: f64,
    /// Share of its period that a tick took; none where nobody measures it.
    pub tick_load: Option<f64>,
}

impl Telemetry {
    /// What it says of what turns.
    pub fn turned(&self) -> Turned {
        Turned {
            counts: self.counts,
            wheel_speeds: self.wheel_speeds,
            omega: self.omega,
            steer: self.steer,
        }
    }

    /// Reads a row of these fields. None if it has others, or not all of them, or a number is not finite.
    pub fn parse(row: &str, fields: &[Field]) -> Option<Self> {
        let mut telemetry = Self::default();
        let mut words = row.split_ascii_whitespace();
        for field in fields {
            let word = words.next()?;
            telemetry.set(*field, word)?;
        }
        words.next().is_none().then_some(telemetry)
    }

    fn set(&mut self, field: Field, word: &str) -> Option<()> {
        let number = || word.parse().ok().filter(|x: &f64| x.is_finite());
        let radians = || number().map(f64::to_radians);
        match field {
            Field::Time => self.time = number()?,
            Field::X => self.x = number()?,
            Field::Y => self.y = number()?,
            Field::Theta => self.theta = radians()?,
            Field::Speed => self.v = number()?,
            Field::TurnSpeed => self.omega = radians()?,
            Field::LeftCount => self.counts[0] = word.parse().ok()?,
            Field::RightCount => self.counts[1] = word.parse().ok()?,
            Field::LeftSpeed => self.wheel_speeds[0] = number()?,
            Field::RightSpeed => self.wheel_speeds[1] = number()?,
            Field::Battery => self.battery = number()?,
            Field::Fault => self.fault = (word != "none").then(|| word.to_owned()),
            Field::Dropped => self.dropped = word.parse().ok()?,
            Field::Steer => self.steer = radians()?,
            Field::TickLoad => {
                self.tick_load = if word == "-" { None } else { Some(number()?) };
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_row_is_read_in_its_order() {
        let fields = fields(Vehicle::Differential, true);
        assert_eq!(
            stream(0.02, &fields),
            "Stream 0.02 t x y theta v_s v_alpha left_count right_count left_speed right_speed battery fault dropped tick_load"
        );
        let row = "12.477 1.5 -0.25 90.00000 0.3 -90 -12 34 0.29 0.31 12.392 no-motion 3 0.125";
        let told = Telemetry::parse(row, &fields).unwrap();
        assert_eq!(told.time, 12.477);
        assert_eq!((told.x, told.y, told.theta), (1.5, -0.25, FRAC_PI_2));
        assert_eq!((told.v, told.omega), (0.3, -FRAC_PI_2));
        assert_eq!(told.counts, [-12, 34]);
        assert_eq!(told.wheel_speeds, [0.29, 0.31]);
        assert_eq!(told.battery, 12.392);
        assert_eq!(told.fault.as_deref(), Some("no-motion"));
        assert_eq!((told.dropped, told.tick_load), (3, Some(0.125)));
        let row = row.replace("0.125", "-").replace("no-motion", "none");
        let told = Telemetry::parse(&row, &fields).unwrap();
        assert_eq!((told.fault, told.tick_load), (None, None));
    }

    #[test]
    fn rows_of_other_fields_are_none() {
        let fields = fields(Vehicle::Car, false);
        assert!(fields.contains(&Field::Steer));
        for row in [
            "",
            "1 2 3",
            "1 2 3 4 5 6 7 8 9 10 11 none 0 1 extra",
            "1 inf 3 4 5 6 7 8 9 10 11 none 0 1",
            "1 2 3 4 5 6 7.5 8 9 10 11 none 0 1",
        ] {
            assert_eq!(Telemetry::parse(row, &fields), None, "{row}");
        }
    }
}
