//! Reports as messages, and messages as requests: REP 103's units, REP 105's frames.

use crate::frames::Pose as Planar;
use crate::network::{FramedPose, Level, Motion, Report, Request, Status, UncertainPose};
use crate::params::Params;
use ros_messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use ros_messages::geometry_msgs::{
    Covariance, Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped,
    Quaternion, Transform, TransformStamped, Twist, TwistStamped, TwistWithCovariance, Vector3,
};
use ros_messages::nav_msgs::Odometry;
use ros_messages::sensor_msgs::{BatteryState, JointState};
use ros_messages::std_msgs::{Header, Time};
use ros_messages::tf2_msgs::TFMessage;

/// What is published of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Where the base is, and how fast.
    Odometry(Box<Odometry>),
    /// The frames between map and base.
    Transforms(TFMessage),
    /// What turns.
    Joints(JointState),
    /// The supply.
    Battery(Box<BatteryState>),
    /// How base and bridge are.
    Diagnostics(DiagnosticArray),
}

/// The messages of a report, in the order in which they are published. The transforms come first: who looks up where a pose is finds it.
pub fn messages(params: &Params, report: &Report) -> Vec<Message> {
    match report {
        Report::Motion(motion) => {
            let transforms = transforms(params, motion);
            let tf = (!transforms.transforms.is_empty()).then_some(Message::Transforms(transforms));
            tf.into_iter()
                .chain([Message::Odometry(Box::new(odometry(params, motion)))])
                .collect()
        }
        Report::Joints { stamp, joints } => vec![Message::Joints(JointState {
            header: header(*stamp, ""),
            name: joints.iter().map(|joint| joint.name.clone()).collect(),
            position: joints.iter().map(|joint| joint.position).collect(),
            velocity: joints.iter().map(|joint| joint.velocity).collect(),
            effort: Vec::new(),
        })],
        Report::Battery { stamp, volts } => {
            vec![Message::Battery(Box::new(battery(params, *stamp, *volts)))]
        }
        Report::Diagnostics {
            stamp,
            hardware,
            statuses,
        } => vec![Message::Diagnostics(DiagnosticArray {
            header: header(*stamp, ""),
            status: statuses
                .iter()
                .map(|status| diagnostic(hardware, status))
                .collect(),
        })],
    }
}

fn header(stamp: i64, frame: &str) -> Header {
    Header {
        stamp: Time::from_nanoseconds(stamp),
        frame_id: frame.to_owned(),
    }
}

fn odometry(params: &Params, motion: &Motion) -> Odometry {
    let Planar { x, y, theta } = motion.odom;
    Odometry {
        header: header(motion.stamp, &params.frame_odom),
        child_frame_id: params.frame_base.clone(),
        pose: PoseWithCovariance {
            pose: Pose {
                position: Point { x, y, z: 0.0 },
                orientation: about_z(theta),
            },
            covariance: Covariance(motion.covariance),
        },
        twist: TwistWithCovariance {
            twist: Twist {
                linear: Vector3 {
                    x: motion.v,
                    ..Vector3::default()
                },
                angular: Vector3 {
                    z: motion.omega,
                    ..Vector3::default()
                },
            },
            covariance: Covariance(motion.speed_covariance),
        },
    }
}

fn transforms(params: &Params, motion: &Motion) -> TFMessage {
    let branch = |parent: &str, child: &str, pose: &Planar| TransformStamped {
        header: header(motion.stamp, parent),
        child_frame_id: child.to_owned(),
        transform: Transform {
            translation: Vector3 {
                x: pose.x,
                y: pose.y,
                z: 0.0,
            },
            rotation: about_z(pose.theta),
        },
    };
    let map = params
        .publish_map_tf
        .then(|| branch(&params.frame_map, &params.frame_odom, &motion.map_to_odom));
    let base = params
        .publish_tf
        .then(|| branch(&params.frame_odom, &params.frame_base, &motion.odom));
    TFMessage {
        transforms: map.into_iter().chain(base).collect(),
    }
}

/// The frame that is where the base's is, if one is wished.
pub fn footprint(params: &Params) -> Option<TFMessage> {
    (!params.frame_footprint.is_empty()).then(|| TFMessage {
        transforms: vec![TransformStamped {
            header: header(0, &params.frame_base),
            child_frame_id: params.frame_footprint.clone(),
            transform: Transform::default(),
        }],
    })
}

