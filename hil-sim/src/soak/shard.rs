//! A part of a soak: one base from power-on, driven at random for a while.

use super::book::Book;
use super::driver::{Driver, Wish};
use super::line::{Line, Said};
use super::mishaps::{Shove, fault, kind, log};
use super::sight::{Sight, Watched};
use super::tally::{Finding, Tally};
use super::watch::{Change, Watch};
use super::{Mode, Part};
use crate::faults::Fault as Mishap;
use crate::robot::Robot;
use anyhow::Result;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::{BTreeSet, VecDeque};
use std::fmt::Write;
use vehicle_controller::supervisor::Fault;

/// What one motor of the base gets of its voltage: such is the mismatch of cheap motors.
const WEAK_MOTOR: f64 = 0.85;
/// What went before a finding, ms …
const TRACE_MS: usize = 300;
/// … of which so much is shown.
const TRACE_STEP: usize = 10;
/// Whatever breaks may show itself for so long after it was mended, ms.
const AFTERMATH_MS: u64 = 2000;
/// A line is answered within this, ms: saving may erase meanwhile.
const ANSWER_MS: u64 = 3000;
/// A base below this stands, m/s and rad/s.
const STANDS: [f64; 2] = [0.02, 0.05];
/// Progress is told this often, ticks.
const TOLD_TICKS: u64 = 4096;

/// A tick, for the trace.
#[derive(Clone, Copy, Debug)]
struct Moment {
    now: u64,
    sight: Sight,
    rims: [f64; 2],
    push: [f64; 2],
}

struct Shard<'a, B> {
    part: &'a Part,
    robot: &'a Robot,
    base: B,
    random: ChaCha8Rng,
    driver: Driver,
    line: Line,
    book: Book,
    watch: Watch,
    sight: Sight,
    trace: VecDeque<Moment>,
    tally: Tally,
    complained: BTreeSet<&'static str>,
    shove: (Shove, u64),
    next_shove: u64,
    next_mishap: u64,
    /// Something is wrong until then, ms.
    wrong_until: Option<u64>,
    /// When the last of it was mended.
    mended: Option<u64>,
    is_cut: bool,
    recover_at: Option<u64>,
}

