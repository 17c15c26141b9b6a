//! The bridge: one loop that waits for what happens first, a line of the base, a request of the network, or a deadline.
//!
//! One thread decides all that moves the base. If it hangs, nothing that would keep the base's deadman quiet is sent either.

mod bridge;
mod diagnostics;
mod held;
mod outgoing;
mod requests;
mod schedule;

use crate::line::Door;
use crate::line::keeper::{self, LineEvent};
use crate::network::{Inbox, Network, Received};
use crate::params::Params;
use crate::time::Epoch;
use anyhow::{Result, ensure};
use bridge::Bridge;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// A reply to the last Stop is waited for so long, s: time to say it again twice.
const FAREWELL: f64 = 2.0 * crate::client::DEADLINE + 0.1;
/// So many things that have happened are taken before the deadlines are looked at again: a network that never falls silent must not stop the clock.
const AT_ONCE: usize = 256;
/// The loop looks at its deadlines at least this often, s.
const IDLE: f64 = 0.1;

/// Something that happens.
#[allow(
    clippy::large_enum_variant,
    reason = "each is moved twice, and none is kept"
)]
pub enum Happening {
    /// To the line.
    Line(LineEvent),
    /// On the network.
    Request(Received),
    /// The process is told to end.
    Quit,
    /// Nobody on the network can be heard any more.
    Deaf,
}

/// Ends the bridge, from another thread.
#[derive(Clone)]
pub struct Quit(Sender<Happening>);

impl Quit {
    /// Stops the base and ends the bridge.
    pub fn quit(&self) {
        // It may have ended already.
        let _ = self.0.send(Happening::Quit);
    }
}

/// A bridge that has not begun: its ends can be handed out.
pub struct App {
    params: Params,
    epoch: Epoch,
    sender: Sender<Happening>,
    happenings: Receiver<Happening>,
}

impl App {
    /// A bridge with these parameters.
    pub fn new(params: Params) -> Self {
        let (sender, happenings) = channel();
        Self {
            params,
            epoch: Epoch::begin(),
            sender,
            happenings,
        }
    }

    /// Where networks put what comes in.
    pub fn inbox(&self) -> Inbox {
        Inbox::new(self.epoch, self.sender.clone())
    }

    /// What ends it.
    pub fn quit(&self) -> Quit {
        Quit(self.sender.clone())
    }

    /// Its parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Runs until it is told to end; the base is stopped then. `tell` takes what a person might want to read.
    ///
    /// # Errors
    /// If it ends because nobody could tell it any more to stop the base.
    pub fn run(
        self,
        door: Box<dyn Door>,
        mut network: impl Network,
        mut tell: impl FnMut(&str),
    ) -> Result<()> {
        let Self {
            params,
            epoch,
            sender,
            happenings,
        } = self;
        let name = door.name();
        let hurry = keeper::keep(door, epoch, move |event| {
            sender.send(Happening::Line(event)).is_ok()
        });
        let mut bridge = Bridge::new(params, epoch, name);
        let (mut until, mut deaf) = (None, false);
        loop {
            let now = epoch.now();
            let wake = bridge.next_deadline(now).min(now + IDLE);
            let wake = until.map_or(wake, |until: f64| wake.min(until));
            let wait = Duration::from_secs_f64((wake - now).max(0.0));
            match happenings.recv_timeout(wait) {
                Ok(first) => {
                    let more = happenings.try_iter().take(AT_ONCE);
                    for happening in std::iter::once(first).chain(more) {
                        match happening {
                            Happening::Line(event) => bridge.line(event, epoch.now()),
                            Happening::Request(received) => bridge.request(received),
                            Happening::Quit | Happening::Deaf if until.is_some() => {}
                            end @ (Happening::Quit | Happening::Deaf) => {
                                deaf = matches!(end, Happening::Deaf);
                                until = Some(epoch.now() + FAREWELL);
                                hurry.up();
                                bridge.leave();
                            }
                        }
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
            let now = epoch.now();
            bridge.go_on(now);
            for word in bridge.words() {
                tell(&word);
            }
            for report in bridge.reports() {
                network.publish(&report);
            }
            if until.is_some_and(|until| now >= until || bridge.has_left()) {
                network.close();
                ensure!(!deaf, "the network can no longer be heard");
                return Ok(());
            }
        }
    }
}
