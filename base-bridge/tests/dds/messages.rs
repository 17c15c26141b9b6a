//! What is published arrives as it is.

use crate::alone::alone;
use crate::common::{Truth, sleep};
use crate::peer::{Peer, number, numbers, texts};
use crate::stage::Stage;
use mcap::read::Options;
use ros_messages::from_cdr;
use ros_messages::nav_msgs::Odometry;
use serde_json::Value;

/// What the node hears, and what it says.
const READERS: [&str; 8] = [
    "rq/r1/clear_faultRequest std_srvs::srv::dds_::Trigger_Request_",
    "rq/r1/enableRequest std_srvs::srv::dds_::SetBool_Request_",
    "rq/r1/set_poseRequest robot_localization::srv::dds_::SetPose_Request_",
    "rq/r1/stopRequest std_srvs::srv::dds_::Trigger_Request_",
    "rt/r1/cmd_vel geometry_msgs::msg::dds_::Twist_",
    "rt/r1/goal_pose geometry_msgs::msg::dds_::PoseStamped_",
    "rt/r1/initialpose geometry_msgs::msg::dds_::PoseWithCovarianceStamped_",
    "rt/r1/pose_fix geometry_msgs::msg::dds_::PoseWithCovarianceStamped_",
];
const WRITERS: [&str; 12] = [
    "ros_discovery_info rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_",
    "rr/r1/clear_faultReply std_srvs::srv::dds_::Trigger_Response_",
    "rr/r1/enableReply std_srvs::srv::dds_::SetBool_Response_",
    "rr/r1/set_poseReply robot_localization::srv::dds_::SetPose_Response_",
    "rr/r1/stopReply std_srvs::srv::dds_::Trigger_Response_",
    "rt/diagnostics diagnostic_msgs::msg::dds_::DiagnosticArray_",
    "rt/parameter_events rcl_interfaces::msg::dds_::ParameterEvent_",
    "rt/r1/battery_state sensor_msgs::msg::dds_::BatteryState_",
    "rt/r1/joint_states sensor_msgs::msg::dds_::JointState_",
    "rt/r1/odom nav_msgs::msg::dds_::Odometry_",
    "rt/tf tf2_msgs::msg::dds_::TFMessage_",
    "rt/tf_static tf2_msgs::msg::dds_::TFMessage_",
];

/// Odometry as the bridge has logged it, by its stamp.
fn logged(file: &std::path::Path) -> Vec<Odometry> {
    let bytes = std::fs::read(file).unwrap();
    let messages = mcap::MessageStream::new_with_options(&bytes, Options::IgnoreEndMagic.into());
    let messages = messages.unwrap().map(Result::unwrap);
    let odom = messages.filter(|message| message.channel.topic == "/r1/odom");
    odom.map(|message| from_cdr(&message.data).unwrap())
        .collect()
}

#[test]
fn odometry_is_what_the_base_says_to_the_last_digit() {
    alone(
        "messages::odometry_is_what_the_base_says_to_the_last_digit",
        || {
            let stage = Stage::set();
            let log = stage.folder.path().join("log.mcap");
            let bridge = stage.bridge(&["--mcap", log.to_str().unwrap()]);
            let mut peer = Peer::start("r1");
            peer.ask("wait 10");
            peer.ask("drive 0.3 0.8 2");
            let moving = peer.ask("odom 20");
            // At rest estimate and covariance are those of every row.
            sleep(1.0);
            let resting = peer.ask("odom 3");
            let truth = stage.base.now();
            covariance_is_that_of_the_base(&resting["odom"][0], &truth, &stage);
            assert!(bridge.terminate().success());
            // And each number is the one that was published, bit for bit.
            let logged = logged(&log);
            for heard in [&moving, &resting]
                .into_iter()
                .flat_map(|answer| answer["odom"].as_array().unwrap())
            {
                let stamp = (
                    number(heard, "/header/stamp/sec"),
                    number(heard, "/header/stamp/nanosec"),
                );
                let same = |each: &&Odometry| {
                    (
                        f64::from(each.header.stamp.sec),
                        f64::from(each.header.stamp.nanosec),
                    ) == stamp
                };
                let published = logged.iter().find(same).unwrap();
                assert_eq!(
                    numbers(heard, "/pose/covariance"),
                    published.pose.covariance.0
                );
                assert_eq!(
                    numbers(heard, "/twist/covariance"),
                    published.twist.covariance.0
                );
                let at = published.pose.pose;
                for (path, value) in [
                    ("/pose/pose/position/x", at.position.x),
                    ("/pose/pose/position/y", at.position.y),
                    ("/pose/pose/orientation/z", at.orientation.z),
                    ("/pose/pose/orientation/w", at.orientation.w),
                    ("/twist/twist/linear/x", published.twist.twist.linear.x),
                    ("/twist/twist/angular/z", published.twist.twist.angular.z),
                ] {
                    assert_eq!(number(heard, path), value, "{path}");
                }
                assert_eq!(
                    (
                        heard["header"]["frame_id"].as_str(),
                        heard["child_frame_id"].as_str()
                    ),
                    (Some("odom"), Some("base_link"))
                );
            }
        },
    );
}

