//! The peer in Python.

use crate::common::sleep;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// Loopback, as Cyclone DDS needs it told.
const LOOPBACK: &str = r#"<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex></Discovery></Domain></CycloneDDS>"#;

/// The numbers of readers and writers, as ROS 2 of the network that this is built for tells them.
const GID_BYTES: &str = if cfg!(feature = "dds") { "16" } else { "24" };

/// A node that shares no code with the bridge.
pub struct Peer {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Peer {
    /// One that is there, in a namespace.
    pub fn start(namespace: &str) -> Self {
        Self::script("peer.py", &[namespace])
    }

    /// Another script of this folder.
    pub fn script(name: &str, arguments: &[&str]) -> Self {
        let python = std::env::var_os("ROS_PYTHON").unwrap();
        let script = format!("{}/tests/dds/{name}", env!("CARGO_MANIFEST_DIR"));
        let mut process = Command::new(python)
            .args(["-B", &script])
            .args(arguments)
            .env("CYCLONEDDS_URI", LOOPBACK)
            .env("GID_BYTES", GID_BYTES)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let input = process.stdin.take().unwrap();
        let output = BufReader::new(process.stdout.take().unwrap());
        let mut peer = Self {
            process,
            input,
            output,
        };
        assert_eq!(peer.answer()["ready"], true);
        peer
    }

    /// Asks it for something, and waits for that.
    pub fn ask(&mut self, command: &str) -> Value {
        self.tell(command);
        let answer = self.answer();
        assert!(answer.get("error").is_none(), "{command}: {answer}");
        answer
    }

    /// Asks it for something that takes its time.
    pub fn tell(&mut self, command: &str) {
        writeln!(self.input, "{command}").unwrap();
    }

    /// What it says next.
    pub fn answer(&mut self) -> Value {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))
    }

    /// Kills it, as a computer that loses its power.
    pub fn kill(mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }

    /// It does nothing for a while, and is there all the same.
    pub fn stall(&self, seconds: f64) {
        self.signal(Signal::SIGSTOP);
        sleep(seconds);
        self.signal(Signal::SIGCONT);
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.process.id() as i32), signal).unwrap();
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A number somewhere in an answer; what is none is NaN.
pub fn number(value: &Value, path: &str) -> f64 {
    value
        .pointer(path)
        .and_then(Value::as_f64)
        .unwrap_or(f64::NAN)
}

/// Numbers.
pub fn numbers(value: &Value, path: &str) -> Vec<f64> {
    let all = value.pointer(path).and_then(Value::as_array).unwrap();
    all.iter().map(|each| each.as_f64().unwrap()).collect()
}

/// Texts.
pub fn texts(value: &Value, path: &str) -> Vec<String> {
    let all = value.pointer(path).and_then(Value::as_array).unwrap();
    all.iter()
        .map(|each| each.as_str().unwrap().to_owned())
        .collect()
}
