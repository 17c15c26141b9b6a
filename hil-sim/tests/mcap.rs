//! `run --mcap`: the messages of a run.

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin;
use hil_sim::trace;
use ros_messages::base::frames::Pose;
use ros_messages::diagnostic_msgs::DiagnosticArray;
use ros_messages::nav_msgs::Odometry;
use ros_messages::sensor_msgs::{BatteryState, JointState};
use ros_messages::tf2_msgs::TFMessage;
use ros_messages::{RosMessage, from_cdr};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::io::Write as _;
use std::path::Path;

/// Two metres and a quarter turn, with a pose from outside that is 2 cm off what the base believes, and an encoder that comes loose at the end.
const SCRIPT: &str = "0 m 1 0.3\n4.5 t 90\n6.5 ObservePos 1.02 0.01 91 1e-4 0 0 1e-4 0 1\n7 m 1 0.3\n8.5 !fault left encoder stuck\n10.05 !end\n";

/// Runs the script; messages by topic, and the rows of the trace every 20 ms.
struct Run {
    bytes: Vec<u8>,
    topics: BTreeMap<String, Vec<(u64, Vec<u8>)>>,
    rows: Vec<trace::Row>,
}

impl Run {
    fn of(robot: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.script"), SCRIPT).unwrap();
        let mut command = Command::new(cargo_bin!("hil-sim"));
        command
            .arg("run")
            .arg(at("a.script"))
            .args(["--robot", robot]);
        command.arg("--mcap").arg(at("a.mcap"));
        command
            .arg("--trace")
            .arg(at("a.csv"))
            .args(["--trace-period", "0.02"]);
        command.assert().success();
        let bytes = std::fs::read(at("a.mcap")).unwrap();
        let mut topics: BTreeMap<String, Vec<_>> = BTreeMap::new();
        for message in mcap::MessageStream::new(&bytes).unwrap() {
            let message = message.unwrap();
            let topic = topics.entry(message.channel.topic.clone()).or_default();
            topic.push((message.log_time, message.data.into_owned()));
        }
        let rows = trace::read(&at("a.csv")).unwrap();
        let run = Self {
            bytes,
            topics,
            rows,
        };
        python_agrees(&run, &at("a.mcap"));
        run
    }

    fn all<M: RosMessage>(&self, topic: &str) -> Vec<M> {
        let messages = self.topics[topic].iter();
        messages.map(|(_, data)| from_cdr(data).unwrap()).collect()
    }
}

/// Reads the file by what has nothing in common with its writer.
fn python_agrees(run: &Run, log: &Path) {
    let Some(python) = std::env::var_os("ROS_PYTHON") else {
        let why = "LEFT OUT: no Python with rosbags and mcap in ROS_PYTHON (`cargo xtask test` makes one)";
        let _ = writeln!(std::io::stderr(), "{why}");
        return;
    };
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../ros-messages/tests/read_log.py"
    );
    let read = Command::new(python)
        .arg("-B")
        .arg(script)
        .arg(log)
        .assert()
        .success();
    let counts: BTreeMap<String, usize> =
        serde_json::from_slice(&read.get_output().stdout).unwrap();
    let ours = run
        .topics
        .iter()
        .map(|(topic, messages)| (topic.clone(), messages.len()));
    assert_eq!(counts, ours.collect());
}

fn nanoseconds(header: &ros_messages::std_msgs::Header) -> i64 {
    header.stamp.nanoseconds()
}

fn pose(odometry: &Odometry) -> Pose {
    let at = odometry.pose.pose;
    let theta = 2.0 * at.orientation.z.atan2(at.orientation.w);
    Pose::new(at.position.x, at.position.y, theta)
}

fn near(a: Pose, b: Pose, metres: f64, radians: f64) -> bool {
    (a.x - b.x).hypot(a.y - b.y) <= metres
        && ros_messages::base::frames::wrapped(a.theta - b.theta).abs() <= radians
}

