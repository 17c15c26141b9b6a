//! What the bridge has to do with a network: reports go out, requests come in. DDS is one, a log is one, a test is one.

use crate::convert::joints::Joint;
use crate::frames::Pose;
use crate::time::Epoch;
use std::sync::mpsc::Sender;

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
    /// In numbers.
    pub values: Vec<(&'static str, String)>,
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

/// A position and a quaternion (x, y, z, w), in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FramedPose {
    /// The frame's name.
    pub frame: String,
    /// m.
    pub position: [f64; 3],
    /// x, y, z, w.
    pub orientation: [f64; 4],
}

/// The same with its covariance by rows x y z roll pitch yaw: m, rad.
#[derive(Clone, Debug, PartialEq)]
pub struct UncertainPose {
    /// Where.
    pub pose: FramedPose,
    /// How surely.
    pub covariance: [f64; 36],
}

/// Takes the answer to a service's request: done, or not, and why.
pub type Reply = Box<dyn FnOnce(Result<String, String>) + Send>;

/// What comes in.
pub enum Request {
    /// Speeds.
    Speeds {
        /// m/s.
        linear: [f64; 3],
        /// rad/s.
        angular: [f64; 3],
        /// ns since 1970, if it has a stamp.
        stamp: Option<i64>,
    },
    /// Where somebody else sees the base.
    Fix {
        /// The pose of the base.
        observed: UncertainPose,
        /// When, ns since 1970.
        stamp: i64,
    },
    /// Where to go.
    Goal(FramedPose),
    /// Where the base is, from now on; with or without somebody who waits for the answer.
    SetPose(UncertainPose, Option<Reply>),
    /// Stop.
    Stop(Reply),
    /// Clear the fault.
    ClearFault(Reply),
    /// Motor power on, or off.
    Enable(bool, Reply),
}

/// Something that reports can be given to. It must not wait for anybody: behind it, the base waits.
pub trait Network {
    /// Passes a report on.
    fn publish(&mut self, report: &Report);

    /// Leaves, so that others need not find out by themselves.
    fn close(&mut self);
}

/// Several.
impl Network for Vec<Box<dyn Network>> {
    fn publish(&mut self, report: &Report) {
        for network in self {
            network.publish(report);
        }
    }

    fn close(&mut self) {
        for network in self {
            network.close();
        }
    }
}

/// A request, and when it came in, in the bridge's seconds.
pub struct Received {
    /// What.
    pub request: Request,
    /// When.
    pub at: f64,
}

/// Where a network puts what comes in, from whatever thread. It takes the time at once: a request that waits grows old.
#[derive(Clone)]
pub struct Inbox {
    epoch: Epoch,
    sender: Sender<crate::app::Happening>,
}

impl Inbox {
    /// One that puts it there.
    pub(crate) fn new(epoch: Epoch, sender: Sender<crate::app::Happening>) -> Self {
        Self { epoch, sender }
    }

    /// Puts a request in. False: the bridge has ended.
    pub fn put(&self, request: Request) -> bool {
        let at = self.epoch.now();
        let received = Received { request, at };
        self.sender
            .send(crate::app::Happening::Request(received))
            .is_ok()
    }
}
