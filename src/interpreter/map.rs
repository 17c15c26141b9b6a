//! Commands of the map.
//!
//! What takes long is asked, and answered when the atlas has worked it out, a piece at each poll; lists follow a row at each.

mod read;
mod tell;

pub use read::MapCommand;
pub(super) use read::read;

use super::error::Error;
use super::text::Text;
use super::{Address, Desk, Interpreter, Told, begin};
use crate::map::{Answer, Atlas, Bounds, MapError, Name, PlaceId, Presence, Question, Route};
use crate::params::{Blueprint, DEGREES, Id, Params};
use crate::supervisor::Fault;

/// What the map's bounds are, by the parameters.
fn bounds(params: &Params) -> Bounds {
    let number = |id| f64::from(params.get(id));
    Bounds {
        turn: number(Id::BoundTurn) / DEGREES,
        turn_per_metre: number(Id::BoundTurnPerM) / DEGREES,
        distance: number(Id::BoundDist),
        distance_share: number(Id::BoundDistRel),
    }
}

/// A question under way, and who is to be answered.
#[derive(Clone, Copy, Debug, Default)]
struct Pending {
    address: Address,
    check: bool,
    /// Of AmIThere, the place that it is about.
    place: Option<PlaceId>,
}

/// A list under way: the next row.
#[derive(Clone, Debug)]
enum Listing {
    There(Presence, usize),
    Place(usize),
    /// Of a place.
    Landmark(usize, usize),
    Arc(usize),
    Route(Route<32>, usize),
}

/// What is being said of the map.
#[derive(Clone, Debug, Default)]
pub(super) struct Charts {
    pending: Option<Pending>,
    listing: Option<Listing>,
}

impl Charts {
    /// Something of the map is to be said before the next line is answered.
    pub(super) fn is_busy(&self) -> bool {
        self.pending.is_some() || self.listing.is_some()
    }

    /// A question is under way.
    pub(super) fn is_asking(&self) -> bool {
        self.pending.is_some()
    }

    /// If the command has asked something, it is this one who is answered.
    pub(super) fn asks(&mut self, address: Address, check: bool) -> bool {
        if let Some(pending) = &mut self.pending {
            (pending.address, pending.check) = (address, check);
        }
        self.pending.is_some()
    }
}

impl Interpreter {
    /// Records what the base does, and does a piece of what was asked.
    #[inline(never)]
    pub(super) fn chart<C: Blueprint>(&mut self, desk: &Desk<C>, atlas: &mut Atlas) {
        let snapshot = desk.snapshot();
        let has_known = atlas.anchor().is_some();
        if has_known && snapshot.fault.is_some_and(Fault::doubts_odometry) {
            atlas.lose();
        }
        atlas.update(&snapshot.estimator, &bounds(&self.params));
        if has_known && atlas.anchor().is_none() {
            // It is worth more than the oldest of what nobody has read.
            if self.events.is_full() {
                self.events.pop_front();
            }
            let _ = self.events.push_back(Told::Lost);
        }
        atlas.work();
    }

    #[inline(never)]
    pub(super) fn execute_map<C: Blueprint>(
        &mut self,
        desk: &Desk<C>,
        atlas: &mut Atlas,
        command: &MapCommand,
        text: &mut Text,
    ) -> Result<(), Error> {
        let charts = &mut self.charts;
        let bounds = bounds(&self.params);
        let says_where = matches!(command, MapCommand::Mark(..) | MapCommand::Sight(..));
        if let Some(fault) = desk
            .snapshot()
            .fault
            .filter(|fault| fault.doubts_odometry())
            && says_where
        {
            // Nobody would know where it has gone from there.
            return Err(Error::Fault(fault));
        }
        let mut about = None;
        let question = match command {
            MapCommand::Mark(name, radius) => Question::Mark(*name, *radius),
            MapCommand::Sight(landmark, sight) => {
                Question::Sight(*landmark, sight.map(|sight| sight.sighting(&bounds)))
            }
            MapCommand::AmIThere(name) => {
                about = name.map(|name| find(atlas, &name)).transpose()?;
                Question::Where
            }
            MapCommand::Crosses([a, b, c, d]) => Question::Crosses([
                find(atlas, a)?,
                find(atlas, b)?,
                find(atlas, c)?,
                find(atlas, d)?,
            ]),
            MapCommand::Label(place, landmark) => {
                let place = find(atlas, place)?;
                atlas.label(place, landmark).map_err(Error::Map)?;
                text.str("OK");
                return Ok(());
            }
            MapCommand::Freeway(a, b, width) => {
                let (a, b) = (find(atlas, a)?, find(atlas, b)?);
                let done = atlas.set_freeway(a, b, *width);
                done.map_err(Error::Map)?;
                text.str("OK");
                return Ok(());
            }
            MapCommand::Route(a, b, width) => {
                let (a, b) = (find(atlas, a)?, find(atlas, b)?);
                let route = atlas.map().route(a, b, *width);
                let route = route.ok_or(Error::Map(MapError::Route))?;
                text.str("Route").integer(route.len() as i64);
                charts.listing = Some(Listing::Route(route, 0));
                return Ok(());
            }
            MapCommand::List => {
                list(atlas, text);
                charts.listing = Some(Listing::Place(0));
                return Ok(());
            }
            MapCommand::Forget(all) => {
                if *all {
                    atlas.forget();
                } else {
                    atlas.lose();
                }
                text.str("OK");
                return Ok(());
            }
        };
        let estimator = &desk.snapshot().estimator;
        atlas.ask(question, estimator, &bounds);
        charts.pending = Some(Pending {
            place: about,
            ..Pending::default()
        });
        Ok(())
    }

