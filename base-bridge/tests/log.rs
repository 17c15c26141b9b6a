//! `--mcap`: what is published is in the file, also after a process that was killed.
#![cfg(unix)]

use assert_cmd::cargo::cargo_bin;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use ros_messages::from_cdr;
use ros_messages::nav_msgs::Odometry;
use ros_messages::tf2_msgs::TFMessage;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Runs a simulated base for a while, ends it so, and gives the messages of the file by topic.
fn logged(folder: &Path, file: &str, end: Signal) -> BTreeMap<String, Vec<Vec<u8>>> {
    let mut bridge = Command::new(cargo_bin!("base-bridge"))
        .args(["--sim", "--namespace", "r1", "--mcap"])
        .arg(folder.join("a.mcap"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(4));
    kill(Pid::from_raw(bridge.id() as i32), end).unwrap();
    let status = bridge.wait().unwrap();
    assert_eq!(status.success(), end == Signal::SIGTERM);
    let bytes = std::fs::read(folder.join(file)).unwrap();
    let options = mcap::read::Options::IgnoreEndMagic;
    let mut topics: BTreeMap<String, Vec<Vec<u8>>> = BTreeMap::new();
    for message in mcap::MessageStream::new_with_options(&bytes, options.into()).unwrap() {
        // Behind what was flushed, the file of a process that was killed may end in the midst of something.
        let Ok(message) = message else {
            assert_eq!(end, Signal::SIGKILL);
            break;
        };
        let topic = topics.entry(message.channel.topic.clone()).or_default();
        topic.push(message.data.into_owned());
    }
    topics
}

#[test]
fn what_is_published_is_in_the_file() {
    let folder = tempfile::tempdir().unwrap();
    // The second is not told another name: what the first has written is kept.
    for (end, file) in [(Signal::SIGTERM, "a.mcap"), (Signal::SIGKILL, "a-2.mcap")] {
        let topics = logged(folder.path(), file, end);
        let names: Vec<_> = topics.keys().map(String::as_str).collect();
        assert_eq!(
            names,
            [
                "/diagnostics",
                "/r1/battery_state",
                "/r1/joint_states",
                "/r1/odom",
                "/tf"
            ]
        );
        // Some hundred and fifty, on a quiet computer.
        let odometry: Vec<Odometry> = topics["/r1/odom"]
            .iter()
            .map(|bytes| from_cdr(bytes).unwrap())
            .collect();
        assert!(odometry.len() > 40, "{end}: {}", odometry.len());
        let stamps: Vec<_> = odometry
            .iter()
            .map(|each| each.header.stamp.nanoseconds())
            .collect();
        assert!(stamps.is_sorted(), "{stamps:?}");
        let tf: TFMessage = from_cdr(&topics["/tf"][0]).unwrap();
        assert_eq!(tf.transforms.len(), 2);
    }
}
