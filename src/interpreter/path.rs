//! Paths and chases: their commands, replies and events.

use super::command::PathCommand;
use super::error::{Error, refuse, refuse_path};
use super::listing::Listing;
use super::reply::heading;
use super::text::Text;
use super::{Desk, Interpreter, Told};
use crate::params::Blueprint;
use crate::trajectory::{Notice, PathEvent, Pilot, Posture, Unable};
use core::f64::consts::PI;

impl Interpreter {
    #[inline(never)]
    pub(super) fn execute_path<C: Blueprint>(
        &mut self,
        desk: &mut Desk<C>,
        command: &PathCommand,
    ) -> Result<(), Error> {
        let settings = self.params.trajectory(self.identity.period);
        let done = match command {
            PathCommand::GoTo(posture) => self.pilot.go_to(desk, &settings, posture),
            PathCommand::Start => self.pilot.start(desk, &settings),
            PathCommand::Chase(target) => self.pilot.chase(desk, &settings, target),
            PathCommand::Append(posture) => {
                check_speed(desk, posture)?;
                self.pilot.append(desk, posture).map_err(Unable::from)
            }
            PathCommand::Clear => {
                if self.pilot.errand().is_some() {
                    desk.stop().map_err(refuse)?;
                }
                self.pilot.clear();
                Ok(())
            }
        };
        // At once: the next line may replace it again, or end what came in its place.
        if let Some(notice) = self.pilot.take_end() {
            self.note(notice);
        }
        done.map_err(refuse_path)
    }

    /// Lets the pilot command the base. It has its turn before the lines that wait and after them: neither keeps the other out.
    pub(super) fn drive<C: Blueprint>(&mut self, desk: &mut Desk<C>, yields: bool) {
        if let Some(notice) = self.pilot.update(desk, yields) {
            self.note(notice);
        }
    }

    fn note(&mut self, notice: Notice) {
        // Of a full queue nobody has taken anything for long: see `notify`.
        let _ = self.events.push_back(Told::Notice(notice));
    }

    /// `Path n <errand>`, with n rows to follow.
    pub(super) fn list_path(&mut self, text: &mut Text) {
        let count = self.pilot.path().len() as u32;
        let first = self.pilot.first();
        text.str("Path")
            .integer(i64::from(count))
            .word(self.pilot.errand().map_or("idle", |errand| errand.name()));
        self.listing = Some(Listing::Path(
            first,
            first.saturating_add(count).saturating_sub(1),
        ));
    }
}

/// On the way to a posture, m/s: slower is not on its way.
const MIN_SPEED: f32 = 0.001;

fn check_speed<C: Blueprint>(desk: &Desk<C>, posture: &Posture) -> Result<(), Error> {
    let max = desk.limits().speed;
    match posture.speed {
        Some(speed) if !(MIN_SPEED..=max).contains(&speed) => Err(Error::Range {
            name: "v",
            min: MIN_SPEED,
            max,
            unit: "m/s",
        }),
        _ => Ok(()),
    }
}

/// `~ n x y θ v` of a posture by its number; `-` for what it does not have. One that has been passed since the list began says so.
pub fn row(text: &mut Text, pilot: &Pilot, number: u32, last: u32) {
    text.str("~").integer(i64::from(number));
    // Counted from behind: what has been passed leaves in front, and a path that has ended since counts from 1 again.
    let left = last.saturating_sub(number).saturating_add(1);
    let place = pilot.path().len().checked_sub(left as usize);
    let posture = place.and_then(|place| pilot.path().postures().nth(place));
    let Some(posture) = posture else {
        text.word("passed");
        return;
    };
    text.fixed(posture.x, 6).fixed(posture.y, 6);
    match posture.heading {
        // The nearest f32 to π is above it.
        Some(theta) if f64::from(theta.abs()) > PI => heading(text, PI),
        Some(theta) => heading(text, f64::from(theta)),
        None => drop(text.word("-")),
    }
    match posture.speed {
        Some(speed) => drop(text.shortest(speed)),
        None => drop(text.word("-")),
    }
}

/// An event of a path or a chase.
pub fn notice(text: &mut Text, notice: Notice) {
    match notice {
        Notice::Path(PathEvent::Posture(number)) => {
            text.str("! posture").integer(i64::from(number));
        }
        Notice::Path(PathEvent::Done) => drop(text.str("! path done")),
        Notice::End(errand, ending) => {
            text.str("!")
                .word(errand.name())
                .word("end")
                .word(ending.name());
        }
    }
}
