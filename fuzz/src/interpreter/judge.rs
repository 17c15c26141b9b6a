//! What the protocol says of a command that is well written: why it is refused, and what it does.

use vehicle_controller::controller::Snapshot;
use vehicle_controller::params::{Id, Kind, Params};
use vehicle_controller::supervisor::Fault;

use super::Session;
use crate::base;
use crate::grammar::{Ask, Calibrate, Codes, Doubts};
use crate::{invariant, replies};

/// The gains, and how well they are known.
const GAINS: [Id; 9] = [
    Id::GainRight,
    Id::GainLeft,
    Id::GainBase,
    Id::SpreadRr,
    Id::SpreadLr,
    Id::SpreadLl,
    Id::SpreadBr,
    Id::SpreadBl,
    Id::SpreadBb,
];

/// v and a of a command, and their limits.
const MOTION: [[Id; 4]; 2] = [
    [Id::MoveSpeed, Id::MoveAccel, Id::MaxSpeed, Id::MaxAccel],
    [
        Id::TurnSpeed,
        Id::TurnAccel,
        Id::MaxTurnSpeed,
        Id::MaxTurnAccel,
    ],
];

/// A default or a stop beyond what a command may ask for is refused.
const ORDERED: [(Id, Id); 6] = [
    (Id::MoveSpeed, Id::MaxSpeed),
    (Id::MoveAccel, Id::MaxAccel),
    (Id::StopAccel, Id::MaxAccel),
    (Id::TurnSpeed, Id::MaxTurnSpeed),
    (Id::TurnAccel, Id::MaxTurnAccel),
    (Id::StopTurnAccel, Id::MaxTurnAccel),
];

