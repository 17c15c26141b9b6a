//! Messages as what the bridge is asked.

use crate::network::{FramedPose, Request, UncertainPose};
use ros_messages::geometry_msgs::{
    Pose, PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped,
};
use ros_messages::std_msgs::{Header, Time};

/// The request that speeds are. What they may be is for the one to say who takes them.
pub fn speeds(twist: &Twist, stamp: Option<i64>) -> Request {
    Request::Speeds {
        linear: [twist.linear.x, twist.linear.y, twist.linear.z],
        angular: [twist.angular.x, twist.angular.y, twist.angular.z],
        stamp,
    }
}

/// ns since 1970. A stamp of zero, which many a sender leaves there, is none.
fn stamp(header: &Header) -> Option<i64> {
    (header.stamp != Time::default()).then(|| header.stamp.nanoseconds())
}

/// The same with a stamp.
pub fn stamped_speeds(stamped: &TwistStamped) -> Request {
    speeds(&stamped.twist, stamp(&stamped.header))
}

/// The request that a pose of somebody else is.
pub fn fix(observed: &PoseWithCovarianceStamped) -> Request {
    Request::Fix(uncertain(observed))
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
        stamp: stamp(header),
        frame: header.frame_id.clone(),
        position: [at.x, at.y, at.z],
        orientation: [turned.x, turned.y, turned.z, turned.w],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ros_messages::geometry_msgs::Vector3;

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
