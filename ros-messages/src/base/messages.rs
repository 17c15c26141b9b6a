//! Reports as messages: REP 103's units, REP 105's frames.

use super::frames::Pose as Planar;
use super::names::{Names, Topics};
use super::report::{Level, Motion, Report, Status};
use crate::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use crate::geometry_msgs::{
    Covariance, Point, Pose, PoseWithCovariance, Quaternion, Transform, TransformStamped, Twist,
    TwistWithCovariance, Vector3,
};
use crate::nav_msgs::Odometry;
use crate::sensor_msgs::{BatteryState, JointState};
use crate::std_msgs::{Header, Time};
use crate::tf2_msgs::TFMessage;
use crate::{RosMessage, schema, to_cdr};

/// What is published of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Where the base is, and how fast.
    Odometry(Box<Odometry>),
    /// The frames between map and base.
    Transforms(Box<TFMessage>),
    /// Frames that do not move: kept for who comes later.
    Kept(Box<TFMessage>),
    /// What turns.
    Joints(Box<JointState>),
    /// The supply.
    Battery(Box<BatteryState>),
    /// How base and bridge are.
    Diagnostics(Box<DiagnosticArray>),
}

/// Does the same with a message of whatever type.
macro_rules! with {
    ($message:expr, $inner:ident => $do:expr) => {
        match $message {
            Message::Odometry($inner) => $do,
            Message::Transforms($inner) | Message::Kept($inner) => $do,
            Message::Joints($inner) => $do,
            Message::Battery($inner) => $do,
            Message::Diagnostics($inner) => $do,
        }
    };
}
pub(super) use with;

impl Message {
    /// The topic that it is published on.
    pub fn topic<'a>(&self, topics: &'a Topics) -> &'a str {
        match self {
            Self::Odometry(_) => &topics.odom,
            Self::Transforms(_) => &topics.tf,
            Self::Kept(_) => &topics.tf_static,
            Self::Joints(_) => &topics.joints,
            Self::Battery(_) => &topics.battery,
            Self::Diagnostics(_) => &topics.diagnostics,
        }
    }

    /// Its type's name, such as `nav_msgs/msg/Odometry`.
    pub fn kind(&self) -> &'static str {
        fn of<M: RosMessage>(_: &M) -> &'static str {
            M::NAME
        }
        with!(self, message => of(message.as_ref()))
    }

    /// Its type's definition, with those of all that are in it.
    pub fn schema(&self) -> String {
        fn of<M: RosMessage>(_: &M) -> String {
            schema::<M>()
        }
        with!(self, message => of(message.as_ref()))
    }

    /// Its bytes.
    pub fn cdr(&self) -> Vec<u8> {
        with!(self, message => to_cdr(message.as_ref()))
    }
}

/// The messages of a report, in the order in which they are published. The transforms come first: who looks up where a pose is finds it.
pub fn messages(names: &Names, report: &Report) -> Vec<Message> {
    match report {
        Report::Motion(motion) => {
            let transforms = transforms(names, motion);
            let tf = (!transforms.transforms.is_empty())
                .then(|| Message::Transforms(Box::new(transforms)));
            tf.into_iter()
                .chain([Message::Odometry(Box::new(odometry(
                    &names.odom,
                    &names.base,
                    motion,
                )))])
                .collect()
        }
        Report::Joints { stamp, joints } => vec![Message::Joints(Box::new(JointState {
            header: header(*stamp, ""),
            name: joints.iter().map(|joint| joint.name.clone()).collect(),
            position: joints.iter().map(|joint| joint.position).collect(),
            velocity: joints.iter().map(|joint| joint.velocity).collect(),
            effort: Vec::new(),
        }))],
        Report::Battery { stamp, volts } => {
            vec![Message::Battery(Box::new(battery(names, *stamp, *volts)))]
        }
        Report::Diagnostics {
            stamp,
            hardware,
            statuses,
        } => vec![Message::Diagnostics(Box::new(DiagnosticArray {
            header: header(*stamp, ""),
            status: statuses
                .iter()
                .map(|status| diagnostic(&names.node, hardware, status))
                .collect(),
        }))],
    }
}

