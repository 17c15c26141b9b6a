//! Which `Stream` line is in force: who joins later has to know the fields of the telemetry.

use super::lines::{keyword, untagged};
use std::collections::VecDeque;

/// Lines whose answers are waited for, at most; a base answers no more than that.
const MAX_WAITING: usize = 256;

/// Follows what the driver sends and what the base answers, as far as telemetry is concerned.
#[derive(Debug, Default)]
pub struct Streams {
    accepted: Option<String>,
    waiting: VecDeque<Waiting>,
}

/// A line that has not been answered.
#[derive(Debug)]
struct Waiting {
    tag: Option<u16>,
    /// The line, if it is a `Stream`.
    stream: Option<String>,
}

impl Streams {
    /// The driver sends a line.
    pub fn sent(&mut self, line: &str) {
        let (tag, body) = untagged(line);
        // Nothing but a tag is answered, nothing at all is not.
        if tag.is_none() && body.is_empty() {
            return;
        }
        if self.waiting.len() == MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back(Waiting {
            tag,
            stream: stream_in(line),
        });
    }

    /// A line that was sent does not reach the base, and so is not answered.
    pub fn dropped(&mut self, line: &str) {
        let (tag, _) = untagged(line);
        let stream = stream_in(line);
        let found = self
            .waiting
            .iter()
            .position(|waiting| waiting.tag == tag && waiting.stream == stream);
        if let Some(found) = found {
            self.waiting.remove(found);
        }
    }

    /// The base sends a line.
    pub fn heard(&mut self, line: &str) {
        // A boot may follow what the last one was about to say, in the same line.
        if line.contains("! boot ") {
            self.accepted = None;
            // Some may still be on their way and be answered yet; without a tag nobody knows which.
            self.waiting.retain(|waiting| waiting.tag.is_some());
            return;
        }
        if line.starts_with(['!', '~']) {
            return;
        }
        let (tag, body) = untagged(line);
        // Answers come in order. Whatever waits before this one was lost on the way.
        let Some(found) = self.waiting.iter().position(|waiting| waiting.tag == tag) else {
            return;
        };
        let answered = self.waiting.drain(..=found).next_back();
        let stream = answered.and_then(|waiting| waiting.stream);
        if stream.is_some() && (body == "OK" || body.starts_with("OK*")) {
            self.accepted = stream;
        }
    }

    /// What has not been answered will not be: the line to the base was cut.
    pub fn forget_waiting(&mut self) {
        self.waiting.clear();
    }

    /// What somebody who joins now has to know: the line in force, and those that the base has not answered yet.
    pub fn to_tell(&self) -> impl Iterator<Item = &str> {
        let waiting = self
            .waiting
            .iter()
            .filter_map(|waiting| waiting.stream.as_deref());
        self.accepted.as_deref().into_iter().chain(waiting)
    }
}

fn stream_in(line: &str) -> Option<String> {
    let is_stream = keyword(line).eq_ignore_ascii_case("stream");
    is_stream.then(|| line.to_owned())
}

#[cfg(test)]
mod tests {
    use super::Streams;

    fn told(streams: &Streams) -> Vec<&str> {
        streams.to_tell().collect()
    }

    #[test]
    fn a_stream_counts_when_it_is_accepted() {
        let mut streams = Streams::default();
        streams.sent("@7 Stream 0.02 t x*1A2B");
        assert_eq!(told(&streams), ["@7 Stream 0.02 t x*1A2B"]);
        streams.heard("~ 1 2");
        streams.heard("! move done 0");
        streams.heard("@7 OK*0000");
        streams.sent("@8 stream 0.02 nonsense");
        streams.sent("@9 m 1");
        streams.heard("@8 ERR syntax field");
        streams.heard("@9 OK");
        assert_eq!(told(&streams), ["@7 Stream 0.02 t x*1A2B"]);
    }

    #[test]
    fn untagged_lines_are_answered_in_order() {
        let mut streams = Streams::default();
        streams.sent("m 1");
        streams.sent("  ");
        streams.sent("STREAM 0.1,t");
        streams.heard("ERR fault");
        assert_eq!(told(&streams), ["STREAM 0.1,t"]);
        streams.heard("OK");
        streams.sent("Stream 0");
        streams.heard("ERR busy");
        assert_eq!(told(&streams), ["STREAM 0.1,t"]);
    }

    #[test]
    fn an_answer_that_got_lost_is_not_taken_from_another_line() {
        let mut streams = Streams::default();
        streams.sent("@1 Stream 0.1");
        streams.sent("@2 m 1");
        streams.heard("@2 OK");
        assert!(told(&streams).is_empty());
        streams.sent("Stream 0.1");
        streams.forget_waiting();
        streams.heard("OK");
        assert!(told(&streams).is_empty());
    }

    #[test]
    fn a_line_that_is_dropped_takes_no_other_ones_answer() {
        let mut streams = Streams::default();
        streams.sent("GetTime");
        streams.sent("Stream 0.1");
        streams.dropped("Stream 0.1");
        streams.sent("m 1");
        streams.heard("Time 1");
        streams.heard("OK");
        assert!(told(&streams).is_empty());
    }

    #[test]
    fn a_boot_ends_telemetry() {
        let mut streams = Streams::default();
        streams.sent("@1 Stream 0.1");
        streams.heard("@1 OK");
        streams.sent("@2 Stream 0.2");
        streams.sent("Stream 0.3");
        streams.heard("~ 1.2 3! boot power-on");
        streams.heard("OK");
        assert_eq!(told(&streams), ["@2 Stream 0.2"], "it may be answered yet");
        streams.heard("@2 ERR syntax");
        assert!(told(&streams).is_empty());
    }

    #[test]
    fn what_is_never_answered_takes_no_more_and_more_memory() {
        let mut streams = Streams::default();
        for _ in 0..10_000 {
            streams.sent("m 1");
        }
        assert_eq!(streams.waiting.len(), super::MAX_WAITING);
    }
}
