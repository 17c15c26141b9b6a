//! Bytes from the serial port to idle. What is lost on the way leaves a mark, so that no line is taken for another.

use heapless::spsc::Producer;

/// A byte that no line may have: stands for one that was lost.
const LOST: u8 = 0xFF;

/// What found no room.
#[derive(Clone, Copy, PartialEq)]
enum Gap {
    /// Nothing.
    Nothing,
    /// Part of a line.
    Part,
    /// The end of a line was among it.
    LineEnd,
}

/// The interrupt's end of the queue of bytes.
pub struct Inbox {
    queue: Producer<'static, u8>,
    gap: Gap,
}

impl Inbox {
    /// Puts bytes into a queue.
    pub fn new(queue: Producer<'static, u8>) -> Self {
        Self {
            queue,
            gap: Gap::Nothing,
        }
    }

    /// Takes in a byte, if there is one, and whether one was lost behind it.
    pub fn put(&mut self, byte: Option<u8>, lost: bool) {
        self.fill_gap();
        for byte in byte.into_iter().chain(lost.then_some(LOST)) {
            if self.gap != Gap::Nothing || self.queue.enqueue(byte).is_err() {
                let ends = matches!(byte, b'\n' | b'\r') || self.gap == Gap::LineEnd;
                self.gap = if ends { Gap::LineEnd } else { Gap::Part };
            }
        }
    }

    /// Puts in what stands for the bytes that found no room: a mark, and an end for the line that has it if the next line would be taken for its rest.
    fn fill_gap(&mut self) {
        if self.gap == Gap::Nothing || self.queue.enqueue(LOST).is_err() {
            return;
        }
        let ended = self.gap == Gap::Part || self.queue.enqueue(b'\n').is_ok();
        self.gap = if ended { Gap::Nothing } else { Gap::LineEnd };
    }
}
