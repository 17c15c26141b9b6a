//! Nobody is there any more: what has no end ends, what has one goes on to it.

mod link_cuts;

use hil_sim::base::Base;
use hil_sim::rig::Rig;
use hil_sim::robot::Robot;
use link_cuts::{Caller, Cut, SEED};

fn robot() -> Robot {
    Robot::load("default").unwrap()
}

fn caller() -> Caller<Rig> {
    Caller::new(Box::new(Rig::new(&robot(), SEED).unwrap()))
}

#[test]
fn a_cut_stops_endless_motions_within_deadman_and_ramp_at_every_phase() {
    let mut worst = [0.0_f64; 2];
    for cut in Cut::random(200) {
        let base: Box<dyn Base> = Box::new(Rig::new(&robot(), SEED).unwrap());
        let parts = cut.try_on(base, &robot());
        worst = [0, 1].map(|which| worst[which].max(parts[which]));
    }
    println!(
        "of deadman + v/a: reference {:.4}, base {:.4}",
        worst[0], worst[1]
    );
}

/// The line is whole, but nobody says anything: what happens is told in its order.
#[test]
fn silence_is_told_as_a_fault_and_then_as_a_stop() {
    let mut caller = caller();
    assert_eq!(caller.ask("m inf 0.5"), "OK");
    let since = caller.now;
    caller.run(2500);
    assert_eq!(caller.events(since), ["fault link", "stop fault"]);
    assert!(caller.has_stopped());
    assert_eq!(caller.row().left_duty, 0.0);
}

#[test]
fn a_motion_with_an_end_goes_on_to_it_without_a_fault() {
    for (command, axis) in [
        ("m 2 0.5 1", 0),
        ("m -1.5 0.3", 0),
        ("t 720 90", 1),
        ("t -400", 1),
    ] {
        let mut caller = caller();
        assert_eq!(caller.ask(command), "OK");
        caller.set_cut(true);
        caller.run(12_000);
        caller.set_cut(false);
        caller.send("");
        caller.run(10);
        assert_eq!(caller.ask("GetStatus"), "Status HOLD HOLD enabled none");
        let [x, _, theta] = caller.base.plant().pose();
        let gone = [x, theta.to_degrees()][axis];
        let wanted: f64 = command.split(' ').nth(1).unwrap().parse().unwrap();
        // The tolerance of move and turn, and what the tyres slip.
        let tolerance = [0.01, 2.0][axis];
        assert!((gone - wanted).abs() < tolerance, "{command}: {gone}");
    }
}

#[test]
fn the_axis_without_an_end_stops_and_the_other_one_reaches_its_target() {
    for (lines, turns) in [
        (["m inf 0.3 1", "t 540 90 180"], true),
        (["t inf 60 180", "m 1.5 0.3 1"], false),
    ] {
        let mut caller = caller();
        for line in lines {
            assert_eq!(caller.ask(line), "OK");
        }
        let since = caller.now;
        let (mut still, mut latched, mut driven) = (0, 0, 0);
        for _ in 0..8500 {
            caller.tick();
            let row = caller.row();
            let reference = if turns { row.v_s_ref } else { row.v_alpha_ref };
            if reference != 0.0 {
                still = caller.now + 1 - since;
            }
            if row.fault == "none" {
                latched = caller.now + 1 - since;
            }
            if row.left_duty != 0.0 {
                driven = caller.now + 1 - since;
            }
        }
        // The answer to the second line came up to 5 ms after its sign of life.
        assert!((995..=1003).contains(&latched), "{lines:?}: {latched}");
        // 0.3 m/s at 1 m/s², and 60 °/s at 360 °/s².
        let ramp = if turns { 300 } else { 167 };
        assert!(still <= latched + ramp + 2, "{lines:?}: {still}");
        // 540° at 90 °/s and 180 °/s² take 6.5 s, 1.5 m at 0.3 m/s and 1 m/s² 5.3 s, and then it has half a second to settle.
        let target = if turns { 6500 } else { 5300 };
        assert!(driven > target - 100 && driven <= target + 700, "{driven}");
        let events = caller.events(since);
        let names: Vec<_> = events
            .iter()
            .map(|event| event.split(' ').take(2).collect::<Vec<_>>().join(" "))
            .collect();
        let done = if turns { "turn done" } else { "move done" };
        assert_eq!(names, ["fault link", done, "stop fault"], "{lines:?}");
        if turns {
            let heading = caller.base.plant().pose()[2].to_degrees();
            assert!((heading - 540.0).abs() < 2.0, "{heading}");
        }
    }
}

