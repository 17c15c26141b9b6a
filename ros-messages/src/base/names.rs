//! What topics, frames and joints are called.

/// The names of a base: REP 105's, if nobody wishes others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// The node, with its namespace.
    pub node: String,
    /// The frame of its estimate.
    pub map: String,
    /// The frame that is continuous.
    pub odom: String,
    /// Its own.
    pub base: String,
    /// A frame where its own is; empty: none.
    pub footprint: String,
    /// Whether map → odom is told.
    pub publish_map_to_odom: bool,
    /// Whether odom → base is told.
    pub publish_odom_to_base: bool,
    /// Of a differential drive or a car.
    pub joint_left: String,
    /// Of a differential drive or a car.
    pub joint_right: String,
    /// Of a synchro drive or a tricycle.
    pub joint_drive: String,
    /// Of what steers.
    pub joint_steer: String,
    /// Of topics.
    pub topics: Topics,
}

/// Names of topics, whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// nav_msgs/Odometry.
    pub odom: String,
    /// tf2_msgs/TFMessage.
    pub tf: String,
    /// The same, kept for who comes later.
    pub tf_static: String,
    /// sensor_msgs/JointState.
    pub joints: String,
    /// sensor_msgs/BatteryState.
    pub battery: String,
    /// diagnostic_msgs/DiagnosticArray.
    pub diagnostics: String,
}

impl Default for Names {
    fn default() -> Self {
        Self {
            node: "base".into(),
            map: "map".into(),
            odom: "odom".into(),
            base: "base_link".into(),
            footprint: String::new(),
            publish_map_to_odom: true,
            publish_odom_to_base: true,
            joint_left: "left_wheel_joint".into(),
            joint_right: "right_wheel_joint".into(),
            joint_drive: "drive_wheel_joint".into(),
            joint_steer: "steering_joint".into(),
            topics: Topics {
                odom: "/odom".into(),
                tf: "/tf".into(),
                tf_static: "/tf_static".into(),
                joints: "/joint_states".into(),
                battery: "/battery_state".into(),
                diagnostics: "/diagnostics".into(),
            },
        }
    }
}

/// A name as it is in the whole network: one with a slash in front is whole already, others are in the node's namespace.
pub fn whole(namespace: &str, name: &str) -> String {
    if name.starts_with('/') {
        return name.to_owned();
    }
    match namespace.trim_matches('/') {
        "" => format!("/{name}"),
        namespace => format!("/{namespace}/{name}"),
    }
}

#[cfg(test)]
mod tests {
    use super::whole;

    #[test]
    fn names_are_made_whole() {
        assert_eq!(whole("", "odom"), "/odom");
        assert_eq!(whole("/", "odom"), "/odom");
        assert_eq!(whole("r1", "odom"), "/r1/odom");
        assert_eq!(whole("/fleet/r1/", "odom"), "/fleet/r1/odom");
        assert_eq!(whole("r1", "/tf"), "/tf");
    }
}
