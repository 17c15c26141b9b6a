//! Logs, read by Python's `mcap`, `mcap-ros2-support` and `rosbags`: none of them shares code with this crate, or with ROS.
//!
//! Needs `ROS_PYTHON`, an interpreter that has them (`cargo xtask test` makes one); without it the test says so and is left out.

mod common;

use common::Sample;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use ros_messages::diagnostic_msgs::DiagnosticArray;
use ros_messages::geometry_msgs::{PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped};
use ros_messages::log::McapLog;
use ros_messages::nav_msgs::Odometry;
use ros_messages::sensor_msgs::{BatteryState, JointState};
use ros_messages::tf2_msgs::TFMessage;
use ros_messages::{RosMessage, to_cdr};
use serde_json::json;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::process::Command;

/// Of each type.
const MESSAGES: u32 = 60;

#[test]
fn three_readers_in_python_agree() {
    let Some(python) = std::env::var_os("ROS_PYTHON") else {
        eprintln!("left out: ROS_PYTHON is not set");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (log_path, expected_path) = (folder.path().join("a.mcap"), folder.path().join("expected"));
    let mut log = McapLog::new(File::create(&log_path).unwrap(), "test").unwrap();
    let mut expected = BufWriter::new(File::create(&expected_path).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(1992);
    let mut time = 1_790_000_000_000_000_000_i64;
    macro_rules! log_some {
        ($($kind:ty),*) => { $(
            for _ in 0..MESSAGES {
                let message = <$kind>::sample(&mut rng);
                let topic = concat!("/", stringify!($kind));
                time += 1;
                log.write(topic, time, &message).unwrap();
                let cdr = to_cdr(&message).iter().fold(String::new(), |mut text, byte| {
                    write!(text, "{byte:02x}").unwrap();
                    text
                });
                let line = json!({
                    "topic": topic, "name": <$kind>::NAME, "time": time, "cdr": cdr, "values": message,
                });
                writeln!(expected, "{line}").unwrap();
            }
        )* };
    }
    for_each_message!(log_some);
    log.finish().unwrap();
    expected.flush().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/check_log.py");
    let checked = Command::new(python)
        .arg(script)
        .args([&log_path, &expected_path])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&checked.stdout);
    let wrong = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{said}{wrong}");
    assert_eq!(said.trim(), format!("{} messages of 9 types", 9 * MESSAGES));
}
