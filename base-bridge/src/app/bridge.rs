//! The bridge's state, and what the line does to it.

use super::diagnostics::Counters;
use super::schedule::Rate;
use crate::client::{Answer, Ask, Client, Heard, Outcome};
use crate::clock::Clock;
use crate::commands::velocity::{Limits, Order};
use crate::commands::{Refusal, Velocity};
use crate::line::keeper::{LineEvent, Wire};
use crate::line::splitter::{Piece, Splitter};
use crate::network::{Received, Reply};
use crate::params::Params;
use crate::robot::handshake::Progress;
use crate::robot::{Estimate, Field, Handshake, Knowledge, Telemetry, Vehicle};
use crate::time::Epoch;
use ros_messages::base::covariance::SpeedNoise;
use ros_messages::base::frames::Frames;
use ros_messages::base::{Names, Report};
use std::collections::BTreeMap;

/// An open line on which telemetry is silent for this, s, is as good as lost. At slow rates, for four of its periods.
const SILENCE: f64 = 1.0;
/// A base that streams, and has not answered so many lines in a row, does not hear. There are at least two a second.
const UNANSWERED: u64 = 8;
/// A deadman that takes longer than this, s, is no protection.
const LOOSE: f64 = 2.0;
/// What it does not go beyond.
const LIMITS: [&str; 3] = ["max_speed", "max_turn_speed", "max_wheel_speed"];
/// Its state is asked for this often, Hz: flags, which telemetry does not have.
const STATUS_RATE: f64 = 2.0;

/// The line.
pub(super) enum Link {
    /// Not there.
    Down,
    /// Open; what the base is, is not known yet.
    Greeting(Wire, Box<Handshake>),
    /// The base is known, since then.
    Up(Wire, f64),
}

/// Everything.
pub(super) struct Bridge {
    pub(super) params: Params,
    /// Of joints, which a report has by name.
    pub(super) names: Names,
    pub(super) epoch: Epoch,
    /// What the line is called.
    pub(super) door: String,
    pub(super) link: Link,
    splitter: Splitter,
    pub(super) client: Client,
    pub(super) velocity: Velocity,
    pub(super) clock: Clock,
    pub(super) frames: Frames,
    pub(super) version: String,
    pub(super) base: Knowledge,
    fields: Vec<Field>,
    pub(super) noise: SpeedNoise,
    pub(super) estimate: Option<Estimate>,
    pub(super) told: Option<Telemetry>,
    /// Words of `GetStatus`: states and flags.
    pub(super) status: Option<String>,
    /// When the last telemetry came.
    heard: f64,
    /// How many lines had not been answered when the last answer came.
    unanswered: u64,
    /// When somebody last told the base to stop, or to go somewhere: what was said before that moves it no more.
    pub(super) stopped: f64,
    /// Since the last telemetry the estimate may have been corrected.
    pub(super) corrected: bool,
    /// Poses that wait until it is known where `odom` is.
    pub(super) held: Vec<Received>,
    pub(super) counters: Counters,
    pub(super) refused: BTreeMap<(&'static str, Refusal), u64>,
    /// Who waits for which answer.
    pub(super) replies: BTreeMap<u64, Reply>,
    estimate_rate: Rate,
    status_rate: Rate,
    pub(super) joints_rate: Rate,
    pub(super) battery_rate: Rate,
    pub(super) diagnostics_rate: Rate,
    pub(super) reports: Vec<Report>,
    words: Vec<String>,
    pub(super) leaving: bool,
}

impl Bridge {
    pub(super) fn new(params: Params, epoch: Epoch, door: String) -> Self {
        // A client that was here a moment ago may still be answered: the first tag should be another one.
        let first_tag = (epoch.wall_offset() / 1_000_000 % 1000) as u16;
        let velocity = Velocity::new(params.cmd_vel_timeout);
        Self {
            client: Client::new(first_tag, params.baud as u32),
            velocity,
            estimate_rate: Rate::new(params.rate_covariance),
            status_rate: Rate::new(STATUS_RATE),
            joints_rate: Rate::new(params.rate_joints),
            battery_rate: Rate::new(params.rate_battery),
            diagnostics_rate: Rate::new(params.rate_diagnostics),
            names: params.names("", ""),
            params,
            epoch,
            door,
            link: Link::Down,
            splitter: Splitter::default(),
            clock: Clock::default(),
            frames: Frames::new(0.0),
            version: String::new(),
            base: Knowledge::default(),
            fields: Vec::new(),
            noise: SpeedNoise::default(),
            estimate: None,
            told: None,
            status: None,
            heard: 0.0,
            unanswered: 0,
            stopped: f64::NEG_INFINITY,
            corrected: false,
            held: Vec::new(),
            counters: Counters::default(),
            refused: BTreeMap::new(),
            replies: BTreeMap::new(),
            reports: Vec::new(),
            words: Vec::new(),
            leaving: false,
        }
    }

