//! `calibrate` through the command line, and what it prints through a base's serial line.

mod bench;
mod desk;
mod driven;

use bench::Bench;
use desk::{Desk, hil_sim, text};
use driven::{QUIET, driven, file, winding};
use hil_sim::robot::Robot;
use hil_sim::settings;
use hil_sim::statistics::CHI_SQUARE_3_99;

#[test]
fn the_command_reports_gains_and_errors_and_writes_and_draws() {
    let desk = Desk::new("");
    let gains = [0.9936, 0.9944, 1.007];
    desk.put("a.csv", &file(&driven(gains, 60, &winding)));
    desk.put("b.csv", &file(&driven(gains, 30, &|t| winding(20.0 + t))));
    let quiet = QUIET.map(|setting| format!("--set {setting}")).join(" ");
    let command = format!("calibrate a.csv {quiet} --fix-position 0.001 --fix-heading 0.1");
    let printed = desk.prints(&format!("{command} --out g.csv --plot p.svg --test b.csv"));
    let line = |start: &str| {
        printed
            .lines()
            .rfind(|line| line.starts_with(start))
            .unwrap()
    };
    // Before and after, of the log that was not learned from.
    let numbers: Vec<f64> = line("b  ")
        .split_whitespace()
        .skip(1)
        .map(|word| word.parse().unwrap())
        .collect();
    assert_eq!(numbers.len(), 9, "{printed}");
    for pair in numbers[..8].chunks(2) {
        assert!(pair[1] < 0.2 * pair[0], "{printed}");
    }
    assert!(numbers[8] < CHI_SQUARE_3_99, "{printed}");
    let rows = desk.trace("g.csv");
    assert_eq!(rows.len(), 31);
    let learned: f64 = rows[30][2].parse().unwrap();
    assert!((learned - gains[0]).abs() < 1e-3, "{:?}", rows[30]);
    // The start has no fix.
    assert_eq!(rows[0][8], "");
    assert!(text(&desk.read("p.svg")).contains("k_b"));
    // The same again, to the letter.
    let again = desk.prints(&format!("{command} --out h.csv --plot q.svg --test b.csv"));
    assert_eq!(printed, again);
    assert_eq!(desk.read("p.svg"), desk.read("q.svg"));
}

#[test]
fn scripts_are_run_and_calibrated_on() {
    let desk = Desk::new(
        "0 m inf 0.3\n0.5 SetParam deadman 0\n3 t inf 40\n12 t -inf 40\n21 t 0 0\n24 Stop\n25 !end\n",
    );
    let command = "calibrate a.script --robot uncalibrated --test a.script --seed 3";
    let printed = desk.prints(command);
    assert!(
        printed.starts_with("on uncalibrated, logs to learn from: 1, to test on: 1; a fix of 1.0 cm and 0.50 deg every 2 s"),
        "{printed}"
    );
    let line = printed
        .lines()
        .rfind(|line| line.starts_with("a  "))
        .unwrap();
    let number = |index: usize| {
        line.split_whitespace()
            .nth(index)
            .unwrap()
            .parse::<f64>()
            .unwrap()
    };
    // Before and after: the largest error (m).
    assert!(number(2) < 0.5 * number(1), "{printed}");
    assert_eq!(printed, desk.prints(command));
}

#[test]
fn a_log_of_which_the_truth_is_not_known_is_refused_and_so_are_fixes_that_cannot_be() {
    let desk = Desk::new("");
    desk.put("blind.csv", "t,left,right\n0,0,0\n5,10,10\n");
    desk.put("a.csv", &file(&driven([1.0; 3], 3, &winding)));
    for (arguments, why) in [
        ("blind.csv", "blind: the truth is not known"),
        ("a.csv --test blind.csv", "blind: the truth is not known"),
        ("none.csv", "none.csv"),
        ("a.csv --fix-every 0", "above 0"),
        ("a.csv --fix-every nan", "above 0"),
        ("a.csv --fix-position 0", "deviations above 0"),
        ("a.csv --fix-heading=-1", "deviations above 0"),
        ("a.csv --fix-delay 2", "0 to 1.5 s"),
        ("a.csv --set k_drift=-1", "k_drift must be"),
        ("a.csv --plot p.gif", "p.gif"),
    ] {
        let message = desk.refuses(&format!("calibrate {arguments}"));
        assert!(message.contains(why), "{arguments}: {message}");
    }
    hil_sim().arg("calibrate").assert().code(2);
}

