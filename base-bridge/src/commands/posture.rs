//! Poses of messages: a quaternion to a heading, a frame to the map's.

use super::Refusal;
use ros_messages::base::frames::Pose;

/// A quaternion of a rotation has the length 1; what others send is rounded.
const UNIT: f64 = 0.05;
/// Farther from the origin than this the base takes no position, m.
const FARTHEST: f64 = 1e7;

/// A position and a quaternion (x, y, z, w), as messages have them, in the plane.
///
/// # Errors
/// If they are none.
pub fn planar(position: [f64; 3], quaternion: [f64; 4]) -> Result<Pose, Refusal> {
    if !position.iter().all(|x| x.abs() <= FARTHEST) {
        return Err(Refusal::NotFinite);
    }
    let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    // A NaN is not near 1 either, nor is the quaternion of a message that nobody has filled in.
    if (norm - 1.0).abs() <= UNIT {
        let [x, y, z, w] = quaternion.map(|x| x / norm);
        let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        Ok(Pose::new(position[0], position[1], heading))
    } else {
        Err(Refusal::Orientation)
    }
}

/// A heading as a quaternion (x, y, z, w).
pub fn quaternion(heading: f64) -> [f64; 4] {
    let (sin, cos) = (heading / 2.0).sin_cos();
    [0.0, 0.0, sin, cos]
}

/// The frames that poses may come in, and where the second is in the first.
#[derive(Clone, Debug)]
pub struct Known<'a> {
    /// The frame that the base's estimate is in.
    pub map: &'a str,
    /// The frame that is continuous.
    pub odom: &'a str,
    /// map → odom.
    pub map_to_odom: Pose,
}

impl Known<'_> {
    /// Where a frame is in that of the map. Of a frame that is not named, nobody knows.
    ///
    /// # Errors
    /// If it is another one.
    pub fn origin(&self, frame: &str) -> Result<Pose, Refusal> {
        match bare(frame) {
            frame if frame == self.map => Ok(Pose::default()),
            frame if frame == self.odom => Ok(self.map_to_odom),
            _ => Err(Refusal::Frame),
        }
    }
}

/// A frame's name. ROS 1 had a slash before it, and some still do.
pub fn bare(frame: &str) -> &str {
    frame.strip_prefix('/').unwrap_or(frame)
}

/// `GoTo` a pose of the map.
pub fn go_to(goal: &Pose) -> String {
    format!("GoTo {}", triple(goal))
}

/// x, y and θ as lines have them: m, m, °.
pub fn triple(pose: &Pose) -> String {
    use super::decimal;
    let heading = decimal(pose.theta.to_degrees(), 5);
    format!("{} {} {heading}", decimal(pose.x, 6), decimal(pose.y, 6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn headings_come_back() {
        for heading in [-3.0, -FRAC_PI_2, 0.0, 1e-6, 1.0, PI] {
            let pose = planar([1.0, 2.0, 0.0], quaternion(heading)).unwrap();
            assert!((pose.theta - heading).abs() < 1e-12, "{heading}");
        }
        // −q is the same rotation.
        let pose = planar([0.0; 3], quaternion(1.0).map(|x| -x)).unwrap();
        assert!((pose.theta - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_pose_is_refused() {
        let q = quaternion(0.0);
        assert_eq!(planar([0.0; 3], [0.0; 4]), Err(Refusal::Orientation));
        assert_eq!(planar([0.0; 3], [f64::NAN; 4]), Err(Refusal::Orientation));
        assert_eq!(
            planar([0.0; 3], [0.0, 0.0, 2.0, 0.0]),
            Err(Refusal::Orientation)
        );
        assert_eq!(planar([f64::NAN, 0.0, 0.0], q), Err(Refusal::NotFinite));
        assert_eq!(
            planar([0.0, 0.0, f64::INFINITY], q),
            Err(Refusal::NotFinite)
        );
        assert_eq!(planar([1e8, 0.0, 0.0], q), Err(Refusal::NotFinite));
    }

    #[test]
    fn goals_are_asked_for_in_the_maps_frame() {
        let known = Known {
            map: "map",
            odom: "r1/odom",
            map_to_odom: Pose::new(1.0, 0.0, FRAC_PI_2),
        };
        let goal = Pose::new(2.0, 0.0, 0.0);
        let line = |frame: &str| Ok(go_to(&known.origin(frame)?.then(&goal)));
        assert_eq!(line("map"), Ok("GoTo 2 0 0".to_owned()));
        assert_eq!(line("/map"), Ok("GoTo 2 0 0".to_owned()));
        assert_eq!(line("r1/odom"), Ok("GoTo 1 2 90".to_owned()));
        for frame in ["", "odom", "base_link", "r2/odom"] {
            assert_eq!(line(frame), Err(Refusal::Frame));
        }
    }
}
