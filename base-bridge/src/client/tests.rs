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
    assert_eq!(next(&mut client, 0.0).unwrap(), "@8 t inf 20");
    assert_eq!(next(&mut client, 0.0).unwrap(), "@9 GetStatus");
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

/// Three that are under way: nothing but a Stop may be sent.
fn busy() -> Client {
    let mut client = client();
    for text in ["a", "b", "c"] {
        client.ask(Ask::Params, text);
        next(&mut client, 0.0).unwrap();
    }
    client
}

/// What goes out when there is room again.
fn goes(client: &mut Client) -> Vec<String> {
    for tag in 7..10 {
        reply(client, &format!("@{tag} OK"));
    }
    let mut all = Vec::new();
    while let Some(line) = next(client, 0.0) {
        let (tag, text) = line.split_once(' ').unwrap();
        all.push(text.to_owned());
        reply(client, &format!("{tag} OK"));
    }
    all
}

#[test]
fn the_newest_speed_is_the_one_that_is_sent() {
    let mut client = busy();
    client.ask(Ask::Move, "m inf 0.1");
    client.ask(Ask::Turn, "t inf 10");
    client.ask(Ask::Move, "m inf 0.2");
    client.ask(Ask::Turn, "t inf 20");
    assert_eq!(goes(&mut client), ["m inf 0.2", "t inf 20"]);
}

#[test]
fn the_last_command_is_the_one_that_counts() {
    let mut client = busy();
    client.ask(Ask::Move, "m inf 0.1");
    client.ask(Ask::GoTo, "GoTo 1 2");
    client.ask(Ask::Move, "m inf 0");
    client.ask(Ask::Turn, "t inf 0");
    assert_eq!(goes(&mut client), ["m inf 0", "t inf 0"]);
    let mut client = busy();
    client.ask(Ask::GoTo, "GoTo 1 2");
    client.ask(Ask::Move, "m inf 0.1");
    client.ask(Ask::Turn, "t inf 10");
    client.ask(Ask::Reset, "ResetPos 0 0 0");
    client.ask(Ask::GoTo, "GoTo 3 4");
    // A goal is a place of the map as it is by then.
    assert_eq!(goes(&mut client), ["ResetPos 0 0 0", "GoTo 3 4"]);
}

#[test]
fn what_is_told_to_the_base_does_not_wait_for_what_is_measured() {
    let mut client = busy();
    for fix in 0..200 {
        client.ask(Ask::Observe, format!("ObservePos {fix}"));
    }
    for status in 0..100 {
        client.ask(Ask::Version, format!("GetVersion {status}"));
    }
    client.ask(Ask::Enable, "Disable");
    client.ask(Ask::Move, "m inf 0");
    let all = goes(&mut client);
    assert_eq!(all[..3], ["Disable", "m inf 0", "ObservePos 199"]);
}

#[test]
fn a_second_stop_does_not_wait_for_the_first_once_the_base_may_move_again() {
    let mut client = client();
    let first = client.stop();
    assert_eq!(next(&mut client, 0.0).unwrap(), "@7 Stop");
    // It is on its way: the same will answer both, and what is asked behind both is obeyed.
    let second = client.stop();
    assert_eq!(next(&mut client, 0.0), None);
    client.ask(Ask::GoTo, "GoTo 1 2");
    assert_eq!(next(&mut client, 0.01).unwrap(), "@8 GoTo 1 2");
    assert_eq!(next(&mut client, 0.01), None);
    let third = client.stop();
    assert_eq!(next(&mut client, 0.01).unwrap(), "@9 Stop");
    for (tag, expected) in [(7, vec![first, second]), (9, vec![third])] {
        let answers = reply(&mut client, &format!("@{tag} OK"));
        let Heard::Answers(answers) = answers else {
            panic!("{answers:?}");
        };
        let numbers: Vec<_> = answers.iter().map(|answer| answer.number).collect();
        assert_eq!(numbers, expected);
    }
}

#[test]
fn more_than_four_are_never_under_way_but_for_a_stop() {
    let mut client = client();
    let mut stops = 0;
    for round in 0..10 {
        client.stop();
        client.ask(Ask::Move, "m inf 0.3");
        client.ask(Ask::Turn, "t inf 20");
        while let Some(line) = next(&mut client, 0.0) {
            let last_is_stop = line.ends_with("Stop");
            stops += u32::from(last_is_stop);
            assert!(
                client.under_way.len() <= 4 || last_is_stop,
                "{round}: {line}"
            );
        }
    }
    assert!(stops < 5, "{stops}");
}

#[test]
fn commands_pass_others_but_not_for_ever() {
    let mut client = busy();
    client.ask(Ask::Observe, "ObservePos");
    client.ask(Ask::Estimate, "GetEstPos");
    for tag in 7..10 {
        reply(&mut client, &format!("@{tag} OK"));
    }
    let mut all = Vec::new();
    for speed in 0..12 {
        client.ask(Ask::Move, format!("m inf {speed}"));
        let line = next(&mut client, 0.0).unwrap();
        let (tag, text) = line.split_once(' ').unwrap();
        reply(&mut client, &format!("{tag} OK"));
        all.push(text.to_owned());
    }
    let others: Vec<_> = (0..12).filter(|&at| !all[at].starts_with('m')).collect();
    assert_eq!(others, [3, 7], "{all:?}");
}

#[test]
fn a_flood_of_poses_holds_no_command_up() {
    let mut client = busy();
    for pose in 0..100 {
        client.ask(Ask::Reset, format!("ResetPos {pose}"));
        client.ask(Ask::Move, format!("m inf {pose}"));
    }
    client.ask(Ask::Enable, "Disable");
    assert_eq!(goes(&mut client), ["ResetPos 99", "m inf 99", "Disable"]);
}

