//! What there is to be told of a base.

use super::frames::Pose;
use super::joints::Joint;
use std::borrow::Cow;

/// Where the base is and how it moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// When this was measured, ns since 1970.
    pub stamp: i64,
    /// odom → base_link.
    pub odom: Pose,
    /// map → odom.
    pub map_to_odom: Pose,
    /// Of the base's estimate, in the odom frame, by rows x y z roll pitch yaw: m, rad.
    pub covariance: [f64; 36],
    /// Forward, m/s.
    pub v: f64,
    /// Counterclockwise, rad/s.
    pub omega: f64,
    /// Of both, by rows x y z roll pitch yaw: m/s, rad/s.
    pub speed_covariance: [f64; 36],
}

/// How well something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Well.
    Ok,
    /// Worth a look.
    Warn,
    /// Not well.
    Error,
}

/// What is to be said of a part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// How well it is.
    pub level: Level,
    /// Which part.
    pub name: String,
    /// In words.
    pub message: String,
    /// In numbers, each with a name of its own.
    pub values: Vec<(Cow<'static, str>, String)>,
}

/// What goes out.
#[allow(clippy::large_enum_variant, reason = "most of them are the largest")]
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// Odometry and tf.
    Motion(Motion),
    /// What turns.
    Joints {
        /// When this was measured, ns since 1970.
        stamp: i64,
        /// Each.
        joints: Vec<Joint>,
    },
    /// The supply.
    Battery {
        /// When this was measured, ns since 1970.
        stamp: i64,
        /// V; none where nobody measures it.
        volts: Option<f64>,
    },
    /// How base and bridge are.
    Diagnostics {
        /// Now, ns since 1970.
        stamp: i64,
        /// What the base is: name, version, target, protocol; empty before it has said so.
        hardware: String,
        /// Its parts.
        statuses: Vec<Status>,
    },
}
