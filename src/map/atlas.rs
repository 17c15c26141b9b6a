//! The map at work: it records what the base does, and answers where it may be.
//!
//! Every question takes a chain of bounds in f64, some 10 000 instructions a link on a small processor. So questions are answered piece by piece:
//!
//! ```text
//!     ask ──▶ relate ──▶ reach ──┬──▶ judge ──▶ check ──▶ apply ──▶ answer
//!             the places, as     │    each place that may be the one;
//!             seen from the      │    backward, first to see that it can be, then for good
//!             journey's start    ├──▶ cross ──▶ answer
//!                                └──▶ answer
//! ```
//!
//! The base may go on meanwhile: a question is of the instant at which it was asked, and what is done after that is kept apart until it is answered.

use super::trail::Trail;
use super::{
    Answer, Backward, Bounds, Crossing, Cylinder, Disc, Gaussian, Heading, Journey, Leg, Map,
    MapError, PlaceId, Presence, Question, Reach, Relations, There, crossing,
};
use crate::controller::{Estimator, Stretch};
use heapless::Vec;

/// How many motions between two stops are kept apart.
const MOTIONS: usize = 10;
/// The same, while a question is being answered.
const FEW: usize = 2;

/// Where an answer stands.
#[derive(Clone, Copy, Debug, PartialEq)]
// So that the first one is all zeros.
#[repr(u8)]
pub(super) enum Stage {
    /// Nothing was asked.
    Idle,
    Relate,
    Reach(Reach),
    Judge(Judged),
    Check(Claim, Backward),
    Apply(Claim, Backward),
    /// As seen from the places before this one of the four, they may.
    Cross(usize),
    Done(Result<Answer, MapError>),
}

/// The places that have been judged so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Judged {
    pub(super) next: usize,
    /// The first one that fits, and how many do.
    pub(super) found: Option<Claim>,
    pub(super) fitting: usize,
}

/// That the base is at a place, and what is known of its pose in the place's frame then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Claim {
    pub(super) place: PlaceId,
    pub(super) seen: Cylinder,
}

/// A question, and what was known when it was asked.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Asked {
    pub(super) question: Question,
    /// What had been done since the last stop.
    pub(super) arc: Leg,
    pub(super) likely_arc: Gaussian,
    /// Where the base was, as seen from the start of the journey.
    pub(super) here: Cylinder,
    pub(super) likely_here: Gaussian,
    /// What has been done since.
    pub(super) since: Trail<FEW>,
}

/// The places where a journey stopped, and where each most likely is. Where it began within a meadow there is none.
#[derive(Clone, Debug)]
pub(super) struct Stops<const STOPS: usize>(pub(super) Vec<(Option<PlaceId>, Gaussian), STOPS>);

impl<const STOPS: usize> Stops<STOPS> {
    const fn new() -> Self {
        Self(Vec::new())
    }
}

/// The map of a base, its drive, and its reasoning.
///
/// ```
/// use vehicle_controller::controller::{Estimator, Noise};
/// use vehicle_controller::map::{Answer, Atlas, Bounds, Name, Question};
/// use vehicle_controller::vehicle::Twist;
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut estimator = Estimator::new(Noise::default());
/// let bounds = Bounds { turn: 0.09, turn_per_metre: 0.01, distance: 0.05, distance_share: 0.05 };
/// let mut atlas: Atlas = Atlas::new();
/// let name = Name::try_from("door")?;
/// atlas.ask(Question::Mark(name, Some(0.3)), &estimator, &bounds);
/// while atlas.work() {}
/// assert!(matches!(atlas.answer(), Some(Ok(Answer::Marked(_)))));
///
/// // Two metres ahead, a millimetre a tick.
/// for _ in 0..2000 {
///     estimator.advance(Twist { translation: 0.001, rotation: 0.0 }, Twist::ZERO);
///     atlas.update(&estimator, &bounds);
/// }
/// atlas.ask(Question::Where, &estimator, &bounds);
/// while atlas.work() {}
/// let Some(Ok(Answer::Here(presence))) = atlas.answer() else { panic!() };
/// let door = atlas.map().find("door").ok_or("it was marked")?;
/// assert!(!atlas.there(&presence, door).is_plausible);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Atlas<const PLACES: usize = 32, const ARCS: usize = 96, const STOPS: usize = 33> {
    pub(super) map: Map<PLACES, ARCS>,
    pub(super) relations: Relations<PLACES>,
    /// The place in whose frame the journey began. `None` if nobody knows.
    pub(super) anchor: Option<PlaceId>,
    pub(super) journey: Journey<STOPS>,
    pub(super) stops: Stops<STOPS>,
    /// Since the last stop.
    pub(super) trail: Trail<MOTIONS>,
    /// Where the journey most likely began, and what it has done since.
    pub(super) origin: Gaussian,
    pub(super) whole: Stretch,
    pub(super) asked: Asked,
    stage: Stage,
}