fn header(stamp: i64, frame: &str) -> Header {
    Header {
        stamp: Time::from_nanoseconds(stamp),
        frame_id: frame.to_owned(),
    }
}

/// Where a base is in a frame, and how fast.
pub fn odometry(frame: &str, base: &str, motion: &Motion) -> Odometry {
    let Planar { x, y, theta } = motion.odom;
    Odometry {
        header: header(motion.stamp, frame),
        child_frame_id: base.to_owned(),
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

fn transforms(names: &Names, motion: &Motion) -> TFMessage {
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
    let map = names
        .publish_map_to_odom
        .then(|| branch(&names.map, &names.odom, &motion.map_to_odom));
    let base = names
        .publish_odom_to_base
        .then(|| branch(&names.odom, &names.base, &motion.odom));
    TFMessage {
        transforms: map.into_iter().chain(base).collect(),
    }
}

/// The frame that is where the base's is, if one is wished.
pub fn footprint(names: &Names) -> Option<Box<TFMessage>> {
    (!names.footprint.is_empty()).then(|| {
        Box::new(TFMessage {
            transforms: vec![TransformStamped {
                header: header(0, &names.base),
                child_frame_id: names.footprint.clone(),
                transform: Transform::default(),
            }],
        })
    })
}

fn battery(names: &Names, stamp: i64, volts: Option<f64>) -> BatteryState {
    let unknown = f32::NAN;
    BatteryState {
        header: header(stamp, &names.base),
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

fn diagnostic(node: &str, hardware: &str, status: &Status) -> DiagnosticStatus {
    DiagnosticStatus {
        level: match status.level {
            Level::Ok => 0,
            Level::Warn => 1,
            Level::Error => 2,
        },
        // All nodes of a network share the topic.
        name: format!("{node}: {}", status.name),
        message: status.message.clone(),
        hardware_id: hardware.to_owned(),
        values: status
            .values
            .iter()
            .map(|(key, value)| KeyValue {
                key: key.clone().into_owned(),
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

#[cfg(test)]
mod tests {
    use super::super::joints::Joint;
    use super::*;
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
            &messages(&Names::default(), &Report::Motion(motion()))[..]
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
        let branch =
            |each: &TransformStamped| format!("{} {}", each.header.frame_id, each.child_frame_id);
        assert_eq!(
            (branch(map), branch(base)),
            ("map odom".into(), "odom base_link".into())
        );
        assert_eq!(map.transform.translation.y, 0.5);
        assert!((map.transform.rotation.z + half).abs() < 1e-15);
        assert_eq!(base.transform.translation.x, 1.0);
        assert_eq!(base.header, odom.header);
    }

    #[test]
    fn frames_that_somebody_else_publishes_are_left_out() {
        let mut names = Names::default();
        for left in [1, 0] {
            names.publish_odom_to_base = left == 1;
            names.publish_map_to_odom = false;
            let all = messages(&names, &Report::Motion(motion()));
            let branches = all.iter().find_map(|message| match message {
                Message::Transforms(tf) => Some(tf.transforms.len()),
                _ => None,
            });
            assert_eq!(branches.unwrap_or(0), left);
        }
    }

    #[test]
    fn what_is_not_measured_is_no_number() {
        let names = Names::default();
        for (volts, present) in [(Some(12.5), true), (None, false)] {
            let report = Report::Battery { stamp: 5, volts };
            let [Message::Battery(battery)] = &messages(&names, &report)[..] else {
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
        let [Message::Joints(state)] = &messages(&Names::default(), &report)[..] else {
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
                values: vec![("fault".into(), "stall".into())],
            }],
        };
        let [Message::Diagnostics(array)] = &messages(&Names::default(), &report)[..] else {
            panic!("not what is expected");
        };
        let status = &array.status[0];
        assert_eq!((status.level, status.hardware_id.as_str()), (2, "hil-sim"));
        assert_eq!(status.values[0].value, "stall");
    }
}
