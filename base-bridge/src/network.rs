//! What the bridge has to do with a network: reports go out, requests come in. DDS is one, a log is one, a test is one.

use crate::time::Epoch;
use ros_messages::base::Report;
use std::sync::mpsc::Sender;

/// A position and a quaternion (x, y, z, w), in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FramedPose {
    /// When this is or was said, ns since 1970, if it has a stamp.
    pub stamp: Option<i64>,
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
    Fix(UncertainPose),
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

/// A request, and when it was said, as far as is known: at the latest when it came in. In the bridge's seconds.
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

    /// What the bridge's clock shows.
    pub fn now(&self) -> f64 {
        self.epoch.now()
    }

    /// Puts a request in. False: the bridge has ended.
    pub fn put(&self, request: Request) -> bool {
        self.put_said(request, self.now())
    }

    /// Puts in what was said at this time, in the bridge's seconds, and may have been on its way since.
    pub fn put_said(&self, request: Request, at: f64) -> bool {
        let received = Received { request, at };
        self.sender
            .send(crate::app::Happening::Request(received))
            .is_ok()
    }

    /// Nothing more will come: the bridge stops the base and ends.
    pub fn end(&self) {
        // It may have ended already.
        let _ = self.sender.send(crate::app::Happening::Deaf);
    }
}
