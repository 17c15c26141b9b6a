//! The base's serial line over TCP and at a real terminal.

use assert_cmd::cargo::cargo_bin;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Nothing here takes longer, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// The simulator; it ends with the test.
struct Base(Child);

impl Drop for Base {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Base {
    /// Starts it on a TCP port that is free; the port's address.
    fn tcp(speed: &str) -> (Self, String) {
        let mut child = Command::new(cargo_bin!("hil-sim"))
            .args(["drive", "--tcp", "127.0.0.1:0", "--speed", speed])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = child.stdout.take().unwrap();
        let base = Self(child);
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let address = line.strip_prefix("listening on ").unwrap();
        (base, address.trim_end().to_owned())
    }
}

/// A TCP client.
struct Client(BufReader<TcpStream>);

impl Client {
    fn connect(address: &str) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        Self(BufReader::new(stream))
    }

    fn send(&mut self, lines: &str) {
        self.0.get_mut().write_all(lines.as_bytes()).unwrap();
    }

    /// The next line, but for the one about the boot: who connects early sees it.
    fn line(&mut self) -> String {
        let mut line = String::new();
        self.0.read_line(&mut line).unwrap();
        assert!(line.ends_with('\n'), "the line was cut: {line:?}");
        if line.starts_with("! boot ") {
            return self.line();
        }
        line.trim_end().to_owned()
    }

    /// Reads to the line that begins so.
    fn wait_for(&mut self, begin: &str) -> String {
        loop {
            let line = self.line();
            if line.starts_with(begin) {
                return line;
            }
        }
    }
}

#[test]
fn a_tcp_client_gets_the_answers_in_order() {
    let (_base, address) = Base::tcp("10");
    let mut client = Client::connect(&address);
    client.send("@1 Version\n@2 GetTime\n@3 nonsense\n@4 GetEstPos\n");
    for begin in [
        "@1 Version vehicle-controller ",
        "@2 Time ",
        "@3 ERR syntax ",
        "@4 EstPos 0.000000 0.000000 0.00000 ",
    ] {
        let line = client.line();
        assert!(line.starts_with(begin), "{line}");
    }
    client.send("@5 m 0.1\n");
    assert_eq!(client.line(), "@5 OK");
    assert!(client.line().starts_with("! move done "));
}

#[test]
fn the_base_stays_what_it_is_between_two_tcp_clients() {
    let (_base, address) = Base::tcp("10");
    let mut first = Client::connect(&address);
    first.send("@1 ResetPos 1 2 30\n@2 SetParam gate 9\n");
    assert_eq!(first.line(), "@1 OK");
    assert_eq!(first.line(), "@2 OK");
    drop(first);
    let mut second = Client::connect(&address);
    second.send("@3 GetEstPos\n@4 GetParam gate\n");
    let line = second.line();
    assert!(
        line.starts_with("@3 EstPos 1.000000 2.000000 30.00000 "),
        "{line}"
    );
    let line = second.line();
    assert!(line.starts_with("@4 Param gate 9"), "{line}");
}

#[test]
fn the_next_tcp_client_is_served_when_the_first_has_left() {
    let (_base, address) = Base::tcp("10");
    let mut first = Client::connect(&address);
    let mut second = Client::connect(&address);
    second.send("@2 Version\n");
    first.send("@1 Version\n");
    assert!(first.line().starts_with("@1 Version "));
    drop(first);
    assert!(second.line().starts_with("@2 Version "));
}

#[test]
fn a_tcp_client_may_come_and_go_twenty_times() {
    let (_base, address) = Base::tcp("10");
    for tag in 0..20 {
        let mut client = Client::connect(&address);
        client.send(&format!("@{tag} GetTime\n"));
        let line = client.line();
        assert!(line.starts_with(&format!("@{tag} Time ")), "{line}");
    }
}

