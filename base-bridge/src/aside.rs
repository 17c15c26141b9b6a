//! What may have to wait, for a disk, for a terminal or for a pipe that nobody reads, each in a thread of its own: the base waits for none of them.

use crate::network::Network;
use ros_messages::base::Report;
use std::io::Write;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::thread::Builder;
use std::time::Duration;

/// Reports that may wait: some five seconds of them. Beyond that they are lost.
const QUEUE: usize = 1000;
/// The last of them are waited for so long.
const FAREWELL: Duration = Duration::from_secs(2);

/// Somebody who takes things.
trait Taker<T> {
    fn take(&mut self, thing: T);
    fn end(&mut self) {}
}

/// The same in a thread of his own.
struct Worker<T> {
    /// None after the end.
    sender: Option<SyncSender<T>>,
    done: Receiver<()>,
    lost: u64,
}

impl<T: Send + 'static> Worker<T> {
    fn new(mut taker: impl Taker<T> + Send + 'static) -> std::io::Result<Self> {
        let (sender, things) = sync_channel(QUEUE);
        let (ended, done) = channel();
        Builder::new().name("aside".into()).spawn(move || {
            for thing in things {
                taker.take(thing);
            }
            taker.end();
            // Nobody may wait any more.
            let _ = ended.send(());
        })?;
        Ok(Self {
            sender: Some(sender),
            done,
            lost: 0,
        })
    }

    fn put(&mut self, thing: T) {
        if let Some(sender) = &self.sender
            && let Err(TrySendError::Full(_)) = sender.try_send(thing)
        {
            self.lost += 1;
        }
    }

    /// True if all was taken in time.
    fn close(&mut self) -> bool {
        self.sender = None;
        self.done.recv_timeout(FAREWELL).is_ok()
    }
}

/// A network that is waited for by its own thread only.
pub struct Aside(Worker<Report>);

struct Publishes<N>(N);

impl<N: Network> Taker<Report> for Publishes<N> {
    fn take(&mut self, report: Report) {
        self.0.publish(&report);
    }

    fn end(&mut self) {
        self.0.close();
    }
}

impl Aside {
    /// Puts a network aside.
    ///
    /// # Errors
    /// If there is no thread for it.
    pub fn new(network: impl Network + Send + 'static) -> std::io::Result<Self> {
        Ok(Self(Worker::new(Publishes(network))?))
    }
}

impl Network for Aside {
    fn publish(&mut self, report: &Report) {
        self.0.put(report.clone());
    }

    fn close(&mut self) {
        let ended = self.0.close();
        // A terminal may be what has held it up.
        let Ok(mut words) = Words::new() else {
            return;
        };
        if self.0.lost > 0 {
            words.tell(&format!(
                "what is written is too slow: {} reports are lost",
                self.0.lost
            ));
        }
        if !ended {
            words.tell("what is written has no end: it waits for somebody");
        }
    }
}

/// Tells a person, who may let it wait.
pub fn tell(words: &str) {
    // Somebody may have closed it; the base is driven on.
    let _ = writeln!(std::io::stderr(), "{words}");
}

/// Tells a person, and waits for nobody.
pub struct Words(Worker<String>);

struct Tells;

impl Taker<String> for Tells {
    fn take(&mut self, words: String) {
        tell(&words);
    }
}

impl Words {
    /// On standard error.
    ///
    /// # Errors
    /// If there is no thread for it.
    pub fn new() -> std::io::Result<Self> {
        Ok(Self(Worker::new(Tells)?))
    }

    /// Tells it, or not, when too much waits.
    pub fn tell(&mut self, words: &str) {
        self.0.put(words.to_owned());
    }
}

impl Drop for Words {
    fn drop(&mut self) {
        self.0.close();
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
        assert!(aside.0.lost >= 4 * QUEUE as u64 - 1);
        aside.close();
        assert!(begin.elapsed() < FAREWELL + Duration::from_secs(1));
    }
}