    /// What is to be published.
    pub(super) fn reports(&mut self) -> Vec<Report> {
        std::mem::take(&mut self.reports)
    }

    /// What a person might want to read.
    pub(super) fn words(&mut self) -> Vec<String> {
        std::mem::take(&mut self.words)
    }

    pub(super) fn say(&mut self, words: impl Into<String>) {
        self.words.push(words.into());
    }

    /// Something happens to the line.
    pub(super) fn line(&mut self, event: LineEvent, now: f64) {
        match event {
            LineEvent::Up(wire) => {
                self.counters.opened += 1;
                self.greet(wire, now);
            }
            LineEvent::Bytes(bytes, arrival) => {
                if matches!(self.link, Link::Down) {
                    // Left over from a line that was given up.
                    return;
                }
                self.counters.bytes_in += bytes.len() as u64;
                for piece in self.splitter.push(&bytes) {
                    match piece {
                        Piece::Line(line) => self.hear(&line, arrival, now),
                        Piece::Damaged => self.counters.damaged += 1,
                    }
                }
            }
            LineEvent::Down(why) => self.lose(&why),
        }
    }

    /// Begins to talk to a base of which nothing is known any more.
    fn greet(&mut self, mut wire: Wire, now: f64) {
        self.forget();
        // It ends whatever half a line is left on the wire, and makes it a wrong one: behind a star a base wants a check.
        let hung_up = wire.write(b"*\n").is_err();
        let period = 1.0 / self.params.rate_odom;
        self.client.expect_checks(false);
        let checks = self.params.line_checks;
        let handshake = Handshake::begin(&mut self.client, period, checks, now);
        self.link = Link::Greeting(wire, Box::new(handshake));
        if hung_up {
            self.lose("it takes no bytes");
        } else if self.leaving {
            self.take_leave();
        }
    }

    /// Nothing that was asked for before is ever sent.
    fn forget(&mut self) {
        // A correction that was under way may have been made.
        self.corrected |= self.is_correcting();
        self.client.lost();
        self.velocity.forget();
        self.splitter.clear();
        self.estimate = None;
        self.status = None;
        self.told = None;
        self.take_held();
    }

    /// The line is lost, or given up.
    pub(super) fn lose(&mut self, why: &str) {
        let was_there = !matches!(self.link, Link::Down);
        self.link = Link::Down;
        self.forget();
        if was_there {
            self.counters.lost += 1;
            self.diagnostics_rate.hurry();
        }
        if self.counters.why != why {
            why.clone_into(&mut self.counters.why);
            self.say(format!("line lost: {why}"));
        }
    }

