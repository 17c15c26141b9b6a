//! The base behind the page's server: who drives, what is heard, and what becomes of a base whose driver is lost.

mod page;

use page::{Heard, Server};
use serde_json::Value;
use std::io::Write;
use std::time::{Duration, Instant};
use tungstenite::Message;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn a_driver_gets_the_answers_in_order_and_sees_it_move() {
    let server = Server::start(&["--speed", "5"]);
    let mut driver = server.join("drive");
    let hello = driver.wait_for_world("hello");
    assert_eq!(hello["robot"], "default");
    assert_eq!(hello["vehicle"], "differential");
    assert_eq!(
        (&hello["image"], &hello["push"]),
        (&Value::Bool(false), &Value::Bool(true))
    );
    assert_eq!(number(&hello["speed"]), 5.0);
    assert_eq!(
        (&hello["role"], &hello["seat"]),
        (&"drive".into(), &"taken".into())
    );
    assert_eq!(number(&hello["truth"]["wheel_base"]), 0.2);
    for line in ["@1 Version", "@2 GetTime", "@3 nonsense", "@4 GetEstPos"] {
        driver.say(line);
    }
    for begin in [
        "@1 Version vehicle-controller ",
        "@2 Time ",
        "@3 ERR syntax ",
        "@4 EstPos 0.000000 0.000000 0.00000 ",
    ] {
        let reply = driver.wait_for("@");
        assert!(reply.starts_with(begin), "{reply}");
    }
    assert_eq!(driver.ask(5, "m 0.2"), "OK");
    driver.wait_for("! move done ");
    let world = driver.wait_for_world("world");
    assert!((number(&world["x"]) - 0.2).abs() < 0.002, "{world}");
    assert!(number(&world["y"]).abs() < 0.01, "{world}");
}

#[test]
fn the_worlds_time_is_that_of_telemetry_and_keeps_pace() {
    let server = Server::start(&["--speed", "2"]);
    let mut driver = server.drive();
    driver.ask(1, "Stream 0.02 t");
    let began = (Instant::now(), number(&driver.wait_for_world("world")["t"]));
    std::thread::sleep(Duration::from_secs(2));
    let (mut telemetry, mut samples) = (0.0_f64, 0);
    let mut last = (Instant::now(), Value::Null);
    while last.0.duration_since(began.0) < Duration::from_secs(3) {
        match driver.hear() {
            Heard::Line(line) => telemetry = line[2..].parse().unwrap(),
            Heard::World(word) => {
                samples += 1;
                last = (Instant::now(), word["world"].clone());
                // A telemetry line comes every 0.02 s and takes some milliseconds to come.
                let ahead = number(&last.1["t"]) - telemetry;
                assert!((-0.001..0.2).contains(&ahead), "{ahead} s ahead");
            }
            Heard::End(..) => panic!("it ended"),
        }
    }
    let took = (last.0 - began.0).as_secs_f64();
    let rate = (number(&last.1["t"]) - began.1) / took;
    assert!((1.9..2.1).contains(&rate), "{rate}");
    assert!((0.9..1.1).contains(&number(&last.1["pace"])), "{}", last.1);
    let frequency = f64::from(samples) / took;
    assert!((22.0..27.0).contains(&frequency), "{frequency} Hz");
}

#[test]
fn a_second_driver_is_sent_away() {
    let server = Server::start(&[]);
    let mut first = server.drive();
    let mut second = server.join("drive");
    // It may just have been closed.
    let _ = second.0.send(Message::text("m 1"));
    let end = second.wait_for_end();
    assert_eq!(end, (4409, "another page drives".to_owned()));
    // Longer than anything takes to begin.
    std::thread::sleep(Duration::from_millis(300));
    assert!(first.ask(1, "GetStatus").starts_with("Status HOLD HOLD "));
    let pose = first.ask(2, "GetEstPos");
    assert!(pose.starts_with("EstPos 0.000000 0.000000 "), "{pose}");
}

#[test]
fn a_watcher_sees_what_is_sent_and_what_is_answered() {
    let server = Server::start(&[]);
    let mut early = server.watch();
    let mut driver = server.drive();
    assert_eq!(early.wait_for_world("seat"), "taken");
    assert_eq!(driver.ask(1, "Stream 0.02 t x"), "OK");
    assert_eq!(early.wait_for_world("sent"), "@1 Stream 0.02 t x");
    early.wait_for("@1 OK");
    early.wait_for("~ ");
    assert!(driver.ask(2, "Stream 0.02 nothing").starts_with("ERR "));
    // Who comes later knows the fields that are in force, not those that were refused.
    let mut late = server.join("watch");
    let hello = late.wait_for_world("hello");
    assert_eq!(
        (&hello["role"], &hello["seat"]),
        (&"watch".into(), &"taken".into())
    );
    assert_eq!(late.wait_for_world("sent"), "@1 Stream 0.02 t x");
    assert_eq!(late.wait_for("~ ").split(' ').count(), 3);
}