impl Session<'_> {
    /// Why a command that is well written must or may be refused now.
    pub(super) fn judge(&self, ask: Ask, doubts: &mut Doubts) {
        let snapshot = self.base.snapshot();
        if self.stale {
            // Then it was another time.
            for code in [
                Codes::RANGE,
                Codes::FAULT,
                Codes::DISABLED,
                Codes::MOVING,
                Codes::GATE,
                Codes::NOT_PSD,
                Codes::STORAGE,
                Codes::UNKNOWN,
                Codes::FULL,
                Codes::CONTRADICTION,
            ] {
                doubts.may.add(code);
            }
            return;
        }
        match ask {
            Ask::Motion(axis, [_, v, a]) => {
                let [v_id, a_id, v_max, a_max] = MOTION[axis];
                let [v_last, a_last] = self.given[axis];
                let get = |id| f64::from(self.params.get(id));
                let v = v.or(v_last).unwrap_or_else(|| get(v_id));
                let a = a.or(a_last).unwrap_or_else(|| get(a_id));
                doubts.limit(v, 0.0, get(v_max));
                doubts.limit(a, 0.0, get(a_max));
                doubts.must.add_if(a == 0.0, Codes::RANGE);
                doubts.must.add_if(snapshot.fault.is_some(), Codes::FAULT);
                doubts.must.add_if(!snapshot.enabled, Codes::DISABLED);
            }
            Ask::CorrectPos => {
                doubts.may.add(Codes::NOT_PSD);
                doubts.may.add(Codes::RANGE);
            }
            Ask::ResetPos(_, c) => {
                if !invariant::is_positive(c, 1e-3) {
                    doubts.must.add(Codes::NOT_PSD);
                }
                doubts
                    .may
                    .add_if(!invariant::is_positive(c, 0.0), Codes::NOT_PSD);
            }
            Ask::Observe(aged) => {
                doubts.may.add(Codes::NOT_PSD);
                // What comes out may be too large, or the past not known.
                doubts.may.add(Codes::RANGE);
                let _ = aged;
                doubts
                    .may
                    .add_if(self.params.get(Id::Gate) > 0.0, Codes::GATE);
            }
            Ask::SetParam(id, value) => self.judge_param(id, value, doubts),
            Ask::Plain("ClearFault") => {
                let lasts = snapshot.fault.is_some() && snapshot.fault_persists;
                doubts.must.add_if(lasts, Codes::FAULT);
            }
            Ask::Plain("ResetParams") => {
                doubts.must.add_if(snapshot.is_moving(), Codes::MOVING);
            }
            Ask::Plain("SaveParams" | "LoadParams") => {
                doubts.may.add(Codes::MOVING);
                doubts.may.add(Codes::STORAGE);
            }
            Ask::Calibrate(what @ (Calibrate::Reset | Calibrate::Straight)) => {
                doubts.must.add_if(snapshot.is_moving(), Codes::MOVING);
                // How far the last move went is not looked at here.
                let straight = what == Calibrate::Straight;
                doubts.may.add_if(straight, Codes::RANGE);
                let gated = self.params.get(Id::Gate) > 0.0;
                doubts.may.add_if(straight && gated, Codes::GATE);
            }
            Ask::Map(name, _) => {
                let doubted = snapshot.fault.is_some_and(Fault::doubts_odometry);
                let says_where = ["Mark", "Sight"].contains(&name);
                // Or it was asked before that fault, and has been worked out since.
                doubts.may.add_if(doubted && says_where, Codes::FAULT);
                // What is in the map is not looked at here.
                for code in [Codes::UNKNOWN, Codes::FULL, Codes::CONTRADICTION] {
                    doubts.may.add(code);
                }
            }
            Ask::Route(route) => self.judge_route(route, doubts),
            Ask::Plain(_)
            | Ask::Help
            | Ask::Stream
            | Ask::GetParam(_)
            | Ask::Calibrate(Calibrate::Learn(_)) => {}
        }
    }

    fn judge_param(&self, id: Id, value: f64, doubts: &mut Doubts) {
        let spec = id.spec();
        doubts.limit(value, f64::from(spec.min), f64::from(spec.max));
        // A limit itself is no doubt: numbers are compared as f32.
        let value = value as f32;
        if value == spec.min || value == spec.max {
            doubts.may = Codes::NONE;
        }
        let is_switch = matches!(spec.kind, Kind::Switch | Kind::Wiring);
        doubts
            .must
            .add_if(is_switch && value != 0.0 && value != 1.0, Codes::RANGE);
        let with = |other: Id| {
            if other == id {
                value
            } else {
                self.params.get(other)
            }
        };
        for (small, large) in ORDERED {
            if (small == id || large == id) && with(small) > with(large) {
                // By a hair, rounding decides.
                let hair = with(small) <= with(large) * 1.000_001;
                let doubt = if hair {
                    &mut doubts.may
                } else {
                    &mut doubts.must
                };
                doubt.add(Codes::RANGE);
            }
        }
        let geometry = matches!(spec.kind, Kind::Geometry | Kind::Wiring);
        let moving = self.base.snapshot().is_moving();
        doubts.must.add_if(geometry && moving, Codes::MOVING);
    }

    /// A command was obeyed: its reply tells what it must, and what it changes is changed. True if the controller is to do something.
    pub(super) fn obeyed(&mut self, ask: Ask, reply: &str) -> bool {
        if self.framing_only {
            self.params = *self.base.interpreter.params();
            self.note_limits();
            self.expect_rows(ask, reply);
            return false;
        }
        let snapshot: &Snapshot = self.base.snapshot();
        match ask {
            Ask::Help => {
                assert!(reply.starts_with("Help "), "{reply}");
                return false;
            }
            Ask::GetParam(id) => {
                if !self.stale {
                    replies::param(reply, &self.params, id);
                }
                return false;
            }
            Ask::Observe(_) => {
                let [distance] = replies::numbers(reply, "Observed", [6]);
                let gate = f64::from(self.params.get(Id::Gate));
                let inside = gate == 0.0 || self.stale || distance <= gate * 1.000_001 + 1e-6;
                assert!(distance >= 0.0 && inside, "{reply}, gate {gate}");
                self.learned();
                return true;
            }
            Ask::Plain("ListParams") => {
                assert_eq!(reply, format!("Params {}", Params::default().count()));
                self.expect_rows(ask, reply);
                return false;
            }
            Ask::Map(..) | Ask::Plain("GetMap") => {
                replies::of_map(ask, reply);
                self.expect_rows(ask, reply);
                return false;
            }
            Ask::Plain("GetPath") => {
                self.expect_rows(ask, reply);
                return false;
            }
            Ask::Plain(command) if command.starts_with("Get") || command == "Version" => {
                if !self.stale {
                    replies::of_snapshot(command, reply, snapshot);
                    invariant::check_estimate(&snapshot.estimator.present());
                }
                return false;
            }
            _ => assert_eq!(reply, "OK", "{ask:?}"),
        }
        match ask {
            Ask::Motion(axis, [_, v, a]) => {
                let [v_last, a_last] = &mut self.given[axis];
                *v_last = v.or(*v_last);
                *a_last = a.or(*a_last);
            }
            Ask::SetParam(id, value) if !self.stale => {
                let now = *self.base.interpreter.params();
                let set = now.get(id);
                let same = (f64::from(set) - value).abs() <= value.abs() * 1.3e-7 + 1e-40;
                assert!(same, "{ask:?} set {set}");
                if id.spec().kind == Kind::Geometry && set != self.params.get(id) {
                    // What was learned was learned of another geometry.
                    let doubted: Vec<_> = GAINS[3..].iter().map(|id| (*id, 0.0)).collect();
                    assert_eq!(self.params.set_all(&doubted), Ok(()), "{ask:?}");
                }
                // All others are as they were: it is compared as a whole.
                let kept = self.params.set(id, set);
                assert_eq!(kept, Ok(()), "{ask:?}");
                self.note_limits();
            }
            Ask::Plain("ResetParams") => {
                self.params = base::defaults().params;
                self.note_limits();
            }
            Ask::Plain("LoadParams") => {
                self.params = *self.base.interpreter.params();
                self.note_limits();
            }
            Ask::Route(route) => return self.obeyed_route(route),
            Ask::ResetPos(pose, _) if !self.stale => self.placed = Some(pose),
            Ask::Calibrate(Calibrate::Learn(learns)) => self.learns = learns,
            Ask::Calibrate(Calibrate::Straight) => self.take_gains(),
            Ask::Calibrate(Calibrate::Reset) => {
                let forgotten = GAINS.map(|id| (id, id.spec().default));
                assert_eq!(self.params.set_all(&forgotten), Ok(()), "{ask:?}");
            }
            _ => {}
        }
        !matches!(ask, Ask::Stream | Ask::Calibrate(Calibrate::Learn(_)))
    }

    /// An observation was taken.
    fn learned(&mut self) {
        if self.learns || self.stale {
            self.take_gains();
        }
    }

    /// The gains may be others now, and nothing else.
    fn take_gains(&mut self) {
        let now = *self.base.interpreter.params();
        let gains = GAINS.map(|id| (id, now.get(id)));
        assert_eq!(self.params.set_all(&gains), Ok(()), "learned");
    }
}
