use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::PathBuf;

use nalgebra::Matrix3;

use vehicle_controller::params::Params;
use vehicle_controller::vehicle::Kind;
use vehicle_controller::vehicle::gains::{GainMatrix, of_each};

use super::cloud::cloud_scene;
use super::convergence::convergence_scene;
use super::replay::replay_scene;
use super::returns::returns_scene;
use super::scene::{HEIGHT, Shape};
use super::*;

/// A deterministic noise between -1 and 1.
fn noise(index: usize, channel: u64) -> f64 {
    let mut bits = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (channel << 17);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn still(t: f64) -> Row {
    Row {
        t,
        move_state: "HOLD".into(),
        turn_state: "HOLD".into(),
        battery: 12.0,
        fault: "none".into(),
        ..Row::default()
    }
}

/// Speed and state of a trapezoid over `target` at time `t`.
fn trapezoid(t: f64, target: f64, top: f64, acceleration: f64) -> (f64, &'static str) {
    let ramp = top / acceleration;
    let cruise = (target - top * ramp) / top;
    if t < 0.0 {
        (0.0, "HOLD")
    } else if t < ramp {
        (acceleration * t, "ACCEL")
    } else if t < ramp + cruise {
        (top, "MOVE")
    } else if t < 2.0 * ramp + cruise {
        (top - acceleration * (t - ramp - cruise), "DECCEL")
    } else {
        (0.0, "HOLD")
    }
}

/// A move of `distance` m at 0.5 s, then a turn of `angle` rad.
fn drive(distance: f64, angle: f64, count: usize, dt: f64) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    let mut row = still(0.0);
    let turn_at = if distance > 0.0 { 5.0 } else { 0.5 };
    let mut heading_ref = 0.0;
    for index in 0..count {
        row.t = index as f64 * dt;
        let (mut v, mut w) = ((0.0, "HOLD"), (0.0, "HOLD"));
        if distance > 0.0 {
            v = trapezoid(row.t - 0.5, distance, 0.3, 0.5);
        }
        if angle > 0.0 {
            w = trapezoid(row.t - turn_at, angle, 0.8, 1.6);
        }
        row.v_s_ref = v.0;
        row.v_alpha_ref = w.0;
        row.v_s = v.0 * 0.98 + 0.006 * noise(index, 1);
        row.v_alpha = w.0 * 0.97 + 0.02 * noise(index, 2);
        row.move_state = v.1.into();
        row.turn_state = w.1.into();
        heading_ref += w.0 * dt;
        row.true_theta = heading_ref * 1.03 + 0.02 * row.s;
        row.true_x += v.0 * dt * row.true_theta.cos();
        row.true_y += v.0 * dt * row.true_theta.sin();
        row.est_theta = heading_ref + 0.002 * noise(index, 3);
        row.est_x += v.0 * dt * heading_ref.cos() * 1.01;
        row.est_y += v.0 * dt * heading_ref.sin();
        row.s += v.0 * dt;
        row.ctt = 1e-5 + 0.0015 * row.s + 0.002 * heading_ref;
        row.cxx = 1e-6 + 0.0002 * row.s;
        row.cyy = 1e-6 + 0.0009 * row.s * row.s;
        row.cxy = 0.0;
        row.left_duty = 1.2 * v.0 - 0.25 * w.0 + 0.02 * noise(index, 4);
        row.right_duty = 1.2 * v.0 + 0.25 * w.0 + 0.02 * noise(index, 5);
        rows.push(row.clone());
    }
    rows
}

fn run() -> Vec<Row> {
    let mut rows = drive(1.0, FRAC_PI_2, 900, 0.01);
    for row in &mut rows {
        if (2.0..2.4).contains(&row.t) {
            row.fault = "OVERCURRENT".into();
        }
        if (2.45..2.47).contains(&row.t) || row.t > 8.9 {
            row.fault = "BATTERY_LOW".into();
        }
    }
    rows
}