/// In its places among the 36, m and rad; the others are 10⁻⁹ where they are variances, or zero.
fn covariance_is_that_of_the_base(odom: &Value, truth: &Truth, stage: &Stage) {
    let heard = numbers(odom, "/pose/covariance");
    let mut expected = [0.0; 36];
    for z_roll_pitch in [14, 21, 28] {
        expected[z_roll_pitch] = 1e-9;
    }
    let c = stage.base.covariance();
    for (row, at) in [0, 1, 5].into_iter().enumerate() {
        for (column, place) in [0, 1, 5].into_iter().enumerate() {
            expected[at * 6 + place] = c[row][column];
        }
    }
    assert!(
        expected[0] > 1e-7 && expected[7] > 1e-7 && expected[35] > 1e-5,
        "{expected:?}"
    );
    for (place, (heard, expected)) in heard.iter().zip(expected).enumerate() {
        // GetEstPos has six digits.
        assert!(
            (heard - expected).abs() <= 5e-6 * expected.abs(),
            "{place}: {heard}, not {expected}"
        );
    }
    let [x, y, theta] = truth.estimate;
    let half = 0.5 * theta;
    for (path, expected) in [
        ("/pose/pose/position/x", x),
        ("/pose/pose/position/y", y),
        ("/pose/pose/orientation/z", half.sin()),
        ("/pose/pose/orientation/w", half.cos()),
    ] {
        // Telemetry has micrometres.
        assert!(
            (number(odom, path) - expected).abs() < 1e-6,
            "{path}: {odom}"
        );
    }
}

#[test]
fn all_topics_are_there_and_the_node_is_known_by_them() {
    alone(
        "messages::all_topics_are_there_and_the_node_is_known_by_them",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&["-p", "frames.footprint:=base_footprint"]);
            let mut peer = Peer::start("/r1");
            peer.ask("wait 10");
            let node = peer.ask(&format!("nodes {} {}", READERS.len(), WRITERS.len()));
            assert_eq!(
                (node["name"].as_str(), node["namespace"].as_str()),
                (Some("base"), Some("/r1"))
            );
            assert_eq!(texts(&node, "/readers"), READERS);
            assert_eq!(texts(&node, "/writers"), WRITERS);
            let frames = |answer: &Value, branch: usize| {
                let branch = &answer["transforms"][branch];
                format!(
                    "{} {}",
                    branch["header"]["frame_id"].as_str().unwrap(),
                    branch["child_frame_id"].as_str().unwrap()
                )
            };
            let tf = peer.ask("tf");
            assert_eq!(
                [frames(&tf, 0), frames(&tf, 1)],
                ["map odom", "odom base_link"]
            );
            // It was said once, seconds ago.
            assert_eq!(
                frames(&peer.ask("tf_static"), 0),
                "base_link base_footprint"
            );
            let volts = number(&peer.ask("battery"), "/voltage");
            assert!((11.0..13.0).contains(&volts), "{volts}");
            assert_eq!(
                texts(&peer.ask("joints"), "/name"),
                ["left_wheel_joint", "right_wheel_joint"]
            );
            let diagnostics = peer.ask("diagnostics");
            let names: Vec<_> = diagnostics["status"]
                .as_array()
                .unwrap()
                .iter()
                .map(|each| each["name"].as_str().unwrap())
                .collect();
            assert_eq!(
                names,
                ["controller", "link", "tick", "clock", "commands"]
                    .map(|part| format!("r1/base: {part}"))
            );
        },
    );
}

/// With Nav2 on the network, where to go is its business.
#[test]
fn what_has_no_name_is_left_to_others() {
    alone("messages::what_has_no_name_is_left_to_others", || {
        let stage = Stage::set();
        let _bridge = stage.bridge(&[
            "-p",
            "topics.goal_pose:=\"\"",
            "-p",
            "topics.initialpose:=\"\"",
        ]);
        let mut peer = Peer::start("r1");
        peer.ask("wait 10");
        let others = READERS
            .into_iter()
            .filter(|reader| !reader.contains("goal_pose") && !reader.contains("initialpose"));
        let others: Vec<_> = others.collect();
        let node = peer.ask(&format!("nodes {} {}", others.len(), WRITERS.len()));
        assert_eq!(texts(&node, "/readers"), others);
        peer.ask("drive 0.3 0 1");
    });
}

/// Somebody who does not take what he has asked for, reliably: nobody else waits for him.
#[test]
fn a_reader_that_has_stalled_holds_nobody_up() {
    alone(
        "messages::a_reader_that_has_stalled_holds_nobody_up",
        || {
            let stage = Stage::set();
            let _bridge = stage.bridge(&[]);
            let [mut stalled, mut lively] = [0; 2].map(|_| Peer::start("r1"));
            stalled.ask("wait 10");
            lively.ask("wait 10");
            lively.ask("begin 0.2 0.5");
            lively.tell("gaps 6");
            sleep(1.0);
            stalled.stall(4.0);
            let gaps = lively.answer();
            // 50 Hz; on a machine with more to do than this, a row or two may be late.
            assert!(
                number(&gaps, "/count") > 270.0 && number(&gaps, "/arrival") < 0.2,
                "{gaps}"
            );
            assert!(stage.base.speed().0 > 0.15, "{:?}", stage.base.speed());
            lively.ask("end");
            stalled.ask("odom 10");
        },
    );
}
