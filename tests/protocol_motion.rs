//! The serial protocol: motion, stops, faults and their events.

mod common;

use common::Rig;
use vehicle_controller::controller::State;

fn speeds(rig: &mut Rig) -> [f64; 2] {
    let data = rig.data("GetEstSpeed", "EstSpeed");
    [data[0], data[1]]
}

fn status(rig: &mut Rig) -> String {
    rig.ask("GetStatus")
}

#[test]
fn a_move_ends_at_its_distance_and_says_so() {
    for (line, x) in [("m 0.3 0.2 0.5", 0.3), ("move -0.3 0.2 0.5", -0.3)] {
        let mut rig = Rig::new();
        rig.ok(line);
        // 0.3/0.2 + 0.2/0.5 = 1.9 s
        rig.run(2.5);
        let pose = rig.data("GetEstPos", "EstPos");
        // The done tolerance; a vehicle that follows exactly is far better.
        assert!((pose[0] - x).abs() < 1e-3, "{pose:?}");
        let events = rig.unsolicited();
        assert_eq!(events.len(), 2, "{events:?}");
        let residual: f64 = events[1]
            .strip_prefix("! move done ")
            .unwrap()
            .parse()
            .unwrap();
        assert!(residual.abs() < 1e-3);
        assert_eq!(status(&mut rig), "Status HOLD HOLD enabled none");
    }
}

#[test]
fn a_turn_is_in_degrees_and_ends_at_its_angle() {
    let mut rig = Rig::new();
    rig.ok("t -90 60 120");
    rig.run(1.0);
    // Counter-clockwise is positive; the printed digits.
    assert!((speeds(&mut rig)[1] + 60.0).abs() < 1e-3);
    rig.run(2.0);
    let pose = rig.data("GetEstPos", "EstPos");
    assert!((pose[2] + 90.0).abs() < 0.2, "{pose:?}");
    let events = rig.unsolicited();
    let residual: f64 = events[1]
        .strip_prefix("! turn done ")
        .unwrap()
        .parse()
        .unwrap();
    assert!(residual.abs() < 0.2);
}

#[test]
fn the_state_names_are_those_of_the_paper() {
    let mut rig = Rig::new();
    rig.ok("m 0.3 0.2 0.5");
    let mut seen = Vec::new();
    for _ in 0..2500 {
        let state = status(&mut rig).split(' ').nth(1).unwrap().to_owned();
        if seen.last() != Some(&state) {
            seen.push(state);
        }
        rig.tick();
    }
    assert_eq!(seen, ["ACCEL", "MOVE", "DECCEL", "HOLD"]);
}

#[test]
fn before_any_command_speeds_come_from_the_parameters() {
    let mut rig = Rig::new();
    rig.ok("m inf");
    rig.ok("t inf");
    rig.run(0.1);
    // 0.5 m/s² and 180 °/s² for 0.1 s; a cycle more or less.
    let [v, w] = speeds(&mut rig);
    assert!(
        (v - 0.05).abs() < 1.1e-3 && (w - 18.0).abs() < 0.4,
        "{v} {w}"
    );
    rig.run(1.0);
    let [v, w] = speeds(&mut rig);
    assert!((v - 0.3).abs() < 1e-5 && (w - 90.0).abs() < 1e-3, "{v} {w}");
}

#[test]
fn before_any_command_the_distance_is_zero() {
    for line in ["m", "t"] {
        let mut rig = Rig::new();
        rig.ok(line);
        rig.run(1.0);
        let pose = rig.data("GetEstPos", "EstPos");
        assert_eq!(pose[..3], [0.0; 3], "{line}");
    }
}

#[test]
fn move_without_parameters_repeats_the_last_one() {
    let mut rig = Rig::new();
    rig.ok("m 0.1 0.2 1");
    for n in 1..=3 {
        rig.run(1.5);
        let x = rig.data("GetEstPos", "EstPos")[0];
        assert!((x - 0.1 * f64::from(n)).abs() < 1e-3, "{x}");
        rig.ok("m");
    }
}

