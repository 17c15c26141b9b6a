//! Standard input and output that are no terminal: a script's pipe.

use super::Port;
use anyhow::Context;
use std::io::{BufRead, Write};
use std::sync::mpsc;

/// Reads lines until the end of the input.
pub fn open() -> Port {
    let (sender, input) = mpsc::sync_channel(16);
    std::thread::spawn(move || {
        let mut line = Vec::new();
        let mut stdin = std::io::stdin().lock();
        while matches!(stdin.read_until(b'\n', &mut line), Ok(read) if read > 0) {
            // The last line may lack its end.
            if line.last() != Some(&b'\n') {
                line.push(b'\n');
            }
            if sender.send(std::mem::take(&mut line)).is_err() {
                break;
            }
        }
    });
    Port {
        input: Box::new(move || input.try_recv()),
        output: Box::new(|bytes| {
            let text: Vec<u8> = bytes.iter().copied().filter(|b| *b != b'\r').collect();
            let mut stdout = std::io::stdout().lock();
            stdout.write_all(&text).context("standard output")?;
            stdout.flush().context("standard output")
        }),
        impatient: true,
        max_on_the_way: usize::MAX,
        beside: None,
    }
}