/// Of the line of the table of gains that starts with a name: how many fixes were taken and refused, d²/3, and the gains with their deviations.
fn gains_of(printed: &str, name: &str) -> (String, String, String, Vec<f64>) {
    let table = printed.split("\n\n").next().unwrap();
    let mut lines = table.lines().filter(|line| line.starts_with(name));
    let mut words = lines.next_back().unwrap().split_whitespace().skip(1);
    let mut word = || words.next().unwrap().to_owned();
    let (taken, refused, ratio) = (word(), word(), word());
    let numbers = words.filter_map(|word| word.parse().ok()).collect();
    (taken, refused, ratio, numbers)
}

#[test]
fn what_is_learned_is_carried_over_to_a_base_as_it_is() {
    let desk = Desk::new("");
    desk.put(
        "a.csv",
        &file(&driven([0.9936, 0.9944, 1.007], 60, &winding)),
    );
    let drifts = "calibrate a.csv --set k_drift=1";
    let printed = desk.prints(drifts);
    let lines = |printed: &str| -> Vec<String> {
        let is_one = |line: &&str| line.starts_with("SetParam ") || *line == "SaveParams";
        printed.lines().filter(is_one).map(str::to_owned).collect()
    };
    let commands = lines(&printed);
    assert_eq!(commands.len(), 10, "{printed}");
    assert_eq!(commands[9], "SaveParams");
    let (.., wanted) = gains_of(&printed, "a ");
    let mut robot = Robot::load("default").unwrap();
    settings::apply(&mut robot.params, &["k_drift=1".to_owned()]).unwrap();
    let mut learned = robot.clone();
    let before = [
        "gain_base=0.9",
        "spread_rr=0.1",
        "spread_bl=-0.05",
        "spread_bb=0.2",
    ];
    settings::apply(&mut learned.params, &before.map(str::to_owned)).unwrap();
    // Whatever the base has learned before; line by line, and at once.
    for (robot, at_once) in [(&robot, false), (&robot, true), (&learned, false)] {
        let mut bench = Bench::of(robot, 1);
        bench.run(0.1);
        if at_once {
            bench.send(&commands.join("\n"));
            bench.run(1.0);
            let answers = bench.lines.iter().filter(|(_, line)| line == "OK").count();
            assert_eq!(answers, 10, "{:?}", bench.lines);
        } else {
            for command in &commands {
                bench.send(command);
                bench.wait_for("OK", 1.0);
            }
        }
        // Now, and after power has been off.
        for _ in 0..2 {
            bench.send("GetGains");
            let reply = bench.wait_for("Gains", 1.0);
            let numbers: Vec<f64> = reply.split(' ').map(|n| n.parse().unwrap()).collect();
            for i in 0..3 {
                // The table has five decimals.
                assert!(
                    (numbers[i] - wanted[2 * i]).abs() < 6e-6,
                    "{reply} {wanted:?}"
                );
                assert!(
                    (numbers[3 + i] - wanted[2 * i + 1]).abs() < 6e-6,
                    "{reply} {wanted:?}"
                );
            }
            bench.rig.power_cycle().unwrap();
            bench.run(0.1);
        }
    }
    // How the errors go along with each other is carried over, too: who calibrates further from there comes to the same.
    let more = file(&driven([0.9936, 0.9944, 1.007], 30, &|t| winding(20.0 + t)));
    desk.put("b.csv", &more);
    let both = desk.prints(&drifts.replace("a.csv", "a.csv b.csv"));
    let numbers = |lines: &[String]| -> Vec<f64> {
        let number = |line: &String| line.split(' ').nth(2)?.parse().ok();
        lines.iter().filter_map(number).collect()
    };
    let set: Vec<_> = commands[..9]
        .iter()
        .map(|line| {
            let words: Vec<_> = line.split(' ').collect();
            format!(" --set {}={}", words[1], words[2])
        })
        .collect();
    let further = desk.prints(&(drifts.replace("a.csv", "b.csv") + &set.concat()));
    let (both, further) = (numbers(&lines(&both)), numbers(&lines(&further)));
    assert_eq!(both.len(), 9);
    for (one, other) in both.iter().zip(&further) {
        // Of deviations of 1e-3; the covariance's windows of 10 mm lie elsewhere.
        assert!((one - other).abs() < 1e-6, "{both:?} {further:?}");
    }
}

