//! The simulator with its page, and a client at its WebSocket that shares no code with the server's handling of lines.
#![allow(dead_code, reason = "each test uses a part of it")]

use assert_cmd::cargo::cargo_bin;
use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::handshake::HandshakeError;
use tungstenite::handshake::client::Request;
use tungstenite::{Error, Message, WebSocket};

/// Nothing here takes longer, even on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The simulator; it ends with the test.
pub struct Server {
    child: Child,
    /// Where its page is: address and port.
    pub address: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Server {
    /// Starts it on a free port of loopback, with further options.
    pub fn start(options: &[&str]) -> Self {
        Self::at("127.0.0.1:0", options)
    }

    /// Starts it on an address, with further options.
    pub fn at(address: &str, options: &[&str]) -> Self {
        let mut child = Command::new(cargo_bin!("hil-sim"))
            .args(["drive", "--web", address])
            .args(options)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let stdout = child.stdout.take().unwrap();
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let url = line.strip_prefix("the page is at http://").unwrap();
        let (address, _) = url.split_once('/').unwrap();
        let address = address.to_owned();
        Self { child, address }
    }

    /// As Ctrl-C does.
    #[cfg(unix)]
    pub fn interrupt(&self) {
        use nix::sys::signal::{Signal, kill};
        let id = i32::try_from(self.child.id()).unwrap();
        kill(nix::unistd::Pid::from_raw(id), Signal::SIGINT).unwrap();
    }

    /// The port alone.
    pub fn port(&self) -> u16 {
        let (_, port) = self.address.rsplit_once(':').unwrap();
        port.parse().unwrap()
    }

    /// What it has of the computer's memory, kB; None where that cannot be read.
    pub fn memory(&self) -> Option<u64> {
        let status = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(status).ok()?;
        let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
        line.split_whitespace().nth(1)?.parse().ok()
    }

    /// True while it runs.
    pub fn runs(&mut self) -> bool {
        self.child.try_wait().unwrap().is_none()
    }

    /// A TCP connection.
    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream.set_nodelay(true).unwrap();
        stream
    }

    /// Sends a request's lines, and gives the status and all of the answer. `HOST` stands for the address.
    pub fn http(&self, request: &str) -> (u16, String) {
        let mut stream = self.connect();
        let request = request.replace("HOST", &self.address).replace('\n', "\r\n");
        stream.write_all(request.as_bytes()).unwrap();
        stream.write_all(b"\r\n").unwrap();
        let mut answer = Vec::new();
        // It may be reset behind the answer, if it did not read all.
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer).into_owned();
        let status = answer.split(' ').nth(1).and_then(|code| code.parse().ok());
        (status.unwrap_or_else(|| panic!("{answer:?}")), answer)
    }

    /// The request for a WebSocket as the page makes it.
    pub fn handshake(&self, role: &str) -> Request {
        let mut request = format!("ws://{}/base", self.address)
            .into_client_request()
            .unwrap();
        let headers = request.headers_mut();
        let origin = format!("http://{}", self.address);
        headers.insert("Origin", origin.parse().unwrap());
        headers.insert("Sec-WebSocket-Protocol", role.parse().unwrap());
        request
    }

    /// A client in this role; otherwise the status of the refusal.
    pub fn try_join(&self, request: Request) -> Result<Client, u16> {
        match tungstenite::client(request, self.connect()) {
            Ok((socket, _)) => Ok(Client(socket)),
            Err(HandshakeError::Failure(Error::Http(response))) => Err(response.status().as_u16()),
            Err(error) => panic!("{error}"),
        }
    }

    /// A client in this role.
    pub fn join(&self, role: &str) -> Client {
        self.try_join(self.handshake(role)).unwrap()
    }

    /// A driver that has been greeted.
    pub fn drive(&self) -> Client {
        let mut client = self.join("drive");
        client.wait_for_world("hello");
        client
    }

    /// A watcher that has been greeted.
    pub fn watch(&self) -> Client {
        let mut client = self.join("watch");
        client.wait_for_world("hello");
        client
    }
}

/// What a client hears.
#[derive(Clone, Debug, PartialEq)]
pub enum Heard {
    /// A line of the base.
    Line(String),
    /// Something of the simulated world.
    World(Value),
    /// The end: a code, and why; 0 if there was no farewell.
    End(u16, String),
}

