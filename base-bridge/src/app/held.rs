//! Poses that wait until it is known where `odom` is in the map: a correction, or a base that starts anew, moves that, and the next telemetry tells by how
//! much. It comes within a few hundredths of a second.

use super::bridge::Bridge;
use crate::commands::posture;
use crate::network::{Received, Request};
use std::mem::{discriminant, take};

impl Bridge {
    /// Keeps a pose that must wait, of each kind the newest. Returns everything else. Behind one that waits all wait: they keep their order, and corrections
    /// do not go on and on.
    pub(super) fn hold(&mut self, received: Received) -> Option<Received> {
        let pose = match &received.request {
            Request::Fix(pose) | Request::SetPose(pose, _) => &pose.pose,
            Request::Goal(pose) => pose,
            _ => return Some(received),
        };
        let must_wait = posture::bare(&pose.frame) == self.names.odom && !self.knows_odom();
        if !must_wait && self.held.is_empty() {
            return Some(received);
        }
        let kind = discriminant(&received.request);
        let is_old = |old: &Received| discriminant(&old.request) == kind;
        let old = self.held.iter().position(is_old);
        if let Some(Received { request, .. }) = old.map(|old| self.held.remove(old))
            && let Request::SetPose(_, Some(reply)) = request
        {
            reply(Err("a newer pose came".to_owned()));
        }
        self.held.push(received);
        None
    }

    fn knows_odom(&self) -> bool {
        self.told.is_some() && !self.corrected && !self.is_correcting()
    }

    /// Telemetry has come: those that wait are taken, if that is what they wait for.
    pub(super) fn release(&mut self) {
        if self.knows_odom() {
            self.take_held();
        }
    }

    /// Takes all that wait, as if they came now. Without a base, that refuses them.
    pub(super) fn take_held(&mut self) {
        for received in take(&mut self.held) {
            self.request(received);
        }
    }

    /// The base was told something else since.
    pub(super) fn drop_held_goal(&mut self) {
        self.held
            .retain(|held| !matches!(held.request, Request::Goal(_)));
    }
}
