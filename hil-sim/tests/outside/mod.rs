//! Robots of the presets whose motors have controllers of their own.

use hil_sim::robot::Robot;

/// A preset, and what its motors' controllers are set up with: units per metre, and how fast its drives are.
struct Setup {
    text: &'static str,
    units_per_metre: f64,
    top_speed: f64,
    bandwidth: f64,
    speed_gain: f64,
    integral_gain: f64,
    position_gain: f64,
}

/// A unit is a count of the encoder; full duty is worth the speed that the full battery gives a motor without load.
const DEFAULT: Setup = Setup {
    text: include_str!("../../robots/default.toml"),
    units_per_metre: 10_598.2,
    top_speed: 9_900.0,
    bandwidth: 100.0,
    speed_gain: 2.0,
    integral_gain: 15.0,
    position_gain: 20.0,
};
const TRICYCLE: Setup = Setup {
    text: include_str!("../../robots/tricycle.toml"),
    units_per_metre: 7_835.3,
    top_speed: 5_600.0,
    ..DEFAULT
};
const SYNCHRO: Setup = Setup {
    text: include_str!("../../robots/synchro.toml"),
    units_per_metre: 13_525.0,
    top_speed: 9_700.0,
    ..DEFAULT
};
const CYCAB: Setup = Setup {
    text: include_str!("../../robots/cycab.toml"),
    units_per_metre: 3_259.5,
    top_speed: 8_900.0,
    bandwidth: 100.0,
    speed_gain: 8.0,
    integral_gain: 30.0,
    position_gain: 15.0,
};

/// A robot with this kind of drives, `speed` or `increment`.
pub fn robot(preset: &str, drive: &str) -> Robot {
    let setup = match preset {
        "default" => DEFAULT,
        "tricycle" => TRICYCLE,
        "synchro" => SYNCHRO,
        "cycab" => CYCAB,
        other => return Robot::load(other).unwrap(),
    };
    if drive == "bridge" {
        return Robot::load(preset).unwrap();
    }
    let units = setup.units_per_metre;
    let text = setup.text.replacen(
        "model = \"dynamic\"",
        &format!("model = \"dynamic\"\ndrive = \"{drive}\""),
        1,
    );
    let text = format!(
        "{text}\n[controller]\nunits_per_metre = [{units:?}, {units:?}]\ntimeout = 0.1\nbandwidth = {:?}\ntop_speed = {:?}\n\
         speed_gain = {:?}\nintegral_gain = {:?}\nposition_gain = {:?}\ndead_zone = 1.0\n",
        setup.bandwidth,
        setup.top_speed,
        setup.speed_gain,
        setup.integral_gain,
        setup.position_gain
    );
    Robot::parse(&text, preset).unwrap()
}