#[test]
fn a_stop_that_was_overtaken_is_not_said_again() {
    let mut client = client();
    client.stop();
    next(&mut client, 0.0).unwrap();
    client.ask(Ask::GoTo, "GoTo 1 2");
    next(&mut client, 0.0).unwrap();
    // The base has obeyed it, and its answer is lost; the goal is under way.
    assert_eq!(next(&mut client, 0.4), None);
    let Heard::Answers(answers) = reply(&mut client, "@8 OK") else {
        panic!("two are answered");
    };
    let outcomes: Vec<_> = answers.into_iter().map(|a| (a.ask, a.outcome)).collect();
    let agreed = Outcome::Reply("OK".into());
    assert_eq!(
        outcomes,
        [(Ask::Stop, Outcome::Unanswered), (Ask::GoTo, agreed)]
    );
    assert_eq!(client.ended(0.6), []);
    assert_eq!(next(&mut client, 0.6), None);
    assert!(!client.is_stopping());
    // One that has not been overtaken is.
    client.ask(Ask::GoTo, "GoTo 1 2");
    next(&mut client, 1.0).unwrap();
    client.stop();
    next(&mut client, 1.0).unwrap();
    reply(&mut client, "@9 OK");
    assert_eq!(client.ended(1.6), []);
    assert_eq!(next(&mut client, 1.6).unwrap(), "@11 Stop");
}

#[test]
fn a_stop_that_was_damaged_does_not_end_the_goal_behind_it() {
    for (goal, stops_again) in [("OK", false), ("ERR range x", true)] {
        let mut client = client();
        client.stop();
        next(&mut client, 0.0).unwrap();
        client.ask(Ask::GoTo, "GoTo 1 2");
        next(&mut client, 0.0).unwrap();
        client.ask(Ask::Status, "GetStatus");
        // Whether the base goes there is not known yet.
        assert_eq!(client.hear("@7 ERR checksum"), Heard::Answers(vec![]));
        assert_eq!(next(&mut client, 0.01), None);
        assert!(client.is_stopping());
        reply(&mut client, &format!("@8 {goal}"));
        let said = next(&mut client, 0.01).unwrap();
        let expected = if stops_again { "Stop" } else { "GetStatus" };
        assert!(said.ends_with(expected), "{goal}: {said}");
        assert_eq!(client.is_stopping(), stops_again);
    }
}

#[test]
fn a_stop_and_the_goal_behind_it_that_are_both_lost_end_in_a_stop() {
    let mut client = client();
    client.stop();
    next(&mut client, 0.0).unwrap();
    client.ask(Ask::GoTo, "GoTo 1 2");
    next(&mut client, 0.1).unwrap();
    // Speeds that are said all the time do not keep it waiting for ever.
    let again = (6..100).map(|said| 0.02 * f64::from(said)).find(|&now| {
        client.ask(Ask::Move, "m inf 0.3");
        client.ended(now);
        next(&mut client, now).is_some_and(|line| line.ends_with("Stop"))
    });
    // Its own deadline, and that of what was sent before it.
    assert!(again.is_some_and(|again| again <= 1.0), "{again:?}");
}

#[test]
fn a_stop_that_is_lost_is_said_again_soon() {
    let mut client = client();
    let first = client.stop();
    next(&mut client, 0.0).unwrap();
    let second = client.stop();
    assert_eq!(next(&mut client, 0.06), None);
    let due = client.next_deadline().unwrap();
    assert!(due < 0.07, "{due}");
    assert_eq!(next(&mut client, due).unwrap(), "@8 Stop");
    assert_eq!(next(&mut client, due), None);
    // A late answer to the first speaks for both, and the other's is no stray.
    let Heard::Answers(answers) = reply(&mut client, "@7 OK") else {
        panic!("not answered");
    };
    let numbers: Vec<_> = answers.iter().map(|answer| answer.number).collect();
    assert_eq!(numbers, [first, second]);
    assert!(!client.is_stopping());
    assert_eq!(reply(&mut client, "@8 OK"), Heard::Answers(vec![]));
    // A base that hears nothing has no use for more than four.
    client.stop();
    let mut said = 0;
    for tick in 0..100 {
        let now = 1.0 + f64::from(tick) * 0.004;
        said += u32::from(next(&mut client, now).is_some());
    }
    assert_eq!(said, 4);
}

#[test]
fn who_comes_often_keeps_his_turn() {
    let mut client = busy();
    let (mut tag, mut all) = (7, Vec::new());
    // One place becomes free at a time, and speeds, poses and fixes come more often than that.
    for round in 0..40 {
        client.ask(Ask::Move, format!("m {round}"));
        client.ask(Ask::Turn, format!("t {round}"));
        client.ask(Ask::Reset, format!("ResetPos {round}"));
        client.ask(Ask::Observe, format!("ObservePos {round}"));
        client.ask(Ask::Estimate, format!("GetEstPos {round}"));
        if round % 2 == 0 {
            reply(&mut client, &format!("@{tag} OK"));
            tag += 1;
            let line = next(&mut client, 0.0).unwrap();
            all.push(line.split(' ').nth(1).unwrap().to_owned());
        }
    }
    for what in ["m", "t", "ResetPos", "ObservePos", "GetEstPos"] {
        let count = all.iter().filter(|said| *said == what).count();
        assert!(count >= 2, "{what} in {all:?}");
    }
}

#[test]
fn what_switches_power_on_goes_before_the_speeds_behind_it() {
    let mut client = busy();
    client.ask(Ask::Move, "m inf 0.1");
    client.ask(Ask::Enable, "Enable");
    client.ask(Ask::Move, "m inf 0.2");
    assert_eq!(goes(&mut client), ["Enable", "m inf 0.2"]);
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
