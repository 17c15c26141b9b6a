//! Networks that may have to wait, for a disk or for a pipe that nobody reads, each in a thread of its own: the base waits for none of them.

use crate::network::Network;
use ros_messages::base::Report;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::thread::Builder;
use std::time::Duration;

/// Reports that may wait: some five seconds of them. Beyond that they are lost.
const QUEUE: usize = 1000;
/// The last of them are waited for so long.
const FAREWELL: Duration = Duration::from_secs(2);

/// A network that is waited for by its own thread only.
pub struct Aside {
    /// None after the end.
    sender: Option<SyncSender<Report>>,
    done: Receiver<()>,
    lost: u64,
}

impl Aside {
    /// Puts a network aside.
    ///
    /// # Errors
    /// If there is no thread for it.
    pub fn new(mut network: impl Network + Send + 'static) -> std::io::Result<Self> {
        let (sender, reports) = sync_channel::<Report>(QUEUE);
        let (end, done) = channel();
        Builder::new().name("aside".into()).spawn(move || {
            for report in reports {
                network.publish(&report);
            }
            network.close();
            // Nobody may wait any more.
            let _ = end.send(());
        })?;
        Ok(Self {
            sender: Some(sender),
            done,
            lost: 0,
        })
    }
}

impl Network for Aside {
    fn publish(&mut self, report: &Report) {
        let Some(sender) = &self.sender else {
            return;
        };
        if let Err(TrySendError::Full(_)) = sender.try_send(report.clone()) {
            self.lost += 1;
        }
    }

    fn close(&mut self) {
        self.sender = None;
        let ended = self.done.recv_timeout(FAREWELL).is_ok();
        if self.lost > 0 {
            eprintln!(
                "what is written is too slow: {} reports are lost",
                self.lost
            );
        }
        if !ended {
            eprintln!("what is written has no end: it waits for somebody");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};
    use std::time::Instant;

    #[derive(Clone, Default)]
    struct Slow {
        wait: Duration,
        seen: Arc<Mutex<Vec<i64>>>,
        closed: Arc<Mutex<bool>>,
    }

    impl Network for Slow {
        fn publish(&mut self, report: &Report) {
            std::thread::sleep(self.wait);
            if let Report::Battery { stamp, .. } = report {
                self.seen.lock().unwrap().push(*stamp);
            }
        }

        fn close(&mut self) {
            *self.closed.lock().unwrap() = true;
        }
    }

    fn report(stamp: i64) -> Report {
        Report::Battery { stamp, volts: None }
    }

    #[test]
    fn all_that_is_published_arrives_in_order_and_before_the_end() {
        let slow = Slow::default();
        let mut aside = Aside::new(slow.clone()).unwrap();
        for stamp in 0..500 {
            aside.publish(&report(stamp));
        }
        aside.close();
        aside.publish(&report(-1));
        assert!(slow.seen.lock().unwrap().iter().copied().eq(0..500));
        assert!(*slow.closed.lock().unwrap());
    }

    #[test]
    fn nobody_waits_for_one_who_is_stuck() {
        let slow = Slow {
            wait: Duration::from_secs(60),
            ..Slow::default()
        };
        let mut aside = Aside::new(slow.clone()).unwrap();
        let begin = Instant::now();
        for stamp in 0..5 * QUEUE as i64 {
            aside.publish(&report(stamp));
        }
        assert!(begin.elapsed() < Duration::from_secs(1));
        assert!(aside.lost >= 4 * QUEUE as u64 - 1);
        aside.close();
        assert!(begin.elapsed() < FAREWELL + Duration::from_secs(1));
    }
}
