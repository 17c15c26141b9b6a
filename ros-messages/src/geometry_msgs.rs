//! Package `geometry_msgs`: poses, speeds and transforms.

use crate::std_msgs::Header;
use serde::{Deserialize, Serialize};
use serde_big_array::BigArray;

/// A covariance of six quantities by rows, in the order x, y, z, about x, about y, about z: m and rad (per second for speeds).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance(#[serde(with = "BigArray")] pub [f64; 36]);

impl Default for Covariance {
    fn default() -> Self {
        Self([0.0; 36])
    }
}

message! {
    /// A point, m.
    #[derive(Copy)]
    Point = "geometry_msgs/msg/Point" {
        /// Forward.
        x: f64 = "float64",
        /// To the left.
        y: f64 = "float64",
        /// Upward.
        z: f64 = "float64",
    }
}

message! {
    /// Three components: m, m/s or rad/s.
    #[derive(Copy)]
    Vector3 = "geometry_msgs/msg/Vector3" {
        /// Forward.
        x: f64 = "float64",
        /// To the left.
        y: f64 = "float64",
        /// Upward.
        z: f64 = "float64",
    }
}

/// A rotation as a unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// First of the vector.
    pub x: f64,
    /// Second of it.
    pub y: f64,
    /// Third of it.
    pub z: f64,
    /// The scalar.
    pub w: f64,
}

impl Default for Quaternion {
    /// No rotation, as ROS has it.
    fn default() -> Self {
        Self {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        }
    }
}

impl crate::RosMessage for Quaternion {
    const NAME: &'static str = "geometry_msgs/msg/Quaternion";
    const DEFINITION: &'static str = "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
}

message! {
    /// Where something is.
    #[derive(Copy)]
    Pose = "geometry_msgs/msg/Pose" {
        /// Its point.
        position: Point = "geometry_msgs/Point",
        /// Its direction.
        orientation: Quaternion = "geometry_msgs/Quaternion",
    }
}

message! {
    /// A pose in a frame.
    PoseStamped = "geometry_msgs/msg/PoseStamped" {
        /// When, and in which frame.
        header: Header = "std_msgs/Header",
        /// Where.
        pose: Pose = "geometry_msgs/Pose",
    }
}

message! {
    /// A pose, and how surely.
    #[derive(Copy)]
    PoseWithCovariance = "geometry_msgs/msg/PoseWithCovariance" {
        /// Where.
        pose: Pose = "geometry_msgs/Pose",
        /// How surely, m² and rad².
        covariance: Covariance = "float64[36]",
    }
}

message! {
    /// A pose in a frame, and how surely.
    PoseWithCovarianceStamped = "geometry_msgs/msg/PoseWithCovarianceStamped" {
        /// When, and in which frame.
        header: Header = "std_msgs/Header",
        /// Where.
        pose: PoseWithCovariance = "geometry_msgs/PoseWithCovariance",
    }
}

message! {
    /// Speeds.
    #[derive(Copy)]
    Twist = "geometry_msgs/msg/Twist" {
        /// m/s.
        linear: Vector3 = "geometry_msgs/Vector3",
        /// rad/s.
        angular: Vector3 = "geometry_msgs/Vector3",
    }
}

message! {
    /// Speeds at an instant.
    TwistStamped = "geometry_msgs/msg/TwistStamped" {
        /// When, and in which frame.
        header: Header = "std_msgs/Header",
        /// How fast.
        twist: Twist = "geometry_msgs/Twist",
    }
}

message! {
    /// Speeds, and how surely.
    #[derive(Copy)]
    TwistWithCovariance = "geometry_msgs/msg/TwistWithCovariance" {
        /// How fast.
        twist: Twist = "geometry_msgs/Twist",
        /// How surely, m²/s² and rad²/s².
        covariance: Covariance = "float64[36]",
    }
}

message! {
    /// Where a frame lies in another one.
    #[derive(Copy)]
    Transform = "geometry_msgs/msg/Transform" {
        /// Its origin, m.
        translation: Vector3 = "geometry_msgs/Vector3",
        /// Its direction.
        rotation: Quaternion = "geometry_msgs/Quaternion",
    }
}

message! {
    /// The same, at an instant.
    TransformStamped = "geometry_msgs/msg/TransformStamped" {
        /// When, and in which frame.
        header: Header = "std_msgs/Header",
        /// The frame that lies there.
        child_frame_id: String = "string",
        /// Where.
        transform: Transform = "geometry_msgs/Transform",
    }
}
