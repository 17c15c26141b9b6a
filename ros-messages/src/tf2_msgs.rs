//! Package `tf2_msgs`: the tree of frames.

use crate::geometry_msgs::TransformStamped;

message! {
    /// Some of its branches.
    TFMessage = "tf2_msgs/msg/TFMessage" {
        /// Each.
        transforms: Vec<TransformStamped> = "geometry_msgs/TransformStamped[]",
    }
}
