use super::*;

fn client() -> Client {
    Client::new(7, 115_200)
}

/// The next line, without its check and end.
fn next(client: &mut Client, now: f64) -> Option<String> {
    let line = String::from_utf8(client.next(now)?).unwrap();
    let line = line.strip_suffix('\n').unwrap();
    let Checked::Right(text) = check::of(line) else {
        panic!("{line}");
    };
    Some(text.to_owned())
}

fn reply(client: &mut Client, text: &str) -> Heard {
    client.hear(&check::with(text))
}

fn answered(heard: Heard) -> Outcome {
    match heard {
        Heard::Answers(answers) if answers.len() == 1 => answers[0].outcome.clone(),
        heard => panic!("{heard:?}"),
    }
}

#[test]
fn three_are_under_way_and_stop_finds_room() {
    let mut client = client();
    for ask in [Ask::Version, Ask::Params, Ask::Status, Ask::Estimate] {
        client.ask(ask, "x");
    }
    assert_eq!(next(&mut client, 0.0).unwrap(), "@7 x");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@8 x");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@9 x");
    assert_eq!(next(&mut client, 0.0), None);
    client.stop();
    assert_eq!(next(&mut client, 0.0).unwrap(), "@10 Stop");
    assert_eq!(next(&mut client, 0.0), None);
    assert_eq!(
        answered(reply(&mut client, "@8 Params 0")),
        Outcome::Reply("Params 0".into())
    );
    assert_eq!(next(&mut client, 0.0).unwrap(), "@11 x");
}

#[test]
fn stop_goes_first_and_nothing_asked_before_it_moves_the_base() {
    let mut client = client();
    client.ask(Ask::Move, "m inf 0.3");
    client.ask(Ask::Status, "GetStatus");
    client.ask(Ask::GoTo, "GoTo 1 2");
    client.stop();
    client.ask(Ask::Turn, "t inf 20");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@7 Stop");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@8 GetStatus");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@9 t inf 20");
    assert_eq!(next(&mut client, 0.0), None);
    let ended: Vec<_> = client.ended(0.0);
    let asks: Vec<_> = ended.iter().map(|answer| answer.ask).collect();
    assert_eq!(asks, [Ask::Move, Ask::GoTo]);
    assert!(
        ended
            .iter()
            .all(|answer| answer.outcome == Outcome::NotSent)
    );
}

#[test]
fn stop_is_sent_until_it_is_answered() {
    let mut client = client();
    let number = client.stop();
    assert_eq!(next(&mut client, 0.0).unwrap(), "@7 Stop");
    assert_eq!(client.ended(0.6), []);
    assert_eq!(next(&mut client, 0.6).unwrap(), "@8 Stop");
    // Damaged on its way.
    assert_eq!(client.hear("@8 ERR checksum"), Heard::Answers(vec![]));
    assert_eq!(next(&mut client, 0.7).unwrap(), "@9 Stop");
    assert!(client.is_stopping());
    let answer = Answer {
        ask: Ask::Stop,
        number,
        outcome: Outcome::Reply("OK".into()),
    };
    assert_eq!(reply(&mut client, "@9 OK"), Heard::Answers(vec![answer]));
    assert!(!client.is_stopping());
}

#[test]
fn the_newest_speed_is_the_one_that_is_sent() {
    let mut client = client();
    for _ in 0..3 {
        client.ask(Ask::Observe, "ObservePos");
        next(&mut client, 0.0).unwrap();
    }
    client.ask(Ask::Move, "m inf 0.1");
    client.ask(Ask::Turn, "t inf 10");
    client.ask(Ask::Move, "m inf 0.2");
    reply(&mut client, "@7 Observed 1");
    reply(&mut client, "@8 Observed 1");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@10 m inf 0.2");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@11 t inf 10");
}

#[test]
fn nothing_survives_the_line() {
    let mut client = client();
    client.ask(Ask::Move, "m inf 0.1");
    next(&mut client, 0.0).unwrap();
    client.ask(Ask::Turn, "t inf 10");
    client.ask(Ask::Reset, "ResetPos 0 0 0");
    client.stop();
    client.lost();
    assert_eq!(next(&mut client, 0.1), None);
    let outcomes: Vec<_> = client
        .ended(0.1)
        .into_iter()
        .map(|a| (a.ask, a.outcome))
        .collect();
    assert_eq!(
        outcomes,
        [
            (Ask::Turn, Outcome::NotSent),
            (Ask::Reset, Outcome::Lost),
            (Ask::Move, Outcome::Lost),
            (Ask::Stop, Outcome::Lost),
        ]
    );
    // A reply that was under way finds nobody.
    assert_eq!(reply(&mut client, "@7 OK"), Heard::Stray);
}

#[test]
fn what_is_not_answered_is_told_and_a_late_reply_is_nobodys() {
    let mut client = client();
    let number = client.ask(Ask::Status, "GetStatus");
    next(&mut client, 1.0).unwrap();
    assert_eq!(client.next_deadline(), Some(1.5));
    assert_eq!(client.ended(1.49), []);
    let answer = Answer {
        ask: Ask::Status,
        number,
        outcome: Outcome::Unanswered,
    };
    assert_eq!(client.ended(1.5), [answer]);
    assert_eq!(reply(&mut client, "@7 Status"), Heard::Stray);
    assert_eq!(client.unanswered(), 1);
}

#[test]
fn damage_is_seen() {
    let mut client = client();
    client.ask(Ask::Status, "GetStatus");
    next(&mut client, 0.0).unwrap();
    assert_eq!(client.hear("@7 Status HOLD*0000"), Heard::Damaged);
    assert_eq!(client.hear("@7 Status HOLD"), Heard::Damaged);
    assert_eq!(client.hear("~ 1 2*0000"), Heard::Damaged);
    assert_eq!(client.hear("@7 Status HOLD*00"), Heard::Damaged);
    assert_eq!(client.hear("~ 1 2"), Heard::Row("1 2".into()));
    assert_eq!(
        reply(&mut client, "! stop command"),
        Heard::Event("stop command".into())
    );
    assert_eq!(client.hear("OK"), Heard::Stray);
    client.expect_checks(true);
    assert_eq!(client.hear("~ 1 2"), Heard::Damaged);
    assert_eq!(reply(&mut client, "~ 1 2"), Heard::Row("1 2".into()));
    assert_eq!(
        answered(client.hear("@7 ERR syntax unknown")),
        Outcome::Refused("syntax unknown".into())
    );
}

#[test]
fn a_fix_is_as_old_as_it_is_when_its_line_arrives() {
    let mut client = client();
    let text = "ObservePos 1 2 3 1 0 0 1 0 1";
    client.ask_aged(Ask::Observe, text, 10.0);
    let line = next(&mut client, 10.25).unwrap();
    let age: f64 = line.rsplit(' ').next().unwrap().parse().unwrap();
    // 48 bytes at 115 200 baud.
    assert!((age - 0.2542).abs() < 1e-4, "{line}");
}