#[test]
fn the_last_fix_of_a_log_arrives_however_late() {
    let desk = Desk::new("");
    let gains = [0.9936, 0.9944, 1.007];
    desk.put("a.csv", &file(&driven(gains, 6, &winding)));
    desk.put("b.csv", &file(&driven(gains, 4, &|t| winding(20.0 + t))));
    let quiet = QUIET.map(|setting| format!("--set {setting}")).join(" ");
    let command = format!("calibrate a.csv b.csv {quiet} --fix-every end --out g.csv");
    let fresh = desk.prints(&command);
    for delay in ["0.3", "0.007", "1.5"] {
        let late = desk.prints(&format!("{command} --fix-delay {delay}"));
        for log in ["a ", "b "] {
            let (taken, refused, ratio, of_late) = gains_of(&late, log);
            assert_eq!((&*taken, &*refused), ("1", "0"), "{late}");
            assert_ne!(ratio, "-");
            let (.., of_fresh) = gains_of(&fresh, log);
            assert_eq!(of_late.len(), 6, "{late}");
            for i in 0..3 {
                // They end under way, and stop at once: between 32 ms before the end and the end the past is interpolated.
                let deviation = of_fresh[2 * i + 1];
                let apart = of_late[2 * i] - of_fresh[2 * i];
                assert!(apart.abs() < 0.2 * deviation, "{delay} s\n{fresh}{late}");
            }
        }
        let rows = desk.trace("g.csv");
        // Each log's start and its only fix; time goes on while that is on its way.
        let time = |row: usize| rows[row][0].parse::<f64>().unwrap();
        let delay: f64 = delay.parse().unwrap();
        assert_eq!(rows.len(), 4);
        for (row, wanted) in [0.0, 6.0 + delay, 6.0 + delay, 10.0 + 2.0 * delay]
            .into_iter()
            .enumerate()
        {
            assert!((time(row) - wanted).abs() < 2e-3, "{rows:?}");
        }
    }
}

#[test]
fn a_log_of_which_no_fix_is_taken_has_no_number_and_a_calibration_without_any_fix_is_none() {
    let desk = Desk::new("");
    desk.put("long.csv", &file(&driven([1.0; 3], 6, &winding)));
    desk.put("short.csv", &file(&driven([1.0; 3], 1, &winding)));
    let printed = desk.prints("calibrate long.csv short.csv");
    let (taken, refused, ratio, numbers) = gains_of(&printed, "short ");
    assert_eq!((&*taken, &*refused, &*ratio), ("0", "0", "-"), "{printed}");
    assert_eq!(numbers, gains_of(&printed, "long ").3);
    assert!(!printed.contains("NaN"));
    for (arguments, why) in [
        (
            "short.csv",
            "no fix was taken: the logs end before the first",
        ),
        (
            "long.csv --set gate=1e-9",
            "no fix was taken: all 3 lay beyond the gate",
        ),
    ] {
        let message = desk.refuses(&format!("calibrate {arguments}"));
        assert!(message.contains(why), "{arguments}: {message}");
    }
}
