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
    Ok(Port {
        input,
        output: Box::new(move |bytes| {
            // As on a wire: what nobody reads is lost once the terminal's buffer is full.
            match write(&master, bytes) {
                Ok(_) | Err(Errno::EAGAIN | Errno::EINTR) => Ok(()),
                Err(error) => Err(error).context("pseudo-terminal"),
            }
        }),
    })
}