#[test]
fn the_messages_are_those_of_the_trace() {
    let run = Run::of("default");
    let (odometry, truth) = (
        run.all::<Odometry>("/odom"),
        run.all::<Odometry>("/ground_truth"),
    );
    let (transforms, joints) = (
        run.all::<TFMessage>("/tf"),
        run.all::<JointState>("/joint_states"),
    );
    let rows = &run.rows;
    assert!(rows.len() > 500, "{}", rows.len());
    for each in [odometry.len(), truth.len(), transforms.len(), joints.len()] {
        assert_eq!(each, rows.len());
    }
    for (at, row) in rows.iter().enumerate() {
        let stamp = (row.t * 1e9).round() as i64;
        assert_eq!(nanoseconds(&odometry[at].header), stamp);
        assert_eq!(run.topics["/odom"][at].0, stamp as u64);
        // The trace has nine digits.
        assert!(near(
            pose(&truth[at]),
            Pose::new(row.true_x, row.true_y, row.true_theta),
            1e-8,
            1e-8
        ));
        let [map, base] = [0, 1].map(|branch| {
            let branch = transforms[at].transforms[branch].transform;
            let theta = 2.0 * branch.rotation.z.atan2(branch.rotation.w);
            Pose::new(branch.translation.x, branch.translation.y, theta)
        });
        let estimate = Pose::new(row.est_x, row.est_y, row.est_theta);
        assert!(near(map.then(&base), estimate, 1e-8, 1e-8), "{} s", row.t);
        assert!(near(base, pose(&odometry[at]), 1e-12, 1e-12));
        assert_eq!(odometry[at].twist.twist.linear.x as f32, row.v_s as f32);
        // 84 mm wheels of 2796.8 counts: the robot `default`.
        let turned = row.right_count as f64 / f64::from(2796.8_f32) * TAU;
        assert!((joints[at].position[1] - turned).abs() < 1e-9);
        // What does not depend on how the frames are turned.
        let c = odometry[at].pose.covariance.0;
        let (sum, expected) = (c[0] + c[7], row.cxx + row.cyy);
        assert!(
            (sum - expected).abs() <= 1e-7 * expected + 2e-9,
            "{sum} {expected}"
        );
        assert!((c[35] - row.ctt.max(1e-9)).abs() <= 1e-7 * row.ctt + 1e-12);
    }
    assert_eq!(run.all::<BatteryState>("/battery_state").len(), 11);
    let told = run.all::<DiagnosticArray>("/diagnostics");
    let faults: Vec<_> = told
        .iter()
        .map(|array| array.status[0].message.as_str())
        .collect();
    let well = faults
        .iter()
        .take_while(|fault| **fault == "no fault")
        .count();
    assert!(
        well >= 9
            && faults[well..]
                .iter()
                .all(|fault| *fault == "fault: no-motion"),
        "{faults:?}"
    );
    // At once, not at the next second.
    assert_eq!(faults.len(), 12, "{faults:?}");
}

#[test]
fn a_fix_moves_the_map_and_not_odom() {
    let run = Run::of("default");
    let odometry = run.all::<Odometry>("/odom");
    for pair in odometry.windows(2) {
        let step = pose(&pair[0]).inverse().then(&pose(&pair[1]));
        // 0.3 m/s and 90 °/s for 20 ms, and what its speeds are off where the fix came.
        assert!(
            step.x.hypot(step.y) < 0.0075 && step.theta.abs() < 0.04,
            "{pair:?}"
        );
    }
    // It stands then.
    let standing = run
        .rows
        .windows(2)
        .filter(|pair| (6.3..6.7).contains(&pair[0].t));
    let leaps = standing.filter(|pair| (pair[1].est_x - pair[0].est_x).abs() > 3e-3);
    assert_eq!(leaps.count(), 1, "the fix makes the estimate leap");
    // Until then nothing was corrected.
    let transforms = run.all::<TFMessage>("/tf");
    let before = transforms
        .iter()
        .zip(&run.rows)
        .take_while(|(_, row)| row.t < 6.5);
    for (transforms, row) in before {
        let map = transforms.transforms[0].transform;
        assert_eq!(
            (map.translation.x, map.translation.y, map.rotation.z),
            (0.0, 0.0, 0.0),
            "{} s",
            row.t
        );
    }
}

#[test]
fn equal_runs_make_equal_files() {
    for robot in ["default", "tricycle"] {
        assert!(Run::of(robot).bytes == Run::of(robot).bytes, "{robot}");
    }
}
