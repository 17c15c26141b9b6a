//! Telemetry: which numbers, and how often.

use super::error::Error;
use super::number::Sink;
use super::reply::heading;
use super::text::Text;
use crate::controller::Snapshot;
use crate::params::DEGREES;
use crate::time::{self, Duration, Instant};

/// At most so many fields in a line. Of the widest some may not fit: then the line ends with the last that does.
const MAX_FIELDS: usize = 16;

macro_rules! fields {
    ($($field:ident $name:literal;)*) => {
        /// A number that telemetry can carry.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        enum Field { $($field,)* }

        const NAMES: &[(&str, Field)] = &[$(($name, Field::$field),)*];
    };
}

fields! {
    Time "t"; X "x"; Y "y"; Theta "theta";
    Cxx "cxx"; Cxy "cxy"; Cxt "cxt"; Cyy "cyy"; Cyt "cyt"; Ctt "ctt";
    Speed "v_s"; TurnSpeed "v_alpha";
    S "s"; SRef "s_ref"; SpeedRef "v_s_ref";
    Alpha "alpha"; AlphaRef "alpha_ref"; TurnSpeedRef "v_alpha_ref";
    MoveState "move_state"; TurnState "turn_state";
    LeftCount "left_count"; RightCount "right_count";
    LeftSpeed "left_speed"; RightSpeed "right_speed";
    LeftDuty "left_duty"; RightDuty "right_duty";
    Battery "battery"; LeftCurrent "left_current"; RightCurrent "right_current";
    Steering "steer"; FaultName "fault"; Dropped "dropped"; TickLoad "tick_load";
}

/// The fields of a telemetry line; none means the default ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fields {
    fields: [Option<Field>; MAX_FIELDS],
    count: usize,
}

const DEFAULT: [Field; 6] = [
    Field::Time,
    Field::X,
    Field::Y,
    Field::Theta,
    Field::Speed,
    Field::TurnSpeed,
];

impl Fields {
    /// Adds a field by its name.
    ///
    /// # Errors
    /// [`Error::Syntax`] if there is no such field, [`Error::Range`] if there are too many.
    pub fn add(&mut self, name: &[u8]) -> Result<(), Error> {
        let (_, field) = NAMES
            .iter()
            .find(|(known, _)| name.eq_ignore_ascii_case(known.as_bytes()))
            .ok_or(Error::Syntax("no such field"))?;
        if self.fields.contains(&Some(*field)) {
            return Err(Error::Syntax("a field is given twice"));
        }
        let slot = self.fields.get_mut(self.count).ok_or(Error::Range {
            name: "fields",
            min: 0.0,
            max: MAX_FIELDS as f32,
            unit: "",
        })?;
        *slot = Some(*field);
        self.count += 1;
        Ok(())
    }

    fn list(&self) -> impl Iterator<Item = Field> {
        let defaults: &[Field] = if self.count == 0 { &DEFAULT } else { &[] };
        let given = self.fields.iter().flatten();
        defaults.iter().chain(given).copied()
    }
}

/// The telemetry stream.
#[derive(Clone, Debug, Default)]
pub struct Stream {
    period: Option<Duration>,
    next: Option<Instant>,
    fields: Fields,
    /// Lines that found no room.
    pub dropped: u32,
    /// The largest share of its period that a tick took since the last line, if anybody measures it.
    tick_load: Option<f32>,
}

impl Stream {
    /// Sends every `period` seconds from now on; 0 turns it off.
    pub fn set(&mut self, period: f32, fields: Fields) {
        let ticks = (f64::from(period) * 1e6 + 0.5) as u64;
        self.period = (period > 0.0).then(|| Duration::from_ticks(ticks));
        self.next = None;
        self.fields = fields;
    }

    /// True if a line is due. Lines that were missed are left out: the next is in step again.
    pub fn is_due(&mut self, now: Instant) -> bool {
        let Some(period) = self.period else {
            return false;
        };
        // A clock that was set back must not silence it.
        let leapt = |next| time::since(next, now) > period;
        let due = self.next.is_none_or(|next| now >= next || leapt(next));
        if due {
            let next = time::after(self.next.unwrap_or(now), period);
            self.next = Some(if next > now {
                next
            } else {
                time::after(now, period)
            });
        }
        due
    }

