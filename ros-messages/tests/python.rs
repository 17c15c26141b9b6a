//! Logs, read by Python's `mcap`, `mcap-ros2-support` and `rosbags`: none of them shares code with this crate, or with ROS.
//!
//! Needs `ROS_PYTHON`, an interpreter that has them (`cargo xtask test` makes one); without it the tests say so and are left out.

mod common;

use common::Sample;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use ros_messages::geometry_msgs::Twist;
use ros_messages::log::McapLog;
use ros_messages::tf2_msgs::TFMessage;
use ros_messages::{RosMessage, to_cdr};
use serde_json::json;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Of each type.
const MESSAGES: u32 = 60;

fn python() -> Option<OsString> {
    let python = std::env::var_os("ROS_PYTHON");
    if python.is_none() {
        // Past the capture of the test's output: that it is left out must be seen.
        let _ = writeln!(
            std::io::stderr(),
            "LEFT OUT: no Python with rosbags and mcap in ROS_PYTHON (`cargo xtask test` makes one)"
        );
    }
    python
}

/// Runs a script of this folder; what it prints.
fn run(python: OsString, script: &str, arguments: [&Path; 2]) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
    let checked = Command::new(python)
        .arg("-B")
        .arg(Path::new(folder).join(script))
        .args(arguments)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&checked.stdout);
    let wrong = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{said}{wrong}");
    said.trim().to_owned()
}

/// A log, and beside it what is in it.
struct Written {
    log: McapLog<BufWriter<File>>,
    expected: BufWriter<File>,
    time: i64,
    messages: u32,
    types: u32,
}

impl Written {
    /// Writes some messages of a type down, on a topic of their own.
    fn some<M: RosMessage + Sample>(&mut self, rng: &mut ChaCha8Rng) {
        // What a publisher keeps has a topic of its own.
        let kept = M::NAME == TFMessage::NAME;
        let topic = if kept {
            "/tf_static".to_owned()
        } else {
            format!("/{}", M::NAME)
        };
        for _ in 0..MESSAGES {
            let message = M::sample(rng);
            self.time += 1;
            if kept {
                self.log.write_kept(&topic, self.time, &message).unwrap();
            } else {
                self.log.write(&topic, self.time, &message).unwrap();
            }
            let mut cdr = String::new();
            for byte in to_cdr(&message) {
                write!(cdr, "{byte:02x}").unwrap();
            }
            let line = json!({"topic": topic, "name": M::NAME, "time": self.time, "cdr": cdr, "values": message});
            writeln!(self.expected, "{line}").unwrap();
            self.messages += 1;
        }
        self.types += 1;
    }
}

#[test]
fn readers_in_python_agree() {
    let Some(python) = python() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let paths: [PathBuf; 2] = ["a.mcap", "expected"].map(|name| folder.path().join(name));
    let file = |path: &PathBuf| BufWriter::new(File::create(path).unwrap());
    let mut written = Written {
        log: McapLog::new(file(&paths[0]), "test").unwrap(),
        expected: file(&paths[1]),
        time: 1_790_000_000_000_000_000,
        messages: 0,
        types: 0,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(1992);
    macro_rules! write_some {
        ($($kind:ty),*) => { $(written.some::<$kind>(&mut rng);)* };
    }
    for_each_message!(write_some);
    written.log.finish().unwrap();
    written.expected.flush().unwrap();
    let expected = format!("{} messages of {} types", written.messages, written.types);
    let said = run(python, "check_log.py", [&paths[0], &paths[1]]);
    assert_eq!(said, expected);
}

#[test]
fn a_log_without_an_end_is_recovered() {
    let Some(python) = python() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let paths: [PathBuf; 2] = ["a.mcap", "whole.mcap"].map(|name| folder.path().join(name));
    let mut log = McapLog::new(File::create(&paths[0]).unwrap(), "test").unwrap();
    for time in 0..150 {
        if time == 100 {
            log.flush().unwrap();
        }
        log.write("/cmd_vel", time, &Twist::default()).unwrap();
    }
    // As it is when the process is killed now: the file has not been told of an end.
    let said = run(python, "check_cut.py", [&paths[0], &paths[1]]);
    assert_eq!(said, "100");
}
