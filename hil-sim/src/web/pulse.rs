//! Whether a client is still there: it is asked every other second, and has a while to answer.
//!
//! A question is behind all that was written to the connection before it, so an answer also says that the client has read that. So that nobody can answer
//! what he has not read, a question carries what cannot be guessed.

use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

/// From question to question.
pub const PERIOD: Duration = Duration::from_secs(2);
/// A client that takes longer to answer is gone.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// The questions that are not answered. Times are those since any instant.
#[derive(Debug, Default)]
pub struct Pulse {
    /// From the system's randomness, and anew for each client: a secret has no seed.
    secret: RandomState,
    asked: u64,
    waiting: VecDeque<(u64, Duration)>,
}

impl Pulse {
    /// Asks anew; what the question carries.
    pub fn ask(&mut self, now: Duration) -> [u8; 8] {
        self.asked += 1;
        let question = self.secret.hash_one(self.asked);
        self.waiting.push_back((question, now));
        question.to_be_bytes()
    }

    /// An answer, which carries what its question did; it answers those before, too.
    pub fn answered(&mut self, carried: &[u8]) {
        let Ok(number) = <[u8; 8]>::try_from(carried).map(u64::from_be_bytes) else {
            return;
        };
        if let Some(at) = self.waiting.iter().position(|(asked, _)| *asked == number) {
            self.waiting.drain(..=at);
        }
    }

    /// When patience ends, if nothing is answered until then.
    pub fn deadline(&self) -> Option<Duration> {
        self.waiting.front().map(|(_, at)| *at + PATIENCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn patience_runs_from_the_oldest_question_without_an_answer() {
        let mut pulse = Pulse::default();
        assert_eq!(pulse.deadline(), None);
        let first = pulse.ask(s(2));
        let second = pulse.ask(s(4));
        assert_eq!(pulse.deadline(), Some(s(7)));
        pulse.answered(&first);
        assert_eq!(pulse.deadline(), Some(s(9)));
        pulse.answered(&second);
        assert_eq!(pulse.deadline(), None);
    }

    #[test]
    fn what_was_not_asked_is_no_answer() {
        let mut pulse = Pulse::default();
        pulse.ask(s(2));
        pulse.answered(b"");
        pulse.answered(b"what?");
        for guess in 0..1000_u64 {
            pulse.answered(&guess.to_be_bytes());
        }
        assert_eq!(pulse.deadline(), Some(s(7)));
        let asked = Pulse::default().ask(s(2));
        pulse.answered(&asked);
        assert_eq!(pulse.deadline(), Some(s(7)), "another client's question");
    }
}