#[test]
fn a_tcp_client_that_never_reads_does_not_stop_the_base() {
    let (_base, address) = Base::tcp("max");
    let mut deaf = Client::connect(&address);
    deaf.send("Stream 0.005\n");
    // Whoever comes next is served once the system's buffers are full and the deaf one is dropped.
    let mut next = Client::connect(&address);
    next.send("Stream 0\n@1 GetTime\n");
    let first = next.wait_for("@1 Time ");
    next.send("@2 GetTime\n");
    let second = next.wait_for("@2 Time ");
    let time = |line: &str| line[8..].parse::<f64>().unwrap();
    assert!(time(&second) > time(&first), "{first}, {second}");
}

#[test]
fn the_base_drives_on_when_its_tcp_client_has_left() {
    let (_base, address) = Base::tcp("20");
    let mut first = Client::connect(&address);
    first.send("@1 m 1\n");
    assert_eq!(first.line(), "@1 OK");
    drop(first);
    let mut second = Client::connect(&address);
    second.wait_for("! move done ");
    second.send("@2 GetEstPos\n");
    let line = second.wait_for("@2 EstPos ");
    let x: f64 = line.split(' ').nth(2).unwrap().parse().unwrap();
    assert!((x - 1.0).abs() < 0.002, "{line}");
}

#[test]
fn simulated_time_keeps_pace_with_the_clock() {
    let (_base, address) = Base::tcp("5");
    let mut client = Client::connect(&address);
    let mut time = |tag: &str| {
        client.send(&format!("{tag} GetTime\n"));
        let line = client.wait_for(tag);
        let seconds: f64 = line.rsplit(' ').next().unwrap().parse().unwrap();
        (std::time::Instant::now(), seconds)
    };
    let start = time("@1");
    let end = loop {
        let end = time("@2");
        if end.1 - start.1 > 5.0 {
            break end;
        }
    };
    // Never faster, but for the moment that a reply was under way; slower only if the machine is busy.
    let took = (end.0 - start.0).as_secs_f64();
    assert!(took > 0.8, "5 s passed in {took} s at 5 times real time");
}

#[cfg(unix)]
mod terminal {
    use super::{Base, Command, Duration, PATIENCE, Stdio, Write, cargo_bin};
    use nix::pty::{Winsize, openpty};
    use std::fs::File;
    use std::io::Read;
    use std::process::ExitStatus;
    use std::sync::mpsc::{self, Receiver};
    use std::time::Instant;
    use tempfile::TempDir;

    /// A person at a terminal in which the simulator runs.
    struct Terminal {
        base: Base,
        keyboard: File,
        screen: Receiver<Vec<u8>>,
        /// What has appeared and is not looked at yet.
        seen: String,
        home: TempDir,
    }

    impl Terminal {
        fn open() -> Self {
            let size = Winsize {
                ws_row: 24,
                ws_col: 100,
                ws_xpixel: 0,
                ws_ypixel: 0,
            };
            let pty = openpty(Some(&size), None).unwrap();
            let home = tempfile::tempdir().unwrap();
            let end = || Stdio::from(pty.slave.try_clone().unwrap());
            let child = Command::new(cargo_bin!("hil-sim"))
                .args(["--speed", "10"])
                .env("HOME", home.path())
                .env("TERM", "xterm-256color")
                .stdin(end())
                .stdout(end())
                .stderr(end())
                .spawn()
                .unwrap();
            let keyboard = File::from(pty.master);
            let mut reader = keyboard.try_clone().unwrap();
            let (sender, screen) = mpsc::channel();
            std::thread::spawn(move || {
                let mut buffer = [0; 1024];
                // An error is the end: the simulator has closed its side.
                while let Ok(count @ 1..) = reader.read(&mut buffer) {
                    if sender.send(buffer[..count].to_vec()).is_err() {
                        break;
                    }
                }
            });
            let mut terminal = Self {
                base: Base(child),
                keyboard,
                screen,
                seen: String::new(),
                home,
            };
            terminal.wait_for("Type commands");
            terminal.wait_for("> ");
            terminal
        }