    fn hear(&mut self, line: &str, arrival: f64, now: f64) {
        // A base that starts anew in the middle of a line goes on with this one.
        if let Some((_, event)) = line.split_once("! boot ") {
            return self.boot(event, now);
        }
        match self.client.hear(line) {
            Heard::Answers(answers) => self.answers(answers, now),
            Heard::Event(event) if event.starts_with("fault") => self.say(event),
            Heard::Event(_) => {}
            Heard::Row(row) => {
                // What streams before the base is known is what somebody else has asked for.
                if self.up_since().is_some() {
                    // Its last byte came when it came; the first, as many byte times before.
                    let length = (line.len() + 2) as f64 * 10.0 / f64::from(self.params.baud);
                    self.row(&row, arrival - length, now);
                }
            }
            Heard::Damaged => self.counters.damaged += 1,
            Heard::Stray => self.counters.strays += 1,
        }
    }

    fn answers(&mut self, answers: Vec<Answer>, now: f64) {
        for answer in answers {
            if matches!(answer.outcome, Outcome::Reply(_) | Outcome::Refused(_)) {
                self.unanswered = self.client.unanswered();
            }
            if let Link::Greeting(_, handshake) = &mut self.link
                && !self.leaving
            {
                let progress = handshake.hear(&answer, &mut self.client);
                self.progress(progress, now);
            }
            self.answer(answer);
        }
    }

    fn answer(&mut self, answer: Answer) {
        // Between the last telemetry and the next there was a correction.
        self.corrected |= answer.ask.corrects();
        if let Outcome::Refused(why) = &answer.outcome {
            self.counters.refused(why);
            if matches!(answer.ask, Ask::Move | Ask::Turn) && why.starts_with("range") {
                self.doubt_limits(why);
            }
        }
        let replaced = answer.outcome == Outcome::NotSent;
        let result = match answer.outcome {
            Outcome::Reply(text) => Ok(text),
            Outcome::Refused(why) => Err(why),
            Outcome::Unanswered => Err("the base does not answer".to_owned()),
            Outcome::NotSent => {
                Err("not sent: a Stop or a newer one came first, or there were too many".to_owned())
            }
            Outcome::Lost => Err("the line is lost".to_owned()),
        };
        // Neither the topics nor the service have an answer that could tell. A newer one speaks for itself.
        match (answer.ask, &result) {
            (Ask::Reset, Err(why)) if !replaced => self.say(format!("the pose is not set: {why}")),
            (Ask::GoTo, Err(why)) if !replaced => self.say(format!("no way to the goal: {why}")),
            _ => {}
        }
        match (self.replies.remove(&answer.number), answer.ask, result) {
            (Some(reply), _, result) => reply(result),
            (None, Ask::Estimate, Ok(text)) => {
                self.estimate = Estimate::parse(&text).or(self.estimate);
            }
            (None, Ask::Status, Ok(text)) => {
                self.status = text.strip_prefix("Status ").map(str::to_owned);
            }
            (None, Ask::Params, Ok(text)) if self.up_since().is_some() => {
                if let Some(row) = text.strip_prefix("Param ") {
                    self.learn(row);
                }
            }
            _ => {}
        }
    }

    /// The base refuses a speed that should be possible: somebody has changed its limits. It must not go on with the speed of before.
    fn doubt_limits(&mut self, why: &str) {
        // What somebody has told it since then has ended that speed.
        if !self.velocity.is_driving() || self.up_since().is_none() {
            return;
        }
        self.velocity.forget();
        self.client.stop();
        if !self.client.has(Ask::Params) {
            self.say(format!(
                "the base refuses a speed: {why}; its limits are asked for anew"
            ));
            for limit in LIMITS {
                self.client.ask(Ask::Params, format!("GetParam {limit}"));
            }
        }
    }

    /// Takes a parameter that was asked for anew.
    fn learn(&mut self, row: &str) {
        let before = self.base.clone();
        if self.base.note(row) && self.base != before {
            self.set_limits();
            // It may still be as fast as before.
            let speeds = [&before, &self.base].map(|base| base.or_zero("max_speed"));
            self.frames.set_max_speed(speeds[0].max(speeds[1]));
            self.say(format!("the base has changed: {row}"));
        }
    }

