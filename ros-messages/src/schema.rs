//! Definitions with all that they are made of, as logs carry them.

use crate::RosMessage;
use crate::diagnostic_msgs::{DiagnosticStatus, KeyValue};
use crate::geometry_msgs::{
    Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, Transform,
    TransformStamped, Twist, TwistWithCovariance, Vector3,
};
use crate::std_msgs::{Header, Time};

/// What messages are made of.
const PARTS: &[(&str, &str)] = &[
    part::<Time>(),
    part::<Header>(),
    part::<Point>(),
    part::<Vector3>(),
    part::<Quaternion>(),
    part::<Pose>(),
    part::<PoseWithCovariance>(),
    part::<PoseWithCovarianceStamped>(),
    part::<Twist>(),
    part::<TwistWithCovariance>(),
    part::<Transform>(),
    part::<TransformStamped>(),
    part::<KeyValue>(),
    part::<DiagnosticStatus>(),
];

const fn part<M: RosMessage>() -> (&'static str, &'static str) {
    (M::NAME, M::DEFINITION)
}

/// The definition of a message and, behind lines of 80 `=`, of all that it is made of: the encoding `ros2msg` of MCAP.
///
/// # Panics
/// Never for the messages of this crate: what they are made of is here, too.
pub fn schema<M: RosMessage>() -> String {
    let mut text = M::DEFINITION.to_owned();
    let mut missing = made_of(M::DEFINITION);
    let mut known: Vec<String> = Vec::new();
    while let Some(short) = missing.pop() {
        if known.contains(&short) {
            continue;
        }
        let definition = PARTS
            .iter()
            .find(|(name, _)| name.replace("/msg/", "/") == short)
            .map_or_else(
                || panic!("{short} is no part of any message here"),
                |(_, definition)| *definition,
            );
        text.push_str(&"=".repeat(80));
        text.push_str("\nMSG: ");
        text.push_str(&short);
        text.push('\n');
        text.push_str(definition);
        missing.extend(made_of(definition));
        known.push(short);
    }
    text
}

/// Types with a package's name before theirs, in a definition.
fn made_of(definition: &str) -> Vec<String> {
    definition
        .lines()
        .filter_map(|line| line.split([' ', '[']).next())
        .filter(|kind| kind.contains('/'))
        .map(ToOwned::to_owned)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::schema;
    use crate::nav_msgs::Odometry;

    #[test]
    fn a_schema_has_each_part_once() {
        let text = schema::<Odometry>();
        assert!(text.starts_with("std_msgs/Header header\nstring child_frame_id\n"));
        for part in [
            "std_msgs/Header",
            "builtin_interfaces/Time",
            "geometry_msgs/PoseWithCovariance",
            "geometry_msgs/Pose",
            "geometry_msgs/Point",
            "geometry_msgs/Quaternion",
            "geometry_msgs/TwistWithCovariance",
            "geometry_msgs/Twist",
            "geometry_msgs/Vector3",
        ] {
            assert_eq!(text.matches(&format!("MSG: {part}\n")).count(), 1, "{part}");
        }
        assert_eq!(text.matches(&"=".repeat(80)).count(), 9);
    }
}
