//! Line framing: bytes in any chunking against a model of the framing rules.
//!
//! The first byte of the input says how the others are cut into chunks; the interpreter works after each.

use crate::interpreter::Session;

/// Runs an input.
///
/// # Panics
/// If a promise is broken.
pub fn run(data: &[u8]) {
    let Some((chunking, data)) = data.split_first() else {
        return;
    };
    let mut stream = Vec::with_capacity(data.len() + 1);
    stream.extend(data);
    stream.push(b'\n');
    let wheels = Default::default();
    let mut session = Session::new(&wheels, true);
    let mut cuts = u32::from(*chunking);
    let mut start = 0;
    for (at, byte) in stream.iter().enumerate() {
        session.receive(&stream[start..=at]);
        if matches!(byte, b'\r' | b'\n') {
            start = at + 1;
        }
        // Knuth's constants: chunks of 1 to many bytes.
        cuts = cuts.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let work = cuts >> 24;
        if work < u32::from(*chunking) {
            session.poll();
        }
        if work == 0 {
            session.tick(0);
        }
    }
    session.finish();
}
