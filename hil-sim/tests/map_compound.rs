//! The Gaussian compound beside an arc: the estimator's own increments from one place to the next, whatever was before and whoever corrects the pose meanwhile.

use hil_sim::rig::Rig;
use hil_sim::robot::Robot;

/// Somebody at the serial line of a base that goes where its wheels say.
struct Client {
    rig: Rig,
    text: String,
}

impl Client {
    fn new() -> Self {
        let robot = Robot::load("ideal").unwrap();
        Self {
            rig: Rig::new(&robot, 1).unwrap(),
            text: String::new(),
        }
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1e3) as u32 {
            self.rig.tick();
            let bytes = self.rig.receive();
            self.text.push_str(&String::from_utf8(bytes).unwrap());
        }
    }

    /// What it has said since, line by line.
    fn say(&mut self, line: &str, seconds: f64) -> Vec<String> {
        self.text.clear();
        self.rig.send(format!("{line}\n").as_bytes());
        self.run(seconds);
        self.text.lines().map(str::to_owned).collect()
    }

    fn does(&mut self, line: &str, seconds: f64, answer: &str) {
        let said = self.say(line, seconds);
        assert!(
            said.iter().any(|said| said.starts_with(answer)),
            "{line}: {said:?}"
        );
    }
}

/// L of the stretch, m.
const LENGTH: f64 = 4.0;

/// Drives somewhere, then from one place to the next straight ahead; with a correction at a third of that, or without. Returns x y θ Cxx Cxy Cxθ Cyy Cyθ Cθθ of the
/// arc in GetMap, m and °.
fn drive(corrected: bool) -> [f64; 9] {
    let mut client = Client::new();
    for line in ["SetParam k_rot 0", "SetParam k_scale 0", "SetParam gate 0"] {
        client.does(line, 0.1, "OK");
    }
    // What was before the first place is none of the arc's: 3 m and a quarter turn.
    client.does("m 3 0.5", 9.0, "OK");
    client.does("t 90", 4.0, "OK");
    client.does("Mark a", 0.2, "Marked a");
    client.does(&format!("m {LENGTH} 0.5"), 4.0, "OK");
    if corrected {
        client.does(
            "ObservePos 3.1 1.3 91 1e-4 0 0 1e-4 0 0.04",
            0.2,
            "Observed",
        );
    }
    client.run(9.0);
    client.does("Mark b", 0.2, "Marked b");
    let map = client.say("GetMap", 0.5);
    let arc = map.iter().rfind(|row| row.starts_with("~ arc")).unwrap();
    let words: Vec<f64> = arc
        .split(' ')
        .skip(10)
        .map(|w| w.parse().unwrap())
        .collect();
    words.try_into().unwrap()
}

#[test]
fn a_straight_stretch_has_the_closed_forms() {
    // κ_drift, K_drift, κ_S: the defaults.
    let (kappa, system, along) = (0.01, 0.04, 5e-6);
    let [x, y, theta, xx, xy, xt, yy, yt, tt] = drive(false);
    let l = LENGTH;
    let radian = 180.0 / std::f64::consts::PI;
    let near = |is: f64, wanted: f64| (is - wanted).abs() < 0.005 * wanted;
    assert!(
        (x - l).abs() < 2e-3 && y.abs() < 1e-3 && theta.abs() < 1e-2,
        "{x} {y} {theta}"
    );
    // Theory section 3: random κL, κL²/2, κL³/3; systematic K L², K L³/2, K L⁴/4. Half a percent: windows of 5 mm, and the last millimetre.
    assert!(near(tt, kappa * l + system * l * l), "{tt}");
    let cross = kappa * l * l / 2.0 + system * l.powi(3) / 2.0;
    assert!(near(yt, cross / radian), "{yt}");
    let square = kappa * l.powi(3) / 3.0 + system * l.powi(4) / 4.0;
    assert!(near(yy, square / radian / radian), "{yy}");
    assert!(near(xx, along * l), "{xx}");
    assert!(xy.abs() < 1e-6 && xt.abs() < 1e-6);
}

#[test]
fn a_correction_on_the_way_changes_nothing_of_it() {
    let (without, with) = (drive(false), drive(true));
    for (a, b) in without.iter().zip(with) {
        // A correction turns the estimate, and the base holds its heading: the ways differ by the print's last digits.
        assert!(
            (a - b).abs() <= 2e-3 * a.abs() + 2e-6,
            "{without:?} {with:?}"
        );
    }
}