/// The worst for the size of the file: 100000 rows in which everything is noise.
fn long() -> Vec<Row> {
    let mut rows = drive(1.0, FRAC_PI_2, 100_000, 0.01);
    for (index, row) in rows.iter_mut().enumerate() {
        let phase = row.t * 0.4;
        row.true_x = phase.cos() + 0.1 * noise(index, 6);
        row.true_y = (1.013 * phase).sin() + 0.1 * noise(index, 7);
        row.true_theta = phase + TAU / 4.0;
        row.est_x = row.true_x + 0.0001 * row.t;
        row.est_y = row.true_y + 0.02 * noise(index, 8);
        row.est_theta = row.true_theta;
        row.v_s = 0.4 + 0.1 * noise(index, 9);
        row.left_duty = noise(index, 10);
        row.right_duty = noise(index, 11);
        row.move_state = crate::trace::STATES[index / 3 % 4].into();
        row.fault = ["none", "A", "B"][index / 5 % 3].into();
    }
    rows
}

fn replayed(name: &str, radius: f64) -> ReplayPath {
    let count = 600;
    let angle = |i: usize| TAU * 0.8 * i as f64 / count as f64;
    let pose = |i: usize, drift: f64| {
        let a = angle(i);
        let r = radius * (1.0 + drift * a);
        [r * a.cos(), r * a.sin(), a + FRAC_PI_2 + drift * a]
    };
    ReplayPath {
        name: name.into(),
        t: (0..count).map(|i| i as f64 * 0.05).collect(),
        truth: Some((0..count).map(|i| pose(i, 0.0)).collect()),
        estimated: (0..count).map(|i| pose(i, 0.012)).collect(),
        covariance: (0..count)
            .map(|i| {
                let a = angle(i);
                [0.001 * a, 0.0004 * a, 0.0, 0.0007 * a, 0.0, 0.0006 * a]
            })
            .collect(),
    }
}

/// A cloud about an estimate with a heading that is uncertain by `heading` rad, 10 m from the start.
fn cloud(heading: f64, timed: bool) -> Cloud {
    let (variance, far) = (heading * heading, 10.0);
    let covariance = Matrix3::new(
        1e-2,
        0.0,
        0.0,
        0.0,
        1e-2 + far * far * variance,
        far * variance,
        0.0,
        far * variance,
        variance,
    );
    let point = |index| {
        let angle = 1.7 * heading * noise(index, 1);
        [
            far * (angle.cos() - 1.0) + 0.17 * noise(index, 2),
            far * angle.sin() + 0.17 * noise(index, 3),
        ]
    };
    let times: Vec<f64> = (1..=60).map(f64::from).collect();
    Cloud {
        points: (0..400).map(point).collect(),
        points_name: "true positions at the end".into(),
        covariance,
        other: (!timed).then(|| ([-0.2, 0.0], 0.8 * covariance, "another's ellipse".into())),
        over_time: timed.then(|| OverTime {
            nees: times.iter().map(|t| 1.0 + 0.004 * t).collect(),
            cartesian: times.iter().map(|t| 1.0 + 0.05 * t).collect(),
            times,
            band: [0.92, 1.08],
        }),
    }
}

/// Where `PLOT_SAMPLES` says, or a folder that vanishes.
fn write(name: &str, draw: impl Fn(&Path) -> anyhow::Result<()>) -> Vec<u8> {
    let directory = tempfile::tempdir().unwrap();
    let folder =
        std::env::var_os("PLOT_SAMPLES").map_or_else(|| directory.path().to_owned(), PathBuf::from);
    let path = folder.join(name);
    draw(&path).unwrap();
    std::fs::read(path).unwrap()
}

