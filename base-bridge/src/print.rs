//! What is published, as lines of text: a look at a base without a network.

use base_bridge::network::Network;
use ros_messages::base::{Motion, Report};
use std::io::Write;

/// Prints reports.
pub struct Print;

impl Network for Print {
    fn publish(&mut self, report: &Report) {
        // Somebody may have closed it; the base is driven on.
        let _ = writeln!(std::io::stdout(), "{}", text(report));
    }

    fn close(&mut self) {}
}

fn text(report: &Report) -> String {
    match report {
        Report::Motion(Motion {
            stamp,
            odom,
            map_to_odom,
            covariance,
            v,
            omega,
            ..
        }) => format!(
            "odom {} x {:.4} y {:.4} yaw {:.4} sigma {:.4} {:.4} {:.4} v {v:.4} omega {omega:.4} map_to_odom {:.4} {:.4} {:.4}",
            seconds(*stamp),
            odom.x,
            odom.y,
            odom.theta,
            covariance[0].sqrt(),
            covariance[7].sqrt(),
            covariance[35].sqrt(),
            map_to_odom.x,
            map_to_odom.y,
            map_to_odom.theta,
        ),
        Report::Joints { stamp, joints } => {
            let each = joints.iter().map(|joint| {
                let (position, velocity) = (joint.position, joint.velocity);
                format!(" {} {position:.4} {velocity:.4}", joint.name)
            });
            format!("joints {}{}", seconds(*stamp), each.collect::<String>())
        }
        Report::Battery { stamp, volts } => {
            let volts = volts.map_or_else(|| "-".to_owned(), |volts| format!("{volts:.3}"));
            format!("battery {} {volts}", seconds(*stamp))
        }
        Report::Diagnostics {
            stamp, statuses, ..
        } => {
            let each = statuses.iter().map(|status| {
                let (name, level, message) = (&status.name, status.level, &status.message);
                format!(" {name}: {level:?} {message};")
            });
            let each: String = each.collect();
            format!(
                "diagnostics {}{}",
                seconds(*stamp),
                each.trim_end_matches(';')
            )
        }
    }
}

/// Of a date, as ROS 2's tools print it.
fn seconds(stamp: i64) -> String {
    format!(
        "{}.{:09}",
        stamp.div_euclid(1_000_000_000),
        stamp.rem_euclid(1_000_000_000)
    )
}