/// Runs a part of a soak.
///
/// # Errors
/// If the simulation cannot go on.
pub fn run<B: Watched>(
    part: &Part,
    robot: &Robot,
    mut base: B,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Tally> {
    let mut random = ChaCha8Rng::seed_from_u64(part.seed);
    // The plant draws from stream 0, the encoders' faults from 1 and 2.
    random.set_stream(3);
    base.plant_mut()
        .set_strength(random.random_range(0..2), WEAK_MOTOR);
    let sight = base.sight()?;
    let mut shard = Shard {
        part,
        robot,
        base,
        driver: Driver::new(robot),
        line: Line::default(),
        book: Book::new(&robot.params),
        watch: Watch::new(robot),
        sight,
        trace: VecDeque::with_capacity(TRACE_MS + 1),
        tally: Tally::default(),
        complained: BTreeSet::new(),
        shove: (Shove::default(), 0),
        next_shove: 1000,
        next_mishap: 3000,
        wrong_until: None,
        mended: None,
        is_cut: false,
        recover_at: None,
        random,
    };
    for now in 0..part.ticks {
        shard.tick(now)?;
        if now % TOLD_TICKS == TOLD_TICKS - 1 {
            progress(TOLD_TICKS);
        }
    }
    progress(part.ticks % TOLD_TICKS);
    shard.tally.ticks[part.mode as usize] = part.ticks;
    shard.tally.lines = shard.line.sent;
    shard.tally.worst = shard.watch.worst;
    Ok(shard.tally)
}

impl<B: Watched> Shard<'_, B> {
    fn tick(&mut self, now: u64) -> Result<()> {
        self.shove(now);
        if self.part.mode == Mode::Faults {
            self.break_and_mend(now)?;
        }
        if !self.is_cut {
            self.recover(now)?;
            self.drive(now)?;
        }
        self.base.tick()?;
        let received = self.base.receive();
        if !received.is_empty() {
            for answer in self.line.take(now, &received) {
                if answer.refusal.is_none() {
                    self.driver.live(now);
                }
                self.judge(now, &answer.sent.said, &answer);
                self.book.note_answer(now, &answer);
                self.obey(now, answer.sent.said, answer.refusal.as_deref());
            }
        }
        if self
            .line
            .pending()
            .next()
            .is_some_and(|sent| sent.at + ANSWER_MS < now)
        {
            self.complain(now, "a line is not answered", "");
            self.book.note_lost(&self.line.lose());
        }
        self.book.expire(now);
        self.sight = self.base.sight()?;
        self.remember(now);
        let (complaints, change) = self.watch.look(now, &self.sight, &self.book);
        for complaint in complaints {
            self.complain(now, complaint.kind, &complaint.detail);
        }
        match change {
            Some(Change::Latched(fault)) => self.latched(now, fault),
            Some(Change::Cleared) => {
                self.book.note_cleared(now);
                self.recover_at = None;
            }
            None => {}
        }
        Ok(())
    }

    fn shove(&mut self, now: u64) {
        if now < self.next_shove {
            return;
        }
        let shove = Shove::random(&mut self.random, self.robot, self.part.push);
        self.base.push(shove.force, shove.torque, shove.seconds);
        self.shove = (shove, now + (shove.seconds * 1e3) as u64);
        self.tally.pushes += 1;
        self.next_shove = now + log(&mut self.random, 100.0, 8000.0) as u64;
    }

    /// Puts faults in, one or two at a time, and takes them out again.
    fn break_and_mend(&mut self, now: u64) -> Result<()> {
        if self.wrong_until.is_some_and(|until| now >= until) {
            return self.mend(now);
        }
        if now < self.next_mishap || self.wrong_until.is_some() {
            return Ok(());
        }
        let number = if self.random.random_bool(0.2) { 2 } else { 1 };
        for _ in 0..number {
            let mishap = fault(&mut self.random, self.robot);
            self.base.inject(mishap)?;
            *self.tally.injected.entry(kind(&mishap)).or_default() += 1;
            self.line.note(now, &format!("!fault {mishap}"));
            if mishap == Mishap::LinkCut {
                self.is_cut = true;
                self.book.note_lost(&self.line.lose());
            }
        }
        self.wrong_until = Some(now + log(&mut self.random, 100.0, 6000.0) as u64);
        Ok(())
    }

    fn mend(&mut self, now: u64) -> Result<()> {
        self.base.clear_faults()?;
        self.line.note(now, "!clear");
        if std::mem::take(&mut self.is_cut) {
            // Ends whatever half of a line got through.
            self.base.send(b"\n")?;
        }
        self.wrong_until = None;
        self.mended = Some(now);
        self.next_mishap = now + log(&mut self.random, 500.0, 20_000.0) as u64;
        Ok(())
    }

    /// Some time after a fault somebody sees to it, and clears it.
    fn recover(&mut self, now: u64) -> Result<()> {
        if self.recover_at.is_none_or(|at| now < at) || !self.line.is_idle() {
            return Ok(());
        }
        // What slides on tyres that have lost their grip does not do what its motors are given: nobody drives on before it stands.
        let (speed, turn_speed) = self.base.plant().speed();
        if speed.abs() > STANDS[0] || turn_speed.abs() > STANDS[1] {
            return Ok(());
        }
        if self.wrong_until.is_some() && self.random.random_bool(0.8) {
            self.mend(now)?;
        }
        self.recover_at = Some(now + self.random.random_range(200..500));
        self.say(
            now,
            &Wish {
                text: "ClearFault".into(),
                said: Said::ClearFault,
            },
        )
    }

    fn drive(&mut self, now: u64) -> Result<()> {
        if !self.line.has_room(2) {
            return Ok(());
        }
        let is_idle = self.line.is_idle();
        let wishes = self
            .driver
            .wishes(now, &mut self.random, &self.sight, &self.book, is_idle);
        for wish in wishes {
            self.say(now, &wish)?;
        }
        Ok(())
    }

    fn say(&mut self, now: u64, wish: &Wish) -> Result<()> {
        let clears = |said: Said| said == Said::ClearFault;
        let latched =
            self.book.latched.is_some() && !self.line.pending().any(|sent| clears(sent.said));
        let sent = self
            .line
            .send(&mut self.base, now, &wish.text, wish.said, latched)?;
        self.book.note_sent(&sent);
        let mut pending = self.line.pending();
        let may_be_enabled = !self.book.disabled
            || self.line.wrecked
            || pending.any(|sent| sent.said == Said::Enable);
        match wish.said {
            Said::Motion(axis, _) if !latched && may_be_enabled => {
                self.watch.note_motion(axis);
            }
            Said::Enable => self.watch.note_enable(),
            _ => {}
        }
        Ok(())
    }

    /// What an answer must be.
    fn judge(&mut self, now: u64, said: &Said, answer: &super::line::Answer) {
        let refusal = answer.refusal.as_deref();
        let good = match said {
            Said::Beyond => refusal == Some("range"),
            Said::Motion(..) if answer.sent.while_latched => refusal == Some("fault"),
            Said::Motion(..) => matches!(refusal, None | Some("fault" | "disabled")),
            Said::ClearFault => matches!(refusal, None | Some("fault")),
            Said::Other => !matches!(refusal, Some("syntax" | "busy")),
            _ => refusal.is_none(),
        };
        if matches!(said, Said::Motion(..)) && refusal.is_none() {
            self.tally.motions += 1;
        }
        if !good {
            self.complain(
                now,
                "an answer is not as it must be",
                &format!("{answer:?}"),
            );
        }
    }

    /// What an answer makes of what the base is to do.
    fn obey(&mut self, now: u64, said: Said, refusal: Option<&str>) {
        let pending = |wanted: fn(Said) -> bool| self.line.pending().any(|sent| wanted(sent.said));
        let moves = pending(|said| matches!(said, Said::Motion(..)));
        let enables = pending(|said| said == Said::Enable);
        match (said, refusal) {
            (Said::Stop, None) if !moves => self.watch.note_stop(now, &self.book),
            (Said::Disable, None) if !enables && !moves => {
                self.watch.note_disable(now, &self.book);
            }
            (Said::Motion(..), Some("disabled")) => self.book.disabled = true,
            _ => {}
        }
    }

    fn latched(&mut self, now: u64, fault: Fault) {
        let asked = fault == Fault::Estop && self.book.estop.is_some();
        *self.tally.latched.entry(fault.name()).or_default() += 1;
        let is_wrong = self.wrong_until.is_some()
            || self
                .mended
                .is_some_and(|mended| now < mended + AFTERMATH_MS);
        if !asked && !is_wrong {
            self.tally.false_trips += 1;
            self.find(now, "false trip", format!("false trip: {}", fault.name()));
        }
        let possible = !matches!(
            fault,
            Fault::Output | Fault::Watchdog | Fault::Overrun | Fault::Estimator | Fault::Storage
        );
        if !possible {
            self.complain(now, "a fault that cannot be", fault.name());
        }
        self.book.note_fault(fault);
        let at = now + log(&mut self.random, 50.0, 4000.0) as u64;
        self.recover_at = Some(self.recover_at.map_or(at, |earlier| earlier.min(at)));
        // Now and then somebody goes on commanding, in vain.
        if self.random.random_bool(0.7) {
            self.driver.pause(at);
        }
    }

    fn complain(&mut self, now: u64, kind: &'static str, detail: &str) {
        self.tally.violations += 1;
        let what = if detail.is_empty() {
            kind.to_owned()
        } else {
            format!("{kind}: {detail}")
        };
        self.find(now, kind, what);
    }

    /// Keeps the first finding of each kind.
    fn find(&mut self, now: u64, kind: &'static str, what: String) {
        if !self.complained.insert(kind) {
            return;
        }
        let trace = self.told();
        self.tally.findings.push(Finding {
            shard: self.part.index,
            robot: self.part.robot,
            seconds: now as f64 * 1e-3,
            what,
            trace,
        });
    }

    fn remember(&mut self, now: u64) {
        if self.trace.len() == TRACE_MS {
            self.trace.pop_front();
        }
        let (shove, until) = self.shove;
        let push = if now < until {
            [shove.force, shove.torque]
        } else {
            [0.0; 2]
        };
        self.trace.push_back(Moment {
            now,
            sight: self.sight,
            rims: self.base.plant().wheel_speed(),
            push,
        });
    }

    /// The trace as text.
    fn told(&self) -> String {
        let mut text = String::new();
        for line in &self.line.talk {
            let _ = writeln!(text, "{line}");
        }
        text.push_str(
            "         t   v_ref       v  a_ref      a  error m     deg |  wheels m/s     true m/s       duty           V |  push N    N m  fault\n",
        );
        for moment in self.trace.iter().rev().step_by(TRACE_STEP).rev() {
            let Moment {
                now,
                sight,
                rims,
                push,
            } = moment;
            let [s, r] = &sight.axes;
            let _ = writeln!(
                text,
                "{:10.3} {:7.4} {:7.4} {:6.3} {:6.3} {:8.5} {:7.3} | {:6.3} {:6.3} {:6.3} {:6.3} {:6.3} {:6.3} {:5.2} | {:7.2} {:6.2}  {}",
                *now as f64 * 1e-3,
                s.reference,
                s.speed,
                r.reference,
                r.speed,
                s.error,
                r.error.to_degrees(),
                sight.wheels[0],
                sight.wheels[1],
                rims[0],
                rims[1],
                sight.duties[0],
                sight.duties[1],
                sight.supply,
                push[0],
                push[1],
                sight.fault.map_or("none", Fault::name),
            );
        }
        text
    }
}
