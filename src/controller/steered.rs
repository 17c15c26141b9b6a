//! What is different for a vehicle whose wheels are steered: it points them before it moves, it turns no tighter than they let it, and it holds its heading
//! while it moves, not while it stands.

use super::{Axis, AxisConfig, Controller, Event, axis::AxisEvent};
use crate::math::{limit, smaller};
use crate::vehicle::{Twist, VirtualVehicle};

/// What is remembered of a vehicle that steers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steered {
    /// How much of their wanted speeds translation and rotation had last.
    pub(super) shares: [f32; 2],
    /// What holding the heading has been found to take besides, 1/m: the curve that the steering's offset makes of straight ahead.
    trim: f32,
}

impl Default for Steered {
    fn default() -> Self {
        Self {
            shares: [1.0; 2],
            trim: 0.0,
        }
    }
}

/// The trim turns the vehicle by no more than this over its heading distance, rad (6°).
const MOST_TRIM: f32 = 0.1;

impl<V: VirtualVehicle<Config: Copy>> Controller<V> {
    /// How much of their wanted speeds translation and rotation have, if the wheels' motors leave them `share` of it: nothing while the wheels have to be
    /// pointed first, and of the rotation no more than the translation's reference makes of the tightest curve.
    pub(super) fn steered_shares(&mut self, share: f32) -> [f32; 2] {
        self.steered.shares = self.shares_now(share);
        self.steered.shares
    }

    fn shares_now(&mut self, share: f32) -> [f32; 2] {
        let present = Twist {
            translation: self.translation.reference_speed(),
            rotation: self.rotation.reference_speed(),
        };
        let next = Twist {
            translation: self.translation.urge(),
            rotation: self.rotation.urge(),
        };
        if !self.vehicle.prepare(present, next) {
            return [0.0; 2];
        }
        let tightest = self.vehicle.max_curvature();
        let fastest = self.rotation.fastest_speed();
        let reachable = tightest * present.translation.abs();
        let turn = if tightest.is_finite() && reachable < fastest {
            smaller(share, reachable / fastest)
        } else {
            share
        };
        [share, turn]
    }

    /// A vehicle that turns only while it moves has turned as far as it does once it has come to rest. The residual is told.
    pub(super) fn end_turn_at_rest(&mut self) {
        if self.translation.is_settled() && self.vehicle.max_curvature().is_finite() {
            let ended = self.rotation.end(&self.config.rotation);
            if let Some(AxisEvent::Done(residual)) = ended {
                self.note(Event::TurnDone(residual));
            }
        }
    }

    /// The speed to drive with. A heading error is taken out over some distance, so the slower the vehicle the weaker the correction, and none at rest; and
    /// while it turns in place, it does not translate.
    ///
    /// What holding it takes for ever, as the steering is a little off, is learned while the reference stands: an integral over the distance.
    pub(super) fn steered_speed(&mut self, dt: f32) -> Twist {
        let config = &self.config;
        let rests = |axis: &Axis| axis.is_settled();
        let translation = self.translation.velocity(&config.translation, self.period);
        match (rests(&self.translation), rests(&self.rotation)) {
            (true, true) => Twist {
                translation,
                rotation: 0.0,
            },
            (true, false) => Twist {
                translation: 0.0,
                rotation: self.rotation.velocity(&config.rotation, self.period),
            },
            (false, holds) => {
                let per_second = smaller(
                    translation.abs() / self.vehicle.heading_distance(),
                    config.rotation.gain,
                );
                let rotation = AxisConfig {
                    gain: per_second,
                    ..config.rotation
                };
                let error = self.rotation.error();
                if holds && error.abs() < rotation.max_error && translation != 0.0 {
                    // With a quarter of the squared proportional gain, both per metre, the two together do not swing.
                    let per_metre = per_second / translation;
                    let found = 0.25 * per_metre * per_metre * error * translation * dt;
                    let most = MOST_TRIM / self.vehicle.heading_distance();
                    self.steered.trim = limit(self.steered.trim + found, most);
                }
                let speed = self.rotation.velocity(&rotation, self.period);
                Twist {
                    translation,
                    rotation: speed + self.steered.trim * translation,
                }
            }
        }
    }
}
