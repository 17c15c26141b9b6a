//! What stops the base comes through whatever else is going on, and nothing starts it by itself.

mod common;

use common::Rig;
use vehicle_controller::controller::{Action, AxisCommand};
use vehicle_controller::params::Params;
use vehicle_controller::supervisor::Fault;

fn moving() -> Rig {
    let mut rig = Rig::new();
    rig.ok("m inf 0.5");
    rig.run(1.5);
    rig.unsolicited();
    rig
}

fn speed(rig: &Rig) -> f32 {
    rig.snapshot().translation.speed
}

#[test]
fn estop_overtakes_the_lines_that_wait_and_is_answered_in_its_turn() {
    let mut rig = moving();
    rig.receive(&[&b"m\n".repeat(10)[..], b"@9 EStop\n@10 GetStatus\n"].concat());
    rig.pump();
    rig.tick();
    rig.tick();
    assert_eq!(speed(&rig), 0.0);
    assert_eq!(rig.snapshot().fault, Some(Fault::Estop));
    let replies = rig.ask_all(b"", 12);
    assert_eq!(replies[10], "@9 OK", "{replies:?}");
    assert!(replies[11].starts_with("@10 ERR busy"), "{replies:?}");
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD enabled estop");
}

#[test]
fn estop_overtakes_a_list_and_an_output_that_nobody_reads() {
    let mut rig = moving();
    rig.listening = false;
    rig.receive(b"ListParams\nGetState\n");
    rig.run(0.05);
    rig.receive(b"EStop\n");
    rig.pump();
    rig.tick();
    rig.tick();
    assert_eq!(speed(&rig), 0.0);
}

#[test]
fn stop_is_obeyed_after_the_lines_before_it_however_many() {
    let mut rig = moving();
    rig.receive(&[&b"m\n".repeat(6)[..], b"@9 Stop\n"].concat());
    let replies = rig.ask_all(b"", 7);
    assert!(replies[5].starts_with("ERR busy"), "{replies:?}");
    assert_eq!(replies[6], "@9 OK");
    rig.run(1.0);
    assert_eq!(speed(&rig), 0.0);
    assert_eq!(rig.unsolicited(), ["! stop command"]);
}

#[test]
fn estop_then_clearfault_in_one_burst_clears() {
    let mut rig = moving();
    assert_eq!(
        rig.ask_all(b"EStop\nClearFault\nGetStatus\n", 3)[2],
        "Status HOLD HOLD enabled none"
    );
    rig.run(1.0);
    assert_eq!(speed(&rig), 0.0);
}

#[test]
fn clearfault_then_estop_in_one_burst_does_not() {
    let mut rig = moving();
    rig.ok("EStop");
    rig.ask_all(b"ClearFault\nEStop\n", 2);
    rig.tick();
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD enabled estop");
}

#[test]
fn what_came_before_an_estop_does_not_undo_it() {
    let mut rig = Rig::new();
    rig.ok("EStop");
    rig.tick();
    // The list keeps the others waiting.
    rig.receive(b"ListParams\nClearFault\nm inf 0.5 2\nt inf 90\nEStop\n");
    rig.pump();
    for _ in 0..2000 {
        rig.tick();
        assert_eq!(speed(&rig), 0.0);
        assert_eq!(rig.snapshot().fault, Some(Fault::Estop));
    }
    let replies = rig.ask_all(b"", 5);
    for (reply, wanted) in replies[1..]
        .iter()
        .zip(["ERR fault", "ERR fault", "ERR fault"])
    {
        assert!(reply.starts_with(wanted), "{replies:?}");
    }
    assert_eq!(replies[4], "OK", "{replies:?}");
    rig.ok("ClearFault");
    rig.ok("m 0.1");
}

#[test]
fn a_stop_does_not_wait_for_a_list() {
    let mut rig = moving();
    rig.listening = false;
    rig.receive(b"ListParams\nStop\n");
    rig.run(0.6);
    assert_eq!(speed(&rig), 0.0, "0.5 m/s at 1 m/s² take 0.5 s");
}

#[test]
fn a_stop_counts_for_what_moves_before_it_however_many_stops_came_earlier() {
    // Nobody reads; the second Stop waits behind a list.
    let mut rig = Rig::new();
    rig.listening = false;
    rig.receive(b"Stop\nm 50 0.5 1\nListParams\nStop\n");
    rig.run(3.0);
    assert_eq!(speed(&rig), 0.0);
    // Too many lines wait for it to be remembered at all.
    let mut rig = Rig::new();
    rig.receive(b"Stop\nm 50 0.5 1\nGetTime\nGetTime\n");
    for tag in 1..=40 {
        rig.receive(format!("@{tag} GetTime\n").as_bytes());
    }
    rig.receive(b"Stop\n");
    rig.run(3.0);
    assert_eq!(speed(&rig), 0.0);
    // And it is over: a move after it goes on.
    rig.replies();
    rig.ok("m 50 0.5 1");
    rig.run(1.0);
    assert!(speed(&rig) > 0.4);
}