/// Every text is inside the figure and none lies on another.
fn check_texts(scene: &Scene) {
    let labels: Vec<_> = scene
        .shapes
        .iter()
        .filter_map(|shape| match shape {
            Shape::Text(label) => Some(label),
            _ => None,
        })
        .collect();
    assert!(labels.len() > 20);
    for (index, label) in labels.iter().enumerate() {
        let a = label.bounds();
        assert!(a.width() > 0.0 || label.text.is_empty(), "{label:?}");
        let inside = a.x0 >= 2.0
            && a.y0 >= 2.0
            && a.x1 <= f64::from(WIDTH) - 2.0
            && a.y1 <= f64::from(HEIGHT) - 2.0;
        assert!(inside, "{label:?} is clipped");
        for other in &labels[..index] {
            let b = other.bounds();
            let apart = a.x1 <= b.x0 || b.x1 <= a.x0 || a.y1 <= b.y0 || b.y1 <= a.y0;
            assert!(apart, "{label:?} lies on {other:?}");
        }
    }
}

#[test]
fn texts_neither_overlap_nor_leave_the_figure() {
    let mut far = drive(1.0, 0.0, 500, 0.01);
    for row in &mut far {
        row.t += 1.7e9;
        row.true_x += 123_456.0;
        row.est_x += 123_456.0;
        row.true_y -= 7e6;
        row.est_y -= 7e6;
    }
    let title = "1 m forward, then 90° to the left";
    for rows in [
        run(),
        long(),
        far,
        vec![still(3.0)],
        drive(0.0, FRAC_PI_2, 500, 0.01),
    ] {
        check_texts(&trace_scene(&rows, &[], title).unwrap());
    }
    check_texts(&trace_scene(&run(), &[], &"a very long title ".repeat(40)).unwrap());
    let many: Vec<_> = (0..9)
        .map(|i| replayed(&format!("log-{i}-with-a-long-name"), 1.0 + 0.1 * i as f64))
        .collect();
    check_texts(&replay_scene(&many[..1], title).unwrap());
    check_texts(&replay_scene(&many, title).unwrap());
    for heading in [1e-6, 0.01, 0.5] {
        for timed in [false, true] {
            check_texts(&cloud_scene(&cloud(heading, timed), title).unwrap());
        }
    }
    for points in [learned(1), learned(500)] {
        for vehicle in [Kind::Differential, Kind::BiSteerable] {
            let params = Params::of(vehicle);
            check_texts(&convergence_scene(&points, &params, None, title).unwrap());
        }
    }
    for size in [1e-3, 0.3] {
        check_texts(&returns_scene(&returned(size), title).unwrap());
    }
}

/// Return errors of squares, before and after two calibrations.
fn returned(size: f64) -> Vec<Returns> {
    let errors = |size: f64| crate::umbmark::Directions {
        clockwise: vec![[-size, -size], [-1.1 * size, -size]],
        counter_clockwise: vec![[-size, size], [-size, 0.9 * size]],
    };
    let returns = |name: &str, size| Returns {
        name: name.into(),
        errors: errors(size),
    };
    vec![
        returns("before", size),
        returns("closed form", 0.1 * size),
        returns("filter", -0.05 * size),
    ]
}

/// Gains that settle, over three logs.
fn learned(count: usize) -> Vec<crate::calibrate::Point> {
    let point = |index| {
        let known = 1.0 / (1.0 + index as f64);
        crate::calibrate::Point {
            t: 2.0 * index as f64,
            log: 3 * index / count,
            gains: of_each([1.0 - 0.01 * noise(index, 0) * known, 0.994, 1.007], 0.0),
            covariance: GainMatrix::identity() * 1e-4 * known,
            distance: None,
        }
    };
    (0..count).map(point).collect()
}

#[test]
fn each_vehicle_shows_the_gains_it_has() {
    for (vehicle, names) in [
        (
            Kind::Differential,
            &["k_d = (k_r + k_l)/2", "k_r", "k_l", "k_b"][..],
        ),
        (Kind::Synchro, &["k_d", "gain_turn", "turn_drift [deg/m]"]),
        (Kind::Tricycle, &["k_d", "k_b", "steer_offset [deg]"]),
        (
            Kind::BiSteerable,
            &[
                "k_d = (k_r + k_l)/2",
                "k_r",
                "k_l",
                "k_b",
                "steer_offset [deg]",
            ],
        ),
    ] {
        let bytes = write("gains.svg", |path| {
            plot_convergence(&learned(3), &Params::of(vehicle), None, "", path)
        });
        let text = String::from_utf8(bytes).unwrap().replace('\n', "");
        for name in [
            "k_d = (k_r + k_l)/2",
            "k_r",
            "k_l",
            "k_b",
            "k_d",
            "gain_turn",
            "turn_drift [deg/m]",
            "steer_offset [deg]",
        ] {
            let is_shown = text.contains(&format!(">{name}<"));
            assert_eq!(is_shown, names.contains(&name), "{vehicle:?} {name}");
        }
    }
}

