//! The serial line as a pseudo-terminal that any serial program opens.

use super::{Port, say};
use anyhow::{Context, Result};
use nix::errno::Errno;
use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::{read, ttyname, write};
use std::os::fd::AsFd;
use std::sync::{Arc, mpsc};

/// So many bytes wait for a reader when the terminal's own buffer is full.
const MAX_PENDING: usize = 4096;

/// Opens a pseudo-terminal and prints its name.
pub fn open() -> Result<Port> {
    let pty = openpty(None, None).context("opening a pseudo-terminal")?;
    let mut settings = tcgetattr(&pty.slave)?;
    cfmakeraw(&mut settings);
    tcsetattr(&pty.slave, SetArg::TCSANOW, &settings)?;
    say(format_args!(
        "pseudo-terminal {}",
        ttyname(&pty.slave)?.display()
    ))?;
    fcntl(&pty.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK))?;
    let master = Arc::new(pty.master);
    let reader = Arc::clone(&master);
    // Kept open: without it every read fails as soon as a client closes its end.
    let slave = pty.slave;
    let (sender, input) = mpsc::sync_channel(16);
    std::thread::spawn(move || {
        let _slave = slave;
        let mut buffer = [0; 1024];
        loop {
            let mut wait = [PollFd::new(reader.as_fd(), PollFlags::POLLIN)];
            match poll(&mut wait, PollTimeout::NONE) {
                Ok(_) | Err(Errno::EINTR) => {}
                Err(_) => return,
            }
            match read(&reader, &mut buffer) {
                Ok(0) | Err(Errno::EAGAIN | Errno::EINTR) => {}
                Ok(count) => {
                    if sender.send(buffer[..count].to_vec()).is_err() {
                        return;
                    }
                }
                Err(_) => return,
            }
        }
    });
    let mut pending = Vec::new();
    Ok(Port {
        input: Box::new(move || input.try_recv()),
        output: Box::new(move |bytes| {
            pending.extend_from_slice(bytes);
            match write(&master, &pending) {
                Ok(count) => drop(pending.drain(..count)),
                Err(Errno::EAGAIN | Errno::EINTR) => {}
                Err(error) => return Err(error).context("pseudo-terminal"),
            }
            // As on a wire, what nobody reads is lost; but by whole lines.
            if pending.len() > MAX_PENDING {
                let end = pending.iter().position(|b| *b == b'\n');
                let last = pending.iter().rposition(|b| *b == b'\n');
                if let (Some(end), Some(last)) = (end, last) {
                    pending.drain(end + 1..=last);
                }
            }
            Ok(())
        }),
        impatient: false,
        max_on_the_way: usize::MAX,
        beside: None,
    })
}