fn battery(params: &Params, stamp: i64, volts: Option<f64>) -> BatteryState {
    let unknown = f32::NAN;
    BatteryState {
        header: header(stamp, &params.frame_base),
        voltage: volts.map_or(unknown, |volts| volts as f32),
        temperature: unknown,
        current: unknown,
        charge: unknown,
        capacity: unknown,
        design_capacity: unknown,
        percentage: unknown,
        present: volts.is_some(),
        ..BatteryState::default()
    }
}

fn diagnostic(hardware: &str, status: &Status) -> DiagnosticStatus {
    DiagnosticStatus {
        level: match status.level {
            Level::Ok => 0,
            Level::Warn => 1,
            Level::Error => 2,
        },
        name: status.name.clone(),
        message: status.message.clone(),
        hardware_id: hardware.to_owned(),
        values: status
            .values
            .iter()
            .map(|(key, value)| KeyValue {
                key: (*key).to_owned(),
                value: value.clone(),
            })
            .collect(),
    }
}

/// The rotation by an angle about z.
pub fn about_z(theta: f64) -> Quaternion {
    let (z, w) = (0.5 * theta).sin_cos();
    Quaternion {
        x: 0.0,
        y: 0.0,
        z,
        w,
    }
}

/// The request that speeds are. What they may be is for the one to say who takes them.
pub fn speeds(twist: &Twist, stamp: Option<Time>) -> Request {
    Request::Speeds {
        linear: [twist.linear.x, twist.linear.y, twist.linear.z],
        angular: [twist.angular.x, twist.angular.y, twist.angular.z],
        stamp: stamp.map(Time::nanoseconds),
    }
}

/// The same with a stamp. A stamp of zero, which many a sender leaves there, is none.
pub fn stamped_speeds(stamped: &TwistStamped) -> Request {
    let stamp = stamped.header.stamp;
    speeds(&stamped.twist, (stamp != Time::default()).then_some(stamp))
}

/// The request that a pose of somebody else is.
pub fn fix(observed: &PoseWithCovarianceStamped) -> Request {
    Request::Fix {
        stamp: observed.header.stamp.nanoseconds(),
        observed: uncertain(observed),
    }
}

/// The request that a goal is.
pub fn goal(goal: &PoseStamped) -> Request {
    Request::Goal(framed(&goal.header, &goal.pose))
}

/// A pose with its covariance, in its frame.
pub fn uncertain(pose: &PoseWithCovarianceStamped) -> UncertainPose {
    UncertainPose {
        pose: framed(&pose.header, &pose.pose.pose),
        covariance: pose.pose.covariance.0,
    }
}

