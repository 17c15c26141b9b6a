//! What is known of paths and chases: events are told before the replies of lines that come after what they tell.

use super::{Rows, Session};
use crate::grammar::{Codes, Doubts, Route};
use crate::replies::{self, PathEvent};
use vehicle_controller::params::Id;

/// So many postures have room.
const ROOM: usize = 32;

/// What the base is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Errand {
    Idle,
    Path,
    Chase,
}

/// The queue, and what the base is about; nothing where nobody has listened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    queued: Option<usize>,
    errand: Option<Errand>,
    /// So many postures of this path have been passed.
    passed: Option<u64>,
    /// So many that were replaced are not told yet.
    replaced: Option<usize>,
    /// A path or a chase was ended by a command of one axis: the other one is brought to rest without being asked for it.
    settles: bool,
}

impl Known {
    /// Of a base that has just started.
    pub(super) const NEW: Self = Self {
        queued: Some(0),
        errand: Some(Errand::Idle),
        passed: Some(0),
        replaced: Some(0),
        settles: false,
    };
    /// Of one that nobody has listened to.
    pub(super) const NOTHING: Self = Self {
        queued: None,
        errand: None,
        passed: None,
        replaced: None,
        settles: true,
    };

    /// True if the base may be commanded without a line that asks for it.
    pub(super) fn may_drive(self) -> bool {
        self.errand != Some(Errand::Idle) || self.settles
    }

    /// True if nothing that has happened is still to be told.
    pub(super) fn all_told(self) -> bool {
        self.replaced.is_none_or(|replaced| replaced == 0)
    }

    /// The base was commanded: if something was to be brought to rest, it was that, or it has been taken over.
    pub(super) fn settle(&mut self) {
        self.settles = false;
    }

    fn begin(&mut self, errand: Errand) {
        self.replaced = match self.errand {
            Some(Errand::Idle) => self.replaced,
            Some(_) => self.replaced.map(|replaced| replaced + 1),
            None => None,
        };
        self.errand = Some(errand);
        self.passed = Some(0);
    }
}

impl Session<'_> {
    pub(super) fn judge_route(&self, route: Route, doubts: &mut Doubts) {
        let snapshot = self.base.snapshot();
        let queued = self.route.queued;
        match route {
            Route::GoTo | Route::Start | Route::Chase => {
                doubts.must.add_if(snapshot.fault.is_some(), Codes::FAULT);
                doubts.must.add_if(!snapshot.enabled, Codes::DISABLED);
                let needed = [
                    Id::MoveSpeed,
                    Id::MoveAccel,
                    Id::TurnSpeed,
                    Id::TurnAccel,
                    Id::MaxWheelSpeed,
                ];
                let still = needed.iter().any(|id| self.params.get(*id) == 0.0);
                let starts = route == Route::Start;
                // A path under way goes on, and nothing is planned.
                let goes_on = starts && self.route.errand == Some(Errand::Path);
                let may_go_on = starts && self.route.errand.is_none();
                doubts
                    .must
                    .add_if(still && !goes_on && !may_go_on, Codes::RANGE);
                doubts.may.add_if(still && may_go_on, Codes::RANGE);
                doubts
                    .must
                    .add_if(starts && queued == Some(0), Codes::RANGE);
                doubts.may.add_if(starts && queued.is_none(), Codes::RANGE);
            }
            Route::Append(speed) => {
                if let Some(speed) = speed {
                    let max = f64::from(self.params.limits().speed);
                    doubts.limit(speed, 0.001, max);
                }
                doubts.must.add_if(queued == Some(ROOM), Codes::FULL);
                doubts.may.add_if(queued.is_none(), Codes::FULL);
            }
            Route::Clear => {}
        }
    }

    /// A command was obeyed; true if it stops the base.
    pub(super) fn obeyed_route(&mut self, route: Route) -> bool {
        let known = &mut self.route;
        match route {
            Route::GoTo => {
                known.queued = Some(1);
                known.begin(Errand::Path);
            }
            Route::Start if known.errand == Some(Errand::Path) => {}
            Route::Start if known.errand.is_none() => {
                *known = Known {
                    errand: Some(Errand::Path),
                    passed: None,
                    replaced: None,
                    ..*known
                };
            }
            Route::Start => known.begin(Errand::Path),
            Route::Chase if known.errand == Some(Errand::Chase) => {}
            Route::Chase => known.begin(Errand::Chase),
            Route::Append(_) => known.queued = known.queued.map(|queued| queued + 1),
            Route::Clear => {
                known.queued = Some(0);
                return known.errand.is_some_and(|errand| errand != Errand::Idle);
            }
        }
        false
    }

    /// Hears `Path n <errand>`, with n rows to follow.
    pub(super) fn hear_path(&mut self, reply: &str) {
        let (count, errand) = replies::path(reply);
        let errand = match errand {
            "path" => Errand::Path,
            "chase" => Errand::Chase,
            _ => Errand::Idle,
        };
        let first = if errand == Errand::Path {
            self.route.passed.map(|passed| passed + 1)
        } else {
            Some(1)
        };
        self.rows = Rows::Path(first, count);
        if self.stale || self.framing_only {
            self.rows = Rows::Path(None, count);
            return;
        }
        let Known {
            queued,
            errand: known,
            ..
        } = self.route;
        assert!(
            queued.is_none_or(|queued| queued == count)
                && known.is_none_or(|known| known == errand),
            "{reply}, not {:?}",
            self.route
        );
        self.route.queued = Some(count);
        self.route.errand = Some(errand);
    }

    /// Hears what is told of a path or a chase; nothing else is told of its own moves.
    pub(super) fn hear_event(&mut self, line: &str) {
        if self.stale {
            return;
        }
        let known = &mut self.route;
        let Some(event) = replies::path_event(line) else {
            let is_own = line.starts_with("! move done") || line.starts_with("! turn done");
            let idle = known.errand.is_none_or(|errand| errand == Errand::Idle);
            assert!(idle || !is_own, "{line} of {known:?}");
            return;
        };
        let its = |errand| known.errand.is_none_or(|known| known == errand);
        match event {
            PathEvent::Posture(number) => {
                let next = known.passed.is_none_or(|passed| passed + 1 == number);
                // The last one is never told so.
                let left = known.queued.is_none_or(|queued| queued > 1);
                assert!(its(Errand::Path) && next && left, "{line} of {known:?}");
                known.passed = Some(number);
                known.queued = known.queued.map(|queued| queued - 1);
            }
            PathEvent::Done => {
                let left = known.queued.is_none_or(|queued| queued == 1);
                assert!(its(Errand::Path) && left, "{line} of {known:?}");
                known.queued = Some(0);
                known.errand = Some(Errand::Idle);
            }
            PathEvent::End(_, "replaced") => {
                let is_due = known.replaced.is_none_or(|replaced| replaced > 0);
                assert!(is_due, "{line} of {known:?}");
                known.replaced = known.replaced.map(|replaced| replaced - 1);
            }
            PathEvent::End(chases, reason) => {
                let errand = if chases { Errand::Chase } else { Errand::Path };
                assert!(its(errand), "{line} of {known:?}");
                known.errand = Some(Errand::Idle);
                known.settles = matches!(reason, "move" | "turn");
            }
        }
    }
}
