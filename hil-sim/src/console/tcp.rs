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
    let client: Arc<Mutex<Option<TcpStream>>> = Arc::default();
    let shared = Arc::clone(&client);
    std::thread::spawn(move || {
        let slot = |stream| *shared.lock().unwrap_or_else(PoisonError::into_inner) = stream;
        for stream in listener.incoming().flatten() {
            // Replies are short lines; waiting to fill a packet helps nobody.
            let _ = stream.set_nodelay(true);
            let _ = stream.set_write_timeout(Some(PATIENCE));
            let Ok(mut reader) = stream.try_clone() else {
                continue;
            };
            slot(Some(stream));
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
    Ok(Port {
        input,
        output: Box::new(move |bytes| {
            let mut client = client.lock().unwrap_or_else(PoisonError::into_inner);
            if client
                .as_mut()
                .is_some_and(|stream| stream.write_all(bytes).is_err())
                && let Some(gone) = client.take()
            {
                // It is gone already, or too slow to be kept.
                let _ = gone.shutdown(std::net::Shutdown::Both);
            }
            Ok(())
        }),
        impatient: false,
        max_on_the_way: usize::MAX,
        beside: None,
    })
}
