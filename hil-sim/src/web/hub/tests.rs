use super::*;
use std::sync::mpsc::{Receiver, sync_channel};

struct Base {
    lines: Receiver<Said>,
    asked: Receiver<Asked>,
}

fn hub() -> (Hub, Base) {
    let (lines, lines_out) = sync_channel(4);
    let (asked, asked_out) = sync_channel(2);
    let base = Base {
        lines: lines_out,
        asked: asked_out,
    };
    (
        Hub::new(json!({"robot": "r"}), ToBase { lines, asked }),
        base,
    )
}

/// What goes to the base now.
fn passed(hub: &Hub, base: &Base) -> Vec<Vec<u8>> {
    base.lines
        .try_iter()
        .filter_map(|said| hub.pass(said))
        .collect()
}

/// What a client has been told since it was last asked.
fn told(place: &mut Place) -> Vec<String> {
    let mut told = Vec::new();
    while let Ok(message) = place.told.try_recv() {
        told.push(match message {
            Message::Text(text) => text.to_string(),
            message => String::from_utf8(message.into_data().to_vec()).unwrap(),
        });
    }
    told
}

#[test]
fn the_second_driver_is_sent_away_and_the_first_goes_on() {
    let (hub, base) = hub();
    let mut driver = hub.join(Role::Drive).unwrap();
    let farewell = hub.join(Role::Drive).unwrap_err();
    assert_eq!(farewell.code, 4409);
    assert_eq!(farewell.reason, "another page drives");
    hub.hear_text(driver.id, "m 1").unwrap();
    assert_eq!(passed(&hub, &base), [b"m 1\n"]);
    let told = told(&mut driver);
    let hello: Value = serde_json::from_str(&told[0]).unwrap();
    let expected = json!({"hello": {"robot": "r", "role": "drive", "seat": "taken"}});
    assert_eq!((hello, told.len()), (expected, 1));
}

