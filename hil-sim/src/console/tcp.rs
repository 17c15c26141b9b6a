//! The serial line as a TCP port on loopback: one client at a time, the next one when it has left.

use super::{Port, say};
use anyhow::{Context, Result, bail};
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

/// A client that reads nothing for this long is dropped, so that it cannot stop the simulation.
const PATIENCE: Duration = Duration::from_millis(200);

/// A byte that no line may have, and the end of the line.
const DAMAGED_LINE: &[u8] = b"\0\n";

/// Listens on a loopback address and prints which.
pub fn open(address: SocketAddr) -> Result<Port> {
    if !address.ip().is_loopback() {
        bail!("{address} is not a loopback address: whoever reaches the port drives the base");
    }
    let listener = TcpListener::bind(address).with_context(|| address.to_string())?;
    say(format_args!("listening on {}", listener.local_addr()?))?;
    let (sender, input) = mpsc::sync_channel(16);
    let client: Arc<Mutex<Option<Client>>> = Arc::default();
    let shared = Arc::clone(&client);
    std::thread::spawn(move || {
        let slot = |client| *shared.lock().unwrap_or_else(PoisonError::into_inner) = client;
        for stream in listener.incoming().flatten() {
            // Replies are short lines; waiting to fill a packet helps nobody.
            let _ = stream.set_nodelay(true);
            let _ = stream.set_write_timeout(Some(PATIENCE));
            let Ok(mut reader) = stream.try_clone() else {
                continue;
            };
            slot(Some(Client {
                stream,
                has_begun: false,
            }));
            let mut buffer = [0; 1024];
            let mut at_line_end = true;
            loop {
                match reader.read(&mut buffer) {
                    // It may only have closed its half, and still wait for answers.
                    Ok(0) => break,
                    Ok(read) => {
                        at_line_end = matches!(buffer[read - 1], b'\n' | b'\r');
                        if sender.send(buffer[..read].to_vec()).is_err() {
                            return;
                        }
                    }
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(_) => {
                        slot(None);
                        break;
                    }
                }
            }
            // Half a line must neither be obeyed nor begin the next client's first one.
            if !at_line_end && sender.send(DAMAGED_LINE.to_vec()).is_err() {
                return;
            }
        }
    });
    let mut is_in_line = false;
    Ok(Port {
        input: Box::new(move || input.try_recv()),
        output: Box::new(move |bytes| {
            let mut client = client.lock().unwrap_or_else(PoisonError::into_inner);
            if client
                .as_mut()
                .is_some_and(|client| client.write(bytes, is_in_line).is_err())
                && let Some(gone) = client.take()
            {
                // It is gone already, or too slow to be kept.
                let _ = gone.stream.shutdown(std::net::Shutdown::Both);
            }
            if let Some(last) = bytes.last() {
                is_in_line = *last != b'\n';
            }
            Ok(())
        }),
        impatient: false,
        max_on_the_way: usize::MAX,
        beside: None,
    })
}

struct Client {
    stream: TcpStream,
    /// It has got the beginning of a line: what follows is its own.
    has_begun: bool,
}

impl Client {
    /// Writes what the base sends, from the first whole line on: who connects in the midst of one would take its end for a reply.
    fn write(&mut self, bytes: &[u8], is_in_line: bool) -> std::io::Result<()> {
        let mut rest = bytes;
        if !self.has_begun && is_in_line {
            let Some(end) = bytes.iter().position(|b| *b == b'\n') else {
                return Ok(());
            };
            rest = &bytes[end + 1..];
        }
        // Nothing said is no beginning: the line may still be in its midst.
        self.has_begun |= !bytes.is_empty();
        self.stream.write_all(rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a client gets that comes when the base is, or is not, in the midst of a line.
    fn heard(is_in_line: bool, written: &[&str]) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut far = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let mut client = Client {
            stream: listener.accept().unwrap().0,
            has_begun: false,
        };
        let mut is_in_line = is_in_line;
        for piece in written {
            client.write(piece.as_bytes(), is_in_line).unwrap();
            is_in_line = piece.bytes().last().map_or(is_in_line, |b| b != b'\n');
        }
        drop(client);
        let mut text = String::new();
        far.read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn who_comes_in_the_midst_of_a_line_gets_the_next_one_first() {
        let said = ["", "wer_on\n@1 ", "OK\n", "@2 OK\n"];
        assert_eq!(heard(true, &said), "@1 OK\n@2 OK\n");
        assert_eq!(heard(false, &said), "wer_on\n@1 OK\n@2 OK\n");
        assert_eq!(
            heard(true, &["boo", "t po", "wer_on\n", "@1 OK\n"]),
            "@1 OK\n"
        );
    }
}
