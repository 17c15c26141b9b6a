//! What makes a run invalid: anything the image did that the emulated board has no answer to.

use super::board::Nucleo;
use super::observer::Observer;
use rigless::session::Session;
use std::fmt::Write;

/// What the image did that a real board may not forgive or the emulated one does not know; None if all is well.
pub(super) fn problem(session: &mut Session<Nucleo>, observer: &Observer) -> Option<String> {
    let mut text = String::new();
    let mut note = |line: std::fmt::Arguments<'_>| {
        let separator = if text.is_empty() { "" } else { "; " };
        // Writing to a string does not fail.
        let _ = write!(text, "{separator}{line}");
    };
    for unmapped in session.unmapped() {
        if !observer.overflows {
            note(format_args!("{unmapped}"));
        }
    }
    for (address, fault) in session.refused() {
        note(format_args!("refused at={address:#010x}: {fault:?}"));
    }
    for (address, unimplemented) in session.unimplemented() {
        let (instance, register) = (unimplemented.instance, unimplemented.register);
        let pc = unimplemented.program_counter;
        note(format_args!(
            "no model of {instance}.{register} at={address:#010x} pc={pc:#010x}"
        ));
    }
    for (address, undefined) in session.undefined() {
        let (instance, pc) = (undefined.instance, undefined.program_counter);
        note(format_args!(
            "no register of {instance} at={address:#010x} pc={pc:#010x}"
        ));
    }
    for (instance, line) in session.unrouted() {
        note(format_args!("interrupt {line} of {instance} is not routed"));
    }
    for told in session.told() {
        let (instance, register, reason) = (told.instance, told.register, told.reason);
        note(format_args!("{instance}.{register}: {reason}"));
    }
    for reset in session.resets().iter().skip(observer.expected_resets()) {
        let (at, cause) = (reset.at.0 as f64 * 1e-9, reset.cause);
        note(format_args!("unexpected reset at {at:.6} s: {cause:?}"));
    }
    if let Some(error) = session.take_error() {
        note(format_args!("{error}"));
    }
    (!text.is_empty()).then_some(text)
}
