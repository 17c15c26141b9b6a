//! The Python environment of the tests of what ROS 2 users see: readers of messages and logs, and a DDS peer, that share no code with this project.

use crate::venv::Venv;

/// It.
pub const VENV: Venv = Venv {
    folder: "target/ros-venv",
    packages: "rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0 cyclonedds==11.0.1",
    imports: "rosbags, mcap, mcap_ros2, cyclonedds",
    variable: "ROS_PYTHON",
    without: "the tests against them are left out",
};
