//! Package `nav_msgs`: odometry.

use crate::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use crate::std_msgs::Header;

message! {
    /// Where a base is by its wheels, and how fast.
    Odometry = "nav_msgs/msg/Odometry" {
        /// When, and in which frame the pose is.
        header: Header = "std_msgs/Header",
        /// The frame of the base, in which the speeds are.
        child_frame_id: String = "string",
        /// Where.
        pose: PoseWithCovariance = "geometry_msgs/PoseWithCovariance",
        /// How fast.
        twist: TwistWithCovariance = "geometry_msgs/TwistWithCovariance",
    }
}