    fn progress(&mut self, progress: Progress, now: f64) {
        match progress {
            Progress::Going => {}
            Progress::Failed(why) => self.lose(&format!("{}: {why}", self.door)),
            Progress::Done => {
                let link = std::mem::replace(&mut self.link, Link::Down);
                if let Link::Greeting(wire, handshake) = link {
                    self.known(&handshake);
                    self.link = Link::Up(wire, now);
                    self.heard = now;
                    self.clock.resume();
                    self.client.expect_checks(self.params.line_checks);
                    self.counters.why.clear();
                    self.counters.begin(self.client.unanswered());
                    self.say(format!("{}: {}", self.door, self.version));
                    self.estimate_rate.hurry();
                    self.diagnostics_rate.hurry();
                }
            }
        }
    }

    fn known(&mut self, handshake: &Handshake) {
        handshake.version().clone_into(&mut self.version);
        self.base = handshake.knowledge().clone();
        self.fields = handshake.fields().to_vec();
        self.set_limits();
        self.frames.set_max_speed(self.base.or_zero("max_speed"));
        self.noise = SpeedNoise::of(&self.base);
        if let Some(deadman) = self.loose_deadman() {
            self.say(format!(
                "deadman is {deadman} s: the base runs on when this bridge or its cable is gone"
            ));
        }
    }

    fn set_limits(&mut self) {
        let base = &self.base;
        // A wheel of two goes at v ± ω b/2. Steered vehicles slow down by themselves where their geometry asks for it.
        let wheel = (base.vehicle() == Vehicle::Differential)
            .then(|| Some((base.get("max_wheel_speed")?, base.get("wheel_base")? / 2.0)));
        self.velocity.set_limits(Limits {
            speed: base.or_zero("max_speed"),
            turn_speed: base.or_zero("max_turn_speed").to_radians(),
            wheel: wheel.flatten(),
        });
    }

    /// The base's deadman, if it does not stop the base soon. 0: it never does.
    pub(super) fn loose_deadman(&self) -> Option<f64> {
        let deadman = self.base.get("deadman")?;
        (deadman == 0.0 || deadman > LOOSE).then_some(deadman)
    }

    fn boot(&mut self, cause: &str, now: f64) {
        self.say(format!("the base has started: {cause}"));
        self.clock.reset();
        self.frames.restart();
        // It streams no more, and its parameters may be others.
        match std::mem::replace(&mut self.link, Link::Down) {
            Link::Greeting(wire, _) | Link::Up(wire, _) => self.greet(wire, now),
            Link::Down => {}
        }
    }

    fn row(&mut self, row: &str, sent: f64, now: f64) {
        let Some(told) = Telemetry::parse(row, &self.fields) else {
            self.counters.damaged += 1;
            return;
        };
        self.heard = now;
        let corrected = std::mem::take(&mut self.corrected) || self.is_correcting();
        let fault = self.told.as_ref().map(|told| told.fault.clone());
        if fault.is_none_or(|fault| fault != told.fault) {
            self.diagnostics_rate.hurry();
            // Its event was sent while nobody listened.
            if told.fault.as_deref() == Some("link") {
                self.say("the base has stopped, fault link: the service clear_fault clears it");
            }
        }
        self.publish_row(&told, sent, corrected);
        self.told = Some(told);
        self.release();
    }

    /// A correction waits, or is under way: it may have been made already, though its reply has not come.
    pub(super) fn is_correcting(&self) -> bool {
        self.client.has(Ask::Observe) || self.client.has(Ask::Reset)
    }

    /// Since when the base is known.
    pub(super) fn up_since(&self) -> Option<f64> {
        match self.link {
            Link::Up(_, since) => Some(since),
            _ => None,
        }
    }

