//! From what is known to the text of a reply; degrees exist from here on.

use super::keyword::{ALL, Subject, TOPICS};
use super::text::Text;
use crate::controller::{Estimate, Event, Snapshot};
use crate::params::{DEGREES, Fallback, Id, Params};
use crate::vehicle::Calibration;
use crate::vehicle::gains::OFFSET;

/// Writes a heading in degrees, wrapped to (−180, 180] after rounding to 5 decimals.
pub fn heading(text: &mut Text, theta: f64) {
    const UNIT: f64 = 1e5;
    const TURN: f64 = 360.0 * UNIT;
    let mut rounded = libm::round(crate::math::wrap(theta) * DEGREES * UNIT);
    if rounded <= -0.5 * TURN {
        rounded += TURN;
    }
    text.fixed(rounded / UNIT, 5);
}

/// `EstPos x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ`.
pub fn est_pos(text: &mut Text, estimate: &Estimate) {
    let c = &estimate.covariance;
    text.str("EstPos")
        .fixed(estimate.pose.x, 6)
        .fixed(estimate.pose.y, 6);
    heading(text, estimate.pose.theta);
    text.scientific(c.m11)
        .scientific(c.m12)
        .scientific(c.m13 * DEGREES)
        .scientific(c.m22)
        .scientific(c.m23 * DEGREES)
        .scientific(c.m33 * DEGREES * DEGREES);
}

/// `Gains`, those that the vehicle has (k_r k_l k_b of a differential drive), and their standard deviations; of an offset in degrees.
pub fn gains(text: &mut Text, calibration: &Calibration, params: &Params) {
    text.str("Gains");
    for numbers in [calibration.gains, calibration.spread.deviations()] {
        for (place, (number, id)) in numbers.into_iter().zip(params.gains()).enumerate() {
            let unit = if place == OFFSET { DEGREES } else { 1.0 };
            if id.is_some() {
                text.fixed(f64::from(number) * unit, 6);
            }
        }
    }
}

/// `EstSpeed v_s v_α`.
pub fn est_speed(text: &mut Text, snapshot: &Snapshot) {
    text.str("EstSpeed")
        .fixed(f64::from(snapshot.translation.speed), 6)
        .fixed(f64::from(snapshot.rotation.speed) * DEGREES, 5);
}

/// `Status <move state> <turn state> <flags> <fault>`.
pub fn status(text: &mut Text, snapshot: &Snapshot) {
    text.str("Status")
        .word(snapshot.translation.state.name())
        .word(snapshot.rotation.state.name())
        .word(if snapshot.enabled {
            "enabled"
        } else {
            "disabled"
        })
        .word(snapshot.fault.map_or("none", |fault| fault.name()));
}

/// `State t S S' S'' α α' α''`.
pub fn state(text: &mut Text, snapshot: &Snapshot) {
    let (translation, rotation) = (&snapshot.translation, &snapshot.rotation);
    text.str("State")
        .fixed(seconds(snapshot), 6)
        .fixed(translation.displacement.to_f64(), 6)
        .fixed(f64::from(translation.speed), 6)
        .fixed(f64::from(translation.acceleration), 6)
        .fixed(rotation.displacement.to_f64() * DEGREES, 5)
        .fixed(f64::from(rotation.speed) * DEGREES, 5)
        .fixed(f64::from(rotation.acceleration) * DEGREES, 5);
}

/// `Time t`.
pub fn time(text: &mut Text, snapshot: &Snapshot) {
    text.str("Time").fixed(seconds(snapshot), 6);
}

fn seconds(snapshot: &Snapshot) -> f64 {
    snapshot.time.ticks() as f64 * 1e-6
}

/// `Battery <volts>`.
pub fn battery(text: &mut Text, snapshot: &Snapshot) {
    text.str("Battery").fixed(f64::from(snapshot.supply), 3);
}

/// `Steering φ`.
pub fn steering(text: &mut Text, snapshot: &Snapshot) {
    text.str("Steering")
        .fixed(f64::from(snapshot.steering()) * DEGREES, 4);
}

/// `Wheels <left count> <right count> <left m/s> <right m/s> <left duty> <right duty>`.
pub fn wheels(text: &mut Text, snapshot: &Snapshot) {
    let [left, right] = &snapshot.wheels;
    text.str("Wheels")
        .integer(left.count)
        .integer(right.count)
        .fixed(f64::from(left.speed), 6)
        .fixed(f64::from(right.speed), 6)
        .fixed(f64::from(left.duty), 4)
        .fixed(f64::from(right.duty), 4);
}

/// `Param name value unit`.
pub fn param(text: &mut Text, params: &Params, id: Id) {
    let spec = id.spec();
    text.str("Param")
        .word(spec.name)
        .shortest(params.get(id))
        .word(spec.unit);
}

/// `~ name value min max unit`.
pub fn param_row(text: &mut Text, params: &Params, id: Id) {
    let spec = id.spec();
    text.str("~")
        .word(spec.name)
        .shortest(params.get(id))
        .shortest(spec.min)
        .shortest(spec.max)
        .word(spec.unit);
}

/// An event.
pub fn event(text: &mut Text, event: Event) {
    match event {
        Event::MoveDone(residual) => {
            text.str("! move done").fixed(f64::from(residual), 6);
        }
        Event::TurnDone(residual) => {
            text.str("! turn done")
                .fixed(f64::from(residual) * DEGREES, 5);
        }
        Event::Stopped(reason) => {
            text.str("! stop").word(reason.name());
        }
        Event::Fault(fault, place) => {
            text.str("! fault").word(fault.name());
            if let Some(place) = place.name() {
                text.word(place);
            }
        }
    }
}

/// What of the stored parameters could not be used.
pub fn fallback(text: &mut Text, fallback: Fallback) {
    text.str("! params");
    match fallback {
        Fallback::Default(id) => text.word("default").word(id.spec().name),
        Fallback::Unknown(count) => text.word("unknown").integer(i64::from(count)),
    };
}

/// Help.
pub fn help(text: &mut Text, subject: Subject) {
    text.str("Help");
    match subject {
        Subject::Topics => {
            for topic in TOPICS {
                text.word(topic);
            }
            text.str("; try Help motion, Help move");
        }
        Subject::Topic(topic) => {
            for entry in ALL.iter().filter(|entry| entry.topic == topic) {
                text.word(entry.name);
            }
        }
        Subject::Command(entry) => {
            text.word(entry.short.unwrap_or(entry.name));
            if entry.short.is_some() {
                text.str(" or ").str(entry.name);
            }
            text.word(entry.help);
        }
    }
}