#[test]
fn no_fault_clears_while_the_emergency_stop_is_open() {
    let mut rig = Rig::after(Params::default(), Some(Fault::Watchdog));
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD enabled watchdog");
    rig.refused("m 1", "fault");
    rig.ok("SetParam estop_input 1");
    rig.inputs.estop_open = true;
    rig.tick();
    assert_eq!(
        rig.unsolicited().last().map(String::as_str),
        Some("! fault estop")
    );
    rig.refused("ClearFault", "fault");
    rig.inputs.estop_open = false;
    rig.run(1.0);
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD enabled estop");
    rig.ok("ClearFault");
    rig.run(1.0);
    assert_eq!(speed(&rig), 0.0);
    rig.ok("m 1");
    rig.run(0.5);
    assert!(speed(&rig) > 0.0);
}

#[test]
fn an_output_that_refuses_is_a_fault_until_it_obeys() {
    let mut rig = moving();
    rig.broken.set(true);
    rig.run(0.01);
    assert_eq!(rig.unsolicited(), ["! fault output"]);
    assert!(rig.refused("ClearFault", "fault").contains("output"));
    rig.broken.set(false);
    rig.run(0.01);
    rig.ok("ClearFault");
    rig.run(0.5);
    assert_eq!(speed(&rig), 0.0);
    rig.ok("m 1");
    rig.run(0.5);
    assert!(speed(&rig) > 0.0);
}

#[test]
fn no_correction_leads_beyond_use() {
    let mut rig = Rig::new();
    rig.refused("CorrectPos 0 0 7.77e6 0 0 0 0 0 0 0 0 1e9", "range");
    rig.ok("ResetPos 0 0 0 1e6 0 0 1e6 0 1e6");
    rig.refused("CorrectPos 1 0 0 -1e9 0 0 0 0 0 0 0 0", "range");
    rig.ok("ResetPos 1 2 3 1 0 0 1 0 1");
    assert!(
        rig.ask("GetEstPos")
            .starts_with("EstPos 1.000000 2.000000 3.00000 1.00000e0")
    );
}

#[test]
fn disable_that_is_taken_back_ends_as_a_stop() {
    let mut rig = moving();
    rig.ok("Disable");
    rig.run(0.1);
    rig.ok("Enable");
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), ["! stop command"]);
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD enabled none");
}

#[test]
fn disable_then_stop_is_still_disable() {
    let mut rig = moving();
    rig.ok("Disable");
    rig.run(0.1);
    rig.ok("Stop");
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), ["! stop disable"]);
    assert_eq!(rig.ask("GetStatus"), "Status HOLD HOLD disabled none");
    rig.refused("m 1", "disabled");
}

#[test]
fn estop_has_the_last_word_over_a_clearfault_of_the_same_tick() {
    let mut rig = Rig::after(Params::default(), Some(Fault::Watchdog));
    rig.receive(b"ClearFault\n");
    rig.poll_only();
    rig.receive(b"@2 EStop\n");
    rig.poll_only();
    rig.pump();
    assert_eq!(
        rig.ask_all(b"@3 GetStatus\n", 3)[1..],
        ["@2 OK", "@3 Status HOLD HOLD enabled estop"]
    );
}

#[test]
fn estop_is_seen_behind_any_number_of_lines() {
    let mut rig = moving();
    rig.listening = false;
    rig.receive(&[&b"GetEstPos\n".repeat(500)[..], b"EStop\n"].concat());
    rig.pump();
    rig.tick();
    rig.tick();
    assert_eq!(speed(&rig), 0.0);
    rig.listening = true;
    let replies = rig.ask_all(b"", 501);
    assert_eq!(replies[500], "OK");
}

#[test]
fn estop_needs_no_clock() {
    let mut rig = moving();
    rig.receive(b"EStop\n");
    rig.pump();
    rig.tick_at_the_same_time();
    assert_eq!(rig.snapshot().fault, Some(Fault::Estop));
}

#[test]
fn what_waits_for_its_cycle_does_not_undo_an_estop() {
    let mut rig = Rig::after(Params::default(), Some(Fault::Watchdog));
    let motion = AxisCommand {
        distance: 1.0,
        speed: 0.3,
        acceleration: 0.5,
    };
    for action in [Action::ClearFault, Action::Move(motion), Action::EStop] {
        rig.act(&action);
    }
    rig.tick_at_the_same_time();
    assert_eq!(rig.snapshot().fault, Some(Fault::Estop));
    rig.run(1.0);
    assert_eq!(rig.snapshot().fault, Some(Fault::Estop));
    assert_eq!(speed(&rig), 0.0);
}
