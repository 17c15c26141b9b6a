//! What the network asks for.

use super::bridge::Bridge;
use crate::client::Ask;
use crate::commands::velocity::MAX_FUTURE;
use crate::commands::{Refusal, observation, posture};
use crate::network::{FramedPose, Received, Reply, Request, UncertainPose};
use crate::time::from_stamp;
use ros_messages::base::covariance::turned;
use ros_messages::base::frames::Pose;

/// What is said once, and was said longer ago than this, s, is of another time. Clocks of two computers may differ by less.
const OLD: f64 = 2.0;
/// What a service is answered then.
const NO_LINE: &str = "no base at the line";

impl Bridge {
    /// Takes a request. What came in before the base was known, at this line, is refused: nothing of before may move it.
    pub(super) fn request(&mut self, received: Received) {
        let ready = !self.leaving && self.up_since().is_some_and(|since| received.at >= since);
        let received = if ready {
            self.hold(received)
        } else {
            Some(received)
        };
        let Some(Received { request, at }) = received else {
            return;
        };
        let (name, done) = match request {
            Request::Speeds { .. } if !ready => ("cmd_vel", Err(Refusal::NoBase)),
            Request::Fix(_) if !ready => ("pose_fix", Err(Refusal::NoBase)),
            Request::Goal(_) if !ready => ("goal_pose", Err(Refusal::NoBase)),
            Request::SetPose(_, reply) if !ready => {
                if let Some(reply) = reply {
                    reply(Err(NO_LINE.to_owned()));
                }
                ("initialpose", Err(Refusal::NoBase))
            }
            Request::Stop(reply) | Request::ClearFault(reply) | Request::Enable(_, reply)
                if !ready =>
            {
                // Without a line nobody can be told to stop. Its deadman does.
                reply(Err(NO_LINE.to_owned()));
                return;
            }
            Request::ClearFault(reply) | Request::Enable(true, reply)
                if self.fresh(None, at).is_err() =>
            {
                reply(Err(Refusal::Stale.name().to_owned()));
                return;
            }
            Request::Speeds {
                linear,
                angular,
                stamp,
            } => ("cmd_vel", self.speeds(linear, angular, stamp, at)),
            Request::Fix(observed) => ("pose_fix", self.fix(&observed)),
            Request::Goal(goal) => ("goal_pose", self.goal(&goal, at)),
            Request::SetPose(pose, reply) => ("initialpose", self.set_pose(&pose, at, reply)),
            Request::Stop(reply) => {
                let number = self.stop(at);
                self.replies.insert(number, reply);
                return;
            }
            Request::ClearFault(reply) => {
                let number = self.client.ask(Ask::ClearFault, "ClearFault");
                self.replies.insert(number, reply);
                return;
            }
            Request::Enable(enable, reply) => {
                if !enable {
                    // A Stop is said until it is answered; this is not.
                    self.stop(at);
                }
                let line = if enable { "Enable" } else { "Disable" };
                let number = self.client.ask(Ask::Enable, line);
                self.replies.insert(number, reply);
                return;
            }
        };
        if let Err(refusal) = done {
            let count = self.refused.entry((name, refusal)).or_insert(0);
            *count += 1;
            // Diagnostics count them; that there are any, a person should not have to look for.
            if *count == 1 {
                self.say(format!("{name} refused: {}", refusal.name()));
            }
        }
    }

    fn speeds(
        &mut self,
        linear: [f64; 3],
        angular: [f64; 3],
        stamp: Option<i64>,
        at: f64,
    ) -> Result<(), Refusal> {
        let now = self.epoch.now();
        let stamped = self.stamped(stamp).unwrap_or(at);
        if stamped > now + MAX_FUTURE {
            return Err(Refusal::Future);
        }
        let said = stamped.min(at);
        self.not_before_a_stop(said)?;
        self.velocity.receive(linear, angular, now - said, now)?;
        self.drop_held_goal();
        Ok(())
    }

    /// Ends whatever the base was told to do until then.
    fn stop(&mut self, said: f64) -> u64 {
        self.stopped = self.stopped.max(said);
        self.velocity.forget();
        self.drop_held_goal();
        self.client.stop()
    }

    /// Refuses what was said long ago: by its stamp, or by when it came in. Returns when it was said.
    fn fresh(&self, stamp: Option<i64>, at: f64) -> Result<f64, Refusal> {
        let said = self.stamped(stamp).unwrap_or(at).min(at);
        if self.epoch.now() - said > OLD {
            Err(Refusal::Stale)
        } else {
            Ok(said)
        }
    }

    /// Refuses what was said before the base was told to stop: it came later, by another way.
    fn not_before_a_stop(&self, said: f64) -> Result<(), Refusal> {
        if said < self.stopped {
            Err(Refusal::Stale)
        } else {
            Ok(())
        }
    }

    /// A stamp in the bridge's seconds.
    fn stamped(&self, stamp: Option<i64>) -> Option<f64> {
        stamp.map(|stamp| from_stamp(self.epoch.wall_offset(), stamp))
    }

    fn fix(&mut self, observed: &UncertainPose) -> Result<(), Refusal> {
        // Without a stamp nobody knows where the base was then.
        let stamp = observed.pose.stamp.ok_or(Refusal::Stale)?;
        let measured = from_stamp(self.epoch.wall_offset(), stamp);
        observation::timely(self.epoch.now() - measured)?;
        let (pose, covariance) = self.in_map(observed)?;
        let line = observation::observe(&pose, &covariance);
        self.client.ask_aged(Ask::Observe, line, measured);
        Ok(())
    }

    fn set_pose(
        &mut self,
        pose: &UncertainPose,
        at: f64,
        reply: Option<Reply>,
    ) -> Result<(), Refusal> {
        let fresh = self.fresh(pose.pose.stamp, at);
        match fresh.and_then(|_| self.in_map(pose)) {
            Ok((pose, covariance)) => {
                let line = observation::reset(&pose, &covariance);
                let number = self.client.ask(Ask::Reset, line);
                if let Some(reply) = reply {
                    self.replies.insert(number, reply);
                }
                Ok(())
            }
            Err(refusal) => {
                if let Some(reply) = reply {
                    reply(Err(refusal.name().to_owned()));
                }
                Err(refusal)
            }
        }
    }

    fn goal(&mut self, goal: &FramedPose, at: f64) -> Result<(), Refusal> {
        let said = self.fresh(goal.stamp, at)?;
        self.not_before_a_stop(said)?;
        let (goal, _) = self.pose_in_map(goal)?;
        // Speeds that somebody said before are over, or they would end the way to the goal; also if the base refuses it, or never hears of it.
        self.stop(said);
        self.client.ask(Ask::GoTo, posture::go_to(&goal));
        Ok(())
    }

    /// The pose in the map's frame, and where the frame is that it was in.
    fn pose_in_map(&self, pose: &FramedPose) -> Result<(Pose, Pose), Refusal> {
        let known = posture::Known {
            map: &self.names.map,
            odom: &self.names.odom,
            map_to_odom: self.frames.map_to_odom(),
        };
        let origin = known.origin(&pose.frame)?;
        let pose = posture::planar(pose.position, pose.orientation)?;
        Ok((origin.then(&pose), origin))
    }

    fn in_map(&self, pose: &UncertainPose) -> Result<(Pose, observation::Covariance), Refusal> {
        let covariance = observation::planar(&pose.covariance)?;
        let (pose, origin) = self.pose_in_map(&pose.pose)?;
        Ok((pose, turned(&covariance, origin.theta)))
    }
}