#[test]
fn what_is_left_out_keeps_its_last_value() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.1 1");
    rig.ok("m inf");
    rig.run(0.5);
    assert!((speeds(&mut rig)[0] - 0.1).abs() < 1e-5);
    rig.ok("m inf 0.2");
    rig.run(0.05);
    // The last a, 1 m/s², for 50 ms; a cycle more or less.
    assert!((speeds(&mut rig)[0] - 0.15).abs() < 2.1e-3);
}

#[test]
fn a_refused_move_is_not_the_last_one() {
    let mut rig = Rig::new();
    rig.ok("m 0.1 0.2 1");
    rig.run(1.5);
    rig.refused("m 5 0.1 100", "range");
    rig.refused("m 5 99", "range");
    rig.ok("m");
    rig.run(1.5);
    assert!((rig.data("GetEstPos", "EstPos")[0] - 0.2).abs() < 1e-3);
}

#[test]
fn speeds_and_accelerations_beyond_their_limits_are_refused_and_named() {
    let mut rig = Rig::new();
    for (line, words) in [
        ("m 1 0.71", ["v", "0.7", "m/s"]),
        ("m 1 -0.1", ["v", "0.7", "m/s"]),
        ("m 1 0.1 2.1", ["a", "2", "m/s2"]),
        ("m 1 0.1 0", ["a", "2", "m/s2"]),
        ("m 1 0.1 -1", ["a", "2", "m/s2"]),
        ("t 1 361", ["v", "360", "deg/s"]),
        ("t 1 -1", ["v", "360", "deg/s"]),
        ("t 1 1 1441", ["a", "1440", "deg/s2"]),
        ("t 1 1 0", ["a", "1440", "deg/s2"]),
    ] {
        let reply = rig.refused(line, "range");
        for word in words {
            assert!(reply.split(' ').any(|w| w == word), "{line}: {reply}");
        }
    }
    for line in ["m 1 0.7 2", "t 1 360 1440"] {
        rig.ok(line);
    }
}

#[test]
fn speed_zero_stops_its_own_axis_alone() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.2 1");
    rig.ok("t inf 40 200");
    rig.run(1.0);
    rig.ok("m 1 0");
    rig.run(1.0);
    let [v, w] = speeds(&mut rig);
    assert!(v.abs() < 1e-5 && (w - 40.0).abs() < 1e-3, "{v} {w}");
    assert_eq!(status(&mut rig), "Status HOLD MOVE enabled none");
}

#[test]
fn move_and_turn_reset_their_own_accumulation_only() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.2 1");
    rig.ok("t inf 40 200");
    rig.run(1.0);
    let before = rig.data("GetState", "State");
    rig.ok("t inf");
    let after = rig.data("GetState", "State");
    assert!(after[1] >= before[1] && after[4].abs() < 0.1, "{after:?}");
    rig.ok("m inf");
    let last = rig.data("GetState", "State");
    assert!(last[1].abs() < 1e-3 && last[4] >= after[4], "{last:?}");
}

#[test]
fn stop_brakes_both_axes_at_the_stop_rates() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.5 2");
    rig.ok("t inf 180 1440");
    rig.run(1.0);
    rig.unsolicited();
    rig.ok("Stop");
    rig.run(0.1);
    // 1 m/s² and 360 °/s²; two cycles more or less.
    let [v, w] = speeds(&mut rig);
    assert!(
        (v - 0.4).abs() < 2.1e-3 && (w - 144.0).abs() < 0.8,
        "{v} {w}"
    );
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), ["! stop command"]);
    assert_eq!(speeds(&mut rig), [0.0, 0.0]);
    let state = rig.data("GetState", "State");
    assert!(state[1].abs() < 1e-6 && state[4].abs() < 1e-4, "{state:?}");
}

#[test]
fn stop_resets_the_accumulation_when_the_motors_are_off_too() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.2 1");
    rig.ok("t inf 40 200");
    rig.run(1.0);
    rig.ok("EStop");
    rig.run(0.1);
    assert!(rig.data("GetState", "State")[1] > 0.1);
    rig.ok("Stop");
    rig.run(0.1);
    let state = rig.data("GetState", "State");
    assert!(state[1] == 0.0 && state[4] == 0.0, "{state:?}");
}