/// A client at the WebSocket.
pub struct Client(pub WebSocket<TcpStream>);

impl Client {
    /// The next thing that it hears.
    pub fn hear(&mut self) -> Heard {
        loop {
            match self.0.read() {
                Ok(Message::Text(text)) => return Heard::Line(text.to_string()),
                Ok(Message::Binary(bytes)) => {
                    return Heard::World(serde_json::from_slice(&bytes).unwrap());
                }
                Ok(Message::Close(Some(frame))) => {
                    return Heard::End(frame.code.into(), frame.reason.to_string());
                }
                Ok(Message::Close(None)) => return Heard::End(0, String::new()),
                Ok(_) => {}
                Err(Error::Io(error)) if is_timeout(&error) => panic!("nothing is heard"),
                Err(error) => return Heard::End(0, error.to_string()),
            }
        }
    }

    /// Hears on until something is so.
    pub fn wait(&mut self, what: &str, mut is_it: impl FnMut(&Heard) -> bool) -> Heard {
        let deadline = Instant::now() + PATIENCE;
        let mut lines = VecDeque::new();
        while Instant::now() < deadline {
            let heard = self.hear();
            if is_it(&heard) {
                return heard;
            }
            lines.truncate(20);
            match heard {
                Heard::Line(line) => lines.push_front(line),
                Heard::End(code, why) => {
                    panic!("{what}: ended, {code} {why}; last heard, backward {lines:?}")
                }
                Heard::World(_) => {}
            }
        }
        panic!("{what} does not come; last heard, backward {lines:?}");
    }

    /// The next line that begins so.
    pub fn wait_for(&mut self, begin: &str) -> String {
        let is_it = |heard: &Heard| matches!(heard, Heard::Line(line) if line.starts_with(begin));
        match self.wait(begin, is_it) {
            Heard::Line(line) => line,
            _ => unreachable!(),
        }
    }

    /// The next word of the simulated world that has this key; what it is about.
    pub fn wait_for_world(&mut self, key: &str) -> Value {
        let is_it = |heard: &Heard| matches!(heard, Heard::World(word) if word.get(key).is_some());
        match self.wait(key, is_it) {
            Heard::World(word) => word[key].clone(),
            _ => unreachable!(),
        }
    }

    /// The end of the connection.
    pub fn wait_for_end(&mut self) -> (u16, String) {
        let deadline = Instant::now() + PATIENCE;
        while Instant::now() < deadline {
            if let Heard::End(code, why) = self.hear() {
                return (code, why);
            }
        }
        panic!("the connection does not end");
    }

    /// Sends a line.
    pub fn say(&mut self, line: &str) {
        self.0.send(Message::text(line)).unwrap();
    }

    /// Sends a line with a tag, and waits for the reply, which it gives without the tag.
    pub fn ask(&mut self, tag: u16, line: &str) -> String {
        self.say(&format!("@{tag} {line}"));
        let tag = format!("@{tag} ");
        self.wait_for(&tag)[tag.len()..].to_owned()
    }

    /// Asks the simulated world, and waits until it is done; otherwise why not.
    pub fn ask_world(&mut self, id: u64, request: &str) -> Result<(), String> {
        let text = format!("{{\"id\":{id},{request}}}");
        self.0.send(Message::binary(text.into_bytes())).unwrap();
        let is_answer = |heard: &Heard| {
            let Heard::World(word) = heard else {
                return false;
            };
            word["done"] == id || word["refused"] == id
        };
        match self.wait(request, is_answer) {
            Heard::World(word) if word["refused"] == id => {
                Err(word["why"].as_str().unwrap().to_owned())
            }
            _ => Ok(()),
        }
    }

    /// The TCP connection behind it.
    pub fn stream(&mut self) -> &mut TcpStream {
        self.0.get_mut()
    }

    /// Resets the connection: no farewell, nothing that is on its way arrives any more.
    pub fn reset(self) {
        let stream = socket2::SockRef::from(self.0.get_ref());
        stream.set_linger(Some(Duration::ZERO)).unwrap();
    }
}

/// True if a read took too long.
pub fn is_timeout(error: &std::io::Error) -> bool {
    use std::io::ErrorKind;
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}
