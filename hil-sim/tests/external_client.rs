//! A serial client that nobody here wrote, pyserial, drives the base over a pseudo-terminal.
#![cfg(unix)]

use assert_cmd::cargo::cargo_bin;
use std::f64::consts::PI;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Drives a square, asks where the base is, closes the port, opens it again and asks once more.
const CLIENT: &str = r#"
import sys
import serial

def connect():
    return serial.Serial(sys.argv[1], 115200, timeout=20)

def lines(port):
    while True:
        line = port.readline().decode("ascii")
        if not line.endswith("\n"):
            sys.exit(f"timeout; of the next line came {line!r}")
        yield line.rstrip("\r\n")

def ask(port, tag, command):
    port.write(f"@{tag} {command}\r\n".encode("ascii"))
    for line in lines(port):
        if line.startswith("@"):
            if not line.startswith(f"@{tag} "):
                sys.exit(f"{line!r} answers @{tag} {command}")
            return line.split(" ", 1)[1]

def drive(port, tag, command, done):
    reply = ask(port, tag, command)
    if reply != "OK":
        sys.exit(f"{reply!r} answers {command}")
    for line in lines(port):
        if line.startswith(done):
            return

port = connect()
for side in range(4):
    drive(port, 10 * side, "m 0.5", "! move done ")
    drive(port, 10 * side + 1, "t 90", "! turn done ")
print(ask(port, 100, "GetEstPos"))
print(ask(port, 101, "GetWheels"))
port.close()

port = connect()
print(ask(port, 65535, "GetEstPos"))
print(ask(port, 0, "Version"))
port.close()
"#;

/// The simulator; it ends with the test.
struct Base(Child);

impl Drop for Base {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts the simulator; its pseudo-terminal.
fn start() -> (Base, String) {
    let mut child = Command::new(cargo_bin!("hil-sim"))
        .args(["drive", "--pty", "--speed", "20"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let stdout = child.stdout.take().unwrap();
    let base = Base(child);
    let mut line = String::new();
    BufReader::new(stdout).read_line(&mut line).unwrap();
    let name = line.strip_prefix("pseudo-terminal ").unwrap();
    (base, name.trim_end().to_owned())
}

/// A Python that has pyserial: the one that xtask has made, or the system's.
fn python() -> Option<String> {
    if let Ok(python) = std::env::var("PYSERIAL_PYTHON") {
        return Some(python);
    }
    let mut ask = assert_cmd::Command::new("python3");
    ask.args(["-c", "import serial"])
        .timeout(Duration::from_secs(20));
    let found = ask.output().is_ok_and(|output| output.status.success());
    found.then(|| "python3".to_owned())
}

/// The numbers of a line behind its keyword.
fn numbers(line: &str, keyword: &str) -> Vec<f64> {
    let mut words = line.split(' ');
    assert_eq!(words.next(), Some(keyword), "{line}");
    words.map(|word| word.parse().unwrap()).collect()
}

#[test]
fn pyserial_drives_a_square_and_opens_the_port_twice() {
    let Some(python) = python() else {
        // Past the capture of the test's output: that it is left out must be seen.
        let _ = writeln!(
            std::io::stderr(),
            "LEFT OUT: no Python with pyserial (`cargo xtask` makes one, or `pip install pyserial`)"
        );
        return;
    };
    let (_base, port) = start();
    let run = assert_cmd::Command::new(python)
        .args(["-c", CLIENT, &port])
        .timeout(Duration::from_secs(90))
        .assert()
        .success();
    let printed = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    let lines: Vec<_> = printed.lines().collect();
    let [pose, wheels, again, version] = lines[..] else {
        panic!("{printed}");
    };

    let place = numbers(pose, "EstPos");
    assert!(place[0].hypot(place[1]) < 0.004, "not back: {pose}");
    assert!(place[2].abs() < 0.5, "not turned back: {pose}");
    // The estimated heading is that of the counts: θ = (right − left) π d / (counts b), from θ = 0.
    let counts = numbers(wheels, "Wheels");
    let turned = (counts[1] - counts[0]) * PI * 0.084 / (2796.8 * 0.2);
    let turns = (turned / (2.0 * PI)).round();
    assert_eq!(turns, 1.0, "{wheels}");
    let theta = (turned - 2.0 * PI * turns).to_degrees();
    // The base may roll by a few counts between the two replies: 0.027° each.
    assert!(
        (theta - place[2]).abs() < 0.1,
        "{pose}, but the counts say {theta}"
    );

    let later = numbers(again, "EstPos");
    for (before, after, tolerance) in [
        (place[0], later[0], 5e-4),
        (place[1], later[1], 5e-4),
        (place[2], later[2], 0.1),
    ] {
        assert!((before - after).abs() < tolerance, "{pose}, then {again}");
    }
    assert!(
        version.starts_with("Version vehicle-controller "),
        "{version}"
    );
}