#[test]
fn svg_has_its_legends() {
    let bytes = write("run.svg", |path| {
        plot(&run(), &[], "move <1 m> & turn", path)
    });
    let text = String::from_utf8(bytes).unwrap().replace('\n', "");
    assert!(text.starts_with("<svg width=\"1400\" height=\"1000\""));
    assert!(text.ends_with("</svg>"));
    let words = [
        "move &lt;1 m&gt; &amp; turn",
        "true path",
        "estimated path",
        "95 % ellipse of estimate",
        "start",
        "end",
        ">HOLD<",
        ">ACCEL<",
        ">MOVE<",
        ">DECCEL<",
        "translation speed v_s",
        "reference v_s_ref",
        "rotation speed v_alpha",
        "reference v_alpha_ref",
        "left duty",
        "right duty",
        "fault: OVERCURRENT, BATTERY_LOW",
        ">OVERCURRENT<",
        ">BATTERY_LOW<",
        "speed [m/s]",
        "speed [°/s]",
        "x [m]",
        "y [m]",
        "time t [s]",
    ];
    for word in words {
        assert!(text.contains(word), "{word}");
    }
}

#[test]
fn png_has_its_magic_and_size() {
    for name in ["run.png", "run-capitals.PNG"] {
        let bytes = write(name, |path| {
            plot(&run(), &[], "1 m forward, then 90° to the left", path)
        });
        assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
        assert_eq!(bytes[16..20], 1400u32.to_be_bytes());
        assert_eq!(bytes[20..24], 1000u32.to_be_bytes());
    }
}

#[test]
fn figures_are_deterministic() {
    for name in ["twice.svg", "twice.PNG"] {
        let draw = |path: &Path| plot(&run(), &[], "twice", path);
        assert!(write(name, draw) == write(name, draw), "{name}");
    }
}

#[test]
fn long_traces_make_small_files() {
    let rows = long();
    for name in ["long.svg", "long.png"] {
        let bytes = write(name, |path| plot(&rows, &[], "100000 rows of noise", path));
        assert!(bytes.len() < 2_000_000, "{name}: {} bytes", bytes.len());
    }
}

#[test]
fn special_paths_can_be_drawn() {
    write("straight.png", |path| {
        plot(&drive(1.0, 0.0, 500, 0.01), &[], "straight line", path)
    });
    write("rotation.png", |path| {
        plot(
            &drive(0.0, FRAC_PI_2, 400, 0.01),
            &[],
            "rotation in place",
            path,
        )
    });
    write("single.png", |path| {
        plot(&[still(3.0)], &[], "single row", path)
    });
    let mut unsure = drive(1.0, 0.0, 500, 0.01);
    for row in &mut unsure {
        row.cxx += 0.5;
        row.cyy += 40.0;
    }
    write("unsure.png", |path| {
        plot(&unsure, &[], "very uncertain", path)
    });
}

#[test]
fn replays_can_be_drawn() {
    let one = [replayed("one", 1.0)];
    write("replay-one.png", |path| {
        plot_replay(&one, "replay of one.log", path)
    });
    let mut several: Vec<_> = (0..4)
        .map(|i| replayed(&format!("log {i}"), 1.0 + 0.3 * f64::from(i)))
        .collect();
    several[3].truth = None;
    several[2].t.clear();
    write("replay-four.png", |path| {
        plot_replay(&several, "four logs", path)
    });
    let mut bare = replayed("bare", 1.0);
    bare.truth = None;
    bare.covariance.clear();
    let bytes = write("replay-bare.svg", |path| {
        plot_replay(&[bare.clone()], "bare", path)
    });
    let text = String::from_utf8(bytes).unwrap();
    assert!(text.contains("neither truth nor covariance"));
    assert!(!text.contains("true path"));
}

