//! What may take motion away, and how: the supervisor's findings, faults and their reactions, stops.

use super::clock::Elapsed;
use super::{Axis, AxisCommand, BRAKING, Controller, Event, Motors, Power, State, StopReason};
use crate::math::{larger, smaller};
use crate::supervisor::{self, Fault, Place, Reaction};
use crate::vehicle::{Twist, VirtualVehicle};

/// A stop for a fault's sake may take this much longer than its ramps …
const STOP_SHARE: f32 = 1.25;
/// … and this long besides, s: an axis waits for so long to come to rest.
const STOP_PATIENCE: f32 = 0.6;

impl<V: VirtualVehicle<Config: Copy>> Controller<V> {
    /// What of the motion can be counted: nothing, if a wheel has made more counts than it can.
    #[inline]
    pub(super) fn counted(&mut self, dt: f32) -> Twist {
        let rolled = self.motion.rolled;
        if let Some(place) = self.supervisor.jumps(&self.config.supervision, rolled, dt) {
            self.trip(Fault::EncoderJump, place);
            return Twist::ZERO;
        }
        self.motion.increment
    }

    #[inline]
    pub(super) fn supervise(&mut self, elapsed: Elapsed) {
        let cycle = self.cycle(elapsed);
        let supervision = &self.config.supervision;
        if self.supervisor.is_silent(supervision, elapsed.seconds) {
            self.lose_link();
        }
        let (config, axes) = (&self.config, (&self.translation, &self.rotation));
        let speed = self.motion.speed;
        let [share, turn_share] = if self.vehicle.steers() {
            self.steered.shares
        } else {
            [1.0; 2]
        };
        let following = || {
            [
                axes.0
                    .following(&config.translation, speed.translation, share),
                axes.1
                    .following(&config.rotation, speed.rotation, turn_share),
            ]
        };
        let found = self
            .supervisor
            .watch(&config.supervision, &cycle, following);
        if let Some((fault, place)) = found {
            self.trip(fault, place);
        }
        if self.vehicle.steers() && self.vehicle.is_astray() {
            self.trip(Fault::Steering, Place::Base);
        }
    }

    /// What the supervisor sees.
    #[inline]
    fn cycle(&self, elapsed: Elapsed) -> supervisor::Cycle {
        supervisor::Cycle {
            dt: elapsed.seconds,
            steps: elapsed.steps,
            wheels: self.vehicle.wheels(),
            currents: self.readings.currents,
            supply: self.readings.supply,
            motor_supply: self.readings.usable,
            turns: self.rotation.state() != State::Hold,
            estimate_is_finite: self.estimator.is_finite(),
        }
    }

    /// Nobody has said anything for too long: what has no end is ended; what has one goes on to it.
    #[cold]
    fn lose_link(&mut self) {
        let (moves, turns) = (self.translation.is_endless(), self.rotation.is_endless());
        if !moves && !turns {
            return;
        }
        self.latch(Fault::Link, Place::Base);
        self.stop_axes(StopReason::Fault, moves, turns);
        let ends =
            (moves || self.translation.is_settled()) && (turns || self.rotation.is_settled());
        if !ends {
            self.deadline = f32::INFINITY;
        }
    }

    #[inline]
    pub(super) fn fault_persists(&self) -> bool {
        self.fault.is_some_and(|fault| self.persists(fault))
    }

    #[cold]
    fn persists(&self, fault: Fault) -> bool {
        let now = || {
            self.cycle(Elapsed {
                seconds: 0.0,
                steps: 1,
            })
        };
        self.readings.estop || self.output_failed || self.config.supervision.persists(fault, &now())
    }

    pub(super) fn stop(&mut self, reason: StopReason) {
        if self.motors == Motors::Off {
            self.translation = Axis::default();
            self.rotation = Axis::default();
            self.come_to_rest(reason);
            return;
        }
        self.stop_axes(reason, true, true);
    }

    fn stop_axes(&mut self, reason: StopReason, translation: bool, rotation: bool) {
        let stop = |acceleration| AxisCommand {
            distance: 0.0,
            speed: 0.0,
            acceleration,
        };
        self.motors = Motors::Driving;
        // A stop for a fault's sake is not taken back by another one, nor is its deadline put off; Disable is not by a Stop.
        let for_fault = self.stopping == Some(StopReason::Fault);
        self.stopping = Some(if for_fault || reason == StopReason::Fault {
            StopReason::Fault
        } else if self.power == Power::Disabling {
            StopReason::Disable
        } else {
            reason
        });
        let mut ramp = 0.0;
        if translation {
            let acceleration = self.config.stop_acceleration;
            ramp = self.translation.reference_speed().abs() / acceleration;
            self.translation
                .command(&self.config.translation, stop(acceleration));
        }
        if rotation {
            let acceleration = self.config.stop_turn_acceleration;
            let turn = self.rotation.reference_speed().abs() / acceleration;
            ramp = larger(ramp, turn);
            self.rotation
                .command(&self.config.rotation, stop(acceleration));
        }
        let deadline = STOP_SHARE * ramp + STOP_PATIENCE;
        self.deadline = if for_fault {
            smaller(deadline, self.deadline)
        } else {
            deadline
        };
    }

    pub(super) fn come_to_rest(&mut self, reason: StopReason) {
        self.stopping = None;
        if self.power == Power::Disabling {
            self.power = Power::Disabled;
            self.switch_off();
        } else if reason == StopReason::Fault {
            self.switch_off();
        }
        self.note(Event::Stopped(reason));
    }

    pub(super) fn switch_off(&mut self) {
        if self.motors != Motors::Off {
            self.motors = Motors::Off;
            self.braking = BRAKING;
        }
    }

    /// Latches a fault, and does to the motion what it demands.
    #[inline(never)]
    pub(super) fn trip(&mut self, fault: Fault, place: Place) {
        match fault.reaction() {
            Reaction::Off => {
                self.switch_off();
                self.stopping = None;
                if self.power == Power::Disabling {
                    self.power = Power::Disabled;
                }
            }
            // Under way already, unless a lost link has let an axis go on.
            Reaction::Stop
                if self.stopping == Some(StopReason::Fault) && self.deadline.is_finite() => {}
            Reaction::Stop => self.stop(StopReason::Fault),
        }
        self.latch(fault, place);
    }

    /// The fault that demands more is the one that is known; an emergency stop is told whatever went before.
    fn latch(&mut self, fault: Fault, place: Place) {
        let rank = |fault: Fault| (fault == Fault::Estop, fault.reaction());
        if self.fault.is_none_or(|latched| rank(fault) > rank(latched)) {
            self.fault = Some(fault);
            self.note(Event::Fault(fault, place));
        }
    }
}