#[test]
fn a_watcher_that_sends_is_closed() {
    let server = Server::start(&[]);
    let mut driver = server.drive();
    for message in [
        Message::text("m 1"),
        Message::text(""),
        Message::binary(br#"{"id":1,"push":[50,0,1]}"#.to_vec()),
    ] {
        let mut watcher = server.watch();
        watcher.0.send(message).unwrap();
        assert_eq!(watcher.wait_for_end().0, 1008);
    }
    std::thread::sleep(Duration::from_millis(300));
    let pose = driver.ask(1, "GetEstPos");
    assert!(pose.starts_with("EstPos 0.000000 0.000000 "), "{pose}");
}

#[test]
fn the_seat_can_be_taken_when_it_is_free() {
    let server = Server::start(&[]);
    let mut watcher = server.watch();
    for _ in 0..20 {
        let mut driver = server.drive();
        assert_eq!(watcher.wait_for_world("seat"), "taken");
        driver.ask(1, "GetTime");
        driver.0.close(None).unwrap();
        assert_eq!(watcher.wait_for_world("seat"), "free");
    }
}

#[test]
fn what_is_no_line_is_not_passed_on() {
    let server = Server::start(&[]);
    let mut driver = server.drive();
    let mut watcher = server.watch();
    for wrong in [
        "",
        "m 1\nm 1",
        "m 1\r",
        "m\u{0}1",
        "m 1 °",
        &"m".repeat(256),
    ] {
        driver.say(wrong);
    }
    for wrong in [&b"\xff"[..], b"{}", b"m 1", b"[1]", b""] {
        driver.0.send(Message::binary(wrong.to_vec())).unwrap();
    }
    // Printable nonsense is answered by the base.
    assert!(driver.ask(1, "nonsense").starts_with("ERR syntax"));
    let longest = format!("@2 {}", "m".repeat(252));
    driver.say(&longest);
    assert!(driver.wait_for("@2").starts_with("@2 ERR syntax"));
    assert_eq!(watcher.wait_for_world("sent"), "@1 nonsense");
    assert_eq!(watcher.wait_for_world("sent"), longest);
}

#[test]
fn a_driver_without_rules_is_sent_away() {
    let server = Server::start(&["--speed", "0.1"]);
    let mut driver = server.drive();
    for _ in 0..1000 {
        driver.say("m 1\n");
    }
    assert_eq!(driver.wait_for_end().0, 1008);

    let mut driver = server.drive();
    driver.0.send(Message::text("m".repeat(70_000))).unwrap();
    assert_eq!(driver.wait_for_end().0, 1009);

    let mut driver = server.drive();
    // Final text frame of one byte, masked with nothing, that is not UTF-8.
    let broken = [0x81, 0x81, 0, 0, 0, 0, 0xFF];
    driver.stream().write_all(&broken).unwrap();
    assert_eq!(driver.wait_for_end().0, 1007);

    let mut driver = server.drive();
    // A frame without a mask.
    driver.stream().write_all(&[0x81, 1, b'm']).unwrap();
    assert_eq!(driver.wait_for_end().0, 1002);

    // A base at a tenth of its speed reads a kilobyte in a second.
    let mut driver = server.drive();
    for _ in 0..400 {
        if driver.0.send(Message::text("GetEstPos")).is_err() {
            break;
        }
    }
    assert_eq!(driver.wait_for_end(), (1008, "too fast".to_owned()));
    server.drive();
}

/// How long after power-on, and where, a base that lost its driver has come to rest.
fn rest(watcher: &mut page::Client) -> (f64, f64) {
    watcher.wait_for("! fault link");
    watcher.wait_for("! stop ");
    let settled = watcher.wait_for_world("world");
    std::thread::sleep(Duration::from_millis(500));
    // What has come meanwhile is read to the present.
    let until = number(&settled["t"]) + 0.4;
    let later = watcher.wait(
        "a later world",
        |heard| matches!(heard, Heard::World(word) if word["world"]["t"].as_f64() > Some(until)),
    );
    let Heard::World(later) = later else {
        unreachable!()
    };
    let moved = number(&later["world"]["x"]) - number(&settled["x"]);
    assert!(moved.abs() < 0.001, "it moves on by {moved} m");
    (number(&settled["t"]), number(&settled["x"]))
}

#[test]
fn a_driver_whose_connection_is_reset_is_a_lost_link() {
    let server = Server::start(&[]);
    let mut watcher = server.watch();
    let mut driver = server.drive();
    driver.ask(1, "m inf 0.2");
    std::thread::sleep(Duration::from_millis(500));
    driver.reset();
    assert_eq!(watcher.wait_for_world("seat"), "taken");
    assert_eq!(watcher.wait_for_world("seat"), "free");
    let (_, x) = rest(&mut watcher);
    // It was accelerating for a while, and stops a second after its last line.
    assert!((0.05..0.5).contains(&x), "{x} m");
    server.drive();
}

#[test]
fn a_driver_that_answers_no_pings_is_a_lost_link() {
    let server = Server::start(&[]);
    let mut watcher = server.watch();
    let mut driver = server.drive();
    driver.ask(1, "m inf 0.1");
    let began = Instant::now();
    // It goes on sending signs of life, and reads nothing.
    let sender = std::thread::spawn(move || {
        while driver.0.send(Message::text("GetTime")).is_ok() {
            assert!(began.elapsed() < Duration::from_secs(30), "it is kept");
            std::thread::sleep(Duration::from_millis(200));
        }
    });
    assert_eq!(watcher.wait_for_world("seat"), "taken");
    assert_eq!(watcher.wait_for_world("seat"), "free");
    let took = began.elapsed().as_secs_f64();
    // Pinged after 2 s at the latest, patience of 5 s; those before may have been read with the answers.
    assert!((4.5..10.0).contains(&took), "{took} s");
    let (_, x) = rest(&mut watcher);
    assert!((0.3..1.2).contains(&x), "{x} m");
    sender.join().unwrap();
}

#[test]
fn what_a_driver_sent_before_it_went_is_passed_on_whole_or_not_at_all() {
    let server = Server::start(&[]);
    let mut watcher = server.watch();
    let mut driver = server.drive();
    driver.say("@1 m 0.05");
    driver.wait_for("@1 OK");
    // The beginning of a frame with `m 1` in it.
    let half = [0x81, 0x83, 0, 0, 0, 0, b'm'];
    driver.stream().write_all(&half).unwrap();
    drop(driver);
    watcher.wait_for("! move done ");
    let mut next = server.drive();
    let reply = next.ask(2, "GetEstPos");
    let x: f64 = reply.split(' ').nth(1).unwrap().parse().unwrap();
    assert!((x - 0.05).abs() < 0.002, "{reply}");
}

#[test]
fn the_simulated_world_does_what_the_driver_asks() {
    let server = Server::start(&[]);
    let mut driver = server.drive();
    assert_eq!(driver.ask_world(1, r#""push":[15,0,0.3]"#), Ok(()));
    let pushed = driver.wait_for_world("world");
    assert_eq!(pushed["pushed"], true, "{pushed}");
    std::thread::sleep(Duration::from_millis(600));
    let after = driver.wait(
        "the push to end",
        |heard| matches!(heard, Heard::World(word) if word["world"]["pushed"] == false),
    );
    let Heard::World(after) = after else {
        unreachable!()
    };
    assert!(number(&after["world"]["x"]).abs() > 1e-4, "{after}");

    assert_eq!(
        driver.ask_world(2, r#""fault":"left motor weak 0.5""#),
        Ok(())
    );
    let world = driver.wait_for_world("world");
    assert_eq!(world["broken"], serde_json::json!(["left motor weak 0.5"]));
    assert_eq!(driver.ask_world(3, r#""clear":true"#), Ok(()));
    assert_eq!(
        driver.wait_for_world("world")["broken"],
        serde_json::json!([])
    );

    driver.ask(1, "SetParam estop_input 1");
    assert_eq!(driver.ask_world(4, r#""estop":true"#), Ok(()));
    driver.wait_for("! fault estop");
    assert_eq!(driver.wait_for_world("world")["estop"], true);
    assert!(driver.ask(2, "m 0.1").starts_with("ERR fault"));
    assert_eq!(driver.ask_world(5, r#""estop":false"#), Ok(()));
    assert_eq!(driver.wait_for_world("world")["estop"], false);
    assert_eq!(driver.ask(3, "ClearFault"), "OK");

    let why = driver.ask_world(6, r#""fault":"left motor tired""#);
    assert!(
        why.as_ref()
            .is_err_and(|why| why.contains("a motor's fault is")),
        "{why:?}"
    );
    let why = driver.ask_world(7, r#""fault":"left controller dead""#);
    assert!(
        why.as_ref()
            .is_err_and(|why| why.contains("no controllers")),
        "{why:?}"
    );
    let why = driver.ask_world(8, r#""push":[1,2]"#);
    assert!(
        why.as_ref().is_err_and(|why| why.contains("push takes")),
        "{why:?}"
    );
    assert_eq!(
        driver.wait_for_world("world")["broken"],
        serde_json::json!([])
    );
}

#[test]
fn a_fault_that_the_driver_asks_for_is_found_by_the_base() {
    let server = Server::start(&[]);
    let mut driver = server.drive();
    driver.ask(1, "m 1 0.3");
    std::thread::sleep(Duration::from_millis(900));
    assert_eq!(
        driver.ask_world(1, r#""fault":"left encoder stuck""#),
        Ok(())
    );
    driver.wait_for("! fault no-motion left");
}

#[test]
fn a_power_cycle_begins_time_anew_and_ends_telemetry() {
    let server = Server::start(&[]);
    let mut driver = server.drive();
    driver.ask(1, "Stream 0.1 t");
    std::thread::sleep(Duration::from_millis(1500));
    assert_eq!(driver.ask_world(1, r#""power":"cycle""#), Ok(()));
    // It may follow what the board was about to say when its power failed.
    driver.wait(
        "a boot",
        |heard| matches!(heard, Heard::Line(line) if line.ends_with("! boot power-on")),
    );
    let t = number(&driver.wait_for_world("world")["t"]);
    assert!(t < 0.5, "{t}");
    let mut watcher = server.watch();
    let end = Instant::now() + Duration::from_millis(500);
    while Instant::now() < end {
        let heard = watcher.hear();
        assert!(
            matches!(&heard, Heard::World(word) if word.get("world").is_some()),
            "{heard:?}"
        );
    }
}

#[test]
fn a_cut_link_is_silent_and_a_mended_one_is_not() {
    let server = Server::start(&[]);
    let mut driver = server.drive();
    driver.ask(1, "Stream 0.05 t");
    assert_eq!(driver.ask_world(1, r#""fault":"link cut""#), Ok(()));
    assert_eq!(driver.wait_for_world("world")["broken"][0], "link cut");
    driver.say("@2 GetTime");
    let end = Instant::now() + Duration::from_millis(400);
    let mut lines = 0;
    while Instant::now() < end {
        lines += usize::from(matches!(driver.hear(), Heard::Line(_)));
    }
    // What was on its way to the page had left before.
    assert!(lines <= 2, "{lines} lines");
    assert_eq!(driver.ask_world(2, r#""clear":true"#), Ok(()));
    driver.wait_for("~ ");
    assert!(driver.ask(3, "GetTime").starts_with("Time "));
}

#[test]
fn what_waits_of_a_driver_who_has_left_never_reaches_the_base() {
    // A base at a tenth of its speed reads a kilobyte in a second.
    let server = Server::start(&["--speed", "0.1"]);
    let mut watcher = server.watch();
    let mut driver = server.drive();
    driver.ask(1, "GetTime");
    // What the server puts on the way at once is out of its hands.
    for tag in 100..150 {
        driver.say(&format!("@{tag} GetEstPos{}", " ".repeat(100)));
    }
    driver.say("@200 m inf 0.3");
    driver.say("@201 Stop");
    driver.wait_for("@100 EstPos ");
    drop(driver);
    let mut next = server.drive();
    next.say("@300 GetStatus");
    assert_eq!(next.wait_for("@300 "), "@300 Status HOLD HOLD enabled none");
    let mut answered = Vec::new();
    loop {
        let line = watcher.wait_for("@");
        let tag: u16 = line[1..].split(' ').next().unwrap().parse().unwrap();
        if tag == 300 {
            break;
        }
        answered.push(tag);
    }
    let [.., last] = answered[..] else {
        unreachable!()
    };
    assert_eq!(last, 201, "the Stop is passed on: {answered:?}");
    assert!(
        answered.len() < 20 && !answered.contains(&200),
        "{answered:?}"
    );
}

#[cfg(unix)]
#[test]
fn at_the_simulations_end_everybody_is_told() {
    let mut server = Server::start(&[]);
    let mut watcher = server.watch();
    let mut driver = server.drive();
    driver.ask(1, "GetTime");
    server.interrupt();
    for client in [&mut driver, &mut watcher] {
        assert_eq!(
            client.wait_for_end(),
            (1001, "the simulator ends".to_owned())
        );
    }
    let deadline = Instant::now() + page::PATIENCE;
    while server.runs() {
        assert!(Instant::now() < deadline, "it does not end");
        std::thread::sleep(Duration::from_millis(5));
    }
}