#[test]
fn watchers_are_told_what_is_sent_and_whether_the_seat_is_free() {
    let (hub, _base) = hub();
    let mut watcher = hub.join(Role::Watch).unwrap();
    let mut driver = hub.join(Role::Drive).unwrap();
    hub.hear_text(driver.id, "@1 Stream 0.02").unwrap();
    hub.tell_line("@1 OK");
    hub.leave(driver.id);
    assert_eq!(
        told(&mut watcher)[1..],
        [
            r#"{"seat":"taken"}"#,
            r#"{"sent":"@1 Stream 0.02"}"#,
            "@1 OK",
            r#"{"seat":"free"}"#
        ]
    );
    assert_eq!(told(&mut driver)[1..], ["@1 OK"]);
    let mut late = hub.join(Role::Watch).unwrap();
    assert_eq!(told(&mut late)[1..], [r#"{"sent":"@1 Stream 0.02"}"#]);
    assert!(hub.join(Role::Drive).is_ok());
}

#[test]
fn a_watcher_sends_nothing() {
    let (hub, base) = hub();
    let watcher = hub.join(Role::Watch).unwrap();
    assert_eq!(hub.hear_text(watcher.id, "m 1").unwrap_err().code, 1008);
    let clear = br#"{"id":1,"clear":true}"#;
    assert_eq!(hub.hear_request(watcher.id, clear).unwrap_err().code, 1008);
    assert!(base.lines.try_recv().is_err() && base.asked.try_recv().is_err());
}

#[test]
fn who_has_left_the_seat_drives_no_more() {
    let (hub, base) = hub();
    let driver = hub.join(Role::Drive).unwrap();
    hub.leave(driver.id);
    assert!(hub.hear_text(driver.id, "m 1").is_err());
    assert!(base.lines.try_recv().is_err());
}

#[test]
fn what_is_no_line_is_not_passed_on_and_a_thousand_are_too_many() {
    let (hub, base) = hub();
    let mut driver = hub.join(Role::Drive).unwrap();
    for count in 1..=1000 {
        let heard = match count % 4 {
            0 => hub.hear_text(driver.id, ""),
            1 => hub.hear_text(driver.id, "m 1\nm 2"),
            2 => hub.hear_request(driver.id, b"\xff"),
            _ => hub.hear_request(driver.id, br#"{"clear":true}"#),
        };
        match heard {
            Ok(()) => assert!(count < 1000),
            Err(farewell) => assert_eq!((farewell.code, count), (1008, 1000)),
        }
    }
    assert!(base.lines.try_recv().is_err());
    assert_eq!(told(&mut driver).len(), 1, "nothing is answered");
}

#[test]
fn a_driver_that_is_faster_than_the_base_is_sent_away() {
    let (hub, _base) = hub();
    let driver = hub.join(Role::Drive).unwrap();
    for line in 0..4 {
        hub.hear_text(driver.id, &format!("m {line}")).unwrap();
    }
    let farewell = hub.hear_text(driver.id, "m 4").unwrap_err();
    assert_eq!(
        (farewell.code, farewell.reason.as_str()),
        (1008, "too fast")
    );
    hub.leave(driver.id);
}

#[test]
fn what_waits_of_a_driver_who_has_left_is_dropped_but_a_stop() {
    let (hub, base) = hub();
    let first = hub.join(Role::Drive).unwrap();
    let mut watcher = hub.join(Role::Watch).unwrap();
    for line in ["@1 m inf 0.3", "@2 Stream 0.1 t", "@3 Stop*ABCD"] {
        hub.hear_text(first.id, line).unwrap();
    }
    hub.leave(first.id);
    let second = hub.join(Role::Drive).unwrap();
    hub.hear_text(second.id, "GetTime").unwrap();
    assert_eq!(
        passed(&hub, &base),
        [b"@3 Stop*ABCD\n".as_slice(), b"GetTime\n"]
    );
    hub.tell_line("@2 OK");
    told(&mut watcher);
    let mut late = hub.join(Role::Watch).unwrap();
    assert_eq!(
        told(&mut late).len(),
        1,
        "the stream has not been asked for, and no answer accepts it"
    );
}

#[test]
fn at_the_end_everybody_is_told_and_nobody_comes_any_more() {
    let (hub, _base) = hub();
    let mut driver = hub.join(Role::Drive).unwrap();
    let visit = hub.visit();
    hub.close();
    let farewell = driver.dismissed.try_recv().unwrap();
    assert_eq!(
        (farewell.code, farewell.reason.as_str()),
        (1001, "the simulator ends")
    );
    assert_eq!(hub.join(Role::Watch).unwrap_err().code, 1001);
    assert!(hub.is_visited());
    drop(visit);
    assert!(!hub.is_visited());
}

#[test]
fn requests_are_numbered_and_answered() {
    let (hub, base) = hub();
    let mut driver = hub.join(Role::Drive).unwrap();
    let ask = |text: &str| hub.hear_request(driver.id, text.as_bytes()).unwrap();
    ask(r#"{"id":7,"clear":true}"#);
    let asked = base.asked.try_recv().unwrap();
    assert_eq!((asked.client, asked.id), (driver.id, 7));
    ask(r#"{"id":8,"jump":true}"#);
    ask(r#"{"id":9,"clear":true}"#);
    ask(r#"{"id":10,"clear":true}"#);
    ask(r#"{"id":11,"clear":true}"#);
    hub.answer(driver.id, 9, Ok(()));
    hub.answer(driver.id, 10, Err("no".into()));
    let told = told(&mut driver);
    assert!(told[1].starts_with(r#"{"refused":8,"why":""#), "{told:?}");
    assert_eq!(
        told[2..],
        [
            r#"{"refused":11,"why":"too much at once"}"#,
            r#"{"done":9}"#,
            r#"{"refused":10,"why":"no"}"#
        ]
    );
}

#[test]
fn who_does_not_read_is_sent_away_and_takes_no_more_memory() {
    let (hub, _base) = hub();
    let mut deaf = hub.join(Role::Drive).unwrap();
    let mut watcher = hub.join(Role::Watch).unwrap();
    for _ in 0..3 {
        for _ in 0..MAX_UNREAD / 2 {
            hub.tell_line("~ 1");
        }
        told(&mut watcher);
    }
    let farewell = deaf.dismissed.try_recv().unwrap();
    assert_eq!(
        (farewell.code, farewell.reason.as_str()),
        (1008, "reads too slowly")
    );
    assert!(watcher.dismissed.try_recv().is_err());
    // It was the driver: the seat is free.
    assert!(hub.join(Role::Drive).is_ok());
}