#[test]
fn without_a_deadman_it_goes_on_and_on() {
    let mut caller = caller();
    assert_eq!(caller.ask("SetParam deadman 0"), "OK");
    assert_eq!(caller.ask("m inf 0.2"), "OK");
    caller.set_cut(true);
    caller.run(60_000);
    let row = caller.row();
    assert_eq!(
        (row.fault.as_str(), row.move_state.as_str()),
        ("none", "MOVE")
    );
    let x = caller.base.plant().pose()[0];
    // 0.2 m/s for a minute less the 0.2 s that its acceleration costs.
    let [x, y] = [x, caller.base.plant().pose()[1]];
    assert!((x.hypot(y) - 11.96).abs() < 0.05, "{x} {y}");
}

/// Says a line every 0.7 s for 5 s of an endless move; whether the base goes on.
fn goes_on_with(bytes: &[u8]) -> bool {
    let mut caller = caller();
    assert_eq!(caller.ask("m inf 0.1"), "OK");
    for _ in 0..7 {
        caller.run(700);
        caller.base.send(bytes);
    }
    caller.run(20);
    caller.row().fault == "none"
}

#[test]
fn every_accepted_line_is_a_sign_of_life_and_nothing_else_is() {
    for line in [
        "GetTime\n",
        "GetParam deadman\n",
        "GetStatus\n",
        "GetEstPos\n",
        "Version\n",
        "Help\n",
        "m inf 0.1\n",
        "SetParam gate 25\n",
        "@7 GetTime\r\n",
        "Stream 0\n",
        "ResetPos 0 0 0\n",
    ] {
        assert!(goes_on_with(line.as_bytes()), "{line:?} is life");
    }
    let long = vec![b'x'; 300];
    let refused: [&[u8]; 10] = [
        b"m inf 100\n",
        b"SetParam gate -1\n",
        b"SetParam wheel_base 0.21\n",
        b"GetParam nothing\n",
        b"SaveParams\n",
        b"GetTime*0000\n",
        b"Hello\n",
        b"\n\r\n",
        b"\xff\x00\x80 GetTime",
        &long,
    ];
    for bytes in refused {
        assert!(!goes_on_with(bytes), "{:?}", String::from_utf8_lossy(bytes));
    }
}

/// Power that is switched off and on again on the way to rest is no reason to hold on with the motors.
#[test]
fn disable_and_enable_do_not_take_back_the_stop_for_a_fault() {
    for lines in [
        &["Disable", "Enable"][..],
        &["Stop", "Disable", "Enable"],
        &["Enable"],
    ] {
        let mut caller = caller();
        assert_eq!(caller.ask("m inf 0.5"), "OK");
        while caller.row().fault == "none" {
            caller.tick();
        }
        for line in lines {
            assert_eq!(caller.ask(line), "OK");
        }
        caller.base.push(5.0, 0.0, 10.0);
        caller.run(1500);
        let row = caller.row();
        assert_eq!(row.fault, "link");
        assert_eq!(
            [row.left_duty, row.right_duty],
            [0.0; 2],
            "{lines:?}: driven"
        );
        assert!(
            caller
                .lines
                .iter()
                .any(|(_, line)| line == "! stop fault" || line == "! stop disable")
        );
    }
}