#[test]
fn clouds_can_be_drawn() {
    for (name, timed) in [("cloud.png", false), ("cloud-timed.svg", true)] {
        let bytes = write(name, |path| plot_cloud(&cloud(0.3, timed), "cloud", path));
        assert!(bytes.len() < 1_000_000, "{name}: {} bytes", bytes.len());
    }
    let mut bad = cloud(0.3, false);
    bad.covariance.m11 = f64::NAN;
    assert!(plot_cloud(&bad, "", Path::new("a.svg")).is_err());
    bad.points.clear();
    assert!(plot_cloud(&bad, "", Path::new("a.svg")).is_err());
}

#[test]
fn bad_requests_are_refused() {
    let message = |result: anyhow::Result<()>| format!("{:#}", result.unwrap_err());
    let rows = run();
    for name in ["figure.pdf", "figure"] {
        assert_eq!(
            message(plot(&rows, &[], "", Path::new(name))),
            format!("{name}: a figure must be named *.svg or *.png")
        );
    }
    assert_eq!(
        message(plot(&[], &[], "", Path::new("a.svg"))),
        "no row to plot"
    );
    for name in ["/nowhere/a.svg", "/nowhere/a.png"] {
        let text = message(plot(&rows, &[], "", Path::new(name)));
        assert!(
            text.starts_with(&format!("cannot write the figure {name}: ")),
            "{text}"
        );
        assert!(text.contains("No such file"), "{text}");
    }
    let mut bad = still(1.5);
    bad.est_y = f64::INFINITY;
    assert_eq!(
        message(plot(&[bad], &[], "", Path::new("a.svg"))),
        "the row at t = 1.5 s has a number that is not finite"
    );
    let mut short = replayed("short", 1.0);
    short.covariance.pop();
    assert_eq!(
        message(plot_replay(&[short], "", Path::new("a.svg"))),
        "path `short` has 600 estimated poses but 599 covariances"
    );
    assert!(plot_replay(&[], "", Path::new("a.svg")).is_err());
    assert!(plot_convergence(&[], &Params::default(), None, "", Path::new("a.svg")).is_err());
    let mut points = learned(3);
    points[1].gains[2] = f64::NAN;
    assert_eq!(
        message(plot_convergence(
            &points,
            &Params::default(),
            None,
            "",
            Path::new("a.svg")
        )),
        "at 2 s there is a gain that is not finite"
    );
}

/// A path of two postures, one of them with a heading, and a target chased.
fn asked() -> Vec<AskedPath> {
    let place = |x, y, heading| Place {
        at: [x, y],
        heading,
    };
    vec![
        AskedPath {
            start: Some([0.0, 0.0]),
            places: vec![place(1.0, 0.0, None), place(1.0, 0.5, Some(2.0))],
        },
        AskedPath {
            start: None,
            places: vec![place(0.5, 0.1, None), place(0.5, 3.0, None)],
        },
    ]
}

#[test]
fn what_was_asked_for_is_drawn_with_the_references_and_told_in_the_legend() {
    let texts = |asked: &[AskedPath]| {
        let scene = trace_scene(&run(), asked, "a path").unwrap();
        check_texts(&scene);
        let texts: Vec<String> = scene
            .shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Text(label) => Some(label.text.clone()),
                _ => None,
            })
            .collect();
        texts.join("|")
    };
    let legend = [
        "path asked for: postures and legs",
        "target chased",
        "reference",
    ];
    let (with, without) = (texts(&asked()), texts(&[]));
    for text in legend {
        assert!(with.contains(text), "{with}");
        assert!(!without.contains(&format!("|{text}|")), "{without}");
    }
    // The target is in sight: 3 m along y.
    assert!(with.contains("|3.0|"), "{with}");
    write("asked.svg", |path| plot(&run(), &asked(), "a path", path));
}