fn framed(header: &Header, pose: &Pose) -> FramedPose {
    let (at, turned) = (pose.position, pose.orientation);
    FramedPose {
        frame: header.frame_id.clone(),
        position: [at.x, at.y, at.z],
        orientation: [turned.x, turned.y, turned.z, turned.w],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convert::joints::Joint;
    use std::f64::consts::PI;

    fn motion() -> Motion {
        Motion {
            stamp: 1_790_000_000_123_456_789,
            odom: Planar::new(1.0, -2.0, PI / 2.0),
            map_to_odom: Planar::new(0.25, 0.5, -PI / 2.0),
            covariance: std::array::from_fn(|at| at as f64),
            v: 0.3,
            omega: -0.5,
            speed_covariance: std::array::from_fn(|at| 100.0 + at as f64),
        }
    }

    #[test]
    fn each_number_of_a_motion_finds_its_place() {
        let [Message::Transforms(tf), Message::Odometry(odom)] =
            &messages(&Params::default(), &Report::Motion(motion()))[..]
        else {
            panic!("not what is expected");
        };
        assert_eq!(odom.header.stamp.sec, 1_790_000_000);
        assert_eq!(odom.header.stamp.nanosec, 123_456_789);
        assert_eq!(
            (odom.header.frame_id.as_str(), odom.child_frame_id.as_str()),
            ("odom", "base_link")
        );
        let pose = odom.pose.pose;
        assert_eq!(
            (pose.position.x, pose.position.y, pose.position.z),
            (1.0, -2.0, 0.0)
        );
        let half = 0.5_f64.sqrt();
        assert!((pose.orientation.z - half).abs() < 1e-15);
        assert!((pose.orientation.w - half).abs() < 1e-15);
        assert_eq!(odom.pose.covariance.0[35], 35.0);
        assert_eq!(odom.twist.covariance.0[0], 100.0);
        let twist = odom.twist.twist;
        assert_eq!((twist.linear.x, twist.angular.z), (0.3, -0.5));
        let [map, base] = &tf.transforms[..] else {
            panic!("two branches");
        };
        let names =
            |each: &TransformStamped| format!("{} {}", each.header.frame_id, each.child_frame_id);
        assert_eq!(
            (names(map), names(base)),
            ("map odom".into(), "odom base_link".into())
        );
        assert_eq!(map.transform.translation.y, 0.5);
        assert!((map.transform.rotation.z + half).abs() < 1e-15);
        assert_eq!(base.transform.translation.x, 1.0);
        assert_eq!(base.header, odom.header);
    }

    #[test]
    fn frames_that_somebody_else_publishes_are_left_out() {
        let mut params = Params::default();
        for (assignment, left) in [("tf.map_to_odom:=false", 1), ("tf.odom_to_base:=false", 0)] {
            params.assign(assignment).unwrap();
            let all = messages(&params, &Report::Motion(motion()));
            let branches = all.iter().find_map(|message| match message {
                Message::Transforms(tf) => Some(tf.transforms.len()),
                _ => None,
            });
            assert_eq!(branches.unwrap_or(0), left);
        }
    }

    #[test]
    fn what_is_not_measured_is_no_number() {
        let params = Params::default();
        for (volts, present) in [(Some(12.5), true), (None, false)] {
            let report = Report::Battery { stamp: 5, volts };
            let [Message::Battery(battery)] = &messages(&params, &report)[..] else {
                panic!("not what is expected");
            };
            assert_eq!(battery.present, present);
            assert_eq!(battery.voltage.is_nan(), volts.is_none());
            assert!(battery.current.is_nan() && battery.percentage.is_nan());
        }
    }

    #[test]
    fn joints_and_diagnostics_keep_their_order() {
        let joint = |name: &str, position| Joint {
            name: name.into(),
            position,
            velocity: -position,
        };
        let report = Report::Joints {
            stamp: 1,
            joints: vec![joint("a", 1.0), joint("b", 2.0)],
        };
        let [Message::Joints(state)] = &messages(&Params::default(), &report)[..] else {
            panic!("not what is expected");
        };
        assert_eq!(state.name, ["a", "b"]);
        assert_eq!(
            (&state.position, &state.velocity),
            (&vec![1.0, 2.0], &vec![-1.0, -2.0])
        );
        let report = Report::Diagnostics {
            stamp: 1,
            hardware: "hil-sim".into(),
            statuses: vec![Status {
                level: Level::Error,
                name: "base: fault".into(),
                message: "stall".into(),
                values: vec![("fault", "stall".into())],
            }],
        };
        let [Message::Diagnostics(array)] = &messages(&Params::default(), &report)[..] else {
            panic!("not what is expected");
        };
        let status = &array.status[0];
        assert_eq!((status.level, status.hardware_id.as_str()), (2, "hil-sim"));
        assert_eq!(status.values[0].value, "stall");
    }

    #[test]
    fn what_comes_in_is_passed_on_as_it_is() {
        let twist = Twist {
            linear: Vector3 {
                x: 0.5,
                y: 1.0,
                z: 2.0,
            },
            angular: Vector3 {
                x: 3.0,
                y: 4.0,
                z: f64::NAN,
            },
        };
        let Request::Speeds {
            linear,
            angular,
            stamp,
        } = speeds(&twist, None)
        else {
            panic!("not what is expected");
        };
        assert_eq!((linear, stamp), ([0.5, 1.0, 2.0], None));
        assert!(angular[2].is_nan(), "it is refused where it is taken");
        for (sec, expected) in [(0, None), (7, Some(7_000_000_000))] {
            let stamped = TwistStamped {
                header: Header {
                    stamp: Time { sec, nanosec: 0 },
                    ..Header::default()
                },
                twist,
            };
            let Request::Speeds { stamp, .. } = stamped_speeds(&stamped) else {
                panic!("not what is expected");
            };
            assert_eq!(stamp, expected);
        }
    }
}