    /// Looks at all deadlines, and sends what is to be sent.
    pub(super) fn go_on(&mut self, now: f64) {
        let ended = self.client.ended(now);
        self.answers(ended, now);
        if let Link::Greeting(_, handshake) = &mut self.link
            && !self.leaving
        {
            let progress = handshake.look(now);
            self.progress(progress, now);
        }
        if self.up_since().is_some() {
            match self.missing(now) {
                Some(missing) => {
                    // It may hear, though it is not heard.
                    self.velocity.forget();
                    self.client.stop();
                    self.send(now);
                    self.lose(&format!("{}: no {missing}", self.door));
                }
                None => self.speak(now),
            }
        }
        self.send(now);
        if self.diagnostics_rate.is_due(now, 0.0) {
            self.publish_diagnostics(now);
        }
    }

    /// What does not come from a base that is known.
    fn missing(&self, now: f64) -> Option<&'static str> {
        if now - self.heard > SILENCE.max(4.0 / self.params.rate_odom) {
            Some("telemetry")
        } else if self.client.unanswered() >= self.unanswered + UNANSWERED {
            Some("answers")
        } else {
            None
        }
    }

    /// What is to be said to a base that is known.
    fn speak(&mut self, now: f64) {
        if self.leaving {
            return;
        }
        for order in self.velocity.orders(now) {
            match order {
                Order::Move(line) => self.client.ask(Ask::Move, line),
                Order::Turn(line) => self.client.ask(Ask::Turn, line),
                Order::Stop => self.client.stop(),
            };
        }
        if !self.client.has(Ask::Estimate) && self.estimate_rate.is_due(now, 0.0) {
            self.client.ask(Ask::Estimate, "GetEstPos");
        }
        if !self.client.has(Ask::Status) && self.status_rate.is_due(now, 0.0) {
            self.client.ask(Ask::Status, "GetStatus");
        }
    }

    fn send(&mut self, now: f64) {
        let mut stuck = None;
        if let Link::Greeting(wire, _) | Link::Up(wire, _) = &mut self.link {
            while let Some(line) = self.client.next(now) {
                self.counters.bytes_out += line.len() as u64;
                if let Err(error) = wire.write(&line) {
                    stuck = Some(error);
                    break;
                }
            }
        }
        if let Some(error) = stuck {
            self.lose(&format!("{}: {error}", self.door));
        }
    }

    /// When there is something to do, if nothing happens.
    pub(super) fn next_deadline(&self, now: f64) -> f64 {
        // One that is under way is asked again when its answer has come.
        let poll = |ask, rate: &Rate| {
            let idle = self.up_since().is_some() && !self.client.has(ask);
            if idle { rate.next() } else { f64::INFINITY }
        };
        let rates =
            poll(Ask::Status, &self.status_rate).min(poll(Ask::Estimate, &self.estimate_rate));
        let client = self.client.next_deadline().unwrap_or(f64::INFINITY);
        let velocity = self.velocity.next_deadline().unwrap_or(f64::INFINITY);
        let next = rates
            .min(client)
            .min(velocity)
            .min(self.diagnostics_rate.next());
        // Whatever is overdue and cannot be done must not make the loop spin.
        next.max(now + 0.001)
    }

    /// The process ends: the base is stopped.
    pub(super) fn leave(&mut self) {
        self.leaving = true;
        self.take_held();
        self.velocity.forget();
        self.take_leave();
    }

    fn take_leave(&mut self) {
        self.client.stop();
        // A base that was just being greeted may have been told to ask for checks.
        if self.params.line_checks && !matches!(self.link, Link::Down) {
            self.client.ask(Ask::Params, "SetParam require_crc 0");
        }
    }

    /// There is nothing more to wait for.
    pub(super) fn has_left(&self) -> bool {
        match self.link {
            // It may be opened anew in time: a base that goes to a goal goes on without a line.
            Link::Down => self.counters.opened == 0,
            _ => !self.client.is_stopping() && !self.client.has(Ask::Params),
        }
    }
}