#[test]
fn estop_takes_the_motors_off_at_once_and_latches() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.2 1");
    rig.run(1.0);
    rig.unsolicited();
    rig.ok("EStop");
    rig.tick();
    assert_eq!(rig.unsolicited(), ["! fault estop"]);
    assert_eq!(speeds(&mut rig), [0.0, 0.0]);
    assert_eq!(status(&mut rig), "Status HOLD HOLD enabled estop");
    for line in ["m", "m 1", "t 1", "t 1 0"] {
        let reply = rig.refused(line, "fault");
        assert!(reply.contains("estop"));
    }
    rig.ok("EStop");
    rig.ok("Stop");
    rig.ok("Enable");
    assert_eq!(status(&mut rig), "Status HOLD HOLD enabled estop");
}

#[test]
fn nothing_moves_at_clear_fault() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.2 1");
    rig.ok("t inf 40 200");
    rig.run(1.0);
    rig.ok("EStop");
    rig.tick();
    let before = rig.ask("GetEstPos");
    rig.ok("ClearFault");
    rig.run(1.0);
    assert_eq!(rig.ask("GetEstPos"), before);
    assert_eq!(status(&mut rig), "Status HOLD HOLD enabled none");
    rig.ok("m 0.1 0.2 1");
    rig.run(0.3);
    assert_ne!(rig.snapshot().translation.state, State::Hold);
}

#[test]
fn a_fault_is_not_cleared_while_its_cause_lasts() {
    let mut rig = Rig::new();
    rig.inputs.estop_open = true;
    rig.run(0.01);
    // As long as nobody has said that a circuit is connected, the input means nothing.
    assert_eq!(rig.unsolicited(), ["! boot power-on"]);
    rig.ok("SetParam estop_input 1");
    rig.run(0.01);
    assert_eq!(rig.unsolicited(), ["! fault estop"]);
    let reply = rig.refused("ClearFault", "fault");
    assert!(reply.contains("estop"), "{reply}");
    rig.refused("m 1", "fault");
    rig.inputs.estop_open = false;
    rig.run(0.01);
    assert_eq!(status(&mut rig), "Status HOLD HOLD enabled estop");
    rig.ok("ClearFault");
    assert_eq!(status(&mut rig), "Status HOLD HOLD enabled none");
}

#[test]
fn clear_fault_without_a_fault_is_fine() {
    Rig::new().ok("ClearFault");
}

#[test]
fn disable_stops_first_then_takes_the_motors_off() {
    let mut rig = Rig::new();
    rig.ok("m inf 0.5 2");
    rig.run(1.0);
    rig.unsolicited();
    rig.ok("Disable");
    rig.run(0.1);
    // The stop rate, 1 m/s²; two cycles more or less.
    assert!((speeds(&mut rig)[0] - 0.4).abs() < 2.1e-3);
    assert_eq!(rig.unsolicited(), Vec::<String>::new());
    rig.refused("m 1", "disabled");
    rig.run(1.0);
    assert_eq!(rig.unsolicited(), ["! stop disable"]);
    assert_eq!(status(&mut rig), "Status HOLD HOLD disabled none");
    rig.refused("m 1", "disabled");
    rig.refused("t", "disabled");
    rig.ok("Enable");
    let before = rig.ask("GetEstPos");
    rig.run(0.5);
    assert_eq!(rig.ask("GetEstPos"), before);
    rig.ok("m 0.1 0.2");
    rig.run(0.3);
    assert!(speeds(&mut rig)[0] > 0.1);
}

#[test]
fn both_events_come_when_both_axes_arrive() {
    let mut rig = Rig::new();
    rig.unsolicited();
    rig.ok("m 0.1 0.2 1");
    rig.ok("t 20 40 200");
    rig.run(2.0);
    let mut events = rig.unsolicited();
    events.retain(|event| !event.starts_with("! boot"));
    events.sort();
    assert_eq!(events.len(), 2, "{events:?}");
    assert!(events[0].starts_with("! move done ") && events[1].starts_with("! turn done "));
}