impl<const PLACES: usize, const ARCS: usize, const STOPS: usize> Default
    for Atlas<PLACES, ARCS, STOPS>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<const PLACES: usize, const ARCS: usize, const STOPS: usize> Atlas<PLACES, ARCS, STOPS> {
    /// A map of nothing, of a base that has just started. It is all zeros, so that one that is made before the program starts takes room in RAM alone.
    #[must_use]
    pub const fn new() -> Self {
        const {
            assert!(
                STOPS > PLACES,
                "a journey stops once at each place, and where it is"
            );
        };
        Self {
            map: Map::new(),
            relations: Relations::new(),
            anchor: None,
            journey: Journey::new(),
            stops: Stops::new(),
            trail: Trail::new(),
            origin: Gaussian::HERE,
            whole: Stretch::START,
            asked: Asked {
                question: Question::Where,
                arc: Leg::HERE,
                likely_arc: Gaussian::HERE,
                here: Cylinder::HERE,
                likely_here: Gaussian::HERE,
                since: Trail::new(),
            },
            stage: Stage::Idle,
        }
    }

    /// The places and arcs.
    #[must_use]
    pub fn map(&self) -> &Map<PLACES, ARCS> {
        &self.map
    }

    /// The place in whose frame the journey began.
    #[must_use]
    pub fn anchor(&self) -> Option<PlaceId> {
        self.anchor
    }

    /// The journey since.
    #[must_use]
    pub fn journey(&self) -> &Journey<STOPS> {
        &self.journey
    }

    /// Takes in what the base has done. Call it after each tick, or as often as there is time for: between two calls its way should not be more than some
    /// millimetres.
    #[inline(never)]
    pub fn update(&mut self, estimator: &Estimator, bounds: &Bounds) {
        if !estimator.is_finite() {
            // Nobody knows any more what it has done.
            self.lose();
        }
        self.trail.advance(estimator, bounds);
        let _ = self.whole.advance(estimator);
        if self.is_busy() {
            self.asked.since.advance(estimator, bounds);
        }
    }

    /// Forgets the map, and where the base is.
    pub fn forget(&mut self) {
        self.map.forget();
        self.lose();
    }

    /// Forgets where the base is, and what was asked.
    pub fn lose(&mut self) {
        self.anchor = None;
        self.journey.restart();
        self.stops.0.clear();
        self.relations.begin(None);
        self.stage = Stage::Idle;
    }

    /// Remembers that a landmark is seen from a place.
    ///
    /// # Errors
    /// As for [`Map::label`].
    pub fn label(&mut self, place: PlaceId, landmark: &str) -> Result<(), MapError> {
        self.map.label(place, landmark, None)
    }

    /// Remembers a freeway.
    ///
    /// # Errors
    /// As for [`Map::set_freeway`].
    pub fn set_freeway(
        &mut self,
        a: PlaceId,
        b: PlaceId,
        width: Option<f32>,
    ) -> Result<(), MapError> {
        self.map.set_freeway(a, b, width)
    }

    /// Asks, in place of what was asked before: [`work`](Self::work) finds the answer.
    #[inline(never)]
    pub fn ask(&mut self, question: Question, estimator: &Estimator, bounds: &Bounds) {
        self.trail.read(estimator, bounds);
        let _ = self.whole.read(estimator);
        let whole = Gaussian::from(&self.whole.estimate(estimator));
        let arc = self.trail.recorder.bound();
        self.asked = Asked {
            question,
            arc,
            likely_arc: self.trail.likely(estimator),
            here: arc.there,
            likely_here: self.origin.then(&whole),
            since: Trail::begin(estimator),
        };
        self.stage = Stage::Relate;
    }

    /// True if something was asked whose answer has not been taken.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// The answer, once it is there; then the next question may come.
    pub fn answer(&mut self) -> Option<Result<Answer, MapError>> {
        let Stage::Done(answer) = self.stage else {
            return None;
        };
        self.stage = Stage::Idle;
        Some(answer)
    }

    /// Does a piece of what there is to do; false if nothing is. Call it whenever there is time.
    #[inline(never)]
    pub fn work(&mut self) -> bool {
        self.stage = match self.stage {
            Stage::Idle | Stage::Done(_) => return false,
            Stage::Relate => {
                if self.relate() {
                    Stage::Relate
                } else {
                    self.related()
                }
            }
            Stage::Reach(mut reach) => {
                if self.journey.look_on(&mut reach) {
                    Stage::Reach(reach)
                } else {
                    self.asked.here = reach.bound();
                    self.reached()
                }
            }
            Stage::Judge(judged) => self.judge(judged),
            Stage::Check(claim, backward) => self.check(claim, backward),
            Stage::Apply(claim, backward) => self.apply(claim, backward),
            Stage::Cross(frame) => self.cross(frame),
        };
        true
    }

    /// Settles one more place as seen from the start of the journey; false if all are.
    fn relate(&mut self) -> bool {
        if self.relations.root() != self.anchor {
            self.relations.begin(self.anchor);
        }
        !self.relations.is_complete() && self.relations.step(&self.map)
    }

    fn related(&mut self) -> Stage {
        if let Question::Crosses([first, ..]) = self.asked.question {
            self.relations.begin(Some(first));
            return Stage::Cross(0);
        }
        Stage::Reach(self.journey.look(&self.asked.arc.there))
    }

    fn reached(&mut self) -> Stage {
        match &self.asked.question {
            Question::Where => {
                let known = self
                    .anchor
                    .map(|_| (self.asked.here, self.asked.likely_here));
                Stage::Done(Ok(Answer::Here(Presence { known })))
            }
            Question::Mark(..) => self.mark(),
            Question::Sight(..) => self.sight(),
            Question::Crosses(_) => Stage::Cross(0),
        }
    }

    /// As seen from one of the four places, and from the next one if that does not tell.
    #[inline(never)]
    fn cross(&mut self, frame: usize) -> Stage {
        let Question::Crosses(places) = self.asked.question else {
            return Stage::Done(Err(MapError::Place));
        };
        if self.relations.step(&self.map) {
            return Stage::Cross(frame);
        }
        let seen = places.map(|place| self.relations.to(place));
        let crossing = match seen {
            [Some(a), Some(b), Some(c), Some(d)] => crossing(&a.disc, &b.disc, &c.disc, &d.disc),
            _ => Crossing::May,
        };
        let next = places.get(frame + 1);
        if let (Crossing::May, Some(next)) = (crossing, next) {
            self.relations.begin(Some(*next));
            return Stage::Cross(frame + 1);
        }
        self.relations.begin(None);
        Stage::Done(Ok(Answer::Crosses(crossing)))
    }

    /// Whether the base was at a place when [`Question::Where`] was asked; before anything else is.
    #[must_use]
    #[inline(never)]
    pub fn there(&self, presence: &Presence, place: PlaceId) -> There {
        let anywhere = There {
            is_plausible: true,
            probability: None,
        };
        let (Some(known), Some((here, likely))) = (self.map.place(place), &presence.known) else {
            return anywhere;
        };
        let meadow = Cylinder {
            disc: Disc::about(known.meadow),
            heading: Heading::ANY,
        };
        let (Some(relation), Some(frame)) = (
            self.relations.to(place),
            self.relations.likely(place, &self.map),
        ) else {
            return anywhere;
        };
        let is_plausible = relation.then(&meadow).meets(here);
        let probability = if is_plausible {
            frame.inverse().then(likely).within(known.meadow as f32)
        } else {
            0.0
        };
        There {
            is_plausible,
            probability: Some(probability),
        }
    }
}