    /// Goes on with a list, or answers what was asked if the answer is there.
    #[inline(never)]
    pub(super) fn answer_map<C: Blueprint>(&mut self, desk: &mut Desk<C>, atlas: &mut Atlas) {
        if let Some(listing) = self.charts.listing.take() {
            let mut text = Text::default();
            self.charts.listing = row(atlas, listing, &mut text);
            if !text.bytes().is_empty() {
                self.send(&mut text);
            }
            return;
        }
        let answer = match atlas.answer() {
            Some(answer) => answer,
            None if atlas.is_busy() => return,
            None => Err(MapError::Lost),
        };
        let Some(pending) = self.charts.pending.take() else {
            return;
        };
        let mut text = begin(pending.address);
        match answer {
            Ok(answer) => {
                desk.sign_of_life();
                self.charts.tell(&mut text, atlas, answer, pending.place);
            }
            Err(error) => Error::Map(error).write(&mut text),
        }
        self.send_with(&mut text, pending.check);
    }
}

impl Charts {
    #[inline(never)]
    fn tell(&mut self, text: &mut Text, atlas: &Atlas, answer: Answer, about: Option<PlaceId>) {
        let map = atlas.map();
        let name = |place| map.place(place).map(|place| place.name).unwrap_or_default();
        match answer {
            Answer::Marked(place) => drop(text.str("Marked").word(&name(place))),
            Answer::Added(place) => drop(text.str("Added").word(&name(place))),
            Answer::Confirmed(place, shrunk) => {
                text.str("Confirmed").word(&name(place));
                text.integer(shrunk as i64);
            }
            Answer::Unsure(fitting) => drop(text.str("Unsure").integer(fitting as i64)),
            Answer::Crosses(crossing) => drop(text.str("Crosses").word(crossing.name())),
            Answer::Here(presence) => {
                text.str("AmIThere");
                if let Some(place) = about {
                    let there = atlas.there(&presence, place);
                    tell::there(text.word(&name(place)), &there);
                } else {
                    text.integer(map.places().count() as i64);
                    self.listing = Some(Listing::There(presence, 0));
                }
            }
        }
    }
}

fn find(atlas: &Atlas, name: &Name) -> Result<PlaceId, Error> {
    let place = atlas.map().find(name);
    place.ok_or(Error::Map(MapError::Place))
}

/// `Map <places> <landmarks> <arcs> <anchor>`; the rows come after that.
#[inline(never)]
fn list(atlas: &Atlas, text: &mut Text) {
    let map = atlas.map();
    let landmarks = map.places().map(|(_, place)| place.landmarks.len());
    text.str("Map")
        .integer(map.places().count() as i64)
        .integer(landmarks.sum::<usize>() as i64)
        .integer(map.arcs().len() as i64);
    match atlas.anchor().and_then(|place| map.place(place)) {
        Some(anchor) => text.word(&anchor.name),
        None => text.word("-"),
    };
}

/// Writes a row, if there is one left; gives what is left then.
#[inline(never)]
fn row(atlas: &Atlas, mut listing: Listing, text: &mut Text) -> Option<Listing> {
    let map = atlas.map();
    let name = |place| map.place(place).map(|place| place.name).unwrap_or_default();
    loop {
        match listing {
            Listing::There(presence, next) => {
                let (place, known) = map.places().nth(next)?;
                text.str("~ there").word(&known.name);
                tell::there(text, &atlas.there(&presence, place));
                return Some(Listing::There(presence, next + 1));
            }
            Listing::Place(next) => {
                let Some((_, place)) = map.places().nth(next) else {
                    listing = Listing::Arc(0);
                    continue;
                };
                tell::place(text, place);
                return Some(Listing::Landmark(next, 0));
            }
            Listing::Landmark(at, next) => {
                let (_, place) = map.places().nth(at)?;
                let Some(landmark) = place.landmarks.get(next) else {
                    listing = Listing::Place(at + 1);
                    continue;
                };
                tell::landmark(text, place, landmark);
                return Some(Listing::Landmark(at, next + 1));
            }
            Listing::Arc(next) => {
                let arc = map.arcs().get(next)?;
                tell::arc(text, arc, &name(arc.from), &name(arc.to));
                return Some(Listing::Arc(next + 1));
            }
            Listing::Route(ref route, next) => {
                let place = *route.get(next)?;
                text.str("~ route").word(&name(place));
                let route = route.clone();
                return Some(Listing::Route(route, next + 1));
            }
        }
    }
}