        fn press(&mut self, keys: &str) {
            self.keyboard.write_all(keys.as_bytes()).unwrap();
        }

        /// Waits until a text appears behind all that was waited for before.
        fn wait_for(&mut self, text: &str) {
            let deadline = Instant::now() + PATIENCE;
            loop {
                if let Some(at) = self.seen.find(text) {
                    self.seen.drain(..at + text.len());
                    return;
                }
                let left = deadline.saturating_duration_since(Instant::now());
                match self.screen.recv_timeout(left) {
                    Ok(bytes) => self.seen += &String::from_utf8_lossy(&bytes),
                    Err(error) => panic!("{text:?} does not appear ({error}): {:?}", self.seen),
                }
            }
        }

        /// Waits for a line of the base, and for the prompt that follows it: before, a key would not reach the editor.
        fn wait_for_reply(&mut self, text: &str) {
            self.wait_for(text);
            self.wait_for("> ");
        }

        fn wait_for_exit(&mut self) -> ExitStatus {
            let deadline = Instant::now() + PATIENCE;
            loop {
                if let Some(status) = self.base.0.try_wait().unwrap() {
                    return status;
                }
                assert!(
                    Instant::now() < deadline,
                    "it does not leave: {:?}",
                    self.seen
                );
                std::thread::sleep(Duration::from_millis(5));
            }
        }
    }

    #[test]
    fn tab_completes_a_command() {
        let mut terminal = Terminal::open();
        terminal.press("getestp\t");
        terminal.wait_for("GetEstPos ");
        terminal.press("\r");
        terminal.wait_for_reply("EstPos 0.000000 0.000000 0.00000 ");
    }

    #[test]
    fn tab_offers_the_commands_that_begin_so() {
        let mut terminal = Terminal::open();
        terminal.press("gete\t");
        terminal.wait_for("GetEstPos");
        terminal.press("\t");
        terminal.wait_for("GetEstSpeed");
    }

    #[test]
    fn tab_completes_a_parameter() {
        let mut terminal = Terminal::open();
        terminal.press("GetParam wheel_\t");
        terminal.wait_for("wheel_base ");
        terminal.press("\r");
        terminal.wait_for_reply("Param wheel_base ");
    }

    #[test]
    fn ctrl_c_stops_the_base_and_does_not_leave() {
        let mut terminal = Terminal::open();
        terminal.press("m inf 0.2\r");
        terminal.wait_for_reply("OK");
        terminal.press("\x03");
        terminal.wait_for_reply("! stop command");
        terminal.press("@9 GetStatus\r");
        terminal.wait_for_reply("@9 Status HOLD HOLD enabled none");
    }

    #[test]
    fn ctrl_d_leaves() {
        let mut terminal = Terminal::open();
        terminal.press("Version\r");
        terminal.wait_for_reply("Version vehicle-controller ");
        terminal.press("\x04");
        assert!(terminal.wait_for_exit().success());
    }

    #[test]
    fn ctrl_d_lets_a_motion_end() {
        let mut terminal = Terminal::open();
        terminal.press("m 0.5\r");
        terminal.wait_for_reply("OK");
        terminal.press("\x04");
        terminal.wait_for("! move done ");
        assert!(terminal.wait_for_exit().success());
    }

    #[test]
    fn the_arrow_up_brings_the_last_line_back() {
        let mut terminal = Terminal::open();
        terminal.press("@1 GetTime\r");
        terminal.wait_for_reply("@1 Time ");
        terminal.press("\x1b[A\r");
        terminal.wait_for_reply("@1 Time ");
    }

    #[test]
    fn the_history_is_kept_at_home() {
        let mut terminal = Terminal::open();
        terminal.press("@77 Version\r");
        terminal.wait_for_reply("@77 Version ");
        terminal.press("\x04");
        assert!(terminal.wait_for_exit().success());
        let history = terminal.home.path().join(".hil-sim-history");
        let history = std::fs::read_to_string(history).unwrap();
        assert!(history.contains("@77 Version"), "{history}");
    }
}
