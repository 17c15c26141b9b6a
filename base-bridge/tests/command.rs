//! The command: its options, its files, and how it ends.
#![cfg(unix)]

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn bridge(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_base-bridge"));
    command.args(arguments);
    command
}

fn output(arguments: &[&str]) -> (bool, String) {
    let output = bridge(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.success(), String::from_utf8(text).unwrap())
}

/// Waits for a line that has this in it.
fn wait_for(child: &mut Child, what: &str) -> String {
    let mut lines = BufReader::new(child.stdout.as_mut().unwrap());
    let begin = Instant::now();
    loop {
        let mut line = String::new();
        assert!(lines.read_line(&mut line).unwrap() > 0, "no {what}");
        if line.contains(what) {
            return line;
        }
        assert!(begin.elapsed() < Duration::from_secs(20), "no {what}");
    }
}

#[test]
fn a_second_file_replaces_and_an_option_comes_last() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let all = write(
        "all.yaml",
        "/**:\n  ros__parameters:\n    cmd_vel: {timeout: 0.5, stamped: true}\n    rates.odom: 20\n",
    );
    let one = write(
        "one.yaml",
        "robot1:\n  base:\n    ros__parameters:\n      cmd_vel.timeout: 0.3\n      frames: {odom: robot1/odom}\n",
    );
    let files = [
        "--params-file",
        &all,
        "--params-file",
        &one,
        "-p",
        "rates.odom:=25",
        "--list-params",
    ];
    let (good, text) = output(&[&files[..], &["--namespace", "/robot1"]].concat());
    assert!(good, "{text}");
    for expected in [
        "cmd_vel.timeout: 0.3\n",
        "cmd_vel.stamped: true\n",
        "frames.odom: \"robot1/odom\"\n",
        "rates.odom: 25.0\n",
    ] {
        assert!(text.contains(expected), "{expected}: {text}");
    }
    let (_, text) = output(&files);
    assert!(
        text.contains("cmd_vel.timeout: 0.5\n") && text.contains("frames.odom: \"odom\"\n"),
        "{text}"
    );
    let (good, text) = output(&["--sim", "-p", "cmd_vel.timeot:=1"]);
    assert!(
        !good && text.contains("no parameter `cmd_vel.timeot`"),
        "{text}"
    );
    let (good, text) = output(&["--sim", "nobody", "--print"]);
    assert!(!good && text.contains("uncalibrated"), "{text}");
    let (good, text) = output(&["--print"]);
    assert!(!good && text.contains("which base?"), "{text}");
    let (good, _) = output(&["--sim", "--tcp", "127.0.0.1:1", "--print"]);
    assert!(!good);
}

#[test]
fn a_simulated_base_is_joined_and_left() {
    let mut child = bridge(&["--sim", "--print"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_for(&mut child, "odom 1");
    wait_for(&mut child, "joints 1");
    assert!(wait_for(&mut child, "diagnostics").contains("link: Ok connected"));
    let pid = nix::unistd::Pid::from_raw(child.id() as i32);
    let told = Instant::now();
    nix::sys::signal::kill(pid, nix::sys::signal::Signal::SIGTERM).unwrap();
    // It goes on to print until it has ended: a pipe that nobody reads would hold it up.
    let mut rest = String::new();
    child
        .stdout
        .as_mut()
        .unwrap()
        .read_to_string(&mut rest)
        .unwrap();
    assert!(child.wait().unwrap().success());
    assert!(
        told.elapsed() < Duration::from_secs(2),
        "{:?}",
        told.elapsed()
    );
}

/// A terminal that closes, or a script that passes on what its terminal says, asks twice at once; who asks again later does not want to wait.
#[test]
fn who_is_told_twice_to_end_ends_once() {
    use nix::sys::signal::{Signal, kill};
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("a.mcap");
    let mut child = bridge(&["--sim", "--print", "--mcap", log.to_str().unwrap()])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_for(&mut child, "odom 1");
    let pid = nix::unistd::Pid::from_raw(child.id() as i32);
    for signal in [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP] {
        kill(pid, signal).unwrap();
    }
    let mut rest = String::new();
    let mut output = child.stdout.take().unwrap();
    output.read_to_string(&mut rest).unwrap();
    assert!(child.wait().unwrap().success());
    let bytes = std::fs::read(&log).unwrap();
    assert!(bytes.ends_with(b"\x89MCAP0\r\n"), "the log has its end");
}

#[test]
fn a_port_that_is_not_there_is_waited_for() {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    drop(listener);
    let mut child = bridge(&["--tcp", &address, "--print"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let line = wait_for(&mut child, "diagnostics");
    assert!(line.contains("controller: Error not connected"), "{line}");
    let listener = std::net::TcpListener::bind(&address).unwrap();
    let (mut base, _) = listener.accept().unwrap();
    let mut first = [0; 2];
    base.read_exact(&mut first).unwrap();
    assert_eq!(first, *b"*\n");
    let mut line = String::new();
    BufReader::new(&base).read_line(&mut line).unwrap();
    assert!(line.contains(" Stop*"), "{line}");
    child.kill().unwrap();
    child.wait().unwrap();
}
