//! What is watched while the core runs: resets, when the motors go off and on, what is counted, and the fault that is to happen.

use super::board::{Bridge, Nucleo};
use super::count::Counter;
use super::fault::Injection;
use rigless::emulator::{AccessKind, Host, Settled};
use rigless::session::Session;
use rigless::time::VirtualNanos;

/// The registers that the drivers of the motors hang on: TIM1 and GPIOE.
const DRIVE_REGISTERS: [std::ops::Range<u64>; 2] =
    [0x4001_0000..0x4001_0400, 0x4002_1000..0x4002_1400];

/// Watches a run.
#[derive(Debug, Default)]
pub struct Observer {
    resets: usize,
    expected_resets: usize,
    /// The stack was made to run into memory that is not there.
    pub(super) overflows: bool,
    bridges: [Bridge; 2],
    /// Since when both motors are off.
    off_since: Option<VirtualNanos>,
    last_hit: Option<VirtualNanos>,
    pub(super) counter: Option<Counter>,
    pub(super) injection: Option<Injection>,
    /// What went wrong while something was put into the image.
    pub(super) failure: Option<String>,
}

impl Observer {
    /// So many resets may have happened so far.
    pub fn expected_resets(&self) -> usize {
        self.expected_resets
    }

    /// One more reset may happen.
    pub fn expect_reset(&mut self) {
        self.expected_resets += 1;
    }

    /// Since when both motors are off, as the drivers see it; None while one is on.
    pub fn off_since(&self) -> Option<VirtualNanos> {
        self.off_since
    }

    /// When the core last came by a watched instruction.
    pub fn last_hit(&self) -> Option<VirtualNanos> {
        self.last_hit
    }

    pub(super) fn settled(
        &mut self,
        session: &mut Session<Nucleo>,
        host: &mut dyn Host,
        settled: Settled,
    ) {
        let at = match settled {
            Settled::Access { access, .. } => {
                let is_drive = |range: &std::ops::Range<u64>| range.contains(&access.address);
                if access.kind != AccessKind::Write || !DRIVE_REGISTERS.iter().any(is_drive) {
                    return;
                }
                access.virtual_time
            }
            Settled::Stop(stop) => {
                if session.resets().len() == self.resets {
                    return;
                }
                self.resets = session.resets().len();
                session.board_mut().connect(stop.at);
                self.restart(host);
                stop.at
            }
            Settled::Hit(hit) => {
                self.last_hit = Some(hit.at);
                if let Some(counter) = &mut self.counter {
                    counter.hit(&hit);
                }
                if let Some(injection) = &mut self.injection {
                    let done = injection.hit(session, host, &hit);
                    self.failure = done.err().map(|error| error.to_string());
                }
                return;
            }
            _ => return,
        };
        self.bridges = session.board_mut().bridges(at);
        let off = self.bridges.iter().all(Bridge::is_off);
        self.off_since = off.then(|| self.off_since.unwrap_or(at));
    }

    fn restart(&mut self, host: &mut dyn Host) {
        if let Some(counter) = &mut self.counter {
            counter.restart();
        }
        let restored = self
            .injection
            .as_mut()
            .map(|injection| injection.restore(host));
        if let Some(Err(error)) = restored {
            self.failure = Some(error.to_string());
        }
    }
}
