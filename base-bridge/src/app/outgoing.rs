//! A telemetry row to what is published.

use super::bridge::Bridge;
use crate::robot::Telemetry;
use crate::time::stamp;
use ros_messages::base::covariance::spatial;
use ros_messages::base::frames::{Pose, Reading};
use ros_messages::base::joints::joints;
use ros_messages::base::{Motion, Report};

impl Bridge {
    /// Publishes what a row says. `sent`: when its first byte has left the base at the latest. `corrected`: the estimate may have been corrected since the
    /// last one.
    pub(super) fn publish_row(&mut self, told: &Telemetry, sent: f64, corrected: bool) {
        let resets = self.clock.resets();
        let measured = self.clock.note(told.time, sent);
        if self.clock.resets() != resets {
            self.frames.restart();
        }
        self.frames.advance(
            Reading {
                time: told.time,
                estimate: Pose::new(told.x, told.y, told.theta),
                v: told.v,
                omega: told.omega,
            },
            corrected,
        );
        let stamp = stamp(self.epoch.wall_offset(), measured);
        let early = 0.5 / self.params.rate_odom;
        // Where the base is without how surely is nothing that others could use.
        if let Some(estimate) = &self.estimate {
            let covariance = self.frames.in_odom(&estimate.covariance);
            self.reports.push(Report::Motion(Motion {
                stamp,
                odom: self.frames.odom(),
                map_to_odom: self.frames.map_to_odom(),
                covariance: spatial(&covariance),
                v: told.v,
                omega: told.omega,
                speed_covariance: self.noise.covariance(told.v, told.omega),
            }));
        }
        if self.joints_rate.is_due(measured, early) {
            let joints = joints(&self.names, &self.base, &told.turned());
            if !joints.is_empty() {
                self.reports.push(Report::Joints { stamp, joints });
            }
        }
        if self.battery_rate.is_due(measured, early) {
            // A base that does not measure it says 0.
            let volts = (told.battery > 0.0).then_some(told.battery);
            self.reports.push(Report::Battery { stamp, volts });
        }
    }
}