    /// Notes the share of its period that a tick took. What is not finite is left out.
    pub fn note_tick_load(&mut self, share: f32) {
        if share.is_finite() {
            self.tick_load = Some(self.tick_load.map_or(share, |load| load.max(share)));
        }
    }

    /// Writes a line. The ticks before it are not told again.
    pub fn write(&mut self, text: &mut Text, snapshot: &Snapshot) {
        let tick_load = self.tick_load.take();
        let estimate = snapshot.estimator.present();
        let c = &estimate.covariance;
        let (translation, rotation) = (&snapshot.translation, &snapshot.rotation);
        let [left, right] = &snapshot.wheels;
        let fixed = |text: &mut Text, x: f64, decimals| {
            text.fixed(x, decimals);
        };
        let metres = |text: &mut Text, x: f32| fixed(text, f64::from(x), 6);
        let degrees = |text: &mut Text, x: f64| fixed(text, x * DEGREES, 5);
        // Where there is no sensor there is no number, but a line keeps its columns.
        let measured = |text: &mut Text, value: Option<f32>| {
            match value {
                Some(value) => text.fixed(f64::from(value), 3),
                None => text.word("-"),
            };
        };
        text.byte(b'~');
        for field in self.fields.list() {
            let mark = text.mark();
            match field {
                Field::Time => fixed(text, snapshot.time.ticks() as f64 * 1e-6, 3),
                Field::X => fixed(text, estimate.pose.x, 6),
                Field::Y => fixed(text, estimate.pose.y, 6),
                Field::Theta => heading(text, estimate.pose.theta),
                Field::Cxx => {
                    text.scientific(c.m11);
                }
                Field::Cxy => {
                    text.scientific(c.m12);
                }
                Field::Cxt => {
                    text.scientific(c.m13 * DEGREES);
                }
                Field::Cyy => {
                    text.scientific(c.m22);
                }
                Field::Cyt => {
                    text.scientific(c.m23 * DEGREES);
                }
                Field::Ctt => {
                    text.scientific(c.m33 * DEGREES * DEGREES);
                }
                Field::Speed => metres(text, translation.speed),
                Field::SpeedRef => metres(text, translation.reference_speed),
                Field::TurnSpeed => degrees(text, f64::from(rotation.speed)),
                Field::TurnSpeedRef => degrees(text, f64::from(rotation.reference_speed)),
                Field::S => fixed(text, translation.displacement.to_f64(), 6),
                Field::SRef => fixed(text, translation.reference(), 6),
                Field::Alpha => degrees(text, rotation.displacement.to_f64()),
                Field::AlphaRef => degrees(text, rotation.reference()),
                Field::MoveState => {
                    text.word(translation.state.name());
                }
                Field::TurnState => {
                    text.word(rotation.state.name());
                }
                Field::LeftCount => {
                    text.integer(left.count);
                }
                Field::RightCount => {
                    text.integer(right.count);
                }
                Field::LeftSpeed => metres(text, left.speed),
                Field::RightSpeed => metres(text, right.speed),
                Field::LeftDuty => fixed(text, f64::from(left.duty), 4),
                Field::RightDuty => fixed(text, f64::from(right.duty), 4),
                Field::Steering => fixed(text, f64::from(snapshot.steering()) * DEGREES, 4),
                Field::Battery => fixed(text, f64::from(snapshot.supply), 3),
                Field::LeftCurrent => measured(text, snapshot.currents[0]),
                Field::RightCurrent => measured(text, snapshot.currents[1]),
                Field::FaultName => {
                    text.word(snapshot.fault.map_or("none", |fault| fault.name()));
                }
                Field::Dropped => {
                    text.integer(i64::from(self.dropped));
                }
                Field::TickLoad => measured(text, tick_load),
            }
            if text.is_full() {
                text.cut(mark);
                return;
            }
        }
    }
}
